"""Writes what a driver does, a minute a file, and how quick it was."""

from __future__ import annotations

from typing import Any, final

import numpy as np

from zfcal.artifacts.drive_files import DriveWriter
from zfcal.artifacts.lineage import Lineage
from zfcal.online.events import Made, Tell
from zfcal.trial import Trial
from zfcal.units import SEGMENT_S

TICK_TO_BYTE, POSE_TO_STATE = "tick_to_byte_s", "pose_to_state_s"


@final
class DriveLog:
    """The log of one run.

    Parameters
    ----------
    trial
        Where it goes.
    lineage
        Where it comes from.
    tell
        Hears of every file, when it is closed.
    """

    def __init__(self, trial: Trial, lineage: Lineage, tell: Tell) -> None:
        self._trial = trial
        self._lineage = lineage
        self._tell = tell
        self._writer: DriveWriter | None = None
        self._start_s = -1
        self._taken: dict[str, list[float]] = {TICK_TO_BYTE: [], POSE_TO_STATE: []}
        self.n_ticks_skipped = 0
        self.n_steps_missed = 0

    def add(self, item: dict[str, Any]) -> None:
        """Take a message, into the file of its minute."""
        start_s = int((item["time_s"] + 1e-6) // SEGMENT_S * SEGMENT_S)
        # A pose may be a little older than the tick before it: files do not go back.
        if self._writer is None or start_s > self._start_s:
            self._close_file()
            path = self._trial.path("drive", start_s, ".mcap")
            self._writer, self._start_s = DriveWriter(path, self._lineage), start_s
        self._writer.add(item)

    def flush(self) -> None:
        """Hand over what was added."""
        if self._writer is not None:
            self._writer.flush()

    def measure(self, what: str, seconds: float) -> None:
        """Note a latency."""
        self._taken[what].append(seconds)

    def latencies(self) -> dict[str, Any]:
        """Return number, median, 95th percentile and largest of each latency, in seconds."""
        found: dict[str, Any] = {
            "ticks_skipped": self.n_ticks_skipped,
            "steps_missed": self.n_steps_missed,
        }
        for name, values in self._taken.items():
            if values:
                median, p95, most = np.quantile(values, [0.5, 0.95, 1.0])
                found[name] = {
                    "n": len(values),
                    "median": round(float(median), 6),
                    "p95": round(float(p95), 6),
                    "max": round(float(most), 6),
                }
        return found

    def close(self) -> None:
        """Close the last file; it says how quick the driver was so far."""
        self._close_file()

    def _close_file(self) -> None:
        if self._writer is None:
            return
        flat: dict[str, str] = {}
        for name, value in self.latencies().items():
            if isinstance(value, dict):
                flat |= {f"{name}.{key}": str(number) for key, number in value.items()}
            else:
                flat[name] = str(value)
        self._writer.close(flat)
        self._tell(Made(path=self._writer.path, reason="driven"))
        self._writer = None

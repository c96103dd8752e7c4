"""Writes what a driver does, a minute a file, and how quick it was."""

from __future__ import annotations

import dataclasses
import threading
import time
from collections.abc import Iterable
from itertools import takewhile
from queue import SimpleQueue
from typing import Any, final

import numpy as np

from zfcal.artifacts.drive_files import DriveWriter
from zfcal.artifacts.lineage import Lineage
from zfcal.errors import StorageError
from zfcal.stages.events import Made, Note, Tell
from zfcal.trial import Trial
from zfcal.units import SEGMENT_S

TICK_TO_BYTE, POSE_TO_STATE = "tick_to_byte_s", "pose_to_state_s"

_LATELY = 300
"""Measurements: half a minute of ticks."""

_RETRY_S = 1.0
_MOST_KEPT = 60_000
"""Messages that wait for the disk: half an hour at 15 Hz, some 50 MB."""


@final
class DriveLog:
    """The log of one run.

    Parameters
    ----------
    trial
        Where it goes.
    lineage
        Where it comes from. The model by which a file begins is an input of that file, too.
    tell
        Hears of every file, when it is closed.
    is_patient
        Whether a disk that cannot be written is waited for: messages are kept meanwhile,
        and written when it can. Who drives a robot does not let go of it for a full disk.
    """

    def __init__(
        self, trial: Trial, lineage: Lineage, tell: Tell, *, is_patient: bool = False
    ) -> None:
        self._trial = trial
        self._lineage = lineage
        self._tell = tell
        self._is_patient = is_patient
        self._added: SimpleQueue[dict[str, Any]] = SimpleQueue()
        self._kept: list[dict[str, Any]] = []
        self._scribe: threading.Thread | None = None
        self._wanted = threading.Event()
        self._ends = False
        self._problem: StorageError | None = None
        self._failed = False
        self._retry_s = 0.0
        self._writer: DriveWriter | None = None
        self._start_s = -1
        self._is_open = False
        self._of_file = lineage
        self._model: dict[str, str] = {}
        self._taken: dict[str, list[float]] = {TICK_TO_BYTE: [], POSE_TO_STATE: []}
        self.n_ticks_skipped = 0
        self.n_steps_missed = 0

    @staticmethod
    def warm_up() -> None:
        """Work out a quantile: the first one takes 50 ms."""
        np.quantile([0.0, 1.0], 0.95)

    def add(self, item: dict[str, Any]) -> None:
        """Take a message, for the file of its minute; the next `flush` writes it."""
        self._added.put(item)

    def write_behind(self) -> None:
        """Write from a thread of its own from now on: nobody waits for a disk that is busy."""
        self._scribe = threading.Thread(target=self._write_on, daemon=True)
        self._scribe.start()

    def flush(self) -> None:
        """Write what was added, or have it written.

        Raises
        ------
        StorageError
            The place cannot be written, and it is not waited for, or not any longer.
        """
        if self._scribe is None:
            self._flush()
            return
        if self._problem is not None:
            raise self._problem
        if self._failed or not self._added.empty():
            self._wanted.set()

    def _write_on(self) -> None:
        while not self._ends:
            self._wanted.wait()
            self._wanted.clear()
            try:
                self._flush()
            except StorageError as error:
                self._problem = error
                return

    def _flush(self) -> None:
        while not self._added.empty():
            self._kept.append(self._added.get())
        if self._failed and time.monotonic() < self._retry_s:
            return
        try:
            self._write()
        except StorageError as error:
            self._fail(error)
        else:
            self._recover()

    def _write(self) -> None:
        while self._kept:
            minute = _minute_of(self._kept[0])
            # A pose may be a little older than the tick before it: files do not go back.
            if not self._is_open or minute > self._start_s:
                self._close_file()
                self._start_s, self._is_open = max(minute, self._start_s), True
                self._of_file = self._lineage_of_file()
            writer = self._taken_up()
            own = list(takewhile(lambda item: _minute_of(item) <= self._start_s, self._kept))
            for item in own:
                writer.add(item)
            writer.flush()
            del self._kept[: len(own)]
            self._model = _model_in(reversed(own)) or self._model

    def _lineage_of_file(self) -> Lineage:
        """Return where the file that begins now comes from; later models stand in the log itself.

        Poses grow while they are read: they have no hash yet.
        """
        model = _model_in(self._kept[:1]) or self._model or _model_in(self._kept)
        return dataclasses.replace(self._lineage, inputs={**self._lineage.inputs, **model})

    def _taken_up(self) -> DriveWriter:
        """Return the writer of the file that is open; after a failure it goes on in it."""
        if self._writer is None:
            path = self._trial.path("drive", self._start_s, ".mcap")
            self._writer = DriveWriter(path, self._of_file)
        return self._writer

    def _fail(self, error: StorageError) -> None:
        if self._writer is not None:
            self._writer.abandon()
            self._writer = None
        if not self._is_patient or len(self._kept) > _MOST_KEPT:
            raise error
        self._retry_s = time.monotonic() + _RETRY_S
        if not self._failed:
            self._failed = True
            self._fault(f"{error} It is kept until it can be; the robot is driven on.")

    def _recover(self) -> None:
        if self._failed:
            self._failed = False
            self._fault("The log can be written again, and lacks nothing.", ended=True)

    def _fault(self, says: str, *, ended: bool = False) -> None:
        time_s = self._kept[-1]["time_s"] if self._kept else float(self._start_s)
        item = {"what": "fault", "time_s": time_s, "fault": "log", "says": says, "ended": ended}
        self._kept.append(item)
        values = {"time_s": time_s, "fault": "log", "ended": ended}
        self._tell(Note(text=says, warning=not ended, kind="fault", values=values))

    def measure(self, what: str, seconds: float) -> None:
        """Note a latency."""
        self._taken[what].append(seconds)

    def lately(self, what: str) -> float | None:
        """Return the 95th percentile of the newest measurements of a latency; None without any."""
        values = self._taken[what][-_LATELY:]
        return float(np.quantile(values, 0.95)) if values else None

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
        """Write what is left and close the last file; it says how quick the driver was so far.

        Raises
        ------
        StorageError
            The place cannot be written; there is nothing more to wait for.
        """
        if self._scribe is not None:
            self._ends = True
            self._wanted.set()
            self._scribe.join()
            self._scribe = None
        self._is_patient, self._retry_s = False, 0.0
        self._flush()
        self._close_file()

    def _close_file(self) -> None:
        if not self._is_open:
            return
        writer = self._taken_up()
        flat: dict[str, str] = {}
        for name, value in self.latencies().items():
            if isinstance(value, dict):
                flat |= {f"{name}.{key}": str(number) for key, number in value.items()}
            else:
                flat[name] = str(value)
        writer.close(flat)
        self._tell(Made(path=writer.path, reason="driven"))
        self._writer, self._is_open = None, False


def _minute_of(item: dict[str, Any]) -> int:
    return int((item["time_s"] + 1e-6) // SEGMENT_S * SEGMENT_S)


def _model_in(items: Iterable[dict[str, Any]]) -> dict[str, str]:
    """Return the hash of the first model among messages, by its name; empty for none."""
    found = next((item for item in items if item["what"] == "model"), None)
    return {} if found is None else {found["model"]: found["sha256"]}

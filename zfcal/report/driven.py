"""How quick the robot was driven, from what a drive says of itself when it is closed.

A file that still grows says nothing yet: it is no part of a report.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from zfcal.artifacts.drive_files import LATENCY_KEY, drive_files
from zfcal.artifacts.mcap_files import read_metadata
from zfcal.errors import DamagedError, InputError


@dataclass(frozen=True, slots=True, kw_only=True)
class Latency:
    """A latency of one drive, in seconds; NaN where it was not measured.

    Parameters
    ----------
    median_s, p95_s, most_s
        Over the drive.
    """

    median_s: float = math.nan
    p95_s: float = math.nan
    most_s: float = math.nan


@dataclass(frozen=True, slots=True, kw_only=True)
class Driven:
    """How quick one drive was.

    Parameters
    ----------
    start_s
        Second of the trial at which its file starts.
    seeing
        From the writing of a frame to the driver's own state.
    sending
        From a tick to the return of the write of its last byte.
    steps_missed, ticks_skipped
        How many.
    """

    start_s: int
    seeing: Latency
    sending: Latency
    steps_missed: int
    ticks_skipped: int


def closed_drives(root: Path) -> dict[int, Path]:
    """Return the files of a trial's drives that are closed, by the second at which they start."""
    return {start_s: path for start_s, path in drive_files(root).items() if _is_closed(path)}


def driven_of(start_s: int, path: Path) -> Driven | None:
    """Return how quick a drive was; None where its file does not say.

    Raises
    ------
    InputError
        It cannot be opened.
    DamagedError
        It is damaged before it says so.
    """
    said = read_metadata(path, LATENCY_KEY)
    if said is None:
        return None
    return Driven(
        start_s=start_s,
        seeing=_latency(said, "pose_to_state_s"),
        sending=_latency(said, "tick_to_byte_s"),
        steps_missed=int(_number(said, "steps_missed", 0.0)),
        ticks_skipped=int(_number(said, "ticks_skipped", 0.0)),
    )


def driven_rows(driven: tuple[Driven, ...]) -> Iterator[list[str]]:
    """Yield the cells of a table, a row for each drive; latencies in milliseconds."""
    for each in driven:
        cells = [
            "–" if math.isnan(value) else f"{1e3 * value:.1f}"
            for latency in (each.seeing, each.sending)
            for value in (latency.median_s, latency.p95_s, latency.most_s)
        ]
        yield [str(each.start_s), *cells, str(each.steps_missed), str(each.ticks_skipped)]


def _is_closed(path: Path) -> bool:
    try:
        return read_metadata(path, LATENCY_KEY) is not None
    except (DamagedError, InputError, OSError):
        return False


def _latency(said: Mapping[str, str], name: str) -> Latency:
    return Latency(
        median_s=_number(said, f"{name}.median"),
        p95_s=_number(said, f"{name}.p95"),
        most_s=_number(said, f"{name}.max"),
    )


def _number(said: Mapping[str, str], key: str, missing: float = math.nan) -> float:
    try:
        found = float(said[key])
    except (KeyError, ValueError):
        return missing
    return found if math.isfinite(found) else missing

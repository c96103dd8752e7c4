"""Whether poses can come at all to a trial: a drive without any ends only where none can."""

from __future__ import annotations

from pathlib import Path

from zfcal.artifacts.lineage import read_lineage
from zfcal.artifacts.lock import is_locked
from zfcal.artifacts.segments import segment_path, segment_starts
from zfcal.errors import ZfcalError
from zfcal.stages.recording import has_ended, starts_between, stretch_of

_WITHOUT_TRACKER = {"import", "simulate"}
"""Commands whose tracks no tracker goes on with."""

_TRACKERS = ("track", "watch-track", "watch-analyse", "watch-calibrate")
"""Names of the locks of a tracker, and of a watch, which belongs to an experiment that goes on."""


def can_no_tracker_come(root: Path) -> bool:
    """Return whether a trial's tracks are whole and of no tracker, and none is at work.

    In doubt one can: tracks that cannot be read say nothing, and the end of tracks that an earlier
    tracker closed is no end of the experiment.

    Parameters
    ----------
    root
        The trial's directory.
    """
    try:
        starts = segment_starts(root)
        return bool(starts) and _is_whole_without_tracker(root, max(starts))
    except (ZfcalError, OSError, ValueError):
        return False


def _is_whole_without_tracker(root: Path, start: int) -> bool:
    last = segment_path(root, start)
    if read_lineage(last).command not in _WITHOUT_TRACKER:
        return False
    stretch = stretch_of(last)
    if stretch is None or starts_between(*stretch)[-1] != start:
        return False
    folder, written_s = root / "poses", last.stat().st_mtime
    paths = list(folder.iterdir()) if folder.is_dir() else []
    if any(path.lstat().st_mtime > written_s for path in paths):
        return False
    return not any(is_locked(root, command) for command in _TRACKERS)


def is_recorded(root: Path) -> bool:
    """Return whether a recording is there to its end, for the poses' clock; in doubt it is not.

    Parameters
    ----------
    root
        The trial's directory.
    """
    try:
        return has_ended(root, segment_starts(root))
    except (ZfcalError, OSError, ValueError):
        return False

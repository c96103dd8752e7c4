"""Which trial, and which windows of it, a path speaks of.

So a command can work on each artifact as its path comes through a pipe. What
the commands then do with it is in the stages.
"""

from __future__ import annotations

import difflib
from dataclasses import dataclass
from pathlib import Path

from zfcal.artifacts.settings import find_trial
from zfcal.errors import InputError
from zfcal.trial import CONFIG_NAME, second_of
from zfcal.units import SEGMENT_S

_ENDS_AFTER_S = {"tracks": (int(SEGMENT_S), 2 * int(SEGMENT_S)), "stats": (0,), "scores": (0,)}
"""By folder, what to add to the number of a file to get the ends of its windows."""


_BESIDE = "-following.parquet"
"""What stands beside the statistics of a window, and is of no other."""

_MOST_NAMED = 8
"""Files and folders that a hint names."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Work:
    """A part of a trial to work on.

    Parameters
    ----------
    root
        The trial's directory.
    ends_s
        Ends of the windows concerned, in seconds since trial start; None for all.
    """

    root: Path
    ends_s: frozenset[int] | None = None


def work_of(path: Path) -> Work:
    """Return the trial that a path lies in, and the windows that it bears on.

    Parameters
    ----------
    path
        A trial, or any file of one. A track segment bears on the two windows
        that hold it, statistics on their own window, poses and camera images on
        none, anything else on all.

    Raises
    ------
    InputError
        The path lies in no trial.
    """
    root = _root_of(path)
    if path.suffix == ".mcap":
        # What is counted comes from the segments, whose paths come as well.
        return Work(root=root, ends_s=frozenset())
    beside = path.parent.name == "stats" and path.name.endswith(_BESIDE)
    second = second_of(path, _BESIDE) if beside else second_of(path)
    after_s = _ENDS_AFTER_S.get(path.parent.name)
    if second is None or after_s is None:
        return Work(root=root)
    return Work(root=root, ends_s=frozenset(second + add_s for add_s in after_s))


def work_at(path: Path) -> Work:
    """Return what `work_of` does, for a path that a person has typed.

    Raises
    ------
    InputError
        It is not there, or lies in no trial. What came through a pipe may be gone
        again; a slip of the pen in a trial must not set all of it to work.
    """
    work = work_of(path)
    if not path.exists():
        folder = next(parent for parent in path.parents if parent.is_dir())
        names = sorted(part.name for part in folder.iterdir() if not part.name.startswith("."))
        more = f" and {len(names) - _MOST_NAMED} more" if len(names) > _MOST_NAMED else ""
        near = difflib.get_close_matches(path.name, names, n=1)
        meant = f"Did you mean {folder / near[0]}? " if near else ""
        raise InputError(
            f"{path}: no such file or folder in the trial {work.root}.",
            hint=f"{meant}{folder} holds {', '.join(names[:_MOST_NAMED]) or 'nothing'}{more}.",
        )
    return work


def _root_of(path: Path) -> Path:
    """Return the trial as the path names it: relative where the path is."""
    named = (folder for folder in (path, *path.parents) if (folder / CONFIG_NAME).is_file())
    return next(named, None) or find_trial(path)

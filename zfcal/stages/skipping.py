"""Rounds that were passed over: written down, so that every later run goes the same way.

A model starts from the population of the round before. Had a round been left out
without a record, a later run would make it, and all that follow would change.
"""

from __future__ import annotations

import json
from pathlib import Path

from zfcal.artifacts.atomic import write_text_whole
from zfcal.artifacts.freshness import hash_inputs
from zfcal.artifacts.lineage import Lineage
from zfcal.artifacts.reading.contents import numbered_of
from zfcal.artifacts.reading.places import is_regular
from zfcal.stages.events import Note, Tell
from zfcal.stages.trial_context import Task

_SKIPPED = "zfcal.skipped/1"
_ENDING = ".skipped.json"


def skipped_path(root: Path, end_s: int) -> Path:
    """Return where it stands that a window has no model."""
    return root / "models" / f"{end_s:06d}{_ENDING}"


def skipped_ends(root: Path) -> set[int]:
    """Return the ends of the windows that were passed over, in seconds."""
    return {end for end, path in numbered_of(root / "models", _ENDING).items() if is_regular(path)}


def without_skipped(root: Path, ends: list[int], task: Task, tell: Tell) -> list[int]:
    """Return the windows to calibrate: those that were passed over only if they are forced.

    Parameters
    ----------
    root
        The trial's directory.
    ends
        Ends of windows, in seconds.
    task
        Which of them are asked for, and whether they are forced.
    tell
        Hears of those asked for that are left out.
    """
    skipped = {end for end in skipped_ends(root) if not (task.force and task.wants(end))}
    for end in sorted(skipped.intersection(ends)):
        if task.wants(end):
            text = f"{skipped_path(root, end)}: watch passed this window over; --force makes it."
            tell(Note(text=text))
    return [end for end in ends if end not in skipped]


def write_skipped(root: Path, end_s: int, *, went_on_with_s: int, because: str) -> Path:
    """Write down that a window was passed over, and return where.

    Parameters
    ----------
    root
        The trial's directory.
    end_s
        The window that gets no model.
    went_on_with_s
        The window that was calibrated instead.
    because
        Why, in a sentence.

    Raises
    ------
    StorageError
        The disk is full, or the place cannot be written.
    """
    stats = root / "stats" / f"{end_s:06d}.parquet"
    inputs = hash_inputs(root, [stats] if is_regular(stats) else [])
    origin = Lineage(schema=_SKIPPED, command="watch", inputs=inputs).as_dict()
    del origin["schema"]
    document = {
        "schema": _SKIPPED,
        "window_end_s": end_s,
        "went_on_with_s": went_on_with_s,
        "because": because,
        "lineage": origin,
    }
    path = skipped_path(root, end_s)
    text = json.dumps(document, indent=1, ensure_ascii=False) + "\n"
    write_text_whole(path, text, parents=False)
    return path

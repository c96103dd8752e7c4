"""Which windows a trial has: where they end, and which segments they need."""

from __future__ import annotations

from pathlib import Path

from zfcal.artifacts.segments import segment_starts
from zfcal.stages.events import Note, Tell
from zfcal.stages.segments import STEP_S, is_whole
from zfcal.trial import Trial
from zfcal.units import WINDOW_S

LENGTH_S = int(WINDOW_S)


def starts_of(end_s: int, *, length_s: int = LENGTH_S) -> range:
    """Return the starts of the segments that a window needs.

    >>> list(starts_of(180))
    [60, 120]
    """
    return range(end_s - length_s, end_s, STEP_S)


def window_ends(trial: Trial, tell: Tell, starts: list[int] | None = None) -> list[int]:
    """Return the seconds at which whole windows end, in order.

    No window ends in a last part segment, nor stretches over a missing one; the
    latter is told.

    Parameters
    ----------
    trial
        Whose.
    tell
        Hears of what is missing.
    starts
        Its whole segments, where they were looked up before: in a trial that grows,
        two looks do not find the same.
    """
    starts = whole_segments(trial) if starts is None else starts
    known = set(starts)
    if not starts:
        return []
    _tell_gaps(trial.root, starts, tell)
    ends = (start + STEP_S for start in starts)
    return [end for end in ends if end >= LENGTH_S and known.issuperset(starts_of(end))]


def whole_segments(trial: Trial) -> list[int]:
    """Return the starts of the segments that the recording filled to the end."""
    starts = segment_starts(trial.root)
    if starts and not is_whole(trial.root, starts[-1], fps=trial.fps):
        return starts[:-1]
    return starts


def _tell_gaps(root: Path, starts: list[int], tell: Tell) -> None:
    missing = sorted(set(range(starts[0], starts[-1], STEP_S)) - set(starts))
    if missing:
        names = ", ".join(f"{second:06d}.parquet" for second in missing[:3])
        more = f" and {len(missing) - 3} more" if len(missing) > 3 else ""
        tell(
            Note(
                text=f"{root / 'tracks'}: {names}{more} missing; windows that need them are "
                "left out.",
                warning=True,
            )
        )

"""A live recording that was interrupted goes on: its clock, its ids, its unfinished minute."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from zfcal.artifacts.atomic import remove
from zfcal.artifacts.lineage import JSON
from zfcal.artifacts.pose_files import read_clock
from zfcal.artifacts.segments import segment_path, segment_starts
from zfcal.errors import DamagedError, InputError
from zfcal.stages.events import Note, Tell
from zfcal.stages.segments import STEP_S
from zfcal.stages.taken import unless_taken
from zfcal.stages.track.learnt import learnt_before
from zfcal.stages.track.minutes import Minutes, next_agent_of, pose_files, unfinished
from zfcal.tracks import FramePoses

STARTED = "started_unix_s"


@dataclass(frozen=True, slots=True, kw_only=True)
class Resumed:
    """What is there of a live recording.

    Parameters
    ----------
    started_unix_s
        When it began; None for one that begins now.
    minutes
        Frames of the minutes that have poses and are not closed, by their start.
    next_agent
        The first agent id that is free.
    learnt
        What was known of the animals, as a closed segment has it; None for nothing.
    """

    started_unix_s: float | None = None
    minutes: dict[int, list[FramePoses]] | None = None
    next_agent: int = 0
    learnt: Mapping[str, JSON] | None = None

    @property
    def last(self) -> tuple[int, float] | None:
        """Number and time of the last frame of the unfinished minutes."""
        frames = [poses for part in (self.minutes or {}).values() for poses in part]
        return (frames[-1].frame, frames[-1].time_s) if frames else None


def resume(root: Path, tell: Tell) -> Resumed:
    """Return what is there of a live recording, maybe nothing."""
    started_s = _started(root)
    if started_s is None:
        return Resumed()
    now_s = int((time.time() - started_s) // STEP_S) * STEP_S
    minutes = unfinished(root, tell, also=now_s)
    frames = [poses for part in minutes.values() for poses in part]
    since = time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(started_s))
    tell(
        Note(
            text=f"{root}: goes on with the recording that began at {since}; --force begins again."
        )
    )
    return Resumed(
        started_unix_s=started_s,
        minutes=minutes,
        next_agent=next_agent_of(root, frames),
        learnt=learnt_before(root),
    )


def take_up(resumed: Resumed, minutes: Minutes) -> None:
    """Close the minutes that have passed, and go on with the one that is passing."""
    for start_s, frames in (resumed.minutes or {}).items():
        if frames:
            minutes.take_up(start_s, frames, next_agent=resumed.next_agent)


def begin_anew(root: Path, tell: Tell) -> None:
    """Remove what an earlier live recording left in a trial."""
    gone = [segment_path(root, start) for start in segment_starts(root)]
    gone += pose_files(root).values()
    gone += sorted(root.glob("frames/*/*.mcap"))
    for path in gone:
        with unless_taken(path, tell):
            remove(path)
    if gone:
        tell(Note(text=f"{root}: {len(gone)} files of an earlier recording were removed."))


def _started(root: Path) -> float | None:
    for path in pose_files(root).values():
        try:
            said = (read_clock(path) or {}).get(STARTED)
        except (DamagedError, InputError):
            continue
        if said is not None:
            return float(said)
    return None

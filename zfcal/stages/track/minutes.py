"""Closes a minute of tracks as soon as it has passed, while the poses grow frame by frame."""

from __future__ import annotations

import contextlib
from collections import defaultdict
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeAlias, final

from zfcal.artifacts.freshness import stale_reason
from zfcal.artifacts.lineage import JSON, Lineage
from zfcal.artifacts.mcap_files import has_footer
from zfcal.artifacts.pose_files import PoseWriter, read_poses
from zfcal.artifacts.reading.contents import check_contents, numbered_of
from zfcal.artifacts.segments import segment_path, segment_starts
from zfcal.artifacts.tables import read_extra, read_tracks, write_tracks
from zfcal.errors import DamagedError, InputError
from zfcal.stages.events import LeftOut, Made, Tell, UpToDate
from zfcal.stages.recording import STRETCH_KEY, remove_surplus
from zfcal.stages.segments import END_KEY, STEP_S
from zfcal.stages.taken import unless_taken
from zfcal.stages.trial_context import OpenTrial, Task, reason_to_make
from zfcal.tracks import FramePoses, Tracks, tracks_of

_BAD_KEY = "bad_frames"
"""Extra metadata of a segment: frame numbers by what was wrong with them."""

NEXT_KEY = "next_agent"
"""Extra metadata of a segment: the first agent id that is free after it."""

_SLACK_S = 1e-6

Revise: TypeAlias = Callable[[list[FramePoses]], list[FramePoses]]
"""Returns a minute's frames as they are known at its end."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Origins:
    """Where the artifacts of a run come from.

    Parameters
    ----------
    tracks, poses
        The lineage of segments and of files of poses.
    is_live
        Whether the frames never come again: then nothing is up to date, and a run
        that is interrupted keeps what it has.
    clock
        Tells when a live recording began, for the files of poses.
    """

    tracks: Lineage
    poses: Lineage
    is_live: bool
    clock: Callable[[], Mapping[str, str]] | None = None


@dataclass(slots=True, kw_only=True)
class _Minute:
    start_s: int
    writer: PoseWriter | None = None
    has_poses: bool = True
    next_agent: int = 0
    frames: list[FramePoses] = field(default_factory=list)
    bad: dict[str, list[int]] = field(default_factory=lambda: defaultdict(list))


@final
class Minutes:
    """Writes ``poses/`` and ``tracks/`` of a trial from frames in order.

    Parameters
    ----------
    opened
        The trial.
    origins
        Where they come from.
    measure
        Returns what is to be known of a segment's tracks, such as their noise.
    revise
        Returns a minute's frames as they are known at its end; asked of each minute, in order.
    tell
        Hears of every file, when it is closed.
    task
        Whether to make everything again.
    """

    def __init__(  # noqa: PLR0913 - one keyword for each of its surroundings
        self,
        opened: OpenTrial,
        origins: Origins,
        measure: Callable[[Tracks], Mapping[str, JSON]],
        tell: Tell,
        *,
        task: Task,
        revise: Revise = list,
    ) -> None:
        self._opened = opened
        self._origins = origins
        self._revise = revise
        self._measure = measure
        self._tell = tell
        self._task = task
        self._minute: _Minute | None = None
        self._passed: _Minute | None = None
        self._first_s: float | None = None
        self._seen: set[int] = set()

    def add(
        self,
        poses: FramePoses,
        *,
        next_agent: int,
        bad: tuple[str, ...] = (),
        is_urgent: bool = False,
    ) -> None:
        """Take the next frame; of the minute before, all files are closed first.

        Parameters
        ----------
        poses
            Who is where.
        next_agent
            The first id that is free.
        bad
            What was wrong with the frame, in words such as ``few``.
        is_urgent
            Whether the poses are written first, and the minute before waits for `close_passed`.
        """
        start_s = int((poses.time_s + _SLACK_S) // STEP_S) * STEP_S
        if self._minute is not None and self._minute.start_s != start_s:
            self.close_passed()
            self._passed, self._minute = self._minute, None
            if not is_urgent:
                self.close_passed()
        if self._minute is None:
            self._minute = self._begun(start_s)
        minute = self._minute
        if minute.writer is not None:
            minute.writer.add(poses)
        minute.frames.append(poses)
        for word in bad:
            minute.bad[word].append(poses.frame)
        self._first_s = poses.time_s if self._first_s is None else self._first_s
        minute.next_agent = next_agent

    def close_passed(self) -> None:
        """Close the files of the minute that has passed, where there is one.

        That takes as long as some frames: the poses of the next frame are written before.
        """
        if self._passed is not None:
            passed, self._passed = self._passed, None
            self._close(passed, passed.start_s + STEP_S)

    def take_up(self, start_s: int, frames: list[FramePoses], *, next_agent: int) -> None:
        """Go on with a minute that was interrupted: its frames are written anew, then more."""
        self.close_passed()
        if self._minute is not None:
            self._close(self._minute, self._minute.start_s + STEP_S)
        path = _poses_path(self._opened.trial.root, start_s)
        part = path.with_name(f".{path.name}.taken-up")
        writer = PoseWriter(
            part, self._origins.poses, arena=self._opened.arena, clock=self._clock()
        )
        for poses in frames:
            writer.add(poses)
        writer.move_to(path)
        self._minute = _Minute(
            start_s=start_s, writer=writer, next_agent=next_agent, frames=list(frames)
        )

    def finish(self, end_s: float) -> None:
        """Close the last minute, which may be a part, and remove what an earlier run left.

        Parameters
        ----------
        end_s
            The second up to which the recording went.
        """
        self.close_passed()
        if self._minute is not None:
            whole = [] if self._first_s is None else [self._first_s, end_s]
            self._close(self._minute, end_s, stretch=whole)
            self._minute = None
        if not self._origins.is_live:
            self._remove_others()

    def interrupt(self, end_s: float) -> None:
        """End early: what a camera gave is kept, what can be read again stays unfinished."""
        self.close_passed()
        if self._minute is None:
            return
        minute, self._minute = self._minute, None
        if self._origins.is_live:
            self._close(minute, end_s)
        elif minute.writer is not None:
            minute.writer.abandon()

    def _close(self, minute: _Minute, end_s: float, *, stretch: list[float] | None = None) -> None:
        root = self._opened.trial.root
        # A file of poses that is closed counts as whole: it must be of what its lineage names.
        check_contents()
        if minute.writer is not None:
            minute.writer.close()
        self._seen.add(minute.start_s)
        frames = self._revise(minute.frames)
        path = segment_path(root, minute.start_s)
        reason = self._reason(path)
        if reason:
            tracks = tracks_of(frames)
            extra: dict[str, JSON] = {
                **self._measure(tracks),
                _BAD_KEY: dict(minute.bad),
                NEXT_KEY: minute.next_agent,
                END_KEY: min(float(end_s), float(minute.start_s + STEP_S)),
            }
            if stretch:
                extra[STRETCH_KEY] = list(stretch)
            with unless_taken(path, self._tell):
                write_tracks(path, tracks, self._origins.tracks, extra=extra)
                self._tell(Made(path=path, reason=reason))
        # After the tracks: who reads the paths finds the segment when it hears of the poses.
        if minute.writer is not None:
            self._tell(Made(path=minute.writer.path, reason="tracked"))
        elif minute.has_poses:
            self._tell(UpToDate(path=_poses_path(root, minute.start_s)))

    def _reason(self, path: Path) -> str | None:
        if self._origins.is_live:
            return "tracked"
        return reason_to_make(path, self._origins.tracks, self._task, self._tell)

    def _begun(self, start_s: int) -> _Minute:
        """Return a minute that begins; one for whose poses there is no place has tracks alone."""
        minute = _Minute(start_s=start_s, has_poses=False)
        with unless_taken(_poses_path(self._opened.trial.root, start_s), self._tell):
            minute.writer, minute.has_poses = self._pose_writer(start_s), True
        return minute

    def _pose_writer(self, start_s: int) -> PoseWriter | None:
        """Return what writes a minute's poses; None if they are there already."""
        path = _poses_path(self._opened.trial.root, start_s)
        fresh = (
            not self._origins.is_live
            and not self._task.force
            and poses_reason(path, self._origins.poses) is None
        )
        if fresh:
            return None
        return PoseWriter(path, self._origins.poses, arena=self._opened.arena, clock=self._clock())

    def _clock(self) -> Mapping[str, str] | None:
        return None if self._origins.clock is None else self._origins.clock()

    def _remove_others(self) -> None:
        """Remove what an earlier, longer run of the same recording left."""
        root = self._opened.trial.root
        gone = [segment_path(root, s) for s in set(segment_starts(root)) - self._seen]
        gone += [_poses_path(root, start) for start in set(pose_files(root)) - self._seen]
        remove_surplus(sorted(gone), self._tell, self._task)


def poses_reason(path: Path, lineage: Lineage) -> str | None:
    """Return why a file of poses is to be written; None if it is whole and up to date."""
    reason = stale_reason([path], lineage)
    if reason is None and not has_footer(path):
        return "was not closed"
    return reason


def _poses_path(root: Path, start_s: int) -> Path:
    return root / "poses" / f"{start_s:06d}.mcap"


def pose_files(root: Path) -> dict[int, Path]:
    """Return the files of poses of a trial by the second at which they start, in order."""
    return numbered_of(root / "poses", ".mcap")


def unfinished(root: Path, tell: Tell, *, also: int) -> dict[int, list[FramePoses]]:
    """Return the frames of minutes that have poses and no segment yet.

    Parameters
    ----------
    root
        The trial's directory.
    tell
        Hears of files that are damaged, once of each. What lies before the damage counts; a
        frame or an agent that is none is left out.
    also
        The minute that is passing, whose segment may be a part.
    """
    known = set(segment_starts(root)) - {also}
    found: dict[int, list[FramePoses]] = {}
    for start_s, path in pose_files(root).items():
        if start_s in known:
            continue
        frames: list[FramePoses] = []
        problems: list[DamagedError | InputError] = []
        try:
            for poses in read_poses(path, left_out=problems.append):
                frames.append(poses)  # noqa: PERF402 - those before the damage are kept
        except (DamagedError, InputError) as error:
            problems.append(error)
        for problem in problems[:1]:
            tell(LeftOut(path=path, problem=str(problem), hint=problem.hint))
        found[start_s] = frames
    return found


def next_agent_of(root: Path, frames: list[FramePoses]) -> int:
    """Return the first agent id that no segment of a trial, nor any of the frames, uses."""
    ids = [agent.agent + 1 for poses in frames for agent in poses.agents]
    for start_s in reversed(segment_starts(root)):
        path = segment_path(root, start_s)
        with contextlib.suppress(DamagedError, InputError):
            said = read_extra(path).get(NEXT_KEY)
            if isinstance(said, int):
                return max([said, *ids])
            ids.append(int(read_tracks(path).agent.max(initial=-1)) + 1)
    return max(ids, default=0)

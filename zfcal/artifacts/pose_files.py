"""``poses/NNNNNN.mcap``: where everybody is, a message per frame, flushed at once.

``/agents`` (``zfcal.poses/1``, JSON) is what zfcal reads back; ``/poses``
(``foxglove.PosesInFrame``) and ``/scene`` (``foxglove.SceneUpdate``) say the same to
viewers. Log times are seconds since the start of the trial.
"""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Self, final

from mcap.writer import Writer

from zfcal.arena import Arena
from zfcal.artifacts.atomic import storage_error
from zfcal.artifacts.lineage import LINEAGE_KEY, Lineage
from zfcal.artifacts.mcap_files import FRESH_S
from zfcal.artifacts.pose_messages import as_json, as_poses, as_scene, from_json, register
from zfcal.artifacts.reading.contents import Looks, looks_of, numbered_of
from zfcal.artifacts.reading.opening import open_to_write
from zfcal.artifacts.reading.places import check_inside
from zfcal.artifacts.tailing import Tail
from zfcal.errors import DamagedError, InputError
from zfcal.tracks import FramePoses
from zfcal.trial import second_of

LIBRARY = "zfcal"
_CLOCK_KEY = "zfcal.clock"
"""Metadata record of a live recording: when the trial began, in seconds since 1970."""

_AHEAD_S, _SILENT_S = 60.0, 5.0
"""A frame that is so far ahead of the clock is left out, unless none but such come for so long."""

_FILE, _FRAME, _AGENT = "file", "frame", "agent"
"""What may be bad: each is told once of a file."""


@final
class PoseWriter:
    """Writes one file of poses, closed by `close` or at the end of a ``with`` block.

    Parameters
    ----------
    path
        Where it goes; one that is there is written anew.
    lineage
        Where the poses come from.
    arena
        Drawn for viewers; None to do without.
    clock
        Further metadata of the file; None for a recording without a wall clock.

    Raises
    ------
    StorageError
        The place cannot be written, here or later.
    """

    def __init__(
        self,
        path: Path,
        lineage: Lineage,
        *,
        arena: Arena | None = None,
        clock: Mapping[str, str] | None = None,
    ) -> None:
        self.path = path
        self._arena = arena
        try:
            # Not the trial itself: one that was moved away must not come into being again.
            check_inside(path.parent)
            path.parent.mkdir(exist_ok=True)
            self._file = open_to_write(path)
            self._writer = Writer(self._file, chunk_size=2**22)
            self._writer.start(profile="", library=LIBRARY)
            self._writer.add_metadata(LINEAGE_KEY, lineage.as_text())
            if clock is not None:
                self._writer.add_metadata(_CLOCK_KEY, dict(clock))
            self._channels = register(self._writer)
            self._writer.flush()  # type: ignore[no-untyped-call]
        except OSError as error:
            raise storage_error(path, error) from error

    def add(self, poses: FramePoses) -> None:
        """Write the poses of a frame and hand them to the operating system."""
        time_ns = round(poses.time_s * 1e9)
        data = {
            "/poses": as_poses(poses, time_ns).SerializeToString(),
            "/agents": as_json(poses),
            "/scene": as_scene(poses, time_ns, self._arena).SerializeToString(),
        }
        # Viewers keep the walls: they are drawn once in a file.
        self._arena = None
        try:
            for topic, message in data.items():
                self._writer.add_message(self._channels[topic], time_ns, message, time_ns)
            self._writer.flush()  # type: ignore[no-untyped-call]
        except OSError as error:
            raise storage_error(self.path, error) from error

    def close(self) -> None:
        """Write the footer and close the file."""
        if self._file.closed:
            return
        try:
            self._writer.finish()  # type: ignore[no-untyped-call]
            self._file.close()
        except OSError as error:
            raise storage_error(self.path, error) from error

    def move_to(self, path: Path) -> None:
        """Give the file another name; it stays open."""
        try:
            self.path.replace(path)
        except OSError as error:
            raise storage_error(path, error) from error
        self.path = path

    def abandon(self) -> None:
        """Leave the file without a footer, as one that is not finished."""
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def read_poses(
    path: Path,
    *,
    left_out: Callable[[DamagedError], None] | None = None,
    cut: Callable[[DamagedError], None] | None = None,
) -> Iterator[FramePoses]:
    """Yield the poses of a file, in its order; of one that was cut short, those before the cut.

    Parameters
    ----------
    path
        The file.
    left_out
        Hears of each frame that is none, and of each agent whose pose is none; such are left
        out then, as a follower does.
    cut
        Hears how much is lost of a file that is not closed.

    Raises
    ------
    InputError
        It is missing or cannot be opened.
    DamagedError
        It is no file of poses, or a record is damaged.
    """
    if not os.path.lexists(path):
        raise InputError(f"{path}: no such file.", hint="Check the path, and where you stand.")
    tail = Tail(path, "/agents")
    for _, data in tail.messages():
        try:
            poses = from_json(path, data, absent=left_out)
        except DamagedError as error:
            if left_out is None:
                raise
            left_out(error)
        else:
            yield poses
    if cut is not None and tail.cut is not None:
        cut(tail.cut)


def read_clock(path: Path) -> dict[str, str] | None:
    """Return when a live recording began, as its file of poses states; None if it does not."""
    tail = Tail(path, "/agents")
    tail.poll()
    return tail.metadata.get(_CLOCK_KEY)


def _is_fresh(path: Path) -> bool:
    """Return whether a file was written to moments ago; false for one that is gone."""
    try:
        return time.time() - path.stat().st_mtime < FRESH_S
    except OSError:
        return False


@final
class PoseFollower:
    """Follows the poses of a trial while they are written, from minute to minute.

    Parameters
    ----------
    root
        The trial's directory.
    newest
        Whether to begin with the last file rather than the first.
    """

    def __init__(self, root: Path, *, newest: bool = False) -> None:
        self._folder = root / "poses"
        self._newest = newest
        self._tail: Tail | None = None
        self._known = -1
        self._bad: dict[Path, Looks | None] = {}
        self._told: set[tuple[Path, str]] = set()
        self._problems: list[DamagedError] = []
        self._clock = _Clock() if newest else None
        self._left: list[Tail] = []

    @property
    def path(self) -> Path | None:
        """The file that is followed; None before there is any."""
        return None if self._tail is None else self._tail.path

    @property
    def is_closed(self) -> bool:
        """Whether the file that is followed has its footer: only a later file can bring more."""
        return bool(self._bad) if self._tail is None else self._tail.is_closed

    def poll(self) -> list[FramePoses]:
        """Return the poses that were added since the last question, maybe none.

        Raises
        ------
        DamagedError
            A file cannot be read, or holds a frame or an agent that cannot be: told once of
            each. The next question goes on behind it.
        """
        found: list[FramePoses] = []
        while True:
            # Looked for before reading: what is added meanwhile is not passed over.
            later = self._later()
            if self._tail is not None:
                found += self._added(self._tail)
            if not any(self._begin(path, found) for path in later):
                break
        if self._problems and not found:
            raise self._problems.pop(0)
        return found

    def take_problems(self) -> list[DamagedError]:
        """Return what is wrong and was not told yet: where frames come all the time, in time."""
        found, self._problems = self._problems, []
        return found

    def cuts(self, *, is_over: bool) -> dict[Path, DamagedError]:
        """Return what is lost of files that were not closed, though none adds to them any more.

        A tracker closes a file just after it has begun the next: of one that was written to
        moments ago nothing is said before all is over. Who begins with the newest file follows a
        tracker, and is told of none.

        Parameters
        ----------
        is_over
            Whether nothing more is added to the file that is followed either.
        """
        found = {}
        for tail in [*self._left, *([self._tail] if is_over and self._tail else [])]:
            # One that is bad, or is gone by now, has been told.
            with contextlib.suppress(DamagedError, InputError):
                tail.poll()
            is_done = is_over or not _is_fresh(tail.path)
            if tail.cut is not None and is_done and (tail.path, _FILE) not in self._told:
                found[tail.path] = tail.cut
        return found

    def _begin(self, path: Path, found: list[FramePoses]) -> bool:
        """Go on with a later file, and return whether it has begun.

        A file of which nothing can be read does not take the place of one that may grow.
        """
        tail = Tail(path, "/agents")
        looks = looks_of(path)
        added = self._added(tail)
        if tail.is_begun:
            if self._tail is not None and not (self._newest or self._tail.is_closed):
                self._left.append(self._tail)
            self._tail, self._known = tail, second_of(path, ".mcap") or 0
            found += added
            return True
        if (path, _FILE) in self._told:
            self._bad[path] = looks
        return False

    def _added(self, tail: Tail) -> list[FramePoses]:
        """Return what a file gives; what is wrong with it is kept for the next question."""
        found = []
        try:
            for _, data in tail.messages():
                try:
                    found.append(self._checked(tail.path, data))
                except DamagedError as error:
                    self._note(tail.path, error, what=_FRAME)
        except (DamagedError, InputError) as error:
            self._note(tail.path, error)
        return found

    def _checked(self, path: Path, data: bytes) -> FramePoses:
        poses = from_json(path, data, absent=lambda error: self._note(path, error, what=_AGENT))
        if self._clock is not None and not self._clock.is_passing(poses.time_s):
            raise DamagedError(
                f"{path}: a frame of {poses.time_s:.3f} s runs ahead of the clock.",
                hint="Check the time stamps of the tracker that writes there.",
            )
        return poses

    def _note(self, path: Path, error: DamagedError | InputError, *, what: str = _FILE) -> None:
        """Keep what is wrong with a file, or in it, until it is asked; the first time only."""
        if (path, what) not in self._told:
            self._told.add((path, what))
            self._problems.append(DamagedError(str(error), hint=error.hint))

    def _later(self) -> list[Path]:
        """Return the files that may be read next, those to be tried first in front."""
        try:
            files = numbered_of(self._folder, ".mcap")
        except InputError as error:
            self._note(self._folder, error)
            return []
        later = [path for second, path in files.items() if self._is_later(second, path)]
        return later[::-1] if self._newest and self._tail is None else later

    def _is_later(self, second: int, path: Path) -> bool:
        if second <= self._known:
            return False
        # One that was bad is tried again when another one lies there.
        return path not in self._bad or self._bad[path] != looks_of(path)


@final
class _Clock:
    """Tells frames that come from those that claim a time which has not come yet."""

    def __init__(self) -> None:
        self._lead_s: float | None = None
        self._taken_s = 0.0

    def is_passing(self, time_s: float) -> bool:
        """Return whether a frame may be of now.

        Frames of the past may come at once; so may those of a time that is no more than
        `_AHEAD_S` ahead of how far the clock has gone since the frames before. Where for
        `_SILENT_S` no others come, the tracker has a new clock, and its frames are taken.
        """
        now_s = time.monotonic()
        lead_s = time_s - now_s
        ahead = self._lead_s is not None and lead_s > self._lead_s + _AHEAD_S
        if ahead and now_s - self._taken_s < _SILENT_S:
            return False
        # The lead that was furthest: a tracker may fall behind and catch up.
        self._lead_s = lead_s if self._lead_s is None or ahead else max(self._lead_s, lead_s)
        self._taken_s = now_s
        return True

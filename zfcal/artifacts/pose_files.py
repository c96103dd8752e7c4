"""``poses/NNNNNN.mcap``: where everybody is, a message per frame, flushed at once.

``/agents`` (``zfcal.poses/1``, JSON) is what zfcal reads back; ``/poses``
(``foxglove.PosesInFrame``) and ``/scene`` (``foxglove.SceneUpdate``) say the same to
viewers. Log times are seconds since the start of the trial.
"""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any, Self, final

from foxglove_schemas_protobuf.PosesInFrame_pb2 import PosesInFrame
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from mcap.writer import Writer
from mcap_protobuf.schema import register_schema

from zfcal.arena import Arena
from zfcal.artifacts.atomic import storage_error
from zfcal.artifacts.lineage import LINEAGE_KEY, Lineage, to_json
from zfcal.artifacts.parsing import json_of
from zfcal.artifacts.places import check_inside
from zfcal.artifacts.reading import Looks, looks_of, numbered_of, open_to_write
from zfcal.artifacts.tailing import Tail
from zfcal.errors import DamagedError, InputError
from zfcal.tracks import KINDS, ROBOT, AgentPose, FramePoses
from zfcal.trial import second_of
from zfcal.units import SEGMENT_S

POSES = "zfcal.poses/1"
LIBRARY = "zfcal"
CLOCK_KEY = "zfcal.clock"
"""Metadata record of a live recording: when the trial began, in seconds since 1970."""

_AHEAD_S, _SILENT_S = 60.0, 5.0
"""A frame that is so far ahead of the clock is left out, unless none but such come for so long."""

_EDGE_S = 1.0
"""A frame may lie so far outside the minute that its file's name states."""

_FARTHEST_M = 1000.0
_LARGEST_ID = 2**31 - 1
_MOST_AGENTS = 10_000

_FRAME_ID = "arena"
_FISH_COLOUR = (0.0, 0.45, 0.7, 1.0)
_ROBOT_COLOUR = (0.84, 0.37, 0.0, 1.0)
_WALL_COLOUR = (0.5, 0.5, 0.5, 1.0)
_BODY_M = 0.03


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
        Further metadata under `CLOCK_KEY`; None for a recording without a wall clock.

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
                self._writer.add_metadata(CLOCK_KEY, dict(clock))
            self._channels = _register(self._writer)
            self._writer.flush()  # type: ignore[no-untyped-call]
        except OSError as error:
            raise storage_error(path, error) from error

    def add(self, poses: FramePoses) -> None:
        """Write the poses of a frame and hand them to the operating system."""
        time_ns = round(poses.time_s * 1e9)
        data = {
            "/poses": _as_poses(poses, time_ns).SerializeToString(),
            "/agents": _as_json(poses),
            "/scene": _as_scene(poses, time_ns, self._arena).SerializeToString(),
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
    path: Path, *, left_out: Callable[[DamagedError], None] | None = None
) -> Iterator[FramePoses]:
    """Yield the poses of a file, in its order; of one that was cut short, those before the cut.

    Parameters
    ----------
    path
        The file.
    left_out
        Hears of each frame that is none; such are left out then, as a follower does.

    Raises
    ------
    InputError
        It is missing or cannot be opened.
    DamagedError
        It is no file of poses, or a record is damaged.
    """
    if not os.path.lexists(path):
        raise InputError(f"{path}: no such file.", hint="Check the path, and where you stand.")
    for _, data in Tail(path, "/agents").messages():
        try:
            poses = _from_json(path, data)
        except DamagedError as error:
            if left_out is None:
                raise
            left_out(error)
        else:
            yield poses


def read_clock(path: Path) -> dict[str, str] | None:
    """Return when a live recording began, as its file of poses states; None if it does not."""
    tail = Tail(path, "/agents")
    tail.poll()
    return tail.metadata.get(CLOCK_KEY)


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
        self._told: set[Path] = set()
        self._problems: list[DamagedError] = []
        self._clock = _Clock() if newest else None

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
            A file cannot be read, or holds what cannot be: told once of each. The next
            question goes on behind it.
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

    def _begin(self, path: Path, found: list[FramePoses]) -> bool:
        """Go on with a later file, and return whether it has begun.

        A file of which nothing can be read does not take the place of one that may grow.
        """
        tail = Tail(path, "/agents")
        looks = looks_of(path)
        added = self._added(tail)
        if tail.is_begun:
            self._tail, self._known = tail, second_of(path, ".mcap") or 0
            found += added
            return True
        if path in self._told:
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
                    self._note(tail.path, error)
        except (DamagedError, InputError) as error:
            self._note(tail.path, error)
        return found

    def _checked(self, path: Path, data: bytes) -> FramePoses:
        poses = _from_json(path, data)
        if self._clock is not None and not self._clock.is_passing(poses.time_s):
            raise DamagedError(
                f"{path}: a frame of {poses.time_s:.3f} s runs ahead of the clock.",
                hint="Check the time stamps of the tracker that writes there.",
            )
        return poses

    def _note(self, path: Path, error: DamagedError | InputError) -> None:
        """Keep what is wrong with a file until it is asked; the first time only."""
        if path not in self._told:
            self._told.add(path)
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


def _register(writer: Writer) -> dict[str, int]:
    agents = writer.register_schema(POSES, "jsonschema", _agents_schema())
    schemas = {
        "/poses": ("protobuf", register_schema(writer, PosesInFrame)),
        "/agents": ("json", agents),
        "/scene": ("protobuf", register_schema(writer, SceneUpdate)),
    }
    return {
        topic: writer.register_channel(topic, encoding, schema)
        for topic, (encoding, schema) in schemas.items()
    }


@cache
def _agents_schema() -> bytes:
    return (files("zfcal.schemas") / "poses.schema.json").read_bytes()


def _as_json(poses: FramePoses) -> bytes:
    agents = [
        {
            "agent": agent.agent,
            "kind": KINDS[agent.kind],
            "x_m": agent.x_m,
            "y_m": agent.y_m,
            "heading_rad": agent.heading_rad if math.isfinite(agent.heading_rad) else None,
            "confidence": agent.confidence,
        }
        for agent in poses.agents
    ]
    return to_json({"time_s": poses.time_s, "frame": poses.frame, "agents": agents}).encode()


def _from_json(path: Path, data: bytes) -> FramePoses:
    try:
        found = json_of(data)
        if len(found["agents"]) > _MOST_AGENTS:
            message = f"{len(found['agents'])} agents, expected at most {_MOST_AGENTS}"
            raise ValueError(message)  # noqa: TRY301 - becomes a DamagedError with the others
        agents = tuple(_as_agent(agent) for agent in found["agents"])
        time_s, frame = float(found["time_s"]), int(found["frame"])
        _check_frame(path, time_s, frame, agents)
    except (ValueError, KeyError, TypeError, AttributeError, OverflowError) as error:
        raise DamagedError(
            f"{path}: a message of /agents is not of {POSES} ({error!r:.200}).",
            hint="It was not made by zfcal, or by another version of it.",
        ) from error
    return FramePoses(time_s=time_s, frame=frame, agents=agents)


def _check_frame(path: Path, time_s: float, frame: int, agents: tuple[AgentPose, ...]) -> None:
    """Refuse what no tracker sees; each limit is written so that NaN fails.

    Raises
    ------
    ValueError
        A number is out of its range, or an agent is there twice.
    """
    start_s = second_of(path, ".mcap")
    low_s = 0.0 if start_s is None else start_s - _EDGE_S
    high_s = 1e9 if start_s is None else start_s + SEGMENT_S + _EDGE_S
    _check_range("time_s", time_s, low_s, high_s)
    _check_range("frame", frame, 0, 2**53)
    if len({agent.agent for agent in agents}) < len(agents):
        message = "an agent stands twice in a frame"
        raise ValueError(message)
    for agent in agents:
        _check_range("agent", agent.agent, 0, _LARGEST_ID)
        _check_range("x_m", agent.x_m, -_FARTHEST_M, _FARTHEST_M)
        _check_range("y_m", agent.y_m, -_FARTHEST_M, _FARTHEST_M)
        _check_range("confidence", agent.confidence, 0.0, 1.0)
        if not math.isnan(agent.heading_rad):
            _check_range("heading_rad", agent.heading_rad, -100.0, 100.0)


def _check_range(name: str, value: float, low: float, high: float) -> None:
    if not low <= value <= high:
        message = f"{name} is {value!r:.40}, expected {low:g} to {high:g}"
        raise ValueError(message)


def _as_agent(found: Mapping[str, Any]) -> AgentPose:
    heading = found.get("heading_rad")
    return AgentPose(
        agent=int(found["agent"]),
        kind=KINDS.index(found["kind"]),
        x_m=float(found["x_m"]),
        y_m=float(found["y_m"]),
        heading_rad=math.nan if heading is None else float(heading),
        confidence=float(found["confidence"]),
    )


def _as_poses(poses: FramePoses, time_ns: int) -> PosesInFrame:
    message = PosesInFrame(frame_id=_FRAME_ID)
    message.timestamp.FromNanoseconds(time_ns)
    for agent in poses.agents:
        _place(message.poses.add(), agent)
    return message


def _place(pose: Any, agent: AgentPose) -> None:
    heading = agent.heading_rad if math.isfinite(agent.heading_rad) else 0.0
    pose.position.x, pose.position.y = agent.x_m, agent.y_m
    pose.orientation.z, pose.orientation.w = math.sin(heading / 2), math.cos(heading / 2)


def _as_scene(poses: FramePoses, time_ns: int, arena: Arena | None) -> SceneUpdate:
    message = SceneUpdate()
    if arena is not None:
        walls = message.entities.add(id="arena", frame_id=_FRAME_ID)
        walls.timestamp.FromNanoseconds(time_ns)
        for ring in arena.rings_m:
            line = walls.lines.add(type=1, thickness=2.0, scale_invariant=True)
            line.pose.orientation.w = 1.0
            _paint(line.color, _WALL_COLOUR)
            for x, y in ring:
                line.points.add(x=float(x), y=float(y))
    agents = message.entities.add(id="agents", frame_id=_FRAME_ID)
    agents.timestamp.FromNanoseconds(time_ns)
    for agent in poses.agents:
        arrow = agents.arrows.add(
            shaft_length=_BODY_M / 2, shaft_diameter=0.006, head_length=_BODY_M / 2
        )
        arrow.head_diameter = 0.012
        _place(arrow.pose, agent)
        _paint(arrow.color, _ROBOT_COLOUR if agent.kind == ROBOT else _FISH_COLOUR)
    return message


def _paint(colour: Any, rgba: tuple[float, float, float, float]) -> None:
    colour.r, colour.g, colour.b, colour.a = rgba

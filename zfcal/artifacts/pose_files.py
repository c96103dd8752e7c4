"""``poses/NNNNNN.mcap``: where everybody is, a message per frame, flushed at once.

``/agents`` (``zfcal.poses/1``, JSON) is what zfcal reads back; ``/poses``
(``foxglove.PosesInFrame``) and ``/scene`` (``foxglove.SceneUpdate``) say the same to
viewers. Log times are seconds since the start of the trial.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
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
from zfcal.artifacts.tailing import Tail
from zfcal.errors import DamagedError, InputError
from zfcal.tracks import KINDS, ROBOT, AgentPose, FramePoses
from zfcal.trial import second_of

POSES = "zfcal.poses/1"
LIBRARY = "zfcal"
CLOCK_KEY = "zfcal.clock"
"""Metadata record of a live recording: when the trial began, in seconds since 1970."""

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
            path.parent.mkdir(exist_ok=True)
            self._file = path.open("wb")
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


def read_poses(path: Path) -> Iterator[FramePoses]:
    """Yield the poses of a file, in its order; of one that was cut short, those before the cut.

    Raises
    ------
    InputError
        It is missing or cannot be opened.
    DamagedError
        It is no file of poses, or a record is damaged.
    """
    if not path.exists():
        raise InputError(f"{path}: no such file.", hint="Check the path, and where you stand.")
    for _, data in Tail(path, "/agents").messages():
        yield _from_json(path, data)


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
        self._tail: Tail | None = None
        self._newest = newest

    @property
    def path(self) -> Path | None:
        """The file that is followed; None before there is any."""
        return None if self._tail is None else self._tail.path

    @property
    def is_closed(self) -> bool:
        """Whether the file that is followed has its footer: only a later file can bring more."""
        return self._tail is not None and self._tail.is_closed

    def poll(self) -> list[FramePoses]:
        """Return the poses that were added since the last question, maybe none.

        Raises
        ------
        DamagedError
            A record is damaged.
        """
        found: list[FramePoses] = []
        while True:
            # Looked for before reading: what is added meanwhile is not passed over.
            later = self._later()
            if self._tail is not None:
                found += self._added(self._tail, later)
            if later is None:
                return found
            self._tail = Tail(later, "/agents")

    def _added(self, tail: Tail, later: Path | None) -> list[FramePoses]:
        try:
            return [_from_json(tail.path, data) for _, data in tail.poll()]
        except DamagedError:
            if later is not None:
                # The next question goes on with the next file.
                self._tail = Tail(later, "/agents")
            raise

    def _later(self) -> Path | None:
        """Return the file after the one that is read; None if there is none."""
        known = -1 if self._tail is None else second_of(self._tail.path, ".mcap") or 0
        files = {second_of(path, ".mcap"): path for path in self._folder.glob("*.mcap")}
        later = [second for second in files if second is not None and second > known]
        if not later:
            return None
        return files[max(later) if self._newest and self._tail is None else min(later)]


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
        found = json.loads(data)
        agents = tuple(_as_agent(agent) for agent in found["agents"])
        return FramePoses(time_s=float(found["time_s"]), frame=int(found["frame"]), agents=agents)
    except (ValueError, KeyError, TypeError) as error:
        raise DamagedError(
            f"{path}: a message of /agents is not of {POSES} ({error!r}).",
            hint="It was not made by zfcal, or by another version of it.",
        ) from error


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

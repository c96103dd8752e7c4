"""What a message of ``poses/NNNNNN.mcap`` says: where everybody is in one frame.

``/agents`` (``zfcal.poses/1``, JSON) is what zfcal reads back, and trusts no further than it
has checked; ``/poses`` (``foxglove.PosesInFrame``) and ``/scene`` (``foxglove.SceneUpdate``)
say the same to viewers. Files are the business of `pose_files`.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

from foxglove_schemas_protobuf.PosesInFrame_pb2 import PosesInFrame
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from mcap.writer import Writer
from mcap_protobuf.schema import register_schema

from zfcal.arena import Arena
from zfcal.artifacts.lineage import to_json
from zfcal.artifacts.reading.parsing import json_of
from zfcal.errors import DamagedError
from zfcal.tracks import KINDS, ROBOT, AgentPose, FramePoses
from zfcal.trial import second_of
from zfcal.units import SEGMENT_S

POSES = "zfcal.poses/1"

_EDGE_S = 1.0
"""A frame may lie so far outside the minute that its file's name states."""

_FARTHEST_M = 1000.0
_LARGEST_ID = 2**31 - 1
_MOST_AGENTS = 10_000

_WRONG = (ValueError, KeyError, TypeError, AttributeError, OverflowError)
"""What reading a message of another form may raise."""

_FRAME_ID = "arena"
_FISH_COLOUR = (0.0, 0.45, 0.7, 1.0)
_ROBOT_COLOUR = (0.84, 0.37, 0.0, 1.0)
_WALL_COLOUR = (0.5, 0.5, 0.5, 1.0)
_BODY_M = 0.03


def register(writer: Writer) -> dict[str, int]:
    """Register the channels of poses with a writer; return their ids by topic."""
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


def as_json(poses: FramePoses) -> bytes:
    """Return what ``/agents`` says of a frame."""
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


def from_json(
    path: Path, data: bytes, *, absent: Callable[[DamagedError], None] | None = None
) -> FramePoses:
    """Return the frame that a message of ``/agents`` says.

    Parameters
    ----------
    path
        Its file, which bounds the time, and for the message.
    data
        The message.
    absent
        Hears of each agent whose pose is none; it counts as absent then, and the others of
        its frame stay. None to refuse the frame.

    Raises
    ------
    DamagedError
        It has another form, or says what no tracker sees.
    """
    try:
        # One number that is none is no reason to lose the others of the frame.
        found = json_of(data, not_finite=True)
        agents = found["agents"]
        if not isinstance(agents, list) or len(agents) > _MOST_AGENTS:
            message = f"agents are no list of at most {_MOST_AGENTS}"
            raise ValueError(message)
        time_s, frame = float(found["time_s"]), int(found["frame"])
        _check_frame(path, time_s, frame)
    except _WRONG as error:
        raise DamagedError(
            f"{path}: a message of /agents is not of {POSES} ({error!r:.200}).",
            hint="It was not made by zfcal, or by another version of it.",
        ) from error
    sound, problems = _told_apart(agents)
    for problem in problems:
        told = DamagedError(
            f"{path}: in frame {frame} {problem}: a message of /agents is not of {POSES}.",
            hint="It counts as absent, the others of its frame are taken: check the tracker.",
        )
        if absent is None:
            raise told
        absent(told)
    return FramePoses(time_s=time_s, frame=frame, agents=tuple(sound))


def _told_apart(agents: list[Any]) -> tuple[list[AgentPose], list[str]]:
    """Return the poses that are some, and what is wrong with the others."""
    found: list[AgentPose] = []
    problems = []
    for agent in agents:
        try:
            found.append(_as_agent(agent))
        except _WRONG as error:
            number = agent.get("agent") if isinstance(agent, dict) else None
            problems.append(f"agent {number!r:.40} has no pose ({error!r:.200})")
    times = Counter(pose.agent for pose in found)
    # Nobody knows which of them is the animal.
    problems += [f"agent {number} stands {n} times" for number, n in times.items() if n > 1]
    return [pose for pose in found if times[pose.agent] == 1], problems


def _check_frame(path: Path, time_s: float, frame: int) -> None:
    """Refuse a frame that is of no time; each limit is written so that NaN fails.

    Raises
    ------
    ValueError
        A number is out of its range.
    """
    start_s = second_of(path, ".mcap")
    low_s = 0.0 if start_s is None else start_s - _EDGE_S
    high_s = 1e9 if start_s is None else start_s + SEGMENT_S + _EDGE_S
    _check_range("time_s", time_s, low_s, high_s)
    _check_range("frame", frame, 0, 2**53)


def _check_range(name: str, value: float, low: float, high: float) -> None:
    if not low <= value <= high:
        message = f"{name} is {value!r:.40}, expected {low:g} to {high:g}"
        raise ValueError(message)


def _as_agent(found: Mapping[str, Any]) -> AgentPose:
    """Return a pose; refuse one that no tracker sees, each limit written so that NaN fails.

    Raises
    ------
    ValueError, KeyError, TypeError, AttributeError, OverflowError
        It has another form, or a number is out of its range.
    """
    heading = found.get("heading_rad")
    pose = AgentPose(
        agent=int(found["agent"]),
        kind=KINDS.index(found["kind"]),
        x_m=float(found["x_m"]),
        y_m=float(found["y_m"]),
        heading_rad=math.nan if heading is None else float(heading),
        confidence=float(found["confidence"]),
    )
    _check_range("agent", pose.agent, 0, _LARGEST_ID)
    _check_range("x_m", pose.x_m, -_FARTHEST_M, _FARTHEST_M)
    _check_range("y_m", pose.y_m, -_FARTHEST_M, _FARTHEST_M)
    _check_range("confidence", pose.confidence, 0.0, 1.0)
    if not math.isnan(pose.heading_rad):
        _check_range("heading_rad", pose.heading_rad, -100.0, 100.0)
    return pose


def as_poses(poses: FramePoses, time_ns: int) -> PosesInFrame:
    """Return what ``/poses`` says of a frame."""
    message = PosesInFrame(frame_id=_FRAME_ID)
    message.timestamp.FromNanoseconds(time_ns)
    for agent in poses.agents:
        _place(message.poses.add(), agent)
    return message


def _place(pose: Any, agent: AgentPose) -> None:
    heading = agent.heading_rad if math.isfinite(agent.heading_rad) else 0.0
    pose.position.x, pose.position.y = agent.x_m, agent.y_m
    pose.orientation.z, pose.orientation.w = math.sin(heading / 2), math.cos(heading / 2)


def as_scene(poses: FramePoses, time_ns: int, arena: Arena | None) -> SceneUpdate:
    """Return what ``/scene`` says of a frame, with the walls where an arena is given."""
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

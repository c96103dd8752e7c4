"""What is said to a FishBot and what it says: users' events and the network's own messages.

Speeds here are whole centimetres per second, as the robot takes them.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from zfcal.errors import InputError
from zfcal.robot.aseba import Frame

LETTERS = "ABCDEFGHIJ"
"""Names of the robots of a network."""

STOP, POWER_DOWN, OBSTACLE = 1, 4, 5
MOTOR_CONTROL, FISH_BEHAVIOR, OBSTACLE_AVOIDANCE = 6, 16, 26
"""Events of robot A; the others' follow in the order of the letters."""

LIST_NODES, GET_DESCRIPTION, GET_NODE_DESCRIPTION = 0xA011, 0xA000, 0xA010
NODE_PRESENT, DESCRIPTION, NAMED_VARIABLE_DESCRIPTION = 0x900C, 0x9000, 0x9001
SET_VARIABLES, DISCONNECTED = 0xA00C, 0x9004

_PROTOCOL_VERSION = 5
_FIRST_NODE = 30
_WORD = range(-(2**15), 2**15)


def robot_index(letter: str) -> int:
    """Return a robot's number in the network, 0 for A."""
    if len(letter) != 1 or letter not in LETTERS:
        raise InputError(
            f"No robot is called {letter!r}; expected one of {', '.join(LETTERS)}.",
            hint="The letter stands on the robot: its node is named Fish_bot_F or so.",
        )
    return LETTERS.index(letter)


def node_of(letter: str) -> int:
    """Return a robot's node, 30 for A."""
    return _FIRST_NODE + robot_index(letter)


def node_name(letter: str) -> str:
    """Return the name of a robot's node, such as ``Fish_bot_F``."""
    robot_index(letter)
    return f"Fish_bot_{letter}"


def stop() -> Frame:
    """Return the event on which every robot stops its wheels."""
    return Frame(type=STOP)


def motor_control(letter: str, left_cm_s: int, right_cm_s: int) -> Frame:
    """Return the event that sets a robot's wheel speeds."""
    return _event(MOTOR_CONTROL + robot_index(letter), left_cm_s, right_cm_s)


def fish_behavior(letter: str, turn_deg: int, distance_ticks: int, speed_cm_s: int) -> Frame:
    """Return the event on which a robot turns, goes a way and glides, by itself."""
    if not -180 <= turn_deg <= 180:
        raise InputError(f"A turn is -180 to 180 degrees, got {turn_deg!r}.")
    return _event(FISH_BEHAVIOR + robot_index(letter), turn_deg, distance_ticks, speed_cm_s)


def obstacle_avoidance(letter: str, mode: int) -> Frame:
    """Return the event that sets what a robot does at obstacles: 0 off, 1 Braitenberg, 2 turn."""
    if mode not in {0, 1, 2}:
        raise InputError(f"Obstacle avoidance is 0 (off), 1 (Braitenberg) or 2 (turn), got {mode}.")
    return _event(OBSTACLE_AVOIDANCE + robot_index(letter), mode)


def list_nodes() -> Frame:
    """Return the question who is there, which nodes answer by NODE_PRESENT."""
    return Frame(type=LIST_NODES, payload=struct.pack("<H", _PROTOCOL_VERSION))


def get_description() -> Frame:
    """Return the question that nodes with older firmware answer by DESCRIPTION."""
    return Frame(type=GET_DESCRIPTION, payload=struct.pack("<H", _PROTOCOL_VERSION))


def get_node_description(node: int) -> Frame:
    """Return the question that one node answers by DESCRIPTION."""
    payload = struct.pack("<HH", node, _PROTOCOL_VERSION)
    return Frame(type=GET_NODE_DESCRIPTION, payload=payload)


def set_variables(node: int, start: int, values: list[int]) -> Frame:
    """Return the message that writes a node's variables from an index on."""
    payload = struct.pack("<HH", node, start) + _words(values)
    return Frame(type=SET_VARIABLES, payload=payload)


def node_present(node: int) -> Frame:
    """Return a node's answer to LIST_NODES."""
    return Frame(type=NODE_PRESENT, source=node, payload=struct.pack("<H", _PROTOCOL_VERSION))


def description(node: int, name: str) -> Frame:
    """Return a node's answer to a question for its description, without variables."""
    said = name.encode()
    # Version, then sizes of bytecode, stack and variables, then counts of what is described apart.
    rest = struct.pack("<7H", _PROTOCOL_VERSION, 0, 0, 0, 0, 0, 0)
    return Frame(type=DESCRIPTION, source=node, payload=bytes([len(said)]) + said + rest)


def named_variable(node: int, size: int, name: str) -> Frame:
    """Return a node's description of one variable, of so many words."""
    said = name.encode()
    payload = struct.pack("<HB", size, len(said)) + said
    return Frame(type=NAMED_VARIABLE_DESCRIPTION, source=node, payload=payload)


def disconnected(node: int) -> Frame:
    """Return what is said when a node has gone."""
    return Frame(type=DISCONNECTED, source=node)


@dataclass(frozen=True, slots=True, kw_only=True)
class Said:
    """What a robot said, as far as the driver cares.

    Parameters
    ----------
    what
        ``power-down``, ``obstacle``, ``present``, ``described``, ``variable``,
        ``disconnected`` or ``other``.
    robot
        Letter of the robot; empty where it is none of ours.
    name
        What a description names.
    """

    what: str
    robot: str = ""
    name: str = ""


_BY_NODE = {
    NODE_PRESENT: "present",
    DESCRIPTION: "described",
    NAMED_VARIABLE_DESCRIPTION: "variable",
    DISCONNECTED: "disconnected",
}


def understand(frame: Frame) -> Said:
    """Return what a frame from the network says; what is malformed is ``other``."""
    if frame.type in {POWER_DOWN, OBSTACLE}:
        index = frame.arguments[0] if frame.arguments else -1
        what = "power-down" if frame.type == POWER_DOWN else "obstacle"
        return Said(what=what, robot=_letter(index)) if _letter(index) else Said(what="other")
    what = _BY_NODE.get(frame.type, "other")
    if what == "described":
        return Said(what=what, robot=_letter(frame.source - _FIRST_NODE), name=_string(frame, 0))
    if what == "variable":
        return Said(what=what, robot=_letter(frame.source - _FIRST_NODE), name=_string(frame, 2))
    return Said(what=what, robot=_letter(frame.source - _FIRST_NODE))


def _letter(index: int) -> str:
    return LETTERS[index] if 0 <= index < len(LETTERS) else ""


def _string(frame: Frame, start: int) -> str:
    length = frame.payload[start] if len(frame.payload) > start else 0
    return frame.payload[start + 1 : start + 1 + length].decode(errors="replace")


def _event(number: int, *arguments: int) -> Frame:
    return Frame(type=number, payload=_words(list(arguments)))


def _words(values: list[int]) -> bytes:
    for value in values:
        if value not in _WORD:
            raise InputError(f"An argument is a whole number of 16 bits, got {value!r}.")
    return struct.pack(f"<{len(values)}h", *values)

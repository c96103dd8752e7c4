"""What is said to a FishBot, in the bytes that it knows."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from zfcal.errors import InputError
from zfcal.robot import events
from zfcal.robot.aseba import Decoder, Frame

VECTORS = {
    "MotorControl(10, 12)": (events.motor_control("F", 10, 12), "04 00 00 00 0b 00 0a 00 0c 00"),
    "FishBehavior(-45, 25, 14)": (
        events.fish_behavior("F", -45, 25, 14),
        "06 00 00 00 15 00 d3 ff 19 00 0e 00",
    ),
    "SetObstacleAvoidance(1)": (events.obstacle_avoidance("F", 1), "02 00 00 00 1f 00 01 00"),
    "STOP": (events.stop(), "00 00 00 00 01 00"),
    "LIST_NODES": (events.list_nodes(), "02 00 00 00 11 a0 05 00"),
    "GET_NODE_DESCRIPTION(35)": (
        events.get_node_description(35),
        "04 00 00 00 10 a0 23 00 05 00",
    ),
    "SET_VARIABLES(35, 100, [2])": (
        events.set_variables(35, 100, [2]),
        "06 00 00 00 0c a0 23 00 64 00 02 00",
    ),
}


@pytest.mark.parametrize("name", VECTORS)
def test_exchanges_are_those_of_the_published_scripts(name):
    """The byte vectors of robot F."""
    frame, line = VECTORS[name]
    assert frame.encode() == bytes.fromhex(line)


@given(st.sampled_from(events.LETTERS), st.integers(-300, 300), st.integers(-300, 300))
def test_wheel_speeds_come_back(letter, left, right):
    """Robot and speeds can be told from the frame alone."""
    (frame,) = Decoder().feed(events.motor_control(letter, left, right).encode())
    assert frame.type - events.MOTOR_CONTROL == events.LETTERS.index(letter)
    assert frame.arguments == (left, right)


def test_robots_have_nodes_and_names():
    """A is 30, F is 35, J is 39."""
    assert [events.node_of(letter) for letter in "AFJ"] == [30, 35, 39]
    assert events.node_name("F") == "Fish_bot_F"


@pytest.mark.parametrize("letter", ["", "K", "f", "AB"])
def test_there_are_ten_robots(letter):
    """Any other name is a mistake."""
    with pytest.raises(InputError):
        events.node_of(letter)


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: events.motor_control("A", 40000, 0),
        lambda: events.fish_behavior("A", 181, 1, 1),
        lambda: events.obstacle_avoidance("A", 3),
    ],
)
def test_arguments_beyond_their_range_are_refused(wrong):
    """Never cut off."""
    with pytest.raises(InputError):
        wrong()


def test_a_robot_in_need_is_understood():
    """PowerDown and Obstacle name the robot by its index."""
    low = Frame(type=4, payload=b"\x05\x00", source=35)
    near = Frame(type=5, payload=b"\x00\x00", source=30)
    assert events.understand(low) == events.Said(what="power-down", robot="F")
    assert events.understand(near) == events.Said(what="obstacle", robot="A")


def test_the_handshake_is_understood():
    """A node that is there, that describes itself, its variables, and that has gone."""
    said = events.understand(events.node_present(35))
    assert (said.what, said.robot) == ("present", "F")
    said = events.understand(events.description(35, "Fish_bot_F"))
    assert (said.what, said.robot, said.name) == ("described", "F", "Fish_bot_F")
    said = events.understand(events.named_variable(35, 2, "motor.target"))
    assert (said.what, said.name) == ("variable", "motor.target")
    assert events.understand(events.disconnected(35)).what == "disconnected"


@given(st.integers(0, 2**16 - 1), st.integers(0, 2**16 - 1), st.binary(max_size=40))
def test_whatever_comes_is_understood_somehow(kind, source, payload):
    """Malformed payloads and unknown types are no errors."""
    said = events.understand(Frame(type=kind, source=source, payload=payload))
    assert said.robot in {"", *events.LETTERS}

"""Wheels and where they lead."""

import math

import pytest
import shapely
from hypothesis import example, given
from hypothesis import strategies as st

from zfcal.errors import InputError
from zfcal.robot.body import (
    WHEEL_BASE_M,
    WHEEL_LIMIT_M_S,
    Pose,
    Wheels,
    check_wheels,
    roll,
    wheels_for,
)
from zfcal.robot.confines import Confines

SPEEDS = st.floats(-5, 5)
SQUARE = shapely.box(0, 0, 1, 1)


def test_wheels_turn_to_the_left_with_the_right_one_faster():
    """V = 0.1 m/s and omega = 2 rad/s: 0.1 -+ 2 * 0.018 / 2."""
    wheels = wheels_for(0.1, 2.0)
    assert (wheels.left_m_s, wheels.right_m_s) == pytest.approx((0.082, 0.118))
    assert wheels.speed_m_s == pytest.approx(0.1)
    assert wheels.turn_rad_s == pytest.approx(2.0)


@given(SPEEDS, st.floats(-100, 100))
def test_no_wheel_is_asked_for_more_than_it_can_do(speed, turn):
    """Whatever is asked for, what comes out is accepted, and turns the right way."""
    wheels = wheels_for(speed, turn)
    check_wheels(wheels)
    assert wheels.turn_rad_s * turn >= -1e-9


@pytest.mark.parametrize("wheels", [(0.31, 0), (0, -0.31), (math.nan, 0), (0, math.inf)])
def test_too_fast_is_refused(wheels):
    """Not a number is refused as well."""
    with pytest.raises(InputError, match="wheel"):
        check_wheels(Wheels(left_m_s=wheels[0], right_m_s=wheels[1]))


def test_a_quarter_of_a_circle():
    """Wheels at r -+ b/2 of a circle of 0.1 m, for a quarter turn: from (0, 0) to (0.1, 0.1)."""
    omega = 1.0
    wheels = Wheels(
        left_m_s=omega * (0.1 - WHEEL_BASE_M / 2), right_m_s=omega * (0.1 + WHEEL_BASE_M / 2)
    )
    pose = roll(Pose(x_m=0, y_m=0, heading_rad=0), wheels, math.pi / 2)
    assert (pose.x_m, pose.y_m) == pytest.approx((0.1, 0.1))
    assert pose.heading_rad == pytest.approx(math.pi / 2)


@given(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3), st.floats(-3, 3))
@example(left=0.0, right=5e-324, heading=0.0)
def test_two_halves_make_a_whole(left, right, heading):
    """An arc does not depend on how time is cut."""
    start, wheels = Pose(x_m=1, y_m=2, heading_rad=heading), Wheels(left_m_s=left, right_m_s=right)
    whole = roll(start, wheels, 0.02)
    halves = roll(roll(start, wheels, 0.01), wheels, 0.01)
    assert (halves.x_m, halves.y_m) == pytest.approx((whole.x_m, whole.y_m), abs=1e-9)


@given(st.floats(-1, 2), st.floats(-1, 2))
def test_clamped_places_are_the_nearest_that_are_allowed(x, y):
    """Inside nothing moves; outside it is the nearest place of the smaller square."""
    confines = Confines(SQUARE, 0.1)
    at_x, at_y, moved = confines.clamp(x, y)
    inside = 0.1 <= x <= 0.9 and 0.1 <= y <= 0.9
    assert moved != inside
    assert (at_x, at_y) == pytest.approx((min(0.9, max(0.1, x)), min(0.9, max(0.1, y))), abs=2e-6)
    assert not confines.clamp(at_x, at_y)[2]


def test_a_hole_is_a_wall():
    """A target in the middle of a ring is moved into the ring."""
    ring = shapely.Point(0, 0).buffer(0.3) - shapely.Point(0, 0).buffer(0.2)
    x, y, moved = Confines(ring, 0.02).clamp(0.01, 0.0)
    assert moved
    assert math.hypot(x, y) == pytest.approx(0.22, abs=1e-3)


def test_a_robot_that_fits_nowhere_is_told():
    """Of an arena of one metre a robot of half a metre leaves nothing."""
    with pytest.raises(InputError, match="fits nowhere"):
        Confines(SQUARE, 0.5)
    with pytest.raises(InputError, match="radius"):
        Confines(SQUARE, math.nan)


def test_wheel_limits():
    """30 cm/s, the real one's."""
    assert WHEEL_LIMIT_M_S == 0.30

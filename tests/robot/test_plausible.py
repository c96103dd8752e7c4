"""What is taken for a pose, and what is not."""

import math

import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from zfcal.arena import make_arena
from zfcal.robot.body import WHEEL_LIMIT_M_S
from zfcal.robot.plausible import CONSISTENT_FRAMES, TOLERANCE_M, Plausibility, Reach, is_frame
from zfcal.tracks import ROBOT, AgentPose

NAN, INF = math.nan, math.inf
FRAME_S = 1 / 15


@pytest.fixture(scope="module")
def judge():
    """Return what judges poses in a square tank of a metre, from (0, 0) to (1, 1)."""
    outline = shapely.box(0.0, 0.0, 1.0, 1.0)
    return Plausibility(make_arena(name="square", outline=outline))


def seen(x_m, y_m, *, confidence=1.0, heading_rad=0.0):
    """Return a robot's pose."""
    return AgentPose(
        agent=4, kind=ROBOT, x_m=x_m, y_m=y_m, heading_rad=heading_rad, confidence=confidence
    )


@pytest.mark.parametrize(
    ("pose", "kind"),
    [
        (seen(0.5, 0.5), None),
        (seen(0.5, 0.5, heading_rad=NAN), None),
        (seen(1.0 + 0.9 * TOLERANCE_M, 0.5), None),
        (seen(1.0 + 1.1 * TOLERANCE_M, 0.5), "outside"),
        (seen(6.0, 0.5), "outside"),
        (seen(1e308, -1e308), "outside"),
        (seen(NAN, 0.5), "not-finite"),
        (seen(0.5, -INF), "not-finite"),
        (seen(0.5, 0.5, confidence=0.5), None),
        (seen(0.5, 0.5, confidence=0.49), "unsure"),
        (seen(0.5, 0.5, confidence=0.0), "unsure"),
        (seen(0.5, 0.5, confidence=NAN), "unsure"),
    ],
)
@pytest.mark.filterwarnings("error")
def test_a_pose_is_finite_sure_and_in_the_tank(judge, pose, kind):
    """Within a tolerance of 3 cm; a heading may be unknown."""
    doubt = judge.doubt(pose)
    assert (None if doubt is None else doubt.kind) == kind


def test_it_is_said_by_how_much_a_pose_is_outside(judge):
    """Five metres, in words."""
    assert "5 m outside the tank, 0.03 m are allowed" in judge.doubt(seen(6.0, 0.5)).says


def test_a_robot_that_jumps_is_found_after_five_frames_that_agree():
    """Four are left out; others that agree with nothing are left out for ever."""
    reach = Reach()
    assert reach.doubt(0.0, 0.1, 0.1) is None
    found = [reach.doubt(k * FRAME_S, 0.6, 0.1) for k in range(1, 7)]
    assert [doubt is None for doubt in found] == [False] * (CONSISTENT_FRAMES - 1) + [True] * 2
    assert found[0].kind == "jump"
    assert "0.5 m from where it was" in found[0].says
    wild = [reach.doubt((7 + k) * FRAME_S, 0.1 + 0.5 * (k % 2), 0.9) for k in range(30)]
    assert None not in wild


def test_a_place_in_between_ends_what_agreed():
    """Four frames elsewhere, one where it was, four elsewhere: never five in a row."""
    reach = Reach()
    reach.doubt(0.0, 0.1, 0.1)
    for k in range(1, 30):
        x = 0.1 if k % 5 == 0 else 0.6
        assert (reach.doubt(k * FRAME_S, x, 0.1) is None) == (k % 5 == 0)


def test_a_robot_that_was_lost_may_have_driven_meanwhile():
    """0.3 m in a second, and a tolerance; time that goes back allows nothing."""
    reach = Reach()
    reach.doubt(0.0, 0.1, 0.1)
    assert reach.doubt(1.0, 0.1 + 0.32, 0.1) is None
    assert reach.doubt(2.0, 0.42 + 0.34, 0.1).kind == "jump"
    assert reach.doubt(0.5, 0.5, 0.1).kind == "jump"


@given(
    speeds=st.lists(st.floats(0, WHEEL_LIMIT_M_S), min_size=1, max_size=30),
    heading=st.floats(-math.pi, math.pi),
)
@settings(deadline=None)
def test_no_robot_that_drives_is_left_out(speeds, heading):
    """At any speed that its wheels have."""
    reach, at = Reach(), [0.0, 0.0]
    for k, speed in enumerate(speeds):
        at[0] += speed * FRAME_S * math.cos(heading)
        at[1] += speed * FRAME_S * math.sin(heading)
        assert reach.doubt((k + 1) * FRAME_S, *at) is None


def test_frames_have_times_and_numbers_of_a_trial():
    """From 0 on, and not of another age."""
    assert is_frame(0.0, 0, 15.0)
    assert is_frame(3600.0, 54_000, 15.0)
    for time_s, number in ((NAN, 1), (INF, 1), (-1.0, 1), (1e308, 1), (1.0, -1)):
        assert not is_frame(time_s, number, 15.0)


def test_a_frames_number_is_that_of_its_time():
    """A camera may run 1 % slow for hours, and a tracker begin at any frame; no more than that."""
    assert is_frame(3600.0, round(0.99 * 54_000), 15.0)
    assert is_frame(0.0, 14, 15.0)
    for time_s, number in ((10.0, 10**9), (10.0, 0), (3600.0, 50_000), (0.0, 16)):
        assert not is_frame(time_s, number, 15.0)

"""Ways to swim to a target."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from zfcal.errors import InputError
from zfcal.robot.body import Pose, check_wheels, roll
from zfcal.robot.fishbot import FishBot
from zfcal.robot.motion import FishPattern, Gains, Goal, Kicks, PidPattern, Steering, pattern_of
from zfcal.robot.simulated import SimulatedFishBot, Traits

HERE = Pose(x_m=0.0, y_m=0.0, heading_rad=0.0)
PLACES = st.builds(Goal, x_m=st.floats(-1, 1), y_m=st.floats(-1, 1), speed_m_s=st.floats(0, 0.2))
POSES = st.builds(
    Pose, x_m=st.floats(-1, 1), y_m=st.floats(-1, 1), heading_rad=st.floats(-3.1, 3.1)
)


def swim(pattern, goal_at, *, seconds=20.0):
    """Let a robot without inertia swim; return its poses and speeds, one each 0.1 s."""
    pose, poses, speeds = HERE, [], []
    for k in range(round(10 * seconds)):
        wheels = pattern.command(pose, goal_at(k / 10), k / 10)
        check_wheels(wheels)
        pose = roll(pose, wheels, 0.1)
        poses.append(pose)
        speeds.append(wheels.speed_m_s)
    return poses, np.array(speeds)


def test_turning_by_hand():
    """Kp e + ki times the sum of the errors: 0.2 and then 0.4 rad."""
    steering = Steering(Gains())
    assert steering.turn(0.2) == pytest.approx(3.5 * 0.2 + 0.05 * 0.2)
    assert steering.turn(0.4) == pytest.approx(3.5 * 0.4 + 0.05 * 0.6)


def test_the_differential_part_by_hand():
    """Kd times the change of the error over a tick of 0.1 s."""
    steering = Steering(Gains(turn_p=0, turn_i=0, turn_d=0.3))
    assert steering.turn(0.1) == 0.0
    assert steering.turn(0.15) == pytest.approx(0.3 * 0.05 / 0.1)


def test_the_sum_forgets_after_twenty_errors():
    """A constant error's sum stops growing."""
    steering = Steering(Gains())
    turns = [steering.turn(0.1) for _ in range(40)]
    assert turns[19] == pytest.approx(3.5 * 0.1 + 0.05 * 2.0)
    assert turns[39] == pytest.approx(turns[19])


def test_speed_follows_the_distance_up_to_the_cap():
    """250 cm/s per metre: 0.1 m/s at 4 cm, and 0.16 m/s from 6.4 cm on."""
    for distance, speed in ((0.02, 0.05), (0.04, 0.1), (0.2, 0.16)):
        wheels = PidPattern().command(HERE, Goal(x_m=distance, y_m=0.0), 0.0)
        assert wheels.speed_m_s == pytest.approx(speed)
        assert wheels.turn_rad_s == pytest.approx(0.0)


def test_a_target_to_the_left_is_turned_to():
    """Angles are counter-clockwise: the right wheel is the faster one."""
    for pattern in (PidPattern(), FishPattern()):
        wheels = pattern.command(HERE, Goal(x_m=0.0, y_m=0.1), 0.0)
        assert wheels.right_m_s > wheels.left_m_s


@pytest.mark.parametrize("name", ["pid", "fish"])
@given(pose=POSES, goal=PLACES)
def test_no_wheel_is_ever_asked_for_too_much(name, pose, goal):
    """From anywhere to anywhere, at the first command and after a while."""
    pattern = pattern_of(name)
    for k in range(25):
        check_wheels(pattern.command(pose, goal, k / 10))


@pytest.mark.parametrize("name", ["pid", "fish"])
def test_a_robot_that_is_there_rests(name):
    """A target at the robot's own place moves nothing."""
    wheels = pattern_of(name).command(HERE, Goal(x_m=0.0, y_m=0.0), 0.0)
    assert (wheels.left_m_s, wheels.right_m_s) == (0.0, 0.0)


@pytest.mark.parametrize("name", ["pid", "fish"])
def test_a_standing_target_is_reached(name):
    """From 0.3 m away, behind it, within 12 s to some centimetres."""
    poses, _ = swim(pattern_of(name), lambda _: Goal(x_m=-0.3, y_m=0.05), seconds=12)
    nearest = min(math.hypot(p.x_m + 0.3, p.y_m - 0.05) for p in poses)
    assert nearest < 0.04


def test_fish_kick_and_glide():
    """Speed peaks at 14 to 19 cm/s and decays between kicks, about one a second."""
    _, speeds = swim(FishPattern(), lambda s: Goal(x_m=0.1 * s + 0.03, y_m=0.0, speed_m_s=0.1))
    kicks = np.flatnonzero(np.diff(speeds) > 0.02) + 1
    assert 0.6 < np.diff(kicks).mean() / 10 < 1.4
    assert ((speeds[kicks] >= 0.14 - 1e-9) & (speeds[kicks] <= 0.19 + 1e-9)).all()
    glides = np.delete(speeds, np.append(kicks, 0))
    assert (np.diff(speeds)[np.diff(speeds) <= 0.02] < 0).all()
    assert glides.min() < 0.09


@pytest.mark.parametrize("asked", [0.06, 0.09, 0.12])
def test_fish_swim_as_fast_as_the_model_on_the_average(asked):
    """Within a tenth, over half a minute, for the speeds that fish have."""
    _, speeds = swim(
        FishPattern(),
        lambda s: Goal(x_m=asked * s + 0.02, y_m=0.0, speed_m_s=asked),
        seconds=30,
    )
    assert speeds.mean() == pytest.approx(asked, rel=0.1)


def wander(pattern, line, *, asked, turn_rad, seconds=60):
    """Let a simulated robot follow a model whose steps of 0.2 s turn a lot; return its speed."""
    rng = np.random.default_rng(3)
    driver, robot = FishBot("F", line), SimulatedFishBot(Traits(), HERE)
    for k in range(round(10 * seconds)):
        robot.advance(k / 10)
        if k % 2 == 0:
            at, angle = robot.pose, robot.pose.heading_rad + turn_rad * rng.standard_normal()
            goal = Goal(
                x_m=at.x_m + 0.2 * asked * math.cos(angle),
                y_m=at.y_m + 0.2 * asked * math.sin(angle),
                speed_m_s=asked,
            )
        robot.receive(driver.frame_for(pattern.command(robot.pose, goal, k / 10)).encode())
    return robot.way_m / seconds


@pytest.mark.parametrize("asked", [0.06, 0.085])
def test_steps_that_turn_as_fish_do_cost_no_speed(line, asked):
    """Seventy degrees on the average, every 0.2 s: it still goes as far as it is asked.

    A robot that stood still to face each target came to half of that.
    """
    assert wander(FishPattern(), line, asked=asked, turn_rad=1.5) == pytest.approx(asked, rel=0.15)
    slow = wander(FishPattern(kicks=Kicks(face_rad=0.5)), line, asked=asked, turn_rad=1.5)
    assert slow < 0.8 * asked


def test_a_kick_begins_when_the_target_is_faced():
    """Its first speed is a kick's, however long the robot had to turn for it."""
    _, speeds = swim(FishPattern(), lambda _: Goal(x_m=-0.5, y_m=0.0, speed_m_s=0.1), seconds=2)
    moving = np.flatnonzero(speeds > 0)
    assert moving[0] > 0
    assert 0.14 <= speeds[moving[0]] <= 0.19


def test_a_leap_of_the_tracker_is_not_taken_for_speed():
    """A robot that is suddenly seen a metre farther on kicks as often as before."""
    calm, leapt = FishPattern(), FishPattern()
    kicks = {calm: 0, leapt: 0}
    for pattern, leap_m in ((calm, 0.0), (leapt, 1.0)):
        speed = 0.0
        for k in range(100):
            x_m = 0.08 * k / 10 + (leap_m if k > 50 else 0.0)
            goal = Goal(x_m=x_m + 0.02, y_m=0.0, speed_m_s=0.1)
            wheels = pattern.command(Pose(x_m=x_m, y_m=0.0, heading_rad=0.0), goal, k / 10)
            kicks[pattern] += wheels.speed_m_s > speed + 0.02
            speed = wheels.speed_m_s
    assert abs(kicks[calm] - kicks[leapt]) <= 1


def test_a_fish_faces_what_is_behind_it_first():
    """The first command turns on the spot."""
    wheels = FishPattern().command(HERE, Goal(x_m=-0.1, y_m=0.0, speed_m_s=0.1), 0.0)
    assert wheels.speed_m_s == pytest.approx(0.0)
    assert abs(wheels.turn_rad_s) > 5


def test_after_a_stop_a_kick_begins_anew():
    """What was under way is forgotten."""
    pattern = FishPattern(kicks=Kicks())
    goal = Goal(x_m=0.5, y_m=0.0, speed_m_s=0.1)
    first = pattern.command(HERE, goal, 0.0)
    pattern.command(HERE, goal, 0.1)
    pattern.reset()
    assert pattern.command(HERE, goal, 0.2).speed_m_s == pytest.approx(first.speed_m_s)


def test_there_are_two_patterns():
    """Any other name is a mistake."""
    with pytest.raises(InputError, match="fish"):
        pattern_of("eel")

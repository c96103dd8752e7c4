"""A FishBot that is not there."""

import math

import numpy as np
import pytest
import shapely

from zfcal.robot import events
from zfcal.robot.aseba import Decoder
from zfcal.robot.body import Pose
from zfcal.robot.confines import Confines
from zfcal.robot.simulated import SimulatedFishBot, Traits

ORIGIN = Pose(x_m=0.0, y_m=0.0, heading_rad=0.0)
EXACT = Traits(noise=0.0, lag_s=0.0)


def robot(traits=EXACT, **how):
    """Return a robot at the origin, facing along x."""
    return SimulatedFishBot(traits, ORIGIN, **how)


def tell(bot, frame):
    """Send it a frame."""
    bot.receive(frame.encode())


def test_it_goes_where_its_wheels_go():
    """10 cm/s for a second, less what a metre per second squared costs: 10 cm less half of 1 cm."""
    bot = robot()
    tell(bot, events.motor_control("F", 10, 10))
    bot.advance(1.0)
    assert bot.pose.x_m == pytest.approx(0.1 - 0.1**2 / 2, abs=6e-4)
    assert (bot.pose.y_m, bot.pose.heading_rad) == pytest.approx((0.0, 0.0))


def test_the_right_wheel_alone_turns_it_left():
    """Radians a second: the difference over a wheel base of 1.8 cm."""
    bot = robot()
    tell(bot, events.motor_control("F", 0, 2))
    bot.advance(0.5)
    before = bot.pose.heading_rad
    bot.advance(1.0)
    assert bot.pose.heading_rad - before == pytest.approx(0.02 / 0.018 * 0.5, rel=1e-6)


@pytest.mark.parametrize("speeds", [(31, 0), (0, -31), (200, 200)])
def test_too_fast_sets_both_wheels_to_zero(speeds):
    """As the real one does."""
    bot = robot()
    tell(bot, events.motor_control("F", 20, 20))
    bot.advance(1.0)
    tell(bot, events.motor_control("F", *speeds))
    bot.advance(2.0)
    assert (bot.wheels.left_m_s, bot.wheels.right_m_s) == (0.0, 0.0)


def test_stop_is_for_everybody_and_commands_are_not():
    """A command to robot A moves no robot F; STOP stops it."""
    bot = robot()
    tell(bot, events.motor_control("A", 20, 20))
    bot.advance(0.5)
    assert bot.pose == ORIGIN
    tell(bot, events.motor_control("F", 20, 20))
    bot.advance(1.0)
    tell(bot, events.stop())
    bot.advance(1.5)
    assert bot.wheels.speed_m_s == 0.0


def test_a_command_takes_effect_after_the_lag():
    """Not before 0.1 s, and soon after."""
    bot = robot(Traits(noise=0.0, lag_s=0.1))
    tell(bot, events.motor_control("F", 10, 10))
    bot.advance(0.1)
    assert bot.wheels.speed_m_s == 0.0
    bot.advance(0.11)
    assert bot.wheels.speed_m_s > 0.0


def test_the_same_seed_leads_to_the_same_place():
    """However time is cut; another seed leads elsewhere, by about the noise that was asked for."""
    ends = []
    for seed, pieces in ((1, 3), (1, 250), (2, 3)):
        bot = robot(Traits(noise=0.05, lag_s=0.03), seed=seed)
        tell(bot, events.motor_control("F", 10, 11))
        for k in range(1, pieces + 1):
            bot.advance(5.0 * k / pieces)
        ends.append(bot.pose)
    assert ends[0] == ends[1]
    assert ends[0] != ends[2]


@pytest.mark.slow
def test_slip_is_as_large_as_it_was_asked_to_be():
    """The way of 3 s by 200 robots spreads as slip that lasts half a second makes it.

    Its variance is (noise v)^2 / 2 * 2 T (t - T) for two wheels with T = 0.5 s. The test
    notices a fourth more or less.
    """
    noise, speed, span_s, lasts_s = 0.05, 0.1, 3.0, 0.5
    ways = []
    for seed in range(200):
        bot = robot(Traits(noise=noise, lag_s=0.0), seed=seed)
        tell(bot, events.motor_control("F", 10, 10))
        bot.advance(span_s)
        ways.append(bot.way_m)
    variance = (noise * speed) ** 2 / 2 * 2 * lasts_s * (span_s - lasts_s)
    assert np.std(ways) == pytest.approx(math.sqrt(variance), rel=0.25)


def test_walls_hold_it():
    """It slides along, and never leaves."""
    box = Confines(shapely.box(-1, -0.1, 0.2, 0.1), 0.015)
    bot = robot(confines=box)
    tell(bot, events.motor_control("F", 25, 26))
    for k in range(1, 60):
        bot.advance(k / 10)
        assert box.clamp(bot.pose.x_m, bot.pose.y_m)[2] is False


def test_it_behaves_like_a_fish_by_itself():
    """FishBehavior: turn right by 45 degrees, go 25 ticks at 14 cm/s, glide to a rest."""
    bot = robot()
    tell(bot, events.fish_behavior("F", -45, 25, 14))
    fastest = 0.0
    for k in range(1, 800):
        bot.advance(k * 0.005)
        fastest = max(fastest, bot.wheels.speed_m_s)
    assert bot.pose.heading_rad == pytest.approx(-math.pi / 4, abs=0.25)
    assert fastest == pytest.approx(0.14, abs=0.01)
    assert bot.wheels.speed_m_s == 0.0
    assert math.hypot(bot.pose.x_m, bot.pose.y_m) > 25 * 0.00088


def test_the_handshake():
    """LIST_NODES, GET_NODE_DESCRIPTION and the older question are answered by node 35."""
    bot = robot()
    for question in (
        events.list_nodes(),
        events.get_node_description(35),
        events.get_description(),
    ):
        tell(bot, question)
    tell(bot, events.get_node_description(34))
    answers = [events.understand(frame) for frame in Decoder().feed(bot.take_output())]
    assert [answer.what for answer in answers] == ["present", "described", "described"]
    assert {answer.robot for answer in answers} == {"F"}
    assert answers[1].name == "Fish_bot_F"


def test_without_supply_it_stands_and_complains():
    """PowerDown again and again for 4 s, then it drives on."""
    bot = robot()
    bot.starve(4.0)
    tell(bot, events.motor_control("F", 10, 10))
    bot.advance(4.0)
    assert bot.pose == ORIGIN
    said = [events.understand(frame) for frame in Decoder().feed(bot.take_output())]
    assert len(said) == 20
    assert {each.what for each in said} == {"power-down"}
    tell(bot, events.motor_control("F", 10, 10))
    bot.advance(5.0)
    assert bot.pose.x_m > 0.05


def test_an_obstacle_is_told_once():
    """By the robot that met it."""
    bot = robot()
    bot.meet_obstacle()
    (said,) = Decoder().feed(bot.take_output())
    assert events.understand(said) == events.Said(what="obstacle", robot="F")


def test_noise_on_the_line_is_survived():
    """Garbage moves nothing, and what it says later is heard after the line was quiet."""
    bot = robot()
    bot.receive(b"\xff\xfe\xfd" * 50)
    bot.advance(1.0)
    assert bot.pose == ORIGIN
    assert bot.n_received == 0

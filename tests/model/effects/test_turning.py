"""Effects of a fish's own way on its heading do what their sentences say."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from zfcal.model.onestep import heading_density


def test_along_a_wall_a_fish_keeps_its_way(natural_model, two_rooms):
    """3 cm from a wall and swimming up along it: odds of up against down become e^(2 s)."""
    odds = []
    for effects in ({}, {"wall-persistence": {"strength": 0.7}}):
        theta, density = heading_density(
            dataclasses.replace(natural_model, effects=effects), two_rooms, xy_m=[(0.08, 0.8)],
            heading_rad=[math.pi / 2 + 0.1], speed_m_s=0.0,
        )  # fmt: skip
        odds.append(density[np.sin(theta) > 0].sum() / density[np.sin(theta) < 0].sum())

    assert odds[0] == pytest.approx(1.0, rel=1e-6)
    assert odds[1] == pytest.approx(math.exp(1.4), rel=0.05)


def test_away_from_walls_nothing_is_kept(ask):
    """In a zone that does not follow walls every heading is alike."""
    asked = ask("wall-persistence", {"strength": 2.0}, FOLLOWS=0.0)
    assert asked.factor(1.0) == asked.factor(-2.0) == 1.0


def test_the_sense_is_the_same_whichever_way_the_wall_is_drawn(ask):
    """Turning the wall's direction round changes nothing; turning the fish round does."""
    rows = {"FOLLOWS": 1.0, "HX": math.cos(1.2), "HY": math.sin(1.2)}
    up = ask("wall-persistence", {"strength": 1.0}, TAU_X=0.0, TAU_Y=1.0, **rows)
    down = ask("wall-persistence", {"strength": 1.0}, TAU_X=0.0, TAU_Y=-1.0, **rows)
    assert up.factor(0.9) == pytest.approx(down.factor(0.9))
    assert up.factor(0.9) > up.factor(-0.9)


def test_fish_that_keep_their_way_turn_back_less(swim, two_rooms):
    """Share of steps within 7 cm of a wall that reverse the last one, over 4,000 s of five."""

    def reversals(xy, heading):
        by_wall = two_rooms.zone_of(xy[:-1]) == 2
        return (np.cos(heading[1:] - heading[:-1])[by_wall] < 0).mean()

    plain = reversals(*swim())
    assert reversals(*swim("wall-persistence", {"strength": 1.0})) < 0.5 * plain
    assert reversals(*swim("wall-persistence", {"strength": -0.5})) > 1.1 * plain


def test_a_drift_favours_its_direction(natural_model, two_rooms):
    """Along to against it, and along to across it: e^(2 s) and e^s times what they were."""
    ratios = []
    for effects in ({}, {"directional-drift": {"strength": 0.8, "direction_rad": math.pi / 2}}):
        _, density = heading_density(
            dataclasses.replace(natural_model, effects=effects), two_rooms, xy_m=[(0.2, 0.77)],
            heading_rad=[0.3], speed_m_s=0.0,
        )  # fmt: skip
        ratios.append(np.array([density[270] / density[90], density[270] / density[180]]))

    assert ratios[1] / ratios[0] == pytest.approx(np.exp([1.6, 0.8]), rel=1e-6)


@pytest.mark.parametrize(("speed_m_s", "exponent"), [(0.07, 0.6), (0.0175, 2.4), (0.001, 8.0)])
def test_a_current_carries_slow_fish_more(ask, speed_m_s, exponent):
    """Along to against at the inverse of the speed: four times as much at a quarter, 4 at most."""
    asked = ask("directional-drift", {"strength": 0.3, "direction_rad": 1.0, "by_slowness": 1.0})
    ratio = asked.factor(1.0, speed=speed_m_s) / asked.factor(1.0 + math.pi, speed=speed_m_s)
    assert ratio == pytest.approx(math.exp(exponent))
    alike = ask("directional-drift", {"strength": 0.3, "direction_rad": 1.0})
    assert alike.factor(2.0, speed=speed_m_s) == alike.factor(2.0, speed=0.2)


def test_fish_gather_where_they_drift(swim):
    """A drift up takes them to the upper room, one down to the lower; mean height in metres."""

    def height(strength, direction):
        given = {"strength": strength, "direction_rad": direction}
        return swim("directional-drift", given)[0][..., 1].mean()

    plain = height(0.0, 0.0)
    assert height(0.5, math.pi / 2) > plain + 0.05
    assert height(0.5, -math.pi / 2) < plain - 0.05


@pytest.mark.parametrize("strength", [0.6, -0.6])
def test_left_is_favoured_over_right(ask, strength):
    """A right angle to the left against one to the right: e^(2 s), whatever the heading."""
    for heading in (0.0, 2.0):
        asked = ask(
            "turning-bias", {"strength": strength}, HX=math.cos(heading), HY=math.sin(heading)
        )
        ratio = asked.factor(heading + math.pi / 2) / asked.factor(heading - math.pi / 2)
        assert ratio == pytest.approx(math.exp(2 * strength))
        assert asked.factor(heading) == pytest.approx(asked.factor(heading + math.pi))


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_left_can_be_left_of_the_way_along_the_wall(ask, sense):
    """45 degrees to the left of either sense against 45 to the right: e^(2 s), whichever way
    the fish swims; away from walls it is left of the heading.
    """
    rows = {"TAU_X": 1.0, "TAU_Y": 0.0, "HX": 0.0, "HY": sense, "FOLLOWS": [1.0, 0.0]}
    asked = ask("turning-bias", {"strength": 0.5, "along_walls": 1.0}, **rows)
    for along in (0.0, math.pi):
        ratio = asked.factor(along + math.pi / 4) / asked.factor(along - math.pi / 4)
        assert ratio == pytest.approx(math.e)
    left = math.pi / 2 * (1 + sense)
    assert asked.factor(left, i=1) / asked.factor(left + math.pi, i=1) == pytest.approx(math.e)


def test_biased_fish_turn_left(swim):
    """Mean sine of the turns; without the effect it is nothing."""

    def mean_turn(heading):
        return np.sin(np.diff(heading, axis=0)).mean()

    assert mean_turn(swim("turning-bias", {"strength": 0.8})[1]) > 0.03
    assert mean_turn(swim("turning-bias", {"strength": -0.8})[1]) < -0.03
    assert abs(mean_turn(swim()[1])) < 0.01


def test_a_turn_is_remembered(ask):
    """After a right angle to the left, once more against back: e^(2 s); after none, alike."""
    asked = ask("turning-memory", {"strength": 0.5}, PAST_HX=[0.0, 1.0], PAST_HY=[-1.0, 0.0])
    ratio = asked.factor(math.pi / 2) / asked.factor(-math.pi / 2)
    assert ratio == pytest.approx(math.exp(1.0))
    assert asked.factor(1.0, i=1) == pytest.approx(1.0)


def test_wide_turns_can_be_forgotten(ask):
    """After 60 degrees s sin 60 cos 60; after 120 degrees nothing."""
    turned = np.radians([-60.0, -120.0])
    rows = {"PAST_HX": np.cos(turned), "PAST_HY": np.sin(turned)}
    asked = ask("turning-memory", {"strength": 0.5, "forgets_wide": 1.0}, **rows)
    ratio = asked.factor(math.pi / 2) / asked.factor(-math.pi / 2)
    assert ratio == pytest.approx(math.exp(math.sqrt(3) / 4))
    assert asked.factor(1.0, i=1) == asked.factor(-1.0, i=1) == 1.0


def test_turns_to_one_side_come_in_series(swim):
    """Correlation of the sines of successive turns rises, or falls, against the base model's."""

    def correlation(heading):
        sines = np.sin(np.diff(heading, axis=0))
        return np.corrcoef(sines[:-1].ravel(), sines[1:].ravel())[0, 1]

    plain = correlation(swim()[1])
    assert correlation(swim("turning-memory", {"strength": 1.5})[1]) > plain + 0.05
    assert correlation(swim("turning-memory", {"strength": -1.5})[1]) < plain - 0.05


def test_fast_steps_are_straight(ask):
    """Straight on against right back at 0.12 and at 0.02 m/s: e^(2 s) and e^(-2 s)."""
    asked = ask("speed-turn-coupling", {"strength": 0.7})
    for speed, sign in ((0.12, 1.0), (0.07, 0.0), (0.02, -1.0)):
        ratio = asked.factor(0.0, speed=speed) / asked.factor(math.pi, speed=speed)
        assert ratio == pytest.approx(math.exp(1.4 * sign))


def test_fast_steps_can_be_closer_to_the_own_direction(ask):
    """A turn of two widths is less preferred than a wide one; steps at 0.12 m/s are one unit quick.

    By the chord of the turn over the width, squared: c, the log is 0.7 (1 - c) exp(-c / 2).
    """
    asked = ask("speed-turn-coupling", {"strength": 0.7, "local": 1.0, "width_rad": 0.2})

    def above(angle):
        return math.log(asked.factor(0.0, speed=0.12) / asked.factor(angle, speed=0.12))

    chord = 2 * math.sin(0.2) / 0.2
    assert above(0.4) == pytest.approx(0.7 * (1 + (chord**2 - 1) * math.exp(-(chord**2) / 2)))
    assert above(-0.4) == pytest.approx(above(0.4))
    assert above(2.0) == pytest.approx(0.7, abs=1e-6)
    slow = asked.factor(0.0, speed=0.02) / asked.factor(0.4, speed=0.02)
    assert math.log(slow) == pytest.approx(-above(0.4))


def test_along_a_wall_either_way_is_the_own_direction(ask):
    """The wall runs along y: headings up and down are alike, those beside them less."""
    rows = {"HX": [1.0], "HY": [0.0], "TAU_X": [0.0], "TAU_Y": [1.0], "FOLLOWS": [1.0]}
    given = {"strength": 0.7, "local": 1.0, "width_rad": 0.2}
    asked = ask("speed-turn-coupling", given, **rows)
    up, down = (asked.factor(sign * math.pi / 2, speed=0.12) for sign in (1, -1))
    assert up == pytest.approx(1.0)
    assert down == pytest.approx(up)
    assert asked.factor(math.pi / 2 + 0.4, speed=0.12) < 0.5


def test_a_kick_is_a_step_faster_than_the_last(ask):
    """At 0.12 m/s after 0.12 m/s nothing is preferred, after 0.07 m/s as one unit quicker.

    So it is where the last speed is not known: a middling one is taken.
    """
    for last, log_ratio in ((0.12, 0.0), (0.07, 1.4), (math.nan, 1.4), (-1.0, 1.4)):
        asked = ask("speed-turn-coupling", {"strength": 0.7, "kick": 1.0}, SPEED=[last])
        ratio = asked.factor(0.0, speed=0.12) / asked.factor(math.pi, speed=0.12)
        assert math.log(ratio) == pytest.approx(log_ratio)


def test_straight_on_can_go_by_the_speed_of_the_step_before(ask):
    """At 0.12 m/s by one unit, whatever the step's own speed; by nothing if that is not known."""
    for last, log_ratio in ((0.12, 1.4), (0.07, 0.0), (math.nan, 0.0), (-1.0, 0.0)):
        given = {"strength": 0.7, "last": 1.0, "kick": 1.0}
        asked = ask("speed-turn-coupling", given, SPEED=[last])
        ratio = asked.factor(0.0, speed=0.03) / asked.factor(math.pi, speed=0.03)
        assert math.log(ratio) == pytest.approx(log_ratio)


def test_wide_turns_can_follow_wide_ones(ask):
    """By the size of the last turn beyond 0.6 rad, to either side; not known, nothing."""
    given = {"strength": 0.8, "sizes": 1.0}
    for turn, off in ((1.0, 0.4), (-1.0, 0.4), (0.2, -0.4), (0.6, 0.0), (3.0, 2.4)):
        rows = {"PAST_HX": [math.cos(turn)], "PAST_HY": [-math.sin(turn)]}
        asked = ask("turning-memory", given, **rows)
        ratio = asked.factor(0.0) / asked.factor(math.pi / 2)
        assert math.log(ratio) == pytest.approx(-0.8 * off)
        assert asked.factor(1.3) == pytest.approx(asked.factor(-1.3))
        assert max(asked.factor(angle) for angle in np.linspace(-np.pi, np.pi, 41)) <= 1 + 1e-12
    for rows in ({"PAST_HX": [0.0]}, {"PAST_HX": [0.0], "PAST_HY": [1.0], "FOLLOWS": [1.0]}):
        none = ask("turning-memory", given, **rows)
        assert none.factor(0.0) == none.factor(2.0) == 1.0


def test_fish_slow_down_in_turns(swim):
    """Correlation of a step's speed with the cosine of its turn, beyond the base model's."""

    def correlation(xy, heading):
        speed = np.linalg.norm(np.diff(xy, axis=0), axis=-1)
        return np.corrcoef(speed.ravel(), np.cos(np.diff(heading, axis=0)).ravel())[0, 1]

    plain = correlation(*swim())
    assert correlation(*swim("speed-turn-coupling", {"strength": 1.0})) > plain + 0.1
    assert correlation(*swim("speed-turn-coupling", {"strength": -1.0})) < plain - 0.1

"""Effects of neighbours on the heading do what their sentences say."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from scipy import stats

from zfcal.model.effects import find_effect
from zfcal.model.features import OneOf
from zfcal.model.onestep import heading_density

HERE = (0.20, 0.77)
LEVEL = {"heading_rad": [0.0, 1.0], "speed_m_s": 0.0}


@pytest.fixture
def density(natural_model, two_rooms):
    """Return a function: density of agent 0's heading with one effect."""

    def with_effect(effects, xy_m, heading_rad):
        model = dataclasses.replace(natural_model, effects=effects)
        return heading_density(model, two_rooms, xy_m=xy_m, heading_rad=heading_rad, speed_m_s=0.0)

    return with_effect


def test_cohesion_points_to_the_middle_of_all_others_seen_or_not(density):
    """Three others behind, unseen: a von Mises about their centroid of weight 2 / (1 + 2)."""
    xy = [HERE, (0.10, 0.77), (0.12, 0.80), (0.06, 0.66)]
    heading = [0.0, 1.0, 2.0, 3.0]

    theta, alone = density({}, xy, heading)
    _, found = density({"group-cohesion": {"weight": 2.0, "kappa": 6.0}}, xy, heading)

    x, y = np.mean(xy[1:], axis=0) - HERE
    toward = stats.vonmises(6.0, loc=math.atan2(y, x)).pdf(theta)
    assert found == pytest.approx((alone + 2.0 * toward) / 3.0, abs=1e-6)


def test_cohesion_grows_up_to_its_whole_distance(ask):
    """The centroid at 0.3 m of 0.6 m: half the weight; the absent do not count."""
    asked = ask(
        "group-cohesion", {"weight": 4.0, "full_m": 0.6},
        X=[0.0, 0.2, 0.4, 9.0], ZONE=[3.0, 3.0, 3.0, 0.0],
    )  # fmt: skip
    weight, (x, y, _) = asked.component()
    assert weight == pytest.approx(2.0)
    assert (x, y) == pytest.approx((1.0, 0.0))


def test_cohesive_fish_are_closer_together(swim):
    """Median distance between two of five fish over 4,000 s falls by a third or more."""

    def spread(xy):
        return np.median(
            np.linalg.norm(xy[:, :, None] - xy[:, None], axis=-1)[:, ~np.eye(5, dtype=bool)]
        )

    plain, _ = swim()
    near, _ = swim("group-cohesion", {"weight": 1.0, "kappa": 4.0})
    assert spread(near) < 0.67 * spread(plain)


def test_beyond_its_range_a_neighbour_is_ignored(density):
    """Range 0.1 m: at 0.18 m the fish swims as if alone, at 0.05 m as without the effect."""
    effect = {"interaction-range": {"ignored": 1.0, "range_m": 0.1}}
    far, near = [HERE, (0.33, 0.64)], [HERE, (0.24, 0.80)]
    _, alone = density({}, [HERE], [0.0])

    assert density(effect, far, [0.0, 1.0])[1] == pytest.approx(alone, abs=0.003)
    assert density(effect, near, [0.0, 1.0])[1] == pytest.approx(
        density({}, near, [0.0, 1.0])[1], rel=0.01
    )


def test_at_the_range_half_of_the_attention_is_left(ask):
    """And with half of it ignored, three quarters."""
    rows = {"X": [0.0, 0.12]}
    assert ask("interaction-range", {"range_m": 0.12}, **rows).sight_of(1) == pytest.approx(0.5)
    half = ask("interaction-range", {"range_m": 0.12, "ignored": 0.5}, **rows)
    assert half.sight_of(1) == pytest.approx(0.75)


def test_a_sharp_range_ends_within_a_centimetre(ask):
    """Half of what is ignored is lost at the range, hardly anything or nearly all 1 cm off it."""
    given = {"range_m": 0.12, "ignored": 0.5, "sharp": 1.0}
    left = [
        ask("interaction-range", given, X=[0.0, away_m]).sight_of(1)
        for away_m in (0.11, 0.12, 0.13, 9.0)
    ]
    assert left == pytest.approx([1.0, 0.75, 0.5, 0.5], abs=0.01)


def test_behind_the_narrower_field_a_neighbour_is_not_seen(density):
    """Field of 90 degrees: at 115 degrees the fish swims as if alone, at 60 as without it."""
    effect = {"rear-blind-zone": {"ignored": 1.0, "fov_rad": math.pi / 2}}

    def beside(degrees):
        angle = math.radians(degrees)
        return [HERE, (HERE[0] + 0.06 * math.cos(angle), HERE[1] + 0.06 * math.sin(angle))]

    _, alone = density({}, [HERE], [0.0])
    behind, ahead = beside(115.0), beside(60.0)
    assert density(effect, behind, [0.0, 1.0])[1] == pytest.approx(alone, abs=0.003)
    assert density({}, behind, [0.0, 1.0])[1] != pytest.approx(alone, abs=0.05)
    assert density(effect, ahead, [0.0, 1.0])[1] == pytest.approx(
        density({}, ahead, [0.0, 1.0])[1], rel=0.01
    )


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_the_blind_zone_is_the_same_on_both_sides(ask, side):
    """At the field's edge half of the attention is left."""
    asked = ask("rear-blind-zone", {"fov_rad": math.pi / 2}, X=[0.3, 0.3], Y=[0.0, side * 0.1])
    assert asked.sight_of(1) == pytest.approx(0.5)


def test_a_fast_neighbour_gets_more_attention(ask):
    """0.12 m/s is one unit above 0.07: e^0.7; a slow one gets less, the usual one the usual."""
    asked = ask("leader-following", {"strength": 0.7}, SPEED=[0.0, 0.12, 0.07, 0.02])
    assert asked.sight_of(1) == pytest.approx(math.exp(0.7))
    assert asked.sight_of(2) == pytest.approx(1.0)
    assert asked.sight_of(3) == pytest.approx(math.exp(-0.7))


def test_fish_follow_the_fast(swim, bearings):
    """How much nearer to its bearing a fish heads for each m/s that another is faster.

    Mean over 6 x 20,000 pairs; without the effect it is nothing within four standard errors.
    """

    def slope(xy, heading):
        toward, _ = bearings(xy[1:-1])
        speed = np.linalg.norm(xy[1:-1] - xy[:-2], axis=-1) / 0.2
        cosine = np.cos(heading[2:, :, None] - toward)
        others = ~np.eye(3, dtype=bool)
        v = np.broadcast_to(speed[:, None, :], cosine.shape)[:, others].ravel()
        c = cosine[:, others].ravel()
        result = stats.linregress(v, c)
        return result.slope, result.stderr

    led, error = slope(*swim("leader-following", {"strength": 2.0}, n_agents=3))
    plain, plain_error = slope(*swim(n_agents=3))
    assert led > 6 * error
    assert abs(plain) < 4 * plain_error


def test_late_fish_head_for_where_others_were(swim, bearings):
    """A second late: the bearing of five steps ago fits better than that of now.

    Without a delay it is the other way round.
    """

    def fit(xy, heading, late):
        dx = xy[5 - late : len(xy) - 1 - late, ::-1] - xy[5:-1]
        away = np.linalg.norm(dx, axis=-1)
        close = (away > 0.03) & (away < 0.2)
        return np.cos(heading[6:] - np.arctan2(dx[..., 1], dx[..., 0]))[close].mean()

    late = swim("reaction-delay", {"delay_s": 1.0}, n_agents=2)
    prompt = swim(n_agents=2)
    assert fit(*late, 5) > fit(*late, 0) + 0.02
    assert fit(*prompt, 0) > fit(*prompt, 5) + 0.02


def test_attention_fades_over_the_trial(ask):
    """Three per hour: from e^0 at 900 s to e^-1.5 half an hour later; negative rises."""
    for sign in (1.0, -1.0):
        asked = ask("habituation", {"per_hour": 3.0 * sign}, TIME=[900.0, 2700.0])
        assert asked.sight_of(1, i=0) == pytest.approx(1.0)
        assert asked.sight_of(0, i=1) == pytest.approx(math.exp(-1.5 * sign))


def test_habituated_fish_drift_apart(swim, bearings):
    """Ten per hour for an hour: in the last third fish head less for each other than in the
    first third. The difference without the effect stays below half of that.
    """

    def change(xy, heading):
        toward, away = bearings(xy[:-1])
        cosine = np.cos(heading[1:, :, None] - toward)
        third = len(cosine) // 3
        close = (away > 0.03) & (away < 0.15)
        return cosine[:third][close[:third]].mean() - cosine[-third:][close[-third:]].mean()

    tired = change(*swim("habituation", {"per_hour": 10.0}, n_steps=18_000))
    plain = change(*swim(n_steps=18_000))
    assert tired > 0.03
    assert abs(plain) < tired / 2


def test_the_robot_gets_less_attention_than_a_fish(ask):
    """e^-1 for agent 2, a robot; a fish gets what it had."""
    asked = ask("robot-avoidance", {"strength": 1.0}, KIND=[0.0, 0.0, 1.0])
    assert asked.sight_of(1) == pytest.approx(1.0)
    assert asked.sight_of(2) == pytest.approx(math.exp(-1.0))


def test_fish_flee_the_robot(ask):
    """At 0.1 m: away from it to toward it as e^(2 s / e); its attention stays; fish do nothing."""
    rows = {"X": [0.0, 0.1], "KIND": [0.0, 1.0]}
    asked = ask("robot-avoidance", {"strength": 1.5, "flight": 1.0}, **rows)
    assert asked.sight_of(1) == pytest.approx(1.0)
    assert asked.factor(math.pi) / asked.factor(0.0) == pytest.approx(
        math.exp(2 * 1.5 * math.exp(-1.0))
    )
    assert asked.factor(0.3, i=1) == pytest.approx(1.0)
    sought = ask("robot-avoidance", {"strength": -1.5, "flight": 1.0}, **rows)
    assert sought.factor(0.0) > sought.factor(math.pi)


@pytest.mark.parametrize("flight", [0.0, 1.0])
def test_fish_keep_away_from_the_robot(swim, bearings, flight):
    """Within 3 to 12 cm they head less for it than for another fish; without, as much."""

    def preference(xy, heading):
        toward, away = bearings(xy[:-1])
        cosine = np.cos(heading[1:, :, None] - toward)[:, :4]
        close = ((away > 0.03) & (away < 0.12))[:, :4]
        fish = close & (np.arange(5) < 4)
        return cosine[..., 4][close[..., 4]].mean() - cosine[fish].mean()

    shunned = swim("robot-avoidance", {"strength": 2.0, "flight": flight}, n_robots=1)
    assert preference(*shunned) < -0.05
    assert abs(preference(*swim(n_robots=1))) < 0.03


@pytest.mark.parametrize("reach_m", [0.06, 0.1, 0.14, 0.2])
@pytest.mark.parametrize(("lag", "steps"), [("half a step", 0.5), ("a step", 1.0)])
def test_those_beyond_a_distance_are_late_and_all_others_are_not(seen, reach_m, lag, steps):
    """What is seen late takes the place of what is seen at once, of far ones alone."""
    (choice,) = (
        each
        for each in find_effect("reaction-delay").features(None)
        if isinstance(each, OneOf) and each.kind == "sight, beyond a distance"
    )
    (own,) = (
        each for each in choice.features if each.label == f"{lag}, sight, beyond {reach_m:g} m"
    )
    far = seen.distance_m > reach_m
    assert far.any()
    assert not far.all()
    assert own.weights(seen)[..., 0] == pytest.approx(far * seen.attention_ago(steps))
    assert own.instead(seen)[..., 0] == pytest.approx(far * seen.attention)
    toward = own.toward(seen) if callable(own.toward) else getattr(seen, own.toward)
    late = seen.half_toward if steps < 1 else seen.sight_ago(steps)
    np.testing.assert_array_equal(toward, late)

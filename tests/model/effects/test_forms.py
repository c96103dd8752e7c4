"""Further forms of effects: those that features find, and that models have then."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from scipy import stats

from zfcal.model.effects.base import NEIGHBOURS
from zfcal.model.kernels.geometry import nearest_wall
from zfcal.model.onestep import draw_headings, heading_density
from zfcal.model.packing import pack
from zfcal.model.tank import tank_of

HERE = (0.20, 0.77)
XY = [HERE, (0.26, 0.77), (0.20, 0.85), (0.10, 0.77)]
"""One ahead, one to the left and a bit farther, one behind who is not seen."""

HEADING = [0.0, 1.0, 2.0, 3.0]


@pytest.fixture
def density(natural_model, two_rooms):
    """Return what gives headings, and their density for agent 0 with some effects."""

    def of(effects):
        model = dataclasses.replace(natural_model, effects=effects)
        return heading_density(
            model, two_rooms, xy_m=XY, heading_rad=HEADING, speed_m_s=0.0
        )  # fmt: skip

    return of


def bell(theta, at, kappa):
    """Return a von Mises density."""
    return stats.vonmises(kappa, loc=at).pdf(theta)


def test_fish_can_be_drawn_to_each_that_they_see(density):
    """Two are seen: two components, each of the weight; of the unseen one nothing."""
    theta, alone = density({})
    _, found = density({"group-cohesion": {"weight": 1.5, "kappa": 6.0, "each": 1.0}})
    base = sightless(alone, found, theta, [0.0, math.pi / 2], [1.5, 1.5], 6.0)
    assert base > 1.0


def sightless(alone, found, theta, ways, weights, kappa):
    """Return the base's whole weight, for which the components are the rest of a density."""
    more = sum(w * bell(theta, at, kappa) for w, at in zip(weights, ways, strict=True))
    # found (base + all) = alone base + more; least squares give the base.
    off = found - alone
    base = float(((more - found * sum(weights)) * off).sum() / (off * off).sum())
    np.testing.assert_allclose(found * (base + sum(weights)), alone * base + more, atol=1e-5)
    return base


def test_the_pull_of_each_grows_with_its_distance(density):
    """Within 0.6 m those at 6 and 8 cm have a tenth and 2 / 15 of the weight."""
    theta, alone = density({})
    given = {"weight": 3.0, "kappa": 6.0, "each": 1.0, "full_m": 0.6}
    _, found = density({"group-cohesion": given})
    sightless(alone, found, theta, [0.0, math.pi / 2], [0.3, 0.4], 6.0)


@pytest.mark.parametrize(
    ("form", "ways", "weights"),
    [
        ({"among": 1.0}, [1.0], [0.4]),
        ({"among": 2.0, "grading": 0.0}, [1.0, 2.0], [0.4, 0.4]),
    ],
    ids=str,
)
def test_fish_can_align_with_the_nearest_or_with_each(density, form, ways, weights):
    """About the heading of the nearest alone, or of each that is seen: 40 per 0.01 sr."""
    theta, alone = density({})
    _, found = density({"alignment": {"weight": 40.0, "kappa": 6.0, **form}})
    sightless(alone, found, theta, ways, weights, 6.0)


def test_each_can_count_by_how_large_it_is_seen(ask):
    """The second nearest at 0.02 sr: weight 20 makes 0.4, about its heading."""
    rows = {"X": [0.0, 0.1, 0.2], "HX": [1.0, 0.0, -1.0], "HY": [0.0, 1.0, 0.0]}
    asked = ask("alignment", {"weight": 20.0, "among": 2.0}, **rows)
    asked.sight[0, 2] = 0.02
    asked.parameters[7] = 2.0
    weight, (x, y, _) = asked.component()
    assert weight == pytest.approx(0.4)
    assert (x, y) == (-1.0, 0.0)
    asked.parameters[7] = 3.0
    assert asked.component()[0] == 0.0


def test_only_what_has_a_component_for_each_is_called_so_often(natural_model, two_rooms):
    """Once for the mean; once and eight times for each, on numbers of their own."""

    def calls(**given):
        effects = {"alignment": given, "group-cohesion": {}}
        packed = pack([dataclasses.replace(natural_model, effects=effects)], two_rooms)
        return packed.components[:, 1].tolist(), packed.effects.shape[1]

    assert calls() == ([0, 1], 2)
    assert calls(among=1.0) == ([0, 1, *range(2, 2 + NEIGHBOURS)], 2 + NEIGHBOURS)


def test_fish_drawn_to_each_head_where_the_density_says(natural_model, two_rooms):
    """Draws against the density: laws 2 % apart at most."""
    effects = {"group-cohesion": {"weight": 1.0, "kappa": 6.0, "each": 1.0}}
    model = dataclasses.replace(natural_model, effects=effects)
    state = {"xy_m": XY, "heading_rad": HEADING, "speed_m_s": 0.02}
    theta, found = heading_density(model, two_rooms, **state)
    drawn = np.sort(draw_headings(model, two_rooms, n=20_000, seed=3, **state))
    below = np.interp(drawn, theta, np.cumsum(found) * (theta[1] - theta[0]))
    assert np.abs(below - (np.arange(len(drawn)) + 0.5) / len(drawn)).max() < 0.02


def test_one_fish_can_be_followed_whatever_its_speed(ask):
    """It gets e^1 of the attention; the others as much as ever."""
    asked = ask("leader-following", {"strength": 1.0, "who": 2.0}, SPEED=[0.1, 0.2, 0.01])
    assert [asked.sight_of(j) for j in (1, 2)] == pytest.approx([1.0, math.e])


def test_the_fastest_in_view_can_be_followed(ask):
    """Not the fastest of all, whom nobody sees."""
    asked = ask("leader-following", {"strength": 1.0, "fastest": 1.0}, SPEED=[0.1, 0.05, 0.06, 0.2])
    asked.sight[0, 3] = 0.0
    assert [asked.sight_of(j) for j in (1, 2)] == pytest.approx([1.0, math.e])


def test_some_headings_can_be_drawn_to_the_way_out(ask):
    """A second after another left, of a memory of four: 0.2 about the mouth's direction."""
    rows = {"ROOM": 1.0, "MOUTH_X": 0.6, "MOUTH_Y": 0.8, "MOUTH_M": 0.3, "LEFT_S": 1.0}
    given = {"strength": 2.0, "memory_s": 4.0, "drawn": 1.0}
    asked = ask("collective-departure", given, **rows)
    weight, (x, y, kappa) = asked.component()
    assert weight == pytest.approx(0.2, rel=0.01)
    assert (x, y, kappa) == (0.6, 0.8, 3.0)
    assert asked.factor(1.0) == 1.0
    late = ask("collective-departure", given, **(rows | {"LEFT_S": 60.0}))
    assert late.component()[0] == 0.0


@pytest.mark.parametrize("strength", [2.0, -2.0])
def test_some_headings_can_be_drawn_from_the_robot_or_to_it(ask, strength):
    """From the nearest that is seen and close; it gets the attention of a fish."""
    given = {"strength": strength, "drawn": 1.0, "reach_m": 0.2, "kappa": 7.0}
    rows = {"X": [0.0, 0.05, -0.3], "KIND": [0.0, 1.0, 1.0]}
    asked = ask("robot-avoidance", given, **rows)
    weight, (x, y, kappa) = asked.component()
    assert weight == pytest.approx(0.2, rel=0.01)
    assert (x, y, kappa) == (-math.copysign(1.0, strength), 0.0, 7.0)
    assert asked.sight_of(1) == 1.0
    assert asked.factor(1.0) == pytest.approx(1.0)
    asked.sight[0, 1] = 0.0
    assert asked.component()[0] < 0.01


@pytest.mark.parametrize(
    ("form", "follows", "turned"),
    [
        ({}, 0.0, 0.1 * 2.0 * math.pi / 4),
        ({"forgets_wide": 1.0}, 0.0, 0.1 * 2.0 * math.pi / 4 * math.cos(math.pi / 4)),
        ({}, 1.0, 0.0),
        ({"along_walls": 1.0}, 1.0, 0.1 * 2.0 * math.pi / 4),
    ],
    ids=str,
)
def test_a_share_of_the_last_turn_can_be_gone_on_with(ask, form, follows, turned):
    """A tenth per strength; by a cosine less after wide turns; along walls only if it says so."""
    side = math.sqrt(0.5)
    asked = ask(
        "turning-memory", {"strength": 2.0, "turning": 1.0, **form},
        HX=side, HY=side, PAST_HX=1.0, FOLLOWS=follows,
    )  # fmt: skip
    assert asked.rotation() == pytest.approx(turned)
    assert asked.factor(2.0) == 1.0


@pytest.mark.parametrize(("back", "weight"), [(0.0, 0.0), (1.0, 0.2)])
def test_one_that_came_back_has_left_all_the_same(ask, back, weight):
    """It is in the room again, a second after it had left that."""
    rows = {
        "X": [0.0, 0.1], "ROOM": 1.0, "MOUTH_X": 1.0, "MOUTH_M": 0.3, "TIME": 50.0,
        "LEFT_FROM": [0.0, 1.0], "LEFT_AT_S": [-1e9, 49.0],
    }  # fmt: skip
    given = {"strength": 2.0, "memory_s": 4.0, "drawn": 1.0, "back": back}
    asked = ask("collective-departure", given, **rows)
    assert asked.component()[0] == pytest.approx(weight, rel=0.01)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_some_headings_can_be_drawn_to_a_side(ask, side):
    """Left of a heading upward is the way to -x; not along a wall."""
    given = {"strength": side * 2.0, "drawn": 1.0}
    weight, (x, y, kappa) = ask("turning-bias", given, HX=0.0, HY=1.0).component()
    assert (weight, x, y, kappa) == pytest.approx((0.2, -side, 0.0, 4.0))
    assert ask("turning-bias", given, FOLLOWS=1.0).component()[0] == 0.0
    assert ask("turning-bias", given).factor(1.0) == 1.0


@pytest.mark.parametrize(("strength", "toward"), [(2.0, math.pi / 2), (-2.0, 0.0)])
def test_some_headings_can_be_drawn_on_as_a_fish_turned(ask, strength, toward):
    """After 45 degrees to the left: 45 more, or back again."""
    side = math.sqrt(0.5)
    asked = ask(
        "turning-memory", {"strength": strength, "drawn": 1.0}, HX=side, HY=side, PAST_HX=1.0
    )
    weight, (x, y, kappa) = asked.component()
    assert (weight, kappa) == pytest.approx((0.2, 9.0))
    assert (x, y) == pytest.approx((math.cos(toward), math.sin(toward)))
    assert ask("turning-memory", {"strength": strength, "drawn": 1.0}).component()[0] == 0.0


def test_nobody_of_unknown_speed_is_the_fastest(ask):
    """One that has just come into sight has none yet."""
    asked = ask("leader-following", {"strength": 1.0, "fastest": 1.0}, SPEED=[0.1, math.nan, 0.06])
    assert [asked.sight_of(j) for j in (1, 2)] == pytest.approx([1.0, math.e])


def test_who_has_no_speed_yet_is_as_fast_as_most(ask):
    """Neither slow, as one that stands, nor fast."""
    asked = ask("leader-following", {"strength": 1.0}, SPEED=[0.1, math.nan, 0.02])
    assert [asked.sight_of(j) for j in (1, 2)] == pytest.approx([1.0, math.exp(-1)])


def test_some_headings_can_be_drawn_to_the_fastest_within_reach(ask):
    """The one at 0.2 m is faster still and too far: 0.1 about the bearing of that at 0.1 m."""
    rows = {"X": [0.0, 0.1, 0.0, 0.2], "Y": [0.0, 0.0, 0.05, 0.0], "SPEED": [0.3, 0.1, 0.05, 0.2]}
    given = {"strength": 1.0, "drawn": 1.0, "reach_m": 0.15, "kappa": 6.0}
    asked = ask("leader-following", given, **rows)
    weight, (x, y, kappa) = asked.component()
    assert (weight, x, y, kappa) == pytest.approx((0.1, 1.0, 0.0, 6.0))
    assert asked.sight_of(1) == 1.0
    asked = ask("leader-following", {**given, "reach_m": 0.02}, **rows)
    assert asked.component()[0] == 0.0


def test_some_headings_can_be_drawn_to_who_was_faster_lately(ask):
    """The fastest in view and within reach, whatever its last step; nobody who was slower."""
    rows = {
        "X": [0.0, 0.1, 0.0, 0.3, -0.1], "Y": [0.0, 0.0, 0.05, 0.0, 0.0],
        "SPEED": [0.1, 0.01, 0.2, 0.2, 0.2], "LATELY": [0.05, 0.1, 0.07, 0.2, 0.3],
    }  # fmt: skip
    given = {"strength": 1.0, "drawn": 1.0, "lately": 1.0, "reach_m": 0.2, "kappa": 6.0}
    asked = ask("leader-following", given, **rows)
    asked.sight[0, 4] = 0.0
    weight, out = asked.component()
    assert (weight, *out) == pytest.approx((0.1, 1.0, 0.0, 6.0))
    assert asked.sight_of(1) == 1.0
    asked = ask("leader-following", given, **{**rows, "LATELY": [0.4, 0.1, 0.07, 0.2, 0.3]})
    assert asked.component()[0] == 0.0


def test_who_was_the_fastest_lately_can_be_followed(ask):
    """Whoever was the fastest at the last step."""
    given = {"strength": 1.0, "fastest": 1.0, "lately": 1.0}
    rows = {"SPEED": [0.1, 0.2, 0.1], "LATELY": [0.3, 0.1, 0.2]}
    asked = ask("leader-following", given, **rows)
    assert [asked.sight_of(j) for j in (1, 2)] == pytest.approx([1.0, math.e])


def test_who_has_no_mean_speed_yet_neither_leads_nor_follows_the_faster(ask):
    """A mean of 0 is that of who has just come, or has not moved since."""
    given = {"strength": 1.0, "fastest": 1.0, "lately": 1.0}
    asked = ask("leader-following", given, SPEED=[0.1, 0.1, 0.1], LATELY=[0.3, 0.0, 0.0])
    assert [asked.sight_of(j) for j in (1, 2)] == pytest.approx([1.0, 1.0])
    given = {"strength": 1.0, "drawn": 1.0, "lately": 1.0, "reach_m": 2.0}
    rows = {"X": [0.0, 0.1, 0.0], "Y": [0.0, 0.0, 0.05], "SPEED": [0.1, 0.1, 0.1]}
    for own, weight in ((0.0, 0.0), (0.01, 0.1)):
        asked = ask("leader-following", given, **rows, LATELY=[own, 0.2, 0.1])
        assert asked.component()[0] == pytest.approx(weight)


def test_some_headings_can_be_drawn_to_one_fish(ask):
    """Whatever its speed; nobody is drawn to oneself."""
    rows = {"X": [0.0, 0.1, 0.0], "Y": [0.0, 0.0, 0.05], "SPEED": [0.3, 0.1, 0.05]}
    asked = ask("leader-following", {"strength": 1.5, "drawn": 1.0, "who": 2.0}, **rows)
    weight, (x, y, _) = asked.component()
    assert (weight, x, y) == pytest.approx((0.15, 0.0, 1.0))
    asked = ask("leader-following", {"strength": 1.5, "drawn": 1.0, "who": 0.0}, **rows)
    assert asked.component()[0] == 0.0


def test_all_headings_can_lean_toward_that_of_the_nearest(density):
    """By 0.03 nats per weight: the density times exp(0.6 cos(heading - 1))."""
    theta, alone = density({})
    _, found = density({"alignment": {"weight": 20.0, "leaning": 1.0, "among": 1.0}})
    expected = alone * np.exp(0.6 * np.cos(theta - 1.0))
    np.testing.assert_allclose(found, expected / (expected.mean() / found.mean()), rtol=1e-3)


def test_fish_can_align_with_who_is_most_straight_ahead(ask):
    """Of two ahead the one in line, farther as it is; not beyond reach, and nobody behind."""
    rows = {
        "X": [0.0, 0.2, 0.05], "Y": [0.0, 0.01, 0.05], "HX": [1.0, 0.0, -1.0],
        "HY": [0.0, 1.0, 0.0],
    }  # fmt: skip
    given = {"weight": 20.0, "kappa": 6.0, "among": 3.0}
    asked = ask("alignment", {**given, "reach_m": 0.4}, **rows)
    weight, (x, y, kappa) = asked.component()
    assert (weight, x, y, kappa) == pytest.approx((0.2, 0.0, 1.0, 6.0))
    assert ask("alignment", {**given, "reach_m": 0.15}, **rows).component()[0] == 0.0
    behind = {**rows, "X": [0.0, -0.2, -0.05]}
    assert ask("alignment", {**given, "reach_m": 0.4}, **behind).component()[0] == 0.0


@pytest.mark.parametrize("name", ["burst-and-coast", "speed-matching"])
def test_speeds_can_go_by_a_speed_evenly(ask, name):
    """0.05 m/s above the usual speed: e^0.4; a power of it would be (12 / 7)^0.4."""
    rows = {"X": [0.0, 0.1], "SPEED": [0.12, 0.12]}
    even = ask(name, {"exponent": 0.4, "evenly": 1.0}, **rows)
    assert even.speed() == pytest.approx(math.exp(0.4))
    assert ask(name, {"exponent": 0.4}, **rows).speed() == pytest.approx((12 / 7) ** 0.4)


@pytest.mark.parametrize("follows", [0.0, 1.0])
@pytest.mark.parametrize("strength", [0.5, -0.5])
def test_fish_may_turn_to_a_side(ask, strength, follows):
    """By a tenth of a radian per strength, along a wall too; none lean, and none are drawn."""
    asked = ask("turning-bias", {"strength": strength, "turning": 1.0}, FOLLOWS=follows)
    assert asked.rotation() == pytest.approx(0.1 * strength)
    assert asked.factor(1.0) == asked.factor(-1.0) == 1.0
    assert asked.component()[0] == 0.0
    assert ask("turning-bias", {"strength": strength}).rotation() == 0.0


WHOLE = {
    "directional-drift": ("strength", 1.0, {"direction_rad": math.pi / 2}, 1.0),
    "group-cohesion": ("weight", 1.0, {}, 1.0),
    "place-preference": (
        "strength", 1.0, {"x_m": 0.0, "y_m": 0.1, "reach_m": 2.0}, 0.1 / 0.12 / (1 + 0.05**4),
    ),
    "robot-avoidance": ("strength", -1.0, {}, math.exp(-1.0)),
}  # fmt: skip
"""Each with a pull of one to the left of a fish that swims along x, and what is left of it."""


@pytest.mark.parametrize("follows", [0.0, 1.0])
@pytest.mark.parametrize("name", WHOLE)
def test_all_directions_may_turn_to_something(ask, name, follows):
    """By a tenth of a radian, along walls too; the base's alone do not, and none lean or are drawn.

    In the other form the base's directions alone turn, and along walls headings lean.
    """
    key, sign, given, left = WHOLE[name]
    rows = {"X": [0.0, 0.0], "Y": [0.0, 0.1], "ZONE": 3.0, "FOLLOWS": follows, "KIND": [0.0, 1.0]}
    whole = ask(name, {key: sign, "turning": 2.0, **given}, HX=1.0, HY=0.0, **rows)
    assert whole.whole_rotation() == pytest.approx(0.1 * left)
    assert whole.rotation() == 0.0
    assert whole.factor(1.0) == whole.factor(-1.0) == 1.0
    assert whole.component()[0] == 0.0
    base = ask(name, {key: sign, "turning": 1.0, **given}, HX=1.0, HY=0.0, **rows)
    assert base.whole_rotation() == 0.0
    assert base.rotation() == pytest.approx(0.0 if follows else 0.1 * left)
    assert (base.factor(1.0) != base.factor(-1.0)) == bool(follows)


@pytest.mark.parametrize(
    ("drawn", "follows", "weight"), [(1, 0, 2), (1, 1, 2), (2, 0, 2), (2, 1, 0)]
)
def test_a_drift_may_be_off_the_walls_alone(ask, drawn, follows, weight):
    """Drawn there, and along a wall not at all."""
    given = {"strength": 2.0, "drawn": drawn}
    assert ask("directional-drift", given, FOLLOWS=float(follows)).component()[0] == weight


@pytest.mark.parametrize("strength", [0.7, -0.7])
def test_fish_may_keep_the_wall_on_one_side(ask, strength):
    """Along tau it has the wall on its left: so it goes for a bias to the right.

    A fish that turns left goes round a tank with the wall on its right.
    """
    given = {"strength": strength, "along_walls": 2.0}
    along = ask("turning-bias", given, FOLLOWS=1.0, TAU_X=0.0, TAU_Y=1.0)
    assert math.log(along.factor(math.pi / 2) / along.factor(-math.pi / 2)) == pytest.approx(
        -2 * strength
    )
    off = ask("turning-bias", given)
    assert off.factor(1.0) == off.factor(-1.0) == 1.0


def test_along_the_wall_is_with_the_wall_on_the_left(two_rooms):
    """Just below the wall at the top of the first room, and just right of that at its left."""
    tank = tank_of(two_rooms)
    left, _, right, top = two_rooms.outline.bounds
    assert right > left
    _, x, y = nearest_wall(0.22, top - 0.01, tank)
    assert (x, y) == pytest.approx((1.0, 0.0), abs=1e-6)
    for off_m in (0.01, 1e-6, 1e-10):
        _, x, y = nearest_wall(left + off_m, 0.75, tank)
        assert (x, y) == pytest.approx((0.0, 1.0), abs=1e-6)


def test_the_bold_may_swim_into_a_zone(ask):
    """Into the third: e^(2 s) for the bold, e^(-2 s) for the shy, wherever they are."""
    given = {"spread": 0.5, "heading_share": 0.0, "into_zone": 3.0}
    asked = ask("boldness", given, TRAIT=[1.0, -1.0, 0.0], CLEAR=0.1)
    for i, power in ((0, 1.0), (1, -1.0), (2, 0.0)):
        ratio = asked.factor(0.0, i=i, landing=3) / asked.factor(0.0, i=i, landing=2)
        assert ratio == pytest.approx(math.exp(power))


@pytest.mark.parametrize(("reach_m", "counts"), [(0.08, False), (0.25, True)])
def test_the_mean_heading_may_be_of_those_within_another_reach(ask, reach_m, counts):
    """Of one that swims up, 0.1 m away: leaned or turned toward where it is within reach alone."""
    rows = {
        "X": [0.0, 0.1],
        "Y": [0.0, 0.0],
        "HX": [1.0, 0.0],
        "HY": [0.0, 1.0],
        "ZONE": [3.0, 3.0],
    }
    leaning = ask("alignment", {"weight": 20.0, "leaning": 1.0, "reach_m": reach_m}, **rows)
    ratio = leaning.factor(math.pi / 2) / leaning.factor(-math.pi / 2)
    assert ratio == pytest.approx(math.exp(1.2) if counts else 1.0)
    turning = ask("alignment", {"weight": 20.0, "turning": 1.0, "reach_m": reach_m}, **rows)
    assert turning.rotation() == pytest.approx(0.2 * math.pi / 2 if counts else 0.0)


@pytest.mark.parametrize("theta", [0.0, 0.7, 2.0, -2.5])
def test_headings_may_lean_along_an_axis(ask, theta):
    """The direction and its opposite alike, by the cosine of twice the angle, and nothing else."""
    given = {"strength": 0.6, "direction_rad": 0.5, "axial": 1.0, "drawn": 1.0, "turning": 2.0}
    asked = ask("directional-drift", given)
    expected = math.exp(0.6 * math.cos(2 * (theta - 0.5)))
    assert asked.factor(theta) / asked.factor(0.5 + math.pi / 4) == pytest.approx(expected)
    assert asked.factor(theta + math.pi) == pytest.approx(asked.factor(theta))
    assert asked.rotation() == asked.whole_rotation() == asked.component()[0] == 0.0


@pytest.mark.parametrize("follows", [0.0, 1.0])
def test_all_directions_may_turn_as_others_swim(ask, follows):
    """A hundredth of the way per weight, along walls too; in the other form the base's alone."""
    rows = {"X": [0.0, 0.1], "Y": 0.0, "HX": [1.0, 0.0], "HY": [0.0, 1.0], "FOLLOWS": follows}
    whole = ask("alignment", {"weight": 8.0, "turning": 2.0}, **rows)
    assert whole.whole_rotation() == pytest.approx(0.08 * math.pi / 2)
    assert whole.rotation() == 0.0
    assert whole.factor(1.0) == whole.factor(-1.0) == 1.0
    base = ask("alignment", {"weight": 8.0, "turning": 1.0}, **rows)
    assert base.whole_rotation() == 0.0
    assert base.rotation() == pytest.approx(0.0 if follows else 0.08 * math.pi / 2)


def test_fish_may_be_drawn_to_the_fastest_in_view(ask):
    """Not to a faster one that is not seen."""
    asked = ask(
        "leader-following", {"strength": 1.5, "drawn": 1.0, "fastest": 1.0},
        X=[0.0, 0.1, 0.0, -0.1], Y=[0.0, 0.0, 0.2, 0.0], SPEED=[0.05, 0.08, 0.12, 0.2],
    )  # fmt: skip
    asked.sight[0, 3] = 0.0
    weight, out = asked.component()
    assert weight == pytest.approx(0.15)
    np.testing.assert_allclose(out, [0.0, 1.0, 5.0], atol=1e-12)
    asked.sight[0] = 0.0
    assert asked.component()[0] == 0.0


@pytest.mark.parametrize(
    ("other", "heading", "cosines"),
    [
        ((0.1, 0.0), 0.0, 1.0),
        ((0.1, 0.1), 0.6, math.cos(math.pi / 4) * math.cos(0.6)),
        ((-0.1, 0.0), 0.0, 0.0),
        ((0.1, 0.0), math.pi, 0.0),
    ],
)
def test_who_is_ahead_and_swims_the_same_way_gets_attention(ask, other, heading, cosines):
    """As much as both angles are small; whatever its speed."""
    asked = ask(
        "leader-following", {"strength": 0.8, "same_way": 1.0}, X=[0.0, other[0]],
        Y=[0.0, other[1]], HX=[1.0, math.cos(heading)], HY=[0.0, math.sin(heading)],
    )  # fmt: skip
    assert asked.sight_of(1) == pytest.approx(math.exp(0.8 * cosines))
    assert asked.component()[0] == 0.0


def test_fish_may_leave_a_room_that_a_robot_is_in(ask):
    """By e^(2 s) where a border is within reach; not for a robot elsewhere, nor for a fish."""
    given = {"strength": 0.9, "leaves": 1.0}
    rows = {"X": [0.0, 0.1, 0.2], "KIND": [0.0, 1.0, 0.0], "EXIT": 2.0, "MOUTH_M": 0.02}
    asked = ask("robot-avoidance", given, ROOM=[1.0, 1.0, 2.0], **rows)
    out, stay = (asked.factor(0.0, landing=zone) for zone in (2, 3))
    assert out / stay == pytest.approx(math.exp(2 * 0.9))
    assert asked.sight_of(1) == 1.0
    assert asked.factor(0.0, i=1, landing=2) == 1.0
    for room in ([1.0, 2.0, 1.0], [0.0, 0.0, 1.0]):
        elsewhere = ask("robot-avoidance", given, ROOM=room, **rows)
        assert elsewhere.factor(0.0, landing=2) == elsewhere.factor(0.0, landing=3) == 1.0
    inner = ask("robot-avoidance", given, ROOM=[1.0, 1.0, 2.0], **{**rows, "MOUTH_M": 0.2})
    assert inner.factor(0.0, landing=3) == 1.0
    gone = ask("robot-avoidance", given, ROOM=[1.0, 1.0, 2.0], **rows, ZONE=[3.0, 0.0, 3.0])
    assert gone.factor(0.0, landing=2) == gone.factor(0.0, landing=3)


def test_fish_may_leave_for_where_others_are(ask):
    """Two of three are in the other room; whenever they went."""
    given = {"strength": 1.2, "elsewhere": 1.0, "drawn": 1.0, "turning": 1.0}
    rows = {"X": [0.0, 0.1, 0.2, 0.3], "EXIT": 2.0, "MOUTH_X": 1.0, "MOUTH_Y": 0.0}
    asked = ask("collective-departure", given, ROOM=[1.0, 2.0, 2.0, 1.0], **rows)
    assert asked.factor(0.0) / asked.factor(math.pi) == pytest.approx(math.exp(2 * 1.2 * 2 / 3))
    assert asked.rotation() == asked.component()[0] == 0.0
    alone = ask("collective-departure", given, ROOM=1.0, **rows)
    assert alone.factor(0.0) == alone.factor(math.pi)
    between = ask("collective-departure", given, ROOM=[0.0, 2.0, 2.0, 1.0], **rows)
    assert between.factor(0.0) == 1.0

"""Effects whose strength goes by something: time, speed, turn, zone, company, the other."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from zfcal.errors import InputError
from zfcal.model.effects import all_effects, find_effect
from zfcal.model.effects.genome import from_genome, genome_names, spelt_out, to_genome
from zfcal.model.extended import maximise
from zfcal.model.kernels import curves, state
from zfcal.model.kernels.curves import LEVELS, level_of, strengths_at
from zfcal.model.kernels.state import cue_of
from zfcal.model.onestep import heading_density
from zfcal.model.packing import pack

AWAY_M = [(0.20, 0.77), (0.23, 0.77), (0.20, 0.87)]
"""Three fish: the first one's neighbours are 3 cm ahead and 10 cm to its left."""


def curve(by, knots, more_1=0.0, more_3=0.0):
    """Return the parameters of a curve."""
    return {
        "by": float(by), "knot_1": knots[0], "knot_2": knots[1], "knot_3": knots[2],
        "more_1": more_1, "more_3": more_3,
    }  # fmt: skip


@pytest.fixture
def agents():
    """Return the state of three agents at `AWAY_M`, and solid angles; the first one sees both."""
    made = np.zeros((state.STATES, 3))
    made[[state.X, state.Y]] = np.transpose(AWAY_M)
    made[state.HX], made[state.PAST_HY] = 1.0, -1.0
    made[state.ZONE], made[state.TIME], made[state.SPEED] = 2.0, 90.0, 0.07
    sight = np.zeros((3, 3))
    sight[0, 1:] = 0.01
    return made, sight.ravel()


@pytest.mark.parametrize(
    ("cue", "j", "expected"),
    [
        (curves.BY_TIME, -1, 90.0),
        (curves.BY_SPEED, -1, 0.07),
        (curves.BY_TURN, -1, math.pi / 2),
        (curves.BY_ZONE, -1, 2.0),
        (curves.BY_NUMBER, -1, 2.0),
        (curves.BY_NEAREST, 2, 0.03),
        (curves.BY_DISTANCE, 2, 0.1),
        (curves.BY_DISTANCE, -1, 0.03),
        (curves.BY_BEARING, 2, math.pi / 2),
        (curves.BY_BEARING, -1, 0.0),
    ],
)
def test_a_cue_is_what_it_is_called(agents, cue, j, expected):
    """Of agent 0; without a neighbour that is attended to, of its nearest one."""
    assert cue_of(cue, *agents, 0, j) == pytest.approx(expected)


@pytest.mark.parametrize("cue", [curves.BY_NEAREST, curves.BY_DISTANCE, curves.BY_BEARING])
def test_who_is_alone_is_far_from_all(agents, cue):
    """Whoever is not there has zone 0."""
    agents[0][state.ZONE, 1:] = 0.0
    assert cue_of(cue, *agents, 0, -1) == state.NEVER_S


def test_levels_are_even_between_knots_and_end_at_them():
    """Half-way to the middle one there are as many levels as after it."""
    knots = (1.0, 2.0, 10.0)
    found = [level_of(value, *knots) for value in (-5.0, 1.0, 1.5, 2.0, 6.0, 10.0, 1e9)]
    assert found == [0, 0, LEVELS // 4, LEVELS // 2, 3 * LEVELS // 4, LEVELS - 1, LEVELS - 1]
    # Of what nobody knows there is a level all the same: another one would be no row.
    assert level_of(math.nan, *knots) == 0


def test_a_strength_stays_within_its_bounds():
    """Which are those of the effect, here 0 to 1: straight between the knots, cut beyond."""
    found = strengths_at({"more_1": -0.4, "more_3": 2.0}, 0.5, (0.0, 1.0))
    assert found[[0, LEVELS // 4, LEVELS // 2]] == pytest.approx([0.1, 0.3, 0.5])
    assert found[-1] == 1.0


CASES = {
    "sight by distance": ("habituation", {"per_hour": 9.0}, curves.BY_DISTANCE, (0.03, 0.1)),
    "sight by bearing": ("rear-blind-zone", {"ignored": 0.4}, curves.BY_BEARING, (0.0, 1.2)),
    "tilt by the nearest": ("turning-bias", {"strength": 0.4}, curves.BY_NEAREST, (0.01, 0.03)),
    "component by number": ("alignment", {"weight": 9.0}, curves.BY_NUMBER, (1.0, 2.0)),
    "a component of each by nearest": (
        "group-cohesion",
        {"weight": 1.0, "each": 1.0},
        curves.BY_NEAREST,
        (0.01, 0.04),
    ),
    "turn by speed": ("alignment", {"weight": 9.0, "turning": 1.0}, curves.BY_SPEED, (0.0, 0.05)),
}


@pytest.mark.parametrize("case", CASES)
def test_a_step_is_that_of_the_strength_at_its_cue(case, model, two_rooms):
    """By a curve that is flat it is the plain effect; by one that is not, another one."""
    name, given, by, (first, middle) = CASES[case]
    own = find_effect(name).strength
    seen = {"xy_m": AWAY_M, "heading_rad": [2.0, 1.0, 2.0], "speed_m_s": 0.05}

    def density(values):
        told = dataclasses.replace(model, effects={name: values})
        return heading_density(told, two_rooms, **seen)[1]

    plain = density(given)
    flat = density(given | curve(by, (first, middle, middle + 1.0)))
    assert flat == pytest.approx(plain, abs=1e-12)
    knots = (first, middle + 0.5 * (middle - first), middle + 1.0)
    bent = given | curve(by, knots, more_1=-given[own], more_3=given[own])
    assert np.abs(density(bent) - plain).max() > 1e-3


@pytest.mark.parametrize(
    ("knots", "ends", "strength"),
    [
        ((0.03, 0.1, 0.2), (0.5, 0.0), 0.9),
        ((0.02, 0.04, 0.2), (0.25, 0.0), 0.525),
        ((0.0, 0.01, 0.02), (0.0, -0.3), 0.1),
    ],
    ids=["at the first", "half-way to the middle", "beyond the last"],
)
def test_a_step_has_the_strength_of_its_place_on_the_curve(knots, ends, strength, model, two_rooms):
    """The nearest of the first fish is at 3 cm; at the middle knot the strength is 0.4."""
    bent = {"strength": 0.4} | curve(curves.BY_NEAREST, knots, *ends)
    seen = {"xy_m": AWAY_M, "heading_rad": [0.4, 1.0, 2.0], "speed_m_s": 0.05}
    found, expected = (
        heading_density(
            dataclasses.replace(model, effects={"turning-bias": values}), two_rooms, **seen
        )[1]
        for values in (bent, {"strength": strength})
    )
    assert found == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("case", ["time", "zone"])
def test_fish_with_a_curve_are_recovered(case, model, watch):
    """Five minutes of five fish that turn left at first and right at last, or by zone."""
    by, knots, more_1 = {
        "time": (curves.BY_TIME, (0.0, 150.0, 300.0), 1.0),
        # In the corridor there are too few steps to tell.
        "zone": (curves.BY_ZONE, (1.0, 2.0, 3.0), 0.0),
    }[case]
    truth = {"strength": 0.5} | curve(by, knots, more_1=more_1, more_3=-1.5)
    scene = watch({"turning-bias": truth}, seed=4)
    start = {"strength": 0.1} | curve(by, knots)
    free = [("turning-bias", key) for key in find_effect("turning-bias").free(start)]
    assert {("turning-bias", "more_1"), ("turning-bias", "more_3")} < set(free)
    fitted = {"strength", "more_3"} | ({"more_1"} if more_1 else set())
    free = tuple(pair for pair in free if pair[1] in fitted)

    found = maximise(scene, dataclasses.replace(model, effects={"turning-bias": start}), free=free)

    values = found.parameters.effects["turning-bias"]
    errors = np.sqrt(np.diag(found.covariance))
    for (_, key), error in zip(free, errors, strict=True):
        assert abs(values[key] - truth[key]) < 3.5 * error
        assert 0.01 < error < 0.4


def test_models_of_one_population_have_curves_of_their_own(model, two_rooms):
    """Their strengths differ, one of them has none: each has rows of its own."""
    bent = {"strength": 0.4} | curve(curves.BY_TIME, (0.0, 1.0, 2.0), more_3=0.2)
    models = [
        dataclasses.replace(model, effects={"turning-bias": values})
        for values in ({"strength": 0.1}, bent, bent | {"strength": -0.4})
    ]
    packed = pack(models, two_rooms)
    assert packed.curves[:, 0, curves.CUE].tolist() == [0.0, curves.BY_TIME, curves.BY_TIME]
    at = find_effect("turning-bias").names.index("strength")
    first = packed.curves[1:, 0, curves.FIRST].astype(int)
    ends = [packed.effects[m, f + LEVELS - 1, at] for m, f in zip((1, 2), first, strict=True)]
    assert ends == pytest.approx([0.6, -0.2])
    assert pack(models[:1], two_rooms).curves.shape[1] == 0


@pytest.mark.parametrize("order", [(0, 1, 2, 3), (0, 3, 2, 1), (0, 2, 1, 3)])
def test_how_many_are_seen_does_not_depend_on_their_numbers(order, model, two_rooms):
    """Those beyond a range are ignored, the more of all the more there are."""
    xy_m = np.array([(0.20, 0.77), (0.28, 0.77), (0.20, 0.87), (0.22, 0.79)])[list(order)]
    bent = {"ignored": 0.0, "range_m": 0.05, "sharp": 1.0} | curve(
        curves.BY_NUMBER, (1.0, 2.0, 3.0), more_3=1.0
    )
    told = dataclasses.replace(model, effects={"interaction-range": bent}, fov_rad=math.pi)
    seen = {"heading_rad": [0.4] * 4, "speed_m_s": 0.05}
    # Of three in sight: the strength of the last knot.
    all_ = {"ignored": 1.0, "range_m": 0.05, "sharp": 1.0}
    plain = dataclasses.replace(told, effects={"interaction-range": all_})
    found, expected = (
        heading_density(each, two_rooms, xy_m=xy_m, **seen)[1] for each in (told, plain)
    )
    assert found == pytest.approx(expected, abs=1e-12)


def test_each_of_two_curves_has_rows_of_its_own(model, two_rooms):
    """From the one's last level on come the other's."""
    by_time, by_speed = (curve(by, (0.0, 1.0, 2.0)) for by in (curves.BY_TIME, curves.BY_SPEED))
    both = {
        "turning-bias": {"strength": 0.4, **by_time, "more_3": 0.2},
        "rear-blind-zone": {"ignored": 0.5, **by_speed, "more_1": -0.3},
    }
    packed = pack([dataclasses.replace(model, effects=both)], two_rooms)
    ends = {"turning-bias": (0.4, 0.6), "rear-blind-zone": (0.2, 0.5)}
    for row, name in enumerate(both):
        at = find_effect(name).names.index(find_effect(name).strength)
        first = int(packed.curves[0, row, curves.FIRST])
        found = packed.effects[0, [first, first + LEVELS - 1], at]
        assert found == pytest.approx(ends[name])


def test_a_genome_leaves_a_curve_as_it_is(model):
    """Its one gene is the strength: at its knot, as of all effects."""
    bent = {"strength": 0.4} | curve(curves.BY_TIME, (0.0, 1.0, 2.0), more_3=0.2)
    given = dataclasses.replace(model, effects={"turning-bias": bent})
    assert genome_names(given)[-1] == "turning-bias.strength"
    genes = to_genome(given)
    genes[-1] = 0.5
    made = from_genome(genes, given).effects["turning-bias"]
    low, high = (
        getattr(find_effect("turning-bias").parameter("strength"), x) for x in ("low", "high")
    )
    assert made == bent | {"strength": (low + high) / 2}
    assert bent.items() <= spelt_out(given).effects["turning-bias"].items()


@pytest.mark.parametrize("effect", all_effects(), ids=lambda effect: effect.name)
def test_every_effect_may_have_a_curve(effect):
    """But for a delay, which is the same for all that is seen, and for rests."""
    bent = curve(curves.BY_NEAREST, (0.03, 0.1, 0.25))
    if effect.lag is not None or effect.rests:
        with pytest.raises(InputError, match="has no parameter 'by'"):
            effect.values(bent)
        return
    assert effect.spelt_out(bent).keys() == {*effect.names, *bent}
    assert {"more_1", "more_3"} <= set(effect.free(bent))
    assert not {"by", "knot_1", "knot_2", "knot_3"} & set(effect.free(bent))


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"knot_2": 0.02}, "must ascend"),
        ({"by": 1.5}, "by must be a whole number"),
        ({"by": 9.0}, r"by must be in \[0, 8\]"),
        ({"more_2": 1.0}, "has no parameter 'more_2'"),
        ({"by": 0.0}, "knot_1, knot_2, knot_3, more_1, more_3 stand without `by`"),
    ],
)
def test_a_wrong_curve_is_refused(wrong, says):
    """With what is expected of it."""
    bent = curve(curves.BY_NEAREST, (0.03, 0.1, 0.25)) | wrong
    with pytest.raises(InputError, match=says):
        find_effect("turning-bias").values(bent)

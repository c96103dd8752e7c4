"""The likelihood of a model with effects: values, derivatives, maxima."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.special import i0e

from zfcal.model import blocks
from zfcal.model.extended import (
    bounds_of,
    log_p_at,
    maximise,
    nats_at,
    start_of,
    with_effect,
    without_effects,
)
from zfcal.model.fitted import MIN_STEPS, SCALES, constants, zone_log_p, zone_scores, zone_turns
from zfcal.model.kernels import curves
from zfcal.model.kernels.extended import (
    BASE,
    BASE_SLOPE,
    COLUMNS,
    EXTRA,
    SOCIAL,
    densities,
    extended_sums,
    make_cells,
)
from zfcal.model.kernels.landing import ANGLES, PER_CELL
from zfcal.model.onestep import heading_density
from zfcal.model.scene import make_scene
from zfcal.model.simulate import simulate_tracks
from zfcal.model.views import view_of
from zfcal.tracks import Samples

DT_S = 0.2

KNOTS = {"knot_1": 0.03, "knot_2": 0.1, "knot_3": 0.25, "more_1": -0.4, "more_3": 0.5}
BY_DISTANCE = {"by": float(curves.BY_DISTANCE)} | KNOTS
BY_SPEED = {"by": float(curves.BY_SPEED)} | KNOTS

HOOKS = {
    "none": {},
    "component": {"alignment": {"weight": 20.0, "kappa": 6.0}},
    "factor": {"turning-bias": {"strength": 0.5}},
    "sight": {"rear-blind-zone": {"ignored": 0.7}},
    "rotation": {"alignment": {"weight": 20.0, "turning": 1.0}},
    "whole rotation": {
        "alignment": {"weight": 20.0, "kappa": 6.0},
        "directional-drift": {"strength": 4.0, "direction_rad": 1.9, "turning": 2.0},
    },
    "lag": {"reaction-delay": {"delay_s": 0.4}},
    "lag between steps": {"reaction-delay": {"delay_s": 0.3}},
    "some of it late": {"reaction-delay": {"delay_s": 0.4, "share": 0.3}},
    "late directions": {"reaction-delay": {"delay_s": 0.4, "share": 0.3, "whole": 0.0}},
    "late directions of near ones": {
        "reaction-delay": {"delay_s": 0.3, "share": 0.3, "whole": 0.0, "near": 1.0}
    },
    "sight of then": {"reaction-delay": {"delay_s": 0.4, "share": 0.3, "then": 1.0}},
    "directions of then": {
        "reaction-delay": {"delay_s": 0.3, "share": 0.3, "whole": 0.0, "then": 1.0}
    },
    "curve of a factor": {"turning-bias": {"strength": 0.5} | BY_SPEED},
    "curve of sight": {"rear-blind-zone": {"ignored": 0.4} | BY_DISTANCE},
    "all": {
        "alignment": {"weight": 20.0, "kappa": 6.0},
        "turning-bias": {"strength": 0.5},
        "rear-blind-zone": {"ignored": 0.7},
        "reaction-delay": {"delay_s": 0.4},
    },
    "landing": {
        "place-preference": {
            "strength": 2.0,
            "x_m": 0.24,
            "y_m": 0.77,
            "reach_m": 0.03,
            "lands": 1.0,
        }
    },
}


def samples_of(xy_m):
    """Return positions (sample, fish, xy) as samples of fish."""
    n, fish = xy_m.shape[:2]
    return Samples(
        dt_s=DT_S,
        k=np.arange(n, dtype=np.int64),
        agent=np.arange(1, fish + 1, dtype=np.int32),
        kind=np.zeros(fish, dtype=np.int8),
        xy_m=xy_m,
        confidence=np.ones((n, fish), dtype=np.float32),
    )


@pytest.fixture(scope="module")
def walk(two_rooms, model):
    """Return ten minutes of five fish of the base model, as samples."""
    xy_m, _ = simulate_tracks(model, two_rooms, n_agents=5, n_steps=3000, seed=7)
    return samples_of(xy_m)


@pytest.fixture(scope="module")
def scene(walk, two_rooms):
    """Return them as states and steps."""
    return make_scene(walk, two_rooms)


@pytest.fixture(scope="module")
def short_scene(two_rooms, model):
    """Return the first 200 s of them, for what is asked of each step."""
    xy_m, _ = simulate_tracks(model, two_rooms, n_agents=5, n_steps=1000, seed=7)
    return make_scene(samples_of(xy_m), two_rooms)


def having(model, effects):
    """Return a model with effects."""
    return dataclasses.replace(model, effects=effects)


def nats_of(x, turns, view):
    """Return the log densities of a zone's turns."""
    return zone_scores(x, turns, view)[0]


def test_the_maximum_does_not_depend_on_the_start(scene, model):
    """From the natural parameters, and from half of each kappa."""
    start = [x * np.where(np.arange(x.size) < 2, 0.5, 1.0) for x in start_of(model)]
    one, two = maximise(scene, model), maximise(scene, model, start=start)
    assert one.nats == pytest.approx(two.nats, abs=0.05)


def test_a_long_step_does_not_end_where_neighbours_count_for_nothing(two_rooms, model):
    """Where alpha is 0 the slope by kappa of the neighbours is 0, and that way leads nowhere."""
    own = ((14.0, 3.2, 7.5), (22.7, 13.6, 23.3), (23.4, 22.3, 36.7))
    zones = [
        dataclasses.replace(zone, kappa_0=base, kappa_f=social, alpha=alpha)
        for zone, base, social, alpha in zip(model.zones, *own, strict=True)
    ]
    true = dataclasses.replace(model, zones=tuple(zones))
    xy_m, _ = simulate_tracks(true, two_rooms, n_agents=5, n_steps=3000, seed=8)
    scene = make_scene(samples_of(xy_m), two_rooms)
    assert maximise(scene, model).nats == pytest.approx(maximise(scene, true).nats, abs=0.2)


@pytest.mark.parametrize("effects", HOOKS.values(), ids=HOOKS.keys())
def test_scores_are_the_derivatives_of_the_log_density(short_scene, model, effects):
    """By central differences, step by step, for each parameter of each zone."""
    changed = having(model, effects)
    view = view_of(short_scene, changed)
    for x, turns in zip(start_of(changed), zone_turns(short_scene), strict=True):
        assert len(turns.rows) > 20
        x[-1] = 0.02
        _, scores, _ = zone_scores(x, turns, view)
        for p in range(x.size):
            up, down = x.copy(), x.copy()
            up[p], down[p] = x[p] + 1e-5, x[p] - 1e-5
            slope = (nats_of(up, turns, view) - nats_of(down, turns, view)) / 2e-5
            np.testing.assert_allclose(scores[:, p], slope, rtol=1e-4, atol=1e-4)


@pytest.mark.parametrize("effects", HOOKS.values(), ids=HOOKS.keys())
def test_effects_change_the_density(scene, model, effects):
    """None is left out of the likelihood; without any it is the base's."""
    base, view = view_of(scene, model), view_of(scene, having(model, effects))
    for x, turns in zip(start_of(model), zone_turns(scene), strict=True):
        same = np.array_equal(nats_of(x, turns, base), nats_of(x, turns, view))
        assert same == (not effects)


def one_step(two_rooms, xy, heading, taken_rad, speed_m_s):
    """Return the scene of agents that swam straight on and of agent 0's step from here.

    The four samples before lie on lines that lead to the places, a 2.1 mm step apart.
    """
    xy, heading = np.array(xy, dtype=float), np.array(heading)
    ahead = 0.0021 * np.stack([np.cos(heading), np.sin(heading)], axis=1)
    path = [xy - back * ahead for back in (3, 2, 1, 0)]
    last = xy + ahead
    last[0] = xy[0] + speed_m_s * DT_S * np.array([math.cos(taken_rad), math.sin(taken_rad)])
    return make_scene(samples_of(np.array([*path, last])), two_rooms)


def log_density(scene, model, at):
    """Return the log density of agent 0's turn at a sample, without a lapse."""
    view, start = view_of(scene, model), start_of(model)
    (row,) = np.flatnonzero((scene.turns.at == at) & (scene.turns.who == 0))
    zone = int(scene.turns.zone[row]) - 1
    x, turns = start[zone].copy(), zone_turns(scene)[zone]
    x[-1] = 0.0
    (own,) = np.flatnonzero(turns.rows == row)
    return float(zone_scores(x, turns, view)[0][own])


def expected(model, two_rooms, xy, heading, taken_rad, speed_m_s):
    """Return the same from the numeric density of a simulation's step."""
    theta, density = heading_density(
        model, two_rooms, xy_m=xy, heading_rad=heading, speed_m_s=speed_m_s
    )
    return float(np.log(np.interp(taken_rad, theta, density)))


MIDDLE = [(0.22, 0.77), (0.26, 0.80), (0.17, 0.74)], [0.4, 2.0, -2.5]


@pytest.mark.parametrize(
    "name", ["none", "component", "factor", "sight", "rotation", "whole rotation", "landing"]
)
@pytest.mark.parametrize("degrees", [-100, -20, 25, 60, 150])
def test_the_log_density_is_that_of_a_simulated_step(two_rooms, model, name, degrees):
    """In the middle of a room, to 1e-3: kinds of effects and headings on all sides."""
    own, taken, speed = having(model, HOOKS[name]), math.radians(degrees), 0.06
    scene = one_step(two_rooms, *MIDDLE, taken, speed)
    found = log_density(scene, own, 3)
    assert found == pytest.approx(expected(own, two_rooms, *MIDDLE, taken, speed), abs=1e-3)


@pytest.mark.parametrize(
    "name", ["none", "component", "factor", "sight", "rotation", "whole rotation"]
)
def test_the_log_density_near_walls_and_borders(two_rooms, model, name):
    """12 mm from a wall and from a zone's border: cells that straddle them cost 0.02 nats."""
    own, taken, speed = having(model, HOOKS[name]), math.radians(80), 0.12
    state = [(0.065, 0.80), (0.10, 0.85), (0.08, 0.76)], [1.4, 1.0, 2.0]
    scene = one_step(two_rooms, *state, taken, speed)
    found = log_density(scene, own, 3)
    assert found == pytest.approx(expected(own, two_rooms, *state, taken, speed), abs=0.02)


@pytest.mark.parametrize("then", [0.0, 1.0])
@pytest.mark.parametrize("whole", [1.0, 0.0])
def test_a_share_that_is_late_lies_between(two_rooms, model, whole, then):
    """With no share of it the density is that of a prompt fish, and it moves with the share."""
    scene = one_step(two_rooms, *MIDDLE, 0.7, 0.06)

    def at(share):
        given = {"delay_s": 0.4, "share": share, "whole": whole, "then": then}
        return log_density(scene, having(model, {"reaction-delay": given}), 3)

    assert at(0.0) == log_density(scene, model, 3)
    prompt, some, all_ = math.exp(at(0.0)), math.exp(at(0.5)), math.exp(at(1.0))
    assert prompt != all_
    # What is seen from elsewhere has another size, and so another weight.
    assert some == pytest.approx((prompt + all_) / 2, rel=6e-3 if then else 2e-3)


def test_a_late_response_is_that_to_former_places(two_rooms, model):
    """With a lag of two steps the others stand where they were then, and no effect."""
    own, taken, speed = having(model, HOOKS["lag"]), 0.7, 0.06
    scene = one_step(two_rooms, *MIDDLE, taken, speed)
    xy, heading = np.array(MIDDLE[0]), np.array(MIDDLE[1])
    back = 2 * 0.0021 * np.stack([np.cos(heading), np.sin(heading)], axis=1)
    back[0] = 0.0
    found = log_density(scene, own, 3)
    assert found == pytest.approx(
        expected(model, two_rooms, xy - back, heading, taken, speed), abs=1e-3
    )


def test_an_empty_room_by_hand(two_rooms, make_natural):
    """Alone in the middle, out of reach of borders: a von Mises law about the heading."""
    model = make_natural(two_rooms)
    kappa = model.zones[2].kappa_0
    scene = one_step(two_rooms, [(0.22, 0.77)], [0.4], 0.9, 0.06)
    by_hand = kappa * (math.cos(0.5) - 1) - math.log(2 * math.pi * i0e(kappa))
    assert log_density(scene, model, 3) == pytest.approx(by_hand, abs=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("effects", HOOKS.values(), ids=HOOKS.keys())
def test_the_density_alone_is_that_with_derivatives(scene, model, effects):
    """Step by step, at other parameters than those that the scene was made with."""
    changed = having(model, effects)
    view = view_of(scene, changed)
    for x, turns in zip(start_of(changed), zone_turns(scene), strict=True):
        x[:3], x[-1] = x[:3] * [1.5, 0.7, 0.8], 0.02
        x[3:-1] -= 0.1 * np.arange(x.size - 4)
        assert zone_log_p(x, turns, view) == pytest.approx(nats_of(x, turns, view), abs=1e-9)


@pytest.mark.slow
def test_a_density_is_the_sum_of_its_parts():
    """On all cells and at the heading taken; the columns beside it are left as they are."""
    rng = np.random.default_rng(4)
    headings = rng.normal(size=(6, 2))
    headings /= np.linalg.norm(headings, axis=1)[:, None]
    parts = np.column_stack([[0.4, 0.0], headings[4:], [3.0, 9.0], [0.7, 0.7]])
    made = []
    for apart in (True, False):
        cells = make_cells(ANGLES)
        cells.columns[:] = 7.0
        densities(
            headings[0], headings[1:2], headings[2:4], np.array([0.5, 0.0]), parts,
            (5.0, 8.0), (0.3, 0.6), cells, apart,
        )  # fmt: skip
        made.append(cells.columns)
    apart, whole = made
    cosine = cells.gx * headings[1, 0] + cells.gy * headings[1, 1]
    assert apart[BASE] == pytest.approx(0.3 * np.exp(5.0 * (cosine - 1)), rel=1e-5)
    assert apart[BASE_SLOPE] == pytest.approx(apart[BASE] * cosine)
    assert whole[BASE] == pytest.approx(apart[[BASE, SOCIAL, EXTRA]].sum(axis=0))
    assert (whole[1:] == 7.0).all()


def test_a_lapse_is_a_share_of_uniform_headings(scene, model):
    """By hand, p = 0.9 f + 0.1 / 2 pi, and the probability of no lapse is 0.9 f / p."""
    view, turns = view_of(scene, model), zone_turns(scene)[2]
    x = start_of(model)[2].copy()
    x[-1] = 0.0
    alone = np.exp(nats_of(x, turns, view))
    x[-1] = 0.1
    log_p, _, weight = zone_scores(x, turns, view)
    mixed = 0.9 * alone + 0.1 / (2 * math.pi)
    assert np.exp(log_p) == pytest.approx(mixed)
    assert weight == pytest.approx(0.9 * alone / mixed)


def bell(kappa, cosine):
    """Return the kernel's unscaled law about x at headings of these cosines."""
    made = []
    for value in cosine:
        cells = make_cells(1)
        taken = np.array([value, math.sqrt(max(0.0, 1 - value * value))])
        densities(
            taken, np.array([[1.0, 0.0]]), np.zeros((0, 2)), np.zeros(0), np.zeros((0, 5)),
            (kappa, 1.0), (1.0, 1.0), cells, False,
        )  # fmt: skip
        made.append(cells.columns[BASE, -1])
    return np.array(made)


def test_the_kernels_exponential_over_its_whole_range():
    """From kappa 120, the steepest of a fit, down to none; 2e-6 down to -120, 2e-5 to -240."""
    cosine = np.linspace(-1.0, 1.0, 401)
    for kappa in (1e-3, 0.3, 5.0, 30.0, 120.0):
        exact = np.exp(kappa * (cosine - 1))
        error = np.abs(bell(kappa, cosine) / exact - 1)
        below = kappa * (cosine - 1) < -120
        assert error[~below].max() < 2e-6
        assert error.max() < 2e-5


def component_of(kappa, weight):
    """Return the sum over all headings of one component of an effect, and its height."""
    share = np.full((1, ANGLES, 1), PER_CELL, dtype=np.uint8)
    at_taken, over = np.empty((1, COLUMNS)), np.empty((1, 1, COLUMNS))
    direction = np.array([math.cos(0.3), math.sin(0.3)])
    extended_sums(
        direction[None, None], np.zeros((1, 0, 2)), np.zeros((1, 0)), direction[None], share,
        np.array([[[weight, *direction, kappa]]]), np.zeros((0, ANGLES)), (5.0, 5.0),
        constants(np.array([5.0, 5.0])), at_taken, over,
    )  # fmt: skip
    return over[0, 0, EXTRA], at_taken[0, EXTRA]


@pytest.mark.parametrize("kappa", [0.0, 0.5, 3.7, 3.8, 12.0, 30.0])
def test_a_component_has_its_weight_as_integral(kappa):
    """At all concentrations, on both sides of 3.75, where the series changes."""
    integral, height = component_of(kappa, 0.7)
    assert integral == pytest.approx(0.7, rel=1e-5)
    assert height == pytest.approx(0.7 / (2 * math.pi * i0e(kappa)), rel=1e-5)


def test_a_component_without_weight_adds_nothing():
    """Not even at a kappa that would overflow."""
    assert component_of(30.0, 0.0) == (0.0, 0.0)


def test_constants_are_those_of_von_mises():
    """1 / 2 pi at kappa 0."""
    first, second = constants(np.array([0.0, 5.0]))
    assert first == pytest.approx(1 / (2 * math.pi))
    assert second == pytest.approx(1 / (2 * math.pi * i0e(5.0)))


@pytest.mark.parametrize("effects", HOOKS.values(), ids=HOOKS.keys())
def test_tables_are_the_density_in_cells(scene, model, effects):
    """Each step's sum to one; the cell of the heading taken has about its density.

    The mean log of both differs by less than 0.02 nats: a cell is a tenth of a radian.
    """
    fitted = maximise(scene, having(model, effects), rounds=0)
    _, probability, _ = fitted.tables()
    assert probability.sum(axis=1) == pytest.approx(np.ones(len(scene.turns)))
    taken = np.arctan2(scene.turns.taken[:, 1], scene.turns.taken[:, 0])
    cell = np.round(taken * ANGLES / (2 * math.pi)).astype(int) % ANGLES
    density = probability[np.arange(len(cell)), cell] * ANGLES / (2 * math.pi)
    inside = (density > 0) & (fitted.weight > 0.99)
    assert np.log(density[inside]).mean() == pytest.approx(fitted.log_p[inside].mean(), abs=0.02)


FREE = {
    "component": ("alignment", {"weight": 20.0}, "weight"),
    "factor": ("turning-bias", {"strength": 0.4}, "strength"),
    "sight": ("rear-blind-zone", {"ignored": 0.8}, "ignored"),
    "whole rotation": ("group-cohesion", {"weight": 3.0, "turning": 2.0}, "weight"),
    "landing": (
        "place-preference",
        {"strength": 3.0, "x_m": 0.25, "y_m": 0.77, "reach_m": 0.08, "lands": 1.0},
        "strength",
    ),
    "strong factor": ("generic:heading:own-turn", {"strength": 9.0}, "strength"),
}


@pytest.mark.parametrize(("name", "values", "key"), FREE.values(), ids=FREE.keys())
def test_a_simulated_effect_is_found_again(two_rooms, model, name, values, key):
    """Ten minutes of five fish: within four standard errors, which are small enough to tell.

    An error in an effect's scale of a third is noticed: its standard error is a twelfth or
    less of the strength.
    """
    true = having(model, {name: values})
    xy_m, _ = simulate_tracks(true, two_rooms, n_agents=5, n_steps=3000, seed=21)
    scene = make_scene(samples_of(xy_m), two_rooms)
    low, high = bounds_of(name, key)
    start = having(model, {name: {**values, key: low + 0.02 * (high - low) if low >= 0 else 0.01}})
    fitted = maximise(scene, start, free=((name, key),))
    error = math.sqrt(fitted.covariance[0, 0])
    assert abs(fitted.parameters.effects[name][key] - values[key]) < 4 * error
    assert 0 < error < values[key] / 12
    assert fitted.nats > maximise(scene, model).nats + 20
    assert fitted.effect_scores.sum() == pytest.approx(
        0.0, abs=0.1 * abs(fitted.effect_scores).sum()
    )


def test_what_is_not_free_stays(scene, model):
    """An effect in the model keeps its values while the base is fitted."""
    own = having(model, HOOKS["component"])
    fitted = maximise(scene, own)
    assert fitted.parameters.effects == own.effects
    assert fitted.covariance.shape == (0, 0)


def test_more_parameters_never_fit_worse(scene, model):
    """An effect at strength zero is the base; freed, it gains a little and never loses."""
    base = maximise(scene, model)
    none = with_effect(base.parameters, "turning-bias", {"strength": 0.0})
    fitted = maximise(scene, none, free=(("turning-bias", "strength"),), start=base.x)
    assert -1e-6 <= fitted.nats - base.nats < 8.0


def test_a_zone_with_few_turns_is_left_alone(two_rooms, model):
    """With fewer than 30 turns there its parameters stay, and its turns have no density."""
    xy_m, _ = simulate_tracks(model, two_rooms, n_agents=1, n_steps=60, seed=2)
    scene = make_scene(samples_of(xy_m), two_rooms)
    fitted = maximise(scene, model)
    few = [len(turns.rows) < MIN_STEPS for turns in fitted.turns]
    assert any(few)
    for zone, is_few in enumerate(few):
        rows = fitted.turns[zone].rows
        assert np.isnan(fitted.log_p[rows]).all() == (is_few or not len(rows))
        if is_few:
            assert fitted.x[zone] == pytest.approx(start_of(model)[zone])
            assert fitted.parameters.zones[zone] == model.zones[zone]
    assert math.isfinite(fitted.nats)


def test_a_zone_with_few_ways_out_has_a_finite_maximum(two_rooms, model):
    """31 turns that begin and end in the corridor: nobody lands elsewhere, and no gamma runs off.

    The attraction of what is never chosen goes to its bound, e^-7, and stays there.
    """
    xy_m, _ = simulate_tracks(model, two_rooms, n_agents=5, n_robots=1, n_steps=600, seed=2)
    samples = dataclasses.replace(samples_of(xy_m), kind=np.array([0, 0, 0, 0, 1], dtype=np.int8))
    fitted = maximise(make_scene(samples, two_rooms), model)
    assert math.isfinite(fitted.nats)
    for x in fitted.x:
        assert ((x[3:-1] >= -7.0) & (x[3:-1] <= 0.0)).all()
    for x, turns, view in zip(fitted.x, fitted.turns, [fitted.view] * 3, strict=True):
        assert np.isfinite(nats_of(x, turns, view)).all()


def test_effects_come_and_go(model):
    """Values are merged; without effects it is the base again."""
    one = with_effect(model, "alignment", {"weight": 5.0})
    two = with_effect(one, "alignment", {"kappa": 3.0})
    assert two.effects == {"alignment": {"weight": 5.0, "kappa": 3.0}}
    assert without_effects(two) == without_effects(model)
    assert bounds_of("alignment", "kappa") == (0.0, 30.0)


@pytest.mark.slow
def test_a_place_is_looked_for_within_the_tank(two_rooms, model):
    """Fish that drift everywhere are drawn to its edge, not to a place metres away."""
    x0, y0, x1, y1 = two_rooms.outline.bounds
    assert bounds_of("place-preference", "x_m", two_rooms) == (x0, x1)
    assert bounds_of("place-preference", "y_m", two_rooms) == (y0, y1)
    assert bounds_of("place-preference", "y_m") == (-100.0, 100.0)
    assert bounds_of("place-preference", "reach_m", two_rooms) == (0.03, 2.0)
    drift = having(model, {"directional-drift": {"strength": 0.5, "direction_rad": math.pi / 2}})
    xy_m, _ = simulate_tracks(drift, two_rooms, n_agents=5, n_steps=3000, seed=23)
    scene = make_scene(samples_of(xy_m), two_rooms)
    place = {"strength": 0.5, "x_m": 0.5, "y_m": 0.9, "reach_m": 1.0}
    free = tuple(("place-preference", key) for key in place)
    found = maximise(scene, having(model, {"place-preference": place}), free=free)
    values = found.parameters.effects["place-preference"]
    assert x0 <= values["x_m"] <= x1
    assert values["y_m"] == pytest.approx(y1)


def test_units_of_a_fit():
    """Kappa of the base and of the neighbours in units of 30, alpha of 50."""
    assert SCALES.tolist() == [30.0, 30.0, 50.0]


@pytest.mark.slow
def test_a_place_is_found_to_the_millimetre(two_rooms, model):
    """From 30 cm beside it; a place can be 100 m away, and is told to less than its error."""
    place = {"strength": 1.5, "x_m": 0.3, "y_m": 0.2, "reach_m": 0.4}
    true = having(model, {"place-preference": place})
    xy_m, _ = simulate_tracks(true, two_rooms, n_agents=5, n_steps=3000, seed=22)
    scene = make_scene(samples_of(xy_m), two_rooms)
    start = having(model, {"place-preference": {**place, "x_m": 0.6, "y_m": 0.3}})
    free = tuple(("place-preference", key) for key in place)
    fitted = maximise(scene, start, free=free)
    found = fitted.parameters.effects["place-preference"]
    top = fitted.nats
    for key, by in (("x_m", 0.002), ("y_m", 0.002), ("strength", 0.02)):
        for sign in (-1, 1):
            moved = with_effect(
                fitted.parameters, "place-preference", {key: found[key] + sign * by}
            )
            assert nats_at(scene, [moved], fitted.x)[0] < top + 0.02
    assert np.hypot(found["x_m"] - 0.3, found["y_m"] - 0.2) < 4 * math.sqrt(
        fitted.covariance[1, 1] + fitted.covariance[2, 2]
    )


@pytest.mark.slow
def test_a_given_place_outside_the_tank_is_fitted_from_where_it_is(two_rooms, model):
    """Two metres above: everything else is fitted as well, and its place stays or comes nearer."""
    drift = having(model, {"directional-drift": {"strength": 0.5, "direction_rad": math.pi / 2}})
    xy_m, _ = simulate_tracks(drift, two_rooms, n_agents=5, n_steps=3000, seed=3)
    scene = make_scene(samples_of(xy_m), two_rooms)
    place = {"strength": 2.0, "x_m": 0.5, "y_m": 3.0, "reach_m": 2.0}
    free = tuple(("place-preference", key) for key in place)
    given = having(model, {"place-preference": place})
    fitted = maximise(scene, given, free=free)
    held = maximise(scene, given)
    assert held.nats > nats_at(scene, [given], start_of(given))[0] + 10
    assert fitted.nats > held.nats + 10
    values = fitted.parameters.effects["place-preference"]
    assert two_rooms.outline.bounds[1] <= values["y_m"] <= 3.0


def test_a_parameter_at_its_bound_holds_none_of_the_others_up(two_rooms, model):
    """A place far away acts as a drift where its reach is as large as it can be, and strong."""
    place = {"strength": 1.0, "x_m": 2.4, "y_m": 1.6, "reach_m": 2.0}
    far = having(model, {"directional-drift": {"strength": 0.4, "direction_rad": 0.6}})
    xy_m, _ = simulate_tracks(far, two_rooms, n_agents=5, n_steps=3000, seed=23)
    scene = make_scene(samples_of(xy_m), two_rooms)
    held = (("place-preference", "strength"),)
    alone = maximise(scene, having(model, {"place-preference": place}), free=held)
    both = maximise(
        scene,
        having(model, {"place-preference": place}),
        free=(*held, ("place-preference", "reach_m")),
    )
    assert both.parameters.effects["place-preference"]["reach_m"] == 2.0
    assert both.nats == pytest.approx(alone.nats, abs=0.05)


@pytest.mark.parametrize(
    ("name", "key", "value"),
    [("wall-persistence", "strength", 0.5), ("turning-bias", "strength", 0.5)],
)
def test_the_fit_does_not_depend_on_the_threads(monkeypatch, short_scene, model, name, key, value):
    """To the last digit, though steps are asked in blocks: factors, and smooth ones."""
    monkeypatch.setattr(blocks, "_LEAST", 100)
    start = having(model, {name: {key: value}})
    one, three = (maximise(short_scene, start, free=((name, key),), n_workers=n) for n in (1, 3))
    assert one.nats == three.nats
    assert one.parameters == three.parameters
    np.testing.assert_array_equal(one.effect_scores, three.effect_scores)


def test_a_density_on_other_steps_is_that_of_the_fit(scene, short_scene, model):
    """Nothing is fitted there, and nothing is differentiated."""
    fitted = maximise(scene, having(model, HOOKS["factor"]))
    there = maximise(short_scene, fitted.parameters, start=fitted.x, rounds=0)
    found = log_p_at(short_scene, fitted.parameters, fitted.x)
    np.testing.assert_allclose(found, there.log_p, atol=1e-9)


def test_a_delay_between_steps_is_likeliest_where_it_is(two_rooms, model):
    """Of fish that respond one and a half steps late, beside one step and two."""
    late = {s: having(model, {"reaction-delay": {"delay_s": s}}) for s in (0.2, 0.3, 0.4)}
    xy_m, _ = simulate_tracks(late[0.3], two_rooms, n_agents=5, n_steps=1000, seed=9)
    scene = make_scene(samples_of(xy_m), two_rooms)
    nats = {
        s: sum(nats_of(x, t, view_of(scene, m)).sum() for x, t in pairs(scene, m))
        for s, m in late.items()
    }
    assert nats[0.3] > nats[0.2] + 20
    assert nats[0.3] > nats[0.4] + 20


@pytest.mark.parametrize(("whole", "what"), [(1.0, "then"), (0.0, "then"), (0.0, "near")])
def test_a_late_response_is_likeliest_as_it_is(two_rooms, model, whole, what):
    """Where another was seen, from there or from here; who is next late, or at once."""
    given = {"delay_s": 0.4, "whole": whole}
    late = {t: having(model, {"reaction-delay": {**given, what: t}}) for t in (0.0, 1.0)}
    for true, other in ((0.0, 1.0), (1.0, 0.0)):
        xy_m, _ = simulate_tracks(late[true], two_rooms, n_agents=5, n_steps=1000, seed=9)
        scene = make_scene(samples_of(xy_m), two_rooms)
        nats = {
            w: sum(nats_of(x, t, view_of(scene, m)).sum() for x, t in pairs(scene, m))
            for w, m in late.items()
        }
        assert nats[true] > nats[other] + 20


def pairs(scene, model):
    """Return the true parameters of each zone and its turns."""
    return zip(start_of(model), zone_turns(scene), strict=True)

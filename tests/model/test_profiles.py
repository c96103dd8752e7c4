"""Intervals by profile likelihood: where the likelihood has fallen far enough."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from zfcal.model.extended import GENES, limits_of, maximise
from zfcal.model.fitted import SCALES
from zfcal.model.likelihood import fit
from zfcal.model.profiles import profile_about
from zfcal.model.reach import within_reach
from zfcal.model.scene import make_scene
from zfcal.model.simulate import simulate_tracks
from zfcal.tracks import Samples

WALLS = 1


@pytest.fixture(scope="module")
def scene(two_rooms, model):
    """Return two minutes of five simulated fish."""
    xy, _ = simulate_tracks(model, two_rooms, n_agents=5, n_steps=600, seed=4)
    n, agents = xy.shape[:2]
    samples = Samples(
        dt_s=0.2,
        k=np.arange(n),
        agent=np.arange(1, agents + 1, dtype=np.int32),
        kind=np.zeros(agents, dtype=np.int8),
        xy_m=xy,
        confidence=np.ones((n, agents), dtype=np.float32),
    )
    return make_scene(samples, two_rooms)


@pytest.fixture(scope="module")
def found(scene, model):
    """Return the maximum of their likelihood."""
    return maximise(scene, model, bounds=GENES)


@pytest.fixture(scope="module")
def profile(found):
    """Return the likelihood about the maximum near the walls."""
    limits = limits_of(found.x[WALLS], found.turns[WALLS], GENES)
    return profile_about(found.x[WALLS], found.turns[WALLS], found.view, limits)


def weights(n, *places):
    """Return one at the first place and minus one at the second."""
    made = np.zeros(n)
    made[list(places)] = [1.0, -1.0][: len(places)]
    return made


@pytest.mark.slow
@pytest.mark.parametrize("depth", [0.674, 1.96])
def test_at_an_end_the_likelihood_has_fallen_by_half_the_square_of_the_depth(profile, depth):
    """No other point with that kappa is higher: five hundred random neighbours are tried."""
    of = weights(profile.x.size, 0)
    low, high = profile.interval(of, depth)
    top, _ = profile._at(profile.x)
    rng = np.random.default_rng(1)
    for end in (low, high):
        x, nats = profile._best(profile.x, of, end)
        assert x[0] == pytest.approx(end)
        assert top - nats == pytest.approx(depth**2 / 2, abs=0.03 * depth + 0.01)
        for _ in range(500):
            near = x * np.exp(0.02 * rng.standard_normal(x.size))
            near[0] = end
            assert profile._at(np.clip(near, profile.low, profile.high))[0] <= nats + 0.02


def test_a_deeper_interval_holds_a_shallower_one(profile):
    """And both hold the estimate."""
    of = weights(profile.x.size, 1)
    ends = [profile.interval(of, depth) for depth in (0.5, 1.0, 2.0)]
    for (low, high), (lower, higher) in itertools.pairwise(ends):
        assert lower < low <= profile.x[1] <= high < higher


def test_an_interval_ends_at_a_bound_that_is_likely_enough(profile):
    """The truth of alpha is 42 of at most 50, which two minutes do not tell apart."""
    assert profile.interval(weights(profile.x.size, 2), 1.96)[1] == pytest.approx(1.0)


def test_an_interval_of_a_difference_turned_round_is_its_mirror(profile):
    """Log gamma of the walls less that of the centre."""
    n = profile.x.size
    low, high = profile.interval(weights(n, 4, 5), 1.96)
    assert profile.interval(weights(n, 5, 4), 1.96) == pytest.approx((-high, -low), abs=0.02)


def test_the_numbers_do_not_depend_on_threads(found, profile):
    """To the bit."""
    limits = limits_of(found.x[WALLS], found.turns[WALLS], GENES)
    more = profile_about(found.x[WALLS], found.turns[WALLS], found.view, limits, n_workers=3)
    of = weights(profile.x.size, 0)
    assert more.interval(of, 1.96) == profile.interval(of, 1.96)


def test_the_largest_gamma_of_a_row_has_an_interval(scene, model, found):
    """The largest of the estimate is not known to be the largest: its interval ends below one."""
    estimate = fit(scene, model)
    row = {to: estimate.interval[f"walls.gamma.{to}"] for to in ("corridor", "walls", "centre")}
    largest = max(row, key=lambda to: estimate.parameters.zones[WALLS].gamma[to])
    assert row[largest][1] == 1.0
    assert row[largest][0] < 1.0
    assert all(0 <= low < high <= 1 for low, high in row.values())
    assert found.parameters == estimate.parameters


def test_where_a_zone_within_reach_was_never_met_the_others_may_be_small(two_rooms, model):
    """Fish that stay in a room: nothing says that the corridor does not draw them more."""
    rng = np.random.default_rng(2)
    angle = rng.uniform(0, 2 * math.pi, (300, 3))
    xy = np.array([0.13, 0.87]) + 0.06 * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    samples = Samples(
        dt_s=0.2,
        k=np.arange(300),
        agent=np.arange(1, 4, dtype=np.int32),
        kind=np.zeros(3, dtype=np.int8),
        xy_m=xy,
        confidence=np.ones((300, 3), dtype=np.float32),
    )
    estimate = fit(make_scene(samples, two_rooms), model)
    assert estimate.interval["walls.gamma.corridor"] == (0.0, 1.0)
    assert estimate.interval["walls.gamma.walls"][0] == 0.0


def test_without_a_level_there_are_no_intervals(scene, model):
    """And the same parameters."""
    assert fit(scene, model, level=None).interval == {}
    assert fit(scene, model, level=None).parameters == fit(scene, model).parameters


def test_lower_levels_give_shorter_intervals(scene, model):
    """Each within that of the higher level, but for how far an end is looked for."""
    half, most = fit(scene, model, level=0.5).interval, fit(scene, model).interval
    for name, (low, high) in half.items():
        assert most[name][0] <= low + 1e-9
        assert high <= most[name][1] + 1e-9
    assert half["walls.kappa_0"][1] < most["walls.kappa_0"][1] <= SCALES[0]


def test_no_step_leads_from_the_centre_into_the_corridor(two_rooms):
    """4.87 cm lie between them; a step of 0.2 s at 0.2 m/s is 4 cm, one of 0.3 s is 6 cm."""
    near = within_reach(two_rooms, 0.2)
    assert near.tolist() == [[True, True, False], [True, True, True], [False, True, True]]
    assert within_reach(two_rooms, 0.3).all()

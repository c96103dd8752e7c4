"""How far landings are from things, and their hat functions, as slower ways have them."""

import numpy as np
import pytest

from zfcal.diagnose.features.landing_kernels import expected_hats, hats_within, wall_distances
from zfcal.model.kernels.hats import hats


@pytest.fixture
def random():
    """Return what draws the numbers."""
    return np.random.default_rng(5)


def test_hats_of_landings_are_all_but_the_last(random):
    """At knots, between and beyond them; their means are those of the chances."""
    knots = np.array([0.0, 0.02, 0.05, 0.1])
    away = np.append(random.uniform(-0.01, 0.15, size=59), [0.0, 0.02, 0.05, 0.1, np.nan])
    away, rows = away.reshape(8, 8), np.arange(8)[::-1].copy()
    chances, made, mean = random.uniform(size=(8, 8)), np.empty((8, 8, 3)), np.empty((8, 3))
    hats_within(away, knots, made)
    expected_hats(chances, rows, away, knots, mean)
    np.testing.assert_array_equal(made, hats(away, knots)[..., :-1])
    np.testing.assert_allclose(mean, np.einsum("sc,scb->sb", chances[rows], made), rtol=1e-14)


def test_distances_from_the_wall_are_those_of_the_arena(random, tank):
    """Inside and out, to pieces and to corners; those of NaN are NaN."""
    xy_m = np.vstack([random.uniform(-0.1, 1.1, size=(500, 2)), [[np.nan, 0.5]]])
    away_m = np.empty(len(xy_m))
    wall_distances(xy_m, tank.segments_m, away_m)
    np.testing.assert_allclose(away_m, tank.wall_distance(xy_m), rtol=0, atol=1e-15)

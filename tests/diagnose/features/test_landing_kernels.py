"""How far landings are from things, and their hat functions, as slower ways have them."""

import numpy as np
import pytest

from zfcal.diagnose.features.landing_kernels import (
    expected_hats,
    hat_sums,
    places_among,
    wall_distances,
)
from zfcal.model.kernels.hats import hats


@pytest.fixture
def random():
    """Return what draws the numbers."""
    return np.random.default_rng(5)


def test_hats_of_landings_are_all_but_the_last(random):
    """At knots, between and beyond them; sums are of each cell, means are those of the chances."""
    knots, strengths = np.array([0.0, 0.02, 0.05, 0.1]), np.array([0.3, -0.2, 1.4])
    away = np.append(random.uniform(-0.01, 0.15, size=59), [0.0, 0.02, 0.05, 0.1, np.nan])
    away, rows = away.reshape(8, 8), np.arange(8)[::-1].copy()
    chances, mean = random.uniform(size=(8, 8)), np.empty((8, 3))
    places, sums = np.empty((2, 8, 8))
    places_among(away, knots, places)
    hat_sums(places, np.append(strengths, [0.0, 0.0]), sums)
    expected_hats(chances, rows, places, mean)
    cells = np.nan_to_num(hats(away, knots)[..., :-1])
    np.testing.assert_allclose(sums, cells @ strengths, rtol=1e-13, atol=1e-15)
    np.testing.assert_allclose(mean, np.einsum("sc,scb->sb", chances[rows], cells), rtol=1e-14)


def test_distances_from_the_wall_are_those_of_the_arena(random, tank):
    """Inside and out, to pieces and to corners; those of NaN are NaN."""
    xy_m = np.vstack([random.uniform(-0.1, 1.1, size=(500, 2)), [[np.nan, 0.5]]])
    away_m = np.empty(len(xy_m))
    wall_distances(xy_m, tank.segments_m, away_m)
    np.testing.assert_allclose(away_m, tank.wall_distance(xy_m), rtol=0, atol=1e-15)

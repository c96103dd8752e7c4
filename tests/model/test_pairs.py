"""Distances of large groups are counted as they are one by one."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely

from zfcal.arena import Bins, make_arena
from zfcal.model.kernels.pairs import add_pairs, make_pairs, squared_edges
from zfcal.model.kernels.state import STATES, ZONE, X, Y
from zfcal.model.simulate import tank_of

pytestmark = pytest.mark.plain

SEA = make_arena(
    name="sea", outline=shapely.box(0, 0, 3.0, 1.0), bins=Bins(distance_m=(0.02, 0.25))
)


def one_by_one(xy, zones, low, per, n_zones):
    """Count all pairs by root, difference and product."""
    counts = np.zeros((n_zones, 10), dtype=np.int64)
    for i in range(len(xy)):
        for j in range(i):
            if zones[i] == zones[j]:
                away = math.sqrt((xy[i, 0] - xy[j, 0]) ** 2 + (xy[i, 1] - xy[j, 1]) ** 2)
                counts[zones[i] - 1, min(9, max(0, int((away - low) * per)))] += 1
    return counts


@pytest.mark.parametrize("n", [2, 17, 150])
@pytest.mark.parametrize("spread", ["even", "heap", "lattice"])
def test_sorted_counts_are_those_one_by_one(n, spread):
    """All over the tank, in a heap, and on a lattice whose distances are edges of bins."""
    rng = np.random.default_rng(n)
    xy = rng.uniform((0, 0), (3, 1), size=(n, 2))
    if spread == "heap":
        xy = rng.normal((1.5, 0.5), 0.05, size=(n, 2))
    elif spread == "lattice":
        xy = np.round(xy / 0.023) * 0.023
    state = np.zeros((STATES, n))
    state[X], state[Y] = xy.T
    state[ZONE] = rng.integers(1, 3, n)
    tank = tank_of(SEA)
    counts = np.zeros((2, 10), dtype=np.int64)

    for _ in range(2):  # a second time adds the same once more
        add_pairs(state, n, make_pairs(n, tank), counts)

    zones = state[ZONE].astype(int)
    plain = one_by_one(xy, zones, tank.distance_low_m, tank.distance_per_m, 2)
    np.testing.assert_array_equal(counts, 2 * plain)


@pytest.mark.parametrize(("low", "high"), [(0.0, 0.22), (0.05, 0.2), (0.3, 0.31), (0.0, 1e-3)])
def test_a_squared_edge_is_the_least_number_of_its_bin(low, high):
    """Its root falls into the bin, the root of the number before it does not."""
    per = 10 / (high - low)

    edges = squared_edges(low, per)

    for k, edge in enumerate(edges, start=1):
        assert int((math.sqrt(edge) - low) * per) >= k
        assert int((math.sqrt(np.nextafter(edge, 0)) - low) * per) < k

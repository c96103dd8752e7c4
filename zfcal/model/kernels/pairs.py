"""The histogram of distances of a large group: the same counts, without a root per pair.

Agents of a zone are sorted by x into strips. A pair too many strips apart falls
into the last bin unseen; of the others the squared distance is set against
squared edges, a loop that the compiler turns into vector instructions.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from zfcal.arrays import Floats, Ints
from zfcal.model.kernels.compiled import inlined, kernel
from zfcal.model.kernels.geometry import Tank
from zfcal.model.kernels.state import ZONE, X, Y

_BINS = 10
_PER_STRIP = 8


class Pairs(NamedTuple):
    """Strips of the tank, and agents sorted by zone and strip.

    Attributes
    ----------
    edges_m2 : ndarray, shape (9,)
        The least squared distance that falls into each bin but the first.
    x0_m, per_m
        Where strips start, and strips per metre.
    apart
        Strips that differ by more are farther apart than the last bin's edge.
    n_strips
    key, start : ndarray of int64, shape (agent,) and (zone * strip + 1,)
    x_m, y_m : ndarray, shape (agent,)
    """

    edges_m2: Floats
    x0_m: float
    per_m: float
    apart: int
    n_strips: int
    key: Ints
    start: Ints
    x_m: Floats
    y_m: Floats


@inlined
def bin_of(value: float, low: float, per: float) -> int:
    """Return the bin of a value; the outer bins also hold what lies beyond."""
    return min(_BINS - 1, max(0, int((value - low) * per)))


@kernel
def squared_edges(low: float, per: float) -> Floats:
    """Return the least square whose root falls into each bin but the first.

    Root, difference and product are monotone even when rounded, so bisection
    down to neighbouring numbers finds it.
    """
    edges = np.empty(_BINS - 1)
    for k in range(1, _BINS):
        below, at = 0.0, 4.0 * (abs(low) + (k + 1) / per) ** 2
        while True:
            middle = 0.5 * (below + at)
            if not below < middle < at:
                break
            if bin_of(math.sqrt(middle), low, per) >= k:
                at = middle
            else:
                below = middle
        edges[k - 1] = at
    return edges


@kernel
def make_pairs(n: int, tank: Tank) -> Pairs:
    """Return strips for n agents in a tank."""
    edges = squared_edges(tank.distance_low_m, tank.distance_per_m)
    width_m = tank.cells.shape[1] / tank.per_m
    n_strips = max(1, n // _PER_STRIP)
    per_m = n_strips / width_m
    apart = int(math.sqrt(edges[_BINS - 2]) * per_m * (1.0 + 1e-9) + 1e-9) + 1
    zones = tank.follows.size
    return Pairs(
        edges, tank.x0_m, per_m, apart, n_strips, np.zeros(n, np.int64),
        np.zeros(zones * n_strips + 1, np.int64), np.zeros(n), np.zeros(n),
    )  # fmt: skip


@kernel
def add_pairs(state: Floats, n: int, pairs: Pairs, counts: Ints) -> None:
    """Add the distances of all pairs of the first n agents that are in one zone.

    Parameters
    ----------
    counts : ndarray of int64, shape (zone, 10)
    """
    _sort(state, n, pairs)
    strips = pairs.n_strips
    for zone in range(1, counts.shape[0] + 1):
        first, last = pairs.start[zone * strips], pairs.start[(zone + 1) * strips]
        if last - first > 1:
            _add_zone(zone * strips, first, last, pairs, counts[zone - 1])


@inlined
def _sort(state: Floats, n: int, pairs: Pairs) -> None:
    start = pairs.start
    start[:] = 0
    for i in range(n):
        strip = int((state[X, i] - pairs.x0_m) * pairs.per_m)
        strip = min(pairs.n_strips - 1, max(0, strip))
        pairs.key[i] = int(state[ZONE, i]) * pairs.n_strips + strip
        start[pairs.key[i]] += 1
    # Ends of the strips; filling from there leaves where they begin.
    for key in range(1, start.size):
        start[key] += start[key - 1]
    for i in range(n):
        start[pairs.key[i]] -= 1
        place = start[pairs.key[i]]
        pairs.x_m[place], pairs.y_m[place] = state[X, i], state[Y, i]


@inlined
def _add_zone(base: int, first: int, last: int, pairs: Pairs, counts: Ints) -> None:
    """Add the pairs of one zone, whose strips start at ``base``."""
    x_m, y_m, per_m, x0_m = pairs.x_m, pairs.y_m, pairs.per_m, pairs.x0_m
    e1, e2, e3, e4, e5, e6, e7, e8, e9 = (
        pairs.edges_m2[0], pairs.edges_m2[1], pairs.edges_m2[2], pairs.edges_m2[3],
        pairs.edges_m2[4], pairs.edges_m2[5], pairs.edges_m2[6], pairs.edges_m2[7],
        pairs.edges_m2[8],
    )  # fmt: skip
    n1, n2, n3, n4, n5, n6, n7, n8, n9, unseen = 0, 0, 0, 0, 0, 0, 0, 0, 0, 0
    for i in range(first + 1, last):
        x, y = x_m[i], y_m[i]
        strip = min(pairs.n_strips - 1, max(0, int((x - x0_m) * per_m)))
        begin = pairs.start[base + max(0, strip - pairs.apart)]
        unseen += begin - first
        # No branch and whole numbers alone: the compiler makes vectors of this.
        for j in range(begin, i):
            away2 = (x - x_m[j]) ** 2 + (y - y_m[j]) ** 2
            n1 += away2 >= e1
            n2 += away2 >= e2
            n3 += away2 >= e3
            n4 += away2 >= e4
            n5 += away2 >= e5
            n6 += away2 >= e6
            n7 += away2 >= e7
            n8 += away2 >= e8
            n9 += away2 >= e9
    beyond = (n1, n2, n3, n4, n5, n6, n7, n8, n9)
    counts[0] += (last - first) * (last - first - 1) // 2 - unseen - n1
    for k in range(1, _BINS - 1):
        counts[k] += beyond[k - 1] - beyond[k]
    counts[_BINS - 1] += unseen + n9

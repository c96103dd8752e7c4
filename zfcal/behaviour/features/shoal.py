"""The shape of a shoal: its spread, its polarisation and its nearest neighbours.

The paper names "agent groups aspects" as what similarity scores should take into account next
(Cazenille et al., discussion). The three measures are those by which shoals are usually
described (Couzin et al. 2002, J. Theor. Biol. 218: polarisation; Miller and Gerlai 2012, PLoS
ONE 7: polarisation and nearest neighbour of zebrafish; Delcourt and Poncin 2012, Rev. Fish Biol.
Fish. 22, for all).

They belong to the group and to no zone: a shoal can lie in several zones, and its centroid in
none of them, such as in the wall between two rooms. Distances are as the crow flies.

Who was seen counts: at a sample with two of five fish the shoal is these two. Of the robot
alone there is no spread and no polarisation, and its neighbours are the fish.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from zfcal.arrays import Floats, Indices
from zfcal.behaviour.features.statistic import Observed, Points, Statistic, lengths
from zfcal.behaviour.histograms import bin_edges
from zfcal.units import HEADING_MIN_STEP_M


def observe_spread(points: Points) -> Iterator[Observed]:
    """Yield the mean distance to the centroid at each sample with two agents or more, in metres."""
    if points.within:
        xy_m = points.located.xy_m[points.own]
        at, group, n = _groups(points, points.own)
        away_m = lengths(xy_m - _means(xy_m, group, n)[group])
        yield Observed(at=at[n > 1], value=_means(away_m[:, None], group, n)[n > 1, 0])


def observe_polarisation(points: Points) -> Iterator[Observed]:
    """Yield the length of the mean direction of steps from each sample, in [0, 1].

    Steps of at least 2 mm have a direction; there must be two of them.
    """
    if points.within:
        start, end = points.moves
        step_m = points.located.xy_m[end] - points.located.xy_m[start]
        length_m = lengths(step_m)
        moving = np.flatnonzero(length_m >= HEADING_MIN_STEP_M)
        at, group, n = _groups(points, start[moving])
        mean = _means(step_m[moving] / length_m[moving, None], group, n)
        yield Observed(at=at[n > 1], value=lengths(mean)[n > 1])


def observe_neighbour(points: Points) -> Iterator[Observed]:
    """Yield the distance of each agent to the nearest other one at its sample, in metres."""
    xy_m = points.located.xy_m
    nearest_m = np.full(len(xy_m), np.inf)
    for first, second in points.pairs():
        # Within a lag no point is twice the first, nor twice the second.
        apart_m = lengths(xy_m[second] - xy_m[first])
        nearest_m[first] = np.minimum(nearest_m[first], apart_m)
        nearest_m[second] = np.minimum(nearest_m[second], apart_m)
    at = points.own[np.isfinite(nearest_m[points.own])]
    yield Observed(at=at, value=nearest_m[at])


def _groups(points: Points, at: Indices) -> tuple[Indices, Indices, Indices]:
    """Return for some points one of each sample, which of these each belongs to, and how many."""
    _, first, group, n = np.unique(
        points.located.k[at], return_index=True, return_inverse=True, return_counts=True
    )
    return at[first], group, n


def _means(values: Floats, group: Indices, n: Indices) -> Floats:
    """Return the mean of each group's vectors, shape (group, dimension)."""
    sums = [np.bincount(group, weights=column, minlength=len(n)) for column in values.T]
    return np.stack(sums, axis=-1) / n[:, None]


STATISTICS = (
    Statistic(
        name="spread",
        label="Spread of the group",
        phrase="the spread of the group",
        observe=observe_spread,
        # Of two at the ends of the tank; the range of D is that of neighbours.
        edges=lambda arena: bin_edges((0.0, arena.extent_m / 2)),
        per_zone=False,
        unit="m",
        title="Spread of the group",
        axis="mean distance to the centroid",
        source="Delcourt and Poncin 2012",
    ),
    Statistic(
        name="polarisation",
        label="Polarisation of the group",
        phrase="the polarisation of the group",
        observe=observe_polarisation,
        edges=lambda _: bin_edges((0.0, 1.0)),
        bounded=True,
        per_zone=False,
        title="Polarisation of the group",
        axis="length of the mean direction",
        source="Couzin et al. 2002",
    ),
    Statistic(
        name="neighbour",
        label="Distances to nearest neighbour",
        phrase="the distances to the nearest neighbour",
        observe=observe_neighbour,
        edges=lambda arena: bin_edges(arena.bins.distance_m),
        per_zone=False,
        unit="m",
        title="To the nearest neighbour",
        axis="distance",
        source="Miller and Gerlai 2012",
    ),
)

r"""The score as the authors' published scripts compute it (``--scoring legacy``).

So that a laboratory can compare with its old numbers. Each difference from
``scores`` is deliberate, in them as here:

* D: per sample and zone with two or more agents one value, the mean distance
  over pairs i <= j, where an agent with itself counts as 0; ten bins on
  [0, 0.25] of the arena's extent. What lies beyond is in no bin, yet in the
  total, so the frequencies may sum to less than one.
* T: the rows, each summing to one, one after the other as one vector.
* H is taken of these vectors as they are, not scaled to sum to one. For T it
  can exceed 1, up to the root of the number of zones.
* Each similarity is :math:`(1 - H)^2`, here at most 1, which takes more than
  four zones to exceed; S is the geometric mean of O, D and T.

Where the scripts have no value (a zone without any D), the rules of ``scores``
hold: left out if empty on both sides, 0 if on one. The scripts also count an
agent's first sample as one stay more, and missing agents as a zone; not here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from zfcal.arena import N_BINS, Arena
from zfcal.arrays import Bools, Floats, Indices, Ints
from zfcal.behaviour.histograms import bin_edges, count_cells
from zfcal.behaviour.located import Located, SamplesOrLocated, locate
from zfcal.behaviour.scores import NAN, Scores, from_zones
from zfcal.behaviour.statistics import check_zones, measure
from zfcal.errors import InputError

EXTENT_M = 0.89
"""The extent that the scripts take for the arena of two rooms, in metres."""

_TWO_ROOMS = "two-rooms"

_DISTANCE_SHARE = 0.25
"""D is binned from 0 to this share of the extent."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LegacyStatistics:
    """What a group did in a window, as the authors' scripts count it.

    Parameters
    ----------
    zone_names
        The arena's zones, in its order.
    distance : ndarray of int64, shape (zone, 10)
        Samples by mean distance.
    n_distance : ndarray of int64, shape (zone,)
        Samples with two or more agents in the zone, also those beyond the bins.
    occupation : ndarray of int64, shape (zone,)
        Agent-samples in the zone.
    transition : ndarray of int64, shape (zone, zone)
        Steps from the zone (row) to a zone (column).
    """

    zone_names: tuple[str, ...]
    distance: Ints
    n_distance: Ints
    occupation: Ints
    transition: Ints


def extent_of(arena: Arena) -> float:
    """Return the extent that the scripts take for an arena, in metres.

    Of the two rooms without the rim of the tank; the arena's own elsewhere.
    """
    return EXTENT_M if arena.name == _TWO_ROOMS else arena.extent_m


def measure_legacy(
    samples: SamplesOrLocated, arena: Arena, *, extent_m: float = EXTENT_M
) -> LegacyStatistics:
    """Count what all the given agents did, as the authors' scripts do.

    Parameters
    ----------
    samples
        The agents of a window.
    arena
        Gives the zones; its bins are not used.
    extent_m
        The arena's extent in metres; for an arena other than two-rooms give
        its ``extent_m``.

    Returns
    -------
    LegacyStatistics

    Raises
    ------
    InputError
        The extent is not a positive length.
    """
    if not 0 < extent_m < np.inf:
        raise InputError(f"extent_m must be a positive length in metres, got {extent_m!r}.")
    located = locate(samples, arena)
    counts = measure(located, arena)
    zone, mean_m = _mean_distances(located)
    edges_m = bin_edges((0.0, _DISTANCE_SHARE * extent_m))
    kept = mean_m <= edges_m[-1]
    cell = zone[kept] * N_BINS + np.searchsorted(edges_m[1:-1], mean_m[kept], side="right")
    n_zones = len(arena.zones)
    return LegacyStatistics(
        zone_names=arena.zone_names,
        distance=count_cells(cell, (n_zones, N_BINS)),
        n_distance=np.bincount(zone, minlength=n_zones).astype(np.int64),
        occupation=counts.occupation,
        transition=counts.transition,
    )


def _mean_distances(located: Located) -> tuple[Indices, Floats]:
    """Return zone index and mean distance of every sample's group of two or more in a zone."""
    points = located.take(located.zone > 0)
    order = np.lexsort((points.zone, points.k))
    k, zone, xy_m = points.k[order], points.zone[order], points.xy_m[order]
    new = np.ones(len(k), dtype=np.bool_)
    new[1:] = (k[1:] != k[:-1]) | (zone[1:] != zone[:-1])
    group = np.cumsum(new) - 1
    size = np.bincount(group)
    total_m = np.zeros(len(size))
    for lag in range(1, int(size.max(initial=0))):
        first = np.flatnonzero(group[lag:] == group[:-lag])
        apart_m = np.hypot(*(xy_m[first + lag] - xy_m[first]).T)
        total_m += np.bincount(group[first], apart_m, minlength=len(size))
    shared = size >= 2
    mean_m = total_m[shared] / (size[shared] * (size[shared] + 1) / 2)
    return zone[new][shared].astype(np.intp) - 1, mean_m


def compare_legacy(a: LegacyStatistics, b: LegacyStatistics) -> Scores:
    """Return how alike two windows are, as the authors' scripts score it.

    Parameters
    ----------
    a, b
        Statistics in one arena. The order does not matter.

    Returns
    -------
    Scores
        W is NaN, and T is NaN zone by zone, since they are not scored.

    Raises
    ------
    InputError
        Their zones differ.
    """
    check_zones(a.zone_names, b.zone_names)
    nowhere = np.full((1, len(a.zone_names)), NAN)
    distance = _alike(
        _shares(a.distance, of=a.n_distance[:, None]),
        _shares(b.distance, of=b.n_distance[:, None]),
        empty=(a.n_distance == 0, b.n_distance == 0),
    )
    occupation, transition = (
        _alike(
            _shares(p).ravel(),
            _shares(q).ravel(),
            empty=(np.array(not p.any()), np.array(not q.any())),
        )
        for p, q in ((a.occupation, b.occupation), (a.transition, b.transition))
    )
    # The transitions are one vector, so the mean over "zones" is of this one value.
    scores = from_zones(D=distance[None], W=nowhere, O=occupation[None], T=transition[None, None])
    return scores._replace(T=nowhere).each(a.zone_names)[0]


def _shares(counts: Ints, *, of: Ints | None = None) -> Floats:
    """Return counts over their total; 0 where that is 0."""
    total = counts.sum(axis=-1, keepdims=True) if of is None else of
    return counts / np.where(total > 0, total, 1)


def _alike(p: Floats, q: Floats, *, empty: tuple[Bools, Bools]) -> Floats:
    """Return (1 - H)^2 of vectors of shares; NaN where both are empty, 0 where one is."""
    distance = np.sqrt(0.5 * np.square(np.sqrt(p) - np.sqrt(q)).sum(axis=-1))
    alike = np.where(empty[0] | empty[1], 0.0, np.minimum(np.square(1.0 - distance), 1.0))
    return np.where(empty[0] & empty[1], np.nan, alike)

"""Which detection is which track: least cost of all, within a gate.

The cost of a pair is how far a detection lies from where its track is expected; a track
without a partner costs the gate. Solved exactly (`scipy.optimize.linear_sum_assignment`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from zfcal.arrays import Floats


@dataclass(frozen=True, slots=True, kw_only=True)
class Match:
    """A track and its detection.

    Parameters
    ----------
    track, detection
        Their places in what was matched.
    cost
        Of the pair.
    margin
        How much dearer the cheapest other solution is in which this track and another one
        change detections, or this one takes a free one; infinite without any.
    """

    track: int
    detection: int
    cost: float
    margin: float


def assign(
    cost: Floats,
    gate: Floats,
    tracks: Sequence[int] | None = None,
    detections: Sequence[int] | None = None,
) -> list[Match]:
    """Return the pairs of least total cost, each below its track's gate.

    Parameters
    ----------
    cost : ndarray, shape (track, detection)
        Non-negative.
    gate : ndarray, shape (track,)
        Largest cost of a pair of that track.
    tracks, detections
        Those that are matched, ascending; None for all.

    Returns
    -------
    list of Match
        Ascending by track.
    """
    tracks = range(cost.shape[0]) if tracks is None else tracks
    detections = range(cost.shape[1]) if detections is None else detections
    n_tracks, n_detections = len(tracks), len(detections)
    if not n_tracks or not n_detections:
        return []
    if (n_tracks, n_detections) != cost.shape:
        cost, gate = cost[np.ix_(tracks, detections)], gate[list(tracks)]
    # A column for each track to stay alone in, at the price of its gate.
    full = np.full((n_tracks, n_detections + n_tracks), np.inf)
    full[:, :n_detections] = np.where(cost < gate[:, None], cost, np.inf)
    own = np.arange(n_tracks)
    full[own, n_detections + own] = gate
    rows, columns = (found.tolist() for found in linear_sum_assignment(full))
    pairs = {r: c for r, c in zip(rows, columns, strict=True) if c < n_detections}
    some = full[:, :n_detections].tolist()
    return [
        Match(
            track=tracks[t],
            detection=detections[d],
            cost=some[t][d],
            margin=_margin(some, pairs, t),
        )
        for t, d in pairs.items()
    ]


def _margin(cost: list[list[float]], pairs: dict[int, int], track: int) -> float:
    """Return how much dearer the cheapest change of this track's detection is."""
    own, mine = pairs[track], cost[track]
    taken = set(pairs.values())
    free = [mine[d] - mine[own] for d in range(len(mine)) if d not in taken]
    changed = [
        mine[d] + cost[t][own] - mine[own] - cost[t][d] for t, d in pairs.items() if t != track
    ]
    return min([*free, *changed], default=math.inf)

"""Which detection is which track: least cost of all, within a gate.

The cost of a pair is how far a detection lies from where its track is expected; a track
without a partner costs the gate. Solved exactly (`scipy.optimize.linear_sum_assignment`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

Floats = NDArray[np.float64]


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


def assign(cost: Floats, gate: Floats) -> list[Match]:
    """Return the pairs of least total cost, each below its track's gate.

    Parameters
    ----------
    cost : ndarray, shape (track, detection)
        Non-negative.
    gate : ndarray, shape (track,)
        Largest cost of a pair of that track.

    Returns
    -------
    list of Match
        Ascending by track.
    """
    n_tracks, n_detections = cost.shape
    if not n_tracks or not n_detections:
        return []
    # A column for each track to stay alone in, at the price of its gate.
    alone = np.full((n_tracks, n_tracks), np.inf)
    np.fill_diagonal(alone, gate)
    full = np.hstack([np.where(cost < gate[:, None], cost, np.inf), alone])
    rows, columns = linear_sum_assignment(full)
    pairs = {int(r): int(c) for r, c in zip(rows, columns, strict=True) if c < n_detections}
    return [
        Match(track=t, detection=d, cost=float(cost[t, d]), margin=_margin(full, pairs, t))
        for t, d in pairs.items()
    ]


def _margin(full: Floats, pairs: dict[int, int], track: int) -> float:
    """Return how much dearer the cheapest change of this track's detection is."""
    own = pairs[track]
    n_detections = full.shape[1] - full.shape[0]
    taken = set(pairs.values())
    free = [full[track, d] - full[track, own] for d in range(n_detections) if d not in taken]
    changed = [
        full[track, d] + full[t, own] - full[track, own] - full[t, d]
        for t, d in pairs.items()
        if t != track
    ]
    return float(min([*free, *changed], default=np.inf))

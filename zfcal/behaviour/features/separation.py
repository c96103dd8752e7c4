"""Separation: distances between agents that are in one zone, over the whole tank.

D ends at the arena's ``distance_m``, the range of the paper: in a tank that is larger most
pairs can be in its last bin. The bins here go on to the longest distance that the tank has room
for, and grow with the distance, so that near ones are told apart as well.
"""

from __future__ import annotations

import numpy as np

from zfcal.arena import N_BINS, Arena
from zfcal.arrays import Floats
from zfcal.behaviour.features.distance import observe
from zfcal.behaviour.features.statistic import Statistic


def edges_of(arena: Arena) -> Floats:
    """Return the edges of ten bins that grow with the distance, in metres, shape (11,).

    They are squares of equal steps, to the diagonal of the rectangle around the tank.
    """
    x0, y0, x1, y1 = arena.outline.bounds
    return np.asarray(np.hypot(x1 - x0, y1 - y0) * np.linspace(0.0, 1.0, N_BINS + 1) ** 2)


STATISTICS = (
    Statistic(
        name="separation",
        label="Distances over the whole tank",
        phrase="the distances between fish over the whole tank",
        observe=observe,
        edges=edges_of,
        bounded=True,
        unit="m",
        title="Pairs, whole tank",
        axis="distance",
        source="D, with bins fitted to the tank",
    ),
)

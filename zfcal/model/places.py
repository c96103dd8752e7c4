"""Places of an arena at which an effect of place is asked for."""

from __future__ import annotations

import math

import numpy as np
import shapely

from zfcal.arena import Arena
from zfcal.arrays import Floats

_PLACES = 12
_POINTS = 2000
_ROUNDS = 30


def places(arena: Arena, n: int = _PLACES) -> tuple[tuple[float, float], ...]:
    """Return x and y, in metres, of n places that share the tank evenly among them.

    Each is the middle of the points that are nearest to it (Lloyd 1982, IEEE Transactions
    on Information Theory 28: 129-137), from a start that is as far apart as can be.
    """
    points = _points_inside(arena.outline)
    middles = _far_apart(points, n)
    for _ in range(_ROUNDS):
        owner = _distances(points, middles).argmin(axis=1)
        middles = np.array([points[owner == k].mean(axis=0) for k in range(n)])
    # A middle can lie outside where the tank is bent round a corner.
    return tuple(map(tuple, points[_distances(points, middles).argmin(axis=0)].tolist()))


def _points_inside(outline: shapely.Polygon) -> Floats:
    x0, y0, x1, y1 = outline.bounds
    spacing = math.sqrt(outline.area / _POINTS)
    x, y = np.meshgrid(np.arange(x0, x1, spacing), np.arange(y0, y1, spacing))
    points = np.column_stack([x.ravel(), y.ravel()]) + spacing / 2
    return points[shapely.contains_xy(outline, points)]


def _far_apart(points: Floats, n: int) -> Floats:
    """Return n of the points, each as far as can be from those before it."""
    chosen = [points[0]]
    for _ in range(n - 1):
        chosen.append(points[_distances(points, np.array(chosen)).min(axis=1).argmax()])
    return np.array(chosen)


def _distances(points: Floats, middles: Floats) -> Floats:
    return np.asarray(np.linalg.norm(points[:, None] - middles[None], axis=-1))

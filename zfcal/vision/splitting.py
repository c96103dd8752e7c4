"""Blobs of several animals, divided: how many they hold, and which pixel is whose.

How many is told by area, against what one animal covers, and by how many were last seen
there. Which pixel is whose by clusters, or by moving the bodies as last seen until they cover
the blob. Assignment over time is the business of others.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from zfcal.vision.detect import Blob

Floats = NDArray[np.float64]

_ITERATIONS = 12
_SEVERAL = 1.45
"""Areas of one body vary by a fifth with its bend; from this many areas on there are two."""

_COVERED = 0.65
"""Share of their areas that animals cover at least where they cross."""

_MOST = 8


def count_in(blob: Blob, *, area_px: float, expected: int = 1) -> int:
    """Return how many animals a blob holds.

    Parameters
    ----------
    blob
        The blob.
    area_px
        What one animal covers; NaN where that is not known, then it is one.
    expected
        How many are thought to be there: a crossing covers less than two bodies.
    """
    if not area_px > 0:
        return 1
    areas = blob.area_px / area_px
    told = 1 if areas < _SEVERAL else max(2, round(areas))
    if expected > told and areas > _COVERED * expected:
        return min(expected, _MOST)
    return min(told, _MOST)


def by_clusters(blob: Blob, n: int, seeds: Floats | None = None) -> list[NDArray[np.bool_]]:
    """Return which pixels of a blob belong to each of n animals, by k-means.

    Parameters
    ----------
    n
        How many.
    seeds : ndarray, shape (animal, 2), optional
        Where they are expected; farthest points otherwise.

    Returns
    -------
    list of ndarray of bool, each of shape (pixel,)
    """
    centres = _farthest(blob.pixels, n) if seeds is None or len(seeds) != n else seeds.copy()
    whose = np.zeros(len(blob.pixels), np.int64)
    for _ in range(_ITERATIONS):
        away = np.hypot(*np.moveaxis(blob.pixels[:, None] - centres[None], -1, 0))
        fresh = away.argmin(axis=1)
        if (fresh == whose).all() and _:
            break
        whose = fresh
        for k in range(n):
            own = whose == k
            if own.any():
                centres[k] = np.average(blob.pixels[own], axis=0, weights=blob.weights[own])
    parts = [whose == k for k in range(n)]
    return [part for part in parts if part.sum() >= 3]


def _farthest(pixels: Floats, n: int) -> Floats:
    """Return n points of a blob that lie far apart, the first farthest from its middle."""
    away = ((pixels - pixels.mean(axis=0)) ** 2).sum(axis=1)
    chosen = [int(away.argmax())]
    away = np.full(len(pixels), math.inf)
    while len(chosen) < n:
        away = np.minimum(away, ((pixels - pixels[chosen[-1]]) ** 2).sum(axis=1))
        chosen.append(int(away.argmax()))
    return pixels[chosen].copy()

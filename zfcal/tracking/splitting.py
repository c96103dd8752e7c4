"""Blobs of several animals, divided: which pixel is whose.

By rising darkness, where only the edges of bodies touch, or by clusters. How many a blob holds
and who they are is the business of others.
"""

from __future__ import annotations

import math

import cv2
import numpy as np

from zfcal.arrays import Bools, Floats
from zfcal.tracking._kernels import clusters, nearest_squared
from zfcal.tracking.blobs import Blob

_ITERATIONS = 12

_SHARPER = (0.45, 0.6, 0.75, 0.9)
"""Shares of full body at which a blob may fall into its animals."""

_PIECE = 0.3
"""Share of an animal's area that a piece must have at least, to be one."""


def by_darkness(blob: Blob, n: int, *, area_px: float) -> list[Bools]:
    """Return which pixels of a blob belong to each of n animals that only their edges join.

    The blob is cut at rising darkness until n pieces of some size are left; every other pixel
    goes to the nearest of them. Empty where it never falls into just as many.

    Parameters
    ----------
    n
        How many.
    area_px
        What one animal covers.

    Returns
    -------
    list of ndarray of bool, each of shape (pixel,)
    """
    corner = blob.pixels.min(axis=0).astype(int)
    columns, rows = (blob.pixels.astype(int) - corner).T
    for level in _SHARPER:
        mask = np.zeros((rows.max() + 1, columns.max() + 1), np.uint8)
        dark = blob.weights >= level
        mask[rows[dark], columns[dark]] = 1
        n_pieces, labels = cv2.connectedComponents(mask, connectivity=4)
        label = labels[rows, columns]
        sizes = np.bincount(label, minlength=n_pieces)[1:]
        large = np.flatnonzero(sizes >= _PIECE * area_px) + 1
        if len(large) == n:
            away = np.stack([nearest_squared(blob.pixels, blob.pixels[label == k]) for k in large])
            whose = away.argmin(axis=0)
            return [whose == k for k in range(n)]
    return []


def by_clusters(blob: Blob, n: int, seeds: Floats | None = None) -> list[Bools]:
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
    whose = clusters(blob.pixels, blob.weights, centres, _ITERATIONS)
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

"""The animals of a frame from its blobs: how many each holds, and where in it they are.

A blob of several is divided by rising darkness, where only the edges of bodies touch, by the
bodies that are fitted to it, or by clusters.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import cv2
import numpy as np
from scipy.optimize import linear_sum_assignment

from zfcal.arrays import Bools, Floats
from zfcal.tracking._kernels import clusters, nearest_squared
from zfcal.tracking.blobs import Blob, Shape, shape_of
from zfcal.tracking.fitting import fit
from zfcal.tracking.trail import Detection, Trail
from zfcal.tracking.usual import Body

_SEVERAL = 1.5
"""Areas of one body vary by a fifth with its bend; from this many areas on there are two."""

_COVERED = 0.65
"""Share of their areas that animals cover at least where they cross."""

_DOUBTED = 0.75
"""Share of their areas below which not all animals may be where they are thought to be."""

_MOST = 8

_NEAR_PX = 3
"""So far around a blob bodies would show, if they were there."""

_ITERATIONS = 12

_SHARPER = (0.45, 0.6, 0.75, 0.9)
"""Shares of full body at which a blob may fall into its animals."""

_PIECE = 0.3
"""Share of an animal's area that a piece must have at least, to be one."""


def divide(
    blobs: list[Blob],
    thought: list[list[Trail]],
    usual: Body,
    *,
    n_agents: int | None,
    time_s: float,
) -> list[Detection]:
    """Return the animals in blobs: those expected in one, and those that its area tells.

    Parameters
    ----------
    blobs
        Of a frame.
    thought
        For each, the tracks that should be in it.
    usual
        What an animal looks like.
    n_agents
        How many there are in the tank; None where that is not known.
    time_s
        Of the frame.
    """
    areas = [_areas(blob, trails, usual) for blob, trails in zip(blobs, thought, strict=True)]
    counts = [
        _count(blob_areas, len(trails), known=n_agents is not None)
        for blob_areas, trails in zip(areas, thought, strict=True)
    ]
    if n_agents is not None:
        _reduce(counts, areas, n_agents)
    found: list[Detection] = []
    for blob, trails, n, blob_areas in zip(blobs, thought, counts, areas, strict=True):
        for trail in trails:
            trail.crowd(blob_areas < _DOUBTED * len(trails))
        parts = _parts(blob, n, trails, usual, time_s)
        if _is_forced(blob_areas, n):
            parts = (replace(part, is_forced=True) for part in parts)
        found += parts
    return found


def _is_forced(areas: float, n: int) -> bool:
    """Return whether a blob is too small for n animals, or so large that it should hold more."""
    return (n > 1 and areas < _DOUBTED * n) or areas >= n + 0.5


def _areas(blob: Blob, trails: list[Trail], usual: Body) -> float:
    """Return how many times as large as one of those expected in it a blob is."""
    if not usual.area_px > 0:
        return 1.0
    own = [trail.own_area_px(usual.area_px) for trail in trails]
    return blob.area_px / (sum(own) / len(own) if own else usual.area_px)


def _count(areas: float, expected: int, *, known: bool) -> int:
    """Return how many animals a blob of so many times one's area holds."""
    told = 1 if areas < _SEVERAL else max(2, round(areas))
    # Where the number of animals is known, one of them may lie wholly under another.
    if expected > told and (known or areas > _COVERED * expected):
        told = expected
    return min(told, _MOST)


def _reduce(counts: list[int], areas: list[float], n_agents: int) -> None:
    """Take animals out of the blobs that are least large enough, until as many are left."""
    while sum(counts) > n_agents and max(counts) > 1:
        lacking = [n - a if n > 1 else -np.inf for n, a in zip(counts, areas, strict=True)]
        counts[int(np.argmax(lacking))] -= 1


def _parts(
    blob: Blob, n: int, trails: list[Trail], usual: Body, time_s: float
) -> Iterator[Detection]:
    if n == 1:
        yield Detection(shape=shape_of(blob.pixels, blob.weights, blob.corners), blob=blob)
        return
    parts = by_darkness(blob, n, area_px=usual.area_px)
    if not parts:
        seeds = np.array([trail.predicted(time_s) for trail in trails]).reshape(-1, 2)
        parts = by_clusters(blob, n, seeds)
        if len(parts) == len(trails):
            yield from _fitted(blob, parts, trails, usual, time_s)
            return
    for part in parts:
        shape = shape_of(blob.pixels[part], blob.weights[part])
        share = blob.shares[part]
        yield Detection(
            shape=shape, blob=blob, shared=n, own_darkness=float(share @ share / share.sum())
        )


def _fitted(
    blob: Blob, parts: list[Bools], trails: list[Trail], usual: Body, time_s: float
) -> Iterator[Detection]:
    """Yield the bodies of tracks that lie across each other, moved until they explain the blob.

    They start from where they are due, and again from the parts, each turned to the side that its
    track headed to: a fish may turn by a right angle from one frame to the next.
    """
    shapes = [shape_of(blob.pixels[part], blob.weights[part]) for part in parts]
    at = np.array([(shape.x_px, shape.y_px) for shape in shapes])
    due = np.array([[*trail.predicted(time_s), trail.heading_rad] for trail in trails])
    order, own = linear_sum_assignment(((due[:, None, :2] - at[None]) ** 2).sum(axis=2))
    apart = due.copy()
    for t, k in zip(order, own, strict=True):
        apart[t] = *at[k], _aligned(shapes[k].axis_rad, due[t, 2])
    pixels, shares = _around(blob)
    builds = [trail.build(usual) for trail in trails]
    best = min(
        (fit(pixels, shares, builds, due, start) for start in (due, apart)),
        key=lambda found: found.cost,
    )
    for (x, y, angle, _), trail, build in zip(best.poses, trails, builds, strict=True):
        shape = Shape(
            x_px=float(x),
            y_px=float(y),
            axis_rad=math.remainder(float(angle), math.tau),
            head=0.0,
            length_px=build.length_px,
            width_px=build.width_px,
            area_px=trail.own_area_px(usual.area_px),
        )
        yield Detection(shape=shape, blob=blob, shared=len(parts))


def _around(blob: Blob) -> tuple[Floats, Floats]:
    """Return the pixels of a blob and those near it, which are as bright as the tank."""
    left, top = blob.pixels.min(axis=0).astype(int) - _NEAR_PX
    columns, rows = (blob.pixels - (left, top)).astype(int).T
    share = np.zeros((rows.max() + 1 + _NEAR_PX, columns.max() + 1 + _NEAR_PX))
    share[rows, columns] = blob.shares
    near = cv2.dilate((share > 0).astype(np.uint8), np.ones((2 * _NEAR_PX + 1,) * 2, np.uint8))
    y, x = np.nonzero(near)
    return np.column_stack([x + left, y + top]).astype(np.float64), share[y, x]


def _aligned(axis_rad: float, heading_rad: float) -> float:
    """Return that end of an axis that is nearer to a heading."""
    return axis_rad if np.cos(axis_rad - heading_rad) >= 0 else axis_rad + np.pi


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

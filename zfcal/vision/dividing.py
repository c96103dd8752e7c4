"""The animals of a frame from its blobs: how many each holds, and where in it they are."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from zfcal.vision.detect import Blob, shape_of
from zfcal.vision.splitting import Pose, by_clusters, by_darkness, fit_bodies
from zfcal.vision.trail import Detection, Trail
from zfcal.vision.usual import Body

Floats = NDArray[np.float64]

_SEVERAL = 1.5
"""Areas of one body vary by a fifth with its bend; from this many areas on there are two."""

_COVERED = 0.65
"""Share of their areas that animals cover at least where they cross."""

_DOUBTED = 0.75
"""Share of their areas below which not all animals may be where they are thought to be."""

_MOST = 8


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
        found += _parts(blob, n, trails, usual, time_s)
    return found


def _areas(blob: Blob, trails: list[Trail], usual: Body) -> float:
    """Return how many times as large as one of those expected in it a blob is."""
    if not usual.area_px > 0:
        return 1.0
    own = [trail.own_area_px(usual.area_px) for trail in trails]
    return blob.area_px / (float(np.mean(own)) if own else usual.area_px)


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
        yield Detection(shape=shape, blob=blob, shared=n)


def _fitted(
    blob: Blob, parts: list[NDArray[np.bool_]], trails: list[Trail], usual: Body, time_s: float
) -> Iterator[Detection]:
    """Yield the bodies of tracks that lie across each other, moved until they cover the blob.

    They start from the parts, each turned to the side that its track headed to: a fish may
    turn by a right angle from one frame to the next.
    """
    shapes = [shape_of(blob.pixels[part], blob.weights[part]) for part in parts]
    at = np.array([(shape.x_px, shape.y_px) for shape in shapes])
    due = np.array([trail.predicted(time_s) for trail in trails])
    order, own = linear_sum_assignment(((due[:, None] - at[None]) ** 2).sum(axis=2))
    start = [
        Pose(
            x_px=shapes[k].x_px,
            y_px=shapes[k].y_px,
            axis_rad=_aligned(shapes[k].axis_rad, trails[t].heading_rad),
        )
        for t, k in zip(order, own, strict=True)
    ]
    for _, shape in zip(
        trails, fit_bodies(blob, [trail.body(usual) for trail in trails], start), strict=True
    ):
        yield Detection(shape=shape, blob=blob, shared=len(parts))


def _aligned(axis_rad: float, heading_rad: float) -> float:
    """Return that end of an axis that is nearer to a heading."""
    return axis_rad if np.cos(axis_rad - heading_rad) >= 0 else axis_rad + np.pi

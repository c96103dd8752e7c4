"""Blobs of several animals, divided: how many they hold, and which pixel is whose.

How many is told by area, against what one animal covers, and by how many were last seen
there. Which pixel is whose by clusters, or by moving the bodies as last seen until they cover
the blob. Assignment over time is the business of others.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from zfcal.vision.detect import Blob, Shape

Floats = NDArray[np.float64]

_ITERATIONS = 12

_POINTS = 40
_PIXELS = 240
"""Points of a body and pixels of a blob that count: more make it no more exact."""

_ROUNDS = 6
_PRIOR = 0.05

_SHARPER = (0.45, 0.6, 0.75, 0.9)
"""Shares of full body at which a blob may fall into its animals."""

_PIECE = 0.3
"""Share of an animal's area that a piece must have at least, to be one."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Template:
    """A body to be moved over a blob.

    Parameters
    ----------
    points : ndarray, shape (point, 2)
        Spread evenly over it, about its centroid, head towards x, in pixels.
    area_px
        Pixels that it covers.
    """

    points: Floats
    area_px: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Pose:
    """Where a body is expected: centroid in pixels, direction of the head in the image."""

    x_px: float
    y_px: float
    axis_rad: float


def template_of(pixels: Floats, weights: Floats, axis_rad: float) -> Template:
    """Return a body as a template.

    Parameters
    ----------
    pixels : ndarray, shape (pixel, 2)
    weights : ndarray, shape (pixel,)
    axis_rad
        Direction of its head in the image.
    """
    body = weights > 0.5
    kept = pixels[body][:: max(1, int(body.sum()) // _POINTS)]
    centre = weights @ pixels / weights.sum()
    points = (kept - centre) @ _turn(axis_rad)
    return Template(points=points - points.mean(axis=0), area_px=float(weights.sum()))


def ellipse(length_px: float, width_px: float) -> Template:
    """Return an ellipse as a template, for a body that was never seen alone."""
    along, across = np.meshgrid(np.linspace(-0.5, 0.5, 13), np.linspace(-0.5, 0.5, 5))
    inside = along**2 + across**2 <= 0.25
    points = np.column_stack([along[inside] * length_px, across[inside] * width_px])
    return Template(points=points, area_px=math.pi / 4 * length_px * width_px)


def fit_bodies(blob: Blob, bodies: list[Template], start: list[Pose]) -> list[Shape]:
    """Return where bodies are that together cover a blob, in their order.

    Each is moved as it is, from where it is thought to be. Every pixel of the blob is shared
    out among the points of all bodies that are near, ever more sharply, and each body moves
    to where its pixels are: expectation maximisation for a mixture of Gaussians on rigid
    bodies (coherent point drift, Myronenko & Song 2010). The start counts for a twentieth.
    """
    step = max(1, len(blob.pixels) // _PIXELS)
    pixels, weights = blob.pixels[::step], blob.weights[::step]
    angles = np.array([pose.axis_rad for pose in start])
    centres = np.array([(pose.x_px, pose.y_px) for pose in start])
    at_first = centres.copy()
    width = math.sqrt(min(body.area_px for body in bodies)) / 3
    whose = np.repeat(np.arange(len(bodies)), [len(body.points) for body in bodies])
    density = np.concatenate([np.full(len(b.points), b.area_px / len(b.points)) for b in bodies])
    for sd in width * np.geomspace(1.0, 0.3, _ROUNDS):
        points = np.concatenate(
            [b.points @ _turn(-a) + c for b, a, c in zip(bodies, angles, centres, strict=True)]
        )
        away = ((pixels[:, None] - points[None]) ** 2).sum(axis=2)
        share = density * np.exp(-(away - away.min(axis=1, keepdims=True)) / (2 * sd**2))
        share *= (weights / share.sum(axis=1))[:, None]
        for k, body in enumerate(bodies):
            own = share[:, whose == k]
            centres[k], angles[k] = _moved(
                body.points, own, pixels, (at_first[k], start[k].axis_rad)
            )
    return [
        Shape(
            x_px=float(centre[0]),
            y_px=float(centre[1]),
            axis_rad=math.remainder(float(angle), math.tau),
            head=0.0,
            length_px=4 * float(np.sqrt(np.mean(body.points[:, 0] ** 2))),
            width_px=4 * float(np.sqrt(np.mean(body.points[:, 1] ** 2))),
            area_px=body.area_px,
        )
        for body, centre, angle in zip(bodies, centres, angles, strict=True)
    ]


def _moved(
    points: Floats, share: Floats, pixels: Floats, first: tuple[Floats, float]
) -> tuple[Floats, float]:
    """Return the centre and angle of a body that bring its points to their pixels (Procrustes)."""
    mass = share.sum(axis=0)
    prior = _PRIOR * mass.sum() / len(points) + 1e-9
    expected = points @ _turn(-first[1]) + first[0]
    target = (share.T @ pixels + prior * expected) / (mass + prior)[:, None]
    weight = (mass + prior) / (mass + prior).sum()
    middle, origin = weight @ target, weight @ points
    cross = ((points - origin) * weight[:, None]).T @ (target - middle)
    angle = math.atan2(cross[0, 1] - cross[1, 0], cross[0, 0] + cross[1, 1])
    return middle - origin @ _turn(-angle), angle


def _turn(angle_rad: float) -> Floats:
    """Return the matrix that, from the right, turns rows back by an angle."""
    cos, sin = math.cos(angle_rad), math.sin(angle_rad)
    return np.array([[cos, -sin], [sin, cos]])


def by_darkness(blob: Blob, n: int, *, area_px: float) -> list[NDArray[np.bool_]]:
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
            away = np.stack([_nearest(blob.pixels, blob.pixels[label == k]) for k in large])
            whose = away.argmin(axis=0)
            return [whose == k for k in range(n)]
    return []


def _nearest(pixels: Floats, piece: Floats) -> Floats:
    return ((pixels[:, None] - piece[None]) ** 2).sum(axis=2).min(axis=1)


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

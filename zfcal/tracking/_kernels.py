"""What is compiled of finding blobs: their pixels, moments, distances, clusters.

Formulas on arrays alone; what they are for is told by who calls them. Arrays are contiguous,
so that each is compiled once.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from zfcal.arrays import Floats, Grey, Ints
from zfcal.cameras._kernels import kernel, median_ratio, read_grid

F = TypeVar("F", bound=Callable[..., Any])


def summing(function: F) -> F:
    """Compile a function that may add up in any order."""
    return kernel(function, fastmath={"reassoc", "contract"})


@kernel
def shades(inside: Grey, grey: Grey, level: Grey, left: int, top: int) -> tuple[Floats, Floats]:
    """Return the pixels in or beside a mask that are darker than the tank, and by which share.

    Parameters
    ----------
    inside : ndarray of uint8, shape (row, column)
        The mask of a part of the image; those above, below, left and right of it count as well.
    grey, level : ndarray of uint8, shape (height, width)
        The image and the empty tank.
    left, top
        Where the part begins.

    Returns
    -------
    pixels : ndarray, shape (pixel, 2)
        x and y in the image, row by row.
    shares : ndarray, shape (pixel,)
        Of the tank's grey.
    """
    height, width = inside.shape
    pixels, shares = np.empty((height * width, 2)), np.empty(height * width)
    n = 0
    for y in range(height):
        for x in range(width):
            tank, seen = level[y + top, x + left], grey[y + top, x + left]
            if tank > seen and (
                inside[y, x]
                or (y > 0 and inside[y - 1, x])
                or (x > 0 and inside[y, x - 1])
                or (x + 1 < width and inside[y, x + 1])
                or (y + 1 < height and inside[y + 1, x])
            ):
                pixels[n, 0], pixels[n, 1] = x + left, y + top
                shares[n] = (float(tank) - seen) / float(tank)
                n += 1
    return pixels[:n].copy(), shares[:n].copy()


@kernel
def _is_whole(mask: Grey, x: int, y: int) -> bool:
    """Return whether a pixel and its four neighbours, as far as there are any, are in a mask."""
    height, width = mask.shape
    return (
        mask[y, x] > 0
        and (y == 0 or mask[y - 1, x] > 0)
        and (x == 0 or mask[y, x - 1] > 0)
        and (x + 1 == width or mask[y, x + 1] > 0)
        and (y + 1 == height or mask[y + 1, x] > 0)
    )


@kernel
def outlasts_opening(mask: Grey, inside: Grey, left: int, top: int) -> bool:
    """Return whether anything of a part of a mask is left when it is opened by a cross.

    Parameters
    ----------
    mask : ndarray of uint8, shape (height, width)
    inside : ndarray of uint8, shape (row, column)
        Which pixels of the part count.
    left, top
        Where the part begins.
    """
    height, width = mask.shape
    for row in range(inside.shape[0]):
        for column in range(inside.shape[1]):
            if not inside[row, column]:
                continue
            y, x = row + top, column + left
            if (
                _is_whole(mask, x, y)
                or (y > 0 and _is_whole(mask, x, y - 1))
                or (x > 0 and _is_whole(mask, x - 1, y))
                or (x + 1 < width and _is_whole(mask, x + 1, y))
                or (y + 1 < height and _is_whole(mask, x, y + 1))
            ):
                return True
    return False


@kernel
def moments(
    pixels: Floats, weights: Floats
) -> tuple[float, float, float, float, tuple[float, float, float]]:
    """Return mass, centre and long axis of weighted pixels, and their moments along it.

    Returns
    -------
    total, x, y, angle_rad : float
    central : tuple of float
        Second moment along the axis, second moments of both axes together, third along it.
    """
    total, x, y = 0.0, 0.0, 0.0
    for p in range(weights.size):
        total += weights[p]
        x += weights[p] * pixels[p, 0]
        y += weights[p] * pixels[p, 1]
    x, y = x / total, y / total
    xx, yy, xy = 0.0, 0.0, 0.0
    for p in range(weights.size):
        dx, dy = pixels[p, 0] - x, pixels[p, 1] - y
        xx += weights[p] * dx * dx
        yy += weights[p] * dy * dy
        xy += weights[p] * dx * dy
    angle = 0.5 * math.atan2(2 * xy, xx - yy)
    cos, sin = math.cos(angle), math.sin(angle)
    second, third = 0.0, 0.0
    for p in range(weights.size):
        along = (pixels[p, 0] - x) * cos + (pixels[p, 1] - y) * sin
        second += weights[p] * along**2
        third += weights[p] * along**3
    return total, x, y, angle, (second / total, (xx + yy) / total, third / total)


@kernel
def nearest_squared(pixels: Floats, points: Floats) -> Floats:
    """Return how far each pixel is from the nearest of some points, squared, shape (pixel,)."""
    found = np.empty(len(pixels))
    for p in range(len(pixels)):
        best = np.inf
        for k in range(len(points)):
            dx, dy = pixels[p, 0] - points[k, 0], pixels[p, 1] - points[k, 1]
            best = min(best, dx * dx + dy * dy)
        found[p] = best
    return found


@kernel
def clusters(pixels: Floats, weights: Floats, centres: Floats, rounds: int) -> Ints:
    """Return the cluster of each pixel by k-means; the centres are moved in place.

    Parameters
    ----------
    pixels : ndarray, shape (pixel, 2)
    weights : ndarray, shape (pixel,)
    centres : ndarray, shape (cluster, 2)
        Where they begin; one without any pixel stays.
    rounds
        At most.
    """
    whose = np.full(len(pixels), -1, np.int64)
    for _ in range(rounds):
        moved = 0
        total, sums = np.zeros(len(centres)), np.zeros(centres.shape)
        for p in range(len(pixels)):
            best, nearest = np.inf, 0
            for k in range(len(centres)):
                dx, dy = pixels[p, 0] - centres[k, 0], pixels[p, 1] - centres[k, 1]
                away = dx * dx + dy * dy
                if away < best:
                    best, nearest = away, k
            moved += whose[p] != nearest
            whose[p] = nearest
            total[nearest] += weights[p]
            for axis in range(2):
                sums[nearest, axis] += weights[p] * pixels[p, axis]
        if moved == 0:
            break
        for k in range(len(centres)):
            if total[k] > 0:
                centres[k] = sums[k] / total[k]
    return whose


@kernel
def step_costs(at: Floats, to: Floats, along_share: float, heading: float) -> Floats:
    """Return how far sightings are from where tracks are due, and how else they lie, squared.

    Parameters
    ----------
    at : ndarray, shape (track, 3 or more)
        x, y and heading.
    to : ndarray, shape (sighting, 4 or more)
        x, y, direction of the axis, and what speaks for its head.
    along_share
        Ways along the body, half-way through its turn, count by this share.
    heading
        What a turn by a right angle is worth.
    """
    found = np.empty((len(at), len(to)))
    for t in range(len(at)):
        for d in range(len(to)):
            turn = to[d, 2] - at[t, 2]
            middle = at[t, 2] + math.atan2(math.sin(turn), math.cos(turn)) / 2
            dx, dy = to[d, 0] - at[t, 0], to[d, 1] - at[t, 1]
            cos, sin = math.cos(middle), math.sin(middle)
            along, across = dx * cos + dy * sin, dy * cos - dx * sin
            head, facing = to[d, 3], math.cos(turn)
            faces = head * facing + (1 - head) * abs(facing)
            found[t, d] = (along * along_share) ** 2 + across**2 + heading * (1 - faces)
    return found


def prepare() -> None:
    """Compile all, so that no frame has to wait for it."""
    mask, level, dark = (np.full((2, 2), value, np.uint8) for value in (1, 9, 3))
    pixels, weights = shades(mask, dark, level, 0, 0)
    outlasts_opening(mask, dark, 0, 0)
    moments(pixels, weights)
    nearest_squared(pixels, pixels)
    clusters(pixels, weights, pixels.copy(), 1)
    some = np.ones((2, 4))
    step_costs(some, some, 1.0, 1.0)
    read_grid(np.ones((2, 2, 2)), pixels)
    median_ratio(mask, dark, 0, 1)

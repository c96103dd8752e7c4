"""Unit vectors, turned."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from zfcal.arrays import Floats


def left_of(ways: Floats) -> Floats:
    """Return vectors turned to the left by a right angle.

    Parameters
    ----------
    ways : ndarray, shape (..., 2)
    """
    return np.stack([-ways[..., 1], ways[..., 0]], axis=-1)


def lengths(ways: Floats) -> Floats:
    """Return how long vectors are, shape (...).

    As `numpy.linalg.norm`, which takes several times as long over an axis of two.

    Parameters
    ----------
    ways : ndarray, shape (..., 2)
    """
    x, y = ways[..., 0], ways[..., 1]
    return np.asarray(np.sqrt(x * x + y * y))


def turned_by(ways: Floats, angle_rad: ArrayLike) -> Floats:
    """Return vectors turned to the left, shape (..., 2).

    Parameters
    ----------
    ways : ndarray, shape (..., 2)
    angle_rad : array_like
        For each of them, or for all.
    """
    c, s = np.cos(angle_rad)[..., None], np.sin(angle_rad)[..., None]
    made = np.empty(np.broadcast_shapes(ways.shape, c.shape))
    x, y, c, s = ways[..., 0], ways[..., 1], c[..., 0], s[..., 0]
    np.subtract(c * x, s * y, out=made[..., 0])
    np.add(c * y, s * x, out=made[..., 1])
    return made


def doubled(ways: Floats) -> Floats:
    """Return unit vectors at twice the angle, which those of an axis share, shape (..., 2).

    Parameters
    ----------
    ways : ndarray, shape (..., 2)
        Unit vectors.
    """
    x, y = ways[..., 0], ways[..., 1]
    return np.stack([x * x - y * y, 2 * x * y], axis=-1)


def in_tank(x_axis: Floats, ways: Floats) -> Floats:
    """Return directions that are seen as those of the tank, shape (step, way, 2).

    Parameters
    ----------
    x_axis : ndarray, shape (step, 2)
        Where that of the tank is seen.
    ways : ndarray, shape (step, way, 2)
        As seen.
    """
    return of_tank(x_axis * [1.0, -1.0], ways)


def of_tank(x_axis: Floats, ways: Floats) -> Floats:
    """Return directions of the tank as they are seen, shape (step, way, 2).

    Parameters
    ----------
    x_axis : ndarray, shape (step, 2)
        Where that of the tank is seen.
    ways : ndarray, shape (step or 1, way, 2)
        In the tank.
    """
    c, s = x_axis[:, None, :1], x_axis[:, None, 1:]
    return np.asarray(c * ways + s * left_of(ways))

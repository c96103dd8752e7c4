"""Where a place is, from each position."""

from __future__ import annotations

import math

import numpy as np

from zfcal.arrays import Floats
from zfcal.model.kernels.compiled import kernel

_AT_IT_M = 1e-9


@kernel
def write_ways_to(
    xy_m: Floats, x_axis: Floats, spot: Floats, toward: Floats, far_m: Floats
) -> None:
    """Write unit vectors to a place, as they are seen, and how far it is; zeros at it.

    Parameters
    ----------
    xy_m : ndarray, shape (step, 2)
    x_axis : ndarray, shape (step, 2)
        Where that of the tank is seen.
    spot : ndarray, shape (2,)
    toward : ndarray, shape (step, 2)
    far_m : ndarray, shape (step,)
    """
    for s in range(xy_m.shape[0]):
        x, y = spot[0] - xy_m[s, 0], spot[1] - xy_m[s, 1]
        far_m[s] = math.sqrt(x * x + y * y)
        away = max(far_m[s], _AT_IT_M)
        x, y = x / away, y / away
        c, d = x_axis[s, 0], x_axis[s, 1]
        toward[s, 0], toward[s, 1] = c * x - d * y, c * y + d * x


def distances_to(xy_m: Floats, spot: Floats) -> Floats:
    """Return how far a place is from positions, shape (row, heading).

    Parameters
    ----------
    xy_m : ndarray, shape (row, heading, 2)
    spot : ndarray, shape (2,)
    """
    far_m = np.empty(xy_m.shape[:-1])
    _write_distances(np.ascontiguousarray(xy_m).reshape(-1, 2), spot, far_m.reshape(-1))
    return far_m


@kernel
def _write_distances(xy_m: Floats, spot: Floats, far_m: Floats) -> None:
    for i in range(xy_m.shape[0]):
        x, y = spot[0] - xy_m[i, 0], spot[1] - xy_m[i, 1]
        far_m[i] = math.sqrt(x * x + y * y)

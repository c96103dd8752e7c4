"""What is compiled for all who look through a camera: its grid, its brightness.

How a function is compiled is told here as well. Arrays are contiguous, so that each is
compiled once.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
from numba import njit

from zfcal.arrays import Floats, Grey

F = TypeVar("F", bound=Callable[..., Any])


def kernel(function: F, **options: Any) -> F:
    """Compile a function, and keep it for the next start where there is a place to.

    It calls none of another file: whether a kept version still holds is told by its own file.
    """
    try:
        compiled: Any = njit(cache=True, nogil=True, **options)(function)
    except RuntimeError:
        compiled = njit(nogil=True, **options)(function)
    return compiled


@kernel
def read_grid(grid: Floats, at: Floats) -> Floats:
    """Return what lies between the points of a grid, by straight lines; NaN beyond it.

    Parameters
    ----------
    grid : ndarray, shape (column, row, 2)
    at : ndarray, shape (point, 2)
        In steps of the grid.
    """
    found = np.full(at.shape, np.nan)
    for p in range(len(at)):
        i, j = math.floor(at[p, 0]), math.floor(at[p, 1])
        i, j = min(max(i, 0), grid.shape[0] - 2), min(max(j, 0), grid.shape[1] - 2)
        right, down = at[p, 0] - i, at[p, 1] - j
        if not (0 <= right <= 1 and 0 <= down <= 1):
            continue
        for axis in range(2):
            upper = (1 - right) * grid[i, j, axis] + right * grid[i + 1, j, axis]
            lower = (1 - right) * grid[i, j + 1, axis] + right * grid[i + 1, j + 1, axis]
            found[p, axis] = (1 - down) * upper + down * lower
    return found


@kernel
def median_ratio(one: Grey, other: Grey, first: int, step: int) -> float:
    """Return the median ratio of two images on a grid, each grey counted from one.

    Parameters
    ----------
    one, other : ndarray of uint8, shape (height, width)
    first, step
        Of the grid's rows and columns.
    """
    height, width = one.shape
    rows, columns = (height - first - 1) // step + 1, (width - first - 1) // step + 1
    ratio = np.empty(rows * columns)
    for i in range(rows):
        for j in range(columns):
            y, x = first + i * step, first + j * step
            ratio[i * columns + j] = (float(one[y, x]) + 1.0) / (float(other[y, x]) + 1.0)
    return float(np.median(ratio))

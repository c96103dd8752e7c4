"""Hat functions: of what weights go by, with a strength for each knot."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from zfcal.arrays import Floats
from zfcal.model.kernels.compiled import inlined, kernel


@inlined
def hat_at(x: float, knots: Floats) -> tuple[int, float]:
    """Return the knot at or below a value and the weight of the one after it; NaN for NaN.

    Parameters
    ----------
    x
        No lower than the first knot, and no higher than the last.
    knots : ndarray, shape (knot,)
        Two or more, ascending.
    """
    last = knots.size - 1
    below = last - 1 if math.isnan(x) else 0
    while below < last - 1 and x >= knots[below + 1]:
        below += 1
    return below, (x - knots[below]) / (knots[below + 1] - knots[below])


@kernel
def write_hats(values: Floats, knots: Floats, made: Floats) -> None:
    """Write the hat functions between knots; those of NaN are NaN.

    Parameters
    ----------
    values : ndarray, shape (value,)
    knots : ndarray, shape (knot,)
        Two or more, ascending.
    made : ndarray, shape (value, knot)
    """
    last = knots.size - 1
    for i in range(values.size):
        x = values[i]
        if x < knots[0]:
            x = knots[0]
        elif x > knots[last]:
            x = knots[last]
        below, share = hat_at(x, knots)
        for k in range(last + 1):
            made[i, k] = 0.0
        made[i, below] = 1.0 - share
        made[i, below + 1] = share


def hats(values: ArrayLike, knots: Sequence[float]) -> Floats:
    """Return the hat functions between knots, which add up to one.

    Parameters
    ----------
    values : array_like
        Beyond the first and last knot they count as there.
    knots
        Ascending.

    Returns
    -------
    ndarray, shape (..., knot)
    """
    at = np.asarray(knots, dtype=np.float64)
    x = np.asarray(values, dtype=np.float64)
    made = np.empty((x.size, len(at)))
    write_hats(np.ascontiguousarray(x).ravel(), at, made)
    return made.reshape(*x.shape, len(at))


def hats_where(there: NDArray[np.bool_], values: Floats, knots: Sequence[float]) -> Floats:
    """Return hat functions between knots, and zeros for who is not there.

    Parameters
    ----------
    there : ndarray of bool, shape (...)
    values : ndarray, shape (...)
    knots
        As of `hats`.
    """
    return hats(values, knots) * there[..., None]

"""Hat functions: of what weights go by, with a strength for each knot."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from zfcal.arrays import Floats
from zfcal.model.kernels.compiled import kernel


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
    at, x = np.asarray(knots, dtype=np.float64), np.asarray(values, dtype=np.float64)
    made = np.zeros((x.size, len(at)))
    _write(np.ascontiguousarray(x).reshape(-1), at, made)
    return made.reshape(*x.shape, len(at))


@kernel
def _write(values: Floats, knots: Floats, made: Floats) -> None:
    """Write the hat functions of each value, shape (value, knot)."""
    for k in range(values.size):
        x = values[k]
        if x < knots[0]:
            x = knots[0]
        elif x > knots[-1]:
            x = knots[-1]
        below = 0
        while below < knots.size - 2 and not x < knots[below + 1]:
            below += 1
        share = (x - knots[below]) / (knots[below + 1] - knots[below])
        made[k, below], made[k, below + 1] = 1 - share, share


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

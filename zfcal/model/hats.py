"""Hat functions: of what weights go by, with a strength for each knot."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from zfcal.arrays import Floats


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
    x = np.clip(np.asarray(values, dtype=np.float64), at[0], at[-1])
    below = np.clip(np.searchsorted(at, x, side="right") - 1, 0, len(at) - 2)
    share = (x - at[below]) / (at[below + 1] - at[below])
    made = np.zeros((*x.shape, len(at)))
    np.put_along_axis(made, below[..., None], (1 - share)[..., None], -1)
    np.put_along_axis(made, below[..., None] + 1, share[..., None], -1)
    return made


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

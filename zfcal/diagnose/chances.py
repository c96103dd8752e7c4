"""Sums of residuals as standard normal numbers that are large where a model is wrong."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, ndtri

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

LEAST_IN_BIN = 20
_LEAST_TAIL = 1e-290
_MOST_TAIL = 0.999
"""What was fitted leaves nothing over: no smaller z, which would widen the null's spread."""


def normal_of(chi2: float, df: int) -> float:
    """Return a chi-square as a standard normal number of the same tail; NaN without freedom.

    Beyond the range of numbers by the formula of Wilson and Hilferty (1931, Proceedings of
    the National Academy of Sciences 17: 684-688).
    """
    if df < 1:
        return math.nan
    tail = float(chdtrc(df, chi2))
    if tail > _LEAST_TAIL:
        return -float(ndtri(min(tail, _MOST_TAIL)))
    by = 2 / (9 * df)
    return ((chi2 / df) ** (1 / 3) - (1 - by)) / math.sqrt(by)


def normal_of_tail(tail: float) -> float:
    """Return the standard normal number with that much probability above it."""
    return -float(ndtri(min(max(tail, _LEAST_TAIL), _MOST_TAIL)))


def by_context(values: Floats, bins: Ints) -> float:
    """Return how far scores differ from 0 in the bins of a context.

    Parameters
    ----------
    values : ndarray, shape (step, degree)
        Of mean 0 and variance 1; NaN where there is none.
    bins : ndarray of int64, shape (step,)
        -1 for none. A bin with fewer than 20 steps is left out.
    """
    rows = (bins >= 0) & np.isfinite(values[:, 0])
    if not rows.any():
        return math.nan
    count = np.bincount(bins[rows])
    enough = count >= LEAST_IN_BIN
    sums = np.stack([np.bincount(bins[rows], column[rows]) for column in values.T])
    chi2 = (sums[:, enough] ** 2 / count[enough]).sum()
    return normal_of(float(chi2), int(enough.sum()) * values.shape[1])


def rare_by_context(residual: Floats, variance: Floats, bins: Ints, largest: float) -> float:
    r"""Return how far residuals of which few are large differ from 0 in the bins of a context.

    A bin's sum S of residuals with variance V, none above c, counts as
    :math:`S^2 / (V + c \max(S, 0) / 3)`: by Freedman's inequality (1975, Annals of
    Probability 3: 100-118) twice the least that the logarithm of its tail can be, so that a few
    rare values do not decide.

    Parameters
    ----------
    residual, variance : ndarray, shape (step,)
        NaN where there is none.
    bins : ndarray of int64, shape (step,)
        -1 for none. A bin with fewer than 20 steps is left out.
    largest
        The bound c.
    """
    rows = (bins >= 0) & np.isfinite(residual)
    if not rows.any():
        return math.nan
    enough = np.bincount(bins[rows]) >= LEAST_IN_BIN
    sums = np.bincount(bins[rows], residual[rows])[enough]
    whole = np.bincount(bins[rows], variance[rows])[enough] + largest * np.maximum(sums, 0) / 3
    kept = whole > 0
    return normal_of(float((sums[kept] ** 2 / whole[kept]).sum()), int(kept.sum()))

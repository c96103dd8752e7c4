"""Sums of residuals as standard normal numbers that are large where a model is wrong."""

from __future__ import annotations

import math

import numpy as np
from scipy.special import chdtrc, gammaln, ndtri, ndtri_exp

from zfcal.arrays import Floats, Ints
from zfcal.diagnose.kernels import sums_in_bins

LEAST_IN_BIN = 20
_LEAST_TAIL = 1e-290
_MOST_TAIL = 0.999
"""What was fitted leaves nothing over: no smaller z, which would widen the null's spread."""


def normal_of(chi2: float, df: int) -> float:
    r"""Return a chi-square as a standard normal number of the same tail; NaN without freedom.

    Where the tail is beyond the range of numbers its logarithm is taken, to the second term of
    :math:`\Gamma(a, x) \approx x^{a - 1} e^{-x} / (1 - (a - 1) / x)`.
    """
    if df < 1:
        return math.nan
    tail = float(chdtrc(df, chi2))
    if tail > _LEAST_TAIL:
        return normal_of_tail(tail)
    a, x = df / 2, chi2 / 2
    return normal_of_log((a - 1) * math.log(x) - x - float(gammaln(a)) - math.log1p((1 - a) / x))


def normal_of_tail(tail: float) -> float:
    """Return the standard normal number with that much probability above it."""
    return -float(ndtri(min(max(tail, _LEAST_TAIL), _MOST_TAIL)))


def normal_of_log(log_tail: float) -> float:
    """Return the standard normal number with that much probability above it, by its logarithm."""
    return -float(ndtri_exp(min(log_tail, math.log(_MOST_TAIL))))


def least_of(tails: Floats | float, n: int) -> Floats:
    """Return the probabilities that the least of n tails is as small as each of these.

    Of independent ones (Sidak 1967, Journal of the American Statistical Association 62:
    626-633). By n times the tail most of what chance gives would be certain.

    Parameters
    ----------
    tails : float or ndarray, any shape
        Probabilities; what is returned has their shape.
    n
        Of how many each is the least.
    """
    return np.asarray(-np.expm1(n * np.log1p(-np.minimum(tails, 1 - 1e-16))))


def by_context(values: Floats, bins: Ints) -> float:
    """Return how far scores differ from 0 in the bins of a context.

    Parameters
    ----------
    values : ndarray, shape (step, degree)
        Of mean 0 and variance 1; NaN in all of a step's degrees where it has none.
    bins : ndarray of int64, shape (step,)
        -1 for none. A bin with fewer than 20 steps is left out.
    """
    count, sums = _in_bins(values, bins)
    enough = count[0] >= LEAST_IN_BIN
    chi2 = (sums[:, enough] ** 2 / count[:, enough]).sum()
    return normal_of(float(chi2), int(enough.sum()) * len(sums))


def rare_by_context(residual: Floats, variance: Floats, bins: Ints, largest: float) -> list[float]:
    r"""Return how far residuals of which few are large differ from 0 in the bins of a context.

    A bin's sum S of residuals with variance V, none above c, counts as
    :math:`S^2 / (V + c \max(S, 0) / 3)`: by Freedman's inequality (1975, Annals of
    Probability 3: 100-118) twice the least that the logarithm of its tail can be, so that a few
    rare values do not decide.

    Parameters
    ----------
    residual, variance : ndarray, shape (step, column)
        NaN where there is none, in both.
    bins : ndarray of int64, shape (step,)
        -1 for none. A bin with fewer than 20 steps is left out.
    largest
        The bound c.

    Returns
    -------
    list of float
        Of each column; NaN without bins.
    """
    count, sums = _in_bins(residual, bins)
    whole = _in_bins(variance, bins)[1] + largest * np.maximum(sums, 0) / 3
    kept = (count >= LEAST_IN_BIN) & (whole > 0)
    return [
        normal_of(float((own[rows] ** 2 / by[rows]).sum()), int(rows.sum()))
        for own, by, rows in zip(sums, whole, kept, strict=True)
    ]


def _in_bins(values: Floats, bins: Ints) -> tuple[Ints, Floats]:
    """Return how many values there are in each bin, and their sums, shape (column, bin)."""
    shape = (int(bins.max(initial=-1)) + 1, values.shape[1])
    count, sums = np.zeros(shape, dtype=np.int64), np.zeros(shape)
    sums_in_bins(np.ascontiguousarray(values), bins, count, sums)
    return np.ascontiguousarray(count.T), np.ascontiguousarray(sums.T)

"""The difference of two sets of trials, statistic by statistic.

Pure functions on arrays with a value per trial. The unit of observation is the trial: windows
of one trial, and its fish, are alike for reasons of their own, and to count each of them would
be pseudoreplication (Hurlbert 1984, Ecol. Monogr. 54: 187-211).

The interval is Welch's, which needs no equal spread (Welch 1947, Biometrika 34: 28-35). The
effect size is Hedges' g with the interval of the noncentral t distribution (Hedges and Olkin
1985, chapter 5). p is by relabelling whole trials, on Welch's t, which stays right with unequal
spread as trials become many (Janssen 1997, Stat. Probab. Lett. 36: 9-21); over all statistics
together by the largest t of each relabelling (Westfall and Young 1993, chapter 2).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.special import gammaln, nctdtrinc
from scipy.stats import permutation_test, ttest_ind

from zfcal.arrays import Bools, Floats
from zfcal.errors import InputError
from zfcal.report.comparison.power import ALPHA, smallest_p

LEAST_TRIALS = 4
"""Trials on each side below which nothing is tested: with three, no p is below 0.1."""

MOST_RELABELLINGS = 20_000
"""All of them up to here, which is eight trials on each side; otherwise so many by chance."""

_NAN = float("nan")
_ROUNDING = 1e-12
"""Share of a value below which a difference or a spread is rounding."""

_HUGE_T = 1e12
"""t of a difference without any spread; finite, so that it can be compared."""

_BATCH = 1000


@dataclass(frozen=True, slots=True, kw_only=True)
class Side:
    """One statistic of one set of trials.

    Parameters
    ----------
    n
        Trials that have it.
    mean, sd
        Over these trials, the standard deviation with n - 1; NaN for too few.
    """

    n: int
    mean: float
    sd: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Difference:
    """How two sets of trials differ in one statistic; NaN is not known.

    Parameters
    ----------
    a, b
        The two sets.
    difference, low, high
        Mean of A less mean of B with Welch's 95 % interval, in the statistic's unit.
    g, g_low, g_high
        Hedges' g with its 95 % interval, in standard deviations between trials.
    p
        By relabelling trials, of both signs; NaN where nothing was tested.
    p_family
        The same, over all statistics that were tested.
    """

    a: Side
    b: Side
    difference: float
    low: float
    high: float
    g: float
    g_low: float
    g_high: float
    p: float = _NAN
    p_family: float = _NAN

    @property
    def spread_ratio(self) -> float:
        """The larger standard deviation over the smaller one; NaN without both."""
        small, large = sorted((self.a.sd, self.b.sd))
        if math.isnan(small) or math.isnan(large) or large == 0:
            return _NAN
        return large / small if small > 0 else math.inf


@dataclass(frozen=True, slots=True, kw_only=True)
class Relabelling:
    """How trials were relabelled.

    Parameters
    ----------
    n
        How often; 0 where nothing was tested.
    exact
        Whether these were all ways there are.
    smallest_p
        That any of them could give.
    n_tested
        Statistics that were tested together.
    """

    n: int
    exact: bool
    smallest_p: float
    n_tested: int


def compare_sets(
    a: Floats, b: Floats, *, rng: np.random.Generator
) -> tuple[list[Difference], Relabelling]:
    """Return how two sets of trials differ in each of several statistics.

    Parameters
    ----------
    a : ndarray, shape (statistic, trial of A)
        One value per trial; NaN where a trial has none, which leaves it out of that row.
    b : ndarray, shape (statistic, trial of B)
        The same statistics of the other trials.
    rng
        For relabellings by chance, where there are too many to take all.

    Returns
    -------
    list of Difference
        In the order of the rows.
    Relabelling
        How they were tested. Rows with fewer than four trials on a side are not.

    Raises
    ------
    InputError
        The two have different rows, or a value is infinite.
    """
    a, b = _checked(a, "A"), _checked(b, "B")
    if len(a) != len(b):
        raise InputError(f"Both sets need the same statistics, got {len(a)} and {len(b)} rows.")
    rows = [describe(one, other) for one, other in zip(a, b, strict=True)]
    tested = np.array([min(row.a.n, row.b.n) >= LEAST_TRIALS for row in rows], dtype=np.bool_)
    if not tested.any():
        none = Relabelling(n=0, exact=True, smallest_p=_NAN, n_tested=0)
        return rows, none
    p, p_family, how = permute(a[tested], b[tested], rng=rng)
    for at, own, family in zip(np.flatnonzero(tested), p, p_family, strict=True):
        rows[at] = replace(rows[at], p=float(own), p_family=float(family))
    return rows, how


def describe(a: Floats, b: Floats) -> Difference:
    """Return the difference of two sets in one statistic, without a test.

    Parameters
    ----------
    a, b : ndarray, shape (trial,)
        A value per trial; NaN is left out.

    Returns
    -------
    Difference
        Intervals and g are NaN with fewer than two trials on a side, g also where no trial
        differs from the others of its side.
    """
    a, b = a[~np.isnan(a)], b[~np.isnan(b)]
    one, other = _side(a), _side(b)
    difference = one.mean - other.mean
    low = high = g = g_low = g_high = _NAN
    if min(one.n, other.n) >= 2:
        if one.sd or other.sd:
            interval = ttest_ind(a, b, equal_var=False).confidence_interval(1 - ALPHA)
            low, high = float(interval.low), float(interval.high)
            g, g_low, g_high = hedges_g(difference, one, other)
        else:
            low = high = difference
    return Difference(
        a=one, b=other, difference=difference, low=low, high=high, g=g, g_low=g_low, g_high=g_high
    )


def hedges_g(difference: float, a: Side, b: Side) -> tuple[float, float, float]:
    r"""Return Hedges' g with its 95 % interval.

    Parameters
    ----------
    difference
        Of the means.
    a, b
        The two sets, each of at least two trials, not both without spread.

    Returns
    -------
    g, low, high

    Notes
    -----
    :math:`g = J\,(\bar a - \bar b)/s` with the pooled standard deviation s and
    :math:`J = \Gamma(m/2) / (\sqrt{m/2}\,\Gamma((m-1)/2))`, m degrees of freedom, without which
    few trials overstate the effect (Hedges 1981). The interval holds those effects under which
    t as seen lies between the 2.5 and the 97.5 % quantile of the noncentral t distribution.
    """
    df = a.n + b.n - 2
    pooled = math.sqrt(((a.n - 1) * a.sd**2 + (b.n - 1) * b.sd**2) / df)
    scale = small_sample_factor(df) * math.sqrt(1 / a.n + 1 / b.n)
    seen = difference / pooled / math.sqrt(1 / a.n + 1 / b.n)
    low, high = (scale * _shift(seen, df, share) for share in (1 - ALPHA / 2, ALPHA / 2))
    return scale * seen, low, high


def small_sample_factor(df: int) -> float:
    """Return by what g is smaller than the difference in pooled standard deviations.

    Parameters
    ----------
    df
        Degrees of freedom, at least two.
    """
    return math.exp(gammaln(df / 2) - gammaln((df - 1) / 2)) / math.sqrt(df / 2)


def permute(
    a: Floats, b: Floats, *, rng: np.random.Generator
) -> tuple[Floats, Floats, Relabelling]:
    """Return p of each statistic, and over all of them, by relabelling whole trials.

    All statistics of a trial keep together, so what they have in common is kept as well.

    Parameters
    ----------
    a : ndarray, shape (statistic, trial of A)
        NaN where a trial has no value: it is relabelled with the others and counts nowhere.
    b : ndarray, shape (statistic, trial of B)
        The other set.
    rng
        For relabellings by chance.

    Returns
    -------
    p, p_family : ndarray, shape (statistic,)
        Share of the relabellings with an absolute t as large as the one that was seen; and
        with the largest absolute t of all statistics as large.
    Relabelling

    Raises
    ------
    InputError
        A set has fewer trials than can be tested.
    """
    if not min(a.shape[1], b.shape[1]) >= LEAST_TRIALS:
        raise InputError(
            f"A test needs {LEAST_TRIALS} trials on each side, got {a.shape[1]} and {b.shape[1]}."
        )
    a, b = _standardised(a, b)
    exact = math.comb(a.shape[1] + b.shape[1], a.shape[1]) <= MOST_RELABELLINGS
    result: Any = permutation_test(
        (a, b),
        absolute_t,
        permutation_type="independent",
        vectorized=True,
        n_resamples=MOST_RELABELLINGS,
        batch=_BATCH,
        alternative="greater",
        axis=-1,
        random_state=rng,
    )
    seen = np.atleast_1d(result.statistic)
    null = np.asarray(result.null_distribution).reshape(-1, len(seen))
    # As scipy compares each statistic: rounding must not make two equal ones differ.
    largest = null.max(axis=1)[:, None] >= seen * (1 - 100 * np.finfo(np.float64).eps)
    extra = 0 if exact else 1
    p_family = (largest.sum(axis=0) + extra) / (len(null) + extra)
    least = smallest_p(a.shape[1], b.shape[1])
    how = Relabelling(
        n=len(null),
        exact=exact,
        smallest_p=least if exact else max(least, 1 / (len(null) + 1)),
        n_tested=len(seen),
    )
    return np.atleast_1d(result.pvalue), p_family, how


def absolute_t(a: Floats, b: Floats, axis: int = -1) -> Floats:
    """Return the size of Welch's t of many pairs of sets.

    Parameters
    ----------
    a, b : ndarray, shape (..., trial)
        About zero and of size one; NaN is left out.
    axis
        The trials' axis.

    Returns
    -------
    ndarray, shape (...)
        0 where a side has fewer than two values.
    """
    (n_a, mean_a, var_a), (n_b, mean_b, var_b) = _moments(a, axis), _moments(b, axis)
    with np.errstate(divide="ignore", invalid="ignore"):
        apart = np.abs(mean_a - mean_b)
        error = np.sqrt(var_a / n_a + var_b / n_b)
        found = np.where(error > _ROUNDING, np.minimum(apart / error, _HUGE_T), _HUGE_T)
    known = (np.minimum(n_a, n_b) >= 2) & (apart > _ROUNDING)
    return np.where(known, found, 0.0)


def _moments(values: Floats, axis: int) -> tuple[Floats, Floats, Floats]:
    """Return number, mean and variance of what is known, along an axis."""
    known = ~np.isnan(values)
    n = known.sum(axis=axis).astype(np.float64)
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = np.where(known, values, 0.0).sum(axis=axis) / n
        off = np.where(known, values - np.expand_dims(mean, axis), 0.0)
        return n, mean, (off**2).sum(axis=axis) / (n - 1)


def _standardised(a: Floats, b: Floats) -> tuple[Floats, Floats]:
    """Return each statistic about zero and of size one, which no t notices but by its rounding."""
    both = np.concatenate([a, b], axis=1)
    mean, sd = np.nanmean(both, axis=1, keepdims=True), np.nanstd(both, axis=1, keepdims=True)
    differs = sd > _ROUNDING * np.abs(mean)
    scaled = (both - mean) / np.where(differs, sd, 1.0)
    scaled = np.where(differs | np.isnan(both), scaled, 0.0)
    return scaled[:, : a.shape[1]], scaled[:, a.shape[1] :]


def _shift(seen: float, df: int, share: float) -> float:
    """Return the noncentrality under which t lies below what was seen with some probability."""
    # The inverse is more exact for positive t; the distribution of -t is the mirror image.
    if seen < 0:
        return -float(nctdtrinc(df, 1 - share, -seen))
    return float(nctdtrinc(df, share, seen))


def _side(values: Floats) -> Side:
    n = len(values)
    mean = float(values.mean()) if n else _NAN
    sd = float(values.std(ddof=1)) if n > 1 else _NAN
    return Side(n=n, mean=mean, sd=0.0 if sd <= _ROUNDING * abs(mean) else sd)


def _checked(values: Floats, name: str) -> Floats:
    table = np.asarray(values, dtype=np.float64)
    if table.ndim != 2:
        raise InputError(f"Set {name} needs a row per statistic, got the shape {table.shape}.")
    infinite: Bools = np.isinf(table)
    if infinite.any():
        raise InputError(
            f"Set {name} has an infinite value in row {int(infinite.nonzero()[0][0])}."
        )
    return table

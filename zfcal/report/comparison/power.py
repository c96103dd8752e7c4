"""What so many trials can show: the smallest p there is, and the smallest effect that is found.

Effects are in standard deviations between trials. Trials are taken as normal with one spread
on both sides, for which the power of a t test is that of the noncentral t distribution
(Cohen 1988, Statistical Power Analysis, chapter 2). A test by relabelling finds about what a
t test at its attainable level finds; with four trials on each side somewhat less
(docs/compare.md has what was measured).
"""

from __future__ import annotations

import math

from scipy.special import nctdtrinc
from scipy.stats import t

from zfcal.errors import InputError

ALPHA = 0.05
"""Level of a test, and one minus the level of an interval."""

POWER = 0.8
"""How often an effect is to be found that is there."""


def smallest_p(n_a: int, n_b: int) -> float:
    """Return the smallest p that relabelling so many trials can give, of both signs.

    Parameters
    ----------
    n_a, n_b
        Trials on each side, at least one.

    Returns
    -------
    float
        One in all ways to choose A's trials; of as many trials on both sides two, since the
        two sides exchanged differ by as much.

    Raises
    ------
    InputError
        A side has no trial.
    """
    if not (n_a >= 1 and n_b >= 1):
        raise InputError(f"Relabelling needs a trial on each side, got {n_a} and {n_b}.")
    return (2 if n_a == n_b else 1) / math.comb(n_a + n_b, n_a)


def attainable_level(n_a: int, n_b: int, *, alpha: float = ALPHA) -> float:
    """Return the level at which relabelling tests, since its p comes in steps.

    Parameters
    ----------
    n_a, n_b
        Trials on each side, at least one.
    alpha
        Level that is asked for.

    Returns
    -------
    float
        The largest p up to ``alpha`` that there is; 0 where none is so small.
    """
    step = smallest_p(n_a, n_b)
    return math.floor(alpha / step + 1e-9) * step


def detectable_effect(n_a: int, n_b: int, *, alpha: float = ALPHA, power: float = POWER) -> float:
    """Return the smallest effect that a t test of both signs finds with some power.

    Parameters
    ----------
    n_a, n_b
        Trials on each side, at least two.
    alpha
        Level of the test.
    power
        How often it is to be found, from one half to one.

    Returns
    -------
    float
        In standard deviations between trials.

    Raises
    ------
    InputError
        A side has fewer than two trials, or the power is no such number.
    """
    if not (n_a >= 2 and n_b >= 2):
        raise InputError(f"An effect needs two trials on each side, got {n_a} and {n_b}.")
    if not 0 < alpha < 0.5 <= power < 1:
        raise InputError(
            f"Power must lie in [0.5, 1) and alpha in (0, 0.5), got {power!r} and {alpha!r}."
        )

    shift = detectable_shift(n_a + n_b - 2, alpha=alpha, power=power)
    return shift / math.sqrt(n_a * n_b / (n_a + n_b))


def detectable_shift(df: float, *, alpha: float = ALPHA, power: float = POWER) -> float:
    """Return the smallest true difference that a t test of both signs finds with some power.

    Parameters
    ----------
    df
        Degrees of freedom.
    alpha
        Level of the test.
    power
        How often it is to be found, from one half to one.

    Returns
    -------
    float
        In standard errors of the difference.
    """
    # Of the effects that are looked for, none has a chance worth naming beyond the other end.
    return float(nctdtrinc(df, 1 - power, float(t.isf(alpha / 2, df))))

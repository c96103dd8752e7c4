"""Do our scores agree with published ones? Statistics over trials, on numbers alone.

A contrast is one number of a trial, so that trials are what is counted, never windows. Two
questions are asked of each: is the mean difference from the published mean more than chance
(Student's t, two-sided, the level shared out among the contrasts after Bonferroni)? And is it
within the margin (two one-sided t-tests; Schuirmann 1987, J Pharmacokinet Biopharm 15)? All
contrasts have to be within it, which keeps the level without sharing it out (Berger 1982,
Technometrics 24).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy import stats

from zfcal.report.comparison.power import ALPHA, detectable_shift
from zfcal.report.numbers import mean_and_sd
from zfcal.reproduction.reference import Contrast, Reference

Verdict = Literal["agrees", "disagrees", "undecided"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Compared:
    """One contrast of our trials beside the published one; NaN where it is not known.

    Parameters
    ----------
    contrast
        What is compared.
    n
        Trials that have a value.
    mean, sd
        Of our trials.
    difference, standard_error
        Ours less the published one.
    low, high
        95 % interval of the difference.
    p
        That a difference this large is chance, two-sided, times the number of contrasts.
    p_beyond_margin
        The larger p of the two one-sided tests: small where the difference lies within the margin.
    smallest_shown
        The smallest true difference that these trials would show with a probability of 0.8.
    power
        Probability that a true difference as large as the margin would show.
    """

    contrast: Contrast
    n: int
    mean: float
    sd: float
    difference: float
    standard_error: float
    low: float
    high: float
    p: float
    p_beyond_margin: float
    smallest_shown: float
    power: float

    @property
    def is_within(self) -> bool:
        """Whether the difference is known to lie within the margin."""
        return self.p_beyond_margin < ALPHA

    @property
    def is_apart(self) -> bool:
        """Whether it is more than chance."""
        return self.p < ALPHA


def compare_contrast(
    contrast: Contrast, values: Sequence[float], reference: Reference, *, n_contrasts: int
) -> Compared:
    """Hold one contrast of our trials against the published one.

    Parameters
    ----------
    contrast
        One of the reference's.
    values
        Its value in each of our trials; NaN where a trial has none.
    reference
        Says how many trials the published mean is of. Where no standard deviation was published,
        it is taken to be ours.
    n_contrasts
        Among how many the level is shared out.

    Returns
    -------
    Compared
        NaN throughout but for mean and difference with less than two trials.
    """
    n, (mean, sd) = sum(not math.isnan(value) for value in values), mean_and_sd(values)
    difference = mean - contrast.value
    error, freedom = error_of(sd, n, contrast.sd, reference.n_trials)
    if not error > 0:
        nothing = dict.fromkeys(_TESTED, math.nan)
        return Compared(contrast=contrast, n=n, mean=mean, sd=sd, difference=difference, **nothing)
    half = float(stats.t.ppf(0.975, freedom)) * error
    each = ALPHA / n_contrasts
    beyond = max(
        float(stats.t.sf((difference + reference.margin) / error, freedom)),
        float(stats.t.cdf((difference - reference.margin) / error, freedom)),
    )
    return Compared(
        contrast=contrast,
        n=n,
        mean=mean,
        sd=sd,
        difference=difference,
        standard_error=error,
        low=difference - half,
        high=difference + half,
        p=min(1.0, n_contrasts * 2.0 * float(stats.t.sf(abs(difference) / error, freedom))),
        p_beyond_margin=beyond,
        smallest_shown=error * detectable_shift(freedom, alpha=each),
        power=power_of(reference.margin, error, freedom, level=each),
    )


_TESTED = (
    "standard_error",
    "low",
    "high",
    "p",
    "p_beyond_margin",
    "smallest_shown",
    "power",
)


def error_of(sd: float, n: int, published_sd: float, n_published: int) -> tuple[float, float]:
    """Return the standard error of a difference of means, and its degrees of freedom (Welch 1947).

    Parameters
    ----------
    sd, n
        Of our trials.
    published_sd, n_published
        Of the published ones; a NaN is taken to be ours.

    Returns
    -------
    error, freedom : float
        NaN with fewer than two trials.
    """
    if n < 2:
        return math.nan, math.nan
    own = sd**2 / n
    if math.isnan(published_sd):
        return math.sqrt(own + sd**2 / n_published), float(n - 1)
    other = published_sd**2 / n_published
    if n_published < 2 or own + other == 0:
        return math.sqrt(own + other), float(n - 1)
    freedom = (own + other) ** 2 / (own**2 / (n - 1) + other**2 / (n_published - 1))
    return math.sqrt(own + other), freedom


def power_of(difference: float, error: float, freedom: float, *, level: float) -> float:
    """Return the probability that a true difference shows in a two-sided t-test.

    The square of the statistic is non-central F (Johnson, Kotz and Balakrishnan 1995, chapter 30).

    Parameters
    ----------
    difference, error
        The true difference, and the standard error of its estimate.
    freedom
        Degrees of freedom.
    level
        Of the test.
    """
    limit = float(stats.t.ppf(1.0 - level / 2.0, freedom))
    return float(stats.ncf.sf(limit**2, 1, freedom, (difference / error) ** 2))


def judge(compared: Sequence[Compared]) -> Verdict:
    """Return the one verdict over all contrasts.

    Parameters
    ----------
    compared
        All contrasts that were fixed beforehand.

    Returns
    -------
    str
        ``agrees`` if each difference is known to lie within the margin; else ``disagrees`` if one
        is more than chance; else ``undecided``.
    """
    if compared and all(each.is_within for each in compared):
        return "agrees"
    return "disagrees" if any(each.is_apart for each in compared) else "undecided"


def compare_all(
    reference: Reference, courses: Mapping[str, Mapping[tuple[str, int], float]]
) -> list[Compared]:
    """Hold all contrasts of our trials against the published ones.

    Parameters
    ----------
    reference
        What was published, and the contrasts.
    courses
        Of each trial, its score by feature and by the second at which the window ends.
    """
    return [
        compare_contrast(
            contrast,
            [trial_value(contrast, course) for course in courses.values()],
            reference,
            n_contrasts=len(reference.contrasts),
        )
        for contrast in reference.contrasts
    ]


def trial_value(contrast: Contrast, course: Mapping[tuple[str, int], float]) -> float:
    """Return the mean over a trial's windows that a contrast asks for; NaN where it has none."""
    values = [
        value
        for (feature, end_s), value in course.items()
        if feature == contrast.feature
        and contrast.from_s <= end_s <= contrast.to_s
        and math.isfinite(value)
    ]
    return float(np.mean(values)) if values else math.nan

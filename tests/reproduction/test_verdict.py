"""Contrasts, their tests, and the one verdict."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from zfcal.report.comparison.power import detectable_shift
from zfcal.reproduction.reference import Contrast, Reference
from zfcal.reproduction.verdict import (
    compare_all,
    compare_contrast,
    judge,
    power_of,
    trial_value,
)

AT_180 = Contrast(name="180 s", feature="S", from_s=180, to_s=180, value=0.6)
LATE = Contrast(name="late", feature="S", from_s=300, value=0.8)


def reference(*contrasts, n_trials=10, margin=0.05):
    """Return a reference of these contrasts."""
    return Reference(source="a test", n_trials=n_trials, margin=margin, contrasts=contrasts)


def test_a_contrast_by_hand():
    """0.7 and 0.8 and 0.9 against 0.6 of ten trials: 0.2 over 0.1 sqrt(1/3 + 1/10), 2 degrees."""
    found = compare_contrast(AT_180, [0.7, 0.8, 0.9], reference(AT_180), n_contrasts=1)
    error = 0.1 * math.sqrt(1 / 3 + 1 / 10)
    assert found.n == 3
    assert found.mean == pytest.approx(0.8)
    assert found.difference == pytest.approx(0.2)
    assert found.standard_error == pytest.approx(error)
    assert found.p == pytest.approx(2 * stats.t.sf(0.2 / error, 2))
    assert found.high - found.difference == pytest.approx(stats.t.ppf(0.975, 2) * error)


def test_a_published_standard_deviation_gives_welchs_test():
    """The same as scipy's, from the statistics of both sides."""
    values = np.array([0.62, 0.66, 0.71, 0.58, 0.69])
    contrast = replace(AT_180, sd=0.08)
    found = compare_contrast(contrast, values, reference(contrast), n_contrasts=1)
    theirs = stats.ttest_ind_from_stats(
        values.mean(), values.std(ddof=1), 5, 0.6, 0.08, 10, equal_var=False
    )
    assert found.p == pytest.approx(theirs.pvalue)


def test_the_level_is_shared_out_among_the_contrasts():
    """Three times the p of one, at most 1."""
    values = [0.61, 0.66, 0.7, 0.58]
    one, three = (
        compare_contrast(AT_180, values, reference(AT_180), n_contrasts=n) for n in (1, 3)
    )
    assert three.p == pytest.approx(min(1.0, 3 * one.p))
    assert three.smallest_shown > one.smallest_shown
    assert three.power < one.power


@pytest.mark.parametrize("values", [[], [0.7], [math.nan, 0.7]])
def test_one_trial_decides_nothing(values):
    """There is no standard error: undecided."""
    found = compare_contrast(AT_180, values, reference(AT_180), n_contrasts=1)
    assert math.isnan(found.standard_error)
    assert judge([found]) == "undecided"


def normal_trials(mean, sd, n, seed=1):
    """Return n values with exactly this mean and standard deviation."""
    values = np.random.default_rng(seed).normal(size=n)
    return mean + sd * (values - values.mean()) / values.std(ddof=1)


@pytest.mark.parametrize(("mean", "sd", "verdict"), [
    (0.61, 0.02, "agrees"),
    (0.80, 0.02, "disagrees"),
    (0.63, 0.10, "undecided"),
    (0.62, 0.01, "agrees"),
])  # fmt: skip
def test_the_three_verdicts(mean, sd, verdict):
    """The last one is more than chance, and within the margin all the same."""
    values = normal_trials(mean, sd, 10)
    found = compare_contrast(AT_180, values, reference(AT_180), n_contrasts=1)
    assert judge([found]) == verdict
    if mean == 0.62:
        assert found.is_apart


def test_all_contrasts_have_to_be_within_the_margin():
    """One that is apart makes the whole disagree; one that is open leaves it undecided."""
    near, far, wide = (
        compare_contrast(AT_180, normal_trials(m, sd, 10), reference(AT_180), n_contrasts=2)
        for m, sd in ((0.6, 0.02), (0.9, 0.02), (0.6, 0.2))
    )
    assert judge([near, near]) == "agrees"
    assert judge([near, far]) == "disagrees"
    assert judge([near, wide]) == "undecided"
    assert judge([]) == "undecided"


@pytest.mark.slow
def test_the_family_keeps_its_level():
    """Of 2,000 sets of three true contrasts 5 % disagree, within three standard errors."""
    rng = np.random.default_rng(3)
    contrasts = [replace(AT_180, name=str(k)) for k in range(3)]
    said = reference(*contrasts, margin=0.001)
    wrong = 0
    for _ in range(2000):
        theirs = rng.normal(0.6, 0.05, (3, 10)).mean(axis=1)
        drawn = [replace(c, value=float(v)) for c, v in zip(contrasts, theirs, strict=True)]
        found = [compare_contrast(c, rng.normal(0.6, 0.05, 10), said, n_contrasts=3) for c in drawn]
        wrong += judge(found) == "disagrees"
    assert wrong / 2000 < 0.05 + 3 * math.sqrt(0.05 * 0.95 / 2000)


@pytest.mark.slow
def test_agreement_is_rarely_said_of_what_lies_beyond_the_margin():
    """Of 2,000 sets whose true difference is the margin, 5 % agree at most."""
    rng = np.random.default_rng(4)
    agree = 0
    for _ in range(2000):
        theirs = float(rng.normal(0.6, 0.03, 10).mean())
        contrast = replace(AT_180, value=theirs)
        found = compare_contrast(
            contrast, rng.normal(0.65, 0.03, 10), reference(contrast), n_contrasts=1
        )
        agree += judge([found]) == "agrees"
    assert agree / 2000 < 0.05 + 3 * math.sqrt(0.05 * 0.95 / 2000)


def test_power_is_what_simulated_trials_show():
    """A difference of one standard deviation with ten trials a side, 0.56 by simulation too."""
    rng = np.random.default_rng(5)
    error, freedom = math.sqrt(2 / 10), 18.0
    a, b = rng.normal(1, 1, (20_000, 10)), rng.normal(0, 1, (20_000, 10))
    shown = (stats.ttest_ind(a, b, axis=1).pvalue < 0.05).mean()
    assert power_of(1.0, error, freedom, level=0.05) == pytest.approx(shown, abs=0.012)


def test_the_smallest_difference_has_the_power_that_is_said():
    """By definition, at the level that is shared out; a stricter level needs a larger one."""
    found = 0.02 * detectable_shift(9.0, alpha=0.05 / 3)
    assert power_of(found, 0.02, 9.0, level=0.05 / 3) == pytest.approx(0.8)
    assert detectable_shift(9.0, alpha=0.05) < detectable_shift(9.0, alpha=0.05 / 3)


def test_a_trials_value_is_the_mean_over_its_windows():
    """From 300 s on: 0.8, 0.9 and nothing; D and what is null do not count."""
    course = {
        ("S", 240): 0.1, ("S", 300): 0.8, ("S", 360): 0.9, ("S", 420): math.nan, ("D", 300): 0.2,
    }  # fmt: skip
    assert trial_value(LATE, course) == pytest.approx(0.85)
    assert math.isnan(trial_value(AT_180, course))


def test_trials_are_what_is_counted():
    """Two trials of a hundred windows are two."""
    courses = {
        name: {("S", 300 + 60 * k): value for k in range(100)}
        for name, value in (("a", 0.8), ("b", 0.82))
    }
    (found,) = compare_all(reference(LATE), courses)
    assert found.n == 2

"""Two sets of trials: Welch's interval, Hedges' g and p by relabelling."""

import itertools

import numpy as np
import pytest
from scipy.stats import nct, ttest_ind

from zfcal.errors import InputError
from zfcal.report.comparison.differences import (
    absolute_t,
    compare_sets,
    describe,
    permute,
    small_sample_factor,
)
from zfcal.report.comparison.power import attainable_level, detectable_effect

NAN = np.nan


@pytest.fixture
def rng():
    """Random numbers of one seed."""
    return np.random.default_rng(7)


def one_row(a, b, rng):
    """Return the only difference of two sets of one statistic."""
    (row,), how = compare_sets(np.array([a], dtype=float), np.array([b], dtype=float), rng=rng)
    return row, how


def test_welch_is_what_a_pencil_gives():
    """Variances 5/3 and 20/3: t is minus the root of three with 1875 / 425 degrees of freedom."""
    row = describe(np.array([1.0, 2, 3, 4]), np.array([2.0, 4, 6, 8]))

    assert row.difference == -2.5
    # The 97.5 % quantile of t is 2.776 with 4 degrees of freedom and 2.571 with 5; here 2.678.
    assert row.high - row.difference == pytest.approx(2.678 * np.sqrt(25 / 12), rel=1e-3)
    assert row.low + row.high == pytest.approx(2 * row.difference)
    assert (row.a.n, row.a.mean, row.a.sd) == (4, 2.5, pytest.approx(np.sqrt(5 / 3)))


def test_g_is_what_a_pencil_gives():
    """The pooled variance is 25/6, and six degrees of freedom take 13 % off."""
    row = describe(np.array([1.0, 2, 3, 4]), np.array([2.0, 4, 6, 8]))

    # Gamma(3) = 2 and Gamma(2.5) = 1.32934.
    assert small_sample_factor(6) == pytest.approx(2 / (np.sqrt(3) * 1.32934), rel=1e-5)
    assert row.g == pytest.approx(-2.5 / np.sqrt(25 / 6) * 0.868627, rel=1e-5)


@pytest.mark.parametrize("shift", [-9.0, -1.0, 0.0, 0.4, 25.0])
def test_the_ends_of_g_are_effects_that_leave_two_and_a_half_percent(shift):
    """Under each end t as seen is a quantile of the noncentral t distribution."""
    a, b = np.array([0.0, 1, 3]) + shift, np.array([1.0, 1, 2, 4, 7])
    row = describe(a, b)
    t = ttest_ind(a, b).statistic
    scale = small_sample_factor(6) * np.sqrt(1 / 3 + 1 / 5)

    for end, share in ((row.g_low, 0.975), (row.g_high, 0.025)):
        assert nct.cdf(t, 6, end / scale) == pytest.approx(share, abs=1e-4)
    assert row.g_low < row.g < row.g_high


def test_exchanged_sets_differ_by_as_much_the_other_way(rng):
    """And p is the same."""
    a, b = rng.normal(size=(3, 5)), rng.normal(size=(3, 6))
    forth, back = (compare_sets(x, y, rng=rng)[0] for x, y in ((a, b), (b, a)))

    for one, other in zip(forth, back, strict=True):
        assert one.difference == pytest.approx(-other.difference)
        assert (one.low, one.high) == (pytest.approx(-other.high), pytest.approx(-other.low))
        assert one.g == pytest.approx(-other.g)
        assert (one.p, one.p_family) == (other.p, other.p_family)


def test_another_unit_changes_neither_g_nor_p(rng):
    """Millimetres less a hundred in the place of metres."""
    a, b = rng.normal(0.3, 0.01, size=(2, 4)), rng.normal(0.31, 0.01, size=(2, 5))
    metres = compare_sets(a, b, rng=rng)[0]
    others = compare_sets(1000 * a - 100, 1000 * b - 100, rng=rng)[0]

    for one, other in zip(metres, others, strict=True):
        assert other.g == pytest.approx(one.g)
        assert (other.p, other.p_family) == (one.p, one.p_family)
        assert other.low == pytest.approx(1000 * one.low)


def test_four_below_four_is_two_ways_of_seventy(rng):
    """The labels as they are, and exchanged: no other split is as far apart."""
    row, how = one_row([1, 2, 3, 4], [5, 6, 7, 8], rng)

    assert row.p == pytest.approx(2 / 70)
    assert (how.n, how.exact, how.n_tested) == (70, True, 1)
    assert how.smallest_p == pytest.approx(2 / 70)


def test_one_step_less_apart_is_four_ways_of_seventy(rng):
    """1, 2, 3, 5 have the sum 11; of the other splits only 1, 2, 3, 4 is farther apart."""
    row, _ = one_row([1, 2, 3, 5], [4, 6, 7, 8], rng)

    assert row.p == pytest.approx(4 / 70)


def test_relabelling_is_what_a_slow_loop_finds(rng):
    """Every split by itself, with scipy's t of two sets; over all by the largest."""
    a, b = rng.normal(size=(3, 4)), rng.normal(size=(3, 5)) + 1
    both = np.concatenate([a, b], axis=1)
    everyone = range(9)
    null = np.array(
        [
            np.abs(
                ttest_ind(
                    both[:, chosen],
                    both[:, [i for i in everyone if i not in chosen]],
                    axis=1,
                    equal_var=False,
                ).statistic
            )
            for chosen in map(list, itertools.combinations(everyone, 4))
        ]
    )
    seen = np.abs(ttest_ind(a, b, axis=1, equal_var=False).statistic) - 1e-9
    p, p_family, how = permute(a, b, rng=rng)

    assert how.n == len(null) == 126
    np.testing.assert_allclose(p, (null >= seen).mean(axis=0))
    np.testing.assert_allclose(p_family, (null.max(axis=1)[:, None] >= seen).mean(axis=0))


def test_p_over_all_is_never_below_p_of_one(rng):
    """The largest t is at least each t; a statistic that stands there twice costs nothing."""
    a, b = rng.normal(size=(6, 4)), rng.normal(size=(6, 4))
    p, p_family, _ = permute(a, b, rng=rng)
    again = permute(np.repeat(a, 2, axis=0), np.repeat(b, 2, axis=0), rng=rng)[1]

    assert (p_family >= p).all()
    np.testing.assert_array_equal(again[::2], p_family)


def test_a_statistic_without_any_difference_has_p_one(rng):
    """All trials alike, and values whose spread is rounding: nothing is divided by nothing."""
    for value in (0.0, 0.1 + 0.2):
        row, _ = one_row([value] * 4, [value] * 4, rng)
        assert (row.p, row.difference, row.low, row.high) == (1, 0, 0, 0)
        assert np.isnan(row.g)


def test_sets_without_spread_that_differ_are_as_far_apart_as_can_be(rng):
    """No g, since there is no spread to count in; p is the smallest there is."""
    row, _ = one_row([1] * 4, [2] * 4, rng)

    assert row.p == pytest.approx(2 / 70)
    assert np.isnan(row.g)


def test_a_trial_without_a_value_is_left_out_of_that_row_alone(rng):
    """The other row has all trials; the first is described by those that are there."""
    a = np.array([[1.0, 2, 3, 4, NAN], [1, 2, 3, 4, 5]])
    b = np.array([[5.0, 6, 7, 8, NAN], [6, 7, 8, 9, 10]])
    (one, other), how = compare_sets(a, b, rng=rng)

    assert (one.a.n, one.b.n, other.a.n) == (4, 4, 5)
    assert one.difference == -4
    assert how.n == 252
    assert one.p < 0.05


def test_fewer_than_four_on_a_side_are_described_and_not_tested(rng):
    """A row of three known trials has no p, while the others keep theirs."""
    a, b = rng.normal(size=(2, 4)), rng.normal(size=(2, 4))
    a[0, 1] = NAN
    (three, four), how = compare_sets(a, b, rng=rng)
    (row,), none = compare_sets(a[1:, :3], b[1:, :3], rng=rng)

    assert np.isnan(three.p)
    assert np.isfinite([three.low, three.g_high, four.p]).all()
    assert how.n_tested == 1
    assert np.isnan(row.p)
    assert none.n == none.n_tested == 0
    with pytest.raises(InputError, match="4 trials on each side, got 3 and 3"):
        permute(a[1:, :3], b[1:, :3], rng=rng)


def test_a_single_trial_has_a_mean_and_no_interval(rng):
    """There is no spread to judge by."""
    row, _ = one_row([1], [2, 3], rng)

    assert row.difference == -1.5
    assert np.isnan([row.a.sd, row.low, row.g, row.spread_ratio]).all()


def test_many_trials_are_relabelled_by_chance_and_by_the_seed():
    """Nine and nine have 48,620 ways; the same seed has the same p, which is never zero."""
    draw = np.random.default_rng(3)
    a, b = draw.normal(size=(2, 9)), draw.normal(size=(2, 9))
    a[0] += 9
    one, other = (permute(a, b, rng=np.random.default_rng(0)) for _ in range(2))

    assert (one[2].n, one[2].exact) == (20_000, False)
    np.testing.assert_array_equal(one[0], other[0])
    assert 1 / 20_001 <= one[0][0] <= one[1][0] < 5 / 20_001


@pytest.mark.parametrize(
    ("a", "b", "says"),
    [
        (np.zeros((2, 4)), np.zeros((3, 4)), "got 2 and 3 rows"),
        (np.full((1, 4), np.inf), np.zeros((1, 4)), "infinite value in row 0"),
        (np.zeros(4), np.zeros((1, 4)), r"got the shape \(4,\)"),
    ],
)
def test_tables_that_do_not_fit_are_refused(rng, a, b, says):
    """Other rows on each side, what is no number, a row alone."""
    with pytest.raises(InputError, match=says):
        compare_sets(a, b, rng=rng)


def test_t_of_sides_that_are_too_small_is_nothing():
    """A relabelling that leaves a side with one value counts as no difference."""
    a, b = np.array([[1.0, NAN], [1.0, 2.0]]), np.array([[0.0, 1.0], [NAN, NAN]])

    np.testing.assert_array_equal(absolute_t(a, b), [0, 0])


@pytest.mark.slow
@pytest.mark.parametrize("draw", ["normal", "exponential"])
def test_sets_of_one_law_are_told_apart_at_most_seven_times_of_a_hundred(rng, draw):
    """Over 500 pairs of sets, five trials each, ten statistics that have much in common."""
    sample = getattr(rng, draw)
    n_found = 0
    for _ in range(500):
        table = sample(size=(10, 10)) + sample(size=(1, 10))
        n_found += permute(table[:, :5], table[:, 5:], rng=rng)[1].min() <= 0.05

    assert n_found / 500 <= 0.07


def test_a_single_statistic_of_one_law_is_found_at_the_level_there_is(rng):
    """Of 2000 pairs of five and five about 12 of 252 ways, 4.8 %."""
    p, _, _ = permute(rng.normal(size=(2000, 5)), rng.normal(size=(2000, 5)), rng=rng)

    assert (p <= 0.05).mean() == pytest.approx(12 / 252, abs=0.015)


@pytest.mark.parametrize(("n", "power"), [(4, 0.74), (5, 0.79), (6, 0.80)])
def test_the_effect_that_is_said_to_be_found_is_found(rng, n, power):
    """In four of five experiments; with four trials on each side in three of four."""
    effect = detectable_effect(n, n, alpha=attainable_level(n, n))
    p, _, _ = permute(rng.normal(size=(1500, n)) + effect, rng.normal(size=(1500, n)), rng=rng)

    assert (p <= 0.05).mean() == pytest.approx(power, abs=0.04)


def test_few_trials_of_unequal_spread_are_told_apart_too_often(rng):
    """What the warning is about: four trials ten times as far apart as eight others."""
    p, _, _ = permute(10 * rng.normal(size=(2000, 4)), rng.normal(size=(2000, 8)), rng=rng)

    assert (p <= 0.05).mean() > 0.1

"""What noise of positions makes features gain, and how rare a gain is by it."""

import numpy as np
import pytest
from scipy.stats import chi2, ncx2

from zfcal.diagnose.features.false_gains import NO_NOISE, ByNoise, by_noise


@pytest.mark.parametrize(("nats", "n"), [(0.0, 1), (3.0, 1), (8.0, 5)])
def test_exact_positions_leave_it_to_chance(nats, n):
    """Wilks' theorem: twice the gain is a chi-square of as many degrees as strengths."""
    assert NO_NOISE.chance(nats, n) == pytest.approx(chi2.sf(2 * nats, n))
    assert NO_NOISE.more(n) == 0.0


def test_what_noise_makes_is_expected():
    """Of 20 nats in the mean, by one strength: 30 are no news, 60 are."""
    own = ByNoise(mean_nats=20.0)
    assert own.more(1) == pytest.approx(19.5)
    assert own.chance(30.0, 1) == pytest.approx(ncx2.sf(60, 1, 39))
    assert own.chance(30.0, 1) > 0.05
    assert own.chance(60.0, 1) < 1e-5
    assert own.chance(-1.0, 1) == pytest.approx(1.0)
    wide = ByNoise(mean_nats=20.0, stretch=2.0)
    assert wide.chance(30.0, 1) > own.chance(30.0, 1)
    assert wide.chance(20.0, 1) == pytest.approx(own.chance(20.0, 1))


@pytest.mark.parametrize("own", [NO_NOISE, ByNoise(mean_nats=7.0, stretch=1.3)])
def test_so_many_nats_have_that_chance(own):
    """The one is the other's inverse."""
    assert own.chance(own.most(3, 1e-4), 3) == pytest.approx(1e-4, rel=1e-3)


@pytest.mark.parametrize("apart", [0.0, 10.0, 80.0])
@pytest.mark.parametrize("n", [1, 5])
def test_noise_seldom_gains_more_than_its_chance_says(apart, n):
    """Of three features of which six replicates are known one is rarer in 2 % of cases."""
    rng = np.random.default_rng(5)
    gains = rng.noncentral_chisquare(n, apart + 1e-9, (2000, 7, 3)) / 2
    rare = 0
    for case in gains:
        own = by_noise(case[:6], [n] * 3)
        rare += any(
            each.chance(nats, n) < 0.02 / 3 for each, nats in zip(own, case[6], strict=True)
        )
    assert 0.002 < rare / len(gains) < 0.03


def test_replicates_that_spread_by_more_say_so():
    """Of normal laws with three times the spread: many show it, and six half of it."""
    rng = np.random.default_rng(6)
    wide = 3 * np.sqrt(2 * (1 + 2 * 79)) / 2
    (own,) = by_noise(rng.normal(40.0, wide, (400, 1)), [1])
    assert own.stretch == pytest.approx(3.0, rel=0.1)
    few = [by_noise(rng.normal(40.0, wide, (6, 1)), [1])[0].stretch for _ in range(200)]
    assert 2.0 < np.mean(few) < 2.8
    (calm,) = by_noise(np.full((6, 1), 40.0), [1])
    assert calm.stretch == pytest.approx(np.sqrt(7 / 6))


def test_a_feature_that_spreads_widely_changes_no_other():
    """Nor is what gains no more than chance stretched."""
    rows = np.array([[0.0, 0.2], [0.0, 0.6], [60.0, 0.1], [0.0, 0.9], [0.0, 0.3], [60.0, 0.4]])
    wide, calm = by_noise(rows, [1, 1])
    assert wide.stretch > 3
    assert calm == ByNoise(mean_nats=pytest.approx(0.416, abs=0.01), stretch=1.0)
    assert calm.chance(5.0, 1) == pytest.approx(chi2.sf(10, 1))


def test_the_price_of_a_search_is_no_noise():
    """The best of 500 gains six nats by chance: nothing is taken off, its chance is counted."""
    rng = np.random.default_rng(7)
    best = (rng.chisquare(5, (6, 500, 1)) / 2).max(axis=1)
    (own,) = by_noise(best, [5], [500])
    assert own.more(5) < 2.5
    (charged,) = by_noise(best, [5])
    assert charged.more(5) > 4


def test_what_is_gained_may_be_immense():
    """Chances keep their size far out, and what is needed stays finite."""
    assert NO_NOISE.chance(50.0, 1) == pytest.approx(chi2.sf(100, 1))
    own = ByNoise(mean_nats=80.0)
    assert 0 < own.chance(200.0, 5) < 1e-10
    assert own.most(5, 1e-17) > own.most(5, 1e-12)
    assert np.isfinite(own.most(5, 1e-17))

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
    """Of normal laws with three times the spread: the stretch is about that."""
    rng = np.random.default_rng(6)
    wide = 3 * np.sqrt(2 * (1 + 2 * 79)) / 2
    (own,) = by_noise(rng.normal(40.0, wide, (400, 1)), [1])
    assert own.stretch == pytest.approx(3.0, rel=0.1)
    (calm,) = by_noise(np.full((6, 1), 40.0), [1])
    assert calm.stretch == pytest.approx(np.sqrt(7 / 6))

"""Whether a series has pulses at regular times."""

import math

import numpy as np
import pytest

from zfcal.diagnose.chances import least_of
from zfcal.diagnose.pulses import pulses


def test_pulses_by_hand():
    """A series that is 1 in one sample of fifty has all harmonics of its period alike: with 20
    of them, twice the power of white noise each, and 40 degrees of freedom it cannot be missed;
    white noise gives nothing.
    """
    rng = np.random.default_rng(11)
    comb = np.zeros((1, 5000))
    comb[0, ::50] = 1.0
    white = rng.normal(size=(1, 5000))

    assert pulses(comb, 0.2).z > 20
    assert pulses(white, 0.2).z < 3
    found = pulses(white + 2.0 * comb, 0.2)
    assert found.z > 5
    assert found.period_s == pytest.approx(10.0, rel=1e-3)
    assert math.isnan(pulses(white[:, :20], 0.2).z)


def test_white_noise_gives_standard_normal_numbers():
    """Of 200 series, one or four at a time: fundamentals that share harmonics make the numbers a
    little smaller; neither heavy tails nor a heap of equal ones, which would widen the null.
    """
    rng = np.random.default_rng(12)
    for n in (1, 4):
        z = np.array([pulses(rng.normal(size=(n, 3000)), 0.2).z for _ in range(200)])
        assert -0.7 < z.mean() < 0.1
        assert 0.8 < z.std() < 1.4
        assert z.max() < 3.7


def test_a_mean_is_no_pulse():
    """It is no power of the noise either."""
    white = np.random.default_rng(13).normal(size=(2, 4000))
    assert pulses(white + 100.0, 0.2).tail == pytest.approx(pulses(white, 0.2).tail, rel=1e-6)
    for constant in (0.0, 0.1, 1.0):
        assert pulses(np.full((1, 3001), constant), 0.2).tail == 1.0


def test_the_least_of_many_tails():
    """Of two of 0.1 one is as small in 0.19 of all cases; small ones add up."""
    assert least_of(0.1, 2) == pytest.approx(0.19)
    assert least_of(1e-9, 400) == pytest.approx(4e-7, rel=1e-6)
    assert least_of(1.0, 3) == pytest.approx(1.0)

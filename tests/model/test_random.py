"""Random numbers of the kernels."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numba import njit
from scipy import stats

from zfcal.model.kernels.random import (
    cos_turn,
    next_word,
    seeded,
    uniform,
    vonmises_r,
    vonmises_turn,
)


@njit
def _turns(kappa, n, seed):
    random, r = seeded(seed), vonmises_r(kappa)
    out = np.empty((n, 2))
    for k in range(n):
        out[k] = vonmises_turn(kappa, r, random)
    return out


@njit
def _uniforms(n, seed):
    random = seeded(seed)
    return np.array([uniform(random) for _ in range(n)])


@njit
def _words(state, n):
    return np.array([next_word(state) for _ in range(n)])


def test_the_generator_is_xoshiro256_plus_plus():
    """The published algorithm in Python's whole numbers, from the same state."""
    state = [1, 2, 3, 4]
    expected = []
    mask = (1 << 64) - 1
    for _ in range(10):
        total = (state[0] + state[3]) & mask
        expected.append((((total << 23) | (total >> 41)) + state[0]) & mask)
        shifted = (state[1] << 17) & mask
        state[2] ^= state[0]
        state[3] ^= state[1]
        state[1] ^= state[2]
        state[0] ^= state[3]
        state[2] ^= shifted
        state[3] = ((state[3] << 45) | (state[3] >> 19)) & mask

    assert [int(w) for w in _words(np.array([1, 2, 3, 4], np.uint64), 10)] == expected


@pytest.mark.parametrize("kappa", [0.0, 1e-7, 1e-4, 0.3, 2.0, 9.0, 30.0])
def test_turns_follow_the_von_mises_law(kappa):
    """Kolmogorov-Smirnov with 200,000 draws: notices a shift of the law by 0.5 %."""
    cosine, sine = _turns(kappa, 200_000, 7).T
    law = stats.vonmises(kappa) if kappa > 0 else stats.uniform(-math.pi, 2 * math.pi)

    assert cosine**2 + sine**2 == pytest.approx(1.0)
    assert stats.kstest(np.arctan2(sine, cosine), law.cdf).pvalue > 1e-4


def test_uniform_numbers_are_uniform():
    """Kolmogorov-Smirnov with 200,000 draws, none reaching one."""
    drawn = _uniforms(200_000, 3)

    assert drawn.min() >= 0
    assert drawn.max() < 1
    assert stats.kstest(drawn, "uniform").pvalue > 1e-4


def test_the_polynomial_cosine_is_the_cosine():
    """Over the half turn, to 1e-12."""
    turns = np.linspace(0, 1, 1001)

    assert [cos_turn(t) for t in turns] == pytest.approx(np.cos(np.pi * turns), abs=1e-12)

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
from zfcal.model.kernels.staircase import COLUMNS, ROWS, STEPS, build, staircase_turn


@njit
def _turns(kappa, n, seed):
    random, r = seeded(seed), vonmises_r(kappa)
    out = np.empty((n, 2))
    for k in range(n):
        out[k] = vonmises_turn(kappa, r, random)
    return out


@njit
def _staircase_turns(kappa, tables, n, seed):
    random = seeded(seed)
    out = np.empty((n, 2))
    for k in range(n):
        out[k] = staircase_turn(kappa, tables, (0, 0, 0), random)
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


KAPPAS = [0.0, 1e-7, 1e-4, 0.3, 2.0, 9.0, 30.0, 400.0]


def _check_law(kappa, turns):
    cosine, sine = turns.T
    law = stats.vonmises(kappa) if kappa > 0 else stats.uniform(-math.pi, 2 * math.pi)
    assert cosine**2 + sine**2 == pytest.approx(1.0)
    assert stats.kstest(np.arctan2(sine, cosine), law.cdf).pvalue > 1e-4


@pytest.mark.slow
@pytest.mark.parametrize("kappa", KAPPAS)
def test_turns_follow_the_von_mises_law(kappa):
    """Kolmogorov-Smirnov with 200,000 draws: notices a shift of the law by 0.5 %."""
    _check_law(kappa, _turns(kappa, 200_000, 7))


@pytest.mark.slow
@pytest.mark.parametrize("kappa", KAPPAS)
def test_turns_under_the_staircase_follow_the_von_mises_law(kappa):
    """The same by tables, with a million draws: notices 0.3 %."""
    tables = np.zeros((1, 1, 1, ROWS, COLUMNS))
    build(np.array([kappa]), tables[0, 0])

    _check_law(kappa, _staircase_turns(kappa, tables, 1_000_000, 8))


def test_the_tail_of_a_sharp_law_is_drawn(twin):
    """Beyond the equal steps lie 6e-5 of the law at kappa 9: their share within five errors."""
    tables = np.zeros((1, 1, 1, ROWS, COLUMNS))
    build(np.array([9.0]), tables[0, 0])
    edge = tables[0, 0, 0, 0, STEPS + 1] * STEPS
    n = 4_000_000

    share = (_staircase_turns(9.0, tables, n, 9)[:, 0] < math.cos(edge)).mean()

    expected = 2 * stats.vonmises(9.0).sf(edge)
    assert share == pytest.approx(expected, abs=5 * math.sqrt(expected / n))


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

"""Von Mises draws under a staircase: tables once per concentration, then cheap draws.

The density ``exp(kappa (cos t - 1))`` falls from t = 0 to pi. Steps of one
width under which it lies, and one more for the tail, are an envelope whose
areas are known exactly: a step by Walker's alias method, a place in it, and
acceptance by the ratio of density to step. No approximation enters, whatever
the steps; they only decide how often a draw is rejected (one in twenty).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Floats
from zfcal.model.kernels.compiled import inlined, kernel
from zfcal.model.kernels.random import next_word, sine, uniform

STEPS = 64
_REACH = 4.0
"""The equal steps end at so many standard deviations of the law."""

HEIGHT, TAKE, OTHER, ROWS = range(4)
COLUMNS = STEPS + 2
SCALE_AT = STEPS + 1
"""Behind TAKE: one over the integral of ``exp(kappa (cos t - 1))`` over the circle."""

_TO_UNIT = 1.0 / (1 << 53)


@kernel
def build(kappa: Floats, tables: Floats) -> None:
    """Write the table of each concentration.

    Parameters
    ----------
    kappa : ndarray, shape (table,)
        Concentrations, not negative; 0 is the uniform law.
    tables : ndarray, shape (table, 3, COLUMNS)
        Receives heights of the steps with their width behind, and the alias
        table of the steps' areas (Walker 1977; pairing of Vose 1991).
    """
    share = np.empty(STEPS + 1)
    small, large = np.empty(STEPS + 1, np.int64), np.empty(STEPS + 1, np.int64)
    for k in range(kappa.size):
        table = tables[k]
        width = min(math.pi, _REACH / math.sqrt(max(kappa[k], 1e-3))) / STEPS
        for step in range(STEPS + 1):
            table[HEIGHT, step] = math.exp(kappa[k] * (math.cos(step * width) - 1.0))
            share[step] = table[HEIGHT, step] * width
        share[STEPS] = table[HEIGHT, STEPS] * (math.pi - STEPS * width)
        table[HEIGHT, STEPS + 1] = width
        _alias(share, small, large, table)


@kernel
def _alias(
    share: Floats, small: NDArray[np.int64], large: NDArray[np.int64], table: Floats
) -> None:
    n_small, n_large = 0, 0
    share *= share.size / share.sum()
    for step in range(share.size):
        table[TAKE, step], table[OTHER, step] = 1.0, step
        if share[step] < 1.0:
            small[n_small] = step
            n_small += 1
        else:
            large[n_large] = step
            n_large += 1
    while n_small > 0 and n_large > 0:
        poor, rich = small[n_small - 1], large[n_large - 1]
        table[TAKE, poor], table[OTHER, poor] = share[poor], rich
        share[rich] -= 1.0 - share[poor]
        n_small -= 1
        if share[rich] < 1.0:
            n_large -= 1
            small[n_small] = rich
            n_small += 1


@inlined
def staircase_turn(
    kappa: float, tables: Floats, at: tuple[int, int, int], random: NDArray[np.uint64]
) -> tuple[float, float]:
    """Return cosine and sine of an angle drawn from a von Mises law about zero.

    Parameters
    ----------
    kappa
        Concentration of the table.
    tables : ndarray, shape (model, zone, law, 3, COLUMNS)
        From `build`.
    at
        Model, zone and law.
    random : ndarray of uint64, shape (4,)
    """
    m, z, law = at
    width = tables[m, z, law, HEIGHT, STEPS + 1]
    while True:
        place = (STEPS + 1) * uniform(random)
        step = int(place)
        other = int(tables[m, z, law, OTHER, step])
        step = other if place - step >= tables[m, z, law, TAKE, step] else step
        wide, below = width, tables[m, z, law, HEIGHT, step + 1]
        if step == STEPS:
            wide, below = math.pi - STEPS * width, 0.0
        word = next_word(random)
        half = sine(0.5 * (step * width + wide * ((word >> np.uint64(11)) * _TO_UNIT)))
        cosine = 1.0 - 2.0 * half * half
        level = uniform(random) * tables[m, z, law, HEIGHT, step]
        # The next step is a lower bound of the density: most draws need no exponential.
        if level < below or level < math.exp(kappa * (cosine - 1.0)):
            break
    side = 2.0 * half * math.sqrt(max(0.0, 1.0 - half * half))
    # The lowest bits took no part in the place.
    return cosine, -side if word & np.uint64(1) else side

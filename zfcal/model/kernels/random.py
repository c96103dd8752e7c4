"""Random numbers inside the kernels: xoshiro256++ and what is drawn from it.

A kernel keeps one state of four 64-bit words per run, made from a seed of
`numpy.random.SeedSequence`. It is inlined into the loop; a call of NumPy's
generator costs more than a whole draw here.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from zfcal.model.kernels.compiled import inlined, kernel

_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_MIX_1 = np.uint64(0xBF58476D1CE4E5B9)
_MIX_2 = np.uint64(0x94D049BB133111EB)
_TO_UNIT = 1.0 / (1 << 53)

# Of the sine: one over odd factorials, with alternating signs.
_S1, _S2, _S3, _S4 = -1 / 6, 1 / 120, -1 / 5040, 1 / 362880
_S5, _S6, _S7, _S8 = -1 / 39916800, 1 / 6227020800, -1 / 1307674368000, 1 / 355687428096000

State = NDArray[np.uint64]


@kernel
def seeded(seed: np.uint64) -> State:
    """Return the generator's state for a seed, filled by SplitMix64.

    Source: Blackman and Vigna 2021, Scrambled linear pseudorandom number
    generators, ACM Transactions on Mathematical Software 47(4).
    """
    state = np.empty(4, dtype=np.uint64)
    word = np.uint64(seed)
    for k in range(4):
        word = word + _GOLDEN
        mixed = (word ^ (word >> np.uint64(30))) * _MIX_1
        mixed = (mixed ^ (mixed >> np.uint64(27))) * _MIX_2
        state[k] = mixed ^ (mixed >> np.uint64(31))
    return state


@inlined
def _rotate(word: np.uint64, by: int) -> np.uint64:
    return (word << np.uint64(by)) | (word >> np.uint64(64 - by))


@inlined
def next_word(state: State) -> np.uint64:
    """Return 64 random bits and advance the state (xoshiro256++)."""
    a, b, c, d = state[0], state[1], state[2], state[3]
    word = _rotate(a + d, 23) + a
    shifted = b << np.uint64(17)
    c ^= a
    d ^= b
    b ^= c
    a ^= d
    c ^= shifted
    state[0], state[1], state[2], state[3] = a, b, c, _rotate(d, 45)
    return word


@inlined
def uniform(state: State) -> float:
    """Return a number drawn uniformly from [0, 1)."""
    return (next_word(state) >> np.uint64(11)) * _TO_UNIT


@inlined
def sine(t: float) -> float:
    """Return the sine for t in [-pi/2, pi/2] by its series to the 17th power, error < 1e-12."""
    s = t * t
    q = s * s
    # In pairs, so that no product waits for all the others.
    low = (1.0 + _S1 * s) + q * (_S2 + _S3 * s)
    high = (_S4 + _S5 * s) + q * (_S6 + _S7 * s)
    return t * (low + q * q * (high + q * q * _S8))


@inlined
def cos_turn(half_turns: float) -> float:
    """Return ``cos(pi * half_turns)`` for half_turns in [0, 1]."""
    return sine(math.pi * (0.5 - half_turns))


@inlined
def vonmises_turn(kappa: float, r: float, state: State) -> tuple[float, float]:
    """Return cosine and sine of an angle drawn from a von Mises law about zero.

    Parameters
    ----------
    kappa
        Concentration; 0 is the uniform law.
    r
        What `vonmises_r` gives for it.
    state : ndarray of uint64, shape (4,)

    Notes
    -----
    Best and Fisher 1979, Applied Statistics 28: wrapped Cauchy proposals. Only
    the cosine is needed to accept, so no inverse trigonometry is done.
    """
    while True:
        z = cos_turn(uniform(state))
        f = (1.0 + r * z) / (r + z)
        c = kappa * (r - f)
        u = uniform(state)
        if c * (2.0 - c) > u or (u > 0.0 and math.log(c / u) + 1.0 - c >= 0.0) or kappa == 0.0:
            break
    if kappa == 0.0:
        f = z
    f = min(1.0, max(-1.0, f))
    side = math.sqrt(1.0 - f * f)
    if next_word(state) >> np.uint64(63):
        side = -side
    return f, side


@inlined
def vonmises_r(kappa: float) -> float:
    """Return the constant of Best and Fisher's sampler for a concentration."""
    if kappa < 1e-6:
        # The wrapped Cauchy envelope flattens out: rho = kappa / 2 to first order.
        return 1.0 / max(kappa, 1e-12)
    tau = 1.0 + math.sqrt(1.0 + 4.0 * kappa * kappa)
    rho = (tau - math.sqrt(2.0 * tau)) / (2.0 * kappa)
    return (1.0 + rho * rho) / (2.0 * rho)

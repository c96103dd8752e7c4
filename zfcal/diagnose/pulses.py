"""Whether a series has pulses at regular times, by its periodogram.

The powers at harmonics of a fundamental are added up (de Jager et al. 1989, Astronomy and
Astrophysics 221: 180-190), and the largest sum of all fundamentals counts.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc

from zfcal.arrays import Floats
from zfcal.diagnose.chances import least_of, normal_of_tail

_HARMONICS = (1, 5, 20)
_SHORTEST_PERIOD_S = 5.0
_LEAST_PULSES = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class Pulses:
    """The fundamental whose harmonics have most power.

    Parameters
    ----------
    tail
        Probability of so much in white noise, over all fundamentals and numbers of harmonics.
    period_s
        Of the fundamental; NaN where the series is too short to have one.
    """

    tail: float
    period_s: float

    @property
    def z(self) -> float:
        """Return the tail as a standard normal number; NaN where there is none."""
        return normal_of_tail(self.tail) if math.isfinite(self.period_s) else math.nan


def pulses(sums: Floats, dt_s: float) -> Pulses:
    """Return the fundamental of which the harmonics have most power.

    The grid of fundamentals is as fine as the highest harmonic needs.

    Parameters
    ----------
    sums : ndarray, shape (series, sample)
        The powers of several series, each scaled to its own, are added; their means do not count.
    dt_s
        Between samples.
    """
    n, sums = sums.shape[1], sums - sums.mean(axis=1, keepdims=True)
    whole = np.maximum((sums**2).sum(axis=1), 1e-300)
    power = (np.abs(np.fft.rfft(sums, axis=1)) ** 2 / whole[:, None] * 2).sum(axis=0)
    found = []
    for harmonics in _HARMONICS:
        high = min(n * dt_s / _SHORTEST_PERIOD_S, (power.size - 1) / harmonics)
        fundamental = np.arange(_LEAST_PULSES, high, 1 / harmonics)
        if not fundamental.size:
            continue
        at = np.rint(fundamental[:, None] * np.arange(1, harmonics + 1)).astype(np.int64)
        summed = power[at].sum(axis=1)
        best = int(summed.argmax())
        tail = float(chdtrc(2 * harmonics * len(sums), summed[best]))
        least = float(least_of(tail, fundamental.size))
        found.append((least, n * dt_s / float(fundamental[best])))
    if not found:
        return Pulses(tail=1.0, period_s=math.nan)
    tail, period_s = min(found)
    return Pulses(tail=float(least_of(tail, len(found))), period_s=period_s)

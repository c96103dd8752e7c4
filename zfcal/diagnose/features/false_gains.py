"""What noise of positions alone makes a feature or a form gain, and the chance of a gain by it.

A law that is not quite that of what was measured has its maximum elsewhere than at no effect, and
twice what is gained there follows a noncentral chi-square (Wald 1943, Transactions of the American
Mathematical Society 54: 426-482). Replicates of the model without the effect, measured with the
same noise, show its mean. Its spread goes with the mean, and a few replicates would show it badly.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chndtr, chndtrix

from zfcal.arrays import Floats


@dataclass(frozen=True, slots=True, kw_only=True)
class ByNoise:
    """What noise makes something gain.

    Parameters
    ----------
    mean_nats
        In the mean, what idle strengths gain included.
    stretch
        By which what one recording gains differs from that mean more than in theory: because a few
        replicates show the mean, and where these spread by more.
    """

    mean_nats: float = 0.0
    stretch: float = 1.0

    def more(self, n_strengths: int) -> float:
        """Return the nats that noise makes as many strengths gain beyond what chance does."""
        return max(self.mean_nats - n_strengths / 2, 0.0)

    def chance(self, nats: float, n_strengths: int) -> float:
        """Return the chance of such a gain, or a larger one, where nothing is missing."""
        apart = 2 * self.more(n_strengths)
        ratio = (2 * max(nats, 0.0) - apart - n_strengths) / self.stretch + apart + n_strengths
        return float(1 - chndtr(max(ratio, 0.0), n_strengths, apart))

    def most(self, n_strengths: int, chance: float) -> float:
        """Return the nats that are gained or exceeded with a chance."""
        apart = 2 * self.more(n_strengths)
        ratio = float(chndtrix(1 - chance, n_strengths, apart))
        return ((ratio - apart - n_strengths) * self.stretch + apart + n_strengths) / 2


NO_NOISE = ByNoise()
"""Positions are exact: what chance alone makes idle strengths gain (Wilks 1938)."""


def by_noise(gained: Floats, n_strengths: Sequence[int]) -> list[ByNoise]:
    """Return what noise makes features gain.

    Parameters
    ----------
    gained : ndarray, shape (replicate, feature)
        On replicates of the model that lack the effects of these features, in nats.
    n_strengths
        Of each feature.
    """
    n, k = len(gained), np.array(n_strengths, dtype=np.float64)
    mean = np.maximum(gained.mean(axis=0), 0.0)
    apart = np.maximum(2 * mean - k, 0.0)
    spread = (2 * gained).var(axis=0, ddof=1) / (2 * (k + 2 * apart))
    moved = apart > 0
    wide = max(1.0, float(spread[moved].mean())) if moved.any() else 1.0
    stretch = math.sqrt(wide * (1 + 1 / n))
    return [ByNoise(mean_nats=float(each), stretch=stretch) for each in mean]

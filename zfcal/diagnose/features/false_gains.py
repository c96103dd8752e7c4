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
from scipy.special import chdtrc, chdtri
from scipy.stats import ncx2

from zfcal.arrays import Floats

_CALM = 5
"""Degrees of freedom with which theory tells how much replicates spread, beside what they show."""


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
        mean = apart + n_strengths
        ratio = max((2 * nats - mean) / self.stretch + mean, 0.0)
        if not apart > 0:
            return float(chdtrc(n_strengths, ratio))
        return float(ncx2.sf(ratio, n_strengths, apart))

    def most(self, n_strengths: int, chance: float) -> float:
        """Return the nats that are gained or exceeded with a chance."""
        apart = 2 * self.more(n_strengths)
        mean = apart + n_strengths
        if apart > 0:
            ratio = float(ncx2.isf(chance, n_strengths, apart))
        else:
            ratio = float(chdtri(n_strengths, chance))
        return ((ratio - mean) * self.stretch + mean) / 2


NO_NOISE = ByNoise()
"""Positions are exact: what chance alone makes idle strengths gain (Wilks 1938)."""


def by_noise(
    gained: Floats, n_strengths: Sequence[int], n_tried: Sequence[int] | None = None
) -> list[ByNoise]:
    """Return what noise makes features gain.

    The best of many features gains more than one of them by chance alone, at most the logarithm of
    their number (a union bound). That is no noise, and is counted where its chance is.

    Parameters
    ----------
    gained : ndarray, shape (replicate, feature)
        On two or more replicates of the model that lack the effects of these features, in nats.
    n_strengths
        Of each feature.
    n_tried
        Of how many each is the best; one if not given.
    """
    n, n_features = gained.shape
    k = np.array(n_strengths, dtype=np.float64)
    tried = np.ones(n_features) if n_tried is None else np.array(n_tried, dtype=np.float64)
    mean = np.maximum(gained.mean(axis=0) - np.log(tried), 0.0)
    apart = np.maximum(2 * mean - k, 0.0)
    spread = (2 * gained).var(axis=0, ddof=1) / (2 * (k + 2 * apart))
    # Six replicates show a spread badly: theory counts as much as they do, and beside two more.
    wide = (_CALM + (n - 1) * spread) / (_CALM + n - 1)
    wide = np.where(apart > 0, np.maximum(wide, 1.0), 1.0)
    return [
        ByNoise(mean_nats=float(each), stretch=math.sqrt(w * (1 + 1 / n)) if moved else 1.0)
        for each, w, moved in zip(mean, wide, apart > 0, strict=True)
    ]

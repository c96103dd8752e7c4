"""By how much positions err, as the law of headings shows it.

A recording with nothing between the steps of the model has no frames that tell noise from
movement. The law tells: averaged over where all may have been it is likelier than at the measured
positions where these err, by hundreds of nats for half a millimetre, and less likely where they
do not.

The logarithm of an average over few draws is too low, by what one over their number is of it. So
the likelihood is extrapolated to many draws from all and from half of them (Richardson 1911,
Philosophical Transactions of the Royal Society A 210: 307-357).
"""

from __future__ import annotations

import numpy as np

from zfcal.diagnose.features.fits import Fits
from zfcal.diagnose.features.law import DRAWS, Law
from zfcal.model.fitted import Fitted
from zfcal.model.scene import Scene

_TRIED_M = tuple(1e-4 * 2.0**k for k in range(7))
"""0.1 to 6.4 mm."""

_STEPS = 9000
"""So many steps tell by how much positions err."""


def likely_noise_m(scene: Scene, fitted: Fitted, *, seed: int = 0) -> float:
    """Return the standard deviation of positions per coordinate that is likeliest.

    Parameters
    ----------
    scene, fitted
        The recording, and the model at its maximum likelihood there.
    seed
        Of the draws.

    Returns
    -------
    float
        In metres; 0 or 0.1 mm where that is likelier than twice as much, which is exact enough.
    """
    every = max(1, int(fitted.used.sum()) // _STEPS)

    def log_likelihood(noise_m: float, n_draws: int) -> float:
        law = Law(
            scene=scene, fitted=fitted, noise_m=noise_m, seed=seed, n_draws=n_draws, every=every
        )
        return float(Fits(law=law).null_log_p.sum())

    found = [log_likelihood(0.0, 1)]
    for noise_m in _TRIED_M:
        found.append(2 * log_likelihood(noise_m, DRAWS) - log_likelihood(noise_m, DRAWS // 2))
        if found[-1] < found[-2]:
            break
    k = int(np.argmax(found)) - 1
    if k < 1:
        return 0.0 if k < 0 else _TRIED_M[0]
    return _peak(_TRIED_M[k], found[k : k + 3])


def _peak(noise_m: float, nats: list[float]) -> float:
    """Return where the parabola through three log likelihoods has its top.

    These are at half, once and twice ``noise_m``; fewer say no more than that.
    """
    if len(nats) < 3:
        return noise_m
    before, top, after = nats
    bend = before - 2 * top + after
    return float(noise_m * 2 ** (0.5 * (before - after) / bend if bend < 0 else 0.0))

"""The lapse of a law: a share of headings that are drawn from anywhere."""

from __future__ import annotations

import math

import numpy as np
from scipy.special import expit

from zfcal.arrays import Floats

UNIFORM = 1 / (2 * math.pi)


def mixed(density: Floats, level: float) -> tuple[float, Floats, Floats]:
    """Return the log likelihood with a lapse, the shares of steps that are none, and its slopes."""
    lapse = float(expit(level))
    both = (1 - lapse) * density + lapse * UNIFORM
    slope = (UNIFORM - density) / both * lapse * (1 - lapse)
    return float(np.log(both).sum()), (1 - lapse) * density / both, slope


def log_mixed(density: Floats, level: float) -> Floats:
    """Return log densities with a lapse, whose logit is ``level``."""
    lapse = float(expit(level))
    return np.log((1 - lapse) * density + lapse * UNIFORM)

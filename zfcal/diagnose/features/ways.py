"""Unit vectors of headings, or of twice their angle: what tilts of the law go by."""

from __future__ import annotations

import math

import numpy as np

from zfcal.arrays import Floats
from zfcal.model.directions import doubled
from zfcal.model.kernels.landing import ANGLES


def ways_of_cells(*, axial: bool = False) -> Floats:
    """Return the headings of the cells, shape (cell, 2).

    Parameters
    ----------
    axial
        Whether of twice their angle, as `zfcal.model.features.Tilt` has it.
    """
    angle = (2 if axial else 1) * 2 * math.pi * np.arange(ANGLES) / ANGLES
    return np.stack([np.cos(angle), np.sin(angle)], axis=1)


def ways_of(taken: Floats, *, axial: bool = False) -> Floats:
    """Return headings as a tilt has them, shape (step, 2).

    Parameters
    ----------
    taken : ndarray, shape (step, 2)
        Unit vectors.
    axial
        As of `ways_of_cells`.
    """
    return doubled(taken) if axial else taken

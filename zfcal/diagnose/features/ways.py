"""Unit vectors of headings, or of twice their angle: what tilts of the law go by."""

from __future__ import annotations

import math

import numpy as np

from zfcal.arrays import Floats
from zfcal.diagnose.features.law import Law
from zfcal.model.features import Tilt
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


def ways_taken(law: Law, *, axial: bool = False) -> Floats:
    """Return the headings taken, shape (step, 2).

    Parameters
    ----------
    law
        Of the steps.
    axial
        As of `ways_of_cells`.
    """
    taken = law.turns.taken
    if not axial:
        return taken
    x, y = taken.T
    return np.stack([x * x - y * y, 2 * x * y], axis=1)


def leaned(law: Law, feature: Tilt, vectors: Floats) -> tuple[Floats, Floats]:
    """Return the log of the factor of a tilt on each cell, and at the heading taken.

    Parameters
    ----------
    law
        Of the steps.
    feature
        The tilt.
    vectors : ndarray, shape (step, 2)
        Of it, all its weights together.
    """
    taken = ways_taken(law, axial=feature.axial)
    return vectors @ ways_of_cells(axial=feature.axial).T, (vectors * taken).sum(axis=1)

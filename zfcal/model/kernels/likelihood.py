"""The sums behind the one-step likelihood and its exact gradient, for the steps of one zone."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from zfcal.model.kernels.compiled import kernel

Floats = NDArray[np.float64]

PER_CELL = 4
"""Places in each cell of headings at which the landing zone is looked up."""

# Columns of the sums at the taken heading and over the landing zones.
BASE, BASE_SLOPE, SOCIAL, SOCIAL_SLOPE, SUMS = range(5)


@kernel
def sums(
    base: Floats,
    toward: Floats,
    angle_sr: Floats,
    taken: Floats,
    share: NDArray[np.uint8],
    kappas: tuple[float, float, float, float],
    at_taken: Floats,
    over_zones: Floats,
) -> None:
    """Write densities at the heading taken and their integrals over each landing zone.

    Parameters
    ----------
    base : ndarray, shape (step, mode, 2)
        Unit vectors of the base's modes, of equal weight.
    toward, angle_sr : ndarray, shape (step, other, 2) and (step, other)
    taken : ndarray, shape (step, 2)
    share : ndarray of uint8, shape (step, cell, zone)
    kappas
        kappa of the base, ``log(2 pi i0e(kappa))`` of it, and both for neighbours.
    at_taken : ndarray, shape (step, SUMS)
        Receives the base's density, its derivative less that of the constant
        (the mean of ``density * cos``), and the same of the neighbours, each
        weighted by its solid angle.
    over_zones : ndarray, shape (step, zone, SUMS)
        Receives their integrals over the headings that land in each zone.
    """
    kappa_0, log_0, kappa_f, log_f = kappas
    cells, n_zones = share.shape[1], share.shape[2]
    scale_0, scale_f = math.exp(-log_0), math.exp(-log_f)
    turn = 2.0 * math.pi / cells
    per = turn / PER_CELL
    gx, gy = np.empty(cells), np.empty(cells)
    for g in range(cells):
        gx[g], gy[g] = math.cos(turn * g), math.sin(turn * g)
    for s in range(base.shape[0]):
        for column in range(SUMS):
            at_taken[s, column] = 0.0
            for zone in range(n_zones):
                over_zones[s, zone, column] = 0.0
        modes = base.shape[1]
        for g in range(-1, cells):
            x, y = (taken[s, 0], taken[s, 1]) if g < 0 else (gx[g], gy[g])
            b, b_slope, f, f_slope = 0.0, 0.0, 0.0, 0.0
            for mode in range(modes):
                cosine = x * base[s, mode, 0] + y * base[s, mode, 1]
                value = math.exp(kappa_0 * (cosine - 1.0)) * scale_0 / modes
                b += value
                b_slope += value * cosine
            for j in range(toward.shape[1]):
                if angle_sr[s, j] > 0.0:
                    cosine = x * toward[s, j, 0] + y * toward[s, j, 1]
                    value = angle_sr[s, j] * math.exp(kappa_f * (cosine - 1.0)) * scale_f
                    f += value
                    f_slope += value * cosine
            if g < 0:
                at_taken[s, BASE], at_taken[s, BASE_SLOPE] = b, b_slope
                at_taken[s, SOCIAL], at_taken[s, SOCIAL_SLOPE] = f, f_slope
            else:
                for zone in range(n_zones):
                    if share[s, g, zone] > 0:
                        weight = per * share[s, g, zone]
                        over_zones[s, zone, BASE] += weight * b
                        over_zones[s, zone, BASE_SLOPE] += weight * b_slope
                        over_zones[s, zone, SOCIAL] += weight * f
                        over_zones[s, zone, SOCIAL_SLOPE] += weight * f_slope

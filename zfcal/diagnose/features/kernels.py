"""Integrals over the cells of headings that features ask for."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Floats, Ints
from zfcal.model.kernels.compiled import kernel
from zfcal.model.kernels.von_mises import exponential

_LEAST = 1e-6
"""Of a law that lands all round; below this share of it a series is not exact enough."""


@kernel
def bells(  # noqa: PLR0913, PLR0917 - a kernel
    toward: Floats, kappa: Floats, order: Ints, series: Floats, waves: Floats, weight: Floats,
    taken: Floats, at_taken: Floats, over: Floats,
) -> None:  # fmt: skip
    """Write von Mises laws, not scaled, at the heading taken and over all cells.

    The sum over cells is that of the Fourier series of the law times the waves of the weights: a
    few products in place of an exponential for each cell. Where next to nothing of the law lands
    inside they cancel, and the cells are added up themselves.

    Parameters
    ----------
    toward : ndarray, shape (step, source, 2)
        Unit vectors; zeros for no source.
    kappa : ndarray, shape (step,)
    order : ndarray of int64, shape (step,)
        Row of the series of a step's kappa.
    series : ndarray, shape (kappa, wave)
        exp(-kappa) I_m(kappa), twice that from the first wave on; zeros where it ends.
    waves : ndarray, shape (step, wave, 2)
        Sums over the cells of weight times cosine and sine of so many times the cell's angle.
    weight : ndarray, shape (step, cell)
    taken : ndarray, shape (step, 2)
    at_taken, over : ndarray, shape (step, source)
    """
    cells = weight.shape[1]
    gx, gy = np.empty(cells), np.empty(cells)
    for g in range(cells):
        gx[g], gy[g] = math.cos(2 * math.pi * g / cells), math.sin(2 * math.pi * g / cells)
    for s in range(toward.shape[0]):
        k, row = kappa[s], series[order[s]]
        least = _LEAST * row[0] * waves[s, 0, 0]
        for j in range(toward.shape[1]):
            x, y = toward[s, j, 0], toward[s, j, 1]
            at_taken[s, j], over[s, j] = 0.0, 0.0
            if x == 0.0 and y == 0.0:
                continue
            at_taken[s, j] = exponential(k * (taken[s, 0] * x + taken[s, 1] * y - 1.0))
            total, c, d = 0.0, 1.0, 0.0  # cosine and sine of so many times the angle
            for m in range(row.size):
                if row[m] == 0.0:
                    break
                total += row[m] * (waves[s, m, 0] * c + waves[s, m, 1] * d)
                c, d = c * x - d * y, d * x + c * y
            if not total > least:
                total = 0.0
                for g in range(cells):
                    total += weight[s, g] * exponential(k * (gx[g] * x + gy[g] * y - 1.0))
            over[s, j] = total


@kernel
def bells_on_cells(toward: Floats, kappa: Floats, weight: Floats, cells: Floats) -> None:
    """Add weighted von Mises laws, not scaled, to a density on cells.

    Parameters
    ----------
    toward : ndarray, shape (step, source, 2)
    kappa : ndarray, shape (step,)
    weight : ndarray, shape (step, source)
    cells : ndarray, shape (step, cell)
    """
    n = cells.shape[1]
    gx, gy = np.empty(n), np.empty(n)
    for g in range(n):
        gx[g], gy[g] = math.cos(2 * math.pi * g / n), math.sin(2 * math.pi * g / n)
    for s in range(toward.shape[0]):
        for j in range(toward.shape[1]):
            w, x, y = weight[s, j], toward[s, j, 0], toward[s, j, 1]
            if w == 0.0 or (x == 0.0 and y == 0.0):
                continue
            for g in range(n):
                cells[s, g] += w * exponential(kappa[s] * (gx[g] * x + gy[g] * y - 1.0))


@kernel
def tilted(density: Floats, ways: Floats, vector: Floats, whole: Floats, mean: Floats) -> None:
    """Write the integral of a density times exp(vector . heading), and the mean heading under it.

    Exponents are taken beside the largest one there may be, and are never above it.

    Parameters
    ----------
    density : ndarray, shape (step, cell)
    ways : ndarray, shape (cell, 2)
        Headings of the cells.
    vector : ndarray, shape (step, 2)
    whole : ndarray, shape (step,)
    mean : ndarray, shape (step, 2)
    """
    n = density.shape[1]
    gx, gy = ways[:, 0].copy(), ways[:, 1].copy()
    each = np.empty(n)
    for s in range(density.shape[0]):
        a, b = vector[s, 0], vector[s, 1]
        most = math.sqrt(a * a + b * b)
        # Only this array is written in this loop: with more the compiler gives up on vectors.
        for g in range(n):
            each[g] = density[s, g] * exponential(a * gx[g] + b * gy[g] - most)
        total, x, y = 0.0, 0.0, 0.0
        for g in range(n):
            total, x, y = total + each[g], x + each[g] * gx[g], y + each[g] * gy[g]
        whole[s], mean[s, 0], mean[s, 1] = total * math.exp(most), x / total, y / total


@kernel
def attractions(share: NDArray[np.uint8], gamma: Floats, zone: int) -> tuple[Floats, Floats]:
    """Return the attraction of all that each cell of headings lands in, and that of one zone.

    Parameters
    ----------
    share : ndarray of uint8, shape (step, cell, zone)
        How much of a cell lands in each zone.
    gamma : ndarray, shape (step, zone)
        Attraction of each zone.
    zone
        Column of the one that is asked for.

    Returns
    -------
    whole, own : ndarray, shape (step, cell)
    """
    whole, own = np.empty(share.shape[:2]), np.empty(share.shape[:2])
    for s in range(share.shape[0]):
        for g in range(share.shape[1]):
            total = 0.0
            for z in range(share.shape[2]):
                total += share[s, g, z] * gamma[s, z]
            whole[s, g], own[s, g] = total, share[s, g, zone] * gamma[s, zone]
    return whole, own

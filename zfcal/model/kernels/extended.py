"""Sums behind the one-step likelihood of a model with effects, for the steps of one zone."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Floats
from zfcal.model.kernels.compiled import inlined, kernel
from zfcal.model.kernels.landing import PER_CELL
from zfcal.model.kernels.von_mises import exponential, one_over_integral

# Columns of the sums at the taken heading and over the landing zones.
BASE, BASE_SLOPE, SOCIAL, SOCIAL_SLOPE, EXTRA, COLUMNS = range(6)


class Cells(NamedTuple):
    """Room for the densities of one step on all cells of headings.

    Attributes
    ----------
    gx, gy : ndarray, shape (cell,)
        Unit vectors of the headings; the last cell is the heading taken.
    cosine, value : ndarray, shape (cell,)
    columns : ndarray, shape (COLUMNS, cell)
    """

    gx: Floats
    gy: Floats
    cosine: Floats
    value: Floats
    columns: Floats


@kernel
def make_cells(cells: int) -> Cells:
    """Return room for so many cells, and one for the heading taken."""
    gx, gy = np.empty(cells + 1), np.empty(cells + 1)
    for g in range(cells):
        gx[g], gy[g] = math.cos(2 * math.pi * g / cells), math.sin(2 * math.pi * g / cells)
    return Cells(gx, gy, np.empty(cells + 1), np.empty(cells + 1), np.empty((COLUMNS, cells + 1)))


@inlined
def bell(
    x: float, y: float, kappa: float, weight: float, gx: Floats, gy: Floats, cosine: Floats,
    value: Floats, total: Floats,
) -> None:  # fmt: skip
    """Add a von Mises law, not scaled, to one array; leave its cosines and values."""
    # One array is written in each loop: with more the compiler gives up on vectors.
    for g in range(gx.size):
        cosine[g] = gx[g] * x + gy[g] * y
    for g in range(gx.size):
        value[g] = weight * exponential(kappa * (cosine[g] - 1.0))
    for g in range(gx.size):
        total[g] += value[g]


@inlined
def _weigh(cosine: Floats, value: Floats, total: Floats) -> None:
    for g in range(cosine.size):
        total[g] += value[g] * cosine[g]


@inlined
def densities(
    taken: Floats, base: Floats, toward: Floats, angle_sr: Floats, parts: Floats,
    kappas: tuple[float, float], scales: tuple[float, float], cells: Cells, apart: bool,
) -> None:  # fmt: skip
    """Write the unscaled heading density of one step on all cells.

    Parameters
    ----------
    taken : ndarray, shape (2,)
    base : ndarray, shape (mode, 2)
    toward, angle_sr : ndarray, shape (other, 2) and (other,)
    parts : ndarray, shape (component, 5)
        Weight, unit vector, kappa, and its constant.
    cells
        Its columns receive the densities; the last cell is the heading taken.
    apart
        Whether the density's parts and their slopes go to columns of their own; else all of
        it goes to the first one, and the others are left as they are.
    """
    gx, gy, cosine, value, columns = cells
    gx[-1], gy[-1] = taken[0], taken[1]
    columns[: COLUMNS if apart else 1] = 0.0
    social, extra = (SOCIAL, EXTRA) if apart else (BASE, BASE)
    modes = base.shape[0]
    for m in range(modes):
        weight = scales[0] / modes
        bell(base[m, 0], base[m, 1], kappas[0], weight, gx, gy, cosine, value, columns[BASE])
        if apart:
            _weigh(cosine, value, columns[BASE_SLOPE])
    for j in range(toward.shape[0]):
        if angle_sr[j] > 0.0:
            weight = angle_sr[j] * scales[1]
            bell(
                toward[j, 0], toward[j, 1], kappas[1], weight, gx, gy, cosine, value,
                columns[social],
            )  # fmt: skip
            if apart:
                _weigh(cosine, value, columns[SOCIAL_SLOPE])
    for c in range(parts.shape[0]):
        if parts[c, 0] > 0.0:
            weight = parts[c, 0] * parts[c, 4]
            bell(
                parts[c, 1], parts[c, 2], parts[c, 3], weight, gx, gy, cosine, value,
                columns[extra],
            )  # fmt: skip


@inlined
def _own_parts(parts: Floats, own: Floats) -> None:
    """Write the components of one step with their constants."""
    for c in range(parts.shape[0]):
        own[c, :4] = parts[c]
        own[c, 4] = one_over_integral(parts[c, 3]) if parts[c, 0] > 0.0 else 0.0


@kernel
def extended_sums(
    base: Floats, toward: Floats, angle_sr: Floats, taken: Floats, share: NDArray[np.uint8],
    parts: Floats, tilt: Floats, kappas: tuple[float, float], scales: tuple[float, float],
    at_taken: Floats, over_zones: Floats,
) -> None:  # fmt: skip
    """Write densities at the heading taken and their integrals over each landing zone.

    Parameters
    ----------
    base : ndarray, shape (step, mode, 2)
    toward, angle_sr : ndarray, shape (step, other, 2) and (step, other)
    taken : ndarray, shape (step, 2)
    share : ndarray of uint8, shape (step, cell, zone)
    parts : ndarray, shape (step, component, 4)
    tilt : ndarray, shape (step, cell), or (0, 0) where nothing is tilted
    kappas, scales
        Of the base and of the neighbours, with the constants of their densities.
    at_taken : ndarray, shape (step, COLUMNS)
    over_zones : ndarray, shape (step, zone, COLUMNS)
    """
    n_cells, n_zones = share.shape[1], share.shape[2]
    per = 2.0 * math.pi / n_cells / PER_CELL
    cells = make_cells(n_cells)
    columns, weight = cells.columns, np.empty(n_cells)
    own = np.zeros((parts.shape[1], 5))
    for s in range(base.shape[0]):
        _own_parts(parts[s], own)
        densities(taken[s], base[s], toward[s], angle_sr[s], own, kappas, scales, cells, True)
        for column in range(COLUMNS):
            at_taken[s, column] = columns[column, n_cells]
        for zone in range(n_zones):
            lands = 0.0
            for g in range(n_cells):
                weight[g] = per * share[s, g, zone]
            if tilt.shape[0] > 0:
                for g in range(n_cells):
                    weight[g] *= tilt[s, g]
            for g in range(n_cells):
                lands += weight[g]
            for column in range(COLUMNS):
                over_zones[s, zone, column] = 0.0
            if lands > 0.0:
                for column in range(COLUMNS):
                    total = 0.0
                    for g in range(n_cells):
                        total += weight[g] * columns[column, g]
                    over_zones[s, zone, column] = total


@kernel
def extended_density(
    base: Floats, toward: Floats, angle_sr: Floats, taken: Floats, share: NDArray[np.uint8],
    parts: Floats, tilt: Floats, kappas: tuple[float, float], scales: tuple[float, float],
    gamma: Floats, at_taken: Floats, whole: Floats,
) -> None:  # fmt: skip
    """Write what `extended_sums` comes to at one alpha and gamma, without the derivatives.

    Parameters
    ----------
    base, toward, angle_sr, taken, share, parts, tilt
        As for `extended_sums`.
    kappas, scales
        Likewise; alpha is in the second scale.
    gamma : ndarray, shape (zone,)
    at_taken : ndarray, shape (step,)
        Receives the mixture at the heading taken.
    whole : ndarray, shape (step,)
        Receives its integral, tilted, over all that lands inside, weighted by gamma.
    """
    n_cells, n_zones = share.shape[1], share.shape[2]
    per = 2.0 * math.pi / n_cells / PER_CELL
    cells = make_cells(n_cells)
    mixture, weight = cells.columns[BASE], np.empty(n_cells)
    own = np.zeros((parts.shape[1], 5))
    for s in range(base.shape[0]):
        _own_parts(parts[s], own)
        densities(taken[s], base[s], toward[s], angle_sr[s], own, kappas, scales, cells, False)
        weight[:] = 0.0
        for zone in range(n_zones):
            for g in range(n_cells):
                weight[g] += per * gamma[zone] * share[s, g, zone]
        if tilt.shape[0] > 0:
            for g in range(n_cells):
                weight[g] *= tilt[s, g]
        total = 0.0
        for g in range(n_cells):
            total += weight[g] * mixture[g]
        at_taken[s], whole[s] = mixture[n_cells], total


@kernel
def cell_table(
    base: Floats, toward: Floats, angle_sr: Floats, taken: Floats, share: NDArray[np.uint8],
    parts: Floats, tilt: Floats, kappas: tuple[float, float], scales: tuple[float, float],
    alpha: float, gamma: Floats, mixture: Floats, probability: Floats, mixture_taken: Floats,
) -> None:  # fmt: skip
    """Write the mixture before attraction, and the probability, of each cell of headings.

    Parameters
    ----------
    gamma : ndarray, shape (zone,)
    mixture, probability : ndarray, shape (step, cell)
        The mixture is not scaled; probabilities of a step sum to one. Both are zero where
        no heading of the cell lands inside.
    mixture_taken : ndarray, shape (step,)
        The mixture at the heading taken.
    """
    n_cells, n_zones = share.shape[1], share.shape[2]
    cells = make_cells(n_cells)
    columns = cells.columns
    own = np.zeros((parts.shape[1], 5))
    for s in range(base.shape[0]):
        _own_parts(parts[s], own)
        densities(taken[s], base[s], toward[s], angle_sr[s], own, kappas, scales, cells, True)
        mixture_taken[s] = (
            columns[BASE, n_cells] + alpha * columns[SOCIAL, n_cells] + columns[EXTRA, n_cells]
        )
        total = 0.0
        for g in range(n_cells):
            attraction = 0.0
            for zone in range(n_zones):
                attraction += gamma[zone] * share[s, g, zone]
            mixture[s, g], probability[s, g] = 0.0, 0.0
            if attraction > 0.0:
                mixture[s, g] = columns[BASE, g] + alpha * columns[SOCIAL, g] + columns[EXTRA, g]
                factor = tilt[s, g] if tilt.shape[0] > 0 else 1.0
                probability[s, g] = attraction * factor * mixture[s, g]
                total += probability[s, g]
        for g in range(n_cells):
            probability[s, g] /= total


@kernel
def _harmonic(waves: Floats, gx: Floats, gy: Floats, total: Floats) -> None:
    """Write a trigonometric polynomial at the cells of headings."""
    cells = gx.size
    for g in range(cells):
        total[g] = waves[0] + waves[1] * gx[g] + waves[2] * gy[g]
    for d in range(2, waves.size // 2 + 1):
        c, s = waves[2 * d - 1], waves[2 * d]
        if c != 0.0 or s != 0.0:
            for g in range(cells):
                total[g] += c * gx[d * g % cells] + s * gy[d * g % cells]


@kernel
def harmonic_tilt(waves: Floats, zones: Floats, share: NDArray[np.uint8], tilt: Floats) -> None:
    """Write factors on cells of headings from the harmonics of their logs.

    Parameters
    ----------
    waves, zones
        From `zfcal.model.kernels.effect_evaluation.ask_harmonics`.
    share : ndarray of uint8, shape (step, cell, zone)
        A cell that several zones share counts as in the one with most of it.
    tilt : ndarray, shape (step, cell)
        Receives the factors; of no matter in a cell that lands nowhere.
    """
    cells = tilt.shape[1]
    gx, gy = np.empty(cells), np.empty(cells)
    for g in range(cells):
        gx[g], gy[g] = math.cos(2 * math.pi * g / cells), math.sin(2 * math.pi * g / cells)
    total = np.empty(cells)
    for s in range(waves.shape[0]):
        _harmonic(waves[s], gx, gy, total)
        if zones[s].any():
            for g in range(cells):
                zone, most = 0, 0
                for z in range(zones.shape[1]):
                    if share[s, g, z] > most:
                        most, zone = share[s, g, z], z
                total[g] += zones[s, zone]
        for g in range(cells):
            tilt[s, g] = exponential(min(total[g], 0.0))

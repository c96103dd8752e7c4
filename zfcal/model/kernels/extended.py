"""Sums behind the one-step likelihood of a model with effects, for the steps of one zone."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from zfcal.model.compiled import kernel
from zfcal.model.kernels.likelihood import PER_CELL

Floats = NDArray[np.float64]

# Columns of the sums at the taken heading and over the landing zones.
BASE, BASE_SLOPE, SOCIAL, SOCIAL_SLOPE, EXTRA, COLUMNS = range(6)


@kernel
def _scale(kappa: float) -> float:
    """Return one over ``2 pi I0(kappa) exp(-kappa)``.

    Source: Abramowitz and Stegun 1964, 9.8.1 and 9.8.2 (relative error below 2e-7).
    """
    if kappa < 3.75:
        t = (kappa / 3.75) ** 2
        i0 = 1.0 + t * (
            3.5156229
            + t * (3.0899424 + t * (1.2067492 + t * (0.2659732 + t * (0.0360768 + t * 0.0045813))))
        )
        return math.exp(kappa) / (2.0 * math.pi * i0)
    t = 3.75 / kappa
    scaled = 0.39894228 + t * (
        0.01328592
        + t
        * (
            0.00225319
            + t
            * (
                -0.00157565
                + t
                * (
                    0.00916281
                    + t * (-0.02057706 + t * (0.02635537 + t * (-0.01647633 + t * 0.00392377)))
                )
            )
        )
    )
    return math.sqrt(kappa) / (2.0 * math.pi * scaled)


@kernel
def densities(
    x: float, y: float, base: Floats, toward: Floats, angle_sr: Floats, parts: Floats,
    kappas: tuple[float, float], scales: tuple[float, float], out: Floats,
) -> None:  # fmt: skip
    """Write the unscaled heading density of one step at one direction, in its parts.

    Parameters
    ----------
    base : ndarray, shape (mode, 2)
    toward, angle_sr : ndarray, shape (other, 2) and (other,)
    parts : ndarray, shape (component, 5)
        Weight, unit vector, kappa, and its constant.
    out : ndarray, shape (COLUMNS,)
    """
    out[:] = 0.0
    modes = base.shape[0]
    for m in range(modes):
        cosine = x * base[m, 0] + y * base[m, 1]
        value = math.exp(kappas[0] * (cosine - 1.0)) * scales[0] / modes
        out[BASE] += value
        out[BASE_SLOPE] += value * cosine
    for j in range(toward.shape[0]):
        if angle_sr[j] > 0.0:
            cosine = x * toward[j, 0] + y * toward[j, 1]
            value = angle_sr[j] * math.exp(kappas[1] * (cosine - 1.0)) * scales[1]
            out[SOCIAL] += value
            out[SOCIAL_SLOPE] += value * cosine
    for c in range(parts.shape[0]):
        if parts[c, 0] > 0.0:
            cosine = x * parts[c, 1] + y * parts[c, 2]
            out[EXTRA] += parts[c, 0] * math.exp(parts[c, 3] * (cosine - 1.0)) * parts[c, 4]


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
    cells, n_zones = share.shape[1], share.shape[2]
    per = 2.0 * math.pi / cells / PER_CELL
    gx, gy = np.empty(cells), np.empty(cells)
    for g in range(cells):
        gx[g], gy[g] = math.cos(2 * math.pi * g / cells), math.sin(2 * math.pi * g / cells)
    own = np.zeros((parts.shape[1], 5))
    out = np.zeros(COLUMNS)
    for s in range(base.shape[0]):
        over_zones[s] = 0.0
        for c in range(parts.shape[1]):
            own[c, :4] = parts[s, c]
            own[c, 4] = _scale(parts[s, c, 3]) if parts[s, c, 0] > 0.0 else 0.0
        densities(
            taken[s, 0], taken[s, 1], base[s], toward[s], angle_sr[s], own, kappas, scales, out
        )
        at_taken[s] = out
        for g in range(cells):
            inside = False
            for zone in range(n_zones):
                inside = inside or share[s, g, zone] > 0
            if not inside:
                continue
            densities(gx[g], gy[g], base[s], toward[s], angle_sr[s], own, kappas, scales, out)
            factor = tilt[s, g] if tilt.shape[0] > 0 else 1.0
            for zone in range(n_zones):
                if share[s, g, zone] > 0:
                    weight = per * share[s, g, zone] * factor
                    for column in range(COLUMNS):
                        over_zones[s, zone, column] += weight * out[column]


@kernel
def cell_table(
    base: Floats, toward: Floats, angle_sr: Floats, share: NDArray[np.uint8], parts: Floats,
    tilt: Floats, kappas: tuple[float, float], scales: tuple[float, float], alpha: float,
    gamma: Floats, mixture: Floats, probability: Floats,
) -> None:  # fmt: skip
    """Write the mixture before attraction, and the probability, of each cell of headings.

    Parameters
    ----------
    gamma : ndarray, shape (zone,)
    mixture, probability : ndarray, shape (step, cell)
        The mixture is not scaled; probabilities of a step sum to one. Both are zero where
        no heading of the cell lands inside.
    """
    cells, n_zones = share.shape[1], share.shape[2]
    gx, gy = np.empty(cells), np.empty(cells)
    for g in range(cells):
        gx[g], gy[g] = math.cos(2 * math.pi * g / cells), math.sin(2 * math.pi * g / cells)
    own = np.zeros((parts.shape[1], 5))
    out = np.zeros(COLUMNS)
    for s in range(base.shape[0]):
        for c in range(parts.shape[1]):
            own[c, :4] = parts[s, c]
            own[c, 4] = _scale(parts[s, c, 3]) if parts[s, c, 0] > 0.0 else 0.0
        total = 0.0
        for g in range(cells):
            attraction = 0.0
            for zone in range(n_zones):
                attraction += gamma[zone] * share[s, g, zone]
            mixture[s, g], probability[s, g] = 0.0, 0.0
            if attraction > 0.0:
                densities(gx[g], gy[g], base[s], toward[s], angle_sr[s], own, kappas, scales, out)
                mixture[s, g] = out[BASE] + alpha * out[SOCIAL] + out[EXTRA]
                factor = tilt[s, g] if tilt.shape[0] > 0 else 1.0
                probability[s, g] = attraction * factor * mixture[s, g]
                total += probability[s, g]
        for g in range(cells):
            probability[s, g] /= total


@kernel
def social_score(
    toward: Floats, changed_sr: Floats, angle_sr: Floats, taken: Floats, kappa: float,
    scale: float, alpha: float, mixture: Floats, probability: Floats, mixture_taken: Floats,
    floor: Floats, score: Floats,
) -> None:  # fmt: skip
    """Write the scores of neighbours that are seen otherwise.

    Parameters
    ----------
    changed_sr, angle_sr : ndarray, shape (step, other)
        Solid angles after and before.
    mixture, probability : ndarray, shape (step, cell)
        From `cell_table`, before.
    mixture_taken, floor : ndarray, shape (step,)
        The floor is added to the mixture.
    score : ndarray, shape (step,)
        Receives the change over the mean of both mixtures and the floor at the heading
        taken, less the mean of that over headings. The score itself, the change over the
        mixture, has no variance where the mixture is next to nothing: one heading in ten
        thousand outweighs all others. This is bounded by two, and as sharp at the
        strength that is asked for.
    """
    cells = mixture.shape[1]
    gx, gy = np.empty(cells), np.empty(cells)
    for g in range(cells):
        gx[g], gy[g] = math.cos(2 * math.pi * g / cells), math.sin(2 * math.pi * g / cells)
    for s in range(taken.shape[0]):
        score[s] = 0.0
        change = 0.0
        for j in range(toward.shape[1]):
            change = max(change, abs(changed_sr[s, j] - angle_sr[s, j]))
        if change == 0.0:
            continue
        mean, here = 0.0, 0.0
        for g in range(-1, cells):
            if g >= 0 and probability[s, g] <= 0.0:
                continue
            x, y = (taken[s, 0], taken[s, 1]) if g < 0 else (gx[g], gy[g])
            more = 0.0
            for j in range(toward.shape[1]):
                by = changed_sr[s, j] - angle_sr[s, j]
                if by != 0.0:
                    cosine = x * toward[s, j, 0] + y * toward[s, j, 1]
                    more += by * math.exp(kappa * (cosine - 1.0)) * scale
            if g < 0:
                here = alpha * more / (mixture_taken[s] + 0.5 * alpha * more + floor[s])
            else:
                by = alpha * more / (mixture[s, g] + 0.5 * alpha * more + floor[s])
                mean += probability[s, g] * by
        score[s] = here - mean


@kernel
def component_score(
    parts: Floats, taken: Floats, mixture: Floats, probability: Floats, mixture_taken: Floats,
    floor: Floats, score: Floats,
) -> None:  # fmt: skip
    """Write the scores of components that are added; see `social_score`.

    Parameters
    ----------
    parts : ndarray, shape (step, component, 4)
    """
    cells = mixture.shape[1]
    gx, gy = np.empty(cells), np.empty(cells)
    for g in range(cells):
        gx[g], gy[g] = math.cos(2 * math.pi * g / cells), math.sin(2 * math.pi * g / cells)
    own = np.empty(parts.shape[1])
    for s in range(taken.shape[0]):
        mean, any_ = 0.0, False
        for c in range(parts.shape[1]):
            own[c] = parts[s, c, 0] * _scale(parts[s, c, 3]) if parts[s, c, 0] > 0.0 else 0.0
            any_ = any_ or own[c] > 0.0
        score[s] = 0.0
        if not any_:
            continue
        for g in range(-1, cells):
            if g >= 0 and probability[s, g] <= 0.0:
                continue
            x, y = (taken[s, 0], taken[s, 1]) if g < 0 else (gx[g], gy[g])
            more = 0.0
            for c in range(parts.shape[1]):
                if own[c] > 0.0:
                    cosine = x * parts[s, c, 1] + y * parts[s, c, 2]
                    more += own[c] * math.exp(parts[s, c, 3] * (cosine - 1.0))
            if g < 0:
                score[s] = more / (mixture_taken[s] + 0.5 * more + floor[s])
            else:
                mean += probability[s, g] * more / (mixture[s, g] + 0.5 * more + floor[s])
        score[s] -= mean


@kernel
def mixture_score(
    other: Floats, other_taken: Floats, mixture: Floats, probability: Floats,
    mixture_taken: Floats, floor: Floats, score: Floats,
) -> None:  # fmt: skip
    """Write the score of another mixture beside the model's own; see `social_score`.

    Parameters
    ----------
    other : ndarray, shape (step, cell)
    other_taken : ndarray, shape (step,)
    score : ndarray, shape (step,)
        Receives the relative change at the heading taken, less its mean over headings.
    """
    for s in range(other.shape[0]):
        mean = 0.0
        for g in range(other.shape[1]):
            middle = 0.5 * (other[s, g] + mixture[s, g]) + floor[s]
            mean += probability[s, g] * (other[s, g] - mixture[s, g]) / middle
        middle = 0.5 * (other_taken[s] + mixture_taken[s]) + floor[s]
        score[s] = (other_taken[s] - mixture_taken[s]) / middle - mean


@kernel
def factor_score(tilt: Floats, tilt_taken: Floats, probability: Floats, score: Floats) -> None:
    """Write the change of the log density when headings are tilted by very little.

    Parameters
    ----------
    tilt : ndarray, shape (step, cell)
    tilt_taken, score : ndarray, shape (step,)
    """
    for s in range(tilt.shape[0]):
        mean = 0.0
        for g in range(tilt.shape[1]):
            mean += probability[s, g] * tilt[s, g]
        score[s] = math.log(max(tilt_taken[s], 1e-300)) - math.log(max(mean, 1e-300))

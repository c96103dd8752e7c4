"""Scores of effects on headings, turn by turn, from a fitted model's densities."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Floats
from zfcal.model.kernels.compiled import kernel
from zfcal.model.kernels.extended import bell, make_cells
from zfcal.model.kernels.von_mises import one_over_integral


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
    cells = make_cells(mixture.shape[1])
    more = np.empty(mixture.shape[1] + 1)
    for s in range(taken.shape[0]):
        score[s] = 0.0
        change = 0.0
        for j in range(toward.shape[1]):
            change = max(change, abs(changed_sr[s, j] - angle_sr[s, j]))
        if change == 0.0:
            continue
        cells.gx[-1], cells.gy[-1] = taken[s, 0], taken[s, 1]
        more[:] = 0.0
        for j in range(toward.shape[1]):
            by = alpha * scale * (changed_sr[s, j] - angle_sr[s, j])
            if by != 0.0:
                bell(
                    toward[s, j, 0], toward[s, j, 1], kappa, by, cells.gx, cells.gy,
                    cells.cosine, cells.value, more,
                )  # fmt: skip
        score[s] = _relative(more, mixture[s], probability[s], mixture_taken[s], floor[s])


@kernel
def late_score(
    sight: tuple[Floats, Floats], late: tuple[Floats, Floats], taken: Floats, kappa: float,
    scale: float, alpha: float, mixture: Floats, probability: Floats, mixture_taken: Floats,
    floor: Floats, score: Floats,
) -> None:  # fmt: skip
    """Write the scores of neighbours that are seen where they were; see `social_score`.

    Parameters
    ----------
    sight, late
        Unit vectors, shape (step, other, 2), and solid angles, shape (step, other). A model in
        which some respond late already has seen more others than a model that is late.
    """
    cells = make_cells(mixture.shape[1])
    more = np.empty(mixture.shape[1] + 1)
    for s in range(taken.shape[0]):
        cells.gx[-1], cells.gy[-1] = taken[s, 0], taken[s, 1]
        more[:] = 0.0
        there = False
        n_then, n_now = late[1].shape[1], sight[1].shape[1]
        for j in range(max(n_then, n_now)):
            by = late[1][s, j] if j < n_then else 0.0
            less = sight[1][s, j] if j < n_now else 0.0
            # Whoever is not seen at one of the times has no direction then.
            now, then = sight[0][s, min(j, n_now - 1)], late[0][s, min(j, n_then - 1)]
            if by == less and (by == 0.0 or (now[0] == then[0] and now[1] == then[1])):
                continue
            there = True
            if by > 0.0:
                bell(
                    then[0], then[1], kappa, alpha * scale * by, cells.gx, cells.gy,
                    cells.cosine, cells.value, more,
                )  # fmt: skip
            if less > 0.0:
                bell(
                    now[0], now[1], kappa, -alpha * scale * less, cells.gx, cells.gy,
                    cells.cosine, cells.value, more,
                )  # fmt: skip
        score[s] = 0.0
        if there:
            score[s] = _relative(more, mixture[s], probability[s], mixture_taken[s], floor[s])


@kernel
def _relative(
    more: Floats, mixture: Floats, probability: Floats, taken: float, floor: float
) -> float:
    """Return a change over the mean of both mixtures at the heading taken, less its mean."""
    mean = 0.0
    for g in range(mixture.size):
        if probability[g] > 0.0:
            mean += probability[g] * more[g] / (mixture[g] + 0.5 * more[g] + floor)
    return more[-1] / (taken + 0.5 * more[-1] + floor) - mean


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
    cells = make_cells(mixture.shape[1])
    more = np.empty(mixture.shape[1] + 1)
    for s in range(taken.shape[0]):
        score[s] = 0.0
        cells.gx[-1], cells.gy[-1] = taken[s, 0], taken[s, 1]
        more[:] = 0.0
        there = False
        for c in range(parts.shape[1]):
            if parts[s, c, 0] > 0.0:
                there = True
                kappa = parts[s, c, 3]
                weight = parts[s, c, 0] * one_over_integral(kappa)
                bell(
                    parts[s, c, 1], parts[s, c, 2], kappa, weight,
                    cells.gx, cells.gy, cells.cosine, cells.value, more,
                )  # fmt: skip
        if there:
            score[s] = _relative(more, mixture[s], probability[s], mixture_taken[s], floor[s])


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
def mean_waves(probability: Floats, share: NDArray[np.uint8], waves: Floats, zones: Floats) -> None:
    """Write the means of cosines and sines of headings, and how likely each landing zone is.

    Parameters
    ----------
    probability : ndarray, shape (step, cell)
    share : ndarray of uint8, shape (step, cell, zone)
    waves : ndarray, shape (step, 1 + 2 * degree)
        Receives one, then the mean of cosine and sine of each multiple of the heading.
    zones : ndarray, shape (step, zone)
    """
    cells = probability.shape[1]
    gx, gy = np.empty(cells), np.empty(cells)
    for g in range(cells):
        gx[g], gy[g] = math.cos(2 * math.pi * g / cells), math.sin(2 * math.pi * g / cells)
    for s in range(waves.shape[0]):
        waves[s], zones[s] = 0.0, 0.0
        waves[s, 0] = 1.0
        for g in range(cells):
            p = probability[s, g]
            if not p > 0.0:
                continue
            for d in range(1, waves.shape[1] // 2 + 1):
                waves[s, 2 * d - 1] += p * gx[d * g % cells]
                waves[s, 2 * d] += p * gy[d * g % cells]
            zone, most = 0, 0
            for z in range(zones.shape[1]):
                if share[s, g, z] > most:
                    most, zone = share[s, g, z], z
            zones[s, zone] += p


@kernel
def factor_score(tilt: Floats, tilt_taken: Floats, probability: Floats, score: Floats) -> None:
    """Write the change of the log density when headings are tilted by very little.

    Parameters
    ----------
    tilt : ndarray, shape (step, cell)
    tilt_taken, score : ndarray, shape (step,)
        The logarithm of the factor at the heading taken, less its mean over headings.
    """
    for s in range(tilt.shape[0]):
        mean, taken = 0.0, max(tilt_taken[s], 1e-300)
        for g in range(tilt.shape[1]):
            # The logarithm of a ratio near one, to the third order.
            mean += probability[s, g] * (tilt[s, g] - taken) / (tilt[s, g] + taken)
        score[s] = -2.0 * mean

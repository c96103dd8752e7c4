"""Loops over steps and cells of headings that numpy would do in too many passes."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Floats, Ints
from zfcal.model.kernels.compiled import kernel
from zfcal.model.kernels.state import HX, HY, KIND, SPEED, ZONE, X, Y

_TIE_RAD = 1e-9

# Columns of what a step's agent has about it.
NEAR, NEAR_M, NEAR_X, NEAR_Y, COMPANY, KNOWN, SUM_HX, SUM_HY, PACE = range(9)
MIDDLE_X, MIDDLE_Y, ROBOT_X, ROBOT_Y, SURROUNDINGS = range(9, 14)
"""NEAR: column of the nearest other one, -1 without. NEAR_M, NEAR_X, NEAR_Y: how far, and
unit vector to it. COMPANY: others within reach. KNOWN: those of them whose heading is known,
SUM_H: the sum of their headings, PACE: the mean of their speeds in m/s. MIDDLE: unit vector
to the others' centroid. ROBOT: unit vector to the nearest robot."""

# What is taken of a heading, beside its cosines and sines.
TURN, TURN_SIZE, POLARISATION, DISTANCE, BEARING, QUANTITIES = range(6)


@kernel
def surroundings_of(states: Floats, at: Ints, who: Ints, reach_m: float) -> Floats:
    """Return what the agents of some steps have about them, shape (step, SURROUNDINGS).

    Parameters
    ----------
    states : ndarray, shape (sample, state, agent)
        Rows as in `zfcal.model.kernels.state`.
    at, who : ndarray of int64, shape (step,)
        Sample and agent of each step.
    reach_m
        Others as near as that are company.
    """
    about = np.zeros((at.size, SURROUNDINGS))
    for s in range(at.size):
        state, i, own = states[at[s]], who[s], about[s]
        own[NEAR], own[NEAR_M] = -1.0, math.inf
        middle_x, middle_y, robot_m = 0.0, 0.0, math.inf
        for j in range(state.shape[1]):
            if j == i or not state[ZONE, j] > 0.0:
                continue
            dx, dy = state[X, j] - state[X, i], state[Y, j] - state[Y, i]
            away = math.sqrt(dx * dx + dy * dy)
            middle_x, middle_y = middle_x + dx, middle_y + dy
            if not away > 0.0:
                continue
            if away < own[NEAR_M]:
                own[NEAR], own[NEAR_M] = j, away
                own[NEAR_X], own[NEAR_Y] = dx / away, dy / away
            if state[KIND, j] > 0.0 and away < robot_m:
                robot_m = away
                own[ROBOT_X], own[ROBOT_Y] = dx / away, dy / away
            if away <= reach_m:
                own[COMPANY] += 1.0
                own[PACE] += state[SPEED, j]
                if state[HX, j] != 0.0 or state[HY, j] != 0.0:
                    own[KNOWN] += 1.0
                    own[SUM_HX] += state[HX, j]
                    own[SUM_HY] += state[HY, j]
        if own[COMPANY] > 0.0:
            own[PACE] /= own[COMPANY]
        away = math.sqrt(middle_x * middle_x + middle_y * middle_y)
        if away > 0.0:
            own[MIDDLE_X], own[MIDDLE_Y] = middle_x / away, middle_y / away
    return about


@kernel
def _measure(
    x: float, y: float, heading: Floats, about: Floats, reach_m: float, out: Floats
) -> None:
    """Write the quantities of one heading ``(x, y)``."""
    turn = math.atan2(heading[0] * y - heading[1] * x, heading[0] * x + heading[1] * y)
    out[TURN], out[TURN_SIZE] = turn, abs(turn)
    sum_x, sum_y = about[SUM_HX] + x, about[SUM_HY] + y
    out[POLARISATION] = math.sqrt(sum_x * sum_x + sum_y * sum_y) / (about[KNOWN] + 1.0)
    if about[NEAR] >= 0.0:
        dx = about[NEAR_M] * about[NEAR_X] - reach_m * x
        dy = about[NEAR_M] * about[NEAR_Y] - reach_m * y
        away = math.sqrt(dx * dx + dy * dy)
        out[DISTANCE], out[BEARING] = away, 0.0
        if away > 0.0:
            out[BEARING] = math.acos(min(1.0, max(-1.0, (dx * x + dy * y) / away)))


@kernel
def heading_moments(
    probability: Floats, heading: Floats, taken: Floats, about: Floats, reach_m: Floats,
    waves: Floats, quantities: Floats,
) -> None:  # fmt: skip
    """Write what the model expects of each step's heading.

    Parameters
    ----------
    probability : ndarray, shape (step, cell)
        Cell g is about the angle ``2 pi g / cells``; a step's sum to one.
    heading, taken : ndarray, shape (step, 2)
        Unit vectors before and after.
    about : ndarray, shape (step, SURROUNDINGS)
    reach_m : ndarray, shape (step,)
        Length of the step.
    waves : ndarray, shape (step, 4)
        Receives the means of the cosine and sine of the heading, and of twice the heading.
    quantities : ndarray, shape (step, QUANTITIES, 3)
        Receives the value at the heading taken, the mean, and the variance.
    """
    cells = probability.shape[1]
    gx, gy = np.empty(cells), np.empty(cells)
    for g in range(cells):
        gx[g], gy[g] = math.cos(2 * math.pi * g / cells), math.sin(2 * math.pi * g / cells)
    out = np.zeros(QUANTITIES)
    for s in range(probability.shape[0]):
        out[:] = 0.0
        _measure(taken[s, 0], taken[s, 1], heading[s], about[s], reach_m[s], out)
        for q in range(QUANTITIES):
            quantities[s, q, 0], quantities[s, q, 1], quantities[s, q, 2] = out[q], 0.0, 0.0
        waves[s] = 0.0
        for g in range(cells):
            p = probability[s, g]
            if not p > 0.0:
                continue
            waves[s, 0] += p * gx[g]
            waves[s, 1] += p * gy[g]
            waves[s, 2] += p * (gx[g] * gx[g] - gy[g] * gy[g])
            waves[s, 3] += p * 2.0 * gx[g] * gy[g]
            _measure(gx[g], gy[g], heading[s], about[s], reach_m[s], out)
            for q in range(QUANTITIES):
                quantities[s, q, 1] += p * out[q]
                quantities[s, q, 2] += p * out[q] * out[q]
        for q in range(QUANTITIES):
            quantities[s, q, 2] -= quantities[s, q, 1] * quantities[s, q, 1]


@kernel
def landing_chances(probability: Floats, share: NDArray[np.uint8], weight: Floats) -> Floats:
    """Return the probability that a step ends in each zone, shape (step, zone).

    Parameters
    ----------
    probability : ndarray, shape (step, cell)
        Of each cell of headings.
    share : ndarray of uint8, shape (step, cell, zone)
        Parts of each cell that land in each zone.
    weight : ndarray, shape (step, zone)
        Preference of each zone.
    """
    steps, cells, zones = share.shape
    chance = np.zeros((steps, zones))
    for s in range(steps):
        for g in range(cells):
            p, whole = probability[s, g], 0.0
            if not p > 0.0:
                continue
            for z in range(zones):
                whole += share[s, g, z] * weight[s, z]
            if whole > 0.0:
                for z in range(zones):
                    chance[s, z] += p * share[s, g, z] * weight[s, z] / whole
    return chance


@kernel
def product_sums(values: Floats, other: Ints, sums: Floats) -> int:
    """Add up products of scores with those of other steps; return of how many steps.

    Parameters
    ----------
    values : ndarray, shape (step, degree)
        NaN in all of a step's degrees where it has none.
    other : ndarray of int64, shape (step,)
        The other step of each, -1 for none.
    sums : ndarray, shape (degree,)
        Receives the sum of each degree.
    """
    n = 0
    for s in range(other.size):
        o = other[s]
        if o < 0 or math.isnan(values[s, 0] * values[o, 0]):
            continue
        n += 1
        for d in range(sums.size):
            sums[d] += values[s, d] * values[o, d]
    return n


@kernel
def sums_in_bins(values: Floats, bins: Ints, count: Ints, sums: Floats) -> None:
    """Add up the values of each bin, column by column.

    Parameters
    ----------
    values : ndarray, shape (step, column)
        NaN where there is none.
    bins : ndarray of int64, shape (step,)
        -1 for none.
    count, sums : ndarray, shape (bin, column)
        Zero; receive the number of values and their sum.
    """
    for s in range(bins.size):
        b = bins[s]
        if b < 0:
            continue
        for c in range(values.shape[1]):
            value = values[s, c]
            if math.isfinite(value):
                count[b, c] += 1
                sums[b, c] += value


@kernel
def _counted(angle: float, folded: bool) -> float:
    """Return an angle from -pi to 3 pi in [-pi, pi), or its size there."""
    if angle >= math.pi:
        angle -= 2.0 * math.pi
    elif angle < -math.pi:
        angle += 2.0 * math.pi
    return abs(angle) if folded else angle


@kernel
def cell_ranks(
    probability: Floats, taken: Floats, axis: Floats, folded: bool, lot: Floats, ranks: Floats
) -> None:  # fmt: skip
    """Write the randomised probability integral transform of each step's heading.

    Parameters
    ----------
    probability : ndarray, shape (step, cell)
    taken : ndarray, shape (step, 2)
    axis : ndarray, shape (step, 2)
        Unit vectors from which angles are counted.
    folded
        Whether their size alone counts, from 0 to pi, or their sign as well.
    lot : ndarray, shape (step,)
        Uniform on [0, 1): where in its cell a heading is taken to be.
    ranks : ndarray, shape (step,)
        Receives the probability of a smaller angle.
    """
    cells = probability.shape[1]
    width = 2.0 * math.pi / cells
    for s in range(probability.shape[0]):
        zero = math.atan2(axis[s, 1], axis[s, 0])
        own = round(math.atan2(taken[s, 1], taken[s, 0]) / width) % cells
        here = _counted(own * width - zero, folded)
        below = lot[s] * probability[s, own]
        for g in range(cells):
            p = probability[s, g]
            if p > 0.0 and g != own:
                before = here - _counted(g * width - zero, folded)
                # Two cells can mirror each other about the axis: one atom.
                below += p if before > _TIE_RAD else lot[s] * p if before > -_TIE_RAD else 0.0
        ranks[s] = min(max(below, 0.0), 1.0)


@kernel
def rare_headings(
    probability: Floats, taken: Floats, axis: Floats, floor: float, residual: Floats,
    variance: Floats,
) -> None:  # fmt: skip
    """Write by how much a heading lies more about a direction than the model makes it.

    Parameters
    ----------
    probability : ndarray, shape (step, cell)
    taken : ndarray, shape (step, 2)
    axis : ndarray, shape (step, axis, 2)
        Unit vectors, or (0, 0) for none.
    floor
        A density is counted as at least so much of a uniform one.
    residual, variance : ndarray, shape (step, 2 * axis)
        Receive ``h - E h`` and the variance of h, the bump ``max(0, cos)^6`` about a
        direction over the density: the score of a small component there. Of each axis
        first its own direction, then the opposite one.
    """
    cells = probability.shape[1]
    gx, gy = np.empty(cells), np.empty(cells)
    for g in range(cells):
        gx[g], gy[g] = math.cos(2 * math.pi * g / cells), math.sin(2 * math.pi * g / cells)
    weight = np.empty(cells)
    for s in range(probability.shape[0]):
        own = round(math.atan2(taken[s, 1], taken[s, 0]) * cells / (2.0 * math.pi)) % cells
        for g in range(cells):
            weight[g] = 1.0 / (probability[s, g] * cells + floor)
        for a in range(axis.shape[1]):
            x, y = axis[s, a, 0], axis[s, a, 1]
            along, along2, against, against2, here, behind = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            if x != 0.0 or y != 0.0:
                for g in range(cells):
                    cosine = gx[g] * x + gy[g] * y
                    cosine2 = cosine * cosine
                    h = cosine2 * cosine2 * cosine2 * weight[g]
                    p = probability[s, g] * h
                    if cosine > 0.0:
                        along, along2 = along + p, along2 + p * h
                        here = h if g == own else here
                    elif cosine < 0.0:
                        against, against2 = against + p, against2 + p * h
                        behind = h if g == own else behind
            residual[s, 2 * a], variance[s, 2 * a] = here - along, along2 - along * along
            residual[s, 2 * a + 1] = behind - against
            variance[s, 2 * a + 1] = against2 - against * against

"""What effects say of measured states: components, rotations, factors, speeds.

What asks effects is compiled without reference counts (`lean`). The arrays of a model travel in a
tuple, and each of a million calls counted all of them: a component took 270 ns, and takes 30.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Floats, Ints
from zfcal.model.kernels.compiled import inlined, kernel, lean
from zfcal.model.kernels.hooks import (
    call_component,
    call_factor,
    call_rotation,
    call_sight,
    call_speed,
)
from zfcal.model.kernels.state import Packed, goes_by_each, parameters_at

_HARDLY = 1e-6

PART = 4
"""Columns of a component: weight, unit vector x and y, kappa."""


@kernel
def attend(
    states: Floats, at: Ints, who: Ints, packed: Packed, angle_sr: Floats, changed: Floats
) -> None:
    """Write solid angles as effects on sight change them.

    Parameters
    ----------
    packed
        Of the first model.
    angle_sr, changed : ndarray, shape (step, agent)
        Given, and received.
    """
    _attend(states, at, who, packed, angle_sr, changed, np.zeros(states.shape[2] ** 2))


@lean
def _attend(
    states: Floats, at: Ints, who: Ints, packed: Packed, angle_sr: Floats, changed: Floats,
    row: Floats,
) -> None:  # fmt: skip
    """Write solid angles; ``row`` is zeros, for what agents see."""
    n = states.shape[2]
    for s in range(at.size):
        i = who[s]
        for j in range(n):
            row[i * n + j] = angle_sr[s, j]
        for h in range(packed.sights.shape[0]):
            kind = packed.sights[h, 1]
            each = goes_by_each(packed, 0, kind)
            own = parameters_at(packed, 0, kind, states[at[s]], row, i, -1)
            for j in range(n):
                if row[i * n + j] > 0.0:
                    if each:
                        own = parameters_at(packed, 0, kind, states[at[s]], row, i, j)
                    row[i * n + j] *= call_sight(
                        packed.sights[h, 0], states[at[s]].ctypes.data, row.ctypes.data, n, i,
                        own, j,
                    )  # fmt: skip
        for j in range(n):
            changed[s, j] = row[i * n + j]
            row[i * n + j] = 0.0


@kernel
def ask_components(
    states: Floats, at: Ints, who: Ints, packed: Packed, angle_sr: Floats, parts: Floats
) -> None:
    """Write the heading components of effects.

    Parameters
    ----------
    parts : ndarray, shape (step, component, PART)
        Receives weight, unit vector and kappa; weight 0 where there is none.
    """
    row, out = np.zeros(states.shape[2] ** 2), np.zeros(3)
    _ask_components(states, at, who, packed, angle_sr, parts, row, out)


@lean
def _ask_components(
    states: Floats, at: Ints, who: Ints, packed: Packed, angle_sr: Floats, parts: Floats,
    row: Floats, out: Floats,
) -> None:  # fmt: skip
    """Write components; ``row`` is zeros for what agents see, ``out`` a unit vector and kappa."""
    n = states.shape[2]
    for s in range(at.size):
        i = who[s]
        for j in range(n):
            row[i * n + j] = angle_sr[s, j]
        for h in range(packed.components.shape[0]):
            out[:] = 0.0
            weight: float = call_component(
                packed.components[h, 0], states[at[s]].ctypes.data, row.ctypes.data, n, i,
                parameters_at(packed, 0, packed.components[h, 1], states[at[s]], row, i, -1),
                out.ctypes.data,
            )  # fmt: skip
            parts[s, h, 0] = max(weight, 0.0)
            parts[s, h, 1], parts[s, h, 2], parts[s, h, 3] = out[0], out[1], out[2]
        for j in range(n):
            row[i * n + j] = 0.0


@kernel
def ask_rotations(
    states: Floats, at: Ints, who: Ints, packed: Packed, hooks: Ints, angle_sr: Floats,
    angle: Floats,
) -> None:  # fmt: skip
    """Write the angle by which some functions of effects turn directions.

    Parameters
    ----------
    hooks
        Of the model: those that turn the base's directions, or all.
    angle : ndarray, shape (step,)
    """
    _ask_rotations(states, at, who, packed, hooks, angle_sr, angle, np.zeros(states.shape[2] ** 2))


@lean
def _ask_rotations(
    states: Floats, at: Ints, who: Ints, packed: Packed, hooks: Ints, angle_sr: Floats,
    angle: Floats, row: Floats,
) -> None:  # fmt: skip
    """Write angles; ``row`` is zeros, for what agents see."""
    n = states.shape[2]
    for s in range(at.size):
        i, angle[s] = who[s], 0.0
        for j in range(n):
            row[i * n + j] = angle_sr[s, j]
        for h in range(hooks.shape[0]):
            angle[s] += call_rotation(
                hooks[h, 0], states[at[s]].ctypes.data, row.ctypes.data, n, i,
                parameters_at(packed, 0, hooks[h, 1], states[at[s]], row, i, -1),
            )  # fmt: skip
        for j in range(n):
            row[i * n + j] = 0.0


@inlined
def _cell_zone(share: NDArray[np.uint8], probability: Floats, s: int, g: int) -> int:
    """Return the zone with most of a cell; 0 for none, or where hardly any heading is taken."""
    zone, most = 0, 0
    for z in range(share.shape[2]):
        if share[s, g, z] > most:
            most, zone = share[s, g, z], z + 1
    if probability.shape[0] > 0 and probability[s, g] < _HARDLY:
        zone = 0
    return zone


@inlined
def _parameters_of(packed: Packed, state: Floats, row: Floats, i: int, own: Ints) -> None:
    """Write the addresses of parameters of the effects' factors, the same for all headings.

    Parameters
    ----------
    own : ndarray of int64, shape (factor,)
    """
    for h in range(own.size):
        own[h] = parameters_at(packed, 0, packed.factors[h, 1], state, row, i, -1)


@kernel
def ask_factors(
    states: Floats, at: Ints, who: Ints, packed: Packed, angle_sr: Floats, taken: Floats,
    speed_m_s: Floats, landing: Ints, share: NDArray[np.uint8], probability: Floats,
    tilt: Floats, tilt_taken: Floats,
) -> None:  # fmt: skip
    """Write the product of the effects' factors on each cell of headings.

    Parameters
    ----------
    taken : ndarray, shape (step, 2)
    speed_m_s, landing : ndarray, shape (step,)
    share : ndarray of uint8, shape (step, cell, zone)
        A cell that several zones share counts as in the one with most of it.
    probability : ndarray, shape (step, cell), or (0, cell)
        A cell that hardly any heading takes is passed over, where this is known.
    tilt : ndarray, shape (step, cell)
    tilt_taken : ndarray, shape (step,)
        At the heading taken.
    """
    cells = share.shape[1]
    row, own = np.zeros(states.shape[2] ** 2), np.zeros(packed.factors.shape[0], dtype=np.int64)
    gx, gy = np.empty(cells), np.empty(cells)
    for g in range(cells):
        gx[g], gy[g] = math.cos(2 * math.pi * g / cells), math.sin(2 * math.pi * g / cells)
    _ask_factors(
        states, at, who, packed, angle_sr, taken, speed_m_s, landing, share, probability, tilt,
        tilt_taken, (row, own, gx, gy),
    )  # fmt: skip


@lean
def _ask_factors(
    states: Floats, at: Ints, who: Ints, packed: Packed, angle_sr: Floats, taken: Floats,
    speed_m_s: Floats, landing: Ints, share: NDArray[np.uint8], probability: Floats,
    tilt: Floats, tilt_taken: Floats, work: tuple[Floats, Ints, Floats, Floats],
) -> None:  # fmt: skip
    """Write factors; ``work`` has zeros for what agents see and for addresses, and headings."""
    n, cells = states.shape[2], share.shape[1]
    row, own, gx, gy = work
    for s in range(at.size):
        i = who[s]
        for j in range(n):
            row[i * n + j] = angle_sr[s, j]
        state = states[at[s]]
        _parameters_of(packed, state, row, i, own)
        for g in range(-1, cells):
            ux, uy, zone = taken[s, 0], taken[s, 1], landing[s]
            if g >= 0:
                ux, uy, zone = gx[g], gy[g], _cell_zone(share, probability, s, g)
            product = 1.0
            if zone > 0:
                for h in range(packed.factors.shape[0]):
                    product *= call_factor(
                        packed.factors[h, 0], state.ctypes.data, row.ctypes.data, n, i, own[h],
                        ux, uy, speed_m_s[s], zone,
                    )  # fmt: skip
            if g >= 0:
                tilt[s, g] = product
            else:
                tilt_taken[s] = product
        for j in range(n):
            row[i * n + j] = 0.0


@inlined
def _log_factor(
    packed: Packed, own: Ints, state: Floats, row: Floats, i: int,
    heading: tuple[float, float], speed_m_s: float, landing: int,
) -> float:  # fmt: skip
    """Return the log of the product of the effects' factors at one heading.

    Parameters
    ----------
    own
        As `_parameters_of` writes them.
    state : ndarray, shape (row, agent)
    row : ndarray, shape (agent * agent,)
        What is seen.
    i
        The agent.
    """
    product = 1.0
    for h in range(packed.factors.shape[0]):
        product *= call_factor(
            packed.factors[h, 0], state.ctypes.data, row.ctypes.data, state.shape[1], i, own[h],
            heading[0], heading[1], speed_m_s, landing,
        )  # fmt: skip
    return math.log(max(product, 1e-300))


@inlined
def _polynomial(waves: Floats, x: float, y: float) -> float:
    """Return a trigonometric polynomial at the unit vector ``(x, y)``."""
    total, c, s = waves[0], 1.0, 0.0
    for d in range(1, waves.size // 2 + 1):
        c, s = c * x - s * y, s * x + c * y
        total += waves[2 * d - 1] * c + waves[2 * d] * s
    return total


@kernel
def ask_harmonics(
    states: Floats, at: Ints, who: Ints, packed: Packed, angle_sr: Floats, taken: Floats,
    speed_m_s: Floats, landing: Ints, by_landing: bool, waves: Floats, zones: Floats,
    log_taken: Floats,
) -> None:  # fmt: skip
    """Write the log of the effects' factors, as a trigonometric polynomial of the heading.

    Parameters
    ----------
    taken : ndarray, shape (step, 2)
    speed_m_s, landing : ndarray, shape (step,)
    by_landing
        Whether a factor depends on the landing zone.
    waves : ndarray, shape (step, 1 + 2 * degree)
        Receives the mean, then the cosine's and the sine's share of each degree, for
        headings that land in the first zone.
    zones : ndarray, shape (step, zone)
        Receives by how much more it is for each landing zone.
    log_taken : ndarray, shape (step,)
        At the heading taken.
    """
    points = waves.shape[1]
    row, own = np.zeros(states.shape[2] ** 2), np.zeros(packed.factors.shape[0], dtype=np.int64)
    gx, gy = np.empty(points), np.empty(points)
    for p in range(points):
        gx[p], gy[p] = math.cos(2 * math.pi * p / points), math.sin(2 * math.pi * p / points)
    _ask_harmonics(
        states, at, who, packed, angle_sr, speed_m_s, by_landing, waves, zones,
        (row, own, gx, gy, np.empty(points)),
    )  # fmt: skip
    for s in range(at.size):
        log_taken[s] = _polynomial(waves[s], taken[s, 0], taken[s, 1]) + zones[s, landing[s] - 1]


@lean
def _ask_harmonics(
    states: Floats, at: Ints, who: Ints, packed: Packed, angle_sr: Floats, speed_m_s: Floats,
    by_landing: bool, waves: Floats, zones: Floats,
    work: tuple[Floats, Ints, Floats, Floats, Floats],
) -> None:  # fmt: skip
    """Write polynomials; ``work`` is that of `_ask_factors`, and room for values at headings."""
    n, points = states.shape[2], waves.shape[1]
    row, own, gx, gy, value = work
    for s in range(at.size):
        i = who[s]
        for j in range(n):
            row[i * n + j] = angle_sr[s, j]
        state = states[at[s]]
        _parameters_of(packed, state, row, i, own)
        for p in range(points):
            value[p] = _log_factor(packed, own, state, row, i, (gx[p], gy[p]), speed_m_s[s], 1)
        waves[s] = 0.0
        for p in range(points):
            waves[s, 0] += value[p] / points
            for d in range(1, points // 2 + 1):
                waves[s, 2 * d - 1] += 2.0 * value[p] * gx[p * d % points] / points
                waves[s, 2 * d] += 2.0 * value[p] * gy[p * d % points] / points
        zones[s] = 0.0
        if by_landing:
            for z in range(1, zones.shape[1]):
                there = _log_factor(packed, own, state, row, i, (gx[0], gy[0]), speed_m_s[s], z + 1)
                zones[s, z] = there - value[0]
        for j in range(n):
            row[i * n + j] = 0.0


@kernel
def ask_speeds(
    states: Floats, at: Ints, who: Ints, packed: Packed, angle_sr: Floats, factor: Floats
) -> None:
    """Write the product of the effects' factors on the speed of each step.

    Parameters
    ----------
    factor : ndarray, shape (step,)
        As for a chance of just less than one: nobody is stopped.
    """
    _ask_speeds(states, at, who, packed, angle_sr, factor, np.zeros(states.shape[2] ** 2))


@lean
def _ask_speeds(
    states: Floats, at: Ints, who: Ints, packed: Packed, angle_sr: Floats, factor: Floats,
    row: Floats,
) -> None:  # fmt: skip
    """Write factors on speeds; ``row`` is zeros, for what agents see."""
    n = states.shape[2]
    for s in range(at.size):
        i = who[s]
        for j in range(n):
            row[i * n + j] = angle_sr[s, j]
        factor[s] = 1.0
        for h in range(packed.speeds.shape[0]):
            factor[s] *= call_speed(
                packed.speeds[h, 0], states[at[s]].ctypes.data, row.ctypes.data, n, i,
                parameters_at(packed, 0, packed.speeds[h, 1], states[at[s]], row, i, -1),
                1.0 - 1e-12,
            )  # fmt: skip
        for j in range(n):
            row[i * n + j] = 0.0

"""Headings that draws from the mixture hardly ever hit: the same law under an envelope.

Where an agent may as good as never stay in its zone, and the zone that draws it
covers few of the directions before it, one draw of a hundred is taken. So after a
few the circle is cut into sectors. Of each no more is known than how dense the
mixture and how large the attraction of a landing zone can be anywhere in it; a
sector is drawn by the product, a heading evenly in it, and taken with the ratio of
the true product to the bound. That is the very law that rejection draws from,
whatever the sectors; they only decide how often a heading is rejected.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Floats
from zfcal.model.kernels.compiled import inlined, lean
from zfcal.model.kernels.geometry import Tank, best_within, zone_of
from zfcal.model.kernels.random import sine, uniform
from zfcal.model.kernels.staircase import SCALE_AT, TAKE
from zfcal.model.kernels.state import (
    HX,
    HY,
    KAPPA_BASE,
    LAW_BASE,
    LAW_F,
    SECTOR_ROWS,
    SECTORS,
    TABLE,
    TAU_X,
    TAU_Y,
    ZONE,
    Packed,
    Work,
    X,
    Y,
)
from zfcal.model.kernels.von_mises import LEAST, exponential, one_over_integral

_AX, _AY, _CEILING = range(SECTOR_ROWS)
_HALF_RAD = math.pi / SECTORS
_COS, _SIN = math.cos(_HALF_RAD), math.sin(_HALF_RAD)
_ABOVE = 1.0 + 1e-4
"""Takes the error of the exponential off an upper bound."""


@inlined
def _list_laws(
    i: int, count: int, state: Floats, model: int, packed: Packed, tank: Tank, work: Work
) -> int:
    """Write the von Mises laws of an agent's mixture: direction, kappa, weight over its integral.

    Those beyond the base are in ``work.parts``. The integrals of the zone's own are at hand.
    """
    zone = int(state[ZONE, i])
    laws, kappa = work.laws, packed.zones[model, zone, KAPPA_BASE]
    scale = packed.turns[model, zone, LAW_BASE, TAKE, SCALE_AT]
    cosine, sine_ = work.spin[0], work.spin[1]
    hx, hy, found = state[HX, i], state[HY, i], 1
    if tank.follows[zone]:
        hx, hy, found, scale = state[TAU_X, i], state[TAU_Y, i], 2, 0.5 * scale
    laws[0, 0], laws[0, 1] = cosine * hx - sine_ * hy, sine_ * hx + cosine * hy
    laws[0, 2], laws[0, 3] = kappa, scale
    laws[1, 0], laws[1, 1], laws[1, 2], laws[1, 3] = -laws[0, 0], -laws[0, 1], kappa, scale
    for k in range(count):
        laws[found + k, 0], laws[found + k, 1] = work.parts[k, 1], work.parts[k, 2]
        scale = packed.turns[model, zone, LAW_F, TAKE, SCALE_AT]
        if work.parts[k, 4] != TABLE:
            scale = one_over_integral(work.parts[k, 3])
        laws[found + k, 2], laws[found + k, 3] = work.parts[k, 3], scale * work.parts[k, 0]
    return found + count


@inlined
def _bound(found: int, work: Work) -> None:
    """Write how dense the mixture is at most in each sector."""
    gx, gy, ceiling = work.sectors[_AX], work.sectors[_AY], work.sectors[_CEILING]
    for s in range(SECTORS):
        ceiling[s] = 0.0
    for k in range(found):
        x, y, kappa = work.laws[k, 0], work.laws[k, 1], work.laws[k, 2]
        weight = _ABOVE * work.laws[k, 3]
        for s in range(SECTORS):
            # The cosine of the turn from the law's direction to the sector's nearest end.
            cosine, across = gx[s] * x + gy[s] * y, abs(gx[s] * y - gy[s] * x)
            most = cosine * _COS + across * _SIN
            most = 1.0 if cosine >= _COS else most
            ceiling[s] += weight * exponential(max(LEAST, kappa * (most - 1.0)))


@inlined
def _attract(
    i: int, reach_m: float, best: float, state: Floats, model: int, packed: Packed, tank: Tank,
    work: Work,
) -> float:  # fmt: skip
    """Multiply each sector's bound by the largest attraction within it; return the sum."""
    gx, gy, ceiling = work.sectors[_AX], work.sectors[_AY], work.sectors[_CEILING]
    gain = packed.gamma[model, int(state[ZONE, i])]
    # No landing point of a sector is farther from that in its middle.
    chord_m = (1.0 + 1e-9) * 2.0 * reach_m * math.sin(0.5 * _HALF_RAD) + 1e-12
    total = 0.0
    for s in range(SECTORS):
        x, y = state[X, i] + reach_m * gx[s], state[Y, i] + reach_m * gy[s]
        u, v = (x - tank.x0_m) * tank.per_m, (y - tank.y0_m) * tank.per_m
        most = best
        if 0.0 <= u < tank.cells.shape[1] and 0.0 <= v < tank.cells.shape[0]:
            row, column = int(v), int(u)
            if tank.clear_m[row, column] >= chord_m:
                most = gain[tank.cells[row, column]]
            else:
                most = best_within(x, y, chord_m, gain, tank)
        ceiling[s] *= most
        total += ceiling[s]
    return total


@inlined
def _density(ux: float, uy: float, found: int, work: Work) -> float:
    total = 0.0
    for k in range(found):
        laws = work.laws
        total += laws[k, 3] * math.exp(laws[k, 2] * (laws[k, 0] * ux + laws[k, 1] * uy - 1.0))
    return total


@lean
def open_sectors(
    i: int, reach_m: float, best: float, state: Floats, model: int, packed: Packed, tank: Tank,
    work: Work, count: int,
) -> tuple[int, float]:  # fmt: skip
    """Bound the heading law of an agent in all sectors.

    Parameters
    ----------
    reach_m
        Length of the step.
    best
        The largest attraction of a zone within reach.
    count
        Components that `gather` wrote.

    Returns
    -------
    found : int
        Laws of the mixture, in ``work.laws``.
    total : float
        Sum of the bounds, in ``work.sectors``.
    """
    found = _list_laws(i, count, state, model, packed, tank, work)
    _bound(found, work)
    return found, _attract(i, reach_m, best, state, model, packed, tank, work)


@lean
def draw_in_sectors(
    i: int, reach_m: float, opened: tuple[int, float], state: Floats, model: int, packed: Packed,
    tank: Tank, random: NDArray[np.uint64], work: Work,
) -> bool:  # fmt: skip
    """Write a heading and its landing zone into row i of ``work.moves``; tell whether to take it.

    Parameters
    ----------
    opened
        From `open_sectors`, with a total above zero.
    """
    found, total = opened
    ceiling = work.sectors[_CEILING]
    level, s = uniform(random) * total, 0
    while s < SECTORS - 1 and level >= ceiling[s]:
        level -= ceiling[s]
        s += 1
    across = sine(_HALF_RAD * (2.0 * uniform(random) - 1.0))
    along = math.sqrt(1.0 - across * across)
    gx, gy = work.sectors[_AX, s], work.sectors[_AY, s]
    ux, uy = gx * along - gy * across, gy * along + gx * across
    landing = zone_of(state[X, i] + reach_m * ux, state[Y, i] + reach_m * uy, tank)
    work.moves[i, 0], work.moves[i, 1], work.moves[i, 2] = ux, uy, landing
    # What is left of the level is uniform below the bound.
    accept = packed.gamma[model, int(state[ZONE, i]), landing] * _density(ux, uy, found, work)
    return level < accept

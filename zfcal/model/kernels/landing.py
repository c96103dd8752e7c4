"""Where the headings of a step land: the integral over headings that the likelihood needs."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Floats
from zfcal.model.kernels.compiled import kernel
from zfcal.model.kernels.geometry import Tank, clearance, zone_of

ANGLES = 64
"""Cells of the integral over headings.

With 256 of them the estimates from half an hour differ by a hundredth of their
standard errors: a von Mises law of kappa 30 is 10 degrees wide, and within a
cell the landing zone is looked up at four places.
"""

PER_CELL = 4
"""Places in each cell of headings at which the landing zone is looked up."""


@kernel
def landing_shares(
    xy: Floats, reach: Floats, tank: Tank, n_zones: int, angles: int, per_cell: int
) -> NDArray[np.uint8]:
    """Count the landing zones of each cell; cell g is about the angle 2 pi g / angles."""
    share = np.zeros((len(xy), angles, n_zones), dtype=np.uint8)
    places = angles * per_cell
    ux, uy = np.empty(places), np.empty(places)
    for p in range(places):
        theta = 2.0 * math.pi * ((p + 0.5) / places - 0.5 / angles)
        ux[p], uy[p] = math.cos(theta), math.sin(theta)
    for s in range(len(xy)):
        x, y = xy[s, 0], xy[s, 1]
        if reach[s] < clearance(x, y, tank):  # no border is that near
            share[s, :, zone_of(x, y, tank) - 1] = per_cell
            continue
        until, zone, step = 0, 0, reach[s] * 2.0 * math.pi / places
        for p in range(places):
            if p >= until:
                to_x, to_y = x + reach[s] * ux[p], y + reach[s] * uy[p]
                zone, until = zone_of(to_x, to_y, tank), p + 1
                if zone > 0:  # those after it are in the same zone, as far as it is clear
                    until += int(min(clearance(to_x, to_y, tank) / step, float(places)))
            if zone > 0:
                share[s, p // per_cell, zone - 1] += 1
    return share

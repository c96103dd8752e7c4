"""Where a point lies in a tank, and how large a body looks.

Lengths are metres, angles radians, solid angles steradians.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class World(NamedTuple):
    """A tank: corners (corner, 2), and the strip's width."""

    outline: Floats
    corridor: Floats
    mouths: Floats
    wall_zone_m: float


@njit(cache=True)
def wrap(angle):
    """Return an angle in [-pi, pi)."""
    return (angle + math.pi) % (2 * math.pi) - math.pi


@njit(cache=True)
def within(x, y, corners):
    """Tell whether a polygon holds a point, by crossings of a ray."""
    inside = False
    n = len(corners)
    for a in range(n):
        b = (a + 1) % n
        if (corners[a, 1] > y) != (corners[b, 1] > y):
            share = (y - corners[a, 1]) / (corners[b, 1] - corners[a, 1])
            if x < corners[a, 0] + share * (corners[b, 0] - corners[a, 0]):
                inside = not inside
    return inside


@njit(cache=True)
def nearest_on(x, y, corners):
    """Return distance to a polygon's border, the nearest point, and its side's direction."""
    best, at_x, at_y, along = math.inf, 0.0, 0.0, 0.0
    n = len(corners)
    for a in range(n):
        b = (a + 1) % n
        dx, dy = corners[b, 0] - corners[a, 0], corners[b, 1] - corners[a, 1]
        t = ((x - corners[a, 0]) * dx + (y - corners[a, 1]) * dy) / (dx * dx + dy * dy)
        t = min(1.0, max(0.0, t))
        px, py = corners[a, 0] + t * dx, corners[a, 1] + t * dy
        d = (x - px) ** 2 + (y - py) ** 2
        if d < best:
            best, at_x, at_y, along = d, px, py, math.atan2(dy, dx)
    return math.sqrt(best), at_x, at_y, along


@njit(cache=True)
def zone_of(x, y, world):
    """Return the zone id of a point."""
    if not within(x, y, world.outline):
        return 0
    if within(x, y, world.corridor):
        return 1
    return 2 if nearest_on(x, y, world.outline)[0] < world.wall_zone_m else 3


@njit(cache=True)
def clear_m(x, y, world):
    """Return a distance within which no other zone begins."""
    wall = nearest_on(x, y, world.outline)[0]
    door = nearest_on(x, y, world.corridor)[0] if len(world.corridor) else math.inf
    return min(wall, abs(wall - world.wall_zone_m), door)


@njit(cache=True)
def wall_rad(x, y, world):
    """Return the direction along the nearest wall."""
    d, px, py, along = nearest_on(x, y, world.outline)
    return along if d < 1e-9 else math.atan2(py - y, px - x) + math.pi / 2


@njit(cache=True)
def triangle_sr(a, b, c):
    """Return the solid angle of a triangle seen from the origin (Van Oosterom, Strackee)."""
    la, lb, lc = np.sqrt((a * a).sum()), np.sqrt((b * b).sum()), np.sqrt((c * c).sum())
    triple = (
        a[0] * (b[1] * c[2] - b[2] * c[1])
        + a[1] * (b[2] * c[0] - b[0] * c[2])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
    )
    ab, bc, ca = (a * b).sum(), (b * c).sum(), (c * a).sum()
    return 2 * abs(math.atan2(abs(triple), la * lb * lc + ab * lc + bc * la + ca * lb))


@njit(cache=True)
def body_sr(dx, dy, heading):
    """Return the solid angle of a body of 20 x 20 x 10 mm with its head at (dx, dy)."""
    c, s = math.cos(heading), math.sin(heading)
    third = 0.02 / 3
    points = np.empty((4, 3))
    points[0] = np.array([dx, dy, 0.0])
    points[1] = np.array([dx - 0.02 * c, dy - 0.02 * s, 0.0])
    points[2] = np.array([dx - third * c - 0.01 * s, dy - third * s + 0.01 * c, 0.0])
    points[3] = np.array([dx - third * c + 0.01 * s, dy - third * s - 0.01 * c, 0.0])
    a, b, widest = 0, 1, -1.0
    for p in range(4):
        for q in range(p + 1, 4):
            gap = abs(wrap(math.atan2(points[p, 1], points[p, 0])
                           - math.atan2(points[q, 1], points[q, 0])))  # fmt: skip
            if gap > widest:
                a, b, widest = p, q, gap
    top = np.array([dx - third * c, dy - third * s, 0.005])
    bottom = np.array([dx - third * c, dy - third * s, -0.005])
    return triangle_sr(points[a], top, points[b]) + triangle_sr(points[a], points[b], bottom)

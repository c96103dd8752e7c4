"""The arena in arrays for the kernels: exact tests, and a grid that spares them.

`zfcal.model.tank` fills the arrays.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Floats
from zfcal.model.kernels.compiled import inlined, kernel
from zfcal.model.kernels.rooms import Rooms

ASK = 255
"""Mark of a cell that a border crosses."""

FINE = 8
"""Such a cell is cut into so many rows and columns, most of which no border crosses."""

ON_WALL_M = 1e-9
"""So near to the wall the direction along it is the segment's own."""

_ASIDE_M = 1e-6
"""So far from it one looks on which side the inside is."""

_TOUCH_M = 1e-12
"""A point so near to the wall is on it, hence inside; rounding is far smaller."""


class Tank(NamedTuple):
    """An arena for the kernels; lengths in metres.

    Attributes
    ----------
    walls : ndarray, shape (segment, 7)
        Start x, y, direction x, y (not scaled), one over squared length, length,
        end y.
    edges : ndarray, shape (edge, 7)
        Edges of the zones' polygons, likewise.
    edge_of : ndarray of int64, shape (polygon + 1,)
        Where each polygon's edges start.
    polygon_zone : ndarray of int64, shape (polygon,)
        Zone id of each polygon.
    near_zone, far_zone
        Zone ids of what the polygons leave, by distance to the wall; 0 for none.
    follows : ndarray of bool, shape (zone + 1,)
        Whether fish follow walls, by zone id.
    cells : ndarray of uint8, shape (row, column)
        Zone id of a cell, 255 where a border crosses it.
    fine : ndarray of uint8
        Likewise of the parts of cells that a border crosses, 64 for each such cell.
    fine_at : ndarray of int32, shape (row, column)
        Where those of a cell start.
    clear_m : ndarray of float32, shape (row, column)
        From no point of the cell is a border of a zone nearer than this.
    near_m : ndarray of float32, shape (row, column, zone + 1)
        From no point of the cell is a point of the zone nearer than this.
    nearest : ndarray of int32, shape (row, column)
        The one nearest wall segment, or minus the place in ``lists`` less one.
    lists : ndarray of int32
        A count and then so many segments, again and again.
    rooms
        On the grid of the cells; for effects that know of rooms.
    """

    walls: Floats
    edges: Floats
    edge_of: NDArray[np.int64]
    polygon_zone: NDArray[np.int64]
    near_zone: int
    far_zone: int
    wall_zone_m: float
    follows: NDArray[np.bool_]
    x0_m: float
    y0_m: float
    per_m: float
    cells: NDArray[np.uint8]
    fine: NDArray[np.uint8]
    fine_at: NDArray[np.int32]
    clear_m: NDArray[np.float32]
    near_m: NDArray[np.float32]
    nearest: NDArray[np.int32]
    lists: NDArray[np.int32]
    distance_low_m: float
    distance_per_m: float
    wall_low_m: float
    wall_per_m: float
    speed_low: float
    speed_high: float
    rooms: Rooms


@inlined
def segment_distance2(x: float, y: float, pieces: Floats, s: int) -> float:
    """Return the squared distance to a straight piece, in square metres."""
    px, py = x - pieces[s, 0], y - pieces[s, 1]
    t = (px * pieces[s, 2] + py * pieces[s, 3]) * pieces[s, 4]
    t = min(1.0, max(0.0, t))
    ex, ey = px - t * pieces[s, 2], py - t * pieces[s, 3]
    return ex * ex + ey * ey


@inlined
def crosses(x: float, y: float, pieces: Floats, s: int) -> bool:
    """Tell whether a ray from the point to the right crosses a piece."""
    x0, y0 = pieces[s, 0], pieces[s, 1]
    # Start plus direction can round to beside the end, where the next piece starts.
    y1 = pieces[s, 6]
    return (y0 > y) != (y1 > y) and x < pieces[s, 2] * (y - y0) / (y1 - y0) + x0


@kernel
def zone_exact(x: float, y: float, tank: Tank) -> int:
    """Return the zone id of a point by the exact test; 0 outside."""
    inside = False
    nearest2 = math.inf
    for s in range(tank.walls.shape[0]):
        if crosses(x, y, tank.walls, s):
            inside = not inside
        nearest2 = min(nearest2, segment_distance2(x, y, tank.walls, s))
    on_wall = nearest2 <= _TOUCH_M**2
    if not inside and not on_wall:
        return 0
    for p in range(tank.polygon_zone.size):
        within = False
        for e in range(tank.edge_of[p], tank.edge_of[p + 1]):
            if crosses(x, y, tank.edges, e):
                within = not within
        if within or (on_wall and _touches(x, y, p, tank)):
            return tank.polygon_zone[p]
    rest = tank.near_zone if nearest2 < tank.wall_zone_m**2 else tank.far_zone
    return rest if rest > 0 else _beside_crack(x, y, math.sqrt(nearest2), tank)


@kernel
def _touches(x: float, y: float, p: int, tank: Tank) -> bool:
    """Tell whether a point is on an edge of a polygon."""
    for e in range(tank.edge_of[p], tank.edge_of[p + 1]):
        if segment_distance2(x, y, tank.edges, e) <= _TOUCH_M**2:
            return True
    return False


@kernel
def _beside_crack(x: float, y: float, wall_m: float, tank: Tank) -> int:
    """Return the nearest zone to a point in none, by the rule of `zfcal.arena`."""
    best, zone = math.inf, 0
    for p in range(tank.polygon_zone.size):
        for e in range(tank.edge_of[p], tank.edge_of[p + 1]):
            away = math.sqrt(segment_distance2(x, y, tank.edges, e))
            if away < best:
                best, zone = away, tank.polygon_zone[p]
    rest = max(tank.near_zone, tank.far_zone)
    if rest > 0 and abs(wall_m - tank.wall_zone_m) < best:
        zone = rest
    return zone


@inlined
def zone_of(x: float, y: float, tank: Tank) -> int:
    """Return the zone id of a point; 0 outside."""
    u, v = (x - tank.x0_m) * tank.per_m, (y - tank.y0_m) * tank.per_m
    zone = 0
    if 0.0 <= u < tank.cells.shape[1] and 0.0 <= v < tank.cells.shape[0]:
        row, column = int(v), int(u)
        zone = int(tank.cells[row, column])
        if zone == ASK:
            part = int(FINE * (v - row)) * FINE + int(FINE * (u - column))
            zone = int(tank.fine[tank.fine_at[row, column] + part])
            if zone == ASK:
                zone = zone_exact(x, y, tank)
    return zone


@inlined
def clearance(x: float, y: float, tank: Tank) -> float:
    """Return a distance within which all points are in the zone of a point inside, in metres."""
    return tank.clear_m[int((y - tank.y0_m) * tank.per_m), int((x - tank.x0_m) * tank.per_m)]


@inlined
def best_within(x: float, y: float, reach_m: float, gain: Floats, tank: Tank) -> float:
    """Return the largest gain of the zones that may be within reach of a point inside.

    Parameters
    ----------
    gain : ndarray, shape (zone + 1,)
        By zone id; not negative. What lies outside the tank gains nothing.
    """
    row, column = int((y - tank.y0_m) * tank.per_m), int((x - tank.x0_m) * tank.per_m)
    best = 0.0
    # No branch but the loop's: which zones are near changes from step to step.
    for zone in range(1, gain.size):
        best = max(best, gain[zone] if tank.near_m[row, column, zone] <= reach_m else 0.0)
    return best


@inlined
def nearest_listed(x: float, y: float, place: int, walls: Floats, lists: NDArray[np.int32]) -> int:
    """Return the nearest of the segments of a list, which starts at a place."""
    best2, near = math.inf, 0
    for k in range(lists[place]):
        s = lists[place + 1 + k]
        away2 = segment_distance2(x, y, walls, s)
        if away2 < best2:
            best2, near = away2, int(s)
    return near


@inlined
def nearest_wall(x: float, y: float, tank: Tank) -> tuple[float, float, float]:
    """Return the distance to the wall of a point inside, and the direction along it.

    Returns
    -------
    distance_m : float
    tau_x, tau_y : float
        Unit vector perpendicular to the line to the nearest point of the wall, which is at its
        left, for a point on the wall as well.
    """
    near = tank.nearest[int((y - tank.y0_m) * tank.per_m), int((x - tank.x0_m) * tank.per_m)]
    if near < 0:
        near = nearest_listed(x, y, -near - 1, tank.walls, tank.lists)
    along_x, along_y = tank.walls[near, 2], tank.walls[near, 3]
    px, py = x - tank.walls[near, 0], y - tank.walls[near, 1]
    t = min(1.0, max(0.0, (px * along_x + py * along_y) * tank.walls[near, 4]))
    ex, ey = px - t * along_x, py - t * along_y
    distance = math.sqrt(ex * ex + ey * ey)
    if distance < ON_WALL_M:
        tau_x, tau_y = along_x / tank.walls[near, 5], along_y / tank.walls[near, 5]
        if zone_of(x - _ASIDE_M * tau_y, y + _ASIDE_M * tau_x, tank) > 0:
            tau_x, tau_y = -tau_x, -tau_y
    else:
        tau_x, tau_y = -ey / distance, ex / distance
    return distance, tau_x, tau_y

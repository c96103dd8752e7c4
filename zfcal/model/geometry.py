"""The arena in arrays for the kernels: exact tests, and a grid that spares them.

The grid changes nothing: a cell is marked with a zone only where the distance
from its centre to every border of a zone exceeds its half diagonal, so that the
whole cell lies in that zone (distances are 1-Lipschitz); elsewhere the exact
test runs. Likewise a cell lists each piece of wall that is the nearest one for
any of its points.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from zfcal.arena import Arena
from zfcal.model.compiled import inlined, kernel
from zfcal.model.rooms import Rooms, make_rooms

_CELLS_LONG_SIDE = 480
_ASK = 255
"""Mark of a cell that a border crosses."""

_BLOCK = 16
_ON_WALL_M = 1e-9
_SINGLE_M = 1e-6
"""More than what a length in a tank loses in single precision."""

_TOUCH_M = 1e-12
"""A point so near to the wall is on it, hence inside; rounding is far smaller."""

Floats = NDArray[np.float64]


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
    clear_m : ndarray of float32, shape (row, column)
        From no point of the cell is a border of a zone nearer than this.
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
    clear_m: NDArray[np.float32]
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
def _crosses(x: float, y: float, pieces: Floats, s: int) -> bool:
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
        if _crosses(x, y, tank.walls, s):
            inside = not inside
        nearest2 = min(nearest2, segment_distance2(x, y, tank.walls, s))
    on_wall = nearest2 <= _TOUCH_M**2
    if not inside and not on_wall:
        return 0
    for p in range(tank.polygon_zone.size):
        within = False
        for e in range(tank.edge_of[p], tank.edge_of[p + 1]):
            if _crosses(x, y, tank.edges, e):
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
        zone = int(tank.cells[int(v), int(u)])
        if zone == _ASK:
            zone = zone_exact(x, y, tank)
    return zone


@inlined
def clearance(x: float, y: float, tank: Tank) -> float:
    """Return a distance within which all points are in the zone of a point inside, in metres."""
    return tank.clear_m[int((y - tank.y0_m) * tank.per_m), int((x - tank.x0_m) * tank.per_m)]


@inlined
def nearest_wall(x: float, y: float, tank: Tank) -> tuple[float, float, float]:
    """Return the distance to the wall of a point inside, and the direction along it.

    Returns
    -------
    distance_m : float
    tau_x, tau_y : float
        Unit vector perpendicular to the line to the nearest point of the wall;
        the segment's own direction for a point on the wall.
    """
    near = tank.nearest[int((y - tank.y0_m) * tank.per_m), int((x - tank.x0_m) * tank.per_m)]
    if near < 0:
        near = _nearest_listed(x, y, -near - 1, tank)
    along_x, along_y = tank.walls[near, 2], tank.walls[near, 3]
    px, py = x - tank.walls[near, 0], y - tank.walls[near, 1]
    t = min(1.0, max(0.0, (px * along_x + py * along_y) * tank.walls[near, 4]))
    ex, ey = px - t * along_x, py - t * along_y
    distance = math.sqrt(ex * ex + ey * ey)
    if distance < _ON_WALL_M:
        tau_x, tau_y = along_x / tank.walls[near, 5], along_y / tank.walls[near, 5]
    else:
        tau_x, tau_y = -ey / distance, ex / distance
    return distance, tau_x, tau_y


@kernel
def _nearest_listed(x: float, y: float, place: int, tank: Tank) -> int:
    best2, near = math.inf, 0
    for k in range(tank.lists[place]):
        s = tank.lists[place + 1 + k]
        away2 = segment_distance2(x, y, tank.walls, s)
        if away2 < best2:
            best2, near = away2, s
    return near


@kernel
def _among(x: float, y: float, pieces: Floats, reach_m: float, chosen: NDArray[np.int32]) -> int:
    """Write which pieces are the nearest one for a point within reach, return how many.

    A piece that is nearest somewhere within ``reach_m`` of the centre is at most
    twice that farther from the centre than the piece nearest to the centre.
    """
    nearest2 = math.inf
    for s in range(pieces.shape[0]):
        nearest2 = min(nearest2, segment_distance2(x, y, pieces, s))
    limit2 = (math.sqrt(nearest2) + 2.0 * reach_m) ** 2
    found = 0
    for s in range(pieces.shape[0]):
        if segment_distance2(x, y, pieces, s) <= limit2:
            chosen[found] = s
            found += 1
    return found


@kernel
def _least(x: float, y: float, pieces: Floats, chosen: NDArray[np.int32], found: int) -> float:
    """Return the distance to the nearest of the chosen pieces."""
    nearest2 = math.inf
    for k in range(found):
        nearest2 = min(nearest2, segment_distance2(x, y, pieces, chosen[k]))
    return math.sqrt(nearest2)


@kernel
def _mark(
    row: int,
    column: int,
    border_m: float,
    half_diagonal_m: float,
    xy: tuple[float, float],
    tank: Tank,
) -> None:
    """Mark a cell with its zone if no border can cross it."""
    if not border_m > half_diagonal_m:
        return
    tank.clear_m[row, column] = border_m - half_diagonal_m - _SINGLE_M
    # Two marked cells side by side share an edge, so they share the zone.
    left = tank.cells[row, column - 1] if column > 0 else _ASK
    tank.cells[row, column] = left if left != _ASK else zone_exact(xy[0], xy[1], tank)


@kernel
def _fill(tank: Tank, half_diagonal_m: float) -> NDArray[np.int32]:
    """Write the grid's cells and return the lists of segments.

    Blocks of cells first find the few pieces that can matter to them.
    """
    rows, columns = tank.cells.shape
    lists = np.empty(1024, dtype=np.int32)
    size = 0
    walls_near = np.empty(tank.walls.shape[0], dtype=np.int32)
    edges_near = np.empty(tank.edges.shape[0], dtype=np.int32)
    rest = tank.near_zone > 0 or tank.far_zone > 0
    for block_row in range(0, rows, _BLOCK):
        for block_column in range(0, columns, _BLOCK):
            x = tank.x0_m + (block_column + 0.5 * _BLOCK) / tank.per_m
            y = tank.y0_m + (block_row + 0.5 * _BLOCK) / tank.per_m
            n_walls = _among(x, y, tank.walls, _BLOCK * half_diagonal_m, walls_near)
            n_edges = _among(x, y, tank.edges, _BLOCK * half_diagonal_m, edges_near)
            for row in range(block_row, min(rows, block_row + _BLOCK)):
                for column in range(block_column, min(columns, block_column + _BLOCK)):
                    x = tank.x0_m + (column + 0.5) / tank.per_m
                    y = tank.y0_m + (row + 0.5) / tank.per_m
                    near = _least(x, y, tank.walls, walls_near, n_walls)
                    border = min(near, _least(x, y, tank.edges, edges_near, n_edges))
                    if rest:
                        border = min(border, abs(near - tank.wall_zone_m))
                    _mark(row, column, border, half_diagonal_m, (x, y), tank)
                    if size + n_walls + 1 > lists.size:
                        grown = np.empty(2 * lists.size + n_walls + 1, dtype=np.int32)
                        grown[:size] = lists[:size]
                        lists = grown
                    limit2 = (near + 2.0 * half_diagonal_m) ** 2
                    found = 0
                    for k in range(n_walls):
                        if segment_distance2(x, y, tank.walls, walls_near[k]) <= limit2:
                            lists[size + 1 + found] = walls_near[k]
                            found += 1
                    tank.nearest[row, column] = lists[size + 1] if found == 1 else -(size + 1)
                    if found > 1:
                        lists[size] = found
                        size += found + 1
    return lists[:size].copy()


def make_tank(arena: Arena, *, cells: int = _CELLS_LONG_SIDE) -> Tank:
    """Return the arrays of an arena, with the grid filled.

    Parameters
    ----------
    cells
        Along the longer side of the tank. More are faster and larger; the
        answers are the same.
    """
    edges, edge_of, polygon_zone = _polygons(arena)
    rest = {zone.near_wall: i for i, zone in enumerate(arena.zones, 1) if zone.polygon is None}
    x0, y0, x1, y1 = arena.outline.bounds
    per_m = cells / (arena.extent_m * (1 + 1e-9))
    shape = (int((y1 - y0) * per_m) + 1, int((x1 - x0) * per_m) + 1)
    bins = arena.bins
    tank = Tank(
        walls=_pieces(np.concatenate([_sides(ring) for ring in arena.rings_m])),
        edges=edges,
        edge_of=edge_of,
        polygon_zone=polygon_zone,
        near_zone=rest.get(True, 0),
        far_zone=rest.get(False, 0),
        wall_zone_m=float(arena.wall_zone_m),
        follows=np.array([False, *(zone.follows_walls for zone in arena.zones)]),
        x0_m=x0,
        y0_m=y0,
        per_m=per_m,
        cells=np.full(shape, _ASK, dtype=np.uint8),
        clear_m=np.zeros(shape, dtype=np.float32),
        nearest=np.zeros(shape, dtype=np.int32),
        lists=np.empty(0, dtype=np.int32),
        distance_low_m=float(bins.distance_m[0]),
        distance_per_m=10 / (bins.distance_m[1] - bins.distance_m[0]),
        wall_low_m=float(bins.wall_distance_m[0]),
        wall_per_m=10 / (bins.wall_distance_m[1] - bins.wall_distance_m[0]),
        speed_low=float(bins.speed_m_s[0]),
        speed_high=float(bins.speed_m_s[1]),
        rooms=make_rooms(arena, shape, (x0, y0), per_m),
    )
    half_diagonal_m = math.sqrt(0.5) / per_m * (1 + 1e-9) + 1e-12
    return tank._replace(lists=_fill(tank, half_diagonal_m))


def _pieces(segments: Floats) -> Floats:
    """Return segments (start, end) as the rows of `Tank.walls`."""
    along = segments[:, 2:] - segments[:, :2]
    squared = (along**2).sum(axis=1)
    return np.column_stack(
        [segments[:, :2], along, 1.0 / squared, np.sqrt(squared), segments[:, 3]]
    )


def _polygons(arena: Arena) -> tuple[Floats, NDArray[np.int64], NDArray[np.int64]]:
    edges: list[Floats] = []
    starts, zones = [0], []
    for number, zone in enumerate(arena.zones, start=1):
        if zone.polygon is None:
            continue
        edges += [_sides(ring) for ring in _rings(zone.polygon)]
        starts.append(sum(map(len, edges)))
        zones.append(number)
    joined = np.concatenate(edges) if edges else np.empty((0, 4))
    return _pieces(joined), np.array(starts), np.array(zones, dtype=np.int64)


def _rings(polygon: shapely.Polygon | shapely.MultiPolygon) -> list[Floats]:
    parts = shapely.get_parts(polygon)
    lines = [ring for part in parts for ring in (part.exterior, *part.interiors)]
    return [np.asarray(ring.coords, dtype=np.float64)[:, :2] for ring in lines]


def _sides(ring: Floats) -> Floats:
    """Return the pieces of a closed ring, shape (side, 4); repeated corners make none."""
    sides = np.hstack([ring[:-1], ring[1:]])
    return sides[(sides[:, :2] != sides[:, 2:]).any(axis=1)]

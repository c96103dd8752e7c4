"""From an arena to the arrays of the kernels.

The grid changes nothing: a cell is marked with a zone only where the distance
from its centre to every border of a zone exceeds its half diagonal, so that the
whole cell lies in that zone (distances are 1-Lipschitz); elsewhere the exact
test runs. Likewise a cell lists each piece of wall that is the nearest one for
any of its points, and the zones that it may hold are those whose inside or border
is within the half diagonal of its centre. Cells that a border crosses are cut into
parts, marked by the same rule.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
import shapely
from numpy.typing import NDArray

from zfcal.arena import Arena
from zfcal.arrays import Floats
from zfcal.model.kernels.compiled import kernel
from zfcal.model.kernels.geometry import ASK, FINE, Tank, crosses, segment_distance2, zone_exact
from zfcal.model.kernels.rooms import make_rooms

_CELLS_LONG_SIDE = 480
_BLOCK = 16
_SINGLE_M = 1e-6
"""More than what a length in a tank loses in single precision."""
_ROUNDING_M = 1e-12
"""More than what a place in a tank loses where it is looked up in parts of cells."""


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
    left = tank.cells[row, column - 1] if column > 0 else ASK
    tank.cells[row, column] = left if left != ASK else zone_exact(xy[0], xy[1], tank)


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


@kernel
def _may_hold(zone: int, x: float, y: float, half_diagonal_m: float, tank: Tank) -> bool:
    """Tell whether a cell that a border crosses may hold a point of a zone.

    Where polygons leave cracks, which go to the nearest zone, it may hold any.
    """
    if tank.near_zone == 0 or tank.far_zone == 0:
        return True
    if zone in {tank.near_zone, tank.far_zone}:
        nearest2 = math.inf
        for s in range(tank.walls.shape[0]):
            nearest2 = min(nearest2, segment_distance2(x, y, tank.walls, s))
        beyond_m = math.sqrt(nearest2) - tank.wall_zone_m
        return (
            beyond_m <= half_diagonal_m if zone == tank.near_zone else -beyond_m <= half_diagonal_m
        )
    for p in range(tank.polygon_zone.size):
        within = False
        for e in range(tank.edge_of[p], tank.edge_of[p + 1]):
            if segment_distance2(x, y, tank.edges, e) <= half_diagonal_m**2:
                within = tank.polygon_zone[p] == zone
                break
            if crosses(x, y, tank.edges, e):
                within = not within
        if within and tank.polygon_zone[p] == zone:
            return True
    return False


@kernel
def _find_near(tank: Tank, half_diagonal_m: float) -> None:
    """Write how far it is at least from each cell to each zone.

    The distance between the centres of two cells, less two half diagonals. Along
    columns first, then over the columns beside, until none can be nearer.
    """
    rows, columns = tank.cells.shape
    far = rows + columns
    down = np.empty((rows, columns), dtype=np.int64)
    for zone in range(1, tank.near_m.shape[2]):
        for column in range(columns):
            _look_along(zone, column, half_diagonal_m, tank, down)
        for row in range(rows):
            for column in range(columns):
                best2 = far * far
                for away in range(columns):
                    if away * away >= best2:
                        break
                    if column >= away:
                        best2 = min(best2, away * away + down[row, column - away] ** 2)
                    if column + away < columns:
                        best2 = min(best2, away * away + down[row, column + away] ** 2)
                near_m = math.sqrt(best2) / tank.per_m - 2.0 * half_diagonal_m - _SINGLE_M
                tank.near_m[row, column, zone] = max(0.0, near_m)


@kernel
def _look_along(
    zone: int, column: int, half_diagonal_m: float, tank: Tank, down: NDArray[np.int64]
) -> None:
    """Write how many cells up or down a column it is to one that may hold a zone."""
    rows, columns = tank.cells.shape
    for row in range(rows):
        mark = tank.cells[row, column]
        holds = mark == zone
        if mark == ASK:
            x = tank.x0_m + (column + 0.5) / tank.per_m
            y = tank.y0_m + (row + 0.5) / tank.per_m
            holds = _may_hold(zone, x, y, half_diagonal_m, tank)
        down[row, column] = 0 if holds else rows + columns
        if not holds and row > 0:
            down[row, column] = min(down[row, column], down[row - 1, column] + 1)
    for row in range(rows - 2, -1, -1):
        down[row, column] = min(down[row, column], down[row + 1, column] + 1)


@kernel
def _fill_fine(tank: Tank, half_diagonal_m: float) -> NDArray[np.uint8]:
    """Write where each crossed cell's parts start, and return their zones.

    As cells are marked, a part is where no border can cross it.
    """
    rows, columns = tank.cells.shape
    found = 0
    for row in range(rows):
        for column in range(columns):
            tank.fine_at[row, column] = FINE * FINE * found
            found += tank.cells[row, column] == ASK
    fine = np.full(FINE * FINE * found, ASK, dtype=np.uint8)
    walls_near = np.empty(tank.walls.shape[0], dtype=np.int32)
    edges_near = np.empty(tank.edges.shape[0], dtype=np.int32)
    rest = tank.near_zone > 0 or tank.far_zone > 0
    for row in range(rows):
        for column in range(columns):
            if tank.cells[row, column] != ASK:
                continue
            x, y = tank.x0_m + (column + 0.5) / tank.per_m, tank.y0_m + (row + 0.5) / tank.per_m
            n_walls = _among(x, y, tank.walls, half_diagonal_m, walls_near)
            n_edges = _among(x, y, tank.edges, half_diagonal_m, edges_near)
            for part in range(FINE * FINE):
                x = tank.x0_m + (column + (part % FINE + 0.5) / FINE) / tank.per_m
                y = tank.y0_m + (row + (part // FINE + 0.5) / FINE) / tank.per_m
                near = _least(x, y, tank.walls, walls_near, n_walls)
                border = min(near, _least(x, y, tank.edges, edges_near, n_edges))
                if rest:
                    border = min(border, abs(near - tank.wall_zone_m))
                if border > half_diagonal_m / FINE + _ROUNDING_M:
                    at = tank.fine_at[row, column] + part
                    left = fine[at - 1] if part % FINE > 0 else ASK
                    fine[at] = left if left != ASK else zone_exact(x, y, tank)
    return fine


def tank_of(arena: Arena) -> Tank:
    """Return the kernels' arrays of an arena, made once per process."""
    return _tank(arena.outline.wkb, arena)


@lru_cache(maxsize=8)
def _tank(_outline: bytes, arena: Arena) -> Tank:
    return make_tank(arena)


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
        cells=np.full(shape, ASK, dtype=np.uint8),
        fine=np.empty(0, dtype=np.uint8),
        fine_at=np.zeros(shape, dtype=np.int32),
        clear_m=np.zeros(shape, dtype=np.float32),
        near_m=np.full((*shape, len(arena.zones) + 1), np.inf, dtype=np.float32),
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
    tank = tank._replace(lists=_fill(tank, half_diagonal_m))
    _find_near(tank, half_diagonal_m)
    return tank._replace(fine=_fill_fine(tank, half_diagonal_m))


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

"""Rooms of an arena: what falls apart when a zone is taken out, and the mouths between.

A corridor that joins two rooms is such a zone. An effect that asks whether another
agent has just left the room needs to know of rooms; the base model does not.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from zfcal.arena import Arena
from zfcal.arrays import Floats

_LEAST_SHARE = 0.05
"""A part with less of the tank's area is a corner, not a room."""

_WIDEST_MOUTH = 0.3
"""A part that shares more of its border than this with the zone is a belt of the tank."""

_MERGE_M = 1e-6

_SQUARE = 16
"""Cells of the grid along a side of those squares that are looked at as a whole."""


class Rooms(NamedTuple):
    """Rooms for the kernels.

    Attributes
    ----------
    cells : ndarray of uint8, shape (row, column)
        The nearest room, counted from one, on the grid of the tank; all zero in an
        arena without rooms.
    mouths : ndarray, shape (mouth, 3)
        Number of the room, and x, y of the middle of the opening, in metres.
    exit_zone
        Id of the zone between the rooms; 0 in an arena without.
    """

    cells: NDArray[np.uint8]
    mouths: Floats
    exit_zone: int


def find_rooms(arena: Arena) -> tuple[int, tuple[shapely.Polygon, ...]]:
    """Return the id of the zone between the rooms and the rooms; 0 and none without.

    Parameters
    ----------
    arena
        Its first zone whose absence leaves two or more parts, each with a twentieth
        of the area or more and joined to the zone by less than three tenths of its
        border, is the zone between.
    """
    for number, zone in enumerate(arena.zones, start=1):
        if zone.polygon is None:
            continue
        rest = arena.outline.difference(zone.polygon.buffer(_MERGE_M))
        parts = [
            part
            for part in shapely.get_parts(rest)
            if part.area > _LEAST_SHARE * arena.outline.area
            and shapely.length(_opening(part, zone.polygon)) < _WIDEST_MOUTH * part.exterior.length
        ]
        if len(parts) > 1:
            return number, tuple(parts)
    return 0, ()


def open_zone(arena: Arena) -> int:
    """Return the id of the last zone that neither follows walls nor joins rooms; 0 without one.

    Parameters
    ----------
    arena
        Of the tank.
    """
    between, _ = find_rooms(arena)
    zones = enumerate(arena.zones, start=1)
    open_ = [k for k, zone in zones if not zone.follows_walls and k != between]
    return open_[-1] if open_ else 0


def make_rooms(
    arena: Arena, shape: tuple[int, int], origin_m: tuple[float, float], per_m: float
) -> Rooms:
    """Return the rooms on a grid.

    Parameters
    ----------
    shape
        Rows and columns.
    origin_m
        Corner of the first cell.
    per_m
        Cells in a metre.
    """
    exit_zone, parts = find_rooms(arena)
    if not exit_zone:
        cells = np.zeros(shape, dtype=np.uint8)
        return Rooms(cells=cells, mouths=np.zeros((0, 3)), exit_zone=0)
    cells = _nearest(parts, shape, origin_m, per_m)
    zone = arena.zones[exit_zone - 1].polygon
    mouths = [
        (number, *_middle(line))
        for number, part in enumerate(parts, start=1)
        for line in _lines(_opening(part, zone))
    ]
    return Rooms(cells=cells, mouths=np.array(mouths, dtype=np.float64), exit_zone=exit_zone)


def _nearest(
    parts: tuple[shapely.Polygon, ...],
    shape: tuple[int, int],
    origin_m: tuple[float, float],
    per_m: float,
) -> NDArray[np.uint8]:
    """Return the nearest part of each cell, counted from one.

    A square of cells has one answer where, seen from its middle, the nearest part leads by
    more than the square's diagonal: no distance changes faster than the place. Cell by cell
    it takes a third of a second at every start.
    """
    tall, wide = (-(-n // _SQUARE) for n in shape)
    rows, columns = (_SQUARE * (k.ravel() + 0.5) - 0.5 for k in np.indices((tall, wide)))
    middles = _middles(rows, columns, origin_m, per_m)
    distance_m = np.sort([shapely.distance(part, middles) for part in parts], axis=0)
    tree = shapely.STRtree(parts)
    clear = distance_m[1] - distance_m[0] > math.sqrt(2) * _SQUARE / per_m
    blocks = np.where(clear, tree.nearest(middles) + 1, 0).reshape(tall, wide).astype(np.uint8)
    cells = np.kron(blocks, np.ones((_SQUARE, _SQUARE), dtype=np.uint8))[: shape[0], : shape[1]]
    at = np.nonzero(cells == 0)
    cells[at] = tree.nearest(_middles(at[0], at[1], origin_m, per_m)) + 1
    return np.ascontiguousarray(cells)


def _middles(
    rows: NDArray[Any],
    columns: NDArray[Any],
    origin_m: tuple[float, float],
    per_m: float,
) -> NDArray[np.object_]:
    points: Any = shapely.points(
        origin_m[0] + (columns + 0.5) / per_m, origin_m[1] + (rows + 0.5) / per_m
    )
    return points


def _opening(
    part: shapely.Polygon, zone: shapely.Polygon | shapely.MultiPolygon | None
) -> shapely.Geometry:
    border = shapely.LineString(part.exterior.coords)
    return border.intersection(shapely.buffer(zone, 3 * _MERGE_M)) or shapely.Point()


def _lines(opening: shapely.Geometry) -> list[shapely.LineString]:
    merged = shapely.line_merge(opening)
    parts = shapely.get_parts(merged)
    return [
        line
        for line in parts
        if isinstance(line, shapely.LineString) and line.length > math.sqrt(_MERGE_M)
    ]


def _middle(line: shapely.LineString) -> tuple[float, float]:
    point = line.interpolate(0.5, normalized=True)
    return float(point.x), float(point.y)

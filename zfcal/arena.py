"""The tank as seen from above: its walls, its zones, and where a point lies.

An arena comes from a GeoJSON document in metres (`artifacts` reads the file).
Zone ids are 0 for void (outside) and 1, 2, ... in the arena's order.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from zfcal.arrays import Bools, Floats
from zfcal.errors import InputError

VOID = 0
_WALL_ZONE_M = 0.07
_WALL_TOLERANCE_M = 0.01
N_BINS = 10

_AREA_TOLERANCE = 1e-6
"""Share of the tank below which an overlap or a remainder is rounding."""

_ROOM_SHARE = 0.01
"""A piece of the tank of a smaller share is a crack between zones."""

_INSIDE_M = 1e-9
"""How far inside the wall a settled point is put."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Zone:
    """A part of the tank in which fish behave alike.

    Parameters
    ----------
    name
        Its name, unique in the arena.
    follows_walls
        Whether fish follow the wall there rather than their own heading.
    polygon
        Its area in metres, from the file; None for the zones that share what
        the others leave, by distance to the wall.
    near_wall
        For a zone without polygon: whether it is the part near the wall.
    """

    name: str
    follows_walls: bool
    polygon: shapely.Polygon | shapely.MultiPolygon | None = None
    near_wall: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Bins:
    """Ranges of the histograms, each of ten bins.

    Parameters
    ----------
    distance_m, wall_distance_m
        Range of distances between agents (D) and to the wall (W), in metres.
    speed_m_s
        Range of speeds (V), in metres per second.
    """

    distance_m: tuple[float, float] = (0.0, 0.22)
    wall_distance_m: tuple[float, float] = (0.0, 0.18)
    speed_m_s: tuple[float, float] = (0.0, 0.20)

    def __post_init__(self) -> None:
        for name in ("distance_m", "wall_distance_m", "speed_m_s"):
            low, high = getattr(self, name)
            if not 0 <= low < high < np.inf:
                raise InputError(f"Bin range {name} must be 0 <= low < high, got {low}, {high}.")


@dataclass(frozen=True, kw_only=True)
class Arena:
    """A tank with its zones.

    Parameters
    ----------
    name
        What people call it.
    outline
        The water's edge in metres; holes are walls.
    zones
        In the arena's order: zone ids count from 1.
    wall_zone_m
        Zones without a polygon: nearer than this to the wall is the near one.
    wall_tolerance_m
        A measured point up to this far outside counts as at the wall.
    bins
        Ranges of the histograms.
    """

    name: str
    outline: shapely.Polygon
    zones: tuple[Zone, ...]
    wall_zone_m: float = _WALL_ZONE_M
    wall_tolerance_m: float = _WALL_TOLERANCE_M
    bins: Bins = field(default_factory=Bins)

    @property
    def zone_names(self) -> tuple[str, ...]:
        """Names of the zones, in the arena's order."""
        return tuple(zone.name for zone in self.zones)

    @cached_property
    def rings_m(self) -> tuple[Floats, ...]:
        """The closed rings of the wall, the outer one first, each of shape (corner + 1, 2)."""
        rings = (self.outline.exterior, *self.outline.interiors)
        return tuple(np.asarray(ring.coords, dtype=np.float64)[:, :2] for ring in rings)

    @cached_property
    def segments_m(self) -> Floats:
        """The wall's straight pieces ``x0, y0, x1, y1``, shape (segment, 4)."""
        return np.concatenate([np.hstack([ring[:-1], ring[1:]]) for ring in self.rings_m])

    @property
    def extent_m(self) -> float:
        """The longer side of the bounding rectangle, in metres."""
        x0, y0, x1, y1 = self.outline.bounds
        return float(max(x1 - x0, y1 - y0))

    def wall_distance(self, xy_m: ArrayLike) -> Floats:
        """Return the distance to the nearest segment of the wall, inside or out.

        Parameters
        ----------
        xy_m : array_like, shape (..., 2)
            Positions in metres; NaN marks a lost agent.

        Returns
        -------
        ndarray, shape (...)
            Metres; NaN where the position is NaN.
        """
        xy = np.asarray(xy_m, dtype=np.float64)
        known = ~np.isnan(xy).any(axis=-1)
        distance = np.full(known.shape, np.nan)
        distance[known] = shapely.distance(self._walls, shapely.points(xy[known]))
        return distance

    def zone_of(self, xy_m: ArrayLike) -> NDArray[np.int8]:
        """Return the zone id of each position; 0 outside and where the position is NaN.

        Parameters
        ----------
        xy_m : array_like, shape (..., 2)
            Positions in metres.

        Returns
        -------
        ndarray of int8, shape (...)
        """
        xy = np.asarray(xy_m, dtype=np.float64)
        known = ~np.isnan(xy).any(axis=-1)
        ids = np.zeros(known.shape, dtype=np.int8)
        ids[known] = self._zones_of(np.asarray(shapely.points(xy[known]), dtype=object))
        return ids

    def _zones_of(self, points: NDArray[np.object_]) -> NDArray[np.int8]:
        inside = shapely.covers(self.outline, points)
        ids = np.zeros(points.shape, dtype=np.int8)
        near = shapely.distance(self._walls, points) < self.wall_zone_m
        # From the last to the first: where polygons touch, the first one has the edge.
        for number, zone in reversed(list(enumerate(self.zones, start=1))):
            if zone.polygon is None:
                ids[inside & (near == zone.near_wall) & (ids == VOID)] = number
        for number, zone in reversed(list(enumerate(self.zones, start=1))):
            if zone.polygon is not None:
                ids[inside & shapely.covers(zone.polygon, points)] = number
        return self._fill_cracks(ids, inside, points)

    def _fill_cracks(
        self, ids: NDArray[np.int8], inside: Bools, points: NDArray[np.object_]
    ) -> NDArray[np.int8]:
        """Give points between two zones that should touch to the nearest one.

        Such as a crack between two polygons, or the middle of a tank of which
        hardly a point is farther than ``wall_zone_m`` from the wall.
        """
        lost = inside & (ids == VOID)
        if lost.any():
            near_m = np.abs(shapely.distance(self._walls, points[lost]) - self.wall_zone_m)
            away_m = [
                near_m if zone.polygon is None else shapely.distance(zone.polygon, points[lost])
                for zone in self.zones
            ]
            ids[lost] = np.argmin(away_m, axis=0) + 1
        return ids

    @cached_property
    def rooms(self) -> tuple[shapely.Polygon, ...]:
        """The rooms: the pieces into which the zones with a polygon cut what they leave.

        So a tank of two rooms with a corridor has two, and one without such zones has one.
        """
        taken = [zone.polygon for zone in self.zones if zone.polygon is not None]
        rest = shapely.difference(self.outline, shapely.union_all(taken))
        pieces = [piece for piece in shapely.get_parts(rest) if piece.geom_type == "Polygon"]
        least_m2 = _ROOM_SHARE * self.outline.area
        return tuple(piece for piece in pieces if shapely.area(piece) > least_m2)

    def room_of(self, xy_m: Floats) -> NDArray[np.int64]:
        """Return the room of each position, from 1; 0 in none, and where the position is NaN.

        Parameters
        ----------
        xy_m : ndarray, shape (..., 2)
            Positions in metres.
        """
        room = np.zeros(xy_m.shape[:-1], dtype=np.int64)
        for number, piece in enumerate(self.rooms, start=1):
            shapely.prepare(piece)
            room[shapely.intersects_xy(piece, xy_m[..., 0], xy_m[..., 1])] = number
        return room

    def settle(self, xy_m: ArrayLike) -> tuple[Floats, int]:
        """Take points a little outside at the nearest inside point.

        Parameters
        ----------
        xy_m : array_like, shape (..., 2)
            Measured positions in metres.

        Returns
        -------
        xy_m : ndarray, shape (..., 2)
            The same, with points up to ``wall_tolerance_m`` outside moved onto
            the wall; points farther out are left where they are (void).
        moved : int
            How many were moved.
        """
        settled = np.array(xy_m, dtype=np.float64)
        shapely.prepare(self.outline)
        inside = shapely.intersects_xy(self.outline, settled[..., 0], settled[..., 1])
        outside = ~inside & ~np.isnan(settled).any(axis=-1)
        away = np.zeros(outside.shape)
        away[outside] = shapely.distance(self.outline, shapely.points(settled[outside]))
        rows = (away > 0) & (away <= self.wall_tolerance_m)
        if rows.any():
            # The nearest point of the edge itself can round to just outside.
            inner = shapely.buffer(self.outline, -_INSIDE_M, join_style="mitre")
            lines = shapely.shortest_line(inner, shapely.points(settled[rows]))
            onto = shapely.get_point(lines, 0)
            settled[rows] = np.stack([shapely.get_x(onto), shapely.get_y(onto)], axis=-1)
        return settled, int(rows.sum())

    @cached_property
    def _walls(self) -> shapely.MultiLineString:
        walls = shapely.MultiLineString([ring.tolist() for ring in self.rings_m])
        shapely.prepare(walls)
        shapely.prepare(self.outline)
        for zone in self.zones:
            if zone.polygon is not None:
                shapely.prepare(zone.polygon)
        return walls


def make_arena(  # noqa: PLR0913 - one keyword for each thing that an arena file may state
    *,
    name: str,
    outline: shapely.Polygon,
    zones: tuple[Zone, ...] = (),
    wall_zone_m: float = _WALL_ZONE_M,
    wall_tolerance_m: float = _WALL_TOLERANCE_M,
    bins: Bins | None = None,
) -> Arena:
    """Check an outline and its zones and return the arena.

    What the given zones leave of the tank is shared by ``walls`` (nearer than
    ``wall_zone_m`` to the wall) and ``centre`` (the rest), which come last.

    Raises
    ------
    InputError
        The outline is no simple polygon, or a zone is empty, lies outside,
        overlaps another or has another's name.
    """
    if not (isinstance(outline, shapely.Polygon) and outline.is_valid and outline.area > 0):
        reason = shapely.is_valid_reason(outline)
        raise InputError(
            f"Arena {name!r}: the outline is not a simple polygon ({reason}).",
            hint="List its corners in order, once round, without crossing.",
        )
    for key, value in (("wall_zone_m", wall_zone_m), ("wall_tolerance_m", wall_tolerance_m)):
        if not 0 <= value < np.inf:
            raise InputError(f"Arena {name!r}: {key} must be a length in metres, got {value!r}.")
    for index, zone in enumerate(zones):
        _check_zone(name, outline, zone, zones[:index])
    return Arena(
        name=name,
        outline=outline,
        zones=zones + _remainder(outline, zones, wall_zone_m),
        wall_zone_m=wall_zone_m,
        wall_tolerance_m=wall_tolerance_m,
        bins=bins or Bins(),
    )


def _check_zone(arena: str, outline: shapely.Polygon, zone: Zone, others: tuple[Zone, ...]) -> None:
    where = f"Arena {arena!r}, zone {zone.name!r}"
    if zone.name in {other.name for other in others} or zone.name == "void":
        raise InputError(f"{where}: the name is taken.", hint="Each zone needs its own name.")
    if zone.polygon is None or zone.polygon.is_empty or not zone.polygon.is_valid:
        raise InputError(f"{where}: not a simple polygon.")
    slack_m2 = _AREA_TOLERANCE * outline.area
    outside_m2 = float(shapely.area(shapely.difference(zone.polygon, outline)))
    if outside_m2 > slack_m2:
        raise InputError(
            f"{where}: {outside_m2:.6f} m2 of it lie outside the outline.",
            hint="Coordinates are metres, x right, y up; zones must lie inside the outline.",
        )
    for other in others:
        overlap_m2 = float(shapely.area(shapely.intersection(zone.polygon, other.polygon)))
        if overlap_m2 > slack_m2:
            raise InputError(f"{where}: overlaps zone {other.name!r} by {overlap_m2:.6f} m2.")


def _remainder(
    outline: shapely.Polygon, zones: tuple[Zone, ...], wall_zone_m: float
) -> tuple[Zone, ...]:
    rest = shapely.difference(outline, shapely.union_all([zone.polygon for zone in zones]))
    near = shapely.buffer(outline.boundary, wall_zone_m)
    parts = (
        (Zone(name="walls", follows_walls=True, near_wall=True), shapely.intersection(rest, near)),
        (Zone(name="centre", follows_walls=False), shapely.difference(rest, near)),
    )
    taken = {zone.name for zone in zones}
    made = tuple(
        zone for zone, area in parts if shapely.area(area) > _AREA_TOLERANCE * outline.area
    )
    for zone in made:
        if zone.name in taken:
            raise InputError(
                f"The zones leave a part of the tank uncovered, and {zone.name!r} is taken.",
                hint="Cover the whole outline, or leave both 'walls' and 'centre' to wall_zone_m.",
            )
    return made

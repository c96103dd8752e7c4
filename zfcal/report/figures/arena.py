"""The tank as a picture: walls, zones, metres, and how far the wall is."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import shapely
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.patches import PathPatch
from matplotlib.path import Path as Outline
from matplotlib.ticker import MaxNLocator
from shapely.geometry.base import BaseGeometry

from zfcal.arena import Arena, Zone
from zfcal.arrays import Floats
from zfcal.report.figures import theme
from zfcal.report.figures.panels import Entry, Panel, Picture, write_picture

_Field = tuple[Floats, Floats, Floats]

_WIDTH_IN = 5.4
_TALLEST_IN = 6.4
_GRID_POINTS = 240
_NICE_M = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0)
_LABEL_SHARE = 0.25
"""A part of a zone that is smaller than this share of its largest part gets no label."""

_OUTSIDE_SHARE = 2 / 3
"""A label that would lie outside its zone by more than this share is left out."""


def draw_arena(arena: Arena, path: Path) -> None:
    """Write the tank as a PNG: walls, coloured and named zones, metre axes and a scale.

    Parameters
    ----------
    arena
        Any arena: rooms, a disc, a ring, holes.
    path
        Where the PNG goes, whatever its ending; its folder must be there.
    """
    write_picture(arena_picture(arena), path)


def arena_picture(arena: Arena, *, width_in: float = _WIDTH_IN) -> Picture:
    """Return the tank as a picture of one panel, with the zones as its key."""
    return Picture(
        name="arena",
        title=f"Arena: {arena.name}",
        short="Arena",
        panels=(_panel(arena, width_in),),
        key=(*zone_entries(arena), _contour_entry(arena)),
        columns=1,
    )


def _panel(arena: Arena, width_in: float) -> Panel:
    x0, y0, x1, y1 = arena.outline.bounds
    names = ", ".join(arena.zone_names)
    field = _distance_field(arena)
    return Panel(
        title=f"{x1 - x0:.2f} by {y1 - y0:.2f} m",
        alt=f"Plan of the arena {arena.name}, {x1 - x0:.2f} by {y1 - y0:.2f} m, zones {names}.",
        draw=lambda axes: _draw(axes, arena, field),
        size_in=arena_size_in(arena, width_in),
    )


def arena_size_in(arena: Arena, width_in: float) -> tuple[float, float]:
    """Return the size of a panel that shows the tank, in inches."""
    x0, y0, x1, y1 = arena.outline.bounds
    height_in = (width_in - 0.9) * (y1 - y0) / (x1 - x0) + 1.1
    return width_in, min(height_in, _TALLEST_IN)


def zone_entries(arena: Arena) -> tuple[Entry, ...]:
    """Return a key entry per zone: its colour, share of the tank and whether walls guide it."""
    colours = theme.zone_colours(arena.zone_names)
    whole_m2 = arena.outline.area
    shares = {name: area.area / whole_m2 for name, area in zone_areas(arena).items()}
    return tuple(
        Entry(
            label=f"{zone.name}: {100 * shares[zone.name]:.0f} % of the area"
            + (", follows walls" if zone.follows_walls else ""),
            colour=colours[zone.name],
            mark="bar",
        )
        for zone in arena.zones
    )


def _contour_entry(arena: Arena) -> Entry:
    label = f"distance to the nearest wall, every {contour_step_m(arena):g} m"
    return Entry(label=label, colour=theme.MUTED, mark="dot")


def zone_areas(arena: Arena) -> dict[str, BaseGeometry]:
    """Return the area of each zone in metres, in the arena's order.

    Zones without a polygon share what the others leave: nearer to the wall
    than ``wall_zone_m``, and the rest.
    """
    given = [zone.polygon for zone in arena.zones if zone.polygon is not None]
    rest = shapely.difference(arena.outline, shapely.union_all(given))
    near = shapely.buffer(arena.outline.boundary, arena.wall_zone_m)
    return {zone.name: _area(zone, rest, near) for zone in arena.zones}


def _area(zone: Zone, rest: BaseGeometry, near: BaseGeometry) -> BaseGeometry:
    if zone.polygon is not None:
        return zone.polygon
    return shapely.intersection(rest, near) if zone.near_wall else shapely.difference(rest, near)


def contour_step_m(arena: Arena) -> float:
    """Return a round distance, in metres, that puts two to five contours into the tank."""
    x0, y0, x1, y1 = arena.outline.bounds
    deepest = shapely.maximum_inscribed_circle(arena.outline, tolerance=(x1 - x0 + y1 - y0) / 500)
    depth_m = float(shapely.length(deepest))
    return next((step for step in _NICE_M if depth_m / step <= 5.5), _NICE_M[-1])


def paint_walls(axes: Axes, arena: Arena, *, water: str = theme.GROUND) -> None:
    """Draw the walls on axes in metres, with equal scales and a margin."""
    axes.add_patch(
        PathPatch(_outline(arena.outline), facecolor=water, edgecolor="none", zorder=0.5)
    )
    axes.add_patch(
        PathPatch(_outline(arena.outline), facecolor="none", edgecolor=theme.INK, lw=1.6, zorder=4)
    )
    x0, y0, x1, y1 = arena.outline.bounds
    margin = 0.04 * arena.extent_m
    axes.set(xlim=(x0 - margin, x1 + margin), ylim=(y0 - margin, y1 + margin), aspect="equal")
    axes.set(xlabel="x (m)", ylabel="y (m)")
    for axis, length_m in ((axes.xaxis, x1 - x0), (axes.yaxis, y1 - y0)):
        steps = min(5, theme.letters_across(axes) // 7) * length_m / arena.extent_m
        axis.set_major_locator(MaxNLocator(max(1, round(steps))))


def paint_zones(axes: Axes, arena: Arena, *, alpha: float) -> None:
    """Fill each zone with its colour."""
    colours = theme.zone_colours(arena.zone_names)
    for name, area in zone_areas(arena).items():
        for part in _polygons(area):
            axes.add_patch(
                PathPatch(
                    _outline(part),
                    facecolor=colours[name],
                    edgecolor=colours[name],
                    alpha=alpha,
                    lw=0.8,
                    zorder=1,
                )
            )


def _draw(axes: Axes, arena: Arena, field: _Field) -> None:
    axes.grid(visible=False)
    paint_walls(axes, arena)
    paint_zones(axes, arena, alpha=0.35)
    _paint_distances(axes, arena, field)
    _paint_names(axes, arena, m_per_in=arena.extent_m / theme.width_in_of(axes))
    _paint_scale(axes, arena)


def _distance_field(arena: Arena) -> _Field:
    """Return x, y and the distance to the wall on a grid, NaN outside, in metres."""
    x0, y0, x1, y1 = arena.outline.bounds
    x_m, y_m = np.meshgrid(np.linspace(x0, x1, _GRID_POINTS), np.linspace(y0, y1, _GRID_POINTS))
    inside = shapely.contains_xy(arena.outline, x_m, y_m)
    distance_m = np.where(inside, arena.wall_distance(np.stack([x_m, y_m], axis=-1)), np.nan)
    return x_m, y_m, distance_m


def _paint_distances(axes: Axes, arena: Arena, field: _Field) -> None:
    x_m, y_m, distance_m = field
    step_m = contour_step_m(arena)
    levels = np.arange(step_m, np.nanmax(distance_m), step_m)
    if levels.size:
        axes.contour(
            x_m, y_m, distance_m, levels, colors=theme.MUTED, linewidths=0.7, linestyles="dotted"
        )


def _paint_names(axes: Axes, arena: Arena, *, m_per_in: float) -> None:
    """Write the zones' names into the tank where they do not cover each other; the key has all."""
    # What letters of 9 points take, bold.
    letter_m, line_m = 0.09 * m_per_in, 0.18 * m_per_in
    taken: list[shapely.Polygon] = []
    for name, part, (x_m, y_m) in _name_places(arena):
        half_m = letter_m * len(name) / 2
        box = shapely.box(x_m - half_m, y_m - line_m / 2, x_m + half_m, y_m + line_m / 2)
        elsewhere = shapely.difference(box, part).area > _OUTSIDE_SHARE * box.area
        if elsewhere or shapely.intersects(shapely.MultiPolygon(taken), box):
            continue
        taken.append(box)
        halo = patheffects.withStroke(linewidth=2.5, foreground=theme.GROUND)
        text = axes.text(x_m, y_m, name, ha="center", va="center", fontweight="bold", zorder=5)
        text.set_path_effects([halo])


def _name_places(
    arena: Arena,
) -> Iterator[tuple[str, shapely.Polygon, tuple[float, float]]]:
    for name, area in zone_areas(arena).items():
        parts = _polygons(area)
        largest_m2 = max(part.area for part in parts)
        for part in parts:
            if part.area >= _LABEL_SHARE * largest_m2:
                yield name, part, _roomiest_point(part)


def _roomiest_point(part: shapely.Polygon) -> tuple[float, float]:
    """Return where most room is around a point; of places as good, the one in the middle.

    A band round a room or a ring has many such places, and which of them a
    search finds first would depend on rounding: the upper one is taken.
    """
    x0, y0, x1, y1 = part.bounds
    slack_m = max(x1 - x0, y1 - y0) / 200
    room_m = float(shapely.length(shapely.maximum_inscribed_circle(part, tolerance=slack_m / 4)))
    core = shapely.buffer(part, -max(room_m - slack_m, 0.0))
    middle = shapely.centroid(part)
    above = shapely.Point(middle.x, middle.y + slack_m)
    nearest = shapely.get_point(shapely.shortest_line(core, above), 0)
    return float(shapely.get_x(nearest)), float(shapely.get_y(nearest))


def _paint_scale(axes: Axes, arena: Arena) -> None:
    """Draw a bar of a round length below the tank, where axes alone would have to be read."""
    x0, y0, x1, _ = arena.outline.bounds
    longest_m = min(0.3 * arena.extent_m, x1 - x0)
    length_m = max((step for step in _NICE_M if step <= longest_m), default=_NICE_M[0])
    margin_m = 0.04 * arena.extent_m
    axes.plot([x0, x0 + length_m], [y0 - 2 * margin_m] * 2, color=theme.INK, lw=3)
    axes.annotate(
        f"{length_m:g} m",
        (x0 + length_m, y0 - 2 * margin_m),
        xytext=(6, 0),
        textcoords="offset points",
        va="center",
    )
    axes.set_ylim(bottom=y0 - 3 * margin_m)


def _polygons(area: BaseGeometry) -> list[shapely.Polygon]:
    return [part for part in shapely.get_parts(area) if isinstance(part, shapely.Polygon)]


def _outline(polygon: shapely.Polygon) -> Outline:
    return Outline.make_compound_path(*map(Outline, _rings(polygon)))


def _rings(polygon: shapely.Polygon) -> Iterator[np.ndarray]:
    # Opposite senses, so that holes stay open whatever the order of the file.
    ordered = shapely.geometry.polygon.orient(polygon)
    for ring in (ordered.exterior, *ordered.interiors):
        yield np.asarray(ring.coords)[:, :2]

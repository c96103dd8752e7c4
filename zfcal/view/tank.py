"""The tank as the page draws it: walls and zones as rings of points, in metres."""

from __future__ import annotations

from typing import Any

import shapely
from shapely.geometry.base import BaseGeometry

from zfcal.arena import Arena
from zfcal.report.figures import theme
from zfcal.report.figures.arena import zone_areas

_DIGITS = 4
"""A tenth of a millimetre."""


def tank_of(arena: Arena) -> dict[str, Any]:
    """Return what the page needs to draw a tank.

    Returns
    -------
    dict
        ``name``; ``bounds`` (left, bottom, right, top, in metres); ``walls``, a list of closed
        rings ``[[x, y], ...]``; ``zones``, each with its ``name``, its ``colour`` on the page
        (the name of a variable), and its ``parts``: polygons, each a list of rings.
    """
    colours = theme.zone_colours(arena.zone_names)
    return {
        "name": arena.name,
        "bounds": [round(each, _DIGITS) for each in arena.outline.bounds],
        "walls": [_ring(ring) for ring in (arena.outline.exterior, *arena.outline.interiors)],
        "zones": [
            {"name": name, "colour": theme.THEME[colours[name]][0], "parts": _parts(area)}
            for name, area in zone_areas(arena).items()
        ],
    }


def _parts(area: BaseGeometry) -> list[list[list[list[float]]]]:
    polygons = (part for part in shapely.get_parts(area) if isinstance(part, shapely.Polygon))
    return [
        [_ring(ring) for ring in (polygon.exterior, *polygon.interiors)] for polygon in polygons
    ]


def _ring(ring: shapely.LinearRing) -> list[list[float]]:
    return [[round(x, _DIGITS), round(y, _DIGITS)] for x, y, *_ in ring.coords]

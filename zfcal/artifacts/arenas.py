"""Arenas as GeoJSON files in metres: read, found by name, and made for common tanks.

What an arena is and whether its zones fit stands in `zfcal.arena`.
"""

from __future__ import annotations

import math
from functools import cache
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any, TypeAlias

import shapely

from zfcal.arena import Arena, Bins, Zone, make_arena
from zfcal.artifacts.validation import check, nearest, read_json, written_by_people
from zfcal.errors import InputError

Document: TypeAlias = dict[str, Any]
_Ring: TypeAlias = list[list[float]]

_LARGEST_M = 20.0
_SMALLEST_M = 0.02
_N_CORNERS = 256
"""Corners of a circle: its chords then lie at most r (1 - cos(pi / 256)) = 7.5e-5 r inside it."""

_BIN_NAMES = {"D": "distance_m", "W": "wall_distance_m", "V": "speed_m_s"}

_LARGEST_BIN = {"D": 2 * _LARGEST_M, "W": 2 * _LARGEST_M, "V": 10.0}
"""No tank has a longer diagonal, and no fish is faster: all would lie in one bin."""


_BARE = ("Feature", "Polygon", "MultiPolygon", "LineString", "GeometryCollection")
"""What a drawing program may save instead of a collection."""


def read_arena(path: Path) -> Arena:
    """Read an arena from a GeoJSON file.

    Parameters
    ----------
    path
        A FeatureCollection of polygons in metres: one feature of role
        ``outline``, whose holes are walls, and any number of role ``zone``.
        A third coordinate is dropped.

    Raises
    ------
    InputError
        The file is missing, is not such a document, or its geometry is none of
        a tank: rings that do not close, zones outside or on top of each other,
        sizes that cannot be metres.
    """
    with written_by_people():
        document = read_json(path)
    _check_collection(document, path)
    check(document, "arena", path)
    try:
        return arena_of(document, name=path.stem)
    except InputError as error:
        raise InputError(f"{path}: {error}", hint=error.hint) from error


def _check_collection(document: Document, path: Path) -> None:
    """Say of a polygon by itself what is missing round it: the schema would name its keys."""
    if document.get("type") in _BARE:
        outline = '{"type": "Feature", "properties": {"role": "outline"}, "geometry": ...}'
        raise InputError(
            f"{path}: is a GeoJSON {document['type']}, expected a FeatureCollection.",
            hint='Put it in one: {"type": "FeatureCollection", "features": ['
            f"{outline}]}}, the tank's polygon as the geometry.",
        )


def arena_of(document: Document, *, name: str = "arena") -> Arena:
    """Return the arena of a GeoJSON document that fits the schema.

    Parameters
    ----------
    document
        See `read_arena`.
    name
        What to call it when the document does not say.

    Raises
    ------
    InputError
        See `read_arena`.
    """
    name = document.get("name", name)
    outlines, zones = [], []
    for number, feature in enumerate(document["features"]):
        properties = feature["properties"]
        area = _area(feature["geometry"], f"features[{number}]")
        if properties["role"] == "outline":
            outlines.append(area)
        else:
            follows = properties["follows_walls"]
            zones.append(Zone(name=properties["zone"], follows_walls=follows, polygon=area))
    outline = _only_outline(name, outlines)
    _check_size(name, outline)
    lengths = {key: document[key] for key in ("wall_zone_m", "wall_tolerance_m") if key in document}
    for key, length_m in lengths.items():
        if not length_m <= _LARGEST_M:
            raise InputError(f"Arena {name!r}: {key} is {length_m:g}, more than {_LARGEST_M:g} m.")
    return make_arena(
        name=name,
        outline=outline,
        zones=tuple(zones),
        bins=_bins(document.get("bins", {})),
        **lengths,
    )


@cache
def shipped_arenas() -> tuple[str, ...]:
    """Return the names of the arenas that come with zfcal."""
    names = (entry.name for entry in (files("zfcal") / "arenas").iterdir())
    return tuple(sorted(Path(name).stem for name in names if name.endswith(".geojson")))


def load_arena(name_or_path: str, base: Path) -> Arena:
    """Return an arena that comes with zfcal, or one of a file.

    Parameters
    ----------
    name_or_path
        As in ``trial.toml``: one of `shipped_arenas`, or a file's path.
    base
        The folder that a relative path starts from: the trial.

    Raises
    ------
    InputError
        There is no such arena, or the file is wrong; see `read_arena`.
    """
    if name_or_path in shipped_arenas():
        with as_file(files("zfcal") / "arenas" / f"{name_or_path}.geojson") as path:
            return read_arena(path)
    path = base / name_or_path
    if not path.is_file():
        raise InputError(
            f"Arena {name_or_path!r}: comes not with zfcal, and {path} is no file.",
            hint=f"{nearest(name_or_path, shipped_arenas())}"
            f"There are {', '.join(shipped_arenas())}; or give the path of a GeoJSON file.",
        )
    return read_arena(path)


def circular_document(radius_m: float) -> Document:
    """Return the document of a circular tank around the origin, with walls and centre.

    Parameters
    ----------
    radius_m
        Inner radius of the wall, in metres.
    """
    _check_length("radius_m", radius_m)
    outline = _feature("outline", [_circle(radius_m)])
    return _collection(f"circular {radius_m:g} m", [outline], bins=_open_tank_bins(radius_m))


def rectangle_document(width_m: float, height_m: float) -> Document:
    """Return the document of a rectangular tank from the origin, with walls and centre.

    Parameters
    ----------
    width_m, height_m
        Inner sides along x and y, in metres.
    """
    _check_length("width_m", width_m)
    _check_length("height_m", height_m)
    w, h = float(width_m), float(height_m)
    outline = _feature("outline", [[[0.0, 0.0], [w, 0.0], [w, h], [0.0, h], [0.0, 0.0]]])
    bins = _open_tank_bins(min(w, h) / 2)
    return _collection(f"rectangle {w:g} x {h:g} m", [outline], bins=bins)


def ring_document(radii_m: tuple[float, ...], names: tuple[str, ...]) -> Document:
    """Return the document of a ring corridor around the origin, all of which follows walls.

    Parameters
    ----------
    radii_m
        Radii in metres, ascending: the inner wall, the borders of the zones, the outer wall.
    names
        A name per zone, from the inside out: one fewer than radii.
    """
    for radius_m in radii_m:
        _check_length("radius_m", radius_m)
    if len(names) != len(radii_m) - 1 or not names or list(radii_m) != sorted(set(radii_m)):
        raise InputError(
            f"A ring needs ascending radii and a name per gap, got {radii_m} and {names}."
        )
    circles = [_circle(radius_m) for radius_m in radii_m]
    zones = [
        _feature("zone", [outer, inner[::-1]], zone=name, follows_walls=True)
        for name, inner, outer in zip(names, circles, circles[1:], strict=False)
    ]
    outline = _feature("outline", [circles[-1], circles[0][::-1]])
    inner_m, outer_m = radii_m[0], radii_m[-1]
    # Fish are at most half the corridor from a wall, and at most a diameter from each other.
    bins = {
        "D": [0.0, round(2 * outer_m, 3)],
        "W": [0.0, round((outer_m - inner_m) / 2, 4)],
        "V": [0.0, 0.2],
    }
    name = f"ring {inner_m:g} to {outer_m:g} m"
    return _collection(name, [outline, *zones], bins=bins)


def _collection(name: str, features: list[Document], *, bins: Document) -> Document:
    return {
        "type": "FeatureCollection",
        "name": name,
        "wall_zone_m": 0.07,
        "wall_tolerance_m": 0.01,
        "bins": bins,
        "features": features,
    }


def _feature(role: str, rings: list[_Ring], **properties: Any) -> Document:
    return {
        "type": "Feature",
        "properties": {"role": role, **properties},
        "geometry": {"type": "Polygon", "coordinates": rings},
    }


def _circle(radius_m: float) -> _Ring:
    """Return a closed ring of corners on the circle, to the micrometre, counter-clockwise."""
    angles = [2 * math.pi * corner / _N_CORNERS for corner in range(_N_CORNERS)]
    # Adding zero turns -0.0 into 0.0, which reads better in a file.
    ring = [
        [round(radius_m * math.cos(a), 6) + 0.0, round(radius_m * math.sin(a), 6) + 0.0]
        for a in angles
    ]
    return [*ring, ring[0]]


def _open_tank_bins(inradius_m: float) -> Document:
    """Return ranges in the proportions of a room of ``two-rooms``.

    There W reaches to the room's centre (0.175 m, rounded up to 0.18) and D to 0.22 m.
    """
    return {
        "D": [0.0, round(0.22 / 0.175 * inradius_m, 2)],
        "W": [0.0, math.ceil(100 * inradius_m - 1e-9) / 100],
        "V": [0.0, 0.2],
    }


def _check_length(name: str, length_m: float) -> None:
    if not _SMALLEST_M <= length_m <= _LARGEST_M:
        raise InputError(
            f"{name} must be a length between {_SMALLEST_M} and {_LARGEST_M:g} m, "
            f"got {length_m!r}.",
            hint="Lengths are in metres: a tank of 50 cm has radius_m = 0.25.",
        )


def _area(geometry: Document, where: str) -> shapely.Polygon | shapely.MultiPolygon:
    if geometry["type"] == "Polygon":
        return _polygon(geometry["coordinates"], where)
    parts = [
        _polygon(rings, f"{where}, part {number}")
        for number, rings in enumerate(geometry["coordinates"])
    ]
    return parts[0] if len(parts) == 1 else shapely.MultiPolygon(parts)


def _polygon(rings: list[_Ring], where: str) -> shapely.Polygon:
    for number, ring in enumerate(rings):
        which = f"{where}, ring {number}"
        if ring[0][:2] != ring[-1][:2]:
            raise InputError(
                f"{which} is not closed: it starts at {ring[0][:2]} and ends at {ring[-1][:2]}.",
                hint="Repeat the first corner as the last one.",
            )
        if len({(x, y) for x, y, *_ in ring}) < 3:
            raise InputError(f"{which} has fewer than three corners.")
        if not all(math.isfinite(value) for corner in ring for value in corner[:2]):
            raise InputError(f"{which} has a corner that is not finite.")
    shell, *holes = [[corner[:2] for corner in ring] for ring in rings]
    return shapely.Polygon(shell, holes)


def _only_outline(
    name: str, outlines: list[shapely.Polygon | shapely.MultiPolygon]
) -> shapely.Polygon:
    if len(outlines) != 1:
        raise InputError(
            f"Arena {name!r}: needs one feature of role 'outline', got {len(outlines)}.",
            hint="Mark the water's edge with the property role = outline, and "
            "all other features with role = zone.",
        )
    if isinstance(outlines[0], shapely.MultiPolygon):
        raise InputError(
            f"Arena {name!r}: the outline has {len(outlines[0].geoms)} separate parts.",
            hint="A tank is one piece of water: join the parts, or make an arena of each.",
        )
    return outlines[0]


def _check_size(name: str, outline: shapely.Polygon) -> None:
    """Refuse sizes of no tank: degrees, millimetres and pixels are read as metres otherwise."""
    x0, y0, x1, y1 = outline.bounds
    extent_m = max(x1 - x0, y1 - y0)
    if not extent_m <= _LARGEST_M:
        raise InputError(
            f"Arena {name!r}: is {extent_m:g} m long, more than {_LARGEST_M:g} m.",
            hint="Coordinates are metres. Are these millimetres (divide by 1000) or pixels?",
        )
    if not extent_m >= _SMALLEST_M:
        raise InputError(
            f"Arena {name!r}: is {extent_m:g} m long, less than {_SMALLEST_M:g} m.",
            hint="Coordinates are metres from a corner of the tank. Are these degrees of longitude "
            "and latitude, as map editors write them?",
        )


def _bins(ranges: dict[str, list[float]]) -> Bins:
    for key, (_, high) in ranges.items():
        if not high <= _LARGEST_BIN[key]:
            raise InputError(
                f"The bins of {key} end at {high:g}, expected at most {_LARGEST_BIN[key]:g}.",
                hint="Distances are in metres, speeds in metres a second.",
            )
    pairs = {_BIN_NAMES[key]: (float(low), float(high)) for key, (low, high) in ranges.items()}
    return Bins(**pairs)

"""Arena files: those that come with zfcal, and those that people draw."""

import copy
import json
import math
from importlib.resources import files

import numpy as np
import pytest

from zfcal.arena import Bins
from zfcal.artifacts.arenas import (
    arena_of,
    circular_document,
    load_arena,
    read_arena,
    rectangle_document,
    ring_document,
    shipped_arenas,
)
from zfcal.errors import InputError

SQUARE = [[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]]
LEFT = [[0, 0], [0.5, 0], [0.5, 1], [0, 1], [0, 0]]


def feature(role, rings, *, kind="Polygon", **properties):
    """Return a GeoJSON feature."""
    return {
        "type": "Feature",
        "properties": {"role": role, **properties},
        "geometry": {"type": kind, "coordinates": rings},
    }


def document(*features, **members):
    """Return a GeoJSON collection of a square tank and of further features."""
    outline = feature("outline", [SQUARE])
    return {"type": "FeatureCollection", "features": [outline, *features], **members}


def shipped(name):
    """Return the document of an arena that comes with zfcal."""
    return json.loads((files("zfcal") / "arenas" / f"{name}.geojson").read_text(encoding="utf-8"))


@pytest.fixture
def written(tmp_path):
    """Return what writes a document as a file and gives its path."""

    def write(content):
        path = tmp_path / "tank.geojson"
        path.write_text(content if isinstance(content, str) else json.dumps(content))
        return path

    return write


def test_four_arenas_come_with_zfcal():
    """By the names of the contract."""
    assert shipped_arenas() == ("circular", "open-square", "ring", "two-rooms")


@pytest.mark.parametrize("name", ["circular", "open-square", "ring", "two-rooms"])
def test_every_shipped_arena_loads_and_says_what_it_is(tmp_path, name):
    """It is called as its file, and has a description."""
    assert load_arena(name, tmp_path).name == name
    assert len(shipped(name)["description"]) > 40


def test_two_rooms_has_the_corners_of_the_contract(tmp_path):
    """In metres, whatever the order round the ring."""
    arena = load_arena("two-rooms", tmp_path)
    corners = {tuple(corner) for corner in arena.rings_m[0].tolist()}

    assert corners == {
        (0.051, 0.949), (0.401, 0.949), (0.401, 0.670), (0.670, 0.401), (0.949, 0.401),
        (0.949, 0.051), (0.599, 0.051), (0.599, 0.330), (0.330, 0.599), (0.051, 0.599),
    }  # fmt: skip
    assert set(arena.zones[0].polygon.exterior.coords) == {
        (0.401, 0.670), (0.670, 0.401), (0.599, 0.330), (0.330, 0.599),
    }  # fmt: skip
    assert arena.zone_names == ("corridor", "walls", "centre")
    assert [zone.follows_walls for zone in arena.zones] == [True, True, False]
    assert (arena.wall_zone_m, arena.wall_tolerance_m) == (0.07, 0.01)
    assert arena.bins == Bins(
        distance_m=(0.0, 0.22), wall_distance_m=(0.0, 0.18), speed_m_s=(0.0, 0.20)
    )


def test_open_square_is_a_metre_wide(tmp_path):
    """With walls and centre; the corner is the origin."""
    arena = load_arena("open-square", tmp_path)

    assert arena.outline.bounds == (0.0, 0.0, 1.0, 1.0)
    assert arena.zone_names == ("walls", "centre")
    assert arena.zone_of([[0.01, 0.5], [0.5, 0.5], [-0.1, 0.5]]).tolist() == [1, 2, 0]


def test_ring_has_three_zones_that_follow_walls(tmp_path):
    """Borders at 0.22 and 0.26 m between walls at 0.19 and 0.29 m."""
    arena = load_arena("ring", tmp_path)
    radii_m = np.array([0.18, 0.2, 0.219, 0.221, 0.24, 0.259, 0.261, 0.28, 0.295])
    angle = 1.0
    xy_m = radii_m[:, None] * [math.cos(angle), math.sin(angle)]

    assert arena.zone_names == ("inner", "middle", "outer")
    assert all(zone.follows_walls for zone in arena.zones)
    assert arena.zone_of(xy_m).tolist() == [0, 1, 1, 2, 2, 2, 3, 3, 0]
    assert arena.wall_distance(xy_m[4]) == pytest.approx(0.05, abs=3e-5)
    assert arena.bins.wall_distance_m == (0.0, 0.05)
    assert arena.bins.distance_m == (0.0, 0.58)


def test_no_point_of_the_ring_falls_between_its_zones(tmp_path):
    """The zones share the corners of their borders."""
    arena = load_arena("ring", tmp_path)
    rng = np.random.default_rng(1)
    radius_m, angle = rng.uniform(0.1901, 0.2899, 5000), rng.uniform(-np.pi, np.pi, 5000)
    xy_m = np.stack([radius_m * np.cos(angle), radius_m * np.sin(angle)], axis=-1)

    assert (arena.zone_of(xy_m) > 0).all()


@pytest.mark.parametrize(("name", "radius_m"), [("circular", 0.25), ("ring", 0.29)])
def test_circles_lie_within_the_stated_error(tmp_path, name, radius_m):
    """Chords of 256 corners: at most r (1 - cos(pi / 256)), 0.02 mm here, inside the circle."""
    arena = load_arena(name, tmp_path)
    corners = arena.rings_m[0]
    middles = (corners[1:] + corners[:-1]) / 2
    sagitta_m = radius_m * (1 - math.cos(math.pi / 256))

    assert sagitta_m < 2.2e-5
    assert np.hypot(*corners.T) == pytest.approx(radius_m, abs=1e-6)
    assert np.hypot(*middles.T) == pytest.approx(radius_m - sagitta_m, abs=1e-6)
    assert "0.02 mm" in shipped(name)["description"]


@pytest.mark.parametrize(
    ("name", "made"),
    [
        ("circular", circular_document(0.25)),
        ("open-square", rectangle_document(1.0, 1.0)),
        ("ring", ring_document((0.19, 0.22, 0.26, 0.29), ("inner", "middle", "outer"))),
    ],
)
def test_the_shipped_files_are_what_the_program_makes(name, made):
    """But for their names and descriptions."""
    found = shipped(name)
    for key in ("name", "description"):
        found.pop(key)
        made.pop(key, None)

    assert found == made


@pytest.mark.parametrize("radius_m", [0.02, 0.1, 0.288, 1.5])
def test_a_circular_tank_of_any_radius_is_an_arena(radius_m):
    """Its middle is as far from the wall as its radius, and W reaches there."""
    arena = arena_of(circular_document(radius_m))

    assert arena.wall_distance([0, 0]) == pytest.approx(radius_m, rel=1e-4)
    assert arena.bins.wall_distance_m[1] == pytest.approx(radius_m, abs=0.01)
    assert arena.bins.wall_distance_m[1] >= radius_m
    assert arena.outline.area == pytest.approx(math.pi * radius_m**2, rel=2e-4)


def test_bins_of_open_tanks_are_in_the_proportion_of_a_room():
    """A square of the room's 0.35 m gets the bins of two-rooms."""
    assert arena_of(rectangle_document(0.35, 0.35)).bins == Bins()


@pytest.mark.parametrize("value", [0, -1, math.nan, math.inf, 250])
def test_a_size_that_is_no_tanks_is_refused(value):
    """25 cm are 0.25 m; NaN fails as well."""
    with pytest.raises(InputError, match="must be a length between"):
        circular_document(value)
    with pytest.raises(InputError, match="must be a length between"):
        rectangle_document(1, value)


@pytest.mark.parametrize(
    ("radii_m", "names"),
    [((0.2,), ()), ((0.3, 0.2), ("a",)), ((0.2, 0.3), ("a", "b")), ((0.2, 0.2), ("a",))],
)
def test_a_ring_of_radii_that_do_not_rise_is_refused(radii_m, names):
    """And one with a name too many."""
    with pytest.raises(InputError, match="A ring needs ascending radii"):
        ring_document(radii_m, names)


def test_a_drawn_arena_is_read_with_all_that_it_states(written):
    """Zones, lengths, bins; a third coordinate is dropped."""
    left = feature("zone", [[[*corner, 0.1] for corner in LEFT]], zone="left", follows_walls=True)
    bins = {"D": [0, 1.4], "V": [0, 0.3]}
    arena = read_arena(
        written(document(left, wall_zone_m=0.1, wall_tolerance_m=0.02, bins=bins, name="mine"))
    )

    assert arena.name == "mine"
    assert arena.zone_names == ("left", "walls", "centre")
    assert arena.zone_of([[0.2, 0.5], [0.7, 0.5], [0.95, 0.5]]).tolist() == [1, 3, 2]
    assert (arena.wall_zone_m, arena.wall_tolerance_m) == (0.1, 0.02)
    assert arena.bins == Bins(distance_m=(0.0, 1.4), speed_m_s=(0.0, 0.3))


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"wall_zone_m": 1e308}, r"wall_zone_m is 1e\+308, more than 20 m"),
        ({"wall_tolerance_m": 21}, "wall_tolerance_m is 21, more than 20 m"),
        ({"bins": {"V": [0, 1e308]}}, r"bins of V end at 1e\+308, expected at most 10"),
        ({"bins": {"D": [0, 41]}}, "bins of D end at 41, expected at most 40"),
    ],
)
def test_lengths_and_speeds_of_no_tank_are_refused(written, change, says):
    """They left no zone, or a search without an end."""
    with pytest.raises(InputError, match=says):
        read_arena(written(document(**change)))


def test_an_arena_without_a_name_is_called_as_its_file(written):
    """tank.geojson is tank."""
    assert read_arena(written(document())).name == "tank"


def test_a_zone_of_several_parts_and_a_hole_in_the_outline(written):
    """MultiPolygon zones; holes are walls."""
    hole = [[0.4, 0.4], [0.6, 0.4], [0.6, 0.6], [0.4, 0.6], [0.4, 0.4]]
    outline = feature("outline", [SQUARE, hole])
    parts = [
        [[[0, 0], [0.2, 0], [0.2, 0.2], [0, 0.2], [0, 0]]],
        [[[0.8, 0.8], [1, 0.8], [1, 1], [0.8, 1], [0.8, 0.8]]],
    ]
    ends = feature("zone", parts, kind="MultiPolygon", zone="ends", follows_walls=False)
    arena = read_arena(written({"type": "FeatureCollection", "features": [ends, outline]}))

    assert arena.zone_of([[0.1, 0.1], [0.9, 0.9], [0.5, 0.5], [0.35, 0.5]]).tolist() == [1, 1, 0, 2]
    assert arena.wall_distance([0.3, 0.5]) == pytest.approx(0.1)


def test_an_outline_of_one_part_may_be_a_multipolygon(written):
    """Some editors write nothing else."""
    outline = feature("outline", [[SQUARE]], kind="MultiPolygon")

    arena = read_arena(written({"type": "FeatureCollection", "features": [outline]}))
    assert arena.outline.area == 1.0


def scaled(by, shift=0.0):
    """Return the square tank in another unit, or elsewhere."""
    made = document()
    ring = [[x * by + shift, y * by + shift] for x, y in SQUARE]
    made["features"][0]["geometry"]["coordinates"] = [ring]
    return made


def without(*path):
    """Return the square tank with a left zone and without one member."""
    left = feature("zone", [LEFT], zone="left", follows_walls=True)
    made = copy.deepcopy(document(left))
    target = made
    for step in path[:-1]:
        target = target[step]
    del target[path[-1]]
    return made


@pytest.mark.parametrize(
    ("content", "says", "hint"),
    [
        (scaled(1000.0), "is 1000 m long, more than 20 m", "millimetres"),
        (scaled(1e-5, shift=48.85), "m long, less than 0.02 m", "degrees"),
        (document(feature("zone", [LEFT[:-1]], zone="a", follows_walls=True)),
         r"features\[1\], ring 0 is not closed: it starts at \[0, 0\] and ends at \[0, 1\]",
         "Repeat the first corner"),
        (document(feature("zone", [[[0, 0], [1, 1], [0, 0]]], zone="a", follows_walls=True)),
         "fewer than three corners", ""),
        (document(feature("outline", [SQUARE])), "needs one feature of role 'outline', got 2", ""),
        ({"type": "FeatureCollection", "features": [feature("zone", [LEFT], zone="a",
          follows_walls=True)]}, "needs one feature of role 'outline', got 0", "role = outline"),
        ({"type": "FeatureCollection", "features": []}, "features must be a list of at least", ""),
        ({"type": "Polygon", "coordinates": [SQUARE]}, "is a GeoJSON Polygon", ""),
        (document(feature("zone", [[[x + 2, y] for x, y in LEFT]], zone="a", follows_walls=True)),
         "zone 'a': 0.500000 m2 of it lie outside", "metres"),
        (document(feature("zone", [LEFT], zone="a", follows_walls=True),
                  feature("zone", [LEFT], zone="b", follows_walls=True)), "overlaps zone 'a'", ""),
        (without("features", 1, "properties", "zone"),
         r"'zone' is missing in features\[1\].properties", ""),
        (without("features", 1, "properties", "follows_walls"), "'follows_walls' is missing", ""),
        (without("features", 1, "properties", "role"), "'role' is missing", ""),
        (document(feature("zones", [LEFT])), 'role must be one of "outline", "zone"', ""),
        (document(feature("zone", [LEFT], zone="a", folows_walls=True)),
         "unknown key 'folows_walls'", "Did you mean 'follows_walls'"),
        (document(wall_zone=0.1), "unknown key 'wall_zone'", "Did you mean 'wall_zone_m'"),
        (document(wall_zone_m=-0.1), "wall_zone_m must be at least 0", ""),
        (document(bins={"D": [0.2, 0.1]}), "0 <= low < high", ""),
        (document(bins={"X": [0, 1]}), "unknown key 'X' in bins", ""),
        (document(feature("zone", [[["a", 0], [1, 0], [1, 1], ["a", 0]]], zone="a",
                  follows_walls=True)), 'must be a number, got "a"', ""),
        (document(feature("outline", LEFT)), "must be a list|must be a number", ""),
        (document(feature("zone", [0.1, 0.2], kind="Point", zone="a", follows_walls=True)),
         'type must be one of "Polygon", "MultiPolygon", got "Point"', ""),
        ('{"type": "FeatureCollection", "features": [', "is not valid JSON", "comma"),
        ('{"type": NaN}', "NaN is not a number", ""),
        (json.dumps(document()).replace("[1, 1]", "[1, 1e999]"), "not finite|more than 20 m", ""),
        ("", "the file is empty", ""),
    ],
)  # fmt: skip
def test_a_drawing_that_is_no_tank_is_refused(written, content, says, hint):
    """With the file, the place, and what to do; always exit code 1."""
    path = written(content)

    with pytest.raises(InputError, match=says) as caught:
        read_arena(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)
    assert hint in caught.value.hint


def test_two_tanks_are_no_outline(written):
    """A tank is one piece of water."""
    parts = [[SQUARE], [[[x + 2, y] for x, y in SQUARE]]]
    outline = feature("outline", parts, kind="MultiPolygon")

    with pytest.raises(InputError, match="the outline has 2 separate parts"):
        read_arena(written({"type": "FeatureCollection", "features": [outline]}))


def test_a_trials_own_arena_is_found_beside_it(tmp_path, written):
    """The path is relative to the trial; a shipped name needs no file."""
    path = written(document(name="mine"))

    assert load_arena("tank.geojson", tmp_path).name == "mine"
    assert load_arena(str(path), tmp_path / "elsewhere").name == "mine"


def test_an_arena_that_is_nowhere_is_named_with_the_nearest(tmp_path):
    """And the list of those that there are."""
    with pytest.raises(InputError, match="comes not with zfcal") as caught:
        load_arena("two-room", tmp_path)
    assert caught.value.hint.startswith("Did you mean 'two-rooms'? There are circular, open-square")


@pytest.mark.parametrize("kind", ["Polygon", "Feature"])
def test_a_polygon_by_itself_is_told_what_is_missing(tmp_path, kind):
    """The hint shows the collection that belongs round it."""
    path = tmp_path / "tank.geojson"
    ring = [[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]]
    path.write_text(json.dumps({"type": kind, "coordinates": [ring]}))
    with pytest.raises(InputError, match=f"is a GeoJSON {kind}, expected a Fea") as error:
        read_arena(path)
    assert '{"role": "outline"}' in error.value.hint

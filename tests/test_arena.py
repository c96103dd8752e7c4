"""The tank's geometry: zones, distances to the wall, points a little outside."""

import math

import numpy as np
import pytest
import shapely

from zfcal.arena import VOID, Bins, Zone, make_arena
from zfcal.errors import InputError

OUTLINE_M = (
    (0.051, 0.949), (0.401, 0.949), (0.401, 0.670), (0.670, 0.401), (0.949, 0.401),
    (0.949, 0.051), (0.599, 0.051), (0.599, 0.330), (0.330, 0.599), (0.051, 0.599),
)  # fmt: skip
CORRIDOR_M = ((0.401, 0.670), (0.670, 0.401), (0.599, 0.330), (0.330, 0.599))
CORRIDOR, WALLS, CENTRE = 1, 2, 3


def square(side_m, corner_m=0.0):
    """Return a square from ``(corner_m, corner_m)``."""
    return shapely.box(corner_m, corner_m, corner_m + side_m, corner_m + side_m)


@pytest.fixture(scope="module")
def two_rooms():
    """Return the default arena, made here from the numbers of its description."""
    corridor = Zone(name="corridor", follows_walls=True, polygon=shapely.Polygon(CORRIDOR_M))
    return make_arena(name="two-rooms", outline=shapely.Polygon(OUTLINE_M), zones=(corridor,))


def test_zones_of_two_rooms_are_corridor_walls_and_centre(two_rooms):
    """The corridor comes from its polygon; walls and centre share the rest, in this order."""
    assert two_rooms.zone_names == ("corridor", "walls", "centre")
    assert [zone.follows_walls for zone in two_rooms.zones] == [True, True, False]


@pytest.mark.parametrize(
    ("xy_m", "zone"),
    [
        ((0.5, 0.5), CORRIDOR),  # its middle
        ((0.401, 0.66), CORRIDOR),  # just inside its mouth
        ((0.06, 0.94), WALLS),  # a corner of the upper room
        ((0.226, 0.66), WALLS),  # 61 mm from the room's lower wall
        ((0.226, 0.774), CENTRE),  # the middle of the upper room
        ((0.774, 0.226), CENTRE),  # the middle of the lower room
        ((0.2, 0.2), VOID),  # the corner of the tank without water
        ((0.05, 0.8), VOID),  # 1 mm outside
        ((2.0, 2.0), VOID),
    ],
)
def test_zone_of_points_of_two_rooms_by_hand(two_rooms, xy_m, zone):
    """A point in the corridor's polygon, near a wall, away from walls, and outside."""
    assert two_rooms.zone_of(xy_m) == zone


@pytest.mark.parametrize(
    ("xy_m", "distance_m"),
    [
        ((0.226, 0.774), 0.175),  # the middle of a room of 350 mm
        ((0.061, 0.8), 0.010),
        ((0.5, 0.5), 0.071 / math.sqrt(2)),  # the corridor is 0.071 sqrt 2 = 100.4 mm wide
        ((0.401 - 0.03, 0.670 + 0.04), 0.03),  # beside the reflex corner, to the room's wall
        ((0.04, 0.589), math.hypot(0.011, 0.010)),  # outside, to the corner, not to a line
        ((0.2, 0.2), math.sqrt(2) * 0.2645),  # outside, to the corridor's edge x + y = 0.929
    ],
)
def test_wall_distance_in_two_rooms_by_hand(two_rooms, xy_m, distance_m):
    """The distance is that to the nearest segment, inside or out."""
    assert two_rooms.wall_distance(xy_m) == pytest.approx(distance_m, abs=1e-9)


def test_area_and_extent_of_two_rooms_by_hand(two_rooms):
    """Two squares of 0.35 m and a corridor of 0.269 sqrt 2 by 0.071 sqrt 2; 898 mm across.

    The corridor overlaps each room in a right triangle of legs 0.071 m.
    """
    rooms_m2 = 2 * 0.35**2
    corridor_m2 = 2 * 0.269 * 0.071
    triangles_m2 = 2 * 0.071**2 / 2

    assert two_rooms.outline.area == pytest.approx(rooms_m2 + corridor_m2 - triangles_m2)
    assert two_rooms.extent_m == pytest.approx(0.898)
    assert len(two_rooms.segments_m) == len(OUTLINE_M)


def test_two_rooms_look_the_same_after_swapping_x_and_y(two_rooms):
    """The tank is its own mirror image across the diagonal."""
    xy_m = np.random.default_rng(1).uniform(0, 1, (2000, 2))

    np.testing.assert_array_equal(two_rooms.zone_of(xy_m), two_rooms.zone_of(xy_m[:, ::-1]))
    np.testing.assert_allclose(
        two_rooms.wall_distance(xy_m), two_rooms.wall_distance(xy_m[:, ::-1]), atol=1e-12
    )


def test_lost_agents_have_no_zone_and_no_distance(two_rooms):
    """NaN in one coordinate is enough; the shape stays."""
    xy_m = np.full((3, 4, 2), 0.5)
    xy_m[1, 2, 0] = np.nan
    xy_m[2, 3] = np.nan

    zones, distance_m = two_rooms.zone_of(xy_m), two_rooms.wall_distance(xy_m)

    lost = np.isnan(xy_m).any(axis=-1)
    assert zones.shape == distance_m.shape == (3, 4)
    assert (zones[lost] == VOID).all()
    assert np.isnan(distance_m[lost]).all()
    assert (zones[~lost] == CORRIDOR).all()


def test_no_points_give_no_zones(two_rooms):
    """An empty array keeps its shape."""
    assert two_rooms.zone_of(np.zeros((0, 5, 2))).shape == (0, 5)
    assert two_rooms.wall_distance(np.zeros((0, 2))).shape == (0,)
    assert two_rooms.settle(np.zeros((0, 2)))[1] == 0


def test_the_wall_zone_ends_where_the_distance_reaches_it():
    """Nearer than wall_zone_m is walls; at wall_zone_m is centre."""
    arena = make_arena(name="square", outline=square(1.0), wall_zone_m=0.25)

    assert arena.zone_of([[0.2499, 0.5], [0.25, 0.5], [0.2501, 0.5]]).tolist() == [1, 2, 2]


def test_a_hole_is_void_and_its_edge_is_a_wall():
    """In a square with a square pillar, distances count to the pillar as well."""
    outline = shapely.difference(square(1.0), square(0.2, 0.4))
    arena = make_arena(name="pillar", outline=outline)

    assert arena.zone_of([0.5, 0.5]) == VOID
    assert arena.wall_distance([0.3, 0.5]) == pytest.approx(0.1)
    assert arena.zone_of([0.35, 0.5]) == 1
    assert arena.zone_of([0.25, 0.25]) == 2
    assert len(arena.rings_m) == 2
    assert len(arena.segments_m) == 8


def test_points_just_outside_are_taken_at_the_wall(two_rooms):
    """8 mm outside the left wall of the upper room becomes a point on it; 12 mm stays void."""
    xy_m = np.array([[0.043, 0.8], [0.039, 0.8], [0.2, 0.8], [np.nan, 0.8]])

    settled_m, moved = two_rooms.settle(xy_m)

    assert moved == 1
    np.testing.assert_allclose(settled_m[0], [0.051, 0.8], atol=1e-8)
    np.testing.assert_array_equal(settled_m[1:], xy_m[1:])
    assert two_rooms.zone_of(settled_m).tolist() == [WALLS, VOID, CENTRE, VOID]


def test_settling_leaves_its_argument_alone(two_rooms):
    """The measured positions are not overwritten."""
    xy_m = np.array([[0.045, 0.8]])
    two_rooms.settle(xy_m)

    assert xy_m.tolist() == [[0.045, 0.8]]


def test_where_zones_touch_the_first_one_has_the_edge():
    """Two halves of a square: the common edge belongs to the zone that the file names first."""
    halves = (
        Zone(name="left", follows_walls=True, polygon=shapely.box(0, 0, 0.5, 1)),
        Zone(name="right", follows_walls=True, polygon=shapely.box(0.5, 0, 1, 1)),
    )
    arena = make_arena(name="halves", outline=square(1.0), zones=halves)

    assert arena.zone_names == ("left", "right")
    assert arena.zone_of([[0.5, 0.5], [0.4, 0.5], [0.6, 0.5]]).tolist() == [1, 1, 2]


def test_a_crack_between_zones_goes_to_the_nearest():
    """Corners rounded to the micrometre leave slits; a fish in one is not lost."""
    halves = (
        Zone(name="left", follows_walls=True, polygon=shapely.box(0, 0, 0.4999998, 1)),
        Zone(name="right", follows_walls=True, polygon=shapely.box(0.5000001, 0, 1, 1)),
    )
    arena = make_arena(name="halves", outline=square(1.0), zones=halves)

    assert arena.zone_of([[0.4999999, 0.5], [0.5, 0.5]]).tolist() == [1, 2]


def test_the_middle_of_a_tank_that_is_all_walls_is_walls():
    """With wall_zone_m = half the side only the very middle is not nearer: no zone of its own."""
    arena = make_arena(name="narrow", outline=square(1.0), wall_zone_m=0.5)

    assert arena.zone_names == ("walls",)
    assert arena.zone_of([0.5, 0.5]) == 1


def test_the_middle_of_a_room_is_not_given_to_a_far_zone(two_rooms):
    """With wall_zone_m = 0.175 the rooms are all walls; their middle does not become corridor."""
    corridor = two_rooms.zones[:1]
    arena = make_arena(name="w", outline=two_rooms.outline, zones=corridor, wall_zone_m=0.175)

    assert arena.zone_names == ("corridor", "walls")
    assert arena.zone_of([0.226, 0.774]) == 2


@pytest.mark.parametrize(
    ("outline", "says"),
    [
        (shapely.Polygon([(0, 0), (1, 1), (1, 0), (0, 1)]), "not a simple polygon"),
        (shapely.Polygon([(0, 0), (1, 1), (2, 2)]), "not a simple polygon"),
        (shapely.Polygon(), "not a simple polygon"),
        (shapely.MultiPolygon([square(1.0), square(1.0, 2.0)]), "not a simple polygon"),
    ],
)
def test_an_outline_that_is_no_simple_polygon_is_refused(outline, says):
    """A bow tie, a line, nothing, two tanks."""
    with pytest.raises(InputError, match=says):
        make_arena(name="bad", outline=outline)


@pytest.mark.parametrize(
    ("polygons", "says"),
    [
        ([("a", square(1.0, 0.5))], "lie outside the outline"),
        ([("a", square(0.5)), ("b", square(0.5, 0.25))], "overlaps zone 'a'"),
        ([("a", square(0.2)), ("a", square(0.2, 0.5))], "the name is taken"),
        ([("void", square(0.2))], "the name is taken"),
        ([("walls", square(0.2))], "'walls' is taken"),
        ([("a", shapely.Polygon())], "not a simple polygon"),
        ([("a", None)], "not a simple polygon"),
    ],
)
def test_zones_that_do_not_fit_are_refused(polygons, says):
    """Outside, overlapping, of one name, or of a name that the remainder needs."""
    zones = tuple(Zone(name=n, follows_walls=True, polygon=p) for n, p in polygons)

    with pytest.raises(InputError, match=says):
        make_arena(name="bad", outline=square(1.0), zones=zones)


@pytest.mark.parametrize("value", [-0.1, math.nan, math.inf])
@pytest.mark.parametrize("key", ["wall_zone_m", "wall_tolerance_m"])
def test_lengths_that_are_none_are_refused(key, value):
    """NaN fails a limit as a negative length does."""
    with pytest.raises(InputError, match=f"{key} must be a length"):
        make_arena(name="bad", outline=square(1.0), **{key: value})


@pytest.mark.parametrize("limits", [(0.2, 0.1), (0.1, 0.1), (-0.1, 0.2), (0.0, math.nan)])
def test_bin_ranges_that_do_not_rise_are_refused(limits):
    """A range needs 0 <= low < high, both finite."""
    with pytest.raises(InputError, match="0 <= low < high"):
        Bins(distance_m=limits)

"""What holds for any tank: checked on random polygons and points."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import example, given
from hypothesis import strategies as st
from shapely import affinity

from zfcal.arena import VOID, Zone, make_arena

RADII = st.lists(st.floats(0.2, 0.6), min_size=3, max_size=12)
SEEDS = st.integers(0, 2**32 - 1)


def star(radii_m):
    """Return a simple polygon round the origin with a corner at each radius."""
    angles = 2 * np.pi * np.arange(len(radii_m)) / len(radii_m)
    return shapely.Polygon(np.stack([radii_m * np.cos(angles), radii_m * np.sin(angles)], -1))


def tank(radii_m):
    """Return a tank with a core zone, walls and centre."""
    outline = star(np.array(radii_m))
    # Shrunk towards the origin, which sees every corner: so it lies inside whatever the shape.
    polygon = affinity.scale(outline, 0.2, 0.2, origin=(0.0, 0.0))
    core = Zone(name="core", follows_walls=False, polygon=polygon)
    return make_arena(name="star", outline=outline, zones=(core,), wall_zone_m=0.03)


def points(seed, n=60):
    """Return points in and around a tank."""
    return np.random.default_rng(seed).uniform(-0.7, 0.7, (n, 2))


def slow_wall_distance(arena, xy_m):
    """Return the distance to the nearest segment, one point and segment at a time."""
    found = []
    for x, y in xy_m:
        distances = []
        for x0, y0, x1, y1 in arena.segments_m:
            along = ((x - x0) * (x1 - x0) + (y - y0) * (y1 - y0)) / math.dist(
                (x0, y0), (x1, y1)
            ) ** 2
            t = min(max(along, 0.0), 1.0)
            distances.append(math.dist((x, y), (x0 + t * (x1 - x0), y0 + t * (y1 - y0))))
        found.append(min(distances))
    return np.array(found)


@given(radii_m=RADII, seed=SEEDS)
def test_wall_distance_is_that_of_a_slow_twin(radii_m, seed):
    """The nearest point of each straight piece, by school geometry."""
    arena, xy_m = tank(radii_m), points(seed, 20)

    np.testing.assert_allclose(
        arena.wall_distance(xy_m), slow_wall_distance(arena, xy_m), atol=1e-12
    )


@given(radii_m=RADII, seed=SEEDS)
def test_wall_distance_grows_no_faster_than_the_way(radii_m, seed):
    """From one point to another the distance to the wall changes by their distance at most."""
    arena, xy_m = tank(radii_m), points(seed)
    distance_m = arena.wall_distance(xy_m)
    way_m = np.linalg.norm(np.diff(xy_m, axis=0), axis=-1)

    assert (np.abs(np.diff(distance_m)) <= way_m + 1e-12).all()


@given(radii_m=RADII, seed=SEEDS, shift_m=st.tuples(st.floats(-5, 5), st.floats(-5, 5)))
def test_a_tank_that_is_moved_and_turned_keeps_its_zones(radii_m, seed, shift_m):
    """A quarter turn and a shift of tank and points change no zone and no distance."""
    here = tank(radii_m)
    matrix = [0, -1, 1, 0, *shift_m]
    zones = tuple(
        Zone(
            name=zone.name,
            follows_walls=zone.follows_walls,
            polygon=affinity.affine_transform(zone.polygon, matrix),
        )
        for zone in here.zones
        if zone.polygon is not None
    )
    there = make_arena(
        name="there",
        outline=affinity.affine_transform(here.outline, matrix),
        zones=zones,
        wall_zone_m=0.03,
    )
    xy_m = points(seed)
    moved_m = np.stack([-xy_m[:, 1], xy_m[:, 0]], axis=-1) + shift_m
    distance_m = here.wall_distance(xy_m)
    # Where rounding may decide, either answer is right.
    clear = (np.abs(distance_m - 0.03) > 1e-9) & (distance_m > 1e-9)
    clear &= shapely.distance(here.zones[0].polygon.boundary, shapely.points(xy_m)) > 1e-9

    np.testing.assert_allclose(there.wall_distance(moved_m), distance_m, atol=1e-12)
    assert (there.zone_of(moved_m) == here.zone_of(xy_m))[clear].all()


@given(radii_m=RADII, seed=SEEDS)
def test_every_point_inside_has_a_zone_and_every_point_outside_none(radii_m, seed):
    """The zones cover the tank and nothing else."""
    arena, xy_m = tank(radii_m), points(seed)
    inside = shapely.covers(arena.outline, shapely.points(xy_m))

    np.testing.assert_array_equal(arena.zone_of(xy_m) != VOID, inside)


@example(radii_m=[0.5, 0.25, 0.25, 0.21875, 0.21875, 0.5625, 0.21875], seed=0)
@given(radii_m=RADII, seed=SEEDS)
def test_settling_puts_all_near_points_inside_and_moves_none_twice(radii_m, seed):
    """A point up to the tolerance outside ends inside, not farther than it had to go."""
    arena, xy_m = tank(radii_m), points(seed, 300)
    outside_m = shapely.distance(arena.outline, shapely.points(xy_m))

    settled_m, moved = arena.settle(xy_m)
    again_m, moved_again = arena.settle(settled_m)

    near = (outside_m > 0) & (outside_m <= arena.wall_tolerance_m)
    assert moved == near.sum()
    assert moved_again == 0
    assert (arena.zone_of(settled_m[near]) != VOID).all()
    way_m = np.linalg.norm(settled_m - xy_m, axis=-1)
    # The inner edge on which they are put lies 1e-9 m inside, at sharp corners a little more.
    assert way_m[near] == pytest.approx(outside_m[near], abs=1e-7)
    assert (way_m[~near] == 0).all()
    np.testing.assert_array_equal(again_m, settled_m)

"""Borders, corners, cracks and repeated corners: where the kernels' arena could go astray."""

from __future__ import annotations

import dataclasses
import math
import warnings
from pathlib import Path

import numba
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from zfcal.arena import Bins, Zone, make_arena
from zfcal.artifacts.arenas import load_arena
from zfcal.model.kernels.compiled import kernel
from zfcal.model.kernels.geometry import best_within, clearance, nearest_wall, zone_exact, zone_of
from zfcal.model.tank import make_tank

EPS = 2e-7


@kernel
def _look_up(xy, tank):
    """Return zone by grid, zone by exact test, and of points inside wall and clearance."""
    zones = np.empty((len(xy), 2), np.int64)
    found = np.full((len(xy), 4), np.nan)
    for k in range(len(xy)):
        x, y = xy[k]
        zones[k, 0], zones[k, 1] = zone_of(x, y, tank), zone_exact(x, y, tank)
        if zones[k, 0] > 0:
            found[k, 0], found[k, 1], found[k, 2] = nearest_wall(x, y, tank)
            found[k, 3] = clearance(x, y, tank)
    return zones, found


@kernel
def _best(xy, reach_m, gain, tank):
    best = np.empty(len(xy))
    for k in range(len(xy)):
        best[k] = best_within(xy[k, 0], xy[k, 1], reach_m[k], gain, tank)
    return best


def _box_with(name, polygon, **changes):
    """Return a unit square with one zone and whatever the rest makes."""
    zones = (Zone(name=name, follows_walls=False, polygon=polygon),)
    return make_arena(name=name, outline=shapely.box(0, 0, 1, 1), zones=zones, **changes)


def _cracked():
    """Arenas in which points lie in no zone, with points there; EPS is below what is checked."""
    rng = np.random.default_rng(3)
    along, across = rng.uniform(0.1, 0.9, 4000), rng.uniform(-2 * EPS, 2 * EPS, 4000)
    beside_border = np.column_stack([along, 0.07 + across])
    middle = shapely.box(0.07 + EPS, 0.07 + EPS, 0.93 - EPS, 0.93 - EPS)
    frame = shapely.box(0, 0, 1, 1).difference(
        shapely.box(0.07 - EPS, 0.07 - EPS, 0.93 + EPS, 0.93 + EPS)
    )
    narrow = make_arena(
        name="narrow",
        outline=shapely.box(0, 0, 1, 0.14 + EPS),
        zones=(Zone(name="left", follows_walls=False, polygon=shapely.box(0, 0, 0.5, 0.14 + EPS)),),
    )
    halves = make_arena(
        name="halves",
        outline=shapely.box(0, 0, 1, 1),
        zones=(
            Zone(name="left", follows_walls=True, polygon=shapely.box(0, 0, 0.5 - EPS, 1)),
            Zone(name="right", follows_walls=True, polygon=shapely.box(0.5 + EPS, 0, 1, 1)),
        ),
    )
    return {
        "no centre but a crack": (_box_with("middle", middle), beside_border, ("middle", "walls")),
        "no walls but a crack": (_box_with("frame", frame), beside_border, ("frame", "centre")),
        "a hair of a centre": (
            narrow,
            np.column_stack([0.5 + across, 0.07 + EPS * rng.uniform(0, 1, 4000)]),
            ("left", "walls"),
        ),
        "between two": (halves, np.column_stack([0.5 + across, along]), ("left", "right")),
    }


@pytest.mark.slow
@pytest.mark.parametrize("name", _cracked())
def test_a_crack_belongs_to_the_zone_that_the_arena_gives_it(name):
    """Where the rest of the tank is too small for a zone, arena and kernel agree on the nearest."""
    arena, xy, names = _cracked()[name]
    assert arena.zone_names == names

    zones, _ = _look_up(xy, make_tank(arena))

    assert set(np.unique(zones)) == {1, 2}
    np.testing.assert_array_equal(zones[:, 1], arena.zone_of(xy))
    np.testing.assert_array_equal(zones[:, 0], zones[:, 1])


@pytest.mark.slow
@pytest.mark.parametrize("name", ["two-rooms", "open-square", "circular", "ring"])
def test_points_of_whole_millimetres_on_walls_and_borders_are_where_the_arena_has_them(name):
    """Tracks of whole millimetres lie on walls all the time: there the kernel says inside, too."""
    arena = load_arena(name, Path())
    x0, y0, x1, y1 = np.round(1000 * np.array(arena.outline.bounds)).astype(int)
    grid = np.meshgrid(np.arange(x0 - 1, x1 + 2, 5) / 1000, np.arange(y0 - 1, y1 + 2) / 1000)
    xy = np.stack(grid, axis=-1).reshape(-1, 2)

    zones, _ = _look_up(xy, make_tank(arena))

    expected = arena.zone_of(xy)
    # A slanting border through whole millimetres: rounding decides, to either side of it.
    tie = _away_from_borders(arena, xy) < 1e-12
    assert ((zones[:, 1] == expected) | tie).all()
    assert ((zones[:, 1] > 0) >= (expected > 0)).all()
    assert tie.mean() < 0.01


def _away_from_borders(arena, xy):
    lines = [arena.outline.boundary]
    lines += [zone.polygon.boundary for zone in arena.zones if zone.polygon is not None]
    border = shapely.distance(shapely.union_all(lines), shapely.points(xy))
    return np.minimum(border, np.abs(arena.wall_distance(xy) - arena.wall_zone_m))


def test_a_row_of_points_at_the_height_of_a_corner_is_not_miscounted():
    """0.011 + (0.001 - 0.011) is not 0.001 in floating point: no ray may slip through there."""
    slipping = [(0.0, 0.011), (0.05, 0.001), (0.4, 0.001), (0.4, 0.3), (0.1, 0.3)]
    tilted = [(0.0, 0.25), (0.077, 0.182), (0.3, 0.019), (0.35, 0.077), (0.2, 0.35)]
    for corners in (slipping, tilted, [(y, x) for x, y in slipping], [(y, x) for x, y in tilted]):
        arena = make_arena(name="corners", outline=shapely.Polygon(corners))
        heights = sorted({y for _, y in corners})
        grid = np.meshgrid(np.linspace(-0.11, 0.51, 63), heights)
        xy = np.stack(grid, axis=-1).reshape(-1, 2)

        zones, _ = _look_up(xy, make_tank(arena))

        clear = arena.wall_distance(xy) > 1e-12
        np.testing.assert_array_equal(zones[clear, 1], arena.zone_of(xy)[clear])
        np.testing.assert_array_equal(zones[:, 0], zones[:, 1])


def test_a_corner_that_is_named_twice_makes_no_piece_of_wall():
    """A repeated corner is valid GeoJSON: no division by its length, no direction of nothing."""
    twice = [(0, 0), (1, 0), (1, 0), (1, 1), (1, 1), (0, 1)]
    zone = shapely.Polygon([(0, 0), (0.2, 0), (0.2, 0), (0.2, 0.2), (0, 0.2)])
    arena = make_arena(
        name="twice",
        outline=shapely.Polygon(twice),
        zones=(Zone(name="nook", follows_walls=True, polygon=zone),),
    )

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        tank = make_tank(arena)

    assert len(tank.walls) == len(tank.edges) == 4
    assert np.isfinite(tank.walls).all()
    _, found = _look_up(np.array([[1.0, 0.0], [1.0, 0.5], [0.99, 0.01]]), tank)
    assert np.isfinite(found).all()


RADII = st.lists(st.floats(0.2, 0.6), min_size=3, max_size=9)


@settings(max_examples=20)
@given(radii=RADII, seed=st.integers(0, 2**32 - 1))
def test_any_tank_is_the_same_by_grid_by_exact_test_and_by_shapely(radii, seed):
    """Random stars with a core: zone, distance, clearance, and a direction along the wall."""
    arena = _star(radii)
    tank = make_tank(arena, cells=48)
    rng = np.random.default_rng(seed)
    xy = rng.uniform(-0.6, 0.6, (600, 2))

    zones, found = _look_up(xy, tank)

    np.testing.assert_array_equal(zones[:, 0], zones[:, 1])
    clear = _away_from_borders(arena, xy) > 1e-9
    np.testing.assert_array_equal(zones[clear, 0], arena.zone_of(xy)[clear])
    inside = zones[:, 0] > 0
    assert found[inside, 0] == pytest.approx(arena.wall_distance(xy[inside]), abs=1e-12)
    assert np.hypot(found[inside, 1], found[inside, 2]) == pytest.approx(1.0)
    _check_clearance(arena, xy[inside], found[inside, 3], rng)
    _check_reach(arena, xy[inside], tank, rng)


def _star(radii):
    angles = 2 * np.pi * np.arange(len(radii)) / len(radii)
    corners = np.array(radii)[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    core = Zone(name="core", follows_walls=False, polygon=shapely.Polygon(0.3 * corners))
    return make_arena(
        name="star", outline=shapely.Polygon(corners), zones=(core,), wall_zone_m=0.03
    )


def _check_clearance(arena, xy, clear_m, rng):
    """A step shorter than the clearance ends in the zone where it started."""
    theta = rng.uniform(0, 2 * np.pi, len(xy))
    step = 0.999 * clear_m[:, None] * np.column_stack([np.cos(theta), np.sin(theta)])
    moved = clear_m > 0
    np.testing.assert_array_equal(arena.zone_of(xy[moved] + step[moved]), arena.zone_of(xy[moved]))
    assert (clear_m <= _away_from_borders(arena, xy)).all()


def _check_reach(arena, xy, tank, rng):
    """No step gains more than the best that is said to be within its reach."""
    reach_m, theta = rng.uniform(0, 0.3, len(xy)), rng.uniform(0, 2 * np.pi, len(xy))
    landing = arena.zone_of(xy + reach_m[:, None] * np.column_stack([np.cos(theta), np.sin(theta)]))
    for _ in range(4):
        gain = np.append(0.0, rng.uniform(0, 1, len(arena.zones)))
        assert (gain[landing] <= _best(xy, reach_m, gain, tank)).all()
        assert (gain[arena.zone_of(xy)] <= _best(xy, 0 * reach_m, gain, tank)).all()


@pytest.mark.parametrize("name", _cracked())
def test_what_a_step_gains_is_within_its_reach_beside_cracks_too(name):
    """Points on either side of a crack, and in it."""
    arena, xy, _ = _cracked()[name]
    _check_reach(arena, xy, make_tank(arena), np.random.default_rng(2))


def test_a_zone_counts_as_within_reach_only_where_it_nearly_is(two_rooms):
    """The corridor from any place of a room: at its distance, two diagonals before at most."""
    tank = make_tank(two_rooms)
    corridor = two_rooms.zones[0].polygon
    rng = np.random.default_rng(4)
    xy = rng.uniform((0.051, 0.599), (0.401, 0.949), (5000, 2))
    away_m = shapely.distance(corridor, shapely.points(xy))
    gain = np.array([0.0, 1.0, 0.0, 0.0])
    slack_m = 4 * math.sqrt(0.5) / tank.per_m + 2e-6

    assert (_best(xy, away_m, gain, tank) == 1.0).all()
    far = away_m > slack_m
    assert far.mean() > 0.9
    assert (_best(xy[far], away_m[far] - slack_m, gain, tank) == 0.0).all()


def test_the_clearance_is_all_but_a_cell_of_the_distance_to_a_border(two_rooms):
    """It would be of no use if it were much shorter: at most two half diagonals are lost."""
    rng = np.random.default_rng(1)
    xy = rng.uniform((0.051, 0.599), (0.401, 0.949), (5000, 2))
    tank = make_tank(two_rooms)

    _, found = _look_up(xy, tank)

    lost = _away_from_borders(two_rooms, xy) - found[:, 3]
    assert lost.max() < 2 * math.sqrt(0.5) / tank.per_m + 2e-6
    assert (found[:, 3] > 0).mean() > 0.8


def test_the_direction_along_the_wall_turns_smoothly_round_a_reflex_corner(two_rooms, twin):
    """Round the corridor's mouth, whichever ring order: equal to the twin's at every degree."""
    corner = np.array([0.330, 0.599])
    angles = np.radians(np.arange(-40, 85, 1.0))
    xy = corner + 0.02 * np.column_stack([np.cos(angles), np.sin(angles)])
    turned = dataclasses.replace(two_rooms, outline=shapely.reverse(two_rooms.outline))

    directions = []
    for arena in (two_rooms, turned):
        _, found = _look_up(xy, make_tank(arena))
        directions.append(np.arctan2(found[:, 2], found[:, 1]) % math.pi)

    expected = np.array([twin.wall_direction(two_rooms, point) for point in xy]) % math.pi
    turn = np.diff(np.unwrap(2 * directions[0]) / 2)
    assert np.abs(turn).max() <= math.radians(1.0) + 1e-9
    for found in directions:
        off = (found - expected + math.pi / 2) % math.pi - math.pi / 2
        assert off == pytest.approx(np.zeros(len(off)), abs=1e-9)


def test_all_arenas_are_of_one_type_for_the_compiler():
    """Whole numbers in a file are lengths too: another type would compile everything again."""
    whole = make_arena(
        name="whole numbers",
        outline=shapely.box(0, 0, 1, 1),
        wall_zone_m=0,
        bins=Bins(distance_m=(0, 1), wall_distance_m=(0, 1), speed_m_s=(0, 1)),
    )
    tanks = [make_tank(load_arena(name, Path()), cells=20) for name in ("two-rooms", "circular")]

    kinds = {numba.typeof(tank) for tank in [*tanks, make_tank(whole, cells=20)]}

    assert len(kinds) == 1

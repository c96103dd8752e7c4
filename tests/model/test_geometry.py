"""The kernels' arena: exact tests, and a grid that changes nothing."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import shapely
from numba import njit

from zfcal.arena import Zone, make_arena
from zfcal.artifacts.arenas import load_arena
from zfcal.model.kernels.geometry import nearest_wall, zone_exact, zone_of
from zfcal.model.tank import make_tank

HOLE = make_arena(
    name="tank with a post",
    outline=shapely.box(0, 0, 0.8, 0.5).difference(shapely.box(0.30, 0.2, 0.42, 0.31)),
    zones=(Zone(name="nook", follows_walls=True, polygon=shapely.box(0, 0, 0.2, 0.2)),),
    wall_zone_m=0.05,
)


@njit
def _classify(xy, tank):
    zones, exact = np.empty(len(xy), np.int64), np.empty(len(xy), np.int64)
    walls = np.full((len(xy), 3), np.nan)
    for k in range(len(xy)):
        zones[k] = zone_of(xy[k, 0], xy[k, 1], tank)
        exact[k] = zone_exact(xy[k, 0], xy[k, 1], tank)
        if zones[k] > 0:
            walls[k] = nearest_wall(xy[k, 0], xy[k, 1], tank)
    return zones, exact, walls


def _arena(name):
    return HOLE if name == "post" else load_arena(name, Path())


def _points_near_everything(arena, n=40_000):
    """Half uniform, half within 3 mm of a border of a zone."""
    rng = np.random.default_rng(2)
    x0, y0, x1, y1 = arena.outline.bounds
    anywhere = rng.uniform((x0 - 0.02, y0 - 0.02), (x1 + 0.02, y1 + 0.02), (n // 2, 2))
    lines = [arena.outline.boundary]
    lines += [zone.polygon.boundary for zone in arena.zones if zone.polygon is not None]
    lines.append(arena.outline.boundary.buffer(arena.wall_zone_m).boundary)
    border = shapely.union_all(lines)
    at = shapely.line_interpolate_point(
        shapely.line_merge(border), rng.uniform(0, border.length, n // 2)
    )
    close = np.column_stack([shapely.get_x(at), shapely.get_y(at)])
    return np.vstack([anywhere, close + rng.uniform(-0.003, 0.003, close.shape)])


@pytest.mark.slow
@pytest.mark.parametrize("name", ["two-rooms", "circular", "ring", "open-square", "post"])
def test_the_grid_changes_nothing(name):
    """Zone by grid, zone by exact test and zone by shapely are one, borders included."""
    arena = _arena(name)
    xy = _points_near_everything(arena)

    zones, exact, walls = _classify(xy, make_tank(arena))

    assert (zones == exact).all()
    assert (zones == arena.zone_of(xy)).all()
    inside = zones > 0
    assert walls[inside, 0] == pytest.approx(arena.wall_distance(xy[inside]), abs=1e-12)
    assert set(np.unique(zones)) == set(range(len(arena.zones) + 1))


@pytest.mark.slow
def test_the_wall_direction_is_perpendicular_to_the_nearest_point(two_rooms):
    """Along a flat wall it is the wall; at the reflex corner it turns with the bearing."""
    corner = np.array([0.330, 0.599])
    bearing = math.radians(70.0)
    points = np.array(
        [[0.20, 0.94], [0.055, 0.80], corner + 0.01 * np.array([1, math.tan(bearing)])]
    )

    _, _, walls = _classify(points, make_tank(two_rooms))

    directions = np.degrees(np.arctan2(walls[:, 2], walls[:, 1])) % 180
    assert directions == pytest.approx([0.0, 90.0, 160.0], abs=1e-9)


def test_on_the_wall_the_direction_is_the_segments():
    """An agent on the wall has no line to it: the segment gives the direction."""
    _, _, walls = _classify(np.array([[0.4, 0.0], [0.8, 0.3]]), make_tank(HOLE))
    flat = np.degrees(np.arctan2(walls[:, 2], walls[:, 1])) % 180

    # The far wall may count as outside; where inside, the direction is the wall's.
    assert flat[0] == pytest.approx(0.0)
    assert np.isnan(flat[1]) or flat[1] == pytest.approx(90.0)

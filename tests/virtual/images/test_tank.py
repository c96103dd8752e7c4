"""The empty tank in its two cameras."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from zfcal.artifacts.arenas import load_arena, shipped_arenas
from zfcal.cameras.rig import WALL_M, below_camera, overhead_camera
from zfcal.virtual.images.look import CLEAN, HARD, USUAL, look_of
from zfcal.virtual.images.tank import below_tank, overhead_tank, photographed


@pytest.fixture(params=shipped_arenas())
def arena(request):
    """Return each of the arenas that come with zfcal."""
    return load_arena(request.param, Path())


@pytest.fixture(scope="module")
def rooms():
    """Return two rooms and a corridor."""
    return load_arena("two-rooms", Path())


def pixel(camera, x_m, y_m):
    """Return row and column of a place."""
    column, row = np.rint(camera.to_pixels(np.array([x_m, y_m]))).astype(int)
    return row, column


def test_the_water_covers_the_arena(arena):
    """Where no wall may mirror anything: as many pixels as its area asks for, to 1 %."""
    camera = overhead_camera(arena)
    tank = overhead_tank(arena, camera, look_of(CLEAN), seed=1)
    x0, y0, x1, y1 = arena.outline.bounds
    ends = camera.to_pixels(
        np.array([((x0 + x1) / 2 - 0.05, (y0 + y1) / 2), ((x0 + x1) / 2 + 0.05, (y0 + y1) / 2)])
    )
    px_per_m = np.hypot(*(ends[1] - ends[0])) / 0.1
    assert (1 - tank.wall).sum() == pytest.approx(arena.outline.area * px_per_m**2, rel=0.02)


def test_walls_stand_around_the_water(arena):
    """Every place just inside has the floor's grey, every one just outside the wall's."""
    camera, look = overhead_camera(arena), look_of(CLEAN, {"defocus_px": 0.0})
    image = overhead_tank(arena, camera, look, seed=1).image
    inner = arena.outline.buffer(-0.01)
    outer = arena.outline.buffer(0.25 * WALL_M)
    for area, grey in ((inner, look.floor_grey), (outer, look.wall_grey - 12)):
        parts = [area.exterior, *area.interiors]
        places = [
            part.interpolate(share, normalized=True) for part in parts for share in (0.1, 0.4, 0.9)
        ]
        for place in places:
            assert abs(int(image[pixel(camera, place.x, place.y)]) - grey) < 25


def test_a_corridor_joins_two_rooms(rooms):
    """What lies between the rooms is water, what lies beside the corridor is not."""
    camera, look = overhead_camera(rooms), look_of(CLEAN)
    image = overhead_tank(rooms, camera, look, seed=1).image
    assert image[pixel(camera, 0.5, 0.5)] == look.floor_grey
    assert image[pixel(camera, 0.2, 0.2)] == look.outside_grey
    assert image[pixel(camera, 0.8, 0.8)] == look.outside_grey


def test_the_floor_has_a_pattern_and_specks_of_its_seed(rooms):
    """On a bad day more than usually; the same seed gives the same floor."""
    camera = overhead_camera(rooms)
    spread = []
    for preset in (CLEAN, USUAL, HARD):
        tank = overhead_tank(rooms, camera, look_of(preset), seed=3)
        again = overhead_tank(rooms, camera, look_of(preset), seed=3)
        assert np.array_equal(tank.image, again.image)
        inside = cv2.erode((tank.wall < 0.01).astype(np.uint8), np.ones((9, 9))) > 0
        spread.append(tank.image[inside].std())
    assert spread[0] < 0.5
    assert spread[1] > 1.0
    assert spread[2] > 2 * spread[1]
    other = overhead_tank(rooms, camera, look_of(USUAL), seed=4)
    usual = overhead_tank(rooms, camera, look_of(USUAL), seed=3)
    assert not np.array_equal(usual.image, other.image)


def test_specks_lie_in_the_water_alone(rooms):
    """As many as asked for: two hundred a square metre, give or take."""
    camera = overhead_camera(rooms)
    given = {"specks": 2000.0, "defocus_px": 0.0}
    dirty = overhead_tank(rooms, camera, look_of(CLEAN, given), seed=3)
    clean = overhead_tank(rooms, camera, look_of(CLEAN, {"defocus_px": 0.0}), seed=3)
    there = dirty.image != clean.image
    assert not (there & (dirty.wall > 0.9)).any()
    expected = 2000 * rooms.outline.area
    assert np.count_nonzero(there) == pytest.approx(expected, rel=0.15)
    assert (dirty.image[there] < clean.image[there]).all()


@pytest.mark.parametrize("preset", [CLEAN, USUAL, HARD])
def test_nothing_from_below_looks_like_an_led(rooms, preset):
    """The tank is grey: no channel stands out by more than a tenth, and nothing is bright."""
    image = below_tank(rooms, below_camera(rooms), look_of(preset), seed=1).astype(float)
    assert image.shape == (480, 640, 3)
    assert (image.max(axis=-1) - image.min(axis=-1) <= 0.13 * image.max(axis=-1) + 1).all()
    assert image.max() < 200


def test_a_photograph_takes_the_camera_s_size(rooms):
    """Grey or in colour, its middle stays in the middle."""
    photo = np.zeros((200, 300, 3), np.uint8)
    photo[90:110, 140:160] = 255
    for given in (photo, photo[..., 0]):
        found = photographed(given, overhead_camera(rooms))
        assert found.shape == (500, 500)
        assert found[250, 250] == 255
        assert found[100, 100] == 0

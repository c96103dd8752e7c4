"""The rig's two cameras over and under any arena."""

from pathlib import Path

import numpy as np
import pytest

from zfcal.artifacts.arenas import load_arena, shipped_arenas
from zfcal.cameras.rig import BELOW_PX, OVERHEAD_PX, WALL_M, below_camera, overhead_camera, side_m


@pytest.fixture(params=shipped_arenas())
def arena(request):
    """Return each of the arenas that come with zfcal."""
    return load_arena(request.param, Path())


def corners_of(arena, extra_m=0.0):
    """Return the corners of the rectangle around an arena."""
    x0, y0, x1, y1 = arena.outline.bounds
    x0, y0, x1, y1 = x0 - extra_m, y0 - extra_m, x1 + extra_m, y1 + extra_m
    return np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])


def test_the_overhead_camera_sees_the_tank_and_little_else(arena):
    """All of the water lies in the image, and fills most of its longer side."""
    camera = overhead_camera(arena)
    assert camera.size_px == OVERHEAD_PX
    pixels = camera.to_pixels(corners_of(arena))
    assert pixels.min() > 0
    assert pixels.max() < 499
    assert np.ptp(pixels, axis=0).max() > 0.7 * 500
    side_px = np.ptp(camera.to_pixels(corners_of(arena, WALL_M)), axis=0).max()
    assert side_px == pytest.approx(500 * (arena.extent_m + 2 * WALL_M) / side_m(arena), rel=0.03)


def test_up_is_up_above_and_down_below(arena):
    """The arena's y runs up in the overhead image; the image from below is its mirror image."""
    middle = corners_of(arena).mean(axis=0)
    ahead = middle + np.array([[0.0, 0.0], [0.1, 0.0], [0.0, 0.1]])
    above, below = (camera(arena).to_pixels(ahead) for camera in (overhead_camera, below_camera))
    assert above[1, 0] > above[0, 0]
    assert above[2, 1] < above[0, 1]
    assert below[1, 0] > below[0, 0]
    assert below[2, 1] > below[0, 1]


def test_the_camera_below_sees_all_of_the_tank(arena):
    """Though a fish-eye: what is farther out is smaller."""
    camera = below_camera(arena)
    pixels = camera.to_pixels(corners_of(arena))
    assert (pixels > 0).all()
    assert (pixels < np.array(BELOW_PX) - 1).all()
    middle, corner = corners_of(arena).mean(axis=0), corners_of(arena)[0]
    inner, outer = (
        np.hypot(*np.diff(camera.to_pixels(np.array([place, place + 0.01])), axis=0)[0])
        for place in (middle, corner)
    )
    assert outer < 0.8 * inner


@pytest.mark.parametrize("camera_of", [overhead_camera, below_camera])
def test_pixels_come_back_as_metres(arena, camera_of):
    """Within a hundredth of a millimetre, all over the water."""
    camera = camera_of(arena)
    x0, y0, x1, y1 = arena.outline.bounds
    places = np.random.default_rng(1).uniform((x0, y0), (x1, y1), (200, 2))
    np.testing.assert_allclose(camera.to_metres(camera.to_pixels(places)), places, atol=1e-5)


def test_the_lens_is_not_quite_a_pinhole(arena):
    """Straight lines bend by a pixel or so: a homography of the corners does not do."""
    camera = overhead_camera(arena)
    x0, y0, x1, _ = arena.outline.bounds
    line = camera.to_pixels(np.stack([np.linspace(x0, x1, 21), np.full(21, y0)], axis=1))
    ends = line[-1] - line[0]
    away = (line - line[0]) @ (np.array([-ends[1], ends[0]]) / np.hypot(*ends))
    assert 0.3 < np.abs(away).max() < 4

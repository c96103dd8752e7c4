"""Drawn images of the camera below: where the LEDs lie in them."""

import math

import cv2
import numpy as np
import pytest
import shapely

from zfcal.arena import make_arena
from zfcal.cameras.rig import below_camera
from zfcal.virtual.images.bodies import Bodies
from zfcal.virtual.images.look import CLEAN, HARD, USUAL, look_of
from zfcal.virtual.images.render_below import BelowPainter, led_places
from zfcal.virtual.images.swimming import Moment

ARENA = make_arena(name="square", outline=shapely.box(0, 0, 1, 1))
CAMERA = below_camera(ARENA)


def robots_at(xy_m, heading_rad, *, number=0, n_fish=0):
    """Return a moment with fish in the middle of the tank and robots where asked for."""
    xy_m = np.concatenate([np.full((n_fish, 2), 0.5), np.atleast_2d(xy_m)])
    n = len(xy_m)
    bodies = Bodies(
        xy_m=xy_m,
        heading_rad=np.concatenate([np.zeros(n_fish), np.atleast_1d(heading_rad)]),
        length_m=np.full(n, 0.045),
        bend_rad=np.zeros(n),
        wave_rad=np.zeros(n),
        phase_rad=np.zeros(n),
    )
    return Moment(
        number=number,
        time_s=number / 15,
        is_robot=np.arange(n) >= n_fish,
        bodies=bodies,
        velocity_m_s=np.zeros((n, 2)),
    )


def green_blobs(image, least=90):
    """Return the centroids of what is greener than that, weighted by how green it is."""
    green = image[..., 1].astype(float) - np.maximum(image[..., 0], image[..., 2])
    count, labels = cv2.connectedComponents((green > least).astype(np.uint8))
    found = []
    for label in range(1, count):
        rows, columns = np.nonzero(labels == label)
        weight = green[rows, columns]
        found.append((columns @ weight / weight.sum(), rows @ weight / weight.sum()))
    return np.array(found)


def test_two_leds_by_hand():
    """A robot that heads along y has one 15 mm above and one 15 mm below its position."""
    places = led_places(np.array([0.2, 0.3]), math.pi / 2, 0.03)
    np.testing.assert_allclose(places, [(0.2, 0.315), (0.2, 0.285)], atol=1e-12)


@pytest.mark.parametrize("seed", range(12))
def test_leds_project_back(seed):
    """Their midpoint is the position to 0.1 mm, their axis the heading to a degree or two."""
    rng = np.random.default_rng(seed)
    place, heading = rng.uniform(0.05, 0.95, 2), rng.uniform(-np.pi, np.pi)
    image = BelowPainter(ARENA, CAMERA, look_of(CLEAN), seed=1).paint(robots_at(place, heading))
    blobs_m = CAMERA.to_metres(green_blobs(image, 8))
    assert len(blobs_m) == 2
    np.testing.assert_allclose(blobs_m.mean(axis=0), place, atol=1e-4)
    axis = math.atan2(*(blobs_m[0] - blobs_m[1])[::-1])
    off = (axis - heading + math.pi / 2) % math.pi - math.pi / 2
    assert abs(math.degrees(off)) < 1.5
    assert np.hypot(*(blobs_m[0] - blobs_m[1])) == pytest.approx(0.03, rel=0.03)


@pytest.mark.parametrize(("preset", "worst_mm"), [(USUAL, 0.4), (HARD, 0.8)])
def test_leds_stand_out_in_noise(preset, worst_mm):
    """Two green blobs in four frames of five, near the robot, with reflections and noise."""
    painter = BelowPainter(ARENA, CAMERA, look_of(preset), seed=3)
    rng = np.random.default_rng(4)
    errors_mm = []
    for number in range(20):
        place, heading = rng.uniform(0.1, 0.9, 2), rng.uniform(-np.pi, np.pi)
        blobs = green_blobs(painter.paint(robots_at(place, heading, number=number)), 140)
        if len(blobs) == 2:
            errors_mm.append(1e3 * np.hypot(*(CAMERA.to_metres(blobs).mean(axis=0) - place)))
    assert len(errors_mm) >= 16
    assert np.median(errors_mm) < worst_mm


def test_fish_are_not_seen_from_below():
    """Nor is anything else that has no LEDs."""
    painter = BelowPainter(ARENA, CAMERA, look_of(CLEAN), seed=1)
    moment = robots_at(np.empty((0, 2)), np.empty(0), n_fish=3)
    assert np.array_equal(painter.paint(moment), painter.empty)


def test_further_robots_have_another_colour():
    """The first one's is green; the second one's is not."""
    painter = BelowPainter(ARENA, CAMERA, look_of(CLEAN), seed=1)
    image = painter.paint(robots_at([(0.3, 0.3), (0.7, 0.7)], [0.0, 1.0]))
    blobs_m = CAMERA.to_metres(green_blobs(image))
    assert len(blobs_m) == 2
    np.testing.assert_allclose(blobs_m.mean(axis=0), (0.3, 0.3), atol=3e-4)
    x, y = np.rint(CAMERA.to_pixels(led_places(np.array([0.7, 0.7]), 1.0, 0.03))[0]).astype(int)
    blue, green, red = image[y, x].astype(int)
    assert red > 200
    assert red > 2 * max(blue, green)


def test_a_robot_at_the_edge_breaks_nothing():
    """Nor does one outside the image."""
    places = CAMERA.to_metres(np.array([[2.0, 2.0], [320.0, 478.0]]))
    painter = BelowPainter(ARENA, CAMERA, look_of(HARD), seed=1)
    image = painter.paint(robots_at([*places, (4.0, 4.0)], np.zeros(3)))
    assert image.shape == (480, 640, 3)
    assert image.dtype == np.uint8


def test_the_same_moment_gives_the_same_image():
    """Another frame has other noise."""
    look = look_of(USUAL)
    moment = robots_at((0.4, 0.4), 0.3, number=9)
    first = BelowPainter(ARENA, CAMERA, look, seed=2).paint(moment)
    assert np.array_equal(first, BelowPainter(ARENA, CAMERA, look, seed=2).paint(moment))
    other = robots_at((0.4, 0.4), 0.3, number=10)
    assert not np.array_equal(first, BelowPainter(ARENA, CAMERA, look, seed=2).paint(other))

"""What is compiled of painting gives, bit by bit, what was painted before it was compiled."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from zfcal.artifacts.arenas import load_arena
from zfcal.cameras.rig import below_camera, overhead_camera
from zfcal.tracks import Tracks
from zfcal.virtual.images import _painting, painting, render, render_below, ripples
from zfcal.virtual.images.look import CLEAN, HARD, USUAL, look_of
from zfcal.virtual.images.painting import FINE, Fill, Patch
from zfcal.virtual.images.render import OverheadPainter
from zfcal.virtual.images.render_below import BelowPainter
from zfcal.virtual.images.swimming import Moment, swimming

_spec = importlib.util.spec_from_file_location(
    "plain", Path(__file__).with_name("plain_painting.py")
)
plain = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(plain)

PARTS = float(1 << plain.SHIFT)


@pytest.fixture(scope="module")
def two_rooms():
    """Return the tank of two rooms."""
    return load_arena("two-rooms", Path())


@pytest.fixture
def rng():
    """Return random numbers of a seed."""
    return np.random.default_rng(8)


def rings(rng):
    """Yield polygons of all kinds: round, thin, crossing themselves, with corners on corners."""
    for n in (3, 4, 7, 42):
        for size in (0.05, 1.0, 30.0):
            ring = rng.normal(50.0, size, (n, 2))
            yield ring
            yield np.repeat(ring, 2, axis=0)
            yield np.round(ring)
            yield ring[::-1] * (1.0, 0.001)


def patches(rng, high=9, wide=7):
    """Yield patches in the middle of an image of 20 by 30, over each edge, and outside it."""
    for x in (-40, -7, -3, 0, 11, 27, 30, 50):
        for y in (-40, -9, -4, 0, 6, 15, 20, 50):
            cover = rng.random((high, wide), np.float32)
            ink = (300 * rng.random((high, wide), np.float32) * cover).astype(np.float32)
            yield Patch(corner_px=(x, y), cover=cover, ink=ink)


def grey(rng, *shape):
    """Return an image in which all levels are."""
    return rng.integers(0, 256, shape, np.uint8)


def test_corners_come_to_the_same_64th_of_a_fine_pixel(rng):
    """Moved inwards or not, whichever way round, and where there is no inside at all."""
    low = (31, -7)
    for ring in rings(rng):
        outline = np.ascontiguousarray(ring)
        for inner, sharpest in ((False, plain.SHARPEST), (True, 0.0)):
            found = _painting.fine_points(outline, low, FINE, PARTS, sharpest)
            np.testing.assert_array_equal(found, plain.fine_points(ring, low, inner=inner))


def test_means_of_blocks_are_rounded_alike(rng):
    """Halves go to the even level: 128 of 256 fine pixels at 1, 3 and 5."""
    fine = grey(rng, 3 * FINE, 5 * FINE, 2)
    fine[:, : 2 * FINE][rng.random((3 * FINE, 2 * FINE)) < 0.9] = 0
    np.testing.assert_array_equal(_painting.block_means(fine, FINE), plain.block_means(fine))
    fine = np.zeros((FINE, 2 * FINE, 2), np.uint8)
    fine[: FINE // 2, :FINE], fine[: FINE // 2, FINE:] = (1, 3), (5, 255)
    found = _painting.block_means(fine, FINE)
    np.testing.assert_array_equal(found, plain.block_means(fine))
    np.testing.assert_array_equal(found, [[[0, 2], [2, 128]]])


def test_the_fullest_block_does_not_overflow():
    """256 fine pixels of 255: columns are added up in 16 bits."""
    fine = np.full((FINE, FINE, 2), 255, np.uint8)
    np.testing.assert_array_equal(_painting.block_means(fine, FINE), [[[255, 255]]])


def test_patches_are_the_same(rng):
    """One polygon, and three over each other, sharp and blurred."""
    for ring in rings(rng):
        fills = [
            Fill(corners_px=ring, grey=70.3),
            Fill(corners_px=ring + 0.3, grey=220.0, opacity=0.4),
            Fill(corners_px=(ring - 50.0) * 0.5 + 50.0, grey=13.0, inner=True),
        ]
        for some, blur_px in ((fills[:1], 0.0), (fills, 0.6), (fills, 1.6)):
            found = painting.patch_of(some, blur_px=blur_px)
            expected = plain.patch_of(some, blur_px=blur_px)
            assert found.corner_px == expected.corner_px
            np.testing.assert_array_equal(found.cover, expected.cover)
            np.testing.assert_array_equal(found.ink, expected.ink)


def test_patches_lie_over_images_alike(rng):
    """Within the image, over each edge and outside, where nothing is changed."""
    for patch in patches(rng):
        image = grey(rng, 20, 30)
        expected = image.copy()
        painting.lay_over(image, patch)
        plain.lay_over(expected, patch)
        np.testing.assert_array_equal(image, expected)


@pytest.mark.parametrize("shape", [(20, 30), (20, 30, 3)])
def test_light_is_taken_alike(rng, shape):
    """Everywhere or in places, of one channel or of three."""
    for patch in patches(rng):
        only = rng.random(shape[:2], np.float32)
        for where in (None, only):
            image = grey(rng, *shape)
            expected = image.copy()
            painting.darken(image, patch, 0.35, where)
            plain.darken(expected, patch, 0.35, where)
            np.testing.assert_array_equal(image, expected)


def test_noise_is_added_alike(rng):
    """Also where it would go below black or above white."""
    image = grey(rng, 20, 30)
    one, other = (rng.integers(-300, 301, (64, 70)).astype(np.int16) for _ in range(2))
    for top, left in ((0, 0), (44, 40), (3, 39)):
        found = _painting.add_field(image, one, top, left)
        np.testing.assert_array_equal(found, plain.add_field(image, one, top, left))
        places = np.array([(top, left), (7, 11)])
        found = _painting.add_fields(image, one, other, places)
        np.testing.assert_array_equal(found, plain.add_fields(image, one, other, places))
    assert {0, 255} <= set(found.ravel().tolist())


def test_lights_are_drawn_as_far_as_they_show(rng):
    """What is left out of a light is less than half a level: the image is the same."""
    for glow in (0.0, 0.005, 0.12, 0.3, 1.0):
        for place in [*rng.uniform((-5, -5), (105, 85), (40, 2)), (50.0, 40.0), (0.5, 79.5)]:
            image = grey(rng, 80, 100, 3)
            expected = image.copy()
            colour = rng.random(3, np.float32)
            radius_px = float(rng.uniform(0.5, 9.0))
            render_below._add_light(image, np.asarray(place), radius_px, glow, colour)
            plain.add_light(expected, np.asarray(place), radius_px, glow, colour)
            np.testing.assert_array_equal(image, expected)


def test_mirrors_are_found_alike(two_rooms, rng):
    """In corners, along walls, in the middle; with any reach."""
    walls = render._Walls(two_rooms)
    x0, y0, x1, y1 = two_rooms.outline.bounds
    for xy_m in rng.uniform((x0, y0), (x1, y1), (300, 2)):
        for reach_m in (0.0, 0.045, 0.3):
            found = walls.near(xy_m, reach_m)
            expected = plain.near_walls(two_rooms, xy_m, reach_m)
            assert len(found) == len(expected)
            for own, other in zip(found, expected, strict=True):
                assert own[2] == other[2]
                np.testing.assert_array_equal(own[:2], other[:2])


def moments(arena, look):
    """Return four fish and a robot that circle near a wall, now and a second later."""
    _, _, x1, y1 = arena.outline.bounds
    angle = np.arange(31)[:, None] / 9 + np.arange(5) * 1.3
    reach_m = 0.05 + 0.02 * np.arange(5)
    frame, agent = (each.ravel() for each in np.indices(angle.shape))
    tracks = Tracks(
        time_s=frame / 15,
        frame=frame.astype(np.int64),
        agent=agent.astype(np.int32),
        kind=(agent == 4).astype(np.int8),
        x_m=(x1 - 0.14 + reach_m * np.cos(angle)).ravel(),
        y_m=(y1 - 0.14 + reach_m * np.sin(angle)).ravel(),
        heading_rad=np.full(angle.size, np.nan, np.float32),
        confidence=np.ones(angle.size, np.float32),
    )
    swum = swimming(tracks, look, fps=15.0, seed=2)
    return [swum.at(row) for row in range(0, 31, 6)]


def images_of(arena, look) -> list[np.ndarray]:
    """Return what both cameras see of some moments."""
    above = OverheadPainter(arena, overhead_camera(arena), look, seed=6)
    under = BelowPainter(arena, below_camera(arena), look, seed=6)
    seen: list[Moment] = moments(arena, look)
    return [painter.paint(moment) for painter in (above, under) for moment in seen]


@pytest.mark.parametrize("preset", [CLEAN, USUAL, HARD])
def test_whole_images_are_what_they_were(two_rooms, monkeypatch, preset):
    """Of both cameras: drawn with the compiled parts, and with the plain ones in their places."""
    look = look_of(preset)
    found = images_of(two_rooms, look)
    for module in (render, render_below):
        monkeypatch.setattr(module, "patch_of", plain.patch_of)
        monkeypatch.setattr(module, "darken", plain.darken)
    monkeypatch.setattr(render, "lay_over", plain.lay_over)
    monkeypatch.setattr(render_below, "_add_light", plain.add_light)
    monkeypatch.setattr(ripples, "add_fields", plain.add_fields)
    monkeypatch.setattr(painting._painting, "add_field", plain.add_field)
    for own, other in zip(found, images_of(two_rooms, look), strict=True):
        np.testing.assert_array_equal(own, other)
    assert len({image.tobytes() for image in found}) > 9

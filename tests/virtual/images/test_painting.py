"""Polygons with sub-pixel edges, and noise."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from zfcal.virtual.images.painting import (
    Fill,
    Noise,
    Patch,
    darken,
    lay_over,
    mean_patch,
    patch_of,
    smooth_field,
)
from zfcal.virtual.images.ripples import Ripples


def box(x0, y0, x1, y1):
    """Return the corners of a rectangle in pixels."""
    return np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], float)


def painted(fills, shape=(12, 12), ground=0, **options):
    """Return an image with polygons on an even ground."""
    image = np.full(shape, ground, np.uint8)
    lay_over(image, patch_of(fills, **options))
    return image


def test_a_whole_pixel_is_painted_whole():
    """From the left edge of pixel 3, which is at 2.5, to the right one of pixel 4."""
    image = painted([Fill(corners_px=box(2.5, 5.5, 4.5, 6.5), grey=200.0)])
    expected = np.zeros((12, 12))
    expected[6, 3:5] = 200
    np.testing.assert_allclose(image, expected, atol=2)


def test_half_a_pixel_is_half_as_bright():
    """Cut in the middle of a pixel, to a thirtieth."""
    image = painted([Fill(corners_px=box(2.5, 2.5, 4.0, 4.5), grey=200.0)], ground=0)
    assert image[3, 3] == pytest.approx(200, abs=3)
    assert image[3, 4] == pytest.approx(100, abs=7)
    assert image[3, 5] == 0


@given(
    x=st.floats(8, 20),
    y=st.floats(8, 20),
    radius=st.floats(3.0, 7.0),
    corners=st.integers(3, 12),
    turned=st.floats(0, 6),
    backwards=st.booleans(),
)
def test_area_and_centroid_are_those_of_the_polygon(x, y, radius, corners, turned, backwards):
    """Whichever way round: to 3 %, and as well as a grid of pixels knows a place."""
    angle = turned + 2 * np.pi * np.arange(corners) / corners * (-1 if backwards else 1)
    ring = np.stack([x + radius * np.cos(angle), y + radius * np.sin(angle)], axis=1)
    patch = patch_of([Fill(corners_px=ring, grey=0.0)])
    area = corners / 2 * radius**2 * np.sin(2 * np.pi / corners)
    assert patch.cover.sum() == pytest.approx(area, rel=0.03)
    down, across = np.indices(patch.cover.shape)
    middle = np.array([(across * patch.cover).sum(), (down * patch.cover).sum()])
    found = middle / patch.cover.sum() + patch.corner_px
    np.testing.assert_allclose(found, (x, y), atol=0.06)


def test_later_polygons_cover_earlier_ones():
    """Also where the first one lets light through."""
    both = [
        Fill(corners_px=box(1.5, 1.5, 8.5, 8.5), grey=100.0, opacity=0.5),
        Fill(corners_px=box(3.5, 3.5, 5.5, 5.5), grey=20.0),
    ]
    image = painted(both, ground=200)
    assert image[2, 2] == pytest.approx(150, abs=2)
    assert image[5, 5] == pytest.approx(20, abs=2)
    assert image[10, 10] == 200


def test_a_blur_keeps_the_amount():
    """It spreads what is covered."""
    fills = [Fill(corners_px=box(3.5, 3.5, 6.5, 6.5), grey=0.0)]
    sharp, soft = patch_of(fills), patch_of(fills, blur_px=1.2)
    assert soft.cover.sum() == pytest.approx(sharp.cover.sum(), rel=0.01)
    assert soft.cover.max() < sharp.cover.max()


def test_a_mean_of_patches_covers_the_way_between():
    """Half each of two bodies apart; one alone is itself."""
    here = patch_of([Fill(corners_px=box(1.5, 1.5, 2.5, 2.5), grey=80.0)])
    there = patch_of([Fill(corners_px=box(6.5, 1.5, 7.5, 2.5), grey=80.0)])
    image = np.full((10, 10), 200, np.uint8)
    lay_over(image, mean_patch([here, there]))
    assert image[2, 2] == image[2, 7] == pytest.approx(140, abs=3)
    assert image[2, 4] == 200
    assert mean_patch([here]) is here


@pytest.mark.parametrize("corner", [(-3, -2), (8, 9), (-40, 3), (30, 30)])
def test_what_lies_outside_an_image_is_cut(corner):
    """What lies inside is laid over it."""
    patch = Patch(
        corner_px=corner, cover=np.ones((5, 6), np.float32), ink=np.full((5, 6), 9, np.float32)
    )
    image = np.full((12, 12), 200, np.uint8)
    lay_over(image, patch)
    x, y = corner
    wide = max(0, min(x + 6, 12) - max(x, 0))
    high = max(0, min(y + 5, 12) - max(y, 0))
    assert np.count_nonzero(image == 9) == wide * high
    dark = np.full((12, 12), 200, np.uint8)
    darken(dark, patch, 0.5)
    assert np.count_nonzero(dark == 100) == wide * high


def test_darkness_falls_only_where_it_may():
    """A mask says where."""
    image = np.full((4, 4), 200, np.uint8)
    only = np.zeros((4, 4), np.float32)
    only[:, 2:] = 1
    ones = np.ones((4, 4), np.float32)
    darken(image, Patch(corner_px=(0, 0), cover=ones, ink=ones), 0.25, only)
    assert (image[:, :2] == 200).all()
    assert (image[:, 2:] == 150).all()


def test_noise_has_the_asked_spread_and_follows_its_generator():
    """Within 2 %; colour channels have their own."""
    noise = Noise((200, 300, 3), 6.0, seed=1)
    ground = np.full((200, 300, 3), 128, np.uint8)
    first = noise.add_to(ground, np.random.default_rng(3))
    off = first.astype(float) - 128
    assert off.std() == pytest.approx(6.0, rel=0.02)
    assert abs(np.corrcoef(off[..., 0].ravel(), off[..., 1].ravel())[0, 1]) < 0.02
    assert np.array_equal(first, noise.add_to(ground, np.random.default_rng(3)))
    assert not np.array_equal(first, noise.add_to(ground, np.random.default_rng(4)))
    assert (ground == 128).all()


def test_noise_stays_within_what_a_pixel_holds():
    """Black does not wrap round to white."""
    noise = Noise((60, 60), 9.0, seed=1)
    rng = np.random.default_rng(1)
    assert noise.add_to(np.zeros((60, 60), np.uint8), rng).max() < 60
    assert noise.add_to(np.full((60, 60), 255, np.uint8), rng).min() > 195


def test_ripples_drift_and_keep_their_height():
    """A moment later they are nearly the same, seconds later others."""
    ripples = Ripples((120, 160), 5.0, 10.0, seed=2)
    ground = np.full((120, 160), 128, np.uint8)
    first, soon, late = (
        ripples.add_to(ground, time_s).astype(float) - 128 for time_s in (0.0, 0.07, 5.0)
    )
    assert first.std() == pytest.approx(5.0, rel=0.25)
    assert np.corrcoef(first.ravel(), soon.ravel())[0, 1] > 0.7
    assert abs(np.corrcoef(first.ravel(), late.ravel())[0, 1]) < 0.5
    still = Ripples((120, 160), 0.0, 10.0, seed=2)
    assert np.array_equal(still.add_to(ground, 3.0), ground)


def test_a_smooth_field_has_no_seam():
    """Its edges meet, its spread is one."""
    field = smooth_field(np.random.default_rng(1), (80, 90), 6.0)
    assert field.std() == pytest.approx(1, abs=1e-4)
    inner = np.abs(np.diff(field, axis=0)).max()
    assert np.abs(field[0] - field[-1]).max() < 1.5 * inner

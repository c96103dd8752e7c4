"""Lenses: pixels to rays and back."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from zfcal.cameras.lens import FISHEYE, PINHOLE, Lens
from zfcal.errors import InputError

# The kind of lens that the older rig looks up with: f = 226 px, 14 coefficients.
WIDE = Lens(
    size_px=(640, 480),
    model=PINHOLE,
    matrix=((226.0, 0, 328.0), (0, 226.0, 238.0), (0, 0, 1)),
    distortion=(0.224, -0.043, -7e-4, 3e-4, -0.00135, 0.558, -0.0343, -0.00943, 0, 0, 0, 0, 0, 0),
)
FISH_EYE = Lens(
    size_px=(640, 480),
    model=FISHEYE,
    matrix=((200.0, 0, 320.0), (0, 201.0, 240.0), (0, 0, 1)),
    distortion=(-0.02, 0.003, -0.001, 0.0002),
)
TILTED = Lens(
    size_px=(500, 500),
    model=PINHOLE,
    matrix=((600.0, 0, 251.0), (0, 598.0, 248.0), (0, 0, 1)),
    distortion=(-0.2, 0.05, 1e-3, -2e-3, 0, 0.2, 0, 0, 1e-3, 0, -1e-3, 0, 0.01, -0.02),
)
PLAIN = Lens(
    size_px=(500, 500),
    model=PINHOLE,
    matrix=((600.0, 0, 250.0), (0, 600.0, 250.0), (0, 0, 1)),
    distortion=(),
)
LENSES = [WIDE, FISH_EYE, TILTED, PLAIN]


def grid(lens, step=8):
    """Return pixels all over the image."""
    width, height = lens.size_px
    across, down = np.meshgrid(np.arange(0, width, step), np.arange(0, height, step))
    return np.stack([across, down], axis=-1).astype(np.float64)


@pytest.mark.parametrize("lens", LENSES)
def test_every_pixel_that_has_a_ray_comes_back_exactly(lens):
    """Within a millionth of a pixel, all over the image."""
    pixels = grid(lens)
    rays = lens.to_rays(pixels)
    seen = np.isfinite(rays).all(axis=-1)
    assert seen.mean() > 0.6
    np.testing.assert_allclose(lens.to_pixels(rays)[seen], pixels[seen], atol=1e-6)


@pytest.mark.parametrize("lens", LENSES)
@given(
    angle=st.floats(0, 2 * math.pi, exclude_max=True),
    share=st.floats(0.0, 0.97),
)
def test_every_ray_that_the_lens_can_see_comes_back(lens, angle, share):
    """Also at wide angles, where OpenCV's own inverse stops too early."""
    # Decentring, of a real lens a matter of the image's margin, takes over far outside of it.
    widest = math.tan(share * math.atan(1.0 if lens is TILTED else lens.widest_ray))
    ray = widest * np.array([math.cos(angle), math.sin(angle)])
    pixel = lens.to_pixels(ray)
    back = lens.to_rays(pixel)
    # The smallest error that a pixel's last digits allow grows with the angle.
    np.testing.assert_allclose(np.arctan(back), np.arctan(ray), atol=1e-6)


def test_a_wide_lens_has_pixels_that_no_ray_reaches():
    """Its image ends about 260 px from the middle, so the corner is NaN."""
    corner, inside = WIDE.to_rays(np.array([[0.0, 0.0], [328.0 + 230.0, 238.0]]))
    assert np.isnan(corner).all()
    assert np.isfinite(inside).all()


@pytest.mark.parametrize("lens", LENSES)
def test_a_ray_beyond_the_widest_has_no_pixel(lens):
    """The polynomial folds back there, and would put it into the image."""
    assert np.isnan(lens.to_pixels(np.array([lens.widest_ray * 1.01, 0.0]))).all()
    assert np.isfinite(lens.to_pixels(np.array([lens.widest_ray * 0.99, 0.0]))).all()


def test_an_equidistant_fish_eye_by_hand():
    """Without coefficients a ray at 45 degrees lands pi / 4 focal lengths from the middle."""
    lens = Lens(
        size_px=(640, 480),
        model=FISHEYE,
        matrix=((200.0, 0, 320.0), (0, 200.0, 240.0), (0, 0, 1)),
        distortion=(0, 0, 0, 0),
    )
    pixel = np.array([320 + 200 * math.pi / 4, 240])
    np.testing.assert_allclose(lens.to_pixels(np.array([1.0, 0.0])), pixel)
    np.testing.assert_allclose(lens.to_rays(pixel), [1.0, 0.0], atol=1e-9)


def test_what_is_lost_stays_lost_and_harms_nobody_else():
    """NaN and infinity in, NaN out, the neighbours as without them."""
    alone = WIDE.to_rays(np.array([400.0, 300.0]))
    together = WIDE.to_rays(np.array([[np.nan, 1.0], [400.0, 300.0], [np.inf, 0.0], [1e9, 1e9]]))
    np.testing.assert_array_equal(together[1], alone)
    assert np.isnan(together[[0, 2, 3]]).all()
    assert WIDE.to_rays(np.empty((0, 2))).shape == (0, 2)
    assert WIDE.to_pixels(np.empty((0, 3, 2))).shape == (0, 3, 2)


@pytest.mark.parametrize("lens", LENSES)
def test_pixels_far_outside_alone_have_no_ray_or_their_own(lens):
    """None of them within the lens's reach: NaN, or a ray that comes back."""
    far = np.array([[-5e4, -5e4], [9e4, 100.0]])
    rays = lens.to_rays(far)
    back = lens.to_pixels(rays)
    assert np.isnan(rays).all(axis=1).any()
    np.testing.assert_allclose(back[np.isfinite(back)], far[np.isfinite(back)], atol=1e-5)


def test_half_the_size_sees_the_same_rays():
    """The middle of the first 2 x 2 pixels is that of the first pixel of the half image."""
    half = WIDE.scaled((320, 240))
    assert half.size_px == (320, 240)
    pixels = np.array([[300.0, 200.0], [100.0, 300.0]])
    np.testing.assert_allclose(
        half.to_rays((pixels + 0.5) / 2 - 0.5), WIDE.to_rays(pixels), atol=1e-9
    )


def test_another_ratio_of_sides_cannot_be_scaled_to():
    """640 x 480 is 4 : 3, a square is not."""
    with pytest.raises(InputError, match="640 x 480 images cannot be scaled to 500 x 500"):
        WIDE.scaled((500, 500))


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"model": "mirror"}, "must be pinhole or fisheye, got 'mirror'"),
        ({"size_px": (0, 480)}, "must be width and height in pixels"),
        ({"distortion": (1.0, 2.0)}, "4 or 5 or 8 or 12 or 14 distortion coefficients, got 2"),
        ({"distortion": (math.nan, 0.0, 0.0, 0.0)}, "must be finite"),
        ({"matrix": ((0, 0, 1), (0, 1, 1), (0, 0, 1))}, "Focal lengths must be positive"),
        ({"matrix": ((1, 0), (0, 1))}, "three rows of three finite numbers"),
        ({"matrix": ((1, 0, 1), (0, 1, 1), (0, 1, 1))}, r"\(0, 0, 1\)"),
        ({"matrix": ((math.nan, 0, 1), (0, 1, 1), (0, 0, 1))}, "finite"),
    ],
)
def test_a_lens_that_cannot_be_is_refused(change, says):
    """With what was expected and what was got."""
    given = {
        "size_px": (640, 480),
        "model": PINHOLE,
        "matrix": ((200.0, 0, 320.0), (0, 200.0, 240.0), (0, 0, 1)),
        "distortion": (),
    }
    with pytest.raises(InputError, match=says):
        Lens(**{**given, **change})

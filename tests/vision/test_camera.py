"""Cameras: pixels to metres and back."""

from __future__ import annotations

import math

import numpy as np
import pytest

from zfcal.errors import InputError
from zfcal.vision.camera import FISHEYE, PINHOLE, Camera, Homography

POINTS_M = np.array([[0.0, 0.0], [1.0, 1.0], [0.3, 0.7], [np.nan, np.nan]])

ABOVE = Camera(
    size_px=(500, 500),
    model=PINHOLE,
    matrix=((600, 0, 250), (0, 600, 250), (0, 0, 1)),
    distortion=(-0.1, 0.01, 0, 0, 0),
    rotation_rad=(math.pi, 0, 0),
    translation_m=(-0.5, 0.5, 1.2),
)
BELOW = Camera(
    size_px=(640, 480),
    model=FISHEYE,
    matrix=((200, 0, 320), (0, 200, 240), (0, 0, 1)),
    distortion=(0.01, 0, 0, 0),
    rotation_rad=(0, 0, 0),
    translation_m=(-0.5, -0.5, 0.4),
)


@pytest.mark.parametrize("camera", [ABOVE, BELOW])
def test_a_point_goes_to_its_pixel_and_back(camera):
    """Within a micrometre; what is lost stays lost."""
    back = camera.to_metres(camera.to_pixels(POINTS_M))
    np.testing.assert_allclose(back, POINTS_M, atol=1e-6)


def test_a_pinhole_by_hand():
    """Half a metre beside the axis, 1.2 m away, without distortion: 600 * 0.5 / 1.2 = 250 px."""
    camera = Camera(
        size_px=(500, 500),
        model=PINHOLE,
        matrix=((600, 0, 250), (0, 600, 250), (0, 0, 1)),
        distortion=(),
        rotation_rad=(math.pi, 0, 0),
        translation_m=(-0.5, 0.5, 1.2),
    )
    np.testing.assert_allclose(camera.to_pixels(np.array([1.0, 1.0])), [500, 0], atol=1e-9)


def test_a_homography_goes_both_ways():
    """500 px are a metre, y turned over."""
    grid = Homography(size_px=(500, 500), matrix=((0.002, 0, 0), (0, -0.002, 1), (0, 0, 1)))
    np.testing.assert_allclose(grid.to_metres(np.array([500.0, 0.0])), [1, 1])
    np.testing.assert_allclose(grid.to_pixels(np.array([[1.0, 1.0]])), [[500, 0]])


def test_a_lens_with_the_wrong_number_of_coefficients_is_refused():
    """A fish-eye has four."""
    with pytest.raises(InputError, match="4 distortion coefficients, got 2"):
        Camera(
            size_px=(1, 1),
            model=FISHEYE,
            matrix=((1, 0, 0), (0, 1, 0), (0, 0, 1)),
            distortion=(0, 0),
            rotation_rad=(0, 0, 0),
            translation_m=(0, 0, 1),
        )

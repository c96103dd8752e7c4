"""Cameras: pixels to metres and back."""

from __future__ import annotations

import math

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from zfcal.cameras.camera import FISHEYE, PINHOLE, Camera, Homography, check_fits
from zfcal.errors import InputError

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
    """Within ten nanometres; what is lost stays lost."""
    back = camera.to_metres(camera.to_pixels(POINTS_M))
    np.testing.assert_allclose(back, POINTS_M, atol=1e-8)


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


def tipped(angle_rad, *, model=PINHOLE):
    """Return a camera 1 m above the origin that looks down, tipped toward y by an angle."""
    down = np.diag([1.0, -1.0, -1.0])
    tip = cv2.Rodrigues(np.array([-angle_rad, 0.0, 0.0]))[0]
    rotation = tip @ down
    lens = ABOVE.lens if model == PINHOLE else BELOW.lens
    return Camera.of(lens, cv2.Rodrigues(rotation)[0], rotation @ np.array([0.0, 0.0, -1.0]))


@pytest.mark.parametrize("model", [PINHOLE, FISHEYE])
def test_what_lies_behind_the_camera_has_no_pixel(model):
    """It would be seen upside down, at a place that belongs to somebody else."""
    camera = tipped(math.radians(60), model=model)
    before, behind = camera.to_pixels(np.array([[0.0, 1.5], [0.0, -3.0]]))
    assert np.isfinite(before).all()
    assert np.isnan(behind).all()


def test_a_ray_above_the_horizon_meets_no_plane():
    """Tipped by 80 degrees, half of the image sees the sky: NaN there, metres below."""
    camera = tipped(math.radians(80))
    above, below = camera.to_metres(np.array([[250.0, 20.0], [250.0, 480.0]]))
    assert np.isnan(above).all()
    assert below[1] > 0


def test_a_camera_in_its_own_plane_is_refused():
    """It would see the plane as a line."""
    with pytest.raises(InputError, match=r"0 mm from the plane"):
        Camera.of(ABOVE.lens, np.zeros(3), np.array([0.5, 0.0, 0.0]))


def test_a_pose_that_is_not_finite_is_refused():
    """NaN would spread to every position."""
    with pytest.raises(InputError, match="rotation_rad must be three finite numbers"):
        Camera.of(ABOVE.lens, np.array([0, np.nan, 0]), np.array([0, 0, 1.0]))


@given(
    x=st.floats(-0.4, 0.4),
    y=st.floats(-0.4, 0.4),
    turn=st.floats(-3, 3),
    tip=st.floats(-0.5, 0.5),
    wide=st.booleans(),
)
def test_any_point_goes_to_its_pixel_and_back(x, y, turn, tip, wide):
    """Whatever the pose, the lens bends and unbends exactly."""
    lens = BELOW.lens if wide else ABOVE.lens
    rotation = cv2.Rodrigues(np.array([0, 0, turn]))[0] @ cv2.Rodrigues(np.array([tip, 0, 0]))[0]
    camera = Camera.of(lens, cv2.Rodrigues(rotation)[0], np.array([0.1, -0.2, 1.3]))
    point = np.array([x, y])
    np.testing.assert_allclose(camera.to_metres(camera.to_pixels(point)), point, atol=1e-8)


def test_half_the_size_sees_the_same_place():
    """A camera that records smaller images of the same picture needs no new calibration."""
    half = ABOVE.scaled((250, 250))
    assert half.size_px == (250, 250)
    np.testing.assert_allclose(
        half.to_metres(np.array([99.75, 49.75])), ABOVE.to_metres(np.array([200.0, 100.0]))
    )


def test_a_homography_knows_its_horizon():
    """Beyond it NaN, whichever sign the matrix was written with."""
    rows = np.array([[1.0, 0, 0], [0, 1.0, 0], [0, 0.01, 1]])
    for sign in (1, -1):
        camera = Homography(size_px=(100, 100), matrix=tuple(map(tuple, sign * rows)))
        there, beyond = camera.to_metres(np.array([[0.0, 50.0], [0.0, -150.0]]))
        np.testing.assert_allclose(there, [0, 50 / 1.5])
        assert np.isnan(beyond).all()
        assert np.isnan(camera.to_pixels(np.array([0.0, 300.0]))).all()
        np.testing.assert_allclose(camera.to_pixels(there), [0, 50])


@pytest.mark.parametrize("matrix", [((1, 0, 0), (2, 0, 0), (0, 0, 1)), ((0, 0, 0),) * 3])
def test_a_homography_onto_a_line_is_refused(matrix):
    """It has no way back."""
    with pytest.raises(InputError, match="maps the image to a line"):
        Homography(size_px=(10, 10), matrix=matrix)


def test_the_calibration_of_another_camera_is_refused():
    """Its images have another size."""
    check_fits(ABOVE, (500, 500), camera="overhead.toml")
    with pytest.raises(
        InputError, match=r"overhead.toml: .* 500 x 500 images, these are 640 x 480"
    ):
        check_fits(ABOVE, (640, 480), camera="overhead.toml")


@pytest.mark.parametrize("camera", [ABOVE, BELOW])
def test_no_points_have_no_pixels(camera):
    """Nor places."""
    nothing = np.empty((0, 2))
    assert camera.to_pixels(nothing).shape == (0, 2)
    assert camera.to_metres(nothing).shape == (0, 2)

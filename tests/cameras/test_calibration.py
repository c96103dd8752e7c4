"""Pairs of points, homographies, and errors in millimetres."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from zfcal.cameras.calibration import (
    calibrate_corners,
    calibrate_homography,
    homography_from_corners,
    seen_from,
    summary,
)
from zfcal.cameras.pairs import Pairs
from zfcal.errors import InputError

SIZE = (500, 500)
BOUNDS = (0.0, 0.0, 1.0, 1.0)
CORNERS_PX = ((50.0, 450.0), (450.0, 450.0), (450.0, 50.0), (50.0, 50.0))


def grid_pairs(*, n=4, noise_px=0.0, seed=1):
    """Return points of a metre square as a tipped camera without distortion sees them."""
    across, up = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n))
    m = np.stack([across.ravel(), up.ravel()], axis=-1)
    w = 1 + 0.1 * m[:, 1]
    px = np.stack([50 + 400 * m[:, 0] / w, 450 - 380 * m[:, 1] / w], axis=-1)
    px += np.random.default_rng(seed).normal(0, noise_px, px.shape)
    return Pairs(px=px, m=m, size_px=SIZE)


def test_four_corners_by_hand():
    """A metre over 400 px: 2.5 mm a pixel, y turned up."""
    camera = homography_from_corners(CORNERS_PX, BOUNDS, SIZE)
    np.testing.assert_allclose(camera.to_metres(np.array([250.0, 50.0])), [0.5, 1.0], atol=1e-7)
    np.testing.assert_allclose(camera.to_metres(np.array([51.0, 450.0])), [0.0025, 0], atol=1e-7)


def test_corners_give_no_error_and_say_so():
    """Eight numbers from eight: zero would be a lie."""
    result = calibrate_corners(CORNERS_PX, BOUNDS, SIZE).result()
    assert "error_mm" not in result
    assert "left_out_mm" not in result
    assert "its error is not known" in result["notes"][0]


@given(turn=st.integers(0, 3), mirrored=st.booleans())
def test_a_turned_or_mirrored_camera_is_as_good(turn, mirrored):
    """The corners tell how it stands, and whether it looks up or down."""
    corners = np.roll(np.array(CORNERS_PX), turn, axis=0)
    if mirrored:
        corners[:, 0] = 499 - corners[:, 0]
    camera = homography_from_corners(corners, BOUNDS, SIZE)
    np.testing.assert_allclose(camera.to_metres(corners[2]), [1, 1], atol=1e-7)
    assert seen_from(camera) == ("below" if mirrored else "above")


def test_more_points_give_an_error_in_millimetres():
    """Half a pixel of noise, 2.5 mm a pixel: about a millimetre, and more for points left out."""
    found = calibrate_homography(grid_pairs(n=5, noise_px=0.5)).result()
    assert 0.7 < found["error_mm"]["median"] < 2.5
    assert 0.3 < found["error_px"]["median"] < 1.0
    assert found["left_out_mm"]["rms"] > found["error_mm"]["rms"]


def test_exact_points_leave_no_error():
    """Within a tenth of a micrometre: OpenCV fits homographies in single precision."""
    found = calibrate_homography(grid_pairs())
    np.testing.assert_allclose(found.residual_m, 0, atol=1e-7)
    np.testing.assert_allclose(found.left_out_m, 0, atol=1e-7)
    assert found.notes == ()


def test_a_mistyped_point_is_named():
    """13 px off in a grid of 25 that fits within half a pixel."""
    pairs = grid_pairs(n=5, noise_px=0.3)
    pairs.px[7] += [12.0, -5.0]
    (note,) = calibrate_homography(pairs).notes
    assert note.startswith("Point 8 lies ")


def test_points_without_a_mistake_are_not_called_one():
    """No note in thirty grids with noise."""
    for seed in range(30):
        assert calibrate_homography(grid_pairs(noise_px=0.5, seed=seed)).notes == ()


def test_a_summary_by_hand():
    """Lengths 5, 0 and 10; a lost one does not count."""
    errors = np.array([[3.0, 4.0], [0.0, 0.0], [6.0, -8.0], [np.nan, 1.0]])
    found = summary(errors)
    assert found["median"] == pytest.approx(5)
    assert found["max"] == pytest.approx(10)
    assert found["rms"] == pytest.approx(np.sqrt(125 / 3))
    assert summary(np.full((2, 2), np.nan)) == {}


@pytest.mark.parametrize(
    ("px", "says"),
    [
        (CORNERS_PX[:3], "Four corners X,Y are needed"),
        ([(0, 0), (100, 100), (200, 200), (300, 300)], r"lie on a line \(in pixels\)"),
        ([(0, 0), (100, 100), (200, 200), (400, 0)], "all but one lie on a line"),
        ([(50, 450), (450, 50), (450, 450), (50, 50)], "cross over"),
        ([(50, 450), (450, 450), (450, 50), (50, 800)], "Point 4 lies outside the image: 50, 800"),
        ([(50, 450), (450, 450), (450, np.nan), (50, 50)], "Point 3 is not finite"),
    ],
)
def test_corners_that_cannot_be_are_refused(px, says):
    """Named by number, with what was expected."""
    with pytest.raises(InputError, match=says):
        homography_from_corners(px, BOUNDS, SIZE)


def test_points_in_millimetres_are_refused():
    """A tank of a thousand metres is none."""
    with pytest.raises(InputError, match=r"span 1000 m, expected 0.01 to 20 m"):
        homography_from_corners(CORNERS_PX, (0, 0, 1000, 1000), SIZE)


def test_three_points_are_too_few():
    """A homography has eight numbers, a point gives two."""
    pairs = grid_pairs(n=2).without(0)
    with pytest.raises(InputError, match="needs 4 points or more, got 3"):
        calibrate_homography(pairs)


def test_pixels_and_metres_must_be_as_many():
    """Or they do not belong to each other."""
    with pytest.raises(InputError, match="2 points in pixels, 3 in metres"):
        Pairs(px=np.ones((2, 2)), m=np.array([[0, 0], [1, 0], [1, 1.0]]), size_px=SIZE)

"""From which side a camera sees the tank, and corners that run the wrong way round."""

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from zfcal.arena import make_arena
from zfcal.cameras.calibration import homography_from_corners
from zfcal.cameras.handedness import as_typed, check_corners, check_side, in_order, seen_from
from zfcal.cameras.rig import below_camera, overhead_camera
from zfcal.errors import InputError

BOUNDS, SIZE = (0.0, 0.0, 1.0, 0.8), (500, 480)
UPRIGHT = np.array([(52.5, 448), (447, 450), (449, 51), (50, 53)], float)


@pytest.fixture(scope="module")
def square():
    """Return a square tank of a metre."""
    return make_arena(name="square", outline=shapely.box(0, 0, 1, 1))


def test_the_rig_s_cameras_look_from_where_they_stand(square):
    """Overhead sees the tank as it is, below mirrored; in the middle and elsewhere."""
    for at in (None, (120.0, 300.0)):
        assert seen_from(overhead_camera(square), at) == "above"
        assert seen_from(below_camera(square), at) == "below"


def test_a_pixel_that_shows_the_arena_tells_where_the_middle_shows_none(square):
    """A camera whose middle looks past the plane."""

    class Half:
        size_px = (100, 100)

        def to_metres(self, px):
            found = np.array(px, float) * [0.01, -0.01]
            found[np.array(px)[..., 1] < 60] = np.nan
            return found

    assert seen_from(Half()) == "unknown"
    check_side(Half(), "below", what="x", hint="")
    with pytest.raises(InputError, match=r"seen from above \(not mirrored\), expected from below"):
        check_side(Half(), "below", what="x", hint="", near_px=(50, 80))


def test_corners_in_image_order_are_refused_and_put_in_order():
    """Upper left first, as images are read: the hint holds the same numbers, ready to paste."""
    image_order = UPRIGHT[[3, 2, 1, 0]]
    camera = homography_from_corners(image_order, BOUNDS, SIZE)
    with pytest.raises(InputError, match=r"Corners 50,53 .* \(mirrored\), expected") as caught:
        check_corners(camera, image_order, "above")
    assert "'52.5,448 447,450 449,51 50,53'" in caught.value.hint
    assert "--seen-from below" in caught.value.hint
    check_corners(camera, image_order, "below")


def test_corners_as_from_above_are_refused_for_a_camera_below():
    """The first stays, and the others run the other way."""
    camera = homography_from_corners(UPRIGHT, BOUNDS, SIZE)
    with pytest.raises(InputError, match="expected from below") as caught:
        check_corners(camera, UPRIGHT, "below")
    assert "'52.5,448 50,53 449,51 447,450'" in caught.value.hint
    assert "--seen-from above" in caught.value.hint


@given(first=st.integers(0, 3), tilt=st.floats(-0.6, 0.6))
def test_corners_in_order_are_those_of_an_upright_image(first, tilt):
    """Whichever corner of a tank that stands a little askew came first, and nothing is lost."""
    turn = np.array([[np.cos(tilt), np.sin(tilt)], [-np.sin(tilt), np.cos(tilt)]])
    corners = (UPRIGHT - 250) @ turn * 0.5 + 250
    mirrored = np.roll(corners[::-1], first, axis=0)
    np.testing.assert_array_equal(in_order(mirrored, "above"), corners)
    again = in_order(mirrored, "above")
    check_corners(homography_from_corners(again, BOUNDS, SIZE), again, "above")
    for side, given_corners in (("above", mirrored), ("below", corners)):
        found = in_order(given_corners, side)
        assert seen_from(homography_from_corners(found, BOUNDS, SIZE)) == side


def test_numbers_come_out_as_they_were_typed():
    """No zeros after the comma, and no digit lost."""
    typed = as_typed(np.array([(52.0, 448.25), (447.125, 1e-3)]))
    assert typed == "52,448.25 447.125,0.001"

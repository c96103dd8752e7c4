"""Where a position lies in an image, and every agent in every frame."""

from dataclasses import replace

import numpy as np
import pytest

from zfcal.errors import InputError
from zfcal.writers import METRES, Axes, Image, dense, image_of_import
from zfcal.writers.losses import lost_noise

FPS = 15.0


def test_a_place_in_the_image_by_hand(image):
    """(0.1, 0.2) m at 0.8 mm a pixel: 125 to the right of 25, 250 above 1275."""
    xy_m = np.array([[0.1, 0.2], [np.nan, np.nan]])
    np.testing.assert_allclose(image.axes("px").place(xy_m), [[150.0, 1025.0], [np.nan, np.nan]])
    np.testing.assert_allclose(image.axes("cm").place(xy_m)[0], [12.0, 82.0])
    np.testing.assert_array_equal(METRES.place(xy_m), xy_m)
    assert xy_m[0, 1] == 0.2


def test_axes_say_how_they_are_imported(image):
    """As a person would type it; metres with y up need nothing."""
    options = ("--mm-per-px", "0.8", "--origin", "25,1275", "--flip-y")
    assert image.axes("px").as_options() == options
    assert image.axes("cm").as_options() == ("--origin", "2,102", "--flip-y")
    assert METRES.as_options() == ()


@pytest.mark.parametrize("scale", [0.0, -1.0, np.nan, np.inf])
def test_a_scale_is_a_positive_number(scale):
    """NaN is none."""
    with pytest.raises(InputError, match="must be a positive number of metres"):
        Axes(unit="px", m_per_unit=scale)


def test_the_image_of_imported_tracks_is_that_of_their_file():
    """Pixels by their scale, TRex by its centimetres; of metres nothing is known."""
    given = {"format": "sleap", "m_per_px": 0.002, "origin": [10, 500], "flip_y": True}
    axes = image_of_import(given).axes("px")
    assert (axes.m_per_unit, axes.origin, axes.y_down) == (0.002, (10.0, 500.0), True)
    trex = image_of_import({"format": "trex", "origin": [0, 30], "flip_y": True})
    assert trex == Image(m_per_px=None, origin_m=(0.0, 0.3))
    assert trex.axes("px").origin == pytest.approx((0.0, 300.0))
    assert image_of_import({"format": "csv"}) is None


def test_dense_arrays_start_at_frame_0_and_have_gaps(tracks):
    """Who was not seen in a frame is NaN there; all others are their row."""
    found = dense(tracks, FPS)
    assert found.names == ("fish_2", "fish_5", "fish_7", "robot_11")
    assert found.xy_m.shape == (40, 4, 2)
    assert int(np.isfinite(found.xy_m[..., 0]).sum()) == len(tracks)
    assert np.isnan(found.xy_m[:2]).all()
    assert np.isnan(found.xy_m[20]).all()
    assert np.isnan(found.xy_m[10:15, 1]).all()
    row = np.flatnonzero((tracks.frame == 30) & (tracks.agent == 7))[0]
    assert tuple(found.xy_m[30, 2]) == (tracks.x_m[row], tracks.y_m[row])


def test_an_even_clock_is_even_where_nobody_was_seen(tracks):
    """Also before the first position."""
    found = dense(tracks, FPS)
    np.testing.assert_allclose(found.time_s, np.arange(40) / FPS)
    assert found.time_off_s == 0


def test_an_uneven_clock_advances_where_nobody_was_seen(tracks):
    """A late camera: times between are between."""
    found = dense(replace(tracks, time_s=tracks.time_s + 0.01), FPS)
    assert (np.diff(found.time_s) > 0).all()
    assert found.time_off_s == pytest.approx(0.01)
    assert found.times_tell_frames


def test_a_clock_that_drifts_does_not_tell_the_frames(tracks):
    """Two per cent slow: after 40 frames it is most of a frame off."""
    found = dense(replace(tracks, time_s=tracks.time_s * 1.02), FPS)
    assert not found.times_tell_frames


def test_no_positions_and_too_many_are_refused(tracks):
    """A hundred million places are more than any program reads."""
    with pytest.raises(InputError, match="no position to export"):
        dense(tracks.take(slice(0, 0)), FPS)
    far = tracks.frame.copy()
    far[-1] = 39_999_999
    endless = replace(tracks, frame=far)
    with pytest.raises(InputError, match="4 track ids in 40000000 frames") as caught:
        dense(endless, FPS)
    assert "--to csv" in caught.value.hint


def test_the_noise_is_told_only_where_it_is_known():
    """In millimetres, with the option that gives it back."""
    assert list(lost_noise(None)) == []
    assert list(lost_noise(0.0012)) == [
        "the position noise is lost, 1.2 mm: --noise-mm gives it back."
    ]

"""Scores over time as the report holds them."""

import numpy as np
import pytest

from zfcal.report.views import NO_COURSE, Mark


def test_a_score_against_its_ceiling_by_hand():
    """0.6 of 0.8 are three quarters."""
    assert Mark(value=0.6, ceiling=0.8).against_ceiling == pytest.approx(0.75)


def test_without_a_ceiling_there_is_no_share_of_it():
    """Unknown and zero ceilings give NaN, not an error and not infinity."""
    assert np.isnan(Mark(value=0.6).against_ceiling)
    assert np.isnan(Mark(value=0.6, ceiling=0.0).against_ceiling)


def test_means_leave_out_windows_without_a_value(course):
    """The ceiling of a window that has no score does not count either."""
    line = course([0.5, np.nan, 0.7], ceiling=0.8)
    line.ceiling[1] = 0.2

    assert line.mean().value == pytest.approx(0.6)
    assert line.mean().ceiling == pytest.approx(0.8)


def test_the_last_window_is_the_last_with_a_value(course):
    """A null at the end is passed over; nothing at all has no last."""
    assert course([0.5, 0.6, np.nan]).last == 1
    assert course([np.nan]).last is None
    assert NO_COURSE.last is None
    assert np.isnan(NO_COURSE.mean().value)


def test_windows_since_a_second(course):
    """From 180 s on: the window that ends at 120 s is gone, that at 180 s is there."""
    late = course([0.1, 0.2, 0.3]).since(180)

    assert late.end_s.tolist() == [180, 240]
    assert late.value == pytest.approx([0.2, 0.3])


def test_a_trial_without_tracks_has_no_length(make_view):
    """Half a minute of samples is 120 s at 0.2 s; nothing is nothing."""
    assert make_view().tracked_s == pytest.approx(120.0)
    assert make_view(seen=None).tracked_s == 0.0

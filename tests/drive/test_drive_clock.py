"""How late frames are, as far as it shows."""

import pytest

from zfcal.drive.clock import Lag

FRAME_S = 1 / 15


def lags(frames):
    """Return how far behind each of some frames is, given as times and when they come."""
    lag = Lag()
    return [lag.of(time_s, now_s) for time_s, now_s in frames]


def test_frames_that_are_all_as_late_show_nothing():
    """Whatever second of the trial it is."""
    assert lags((500 + k * FRAME_S, 9000 + k * FRAME_S) for k in range(100)) == [0.0] * 100


def test_a_tracker_that_falls_behind_is_behind_until_it_has_caught_up():
    """By as much, less what a camera may be slow."""
    late = [0.0] * 30 + [1.5] * 300 + [0.0] * 30
    found = lags((k * FRAME_S, 50 + k * FRAME_S + late[k]) for k in range(360))
    assert found[:30] == [0.0] * 30
    assert all(1.5 - 0.3 < each <= 1.5 for each in found[30:330])
    assert found[-1] == pytest.approx(0.0, abs=1e-9)


def test_a_camera_may_be_a_little_slower_than_is_said():
    """Half a percent, for an hour: its frames are not old."""
    n = 54_000
    assert max(lags((k * FRAME_S, k * FRAME_S * 1.005) for k in range(n))) < 0.01


def test_a_tracker_that_is_five_percent_too_slow_is_found():
    """After a quarter of a minute its poses are half a second old."""
    found = lags((k * FRAME_S, k * FRAME_S * 1.05) for k in range(450))
    assert found[180] < 0.5 < found[220]


def test_a_clock_that_was_set_back_begins_anew():
    """The trial's seconds are counted from somewhere else from then on."""
    frames = [(k * FRAME_S, k * FRAME_S) for k in range(900)]
    frames += [(k * FRAME_S, (900 + k) * FRAME_S) for k in range(30)]
    assert set(lags(frames)[-30:]) == {0.0}

"""Frames are numbered by their time stamps; what is missing or double is counted."""

import math

import numpy as np
import pytest

from zfcal.cameras.stamps import FrameClock, Shot, in_nanoseconds, number_frames, with_rate
from zfcal.errors import InputError

FPS = 15.0
IMAGE = np.zeros((2, 2), np.uint8)


def numbers(times_s, *, fps=FPS, after=None):
    """Return the numbers of frames with these stamps, and what was counted."""
    clock = FrameClock(fps, after=after)
    return [clock.number(time_s) for time_s in times_s], clock.tally


def shots(times_s):
    """Return images with these stamps."""
    return [Shot(time_s=time_s, image=IMAGE) for time_s in times_s]


def test_regular_stamps_count_from_nought():
    """Frame k is of k / fps."""
    found, tally = numbers([k / FPS for k in range(50)])
    assert found == list(range(50))
    assert str(tally) == "50 frames"


def test_a_gap_in_the_recording_is_a_gap_in_the_numbers():
    """Frames 3, 4 and 5 are missing: one gap of three, and four periods long."""
    found, tally = numbers([k / FPS for k in (0, 1, 2, 6, 7)])
    assert found == [0, 1, 2, 6, 7]
    assert (tally.gaps, tally.missing) == (1, 3)
    assert tally.longest_s == pytest.approx(4 / FPS)
    assert str(tally) == "5 frames, 3 missing in 1 gaps (the longest 0.267 s)"


def test_a_stamp_that_does_not_advance_is_a_duplicate():
    """Neither the same time again, nor an earlier one, nor NaN gets a number."""
    found, tally = numbers([0.0, 1 / FPS, 1 / FPS, 0.01, math.nan, 2 / FPS])
    assert found == [0, 1, None, None, None, 2]
    assert tally.duplicates == 3
    assert tally.frames == 3


def test_jitter_of_three_tenths_of_a_period_makes_no_gap():
    """Every frame is the next one, and over an hour none is lost count of."""
    rng = np.random.default_rng(3)
    n = 54_000
    times = (np.arange(n) + rng.uniform(-0.3, 0.3, n)) / FPS + 0.1
    found, tally = numbers(times)
    assert tally.gaps == 0
    assert np.array_equal(np.diff(found), np.ones(n - 1))


@pytest.mark.parametrize("rate", [14.9, 15.2])
def test_a_camera_that_runs_a_little_fast_or_slow_has_no_gaps(rate):
    """One period too much or too little adds up, and is no frame that was lost."""
    _, tally = numbers(np.arange(3000) / rate)
    assert (tally.gaps, tally.duplicates) == (0, 0)


def test_a_gap_is_found_in_spite_of_jitter():
    """Two frames of a hundred are taken out of stamps that jitter by a fifth of a period."""
    rng = np.random.default_rng(4)
    kept = np.delete(np.arange(100), [40, 71])
    _, tally = numbers((kept + rng.uniform(-0.2, 0.2, 98)) / FPS + 1.0)
    assert (tally.gaps, tally.missing) == (2, 2)


def test_a_recording_that_goes_on_counts_what_passed_meanwhile():
    """After frame 100, of 6.67 s, one of 10 s is frame 150: 49 are missing."""
    found, tally = numbers([10.0], after=(100, 100 / FPS))
    assert found == [150]
    assert tally.missing == 49


def test_a_recording_that_begins_late_has_the_numbers_of_its_times():
    """Number and time belong together: 2 s at 15 Hz is frame 30."""
    assert numbers([2.0])[0] == [30]


def test_frames_keep_their_stamps_to_the_nanosecond():
    """As a file of whole nanoseconds gives them back: the second time changes nothing."""
    frames = list(number_frames(shots([0.0, 1 / 15, 1 / 15]), FrameClock(FPS)))
    assert [frame.number for frame in frames] == [0, 1]
    assert frames[1].time_s == 0.066666667
    for time_s in np.random.default_rng(1).uniform(0, 1e5, 1000):
        once = in_nanoseconds(time_s)
        assert in_nanoseconds(once) == once
        assert once == pytest.approx(time_s, abs=0.6e-9)


def test_the_rate_of_a_source_must_be_that_of_the_trial():
    """28 frames a second are refused for 15, before any of them is given away."""
    with pytest.raises(InputError, match=r"has 28.07 frames a second, trial.toml says fps = 15"):
        next(with_rate(shots(np.arange(30) / 28.07), fps=FPS, name="x.avi"))


def test_one_long_gap_at_the_start_is_no_other_rate():
    """The middle of the steps counts."""
    times = [0.0, 1.0, *(1 + k / FPS for k in range(1, 20))]
    assert len(list(with_rate(shots(times), fps=FPS, name="x"))) == 21


@pytest.mark.parametrize("n", [0, 1, 2])
def test_a_few_images_tell_no_rate(n):
    """They pass."""
    assert len(list(with_rate(shots(np.arange(n) / 99.0), fps=FPS, name="x"))) == n

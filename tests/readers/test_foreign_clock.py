"""Frame rates: what passes, what is another rate, what is two."""

from pathlib import Path

import numpy as np
import pytest

from zfcal.errors import InputError
from zfcal.readers.clock import check_declared, check_rate

HERE = Path("tracks.csv")


@pytest.mark.parametrize("digits", [2, 3, 6])
def test_times_rounded_to_hundredths_still_tell_their_rate(digits):
    """30 Hz written as 0.03, 0.07, 0.10 s: the mean step counts, not the usual one."""
    check_rate(HERE, np.round(np.arange(300) / 30, digits), fps=30.0)


def test_gaps_do_not_count():
    """A third of the frames is lost, at random and in one long gap."""
    rng = np.random.default_rng(1)
    kept = rng.random(900) > 0.33
    kept[400:500] = False

    check_rate(HERE, np.flatnonzero(kept) / 15, fps=15.0)


def test_three_times_with_a_gap_still_have_a_rate():
    """One step of a frame and one of ten: the short one is the rate."""
    check_rate(HERE, np.array([0, 1, 11]) / 15, fps=15.0)


def test_a_clock_that_is_off_by_one_percent_passes_and_by_five_does_not():
    """The tolerance is two percent; the message states both rates."""
    time_s = np.arange(300) / 15

    check_rate(HERE, time_s * 1.01, fps=15.0)
    with pytest.raises(InputError, match=r"advance at 14\.29 Hz, expected fps = 15 Hz"):
        check_rate(HERE, time_s * 1.05, fps=15.0)


@pytest.mark.parametrize(("first", "second"), [(15, 30), (30, 15), (25, 15)])
def test_two_rates_are_told_in_their_order(first, second):
    """Whichever comes first."""
    time_s = np.concatenate([np.arange(300) / first, 300 / first + np.arange(300) / second])

    with pytest.raises(InputError, match=f"two frame rates, {first} Hz at first and {second} Hz"):
        check_rate(HERE, time_s, fps=float(first))


def test_frame_numbers_tell_the_length_of_each_step():
    """Every fifth frame of 15 Hz is 15 Hz, since the numbers say so."""
    frame = np.arange(0, 500, 5)

    check_rate(HERE, frame / 15, fps=15.0, frame=frame)
    with pytest.raises(InputError, match="advance at 15 Hz, expected fps = 3 Hz"):
        check_rate(HERE, frame / 15, fps=3.0, frame=frame)


def test_one_time_has_no_rate():
    """Nothing to compare, nothing to refuse."""
    check_rate(HERE, np.array([3.0]), fps=15.0)


@pytest.mark.parametrize(("declared", "noted"), [(15.0, 0), (28.0, 1), (29.0, 1)])
def test_a_stated_rate_may_be_cut_to_a_whole_number(declared, noted):
    """28.07 and 29.97 are written as 28 and 29 by trackers that cut the digits off."""
    fps = {15.0: 15.0, 28.0: 28.07, 29.0: 29.97}[declared]

    assert len(check_declared(HERE, declared, fps)) == noted


@pytest.mark.parametrize(("declared", "fps"), [(30.0, 15.0), (14.0, 15.0), (28.5, 29.5)])
def test_another_stated_rate_is_refused(declared, fps):
    """A whole hertz off, or a fraction that nobody cut."""
    with pytest.raises(InputError, match=f"states {declared:g} frames per second, expected"):
        check_declared(HERE, declared, fps)


def test_a_rate_that_is_no_number_is_noted():
    """NaN or 0 in the file: the person's rate is taken."""
    assert "no usable frame rate" in check_declared(HERE, float("nan"), 15.0)[0]

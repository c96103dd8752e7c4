"""Frame rates: what passes, what is another rate, what is two."""

from pathlib import Path

import numpy as np
import pytest

from zfcal.errors import InputError
from zfcal.readers.clock import check_declared, check_rate, frames_of

HERE = Path("tracks.csv")


def wavering(frame, jitter_s, *, fps=15.0, off=1.0, seed=1):
    """Return times of frames on a clock that runs `off` times as long, each off by chance."""
    noise_s = np.random.default_rng(seed).normal(0.0, jitter_s, len(frame))
    return np.sort(frame / fps * off + noise_s)


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


@pytest.mark.parametrize("jitter_ms", [0, 4, 8, 12, 16, 20])
@pytest.mark.parametrize("off", [1.0, 1.013, 0.985])
def test_frames_do_not_run_ahead_of_a_clock_that_wavers(jitter_ms, off):
    """Ten minutes without a lost frame: rounding each step loses 200 frames at 12 ms."""
    frame = np.arange(9000)

    found = frames_of(HERE, wavering(frame, jitter_ms / 1000, off=off), 15.0)

    # At 20 ms the first row may itself take the frame before its own.
    assert np.abs(found - frame).max() <= (1 if jitter_ms == 20 else 0)


@pytest.mark.parametrize("jitter_ms", [0, 4, 8, 12, 16, 20])
def test_lost_frames_stay_lost_however_much_times_waver(jitter_ms):
    """One frame in twenty at random, and four seconds: none is more than a frame away."""
    kept = np.random.default_rng(2).random(9000) > 0.05
    kept[4000:4060] = False
    frame = np.flatnonzero(kept)

    found = frames_of(HERE, wavering(frame, jitter_ms / 1000), 15.0)

    apart = found - (frame - frame[0])
    assert np.abs(apart).max() <= 1
    assert np.mean(apart != 0) < 0.01
    assert (np.diff(found) > 0).all()


@pytest.mark.parametrize("gap_s", [0.4, 4.0, 3600.0])
def test_a_gap_between_wavering_times_has_its_length(gap_s):
    """Also one so long that the clock's own error of 0.7 % is many frames."""
    n_lost = round(gap_s * 15)
    frame = np.concatenate([np.arange(2000), np.arange(2000) + 2000 + n_lost])

    found = frames_of(HERE, wavering(frame, 0.012, off=1.007), 15.0)

    assert found[-1] - found[0] == pytest.approx(frame[-1], abs=max(1, 5e-4 * n_lost))
    assert (np.diff(found[:2000]) == 1).all()
    assert (np.diff(found[2000:]) == 1).all()


def test_one_late_row_in_a_hundred_costs_no_frames():
    """A computer that is busy notes a row 45 ms late; the next is in time."""
    frame = np.arange(9000)
    late = np.random.default_rng(3).random(9000) < 0.01

    assert np.array_equal(frames_of(HERE, frame / 15 * 1.004 + 0.045 * late, 15.0), frame)


def test_a_clock_that_is_set_slowly_takes_no_frames_along():
    """Three frames to and fro in ten minutes, beside 12 ms of jitter."""
    frame = np.arange(9000)
    slow_s = 0.2 * np.sin(2 * np.pi * frame / 9000)

    assert np.array_equal(frames_of(HERE, wavering(frame, 0.012) + slow_s, 15.0), frame)


def test_rows_too_many_are_refused():
    """One in a hundred stands twice: each would take a frame, and the file would last longer."""
    rng = np.random.default_rng(5)
    frame = np.flatnonzero(rng.random(9000) > 0.002)
    once_s = frame / 15 + rng.normal(0, 0.15 / 15, len(frame))
    twice_s = once_s[rng.random(len(frame)) < 0.01] + 0.002

    assert frames_of(HERE, once_s, 15.0)[-1] == frame[-1] - frame[0]
    with pytest.raises(InputError, match="more rows than frames") as caught:
        frames_of(HERE, np.sort(np.concatenate([once_s, twice_s])), 15.0)
    assert "half a frame after the one before, first at" in str(caught.value)


def test_rows_that_were_written_late_together_are_none_too_many():
    """A computer was busy for a second: the rows of that second follow each other at once."""
    frame = np.arange(9000)
    time_s = wavering(frame, 0.01)
    time_s[3000:3015] = time_s[3015] - 0.003 * np.arange(15, 0, -1)

    assert np.array_equal(frames_of(HERE, time_s, 15.0), frame)


@pytest.mark.parametrize("n", [1, 2, 3, 30])
def test_few_wavering_rows_have_a_frame_each(n):
    """Too few to tell a rate: the expected one holds."""
    frame = np.arange(n)

    assert np.array_equal(frames_of(HERE, wavering(frame, 0.012, seed=4), 15.0), frame)


@pytest.mark.parametrize("jitter_ms", [0, 4, 8, 12, 16, 20])
def test_jitter_is_no_other_rate_and_hides_none(jitter_ms):
    """15 Hz passes; 5 % off and two rates are refused as on a steady clock."""
    frame = np.arange(9000)

    check_rate(HERE, wavering(frame, jitter_ms / 1000), fps=15.0)
    with pytest.raises(InputError, match="expected fps = 15 Hz"):
        check_rate(HERE, wavering(frame, jitter_ms / 1000, off=1.05), fps=15.0)
    slower = np.where(frame < 4500, frame, 4500 + (frame - 4500) * 1.5)
    with pytest.raises(InputError, match="two frame rates"):
        check_rate(HERE, wavering(slower, jitter_ms / 1000), fps=15.0)

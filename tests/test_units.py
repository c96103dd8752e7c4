"""The constants of the published rig, the model's step, and angles."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from zfcal import units
from zfcal.errors import InputError
from zfcal.units import default_dt_s, wrap_angle


@pytest.mark.parametrize(
    ("fps", "frames"),
    [
        (15.0, 3),  # every third frame is exactly 0.2 s
        (3.0, 1),  # a frame is 0.333 s: never less than one
        (28.07, 6),  # 5.614 frames are 0.2 s
        (25.0, 5),
        (30.0, 6),
        (50.0, 10),
        (100.0, 20),
        (5.0, 1),
        (0.5, 1),
        (7.0, 1),  # 1.4 frames
        (8.0, 2),  # 1.6 frames
        (1000.0, 200),
    ],
)
def test_the_default_step_is_the_multiple_of_a_frame_nearest_to_200_ms(fps, frames):
    """So many frames, by hand."""
    assert default_dt_s(fps) == pytest.approx(frames / fps, rel=1e-12)


@given(fps=st.floats(0.1, 1e4))
def test_no_other_number_of_frames_is_nearer_to_200_ms(fps):
    """One frame more or less is at least as far off."""
    frames = round(default_dt_s(fps) * fps)
    away = abs(frames / fps - 0.2)

    assert frames >= 1
    assert away <= abs((frames + 1) / fps - 0.2) + 1e-12
    assert frames == 1 or away <= abs((frames - 1) / fps - 0.2) + 1e-12


@pytest.mark.parametrize("fps", [0.0, -15.0, math.nan, math.inf])
def test_a_rate_that_is_none_has_no_step(fps):
    """Zero, negative, NaN, infinite: one clear error, no division by zero."""
    with pytest.raises(InputError, match="positive rate in hertz"):
        default_dt_s(fps)


@pytest.mark.parametrize(
    ("angle", "wrapped"),
    [
        (0.0, 0.0),
        (3 * math.pi, -math.pi),
        (math.pi, -math.pi),
        (-math.pi, -math.pi),
        (1.5 * math.pi, -0.5 * math.pi),
        (-1.5 * math.pi, 0.5 * math.pi),
        (7.0, 7.0 - 2 * math.pi),
    ],
)
def test_angles_by_hand(angle, wrapped):
    """Half a turn becomes -pi: the range is half-open."""
    assert wrap_angle(angle) == pytest.approx(wrapped, abs=1e-12)


def test_an_angle_just_below_minus_pi_stays_in_the_half_open_range():
    """The remainder of a tiny negative number rounds up to a whole turn."""
    assert wrap_angle(math.nextafter(-math.pi, -4.0)) < math.pi


@given(angle=st.floats(-1e4, 1e4), turns=st.integers(-5, 5))
def test_whole_turns_change_no_direction(angle, turns):
    """In [-pi, pi), the same unit vector, with or without whole turns."""
    wrapped = wrap_angle(angle + 2 * math.pi * turns)

    assert -math.pi <= wrapped < math.pi
    assert math.cos(wrapped) == pytest.approx(math.cos(angle), abs=1e-8)
    assert math.sin(wrapped) == pytest.approx(math.sin(angle), abs=1e-8)


def test_an_unknown_angle_stays_unknown():
    """NaN is no direction."""
    assert math.isnan(wrap_angle(math.nan))


def test_constants_are_the_published_ones():
    """Windows of 120 s, a step of 200 ms, no heading below 2 mm, a minute of burn-in."""
    assert (units.WINDOW_S, units.SEGMENT_S, units.BURN_IN_S) == (120.0, 60.0, 60.0)
    assert (units.STEP_S, units.HEADING_MIN_STEP_M) == (0.2, 0.002)
    assert (units.M_PER_CM, units.M_PER_MM) == (0.01, 0.001)

"""The published rig's constants and the conversions allowed at the door.

SI inside: metres, seconds, radians. Nothing but numbers belongs here.
"""

from __future__ import annotations

import math

from zfcal.errors import InputError

WINDOW_S = 120.0
"""Length of an analysis window (Cazenille et al., data analysis)."""

SEGMENT_S = 60.0
"""Length of a track segment, and the time between two windows."""

STEP_S = 0.2
"""The published control step; a trial's own step is the nearest multiple of a frame."""

HEADING_MIN_STEP_M = 0.002
"""A shorter displacement has no heading."""

BURN_IN_S = 60.0
"""The start of every simulation that is dropped."""

M_PER_CM = 0.01
M_PER_MM = 0.001


def wrap_angle(angle_rad: float) -> float:
    """Return the same direction in ``[-pi, pi)``, in radians."""
    turned = (angle_rad + math.pi) % (2 * math.pi) - math.pi
    # Just below -pi the remainder rounds up to a whole turn.
    return -math.pi if turned >= math.pi else turned


def default_dt_s(fps: float) -> float:
    """Return the multiple of the frame interval that is nearest to 0.2 s.

    Parameters
    ----------
    fps
        Frame rate, in hertz, positive.

    Returns
    -------
    float
        The step in seconds, at least one frame.

    Raises
    ------
    InputError
        The rate is none.
    """
    if not 0 < fps < math.inf:
        raise InputError(f"fps must be a positive rate in hertz, got {fps!r}.")
    return max(1, round(STEP_S * fps)) / fps

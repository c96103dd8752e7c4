"""By what the strength of an effect goes, if by anything: curves that any effect may have.

An effect has its own mechanism, and one strength. With a curve the strength differs with a cue, by
hat functions of three knots: so the form that a model has follows what features were fitted to be.
The functions of effects know nothing of it: at each call they are handed the parameters of one of
so many levels of the cue.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from zfcal.arrays import Floats
from zfcal.errors import InputError
from zfcal.model.kernels.compiled import inlined

# What a strength goes by; the last two are of the neighbour that is attended to.
NOTHING, BY_TIME, BY_SPEED, BY_TURN, BY_NEAREST, BY_NUMBER, BY_ZONE, BY_DISTANCE, BY_BEARING = (
    range(9)
)

# Columns of a curve: the cue, its first row of ``effects``, and its knots.
CUE, FIRST, KNOT, CURVE_COLUMNS = 0, 1, 2, 5

BETWEEN = 16
"""Levels from one knot to the next."""

LEVELS = 2 * BETWEEN + 1


CUES = (
    ("nothing", ""),
    ("time of the trial", "s"),
    ("own last speed", "m/s"),
    ("own last turn", "rad"),
    ("distance to the nearest", "m"),
    ("how many are seen", ""),
    ("number of the zone", ""),
    ("distance to the other", "m"),
    ("bearing off the own heading", "rad"),
)
"""What a strength may go by, and its unit; its place here is what ``by`` names."""

MORE = ("more_1", "more_3")
"""Parameters of a curve that are fitted."""

KNOTS = ("knot_1", "knot_2", "knot_3")
"""Those where it bends."""


@inlined
def level_of(value: float, low: float, middle: float, high: float) -> int:
    """Return the nearest level of a cue between its knots; beyond them it is at the last one."""
    if value < middle:
        share = (value - low) / (middle - low)
    else:
        share = 1.0 + (value - middle) / (high - middle)
    return math.floor(BETWEEN * min(2.0, max(0.0, share)) + 0.5)


def has_curve(given: Mapping[str, float]) -> bool:
    """Return whether the strength of an effect goes by something."""
    return given.get("by", 0.0) > 0.0


def knots_of(given: Mapping[str, float]) -> tuple[float, float, float]:
    """Return the knots of an effect's curve; zeros where it has none."""
    first, middle, last = (given.get(name, 0.0) for name in KNOTS)
    return first, middle, last


def check_curve(name: str, given: Mapping[str, float]) -> None:
    """Refuse a curve that is none.

    Parameters
    ----------
    name
        Of the effect.
    given
        Its parameters.

    Raises
    ------
    InputError
        The knots do not ascend, there is no such cue, or there are knots and none.
    """
    if has_curve(given):
        first, middle, last = knots_of(given)
        if given["by"] != int(given["by"]):
            raise InputError(
                f"Effect {name!r}: by must be a whole number from 0 to {len(CUES) - 1}, "
                f"got {given['by']:g}."
            )
        if not first < middle < last:
            raise InputError(
                f"Effect {name!r}: knot_1, knot_2 and knot_3 must ascend, got {first:g}, "
                f"{middle:g} and {last:g}.",
                hint="With `by` each of them is needed: a value of what the strength goes by.",
            )
        return
    idle = [key for key in (*KNOTS, *MORE) if key in given]
    if idle:
        raise InputError(
            f"Effect {name!r}: {', '.join(idle)} stand without `by`, and would do nothing.",
            hint="Say by what the strength goes, such as by = 4, or leave them out.",
        )


def strengths_at(given: Mapping[str, float], strength: float, ends: tuple[float, float]) -> Floats:
    """Return the strength at each level, from the first knot of a curve to the last one.

    Parameters
    ----------
    given
        Parameters of an effect.
    strength
        At the middle knot.
    ends
        Bounds of the strength, within which it stays.
    """
    first, last = (given.get(name, 0.0) for name in MORE)
    more = np.interp(np.linspace(0.0, 2.0, LEVELS), (0.0, 1.0, 2.0), (first, 0.0, last))
    return np.clip(strength + more, *ends)


def strengths_at_knots(
    given: Mapping[str, float], strength: str, ends: tuple[float, float]
) -> tuple[float, ...]:
    """Return the strength at each knot of an effect's curve; the one that it has without a curve.

    Parameters
    ----------
    given
        Parameters of an effect.
    strength
        Name of its strength.
    ends
        Bounds of it, within which it stays.
    """
    own = given[strength]
    more = (given[MORE[0]], 0.0, given[MORE[1]]) if has_curve(given) else (0.0,)
    return tuple(min(max(own + each, ends[0]), ends[1]) for each in more)


def cue_named(by: int) -> str:
    """Return what a strength goes by, with its unit."""
    says, unit = CUES[by]
    return f"{says} ({unit})" if unit else says

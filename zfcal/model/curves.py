"""By what the strength of an effect goes, if by anything: curves that any effect may have.

An effect has its own mechanism, and one strength. With a curve the strength differs with a cue, by
hat functions of three knots: so the form that a model has follows what features were fitted to be.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from zfcal.arrays import Floats
from zfcal.errors import InputError
from zfcal.model.kernels.curves import LAST_CUE, LEVELS

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

_SAYS = ", ".join(f"{number} {says}" for number, (says, _) in enumerate(CUES))


@dataclass(frozen=True, slots=True, kw_only=True)
class EffectParameter:
    """One number of an effect.

    Parameters
    ----------
    name
        As in the model file.
    low, high
        Bounds within which it is calibrated.
    default
        Used where the model file is silent.
    says
        What it means, with its unit.
    """

    name: str
    low: float
    high: float
    default: float
    says: str


def curve_of(low: float, high: float) -> tuple[EffectParameter, ...]:
    """Return the parameters that any effect may have besides: by what its strength goes.

    Parameters
    ----------
    low, high
        Bounds of its strength, which is that at the middle one of three knots.
    """
    own = [
        ("by", 0.0, float(LAST_CUE), f"What the strength goes by: {_SAYS}."),
        *((name, -1e5, 1e5, "Of the cue, ascending.") for name in KNOTS),
        ("more_1", low - high, high - low, "Strength beyond its own at and below the first knot."),
        ("more_3", low - high, high - low, "Strength beyond its own at and above the last knot."),
    ]
    return tuple(
        EffectParameter(name=name, low=least, high=most, default=0.0, says=says)
        for name, least, most, says in own
    )


def has_curve(given: Mapping[str, float]) -> bool:
    """Return whether the strength of an effect goes by something."""
    return given.get("by", 0.0) > 0.0


def knots_of(given: Mapping[str, float]) -> tuple[float, float, float]:
    """Return the knots of an effect's curve; zeros where it has none.

    Raises
    ------
    InputError
        They do not ascend, or there is no such cue.
    """
    first, middle, last = (given.get(name, 0.0) for name in KNOTS)
    if has_curve(given):
        if not first < middle < last:
            raise InputError(
                f"knot_1, knot_2 and knot_3 must ascend, got {first:g}, {middle:g} and {last:g}.",
                hint="They are values of what the strength goes by, from the lowest on.",
            )
        if given["by"] != int(given["by"]):
            raise InputError(f"by must be a whole number, 0 to {LAST_CUE}, got {given['by']:g}.")
    return first, middle, last


def strengths_at(given: Mapping[str, float], own: EffectParameter) -> Floats:
    """Return the strength at each level, from the first knot of a curve to the last one.

    Parameters
    ----------
    given
        Parameters of an effect.
    own
        Its strength, within whose bounds it stays.
    """
    first, last = (given.get(name, 0.0) for name in MORE)
    more = np.interp(np.linspace(0.0, 2.0, LEVELS), (0.0, 1.0, 2.0), (first, 0.0, last))
    return np.clip(given.get(own.name, own.default) + more, own.low, own.high)


def strengths_of(given: Mapping[str, float], strength: str) -> tuple[float, ...]:
    """Return the strength at each knot of an effect's curve; the one that it has without a curve.

    Parameters
    ----------
    given
        Parameters of an effect.
    strength
        Name of its strength.
    """
    own = given[strength]
    if not has_curve(given):
        return (own,)
    return own + given[MORE[0]], own, own + given[MORE[1]]


def cue_named(given: Mapping[str, float]) -> str:
    """Return what the strength of an effect goes by, with its unit."""
    says, unit = CUES[int(given["by"])]
    return f"{says} ({unit})" if unit else says

"""Findings in plain words."""

from __future__ import annotations

from zfcal.diagnose.candidates import Candidate
from zfcal.model.effects.base import EffectParameter
from zfcal.model.kernels.curves import CUES, has_curve, knots_of, strengths_at_knots

_AT_ITS_END = 0.01
"""Share of a range within which a strength is at its end: the fit went as far as it may."""


def says(
    candidate: Candidate, values: dict[str, float], interval: dict[str, tuple[float, float]]
) -> str:
    """Return what an effect is in this recording, for a biologist.

    Parameters
    ----------
    candidate
        The effect.
    values, interval
        Its parameters, and the intervals of those that were fitted.
    """
    effect = candidate.effect
    (strength,) = (each for each in effect.parameters if each.name == effect.strength)
    turned = max(_at_knots(strength, values), key=abs) < 0 and effect.opposite
    size = _curve(strength, values) if has_curve(values) else _size(strength, values, interval)
    return f"{effect.opposite if turned else effect.says} {size}"


def _at_knots(strength: EffectParameter, values: dict[str, float]) -> tuple[float, ...]:
    return strengths_at_knots(values, strength.name, (strength.low, strength.high))


def _curve(strength: EffectParameter, values: dict[str, float]) -> str:
    """Return how strong an effect is at each knot of its curve."""
    says, unit = CUES[int(values["by"])]
    at = [
        f"{own:.3g} at {knot:.3g}{f' {unit}' if unit else ''}"
        for knot, own in zip(knots_of(values), _at_knots(strength, values), strict=True)
    ]
    name = strength.name.replace("_", " ")
    return f"Fitted {name} by {says}: {', '.join(at)}. {strength.says}"


def _size(
    strength: EffectParameter, values: dict[str, float], interval: dict[str, tuple[float, float]]
) -> str:
    value, name = values[strength.name], strength.name.replace("_", " ")
    text = f"Fitted {name}: {value:.3g}"
    if strength.name in interval:
        low, high = interval[strength.name]
        text += f" (95 % interval {low:.3g} to {high:.3g})"
    return f"{text}. {strength.says}{_at_an_end(strength, value)}"


def _at_an_end(strength: EffectParameter, value: float) -> str:
    """Return what to make of a strength at an end of its range that nature does not set."""
    low, high = strength.low, strength.high
    natural = (0.0, 1.0) if (low, high) == (0.0, 1.0) else (0.0,)
    near = _AT_ITS_END * (high - low)
    if not any(abs(value - end) <= near for end in (low, high) if end not in natural):
        return ""
    return (
        f" This is the end of its range, {low:g} to {high:g}: the data may ask for more than that, "
        "or for another form."
    )

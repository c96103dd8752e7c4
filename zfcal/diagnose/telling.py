"""Findings in plain words."""

from __future__ import annotations

from zfcal.diagnose.candidates import Candidate
from zfcal.model.effects.base import EffectParameter


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
    turned = values[effect.strength] < 0 and effect.opposite
    return f"{effect.opposite if turned else effect.says} {_size(strength, values, interval)}"


def _size(
    strength: EffectParameter, values: dict[str, float], interval: dict[str, tuple[float, float]]
) -> str:
    value, name = values[strength.name], strength.name.replace("_", " ")
    text = f"Fitted {name}: {value:.3g}"
    if strength.name in interval:
        low, high = interval[strength.name]
        text += f" (95 % interval {low:.3g} to {high:.3g})"
    return f"{text}. {strength.says}"

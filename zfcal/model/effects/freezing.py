"""Freezing: a fish stops for seconds."""

from __future__ import annotations

import math

from zfcal.model.effects.base import Effect, EffectParameter
from zfcal.model.kernels.compiled import hook
from zfcal.model.kernels.hooks import SPEED as SPEED_HOOK
from zfcal.model.kernels.state import DT_S, SPEED


@hook(SPEED_HOOK)
def speed(state, sight, n, i, parameters, chance):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Return zero for a step at rest: one that begins, or one that goes on."""
    if not parameters[0] > 0.0:
        return 1.0
    dt_s = state[DT_S * n + i]
    resting = math.exp(-dt_s / parameters[1])
    if state[SPEED * n + i] > 0.0:
        resting = 1.0 - math.exp(-parameters[0] * dt_s)
    return 0.0 if chance < resting else 1.0


EFFECT = Effect(
    name="freezing",
    says="Now and then a fish stops for seconds.",
    reference="Kalueff et al. 2013, Zebrafish 10: 70-86",
    parameters=(
        EffectParameter(
            name="rate_per_s",
            low=0.0,
            high=2.0,
            default=0.05,
            says="How often a fish that swims stops, per second.",
        ),
        EffectParameter(
            name="duration_s",
            low=0.1,
            high=60.0,
            default=2.0,
            says="Mean time that it stays at rest, in seconds.",
        ),
    ),
    strength="rate_per_s",
    probe=0.001,
    speed=speed,
    shapes=lambda _arena: tuple({"duration_s": duration} for duration in (1.0, 2.0, 5.0)),
    identity_s=2.0,
    rests="duration_s",
    shown_against="speed",
)

"""Burst and coast: speed depends on the own recent speed."""

from __future__ import annotations

from zfcal.model.effects.base import Effect, EffectParameter
from zfcal.model.effects.forms import SPEED_M_S, log_speed, times_faster
from zfcal.model.kernels.compiled import hook
from zfcal.model.kernels.hooks import SPEED as SPEED_HOOK
from zfcal.model.kernels.state import SPEED


@hook(SPEED_HOOK)
def speed(state, sight, n, i, parameters, chance):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Return a power of the own last speed, over the usual speed."""
    return times_faster(parameters[0] * log_speed(state[SPEED * n + i], parameters[1]))


EFFECT = Effect(
    name="burst-and-coast",
    says="A fish that has just been fast stays fast, and a slow one stays slow.",
    opposite="A fish that has just been fast slows down, and a slow one speeds up.",
    reference="Calovi et al. 2018, PLoS Computational Biology 14: e1005933",
    parameters=(
        EffectParameter(
            name="exponent",
            low=-1.5,
            high=1.5,
            default=0.4,
            says="Power of the own last speed to which the speed is proportional.",
        ),
        EffectParameter(
            name="usual_m_s",
            low=0.01,
            high=0.3,
            default=SPEED_M_S,
            says="Last speed at which the next is as the base model has it, in m/s.",
        ),
    ),
    strength="exponent",
    probe=0.01,
    speed=speed,
    fixed=("usual_m_s",),
    shown_against="speed",
    other_forms=("generic:speed:own-speed",),
)

"""Turning memory: the next turn depends on the last one."""

from __future__ import annotations

from zfcal.model.compiled import hook
from zfcal.model.effects.base import Effect, EffectParameter
from zfcal.model.effects.forms import tilt
from zfcal.model.kernels.hooks import FACTOR
from zfcal.model.kernels.world import HX, HY, PAST_HX, PAST_HY


@hook(FACTOR)
def factor(state, sight, n, i, parameters, ux, uy, speed, landing):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Weigh headings by the sine of their turn times that of the last turn."""
    hx, hy = state[HX * n + i], state[HY * n + i]
    last = state[PAST_HX * n + i] * hy - state[PAST_HY * n + i] * hx
    return tilt(parameters[0], last * (hx * uy - hy * ux), abs(last))


EFFECT = Effect(
    name="turning-memory",
    says="A fish that has just turned goes on turning to the same side.",
    opposite="A fish that has just turned turns back to the other side.",
    reference="Gautrais et al. 2009, Journal of Mathematical Biology 58: 429-445",
    parameters=(
        EffectParameter(
            name="strength",
            low=-4.0,
            high=4.0,
            default=0.8,
            says="Half the log of how much more likely a right angle to the same side is than one "
            "to the other side, after a right angle.",
        ),
    ),
    probe=0.01,
    factor=factor,
    identity_s=0.8,
)

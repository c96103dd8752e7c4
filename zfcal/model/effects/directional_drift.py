"""Directional drift: a preferred compass direction."""

from __future__ import annotations

import math

from zfcal.model.effects.base import Effect, EffectParameter
from zfcal.model.effects.forms import SLOWEST_M_S, SPEED_M_S, cut, tilt
from zfcal.model.kernels.compiled import hook
from zfcal.model.kernels.hooks import FACTOR

_MOST = 4.0


@hook(FACTOR)
def factor(state, sight, n, i, parameters, ux, uy, speed, landing):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Weigh headings by their component along the direction, those of slow steps more."""
    along = ux * math.cos(parameters[1]) + uy * math.sin(parameters[1])
    strength = parameters[0] * (SPEED_M_S / max(speed, SLOWEST_M_S)) ** parameters[2]
    return tilt(cut(strength, 0.0, _MOST), along, 1.0)


EFFECT = Effect(
    name="directional-drift",
    says="All over the tank fish prefer one compass direction, as with a current, a light or a "
    "slope.",
    reference="Montgomery et al. 1997, Nature 389: 960-963",
    parameters=(
        EffectParameter(
            name="strength",
            low=0.0,
            high=_MOST,
            default=0.4,
            says="Log of the preference for headings along the direction.",
        ),
        EffectParameter(
            name="direction_rad",
            low=-7.0,
            high=7.0,
            default=0.0,
            says="The direction, counter-clockwise from x, in radians.",
        ),
        EffectParameter(
            name="by_slowness",
            low=0.0,
            high=1.0,
            default=0.0,
            says="How much more slow steps have of it: 0 for all steps alike, as with a light; 1 "
            "for the inverse of the speed, as where a current carries fish that swim.",
        ),
    ),
    probe=0.01,
    factor=factor,
    harmonics=1,
    shapes=lambda _arena: tuple({"direction_rad": eighth * math.pi / 4} for eighth in range(-3, 5)),
    shown_against="wall",
)

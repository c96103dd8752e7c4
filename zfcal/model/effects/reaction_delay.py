"""Reaction delay: fish respond to where others were a moment ago."""

from __future__ import annotations

from zfcal.model.effects.base import Effect, EffectParameter
from zfcal.model.effects.forms import needs_neighbour

EFFECT = Effect(
    name="reaction-delay",
    says="Fish respond to where their neighbours were a moment ago.",
    reference="Nagy et al. 2010, Nature 464: 890-893",
    parameters=(
        EffectParameter(
            name="delay_s",
            low=0.0,
            high=2.0,
            default=0.6,
            says="Age of what fish see of the others, in seconds; a whole number of steps.",
        ),
    ),
    strength="delay_s",
    probe=0.2,
    lag="delay_s",
    shapes=lambda _arena: tuple({"delay_s": delay} for delay in (0.2, 0.4, 0.6, 0.8, 1.2, 1.6)),
    lacks=needs_neighbour,
    identity_s=2.4,
    fixed=("delay_s",),
)

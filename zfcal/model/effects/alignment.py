"""Alignment: a fish turns toward its neighbours' headings."""

from __future__ import annotations

import math

from zfcal.model.compiled import hook
from zfcal.model.effects.base import Effect, EffectParameter
from zfcal.model.kernels.hooks import COMPONENT
from zfcal.model.kernels.world import HX, HY


@hook(COMPONENT)
def component(state, sight, n, i, parameters, out):  # type: ignore[no-untyped-def]
    """Add a component about the neighbours' mean heading, weighted by solid angle."""
    x, y, seen = 0.0, 0.0, 0.0
    for j in range(n):
        angle = sight[i * n + j]
        x += angle * state[HX * n + j]
        y += angle * state[HY * n + j]
        seen += angle
    length = math.sqrt(x * x + y * y)
    if not length > 0.0:
        return 0.0
    out[0], out[1], out[2] = x / length, y / length, parameters[1]
    return parameters[0] * seen


EFFECT = Effect(
    name="alignment",
    says="Fish turn toward the direction in which their neighbours swim.",
    reference="Couzin et al. 2002, Journal of Theoretical Biology 218: 1-11",
    parameters=(
        EffectParameter(
            name="weight",
            low=0.0,
            high=50.0,
            default=20.0,
            says="Weight of the neighbours' mean heading, per steradian of solid angle.",
        ),
        EffectParameter(
            name="kappa",
            low=0.0,
            high=30.0,
            default=10.0,
            says="Von Mises concentration about that heading.",
        ),
    ),
    strength="weight",
    probe=0.05,
    component=component,
    shapes=lambda _arena: ({"kappa": 3.0}, {"kappa": 12.0}),
    lacks=lambda company: None if company.n_fish + company.n_robots > 1 else "a neighbour",
)

"""Alignment: a fish turns toward its neighbours' headings."""

from __future__ import annotations

import math

from zfcal.model.compiled import hook
from zfcal.model.effects.base import Effect, EffectParameter
from zfcal.model.effects.forms import needs_neighbour
from zfcal.model.kernels.hooks import COMPONENT
from zfcal.model.kernels.world import HX, HY

_USUAL_SR = 0.01
"""Solid angle of a neighbour at about 0.1 m."""


@hook(COMPONENT)
def component(state, sight, n, i, parameters, out):  # type: ignore[no-untyped-def]
    """Add a component about the neighbours' mean heading; the more they agree, the heavier."""
    x, y = 0.0, 0.0
    for j in range(n):
        angle = sight[i * n + j]
        if angle > 0.0:
            if parameters[2] < 1.0:
                angle = _USUAL_SR * (angle / _USUAL_SR) ** parameters[2]
            x += angle * state[HX * n + j]
            y += angle * state[HY * n + j]
    length = math.sqrt(x * x + y * y)
    if not length > 0.0:
        return 0.0
    out[0], out[1], out[2] = x / length, y / length, parameters[1]
    return parameters[0] * length


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
        EffectParameter(
            name="grading",
            low=0.0,
            high=1.0,
            default=1.0,
            says="1: each neighbour counts by its solid angle; 0: all that are seen count alike, "
            "as one of 0.01 sr.",
        ),
    ),
    strength="weight",
    probe=0.05,
    component=component,
    shapes=lambda _arena: (
        {"kappa": 3.0, "grading": 1.0},
        {"kappa": 12.0, "grading": 1.0},
        {"kappa": 3.0, "grading": 0.0},
        {"kappa": 12.0, "grading": 0.0},
    ),
    lacks=needs_neighbour,
    fixed=("grading",),
)

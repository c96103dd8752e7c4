"""Place preference: attraction to a place in the tank, or avoidance of it."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from zfcal.arrays import Floats
from zfcal.model.effects.base import Effect, EffectParameter, Likeness
from zfcal.model.effects.forms import tilt
from zfcal.model.effects.places import places
from zfcal.model.kernels.compiled import hook
from zfcal.model.kernels.hooks import FACTOR
from zfcal.model.kernels.state import X, Y

_AT_IT_M = 0.02


@hook(FACTOR)
def factor(state, sight, n, i, parameters, ux, uy, speed, landing):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Weigh headings by the bearing of the place; far from it less, and at it not at all."""
    dx, dy = parameters[1] - state[X * n + i], parameters[2] - state[Y * n + i]
    away = math.sqrt(dx * dx + dy * dy)
    if not away > 0.0:
        return 1.0
    pull = away / (away + _AT_IT_M) / (1.0 + (away / parameters[3]) ** 4)
    return tilt(parameters[0], pull * (ux * dx + uy * dy) / away, pull)


def _one_sided(xy_m: Floats, values: Mapping[str, float]) -> float:
    """Return how much one way the place pulls where fish were, from 0 to 1.

    The length of the mean of the unit vectors to the place, weighed by its pull (the mean
    resultant length; Mardia and Jupp 2000, Directional Statistics, section 2.3).
    """
    dx, dy = values["x_m"] - xy_m[:, 0], values["y_m"] - xy_m[:, 1]
    away = np.maximum(np.hypot(dx, dy), 1e-9)
    pull = 1.0 / (1.0 + (away / values["reach_m"]) ** 4)
    mean = np.average(np.column_stack([dx / away, dy / away]), axis=0, weights=pull)
    return float(np.hypot(*mean))


EFFECT = Effect(
    name="place-preference",
    says="Fish are drawn to a place in the tank.",
    opposite="Fish keep away from a place in the tank.",
    reference="Mathur et al. 2011, Nature Protocols 6: 338-345",
    parameters=(
        EffectParameter(
            name="strength",
            low=-4.0,
            high=4.0,
            default=1.0,
            says="Log of the preference for headings toward the place.",
        ),
        EffectParameter(
            name="x_m", low=-100.0, high=100.0, default=0.0, says="The place's x, in metres."
        ),
        EffectParameter(
            name="y_m", low=-100.0, high=100.0, default=0.0, says="The place's y, in metres."
        ),
        EffectParameter(
            name="reach_m",
            low=0.03,
            high=2.0,
            default=0.3,
            says="Distance at which half of the pull is left, in metres.",
        ),
    ),
    probe=0.01,
    factor=factor,
    harmonics=1,
    shapes=lambda arena: tuple({"x_m": x, "y_m": y} for x, y in places(arena)),
    other_forms=("generic:heading:place",),
    # A place with a reach of its own bends to a drift of any form.
    looks_like=Likeness(name="directional-drift", share=_one_sided),
)

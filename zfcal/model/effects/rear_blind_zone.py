"""Rear blind zone: the field of view is narrower than assumed."""

from __future__ import annotations

import math

from zfcal.arrays import Floats
from zfcal.model.effects.base import Effect, EffectParameter
from zfcal.model.effects.circumstances import by_circumstances
from zfcal.model.effects.forms import needs_neighbour
from zfcal.model.effects.weights import LESS_ATTENTION, factor_on_attention, precision_of_attention
from zfcal.model.features import Along, Feature, Seen
from zfcal.model.kernels.compiled import hook
from zfcal.model.kernels.hats import hats
from zfcal.model.kernels.hooks import SIGHT
from zfcal.model.kernels.state import HX, HY, X, Y

_SOFT_RAD = 0.06


@hook(SIGHT)
def sight(state, sight, n, i, parameters, j):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Take away from what is farther from the heading than the field of view."""
    dx, dy = state[X * n + j] - state[X * n + i], state[Y * n + j] - state[Y * n + i]
    hx, hy = state[HX * n + i], state[HY * n + i]
    off = abs(math.atan2(hx * dy - hy * dx, hx * dx + hy * dy))
    return 1.0 - parameters[0] / (1.0 + math.exp((parameters[1] - off) / _SOFT_RAD))


_KNOTS_RAD = (0.0, 1.2, 1.8, 2.1, 2.25, 2.3561)
_BEHIND_RAD = (1.2, 2.0)


def _attention(seen: Seen) -> Floats:
    return hats(seen.off_axis_rad, _KNOTS_RAD)[..., 1:]


def _behind(seen: Seen) -> Floats:
    return hats(seen.off_axis_rad, _BEHIND_RAD)[..., 1:]


_FEATURES: tuple[Feature, ...] = (
    factor_on_attention(
        _attention,
        high=0.0,
        along=Along(
            cue="bearing off the own heading (rad)", knots=_KNOTS_RAD[1:], none_at=_KNOTS_RAD[0]
        ),
    ),
    precision_of_attention(_behind, "precision of those behind", high=0.0),
    by_circumstances(
        factor_on_attention(_behind, label="attention to those behind", high=0.0),
        alone=LESS_ATTENTION,
        without=("the time", "bearing"),
        of_each=True,
    ),
)


EFFECT = Effect(
    name="rear-blind-zone",
    says="Fish do not respond to neighbours at their side or rear that the model lets them see.",
    reference="Couzin et al. 2002, Journal of Theoretical Biology 218: 1-11",
    parameters=(
        EffectParameter(
            name="ignored",
            low=0.0,
            high=1.0,
            default=1.0,
            says="Share of attention that neighbours outside the narrower field lose.",
        ),
        EffectParameter(
            name="fov_rad",
            low=0.5,
            high=2.9,
            default=1.57,
            says="Field of view to each side of the heading, in radians.",
        ),
    ),
    strength="ignored",
    probe=0.01,
    sight=sight,
    shapes=lambda _arena: tuple(
        {"fov_rad": math.radians(degrees)} for degrees in (60.0, 75.0, 90.0, 105.0, 120.0)
    ),
    lacks=needs_neighbour,
    features=lambda _arena: _FEATURES,
)

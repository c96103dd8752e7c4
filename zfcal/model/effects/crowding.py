"""Crowding: speed changes with local density."""

from __future__ import annotations

import numpy as np

from zfcal.arrays import Floats
from zfcal.model.effects.base import Effect, EffectParameter
from zfcal.model.effects.circumstances import paces_by
from zfcal.model.effects.forms import apart, beyond, needs_neighbour, times_faster
from zfcal.model.kernels.compiled import hook
from zfcal.model.kernels.hats import hats
from zfcal.model.kernels.hooks import SPEED as SPEED_HOOK
from zfcal.model.kernels.state import ZONE
from zfcal.model.paces import Pace, Spread, Swum


@hook(SPEED_HOOK)
def speed(state, sight, n, i, parameters, chance):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Return an exponential of the number of others within a radius."""
    near = 0.0
    for j in range(n):
        if j != i and state[ZONE * n + j] > 0.0:
            near += 1.0 - beyond(apart(state, n, i, j), parameters[1])
    return times_faster(parameters[0] * (near - parameters[2]))


_KNOTS_M = (0.0, 0.05, 0.1, 0.2, 0.4)
_NEAR_M = (0.0, 0.08, 0.25)
_COMPANY_M = 0.1
_COMPANY = (0.0, 1.0, 2.0, 4.0)
"""Others nearby: a second one, or a fourth, may count less than the first."""


def _number(swum: Swum) -> Floats:
    """Return how many others there are, by distance."""
    weights = hats(swum.distance_m, _KNOTS_M) * swum.here[..., None]
    return np.asarray(weights.sum(axis=1)[:, :-1])


def _company(swum: Swum) -> Floats:
    near = swum.here * np.exp(-0.5 * (swum.distance_m / _COMPANY_M) ** 2)
    return np.asarray(near.sum(axis=1, keepdims=True))


def _few_or_many(swum: Swum) -> Floats:
    return hats(_company(swum)[:, 0], _COMPANY)[:, 1:]


def _spread_by_nearest(swum: Swum) -> Floats:
    return hats(swum.distance_m.min(axis=1, initial=_NEAR_M[-1]), _NEAR_M)[:, :-1]


def _ahead(swum: Swum) -> Floats:
    return hats(swum.ahead_m, _KNOTS_M)[:, :-1]


def _nearest(swum: Swum) -> Floats:
    return hats(swum.distance_m.min(axis=1, initial=_KNOTS_M[-1]), _KNOTS_M)[:, :-1]


EFFECT = Effect(
    name="crowding",
    says="Fish swim faster the more others are close by.",
    opposite="Fish swim more slowly the more others are close by.",
    reference="Herbert-Read et al. 2011, Proceedings of the National Academy of Sciences 108: "
    "18726-18731",
    parameters=(
        EffectParameter(
            name="per_neighbour",
            low=-1.0,
            high=1.0,
            default=0.25,
            says="Log of the change of speed with each neighbour nearby.",
        ),
        EffectParameter(
            name="radius_m",
            low=0.02,
            high=0.6,
            default=0.1,
            says="Distance within which a neighbour counts as nearby, in metres.",
        ),
        EffectParameter(
            name="usual",
            low=0.0,
            high=20.0,
            default=1.0,
            says="Number of neighbours nearby at which a fish swims as the base model has it.",
        ),
    ),
    strength="per_neighbour",
    probe=0.01,
    other_forms=("generic:speed:neighbour-distance",),
    speed=speed,
    shapes=lambda _arena: tuple({"radius_m": radius} for radius in (0.05, 0.08, 0.12, 0.2, 0.35)),
    lacks=needs_neighbour,
    fixed=("usual",),
    paces=(
        Pace(label="number", weights=_number),
        *paces_by(Pace(label="company", weights=_company), "who", "the time"),
        Pace(label="company, few or many", weights=_few_or_many),
        Pace(label="the nearest", weights=_nearest),
        Pace(label="somebody ahead", weights=_ahead),
        Spread(label="slow and fast ones, by how many are near", weights=_company),
        Spread(label="slow and fast ones, by the nearest", weights=_spread_by_nearest),
    ),
)

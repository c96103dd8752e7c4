"""Interaction range: neighbours beyond a distance are ignored."""

from __future__ import annotations

import math

import numpy as np

from zfcal.arrays import Floats
from zfcal.model.effects.base import Effect, EffectParameter
from zfcal.model.effects.circumstances import by_circumstances
from zfcal.model.effects.forms import apart, beyond, cut, needs_neighbour
from zfcal.model.effects.weights import LESS_ATTENTION, factor_on_attention, precision_of_attention
from zfcal.model.features import Along, Feature, Seen
from zfcal.model.kernels.compiled import hook, inlined
from zfcal.model.kernels.hats import hats
from zfcal.model.kernels.hooks import SIGHT
from zfcal.model.kernels.state import ZONE

_EDGE_M = 0.0025
_SHARP_M = tuple(0.05 * 1.15**k for k in range(17))
"""Sharp ranges that are tried: a fit sees the edge from a centimetre or two."""


@inlined
def edge(beyond_m: float) -> float:
    """Return a step from 0 to 1 within two centimetres, so that a fit finds it by its slope."""
    return 1.0 / (1.0 + math.exp(cut(-beyond_m / _EDGE_M, -60.0, 60.0)))


@hook(SIGHT)
def sight(state, sight, n, i, parameters, j):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Take away from what is farther than the range, or from who is not among the nearest."""
    away_m = apart(state, n, i, j)
    if parameters[3] > 0.0:
        return 1.0 - parameters[0] * edge(away_m - parameters[1])
    if not parameters[2] > 0.0:
        return 1.0 - parameters[0] * beyond(away_m, parameters[1])
    nearer = 0.0
    for k in range(n):
        if k not in (i, j) and state[ZONE * n + k] > 0.0 and apart(state, n, i, k) < away_m:
            nearer += 1.0
    return 1.0 - parameters[0] * min(1.0, max(0.0, nearer + 1.0 - parameters[2]))


_KNOTS_M = (0.0, 0.1, 0.2, 0.3, 0.45, 0.7)
_FAR_M = (0.08, 0.25)


def _attention(seen: Seen) -> Floats:
    return hats(seen.distance_m, _KNOTS_M)[..., 1:]


def _far(seen: Seen) -> Floats:
    return hats(seen.distance_m, _FAR_M)[..., 1:]


def _farther(seen: Seen) -> Floats:
    """Return one for who is not the nearest, and for who is not one of the two nearest."""
    rank = np.argsort(np.argsort(seen.distance_m, axis=1), axis=1)
    return np.stack([rank > 0, rank > 1], axis=-1).astype(np.float64)


_FEATURES: tuple[Feature, ...] = (
    factor_on_attention(
        _attention,
        high=0.0,
        along=Along(cue="distance to the other (m)", knots=_KNOTS_M[1:], none_at=_KNOTS_M[0]),
    ),
    factor_on_attention(_farther, label="the nearest alone", high=0.0),
    precision_of_attention(_far, "precision of far ones", high=0.0),
    by_circumstances(
        factor_on_attention(_far, label="attention to far ones", high=0.0),
        alone=LESS_ATTENTION,
        without=("the time",),
    ),
)


EFFECT = Effect(
    name="interaction-range",
    says="Fish ignore neighbours that are farther away than a certain distance.",
    reference="Katz et al. 2011, Proceedings of the National Academy of Sciences 108: 18720-18725",
    parameters=(
        EffectParameter(
            name="ignored",
            low=0.0,
            high=1.0,
            default=1.0,
            says="Share of attention that neighbours beyond the range lose.",
        ),
        EffectParameter(
            name="range_m",
            low=0.03,
            high=0.6,
            default=0.12,
            says="Distance at which half of that share is lost, in metres.",
        ),
        EffectParameter(
            name="nearest",
            low=0.0,
            high=9.0,
            default=0.0,
            says="So many of the nearest count, however far they are; 0: the range counts.",
        ),
        EffectParameter(
            name="sharp",
            low=0.0,
            high=1.0,
            default=0.0,
            says="1: all of that share is lost within two centimetres about the range, and it is "
            "the range that counts, whatever nearest is; 0: little by little.",
        ),
    ),
    strength="ignored",
    probe=0.01,
    sight=sight,
    shapes=lambda _arena: tuple(
        {"range_m": range_m} for range_m in (0.06, 0.09, 0.13, 0.19, 0.28, 0.4)
    ),
    further_shapes=lambda _arena: (
        {"nearest": 1.0},
        {"nearest": 2.0},
        *({"sharp": 1.0, "range_m": range_m} for range_m in _SHARP_M),
    ),
    fixed=("nearest", "sharp"),
    other_forms=("generic:attention:neighbour-distance",),
    lacks=needs_neighbour,
    features=lambda _arena: _FEATURES,
)

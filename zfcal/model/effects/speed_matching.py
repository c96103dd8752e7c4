"""Speed matching: a fish swims at its neighbours' speed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Floats
from zfcal.model.effects.base import Effect, EffectParameter
from zfcal.model.effects.circumstances import paces_by
from zfcal.model.effects.forms import (
    SPEED_M_S,
    apart,
    log_speed,
    needs_neighbour,
    quickness,
    times_faster,
)
from zfcal.model.kernels.compiled import hook
from zfcal.model.kernels.hats import hats, hats_where
from zfcal.model.kernels.hooks import SPEED as SPEED_HOOK
from zfcal.model.kernels.state import SPEED, ZONE
from zfcal.model.paces import Copied, Pace, Spread, Swum

_LEAST_M = 0.01


@hook(SPEED_HOOK)
def speed(state, sight, n, i, parameters, chance):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Return a power of the mean speed of those that are seen, or of all, over the usual speed."""
    total, whole = 0.0, 0.0
    for j in range(n):
        # Of unknown speed is who has just come into sight.
        is_there = j != i and state[ZONE * n + j] > 0.0 and state[SPEED * n + j] >= 0.0
        if is_there and (sight[i * n + j] > 0.0 or parameters[4] > 0.0):
            weight = max(_LEAST_M, apart(state, n, i, j)) ** -parameters[1]
            total += weight * state[SPEED * n + j]
            whole += weight
    if not whole > 0.0:
        return 1.0
    if parameters[3] > 0.0:
        return times_faster(parameters[0] * quickness(total / whole + SPEED_M_S - parameters[2]))
    return times_faster(parameters[0] * log_speed(total / whole, parameters[2]))


_KNOTS_M = (0.0, 0.1, 0.2, 0.4)
_NEAR_M = 0.2
_SLOW_TO_FAST = (-1.0, 0.3, 1.3)


def _near(swum: Swum) -> Floats:
    """Return the sums of the others' last speeds, by distance."""
    weights = hats_where(swum.here, swum.distance_m, _KNOTS_M)
    return np.asarray(np.einsum("sj,sjb->sb", swum.others, weights))


def _of_all_near(swum: Swum) -> Floats:
    """Return the sum of their last speeds, shape (step, 1)."""
    near = swum.here & (swum.distance_m < _NEAR_M)
    return np.asarray((swum.others * near).sum(axis=1, keepdims=True))


def _near_lately(swum: Swum) -> Floats:
    """Return the sums of the others' mean speeds over two seconds, by distance."""
    weights = hats_where(swum.here, swum.distance_m, _KNOTS_M)
    return np.asarray(np.einsum("sj,sjb->sb", swum.others_lately, weights))


def _of_nearest(swum: Swum, values: Floats, among: NDArray[np.bool_]) -> Floats:
    """Return what belongs to the nearest of some others, shape (step, 1); NaN without one.

    Parameters
    ----------
    values, among : ndarray, shape (step, other)
    """
    if not among.size:
        return np.full((len(among), 1), np.nan)
    rows = np.arange(len(among))
    nearest = np.where(among, swum.distance_m, np.inf).argmin(axis=1)
    return np.where(among[rows, nearest], values[rows, nearest], np.nan)[:, None]


def _near_or_far(swum: Swum) -> Floats:
    """Return hat functions of the distance to the nearest, shape (step, 1, weight)."""
    far = swum.distance_m.min(axis=1, initial=_KNOTS_M[-1])
    return hats(far, _KNOTS_M)[:, None, :-1]


def _by_fastest_near(swum: Swum) -> Floats:
    """Return how fast the fastest of those near was; a slow one says as little as none."""
    is_near = swum.here & (swum.distance_m < _NEAR_M)
    fastest = np.where(is_near, swum.others, -np.inf).max(axis=1, initial=-np.inf)
    near = np.isfinite(fastest)[:, None]
    return hats(np.where(near[:, 0], fastest, 0.0), _SLOW_TO_FAST)[:, 1:] * near


def _of_who_is_ahead(swum: Swum) -> Floats:
    """Return the mean speed over two seconds of the nearest one ahead, by its distance."""
    pace = _of_nearest(swum, swum.others_lately, swum.ahead)
    return np.nan_to_num(pace) * hats(swum.ahead_m, _KNOTS_M)[:, :-1]


def _near_ahead(swum: Swum) -> Floats:
    return hats(swum.ahead_m, _KNOTS_M)[:, None, :-1]


def _nearest(swum: Swum) -> Floats:
    """Return the last speed of the nearest, by its distance."""
    if not swum.here.size:
        return np.zeros((len(swum.here), len(_KNOTS_M)))
    rows, nearest = np.arange(len(swum.here)), swum.distance_m.argmin(axis=1)
    pace = swum.others[rows, nearest] * swum.here[rows, nearest]
    return np.asarray(pace[:, None] * hats(swum.distance_m[rows, nearest], _KNOTS_M))


EFFECT = Effect(
    name="speed-matching",
    says="Fish swim fast when the neighbours that they see swim fast.",
    opposite="Fish swim slowly when the neighbours that they see swim fast.",
    reference="Katz et al. 2011, Proceedings of the National Academy of Sciences 108: 18720-18725",
    parameters=(
        EffectParameter(
            name="exponent",
            low=-1.5,
            high=1.5,
            default=0.5,
            says="Power of the neighbours' speed to which the own speed is proportional.",
        ),
        EffectParameter(
            name="focus",
            low=0.0,
            high=6.0,
            default=0.0,
            says="0: all that are seen count alike; the larger, the more the nearest counts.",
        ),
        EffectParameter(
            name="usual_m_s",
            low=0.01,
            high=0.3,
            default=SPEED_M_S,
            says="Neighbours' speed at which a fish swims as it would alone, in m/s.",
        ),
        EffectParameter(
            name="evenly",
            low=0.0,
            high=1.0,
            default=0.0,
            says="0: a power of that speed; 1: an exponential of it, per 0.05 m/s.",
        ),
        EffectParameter(
            name="unseen",
            low=0.0,
            high=1.0,
            default=0.0,
            says="1: those that are not seen count as well.",
        ),
    ),
    strength="exponent",
    probe=0.01,
    speed=speed,
    shapes=lambda _arena: ({"focus": 0.0}, {"focus": 4.0}),
    lacks=needs_neighbour,
    further_shapes=lambda _arena: (
        *({"focus": focus, "evenly": 1.0} for focus in (0.0, 4.0)),
        *({"focus": focus, "evenly": 1.0, "unseen": 1.0} for focus in (0.0, 2.0, 6.0)),
    ),
    fixed=("focus", "usual_m_s", "evenly", "unseen"),
    other_forms=("generic:speed:neighbour-speed",),
    paces=(
        Pace(label="of those near", weights=_near),
        *paces_by(
            Pace(label="of all near", weights=_of_all_near),
            "who",
            "the time",
            "the last speed",
            "how many are near",
        ),
        Pace(label="of the nearest", weights=_nearest),
        Pace(label="of those near, over two seconds", weights=_near_lately),
        Pace(label="of who is ahead, over two seconds", weights=_of_who_is_ahead),
        Spread(label="slow and fast ones, by the fastest near", weights=_by_fastest_near),
        Copied(
            label="the speed of the nearest",
            of=lambda swum: _of_nearest(swum, swum.others_m_s, swum.here),
            ago=lambda swum: _of_nearest(swum, swum.others_ago_m_s, swum.here),
            weights=_near_or_far,
        ),
        Copied(
            label="the speed of who is ahead",
            of=lambda swum: _of_nearest(swum, swum.others_m_s, swum.ahead),
            ago=lambda swum: _of_nearest(swum, swum.others_ago_m_s, swum.ahead),
            weights=_near_ahead,
        ),
    ),
)

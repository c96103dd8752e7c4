"""Burst and coast: speed depends on the own recent speed."""

from __future__ import annotations

import numpy as np

from zfcal.arrays import Floats
from zfcal.model.effects.base import Effect, EffectParameter
from zfcal.model.effects.circumstances import paces_by
from zfcal.model.effects.forms import SPEED_M_S, log_speed, quickness, times_faster
from zfcal.model.kernels.compiled import hook
from zfcal.model.kernels.hats import hats
from zfcal.model.kernels.hooks import SPEED as SPEED_HOOK
from zfcal.model.kernels.state import LATELY, SPEED
from zfcal.model.paces import LATELY_S, LONGER_S, Copied, Pace, Spread, Swum


@hook(SPEED_HOOK)
def speed(state, sight, n, i, parameters, chance):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Return a power of the own last speed, or of the mean of the last ones, over the usual one."""
    last = state[SPEED * n + i]
    if parameters[3] > 0.0:
        last = state[LATELY * n + i]
        if not last > 0.0:  # not known
            return times_faster(0.0)
    if parameters[2] > 0.0:
        return times_faster(parameters[0] * quickness(last + SPEED_M_S - parameters[1]))
    return times_faster(parameters[0] * log_speed(last, parameters[1]))


_KNOTS = (-1.5, -0.5, 0.5, 1.5)
_SLOW_TO_FAST = (-1.2, 0.0, 1.2)
_KNOTS_STEPS = (1.0, 2.0, 4.0, 7.0, 12.0)
_KEPT = (0.55, 0.7, 0.85, 1.0)
"""Shares of the last speed that a coasting fish may have kept."""


def _last(swum: Swum) -> Floats:
    return hats(swum.last, _KNOTS)[:, 1:] * (swum.last != 0.0)[:, None]


def _by_faster(last: Floats, before_last: Floats) -> Floats:
    """Return how fast the faster of two steps was: of none where one is not known."""
    known = (last != 0.0) & (before_last != 0.0)
    return hats(np.maximum(last, before_last), _SLOW_TO_FAST)[:, 1:] * known[:, None]


def _slow_to_fast(last: Floats) -> Floats:
    return hats(last, _SLOW_TO_FAST)[:, 1:] * (last != 0.0)[:, None]


def _shares(speed_m_s: Floats) -> Floats:
    return speed_m_s[:, None] * np.array(_KEPT)


def _each_share(swum: Swum) -> Floats:
    return np.broadcast_to(np.eye(len(_KEPT)), (len(swum.last), len(_KEPT), len(_KEPT)))


def _since_fast(swum: Swum) -> Floats:
    return hats(swum.since_fast, _KNOTS_STEPS)[:, :-1]


def _some_ago(swum: Swum) -> Floats:
    return np.stack([swum.last, swum.before_last, swum.third], axis=1)


EFFECT = Effect(
    name="burst-and-coast",
    says="A fish that has just been fast stays fast, and a slow one stays slow.",
    opposite="A fish that has just been fast slows down, and a slow one speeds up.",
    reference="Calovi et al. 2018, PLoS Computational Biology 14: e1005933",
    parameters=(
        EffectParameter(
            name="exponent",
            low=-1.5,
            high=1.5,
            default=0.4,
            says="Power of the own last speed to which the speed is proportional.",
        ),
        EffectParameter(
            name="usual_m_s",
            low=0.01,
            high=0.3,
            default=SPEED_M_S,
            says="Last speed at which the next is as the base model has it, in m/s.",
        ),
        EffectParameter(
            name="evenly",
            low=0.0,
            high=1.0,
            default=0.0,
            says="0: a power of that speed; 1: an exponential of it, per 0.05 m/s.",
        ),
        EffectParameter(
            name="lately",
            low=0.0,
            high=1.0,
            default=0.0,
            says="1: the mean of the last speeds, which fades with two seconds, in place of the "
            "last one.",
        ),
    ),
    strength="exponent",
    probe=0.01,
    speed=speed,
    further_shapes=lambda _arena: (
        {"evenly": 1.0},
        {"lately": 1.0},
        {"lately": 1.0, "evenly": 1.0},
    ),
    fixed=("usual_m_s", "evenly", "lately"),
    shown_against="speed",
    other_forms=("generic:speed:own-speed",),
    paces=(
        Pace(label="by the last speed", weights=_last),
        *paces_by(
            Pace(label="by the last speed", weights=lambda swum: swum.last[:, None]),
            "who",
            "the time",
        ),
        Pace(label="by the last three speeds", weights=_some_ago),
        Pace(
            label="by the mean over two seconds",
            weights=lambda swum: swum.lately[:, None],
            past_s=LATELY_S,
        ),
        Pace(
            label="by the means over two and four seconds",
            weights=lambda swum: np.stack([swum.lately, swum.longer], axis=1),
            past_s=LONGER_S,
        ),
        Pace(label="by the time since a fast step", weights=_since_fast),
        Spread(
            label="slow and fast ones, by the last speed",
            weights=lambda swum: _slow_to_fast(swum.last),
            ago=lambda swum: _slow_to_fast(swum.earlier),
        ),
        Spread(
            label="slow and fast ones, by the last two",
            weights=lambda swum: _by_faster(swum.last, swum.before_last),
            ago=lambda swum: _by_faster(swum.earlier, swum.before_earlier),
        ),
        Copied(
            label="a share of the last speed",
            of=lambda swum: _shares(swum.last_m_s),
            ago=lambda swum: _shares(swum.last_ago_m_s),
            weights=_each_share,
        ),
    ),
)

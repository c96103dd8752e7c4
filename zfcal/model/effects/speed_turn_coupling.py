"""Speed-turn coupling: fast steps are straighter than slow ones.

The model draws the speed first, so what is a slowing down in turns for the fish is a
turning less at speed for the model: the same joint law.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Floats
from zfcal.model.directions import doubled, lengths
from zfcal.model.effects.base import Effect, EffectParameter
from zfcal.model.effects.circumstances import by_circumstances, each_under, paces_by
from zfcal.model.effects.forms import SPEED_M_S, quickness, tilt
from zfcal.model.effects.weights import only, own_heading_by
from zfcal.model.features import (
    Along,
    Component,
    Feature,
    Landing,
    Seen,
    Sharper,
    Tilt,
)
from zfcal.model.kernels.compiled import hook
from zfcal.model.kernels.hats import hats
from zfcal.model.kernels.hooks import FACTOR
from zfcal.model.kernels.state import FOLLOWS, HX, HY, SPEED, TAU_X, TAU_Y
from zfcal.model.paces import Pace, Spread, Swum


@hook(FACTOR)
def factor(state, sight, n, i, parameters, ux, uy, speed, landing):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Weigh headings by how straight on they are times how quick the step is."""
    straight = state[HX * n + i] * ux + state[HY * n + i] * uy
    if parameters[2] > 0.0:
        off = 2.0 * (1.0 - straight)
        if state[FOLLOWS * n + i] > 0.0:
            # The base law has both senses of the wall there, whatever the heading before was.
            across = state[TAU_X * n + i] * uy - state[TAU_Y * n + i] * ux
            off = across * across
        off /= parameters[4] * parameters[4]
        straight = (1.0 - off) * math.exp(-0.5 * off)
    usual_m_s, last_m_s = parameters[1], state[SPEED * n + i]
    if parameters[5] > 0.0:
        if not last_m_s >= 0.0:
            return 1.0
        speed = last_m_s
    elif parameters[3] > 0.0 and last_m_s >= 0.0:  # not where it is not known
        usual_m_s = last_m_s
    quick = quickness(speed + SPEED_M_S - usual_m_s)
    return tilt(parameters[0], quick * straight, abs(quick))


_KNOTS_M_S = (0.0, 0.05, 0.1, 0.15, 0.2)


def _quicker(seen: Seen) -> Floats:
    weights = hats(seen.own_speed_m_s, _KNOTS_M_S)
    return np.asarray((weights - weights.mean(axis=0))[:, 1:])


def _by_speed(seen: Seen) -> Floats:
    """Return the own heading, weighed by what the step's speed has beside the mean of all steps."""
    return np.asarray(_quicker(seen)[..., None] * seen.own_heading[:, None])


def _axis_by_speed(seen: Seen) -> Floats:
    """Return that of twice the angle: steps straight on and straight back, against those aside."""
    return np.asarray(_quicker(seen)[..., None] * doubled(seen.own_heading)[:, None])


def _by_last_speed(seen: Seen) -> Floats:
    return own_heading_by(seen, hats(seen.last_speed_m_s, _LAST_M_S))


_LAST_M_S = (0.03, 0.08, 0.14)
_KNOTS_RAD = (0.0, 0.5, 1.0, 2.0, 3.2)


def _spread_by_last_turn(swum: Swum) -> Floats:
    return hats(swum.last_turn_rad, (0.0, 0.5, 1.5))[:, 1:]


def _spread_by_bends(swum: Swum) -> Floats:
    """Return whether one of the last three turns was wide; no weight where one is not known."""
    return np.nan_to_num(hats(swum.bent_rad, (0.2, 0.6))[:, 1:])


def _by_turn(swum: Swum) -> Floats:
    return hats(swum.turn_rad, _KNOTS_RAD)[:, 1:]


def _by_last_turn(swum: Swum) -> Floats:
    return hats(swum.last_turn_rad, _KNOTS_RAD)[:, 1:]


def _turn_rad(seen: Seen, rows: NDArray[np.intp], xy_m: Floats) -> Floats:
    """Return by how much a fish turns that goes to some positions."""
    x, y = np.moveaxis(xy_m - seen.xy_m[rows, None], -1, 0)
    own_x, own_y = seen.own_heading[rows].T[..., None]
    return np.asarray(np.arctan2(np.abs(own_x * y - own_y * x), own_x * x + own_y * y))


def _aside_m(seen: Seen, rows: NDArray[np.intp], xy_m: Floats) -> Floats:
    """Return how long an arc is that leads to positions: their distance times the turn."""
    far_m = lengths(xy_m - seen.xy_m[rows, None])
    return np.asarray(_turn_rad(seen, rows, xy_m) * far_m)


_TURN_RAD = (0.0, 0.4, 0.8, 1.2, 1.8, 2.8)
_ASIDE_M = (0.0, 0.01, 0.02, 0.03, 0.045, 0.07)

_FAST_M_S = (0.06, 0.1, 0.14)
_NO_TURN_RAD = 9.0
"""More than any turn: what lands there has no weight."""

_BY_TURN = Along(cue="turn (rad)", knots=_TURN_RAD[:-1])
_TURNING_LESS = Landing(label="turning less", away_m=_turn_rad, knots_m=_TURN_RAD)


def _when_fast(least_m_s: float) -> Landing:
    """Return landings by the turn that leads there, of steps that are faster than some speed."""

    def away_m(seen: Seen, rows: NDArray[np.intp], xy_m: Floats) -> Floats:
        fast = seen.own_speed_m_s[rows, None] > least_m_s
        return np.where(fast, _turn_rad(seen, rows, xy_m), _NO_TURN_RAD)

    return replace(
        _TURNING_LESS,
        label=f"turns of steps faster than {least_m_s:g} m/s",
        away_m=away_m,
        along=_BY_TURN,
        over=_TURNING_LESS,
    )


_SCATTERED = 1.0
"""Concentration of headings that are hardly those of the fish."""


_BACK = 3.0
_BY_ITS_SPEED = Along(cue="speed of the step (m/s)", knots=_KNOTS_M_S)


def _ahead(seen: Seen) -> Floats:
    return only(seen.own_heading)


def _back(seen: Seen) -> Floats:
    return only(-seen.own_heading)


def _each_speed(seen: Seen) -> Floats:
    return only(hats(seen.own_speed_m_s, _KNOTS_M_S))


def _alike(seen: Seen) -> Floats:
    return np.ones((len(seen.zone), 1, 1))


_BY_SPEED = Tilt(label="by speed", vectors=_by_speed)

_FEATURES: tuple[Feature, ...] = (
    _BY_SPEED,
    by_circumstances(
        _BY_SPEED,
        alone=each_under(Tilt(label="ahead", vectors=_ahead)),
        without=("the speed",),
    ),
    Tilt(label="by the last speed", vectors=_by_last_speed),
    Sharper(label="sharper by speed", by=_quicker),
    # More than at all speeds alike, which would be another law of turns.
    Component(
        label="scattered, by speed",
        toward=_ahead,
        weights=_each_speed,
        kappa=_SCATTERED,
        along=_BY_ITS_SPEED,
        over=Component(label="scattered", toward=_ahead, weights=_alike, kappa=_SCATTERED),
    ),
    Component(
        label="turning back, by speed",
        toward=_back,
        weights=_each_speed,
        kappa=_BACK,
        along=_BY_ITS_SPEED,
        over=Component(label="turning back", toward=_back, weights=_alike, kappa=_BACK),
    ),
    Tilt(label="straight or aside, by speed", vectors=_axis_by_speed, axial=True),
    Landing(
        label="landing aside",
        away_m=_aside_m,
        knots_m=_ASIDE_M,
        along=Along(cue="turn times length of the step (m)", knots=_ASIDE_M[:-1]),
        # More than by the turn alone, which would be another law of turns.
        over=_TURNING_LESS,
    ),
    *map(_when_fast, _FAST_M_S),
)


EFFECT = Effect(
    name="speed-turn-coupling",
    says="Fish slow down in turns: fast steps are straighter than slow ones.",
    opposite="Fish speed up in turns: slow steps are straighter than fast ones.",
    reference="Mwaffo et al. 2015, Journal of the Royal Society Interface 12: 20140884",
    parameters=(
        EffectParameter(
            name="strength",
            low=-3.0,
            high=3.0,
            default=0.7,
            says="Log of the preference for straight on against a right angle, gained per "
            "0.05 m/s.",
        ),
        EffectParameter(
            name="usual_m_s",
            low=0.01,
            high=0.3,
            default=SPEED_M_S,
            says="Speed at which turns are as the base model has them, in m/s; with kick where the "
            "last speed is not known.",
        ),
        EffectParameter(
            name="local",
            low=0.0,
            high=1.0,
            default=0.0,
            says="0: headings are preferred by the cosine of their turn. 1: those close to the own "
            "direction are preferred, and those a little aside of it avoided; where fish follow "
            "walls either way along the wall is the own direction.",
        ),
        EffectParameter(
            name="kick",
            low=0.0,
            high=1.0,
            default=0.0,
            says="1: steps count as fast that are faster than the one before, whatever its speed.",
        ),
        EffectParameter(
            name="width_rad",
            low=0.2,  # Two cells of headings: the likelihood would not see a narrower one whole.
            high=1.0,
            default=0.35,
            says="Where local: turns beyond which headings are less preferred, in radians.",
        ),
        EffectParameter(
            name="last",
            low=0.0,
            high=1.0,
            default=0.0,
            says="1: the speed of the step before counts, not that of the step itself, whatever "
            "kick is.",
        ),
    ),
    probe=0.01,
    factor=factor,
    harmonics=1,
    not_harmonic="local",
    further_shapes=lambda _arena: ({"local": 1.0}, {"local": 1.0, "kick": 1.0}, {"last": 1.0}),
    fixed=("usual_m_s", "local", "kick", "last"),
    idle=lambda values: () if values["local"] else ("width_rad",),
    shown_against="speed",
    other_forms=("generic:speed:own-turn",),
    features=lambda _arena: _FEATURES,
    # Not by the turn of the step itself: near a wall a long step has to turn.
    paces=(
        Pace(label="by the last turn", weights=_by_last_turn),
        *paces_by(
            Pace(label="by the last turn", weights=lambda swum: swum.last_turn_rad[:, None]),
            "who",
            "the time",
        ),
        Spread(label="slow and fast ones, by the last turn", weights=_spread_by_last_turn),
        Spread(label="slow and fast ones, by the last three turns", weights=_spread_by_bends),
    ),
    paces_given=(Pace(label="by the turn", weights=_by_turn),),
)

"""Leader following: fast neighbours get more attention than slow ones."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from zfcal.arrays import Floats
from zfcal.model.effects.base import Effect, EffectParameter
from zfcal.model.effects.circumstances import by_circumstances
from zfcal.model.effects.forms import Hooked, apart, needs_neighbour, quickness
from zfcal.model.effects.weights import (
    ATTENTION,
    IN_VIEW_M,
    SHARP,
    factor_on_attention,
    precision_of_attention,
    summed,
)
from zfcal.model.features import Along, Component, Feature, OneOf, Seen, Tilt, Weights
from zfcal.model.kernels.compiled import hook, inlined
from zfcal.model.kernels.hats import hats
from zfcal.model.kernels.hooks import COMPONENT, SIGHT
from zfcal.model.kernels.state import HX, HY, LATELY, SPEED, ZONE, X, Y

_PER_STRENGTH = 0.1
_KNOWN_M_S = 1e-12  # A mean of 0 is that of who has just come, or has not moved since.


@inlined
def fastest_within(state: Hooked, n: int, i: int, reach_m: float) -> int:
    """Return the fastest other agent within reach, seen or not; -1 without one of known speed."""
    found, most = -1, -1.0
    for j in range(n):
        is_near = j != i and state[ZONE * n + j] > 0.0 and apart(state, n, i, j) < reach_m
        if is_near and state[SPEED * n + j] > most:
            found, most = j, state[SPEED * n + j]
    return found


@inlined
def fastest_in_view(state: Hooked, sight: Hooked, n: int, i: int) -> int:
    """Return the fastest other agent in view; -1 without one of known speed."""
    found, most = -1, -1.0
    for j in range(n):
        if sight[i * n + j] > 0.0 and state[SPEED * n + j] > most:
            found, most = j, state[SPEED * n + j]
    return found


@inlined
def faster_lately(state: Hooked, sight: Hooked, n: int, i: int, reach_m: float) -> int:
    """Return the fastest in view and within reach, of those that lately were faster; or -1."""
    own = state[LATELY * n + i]
    found, most = -1, own if own >= _KNOWN_M_S else math.inf  # It has just come into sight.
    for j in range(n):
        is_near = sight[i * n + j] > 0.0 and apart(state, n, i, j) < reach_m
        if is_near and state[LATELY * n + j] > most:
            found, most = j, state[LATELY * n + j]
    return found


@hook(COMPONENT)
def component(state, sight, n, i, parameters, out):  # type: ignore[no-untyped-def]
    """Add a component about the bearing of the fastest within reach, or in view.

    Or about that of a certain agent.
    """
    if not parameters[3] > 0.0:
        return 0.0
    k = int(parameters[2])
    if k < 0:
        if parameters[7] > 0.0:
            k = faster_lately(state, sight, n, i, parameters[4])
        elif parameters[1] > 0.0:
            k = fastest_in_view(state, sight, n, i)
        else:
            k = fastest_within(state, n, i, parameters[4])
    if k < 0 or k >= n or k == i or not state[ZONE * n + k] > 0.0:
        return 0.0
    far_m = max(apart(state, n, i, k), 1e-9)
    out[0] = (state[X * n + k] - state[X * n + i]) / far_m
    out[1] = (state[Y * n + k] - state[Y * n + i]) / far_m
    out[2] = parameters[5]
    return _PER_STRENGTH * max(parameters[0], 0.0)


@hook(SIGHT)
def sight(state, sight, n, i, parameters, j):  # type: ignore[no-untyped-def]
    """Weigh a neighbour by how much faster than 0.07 m/s it swims, or one of them alone.

    Or by how much it is ahead and swims the way that the fish does.
    """
    if parameters[3] > 0.0:
        return 1.0
    if parameters[6] > 0.0:
        far_m = max(apart(state, n, i, j), 1e-9)
        hx, hy = state[HX * n + i], state[HY * n + i]
        x, y = state[X * n + j] - state[X * n + i], state[Y * n + j] - state[Y * n + i]
        alike = hx * state[HX * n + j] + hy * state[HY * n + j]
        led = max(0.0, hx * x + hy * y) / far_m * max(0.0, alike)
        return math.exp(parameters[0] * led)
    if parameters[2] >= 0.0:
        return math.exp(parameters[0]) if j == int(parameters[2]) else 1.0
    if parameters[1] > 0.0:
        row = LATELY if parameters[7] > 0.0 else SPEED
        least = _KNOWN_M_S if row == LATELY else 0.0
        if not state[row * n + j] >= least:  # Of unknown speed: it has just come into sight.
            return 1.0
        for k in range(n):
            if sight[i * n + k] > 0.0 and state[row * n + k] > state[row * n + j]:
                return 1.0
        return math.exp(parameters[0])
    return math.exp(parameters[0] * quickness(state[SPEED * n + j]))


_MOST_FISH = 12
"""With more than so many tracks nobody is known for long enough to be followed as such."""

_MOST_LED = 8
"""Of so many agents each is tried as the one that is followed."""

_KNOTS_M_S = (0.0, 0.05, 0.1, 0.15, 0.2)
_FAST_RANGE_M_S = (0.03, 0.14)
_LATELY_M_S = (0.03, 0.07, 0.11)


def _attention(seen: Seen) -> Floats:
    return hats(seen.speed_m_s, _KNOTS_M_S)[..., 1:]


def _fast(seen: Seen) -> Floats:
    return hats(seen.speed_m_s, _FAST_RANGE_M_S)[..., 1:]


def _attention_lately(seen: Seen) -> Floats:
    return hats(seen.lately_m_s, _LATELY_M_S)[..., 1:]


def _fastest(seen: Seen) -> Floats:
    return seen.chosen(seen.speed_m_s, seen.attention > 0)


def _fastest_lately(seen: Seen) -> Floats:
    return seen.chosen(seen.lately_m_s, seen.attention > 0)


def _going_its_way(seen: Seen) -> Floats:
    """Return how much each other one is ahead and swims the way that the fish does."""
    ahead = np.cos(seen.off_axis_rad)
    alike = np.einsum("sjd,sd->sj", seen.heading, seen.own_heading)
    return np.asarray(np.maximum(ahead, 0.0) * np.maximum(alike, 0.0))[..., None]


def _fast_in_view(least_m_s: float) -> Weights:
    """Return one for the fastest other one in view, if it is faster than that."""
    return lambda seen: seen.chosen(
        seen.speed_m_s,
        seen.in_sight & (seen.speed_m_s > least_m_s) & (seen.has_rivals or least_m_s > 0),
    )


def _who(seen: Seen) -> Floats:
    """Return one for each fish but the first, shape (step, other, fish - 1)."""
    fish = np.unique(np.where(seen.is_robot, -1, seen.other))
    fish = fish[fish >= 0]
    if len(fish) > _MOST_FISH:
        return np.zeros((*seen.other.shape, 0))
    return np.asarray((seen.other[..., None] == fish[1:]) & ~seen.is_robot[..., None], float)


def _one(k: int) -> Weights:
    """Return one for a certain fish, the k-th of all, and nothing where there are fewer."""

    def weights(seen: Seen) -> Floats:
        fish = np.unique(np.where(seen.is_robot, -1, seen.other))
        fish = fish[fish >= 0]
        chosen = fish[k] if k < len(fish) <= _MOST_FISH else -2
        return np.asarray(((seen.other == chosen) & ~seen.is_robot)[..., None], float)

    return weights


def _within(reach_m: float) -> Weights:
    """Return one for the fastest other one within reach, seen or not."""

    def weights(seen: Seen) -> Floats:
        near = seen.here & (seen.distance_m < reach_m) & (seen.speed_m_s >= 0)
        return seen.chosen(seen.speed_m_s, near & seen.has_rivals)

    return weights


def _leaning_within(reach_m: float) -> Weights:
    return lambda seen: summed(_within(reach_m)(seen), seen.bearing)


def _over_time(
    label: str, reaches_m: Sequence[float], made: Callable[[str, Weights], Component]
) -> OneOf:
    """Return a feature of the fastest, by the time that its speed is taken over."""
    return OneOf(
        kind=f"{label}, over some time",
        features=tuple(
            made(
                f"{label} {over_s:g} s within {reach_m:g} m" + ", if it was faster" * if_faster,
                partial(Seen.fastest, over_s=over_s, within_m=reach_m, if_faster=if_faster),
            )
            for over_s in _OVER_S
            for reach_m in reaches_m
            for if_faster in (False, True)
        ),
    )


_DRAWN, _LEANING = "drawn to the fastest", "leaning to the fastest"
_OVER_S = (0.2, 0.6, 1.0, 2.0)
_REACH_M = (0.1, 0.2, 9.0)
_FAST_M_S = (0.0, 0.07, 0.09, 0.11)


def _drawn(label: str, weights: Weights) -> Component:
    return Component(label=label, toward="bearing", weights=weights, kappa=SHARP)


def _near(seen: Seen) -> Floats:
    return np.asarray(seen.here & (seen.distance_m < _REACH_M[1]), float)[..., None]


def _leaning_to_each_near(seen: Seen) -> Floats:
    return summed(_near(seen), seen.bearing)


def _leaning_to_the_fast(seen: Seen) -> Floats:
    """Return the bearings of those near by their speeds, shape (step, speed, 2)."""
    return summed(_attention(seen) * _near(seen), seen.bearing)


_FEATURES: tuple[Feature, ...] = (
    factor_on_attention(
        _attention,
        along=Along(cue="speed of the other (m/s)", knots=_KNOTS_M_S[1:], none_at=_KNOTS_M_S[0]),
    ),
    factor_on_attention(_fastest, label="the fastest in view"),
    factor_on_attention(
        _attention_lately,
        label="attention, by speeds of two seconds",
        along=Along(
            cue="mean speed of the other over 2 s (m/s)", knots=_LATELY_M_S[1:],
            none_at=_LATELY_M_S[0],
        ),
    ),
    factor_on_attention(_fastest_lately, label="the fastest in view, over two seconds"),
    factor_on_attention(lambda seen: seen.foremost, label="the foremost"),
    factor_on_attention(_going_its_way, label="who is ahead and swims its way"),
    factor_on_attention(_who, label="who"),
    precision_of_attention(_fast, "precision of the fast"),
    factor_on_attention(lambda seen: seen.in_open[..., None], label="who is in the open"),
    by_circumstances(
        factor_on_attention(_fast, label="attention to the fast"),
        alone=ATTENTION,
        without=("the time",),
        of_each=True,
    ),
    OneOf(
        kind="drawn to the fastest in view",
        features=tuple(
            Component(label=f"drawn to the fastest in view, from {least_m_s:g} m/s on",
                      toward="bearing", weights=_fast_in_view(least_m_s), kappa=6.0)
            for least_m_s in _FAST_M_S
        ),
    ),
    OneOf(
        kind=_DRAWN,
        features=tuple(
            Component(label=f"{_DRAWN}, {reach_m:g} m", toward="bearing", weights=_within(reach_m),
                      kappa=5.0)
            for reach_m in _REACH_M
        ),
    ),
    _over_time(
        "heeding the fastest of", IN_VIEW_M[-1:],
        lambda label, weights: factor_on_attention(weights, label=label),
    ),
    _over_time("drawn to the fastest of", IN_VIEW_M, _drawn),
    OneOf(
        kind=_LEANING,
        features=tuple(
            Tilt(label=f"{_LEANING}, {reach_m:g} m", vectors=_leaning_within(reach_m), low=0.0)
            for reach_m in _REACH_M
        ),
    ),
    # More than to each alike, which would be cohesion.
    Tilt(
        label="leaning to the fast", vectors=_leaning_to_the_fast, low=0.0,
        over=Tilt(label="leaning to each near", vectors=_leaning_to_each_near, low=0.0),
    ),
    # One of them: a pull to each alike would be cohesion.
    OneOf(
        kind="drawn to one",
        features=tuple(
            Component(
                label=f"drawn to fish {k}", toward="bearing", weights=_one(k), kappa=5.0
            )
            for k in range(_MOST_LED)
        ),
    ),
)  # fmt: skip


EFFECT = Effect(
    name="leader-following",
    says="Fish attend more to neighbours that lead: that swim fast, or ahead of them.",
    opposite="Fish attend more to neighbours that swim slowly.",
    reference="Pettit et al. 2015, Current Biology 25: 3132-3137",
    parameters=(
        EffectParameter(
            name="strength",
            low=-2.0,
            high=2.0,
            default=0.7,
            says="Log of the attention gained per 0.05 m/s that a neighbour is faster than "
            "0.07 m/s.",
        ),
        EffectParameter(
            name="fastest",
            low=0.0,
            high=1.0,
            default=0.0,
            says="1: the fastest of those that are seen gets all of it, as one 0.05 m/s faster; "
            "where some are drawn, they are to that one.",
        ),
        EffectParameter(
            name="who",
            low=-1.0,
            high=99.0,
            default=-1.0,
            says="Number of the agent that gets all of it, whatever its speed, the first one 0; "
            "-1: nobody in particular.",
        ),
        EffectParameter(
            name="drawn",
            low=0.0,
            high=1.0,
            default=0.0,
            says="1: nobody gets more attention, and some headings are drawn about the bearing of "
            "the fastest, or of the agent `who`, as a component of the weight 0.1 per strength.",
        ),
        EffectParameter(
            name="reach_m",
            low=0.02,
            high=2.0,
            default=0.2,
            says="Distance within which that one is the fastest, in metres.",
        ),
        EffectParameter(
            name="kappa",
            low=0.0,
            high=30.0,
            default=5.0,
            says="Von Mises concentration about that bearing.",
        ),
        EffectParameter(
            name="same_way",
            low=0.0,
            high=1.0,
            default=0.0,
            says="1: who is straight ahead and has the fish's own heading gets all of it, whatever "
            "its speed; others by the cosines of both angles, and none beyond a right angle.",
        ),
        EffectParameter(
            name="lately",
            low=0.0,
            high=1.0,
            default=0.0,
            says="1: who is the fastest goes by mean speeds that fade over two seconds; where some "
            "are drawn, to the fastest in view within that distance, if faster than the fish.",
        ),
    ),
    probe=0.01,
    component=component,
    sight=sight,
    further_shapes=lambda _arena: (
        {"fastest": 1.0},
        {"fastest": 1.0, "lately": 1.0},
        {"same_way": 1.0},
        {"drawn": 1.0, "fastest": 1.0},
        *({"who": float(who)} for who in range(_MOST_LED)),
        *({"drawn": 1.0, "reach_m": reach_m} for reach_m in (0.1, 0.15, 0.2, 2.0)),
        *({"drawn": 1.0, "lately": 1.0, "reach_m": reach_m} for reach_m in (0.1, 0.25, 2.0)),
        *({"drawn": 1.0, "who": float(who)} for who in range(_MOST_LED)),
    ),
    fixed=("fastest", "who", "drawn", "reach_m", "kappa", "same_way", "lately"),
    needs={"component": ("drawn",)},
    lacks=needs_neighbour,
    features=lambda _arena: _FEATURES,
)

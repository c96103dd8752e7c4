"""Alignment: a fish turns toward its neighbours' headings."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import numpy as np

from zfcal.arrays import Floats
from zfcal.model.effects.base import Control, Effect, EffectParameter
from zfcal.model.effects.circumstances import by_circumstances
from zfcal.model.effects.forms import (
    Hooked,
    apart,
    foremost_agent,
    nearest_agent,
    needs_neighbour,
    of_base,
    seen_by_rank,
    tilt,
)
from zfcal.model.effects.weights import (
    agreed_heading,
    aside_of,
    attended,
    both_senses,
    evenly,
    halfway,
    mean_heading,
    seen_and_nearest,
    summed,
    to_one_sense,
    turning_as_a_whole,
)
from zfcal.model.features import Along, Component, Feature, OneOf, Seen, Tilt, Turned
from zfcal.model.kernels.compiled import hook, inlined
from zfcal.model.kernels.hats import hats, hats_where
from zfcal.model.kernels.hooks import COMPONENT, FACTOR, ROTATION
from zfcal.model.kernels.state import FOLLOWS, HX, HY, ZONE

_USUAL_SR = 0.01
"""Solid angle of a neighbour at about 0.1 m."""

_NEAR_M, _REACHES_M = 0.15, (0.08, 0.25, 0.4)
_FOREMOST_M = (0.08, 0.15, 0.4)
_PER_WEIGHT, _WAY_PER_WEIGHT = 0.03, 0.01
_USUAL_M_S = 0.05
_OFF_WALLS, _IN_SIGHT = ", off the walls", ", in sight"
_AHEAD_RAD = (0.0, 0.8, 1.6, math.pi)
_AHEAD_M = (0.0, 0.05, 0.15, 0.4)


@inlined
def one_agent(state: Hooked, n: int, i: int, among: float, reach_m: float) -> int:
    """Return the nearest other one, or the foremost within reach; -1 without one."""
    if among < 3.0:
        return nearest_agent(state, n, i)
    return foremost_agent(state, n, i, reach_m)


@hook(COMPONENT)
def component(state, sight, n, i, parameters, out):  # type: ignore[no-untyped-def]
    """Add a component about the neighbours' mean heading; the more they agree, the heavier.

    Or about the heading of the nearest, or of the foremost, or one about that of each.
    """
    if parameters[3] > 0.0 or parameters[4] > 0.0:
        return 0.0
    if parameters[5] > 0.0 or parameters[7] > 0.0:
        of_each = 1.0 < parameters[5] < 3.0
        if of_each == (parameters[7] > 0.0):
            if of_each:
                k = seen_by_rank(state, sight, n, i, parameters[7])
            else:
                k = one_agent(state, n, i, parameters[5], parameters[6])
            if k >= 0:
                out[0], out[1], out[2] = state[HX * n + k], state[HY * n + k], parameters[1]
                graded = of_each and parameters[2] > 0.0
                return parameters[0] * (sight[i * n + k] if graded else _USUAL_SR)
        return 0.0
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


@inlined
def near_heading(state: Hooked, n: int, i: int, reach_m: float) -> tuple[float, float, float]:
    """Return the sum of the headings of all within reach, seen or not, and how many."""
    x, y, near = 0.0, 0.0, 0.0
    for j in range(n):
        if j != i and state[ZONE * n + j] > 0.0 and apart(state, n, i, j) < reach_m:
            x += state[HX * n + j]
            y += state[HY * n + j]
            near += 1.0
    return x, y, near


@hook(FACTOR)
def factor(state, sight, n, i, parameters, ux, uy, speed, landing):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Weigh headings by the mean heading of all that are near; the sense along a wall too.

    Or by the heading of the nearest, or of the foremost.
    """
    leaning = _PER_WEIGHT * parameters[3]
    if of_base(parameters[4]) and state[FOLLOWS * n + i] > 0.0:
        leaning = _WAY_PER_WEIGHT * parameters[4]
    if not leaning > 0.0:
        return 1.0
    if parameters[5] > 0.0:
        k = one_agent(state, n, i, parameters[5], parameters[6])
        if k < 0:
            return 1.0
        return tilt(leaning * parameters[0], state[HX * n + k] * ux + state[HY * n + k] * uy, 1.0)
    x, y, near = near_heading(state, n, i, parameters[6])
    if not near > 0.0:
        return 1.0
    return tilt(leaning * parameters[0], (x * ux + y * uy) / near, math.sqrt(x * x + y * y) / near)


@inlined
def turn_to_mean(state: Hooked, n: int, i: int, parameters: Hooked) -> float:
    """Return a share of the angle to the mean heading of all that are near."""
    x, y, near = near_heading(state, n, i, parameters[6])
    hx, hy = state[HX * n + i], state[HY * n + i]
    if not near > 0.0:
        return 0.0
    return (
        _WAY_PER_WEIGHT * parameters[0] * min(parameters[4], 1.0)
        * math.atan2(hx * y - hy * x, hx * x + hy * y)
    )  # fmt: skip


@hook(ROTATION)
def rotation(state, sight, n, i, parameters):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Turn a share of the way to the mean heading of all that are near; not along a wall."""
    if not of_base(parameters[4]) or state[FOLLOWS * n + i] > 0.0:
        return 0.0
    return turn_to_mean(state, n, i, parameters)


@hook(ROTATION)
def whole_rotation(state, sight, n, i, parameters):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Turn all directions that way, along walls too."""
    return turn_to_mean(state, n, i, parameters) if parameters[4] > 1.0 else 0.0


LATE_S = 12.0
"""Nobody turns toward a heading of so long ago."""


def _late(states: Floats, dt_s: float, _random: np.random.Generator) -> Floats:
    """Return states in which all have the heading of 12 s ago."""
    late = min(max(1, round(LATE_S / dt_s)), len(states) - 1)
    changed = states.copy()
    for row in (HX, HY):
        changed[late:, row] = states[:-late, row]
        changed[:late, row] = 0.0
    return changed


_KNOTS_M = (0.0, 0.025, 0.05, 0.1, 0.2, 0.4, 1.0)
_BY_DISTANCE = Along(
    cue="distance to the other (m)", knots=_KNOTS_M[:-1], besides=("the nearest, wherever it is",)
)
_TO_FOREMOST = Along(cue="distance to the one most ahead (m)", knots=_KNOTS_M[:-1])
_AND_AS_SEEN = replace(
    _BY_DISTANCE, besides=(*_BY_DISTANCE.besides, "each, by the attention that it gets")
)


def _near_and_far(seen: Seen) -> Floats:
    return np.concatenate(
        [hats_where(seen.here, seen.distance_m, _KNOTS_M)[..., :-1], seen.nearest], axis=2
    )


def _of_all(seen: Seen) -> Floats:
    return np.concatenate([_near_and_far(seen), attended(evenly)(seen)], axis=2)


def _by_bearing(seen: Seen) -> Floats:
    """Return the sums of the headings of others, by how far aside and how far away they are."""
    near = hats_where(seen.here, seen.distance_m, _AHEAD_M)[..., :-1]
    weights = near[..., None] * hats(seen.off_axis_rad, _AHEAD_RAD)[..., None, :]
    return summed(weights.reshape(*near.shape[:2], -1), seen.heading)


def _their_course(seen: Seen) -> Floats:
    """Return the sums of the others' mean velocities over two seconds, by distance and if seen."""
    near = hats_where(seen.here, seen.distance_m, _AHEAD_M)[..., :-1]
    weights = np.concatenate([near, seen.in_sight[..., None]], axis=2) / _USUAL_M_S
    return summed(weights, seen.course)


def _of_foremost(seen: Seen) -> Floats:
    return hats_where(seen.here, seen.distance_m, _KNOTS_M)[..., :-1] * seen.foremost


def _leaning_to_mean(reach_m: float, where: str = "") -> Tilt:
    def vectors(seen: Seen) -> Floats:
        toward = mean_heading(seen, reach_m, in_sight=where == _IN_SIGHT)
        return toward * ~(seen.follows_walls & (where == _OFF_WALLS))[:, None, None]

    return Tilt(label=f"leaning, the mean within {reach_m:g} m{where}", vectors=vectors, low=0.0)


def _leaning_to_agreed(reach_m: float) -> Tilt:
    label = f"leaning, those seen within {reach_m:g} m who agree"
    return Tilt(label=label, vectors=partial(agreed_heading, reach_m=reach_m), low=0.0)


_SEEN_M = (0.2, 9.0)


def _along(reach_m: float) -> Component:
    """Return that along a wall fish go the way that those in view within reach do."""

    def weights(seen: Seen) -> Floats:
        along = np.einsum("sjd,sd->sj", seen.heading, seen.along_wall)
        counts = seen.in_sight & seen.here & (seen.distance_m < reach_m)
        mean = (along * counts).sum(axis=1) / np.maximum(counts.sum(axis=1), 1)
        return to_one_sense(seen, mean)

    return Component(
        label=f"along the wall as others within {reach_m:g} m do", toward=both_senses,
        weights=weights, kappa="own", high=0.98,
    )  # fmt: skip


def _toward_mean(seen: Seen) -> Floats:
    """Return the sine of the angle from the own heading to the others' mean one."""
    return aside_of(seen, mean_heading(seen, _NEAR_M), along_walls=True)


def _toward_nearest(seen: Seen) -> Floats:
    """Return that sine of the heading of the nearest, by distance, shape (step, distance)."""
    by = aside_of(seen, seen.heading, along_walls=True)
    near = hats_where(seen.here, seen.distance_m, _AHEAD_M)[..., :-1] * seen.nearest
    return np.asarray(np.einsum("sjb,sj->sb", near, by))


_AS_SEEN = Component(label="drawn, as seen", toward="heading", weights=attended(evenly), kappa=9.0)
_TURNING = Turned(label="turning", by=_toward_mean, neighbours=False, low=0.0)

_FEATURES: tuple[Feature, ...] = (
    *(
        Component(label=label, toward="heading", weights=_of_all, kappa=kappa, along=_AND_AS_SEEN)
        for label, kappa in (("drawn, widely", 3.0), ("drawn", 9.0))
    ),
    _AS_SEEN,
    by_circumstances(_AS_SEEN, of_each=True),
    Tilt(
        label="leaning", vectors=lambda seen: summed(_near_and_far(seen), seen.heading), low=0.0,
        along=_BY_DISTANCE,
    ),
    OneOf(kind="leaning, the mean", features=tuple(
        _leaning_to_mean(reach_m, where)
        for reach_m in (0.08, _NEAR_M, 0.25, 0.4) for where in ("", _OFF_WALLS, _IN_SIGHT)
    )),
    OneOf(kind="leaning, those who agree", features=tuple(map(_leaning_to_agreed, _REACHES_M))),
    Tilt(label="leaning, by bearing", vectors=_by_bearing, low=0.0),
    Tilt(label="leaning, their course", vectors=_their_course, low=0.0),
    Tilt(
        label="leaning, the foremost", low=0.0, along=_TO_FOREMOST,
        vectors=lambda seen: summed(_of_foremost(seen), seen.heading),
    ),
    Component(
        label="drawn, the foremost", toward="heading", weights=_of_foremost, kappa=9.0,
        along=_TO_FOREMOST,
    ),
    OneOf(kind="along the wall as others do", features=tuple(map(_along, _SEEN_M))),
    Component(
        label="drawn half-way", toward=lambda seen: halfway(seen, seen.heading),
        weights=seen_and_nearest, kappa=9.0,
    ),
    _TURNING,
    by_circumstances(_TURNING),
    by_circumstances(_leaning_to_mean(_NEAR_M)),
    by_circumstances(_leaning_to_agreed(0.25)),
    *turning_as_a_whole(_toward_mean, low=0.0),
    Turned(label="turning as the nearest", by=_toward_nearest, neighbours=True, low=0.0),
)  # fmt: skip


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
        EffectParameter(
            name="leaning",
            low=0.0,
            high=1.0,
            default=0.0,
            says="0: some headings are drawn about the mean heading of those that are seen; 1: all "
            "headings lean toward that of those within reach, by 0.03 nats per weight.",
        ),
        EffectParameter(
            name="turning",
            low=0.0,
            high=2.0,
            default=0.0,
            says="1: all turn toward the mean heading of those within reach, by a hundredth of "
            "the way per weight; along a wall they prefer the sense that is nearer to it. 2: so "
            "do the directions to neighbours and those along walls.",
        ),
        EffectParameter(
            name="among",
            low=0.0,
            high=3.0,
            default=0.0,
            says="0: the mean heading of those that are seen; 1: the heading of the nearest, seen "
            "or not, as one of 0.01 sr, or leaned toward; 2: a component about the heading of each "
            "that is seen; 3: the heading of who is most straight ahead, if within reach, as of "
            "the nearest.",
        ),
        EffectParameter(
            name="reach_m",
            low=0.0,
            high=1.0,
            default=_NEAR_M,
            says="Distance within which the mean heading, or that of the foremost, counts that "
            "fish lean or turn toward, in metres.",
        ),
    ),
    strength="weight",
    probe=0.5,
    component=component,
    factor=factor,
    harmonics=1,
    rotation=rotation,
    whole_rotation=whole_rotation,
    shapes=lambda _arena: (
        {"kappa": 3.0, "grading": 1.0},
        {"kappa": 12.0, "grading": 1.0},
        {"kappa": 3.0, "grading": 0.0},
        {"kappa": 12.0, "grading": 0.0},
        {"leaning": 1.0},
        {"turning": 1.0},
    ),
    each="among",
    further_shapes=lambda _arena: (
        *(
            {"kappa": kappa, **form}
            for kappa in (3.0, 8.0)
            for form in ({"among": 1.0}, {"among": 2.0}, {"among": 2.0, "grading": 0.0})
        ),
        {"leaning": 1.0, "among": 1.0},
        *({"leaning": 1.0, "among": 3.0, "reach_m": reach_m} for reach_m in _FOREMOST_M),
        {"among": 3.0, "reach_m": _FOREMOST_M[-1]},
        *({"leaning": 1.0, "reach_m": reach_m} for reach_m in _REACHES_M),
        *({"turning": 1.0, "reach_m": reach_m} for reach_m in _REACHES_M),
        *({"turning": 2.0, "reach_m": reach_m} for reach_m in (*_REACHES_M, _NEAR_M)),
    ),
    lacks=needs_neighbour,
    fixed=("grading", "leaning", "turning", "among", "reach_m"),
    idle=lambda values: ("kappa",) if values["leaning"] + values["turning"] > 0 else (),
    needs={
        "factor": ("leaning", "turning"),
        "rotation": ("turning",),
        "whole_rotation": ("turning",),
    },
    other_forms=("generic:heading:neighbour-heading",),
    control=Control(name="neighbours' heading 12 s ago", states=_late),
    features=lambda _arena: _FEATURES,
)

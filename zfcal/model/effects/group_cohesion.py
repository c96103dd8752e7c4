"""Group cohesion: long-range attraction to the middle of the group."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Floats
from zfcal.model.effects.base import Effect, EffectParameter
from zfcal.model.effects.circumstances import by_circumstances
from zfcal.model.effects.forms import (
    RAD_PER_STRENGTH,
    Hooked,
    apart,
    needs_neighbour,
    of_base,
    seen_by_rank,
    sine_to,
    tilt,
    turn_to,
)
from zfcal.model.effects.weights import (
    IN_VIEW_M,
    NEARING,
    SHARP,
    aside_of,
    every_step,
    halfway,
    middle_by,
    middle_of,
    only,
    seen_and_nearest,
    summed,
    turning_as_a_whole,
)
from zfcal.model.features import Along, Component, Feature, OneOf, Seen, Tilt, Turned, Weights
from zfcal.model.kernels.compiled import hook, inlined
from zfcal.model.kernels.hats import hats_where
from zfcal.model.kernels.hooks import COMPONENT, FACTOR, ROTATION
from zfcal.model.kernels.state import FOLLOWS, ZONE, X, Y


@inlined
def centroid(state: Hooked, n: int, i: int) -> tuple[float, float, float]:
    """Return unit vector toward the centroid of all others, and metres to it; -1 without."""
    x, y, count = 0.0, 0.0, 0
    for j in range(n):
        if j != i and state[ZONE * n + j] > 0.0:
            x += state[X * n + j] - state[X * n + i]
            y += state[Y * n + j] - state[Y * n + i]
            count += 1
    length = math.sqrt(x * x + y * y)
    if not length > 0.0:
        return 0.0, 0.0, -1.0
    return x / length, y / length, length / count


@inlined
def middle(state: Hooked, n: int, i: int, nearest: float) -> tuple[float, float, float]:
    """Return unit vector toward the centroid, or the nearest, and metres to it; -1 without."""
    if not nearest > 0.0:
        return centroid(state, n, i)
    x, y, least = 0.0, 0.0, -1.0
    for j in range(n):
        if j != i and state[ZONE * n + j] > 0.0:
            away_m = apart(state, n, i, j)
            if least < 0.0 or away_m < least:
                x, y = state[X * n + j] - state[X * n + i], state[Y * n + j] - state[Y * n + i]
                least = away_m
    if not least > 0.0:
        return 0.0, 0.0, -1.0
    return x / least, y / least, least


@inlined
def grown(away_m: float, full_m: float) -> float:
    """Return the share of the full pull at a distance."""
    return min(1.0, away_m / full_m) if full_m > 0.0 else 1.0


@hook(COMPONENT)
def component(state, sight, n, i, parameters, out):  # type: ignore[no-untyped-def]
    """Add a component about the bearing of the centroid of all others, seen or not.

    Or one about that of each that is seen.
    """
    if parameters[3] > 0.0 or parameters[6] > 0.0:
        return 0.0
    if parameters[4] > 0.0 or parameters[7] > 0.0:
        if not parameters[4] > 0.0 or not parameters[7] > 0.0:
            return 0.0
        k = seen_by_rank(state, sight, n, i, parameters[7])
        if k < 0:
            return 0.0
        far_m = max(apart(state, n, i, k), 1e-9)
        out[0] = (state[X * n + k] - state[X * n + i]) / far_m
        out[1] = (state[Y * n + k] - state[Y * n + i]) / far_m
        out[2] = parameters[1]
        return parameters[0] * grown(far_m, parameters[2])
    out[0], out[1], away_m = middle(state, n, i, parameters[5])
    out[2] = parameters[1]
    return parameters[0] * grown(away_m, parameters[2]) if away_m > 0.0 else 0.0


@hook(FACTOR)
def factor(state, sight, n, i, parameters, ux, uy, speed, landing):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Weigh headings by the bearing of the centroid of all others, seen or not, or the nearest."""
    leaning = parameters[3]
    if parameters[6] > 0.0:
        leaning = RAD_PER_STRENGTH * state[FOLLOWS * n + i] * of_base(parameters[6])
    if not leaning > 0.0:
        return 1.0
    x, y, away_m = middle(state, n, i, parameters[5])
    if not away_m > 0.0:
        return 1.0
    return tilt(parameters[0] * leaning * grown(away_m, parameters[2]), x * ux + y * uy, 1.0)


@inlined
def turned_rad(
    state: Hooked, n: int, i: int, parameters: Hooked, along_walls: bool
) -> float:  # fmt: skip
    """Return by how much fish turn to that bearing: by the sine of the angle to it."""
    x, y, away_m = middle(state, n, i, parameters[5])
    if not away_m > 0.0:
        return 0.0
    pull = RAD_PER_STRENGTH * parameters[0] * grown(away_m, parameters[2])
    return pull * (sine_to(state, n, i, x, y) if along_walls else turn_to(state, n, i, x, y))


@hook(ROTATION)
def rotation(state, sight, n, i, parameters):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Turn the base's directions to that bearing; not along a wall."""
    return turned_rad(state, n, i, parameters, False) if of_base(parameters[6]) else 0.0


@hook(ROTATION)
def whole_rotation(state, sight, n, i, parameters):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Turn all directions to that bearing, along walls too."""
    return turned_rad(state, n, i, parameters, True) if parameters[6] > 1.0 else 0.0


_KNOTS_M = (0.0, 0.05, 0.1, 0.2, 0.4)
_Some: TypeAlias = Callable[[Seen], NDArray[np.bool_]]

_SOME: dict[str, _Some] = {
    "those in sight": lambda seen: seen.in_sight,
    "those within 0.15 m": lambda seen: np.asarray(seen.distance_m < 0.15),
    "those within 0.3 m": lambda seen: np.asarray(seen.distance_m < 0.3),
    "those beyond 0.15 m": lambda seen: np.asarray(seen.distance_m > 0.15),
    "the farthest": lambda seen: np.asarray(seen.chosen(seen.distance_m, seen.here)[..., 0] > 0),
}


def _drawn_to(label: str, counts: _Some) -> Component:
    return Component(
        label=f"drawn to {label}",
        toward=lambda seen: only(middle_of(seen, counts(seen))[0]),
        weights=_alike,
        kappa=4.0,
    )


def _leaning_to(label: str, counts: _Some) -> Tilt:
    return Tilt(
        label=f"leaning to {label}",
        vectors=lambda seen: only(middle_of(seen, counts(seen))[0]),
        low=0.0,
    )


def _toward(seen: Seen) -> Floats:
    return only(middle_by(seen, _KNOTS_M)[0])


def _by_distance(seen: Seen) -> Floats:
    return only(middle_by(seen, _KNOTS_M)[1])


def _alike(seen: Seen) -> Floats:
    return only(every_step(seen))


def _to_middle(seen: Seen) -> Floats:
    return only(middle_by(seen, _KNOTS_M)[0])


def _leaning(seen: Seen) -> Floats:
    toward, weights = middle_by(seen, _KNOTS_M)
    return np.asarray(weights[..., None] * toward[:, None])


def _of_each(seen: Seen) -> Floats:
    return hats_where(seen.here, seen.distance_m, _KNOTS_M)


def _of_each_seen(seen: Seen) -> Floats:
    return _of_each(seen) * seen.in_sight[..., None]


def _in_view(reach_m: float) -> Weights:
    return lambda seen: np.asarray(
        seen.here & seen.in_sight & (seen.distance_m < reach_m), dtype=np.float64
    )[..., None]


def _of_nearest(seen: Seen) -> Floats:
    return _of_each(seen) * seen.nearest


def _turning(seen: Seen, *, along_walls: bool = False) -> Floats:
    toward, weights = middle_by(seen, _KNOTS_M)
    return np.asarray(aside_of(seen, toward[:, None], along_walls=along_walls) * weights)


def _turning_to_nearest(seen: Seen) -> Floats:
    return np.asarray(np.einsum("sjb,sj->sb", _of_nearest(seen), aside_of(seen, seen.bearing)))


def _leaning_to_nearest(seen: Seen) -> Floats:
    return summed(_of_nearest(seen), seen.bearing)


def _leaning_to_each(seen: Seen) -> Floats:
    return summed(_of_each(seen), seen.bearing)


_TO_MIDDLE = Along(cue="distance to the middle of the others (m)", knots=_KNOTS_M)
_TO_EACH = Along(cue="distance to the other (m)", knots=_KNOTS_M)
_TO_NEAREST = Along(cue="distance to the nearest (m)", knots=_KNOTS_M)

_FEATURES: tuple[Feature, ...] = (
    Component(
        label="drawn, widely", toward=_toward, weights=_by_distance, kappa=2.0, along=_TO_MIDDLE
    ),
    Component(label="drawn", toward=_toward, weights=_by_distance, kappa=8.0, along=_TO_MIDDLE),
    Component(
        label="drawn to each", toward="bearing", weights=_of_each, kappa=5.0, along=_TO_EACH
    ),
    Component(
        label="drawn to each seen", toward="bearing", weights=_of_each_seen, kappa=5.0,
        along=_TO_EACH,
    ),
    Component(
        label="drawn to the nearest", toward="bearing", weights=_of_nearest, kappa=5.0,
        along=_TO_NEAREST,
    ),
    Component(
        label="drawn half-way", toward=lambda seen: halfway(seen, seen.bearing),
        weights=seen_and_nearest, kappa=9.0,
    ),
    Tilt(label="leaning", vectors=_leaning, low=0.0, along=_TO_MIDDLE),
    Tilt(label="leaning to each", vectors=_leaning_to_each, low=0.0, along=_TO_EACH),
    Tilt(label="leaning to the nearest", vectors=_leaning_to_nearest, low=0.0, along=_TO_NEAREST),
    Turned(label="turning", by=_turning, neighbours=False, low=0.0, along=_TO_MIDDLE),
    *turning_as_a_whole(partial(_turning, along_walls=True), low=0.0, along=_TO_MIDDLE),
    Turned(
        label="turning to the nearest", by=_turning_to_nearest, neighbours=False, low=0.0,
        along=_TO_NEAREST,
    ),
    OneOf(
        kind="ending nearer",
        features=tuple(
            Tilt(label=f"ending nearer to {whom}", vectors=vectors, low=0.0)
            for whom, vectors in NEARING.items()
        ),
    ),
    OneOf(
        kind="drawn to each in view, sharply",
        features=tuple(
            Component(
                label=f"drawn to each in view within {reach_m:g} m, sharply", toward="bearing",
                weights=_in_view(reach_m), kappa=SHARP,
            )
            for reach_m in IN_VIEW_M
        ),
    ),
    OneOf(kind="drawn to some", features=tuple(_drawn_to(*each) for each in _SOME.items())),
    OneOf(kind="leaning to some", features=tuple(_leaning_to(*each) for each in _SOME.items())),
    by_circumstances(
        Component(label="drawn to the middle", toward=_toward, weights=_alike, kappa=4.0)
    ),
    by_circumstances(Tilt(label="leaning to the middle", vectors=_to_middle, low=0.0)),
)  # fmt: skip


EFFECT = Effect(
    name="group-cohesion",
    says="Fish are drawn to the middle of the group, however far away it is.",
    reference="Couzin et al. 2002, Journal of Theoretical Biology 218: 1-11",
    parameters=(
        EffectParameter(
            name="weight",
            low=0.0,
            high=10.0,
            default=1.0,
            says="Weight of the bearing of the others' centroid, beside the base's one.",
        ),
        EffectParameter(
            name="kappa",
            low=0.0,
            high=30.0,
            default=5.0,
            says="Von Mises concentration about that bearing.",
        ),
        EffectParameter(
            name="full_m",
            low=0.0,
            high=0.6,
            default=0.0,
            says="Distance of the centroid from which the weight is whole, in metres.",
        ),
        EffectParameter(
            name="leaning",
            low=0.0,
            high=1.0,
            default=0.0,
            says="0: some headings are drawn about that bearing; 1: all headings lean toward it, "
            "by one nat per weight.",
        ),
        EffectParameter(
            name="each",
            low=0.0,
            high=1.0,
            default=0.0,
            says="1: a component about the bearing of each that is seen, each of the whole weight, "
            "in place of one about the centroid.",
        ),
        EffectParameter(
            name="nearest",
            low=0.0,
            high=1.0,
            default=0.0,
            says="1: the nearest, seen or not, in place of the centroid.",
        ),
        EffectParameter(
            name="turning",
            low=0.0,
            high=2.0,
            default=0.0,
            says="1: all turn to that bearing, by a tenth of a radian per weight times the sine "
            "of the angle to it; along a wall they prefer the sense that is nearer to it. 2: so do "
            "the directions to neighbours and those along walls.",
        ),
    ),
    strength="weight",
    probe=0.005,
    component=component,
    factor=factor,
    rotation=rotation,
    whole_rotation=whole_rotation,
    harmonics=1,
    shapes=lambda _arena: (
        {"kappa": 2.0, "full_m": 0.0},
        {"kappa": 8.0, "full_m": 0.0},
        {"kappa": 2.0, "full_m": 0.3},
        {"kappa": 8.0, "full_m": 0.3},
        {"leaning": 1.0, "full_m": 0.0},
        {"leaning": 1.0, "full_m": 0.3},
    ),
    each="each",
    further_shapes=lambda _arena: (
        tuple(
            {"kappa": kappa, "full_m": full_m, "each": 1.0}
            for kappa in (2.0, 6.0)
            for full_m in (0.0, 0.3)
        )
        + tuple(
            {**form, "full_m": full_m, "nearest": 1.0}
            for form in ({"kappa": 2.0}, {"kappa": 6.0}, {"leaning": 1.0})
            for full_m in (0.0, 0.3)
        )
        + tuple(
            {"turning": turning, "full_m": full_m, "nearest": nearest}
            for turning in (1.0, 2.0)
            for nearest in (0.0, 1.0)
            for full_m in (0.0, 0.3)
        )
    ),
    lacks=needs_neighbour,
    fixed=("full_m", "leaning", "each", "nearest", "turning"),
    idle=lambda values: ("kappa",) if values["leaning"] + values["turning"] > 0 else (),
    needs={
        "factor": ("leaning", "turning"),
        "rotation": ("turning",),
        "whole_rotation": ("turning",),
    },
    features=lambda _arena: _FEATURES,
)

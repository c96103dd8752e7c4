"""Robot avoidance: the robot is treated otherwise than a fish."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial

import numpy as np
import shapely
from numpy.typing import NDArray

from zfcal.arena import Arena
from zfcal.arrays import Floats
from zfcal.model.directions import lengths
from zfcal.model.effects.base import Company, Effect, EffectParameter
from zfcal.model.effects.circumstances import by_circumstances
from zfcal.model.effects.forms import (
    RAD_PER_STRENGTH,
    Hooked,
    apart,
    beyond,
    mouth_is_near,
    of_base,
    sine_to,
    tilt,
    turn_to,
    way_out,
)
from zfcal.model.effects.weights import (
    ATTENTION,
    aside_of,
    factor_on_attention,
    precision_of_attention,
    rooms_of,
    summed,
    turning_as_a_whole,
)
from zfcal.model.features import (
    AWAY_M,
    Along,
    Component,
    Feature,
    Landing,
    Leaving,
    Seen,
    Tilt,
    Turned,
    Weights,
)
from zfcal.model.kernels.compiled import hook, inlined
from zfcal.model.kernels.hats import hats
from zfcal.model.kernels.hooks import COMPONENT, FACTOR, ROTATION, SIGHT
from zfcal.model.kernels.rooms import find_rooms
from zfcal.model.kernels.state import FOLLOWS, KIND, ROOM, ZONE, X, Y

_NEAR_M = 0.1
_PER_STRENGTH = 0.1


@hook(SIGHT)
def sight(state, sight, n, i, parameters, j):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Change the attention that a robot gets."""
    if not state[KIND * n + j] > 0.0:
        return 1.0
    if parameters[5] > 0.0 or parameters[6] > 0.0:
        return 1.0
    return math.exp(-parameters[0] * (1.0 - parameters[1]) * (1.0 - parameters[2]))


@hook(COMPONENT)
def component(state, sight, n, i, parameters, out):  # type: ignore[no-untyped-def]
    """Add a component about the way from the nearest robot that is seen, while it is close."""
    nearest, far_m = -1, math.inf
    for j in range(n):
        if state[KIND * n + j] > 0.0 and sight[i * n + j] > 0.0:
            away = apart(state, n, i, j)
            if away < far_m:
                nearest, far_m = j, away
    if nearest < 0 or not parameters[2] > 0.0 or parameters[5] > 0.0:
        return 0.0
    side = (1.0 if parameters[0] > 0.0 else -1.0) / max(far_m, 1e-9)
    out[0] = side * (state[X * n + i] - state[X * n + nearest])
    out[1] = side * (state[Y * n + i] - state[Y * n + nearest])
    out[2] = parameters[4]
    return _PER_STRENGTH * abs(parameters[0]) * (1.0 - beyond(far_m, parameters[3]))


@inlined
def from_robots(state: Hooked, sight: Hooked, n: int, i: int) -> tuple[float, float, float]:
    """Return the sum of the ways from the robots that are seen, the nearer the longer."""
    x, y, most = 0.0, 0.0, 0.0
    for j in range(n):
        if state[KIND * n + j] > 0.0 and sight[i * n + j] > 0.0:
            dx, dy = state[X * n + i] - state[X * n + j], state[Y * n + i] - state[Y * n + j]
            far_m = max(apart(state, n, i, j), 1e-9)
            near = math.exp(-far_m / _NEAR_M)
            x += near * dx / far_m
            y += near * dy / far_m
            most += near
    return x, y, most


@inlined
def with_robot(state: Hooked, n: int, i: int) -> bool:
    """Tell whether a robot is in the room of an agent."""
    room = state[ROOM * n + i]
    for j in range(n):
        is_robot = state[KIND * n + j] > 0.0 and state[ZONE * n + j] > 0.0
        if is_robot and j != i and room > 0.0 and state[ROOM * n + j] == room:
            return True
    return False


@hook(FACTOR)
def factor(state, sight, n, i, parameters, ux, uy, speed, landing):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Weigh headings away from the robots that are seen, or out of a room with one in it."""
    if parameters[6] > 0.0:
        if not (with_robot(state, n, i) and mouth_is_near(state, n, i)):
            return 1.0
        return tilt(parameters[0], way_out(state, n, i, (ux, uy, landing), 0.0), 1.0)
    leaning = parameters[1]
    if parameters[5] > 0.0:
        leaning = RAD_PER_STRENGTH * state[FOLLOWS * n + i] * of_base(parameters[5])
    if not leaning > 0.0:
        return 1.0
    x, y, most = from_robots(state, sight, n, i)
    return tilt(parameters[0] * leaning, ux * x + uy * y, most)


@hook(ROTATION)
def rotation(state, sight, n, i, parameters):  # type: ignore[no-untyped-def]
    """Turn away from the robots that are seen; not along a wall."""
    if not of_base(parameters[5]):
        return 0.0
    x, y, _ = from_robots(state, sight, n, i)
    return RAD_PER_STRENGTH * parameters[0] * turn_to(state, n, i, x, y)


@hook(ROTATION)
def whole_rotation(state, sight, n, i, parameters):  # type: ignore[no-untyped-def]
    """Turn all directions away from the robots that are seen, along walls too."""
    if not parameters[5] > 1.0:
        return 0.0
    x, y, _ = from_robots(state, sight, n, i)
    return RAD_PER_STRENGTH * parameters[0] * sine_to(state, n, i, x, y)


def _lacks(company: Company) -> str | None:
    if company.n_robots < 1:
        return "a robot"
    return None if company.n_fish > 0 else "a fish"


_ATTENTION_M = (0.0, 0.1, 0.3)
_KNOTS_M = (0.0, 0.1, 0.2, 0.4)
_ITS_SPEED_M_S = (0.03, 0.07, 0.12)


def _attention(seen: Seen) -> Floats:
    return hats(seen.distance_m, _ATTENTION_M) * seen.is_robot[..., None]


def _by_its_speed(seen: Seen) -> Floats:
    return hats(seen.speed_m_s, _ITS_SPEED_M_S) * seen.is_robot[..., None]


def _robots(seen: Seen) -> Floats:
    return hats(seen.distance_m, _KNOTS_M) * seen.is_robot[..., None]


def _seen_robots(seen: Seen) -> Floats:
    return _robots(seen) * seen.in_sight[..., None]


def _leaning(seen: Seen) -> Floats:
    return summed(_robots(seen), seen.bearing)


def _to_robots(seen: Seen) -> Floats:
    return seen.is_robot[..., None].astype(np.float64)


def _leaning_near(seen: Seen) -> Floats:
    near = np.exp(-seen.distance_m / _NEAR_M) * seen.is_robot
    return np.asarray(np.einsum("sj,sjd->sd", near, seen.bearing)[:, None])


def _leaving(seen: Seen) -> Floats:
    """Return how near the robot is, shape (step, knot)."""
    near = hats(seen.distance_m, _LEFT_M)[..., :-1] * seen.is_robot[..., None]
    return np.asarray(near.sum(axis=1))


def _in_the_room(rooms: Sequence[shapely.Geometry]) -> Weights:
    """Return one where a robot is in the fish's room, shape (step, 1)."""

    def weights(seen: Seen) -> Floats:
        mine, theirs = rooms_of(seen, rooms)
        with_it = (theirs & mine[:, None]).any(axis=-1) & seen.is_robot
        return np.asarray(with_it.any(axis=1), dtype=np.float64)[:, None]

    return weights


def _turning(seen: Seen, *, along_walls: bool = False) -> Floats:
    aside = aside_of(seen, seen.bearing, along_walls=along_walls)
    return np.asarray(-np.einsum("sjb,sj->sb", _robots(seen), aside))


def _from_robot(seen: Seen, rows: NDArray[np.intp], xy_m: Floats) -> Floats:
    """Return how far positions are from the nearest robot; far away without one."""
    nearest = np.full(xy_m.shape[:2], AWAY_M)
    # One other after the other: few of them are robots, if any.
    for other in np.flatnonzero(seen.is_robot[rows].any(axis=0)):
        away = seen.bearing[rows, other] * seen.distance_m[rows, other, None]
        robot = seen.xy_m[rows] + away
        far = lengths(xy_m - robot[:, None])
        is_robot = seen.is_robot[rows, other, None]
        nearest = np.where(is_robot, np.minimum(nearest, far), nearest)
    return nearest


_LANDS_M = (0.0, 0.03, 0.06, 0.1, 0.15, 0.2)
_LEFT_M = (0.1, 0.25, 0.5)
_TO_ROBOT = Along(cue="distance to the robot (m)", knots=_KNOTS_M)

_FEATURES: tuple[Feature, ...] = (
    factor_on_attention(
        _attention, along=Along(cue="distance to the robot (m)", knots=_ATTENTION_M)
    ),
    Component(
        label="away, widely", toward=lambda s: -s.bearing, weights=_robots, kappa=3.0,
        along=_TO_ROBOT,
    ),
    Component(
        label="away", toward=lambda s: -s.bearing, weights=_robots, kappa=8.0, along=_TO_ROBOT
    ),
    Component(
        label="drawn to it", toward="bearing", weights=_seen_robots, kappa=5.0, along=_TO_ROBOT
    ),
    Tilt(label="leaning", vectors=_leaning, along=_TO_ROBOT),
    Landing(
        label="landing near it", away_m=_from_robot, knots_m=_LANDS_M,
        along=Along(cue="distance to the robot (m)", knots=_LANDS_M[:-1]),
    ),
    Turned(label="turning", by=_turning, neighbours=False, along=_TO_ROBOT),
    *turning_as_a_whole(partial(_turning, along_walls=True), along=_TO_ROBOT),
    factor_on_attention(_by_its_speed, label="attention to robots, by their speed"),
    Leaving(
        label="leaving its room while a robot is near",
        weights=_leaving,
        along=Along(cue="distance to the robot (m)", knots=_LEFT_M[:-1]),
    ),
    precision_of_attention(_to_robots, "precision of robots"),
    by_circumstances(
        factor_on_attention(_to_robots, label="attention to robots"),
        alone=ATTENTION,
        without=("the time", "whether it is a robot"),
        of_each=True,
    ),
    by_circumstances(Tilt(label="leaning near it", vectors=_leaning_near)),
)  # fmt: skip


def _features(arena: Arena) -> tuple[Feature, ...]:
    rooms = find_rooms(arena)[1]
    if not rooms:
        return _FEATURES
    shared = Leaving(label="leaving a room with a robot in it", weights=_in_the_room(rooms))
    return (*_FEATURES, shared)


EFFECT = Effect(
    name="robot-avoidance",
    says="Fish attend less to the robot than to a fish, or swim away from it.",
    opposite="Fish attend more to the robot than to a fish, or seek it.",
    reference="Butail et al. 2013, PLoS ONE 8: e76123",
    parameters=(
        EffectParameter(
            name="strength",
            low=-3.0,
            high=5.0,
            default=1.0,
            says="Log of the attention that the robot loses, or of the preference for headings "
            "away from it when it is close.",
        ),
        EffectParameter(
            name="flight",
            low=0.0,
            high=1.0,
            default=0.0,
            says="0: the robot gets less attention; 1: it gets that of a fish, and is fled from.",
        ),
        EffectParameter(
            name="drawn",
            low=0.0,
            high=1.0,
            default=0.0,
            says="1: it gets the attention of a fish, and some headings are drawn about the way "
            "from it, as a component of the weight 0.1 per strength.",
        ),
        EffectParameter(
            name="reach_m",
            low=0.02,
            high=1.0,
            default=0.15,
            says="Distance within which headings are drawn about the way from it, in metres.",
        ),
        EffectParameter(
            name="kappa",
            low=0.0,
            high=30.0,
            default=5.0,
            says="Von Mises concentration about that way.",
        ),
        EffectParameter(
            name="turning",
            low=0.0,
            high=2.0,
            default=0.0,
            says="1: it gets the attention of a fish, and all turn away from it when it is close, "
            "by a tenth of a radian per strength times the sine of the angle; along a wall they "
            "prefer the sense that leads away. 2: so do the directions to neighbours and those "
            "along walls.",
        ),
        EffectParameter(
            name="leaves",
            low=0.0,
            high=1.0,
            default=0.0,
            says="1: it gets the attention of a fish, and others leave a room that it is in more "
            "readily: half the log odds of a step out of it.",
        ),
    ),
    probe=0.01,
    component=component,
    sight=sight,
    factor=factor,
    rotation=rotation,
    whole_rotation=whole_rotation,
    harmonics=1,
    not_harmonic="leaves",
    shapes=lambda _arena: ({"flight": 0.0}, {"flight": 1.0}),
    further_shapes=lambda arena: (
        *([{"leaves": 1.0}] if find_rooms(arena)[0] else []),
        *({"drawn": 1.0, "reach_m": far_m, "kappa": 5.0} for far_m in (0.07, 0.12, 0.2, 0.35)),
        {"turning": 1.0},
        {"turning": 2.0},
    ),
    lacks=_lacks,
    fixed=("flight", "drawn", "turning", "leaves"),
    idle=lambda values: (
        () if values["drawn"] > 0 and not values["turning"] > 0 else ("reach_m", "kappa")
    ),
    needs={
        "factor": ("flight", "turning", "leaves"),
        "component": ("drawn",),
        "rotation": ("turning",),
        "whole_rotation": ("turning",),
    },
    features=_features,
)


def less_attention(lost: float) -> dict[str, dict[str, float]]:
    """Return the effect at parameters by which the robot is not fled from, but attended to less."""
    return {EFFECT.name: {EFFECT.strength: lost, "flight": 0.0}}

"""Collective departure: a fish leaves a room when another has just left."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
import shapely

from zfcal.arena import Arena
from zfcal.arrays import Floats
from zfcal.model.effects.base import Company, Effect, EffectParameter
from zfcal.model.effects.circumstances import by_circumstances, each_under
from zfcal.model.effects.forms import (
    RAD_PER_STRENGTH,
    Hooked,
    beyond,
    needs_neighbour,
    tilt,
    turn_to,
    way_out,
)
from zfcal.model.effects.weights import (
    LEANING_OUT,
    aside_of,
    every_step,
    only,
    rooms_of,
    turning_as_a_whole,
    who,
)
from zfcal.model.features import (
    Along,
    Component,
    Feature,
    Leaving,
    Seen,
    Tilt,
    Turned,
    Weights,
)
from zfcal.model.kernels.compiled import hook, inlined
from zfcal.model.kernels.hats import hats
from zfcal.model.kernels.hooks import COMPONENT, FACTOR, ROTATION
from zfcal.model.kernels.rooms import find_rooms
from zfcal.model.kernels.state import (
    FOLLOWS,
    LEFT_AT_S,
    LEFT_FROM,
    LEFT_S,
    MOUTH_X,
    MOUTH_Y,
    NEVER_S,
    ROOM,
    TIME,
    ZONE,
)

_KAPPA = 3.0
_PER_STRENGTH = 0.1


@inlined
def since(state: Hooked, n: int, i: int, back: float) -> float:
    """Return how long ago another one left the agent's room; whether it came back, if asked."""
    if not back > 0.0:
        return float(state[LEFT_S * n + i])
    found = NEVER_S
    for j in range(n):
        here = state[ZONE * n + j] > 0.0 and state[LEFT_FROM * n + j] == state[ROOM * n + i]
        if j != i and here:
            found = min(found, state[TIME * n + i] - state[LEFT_AT_S * n + j])
    return found


@inlined
def elsewhere(state: Hooked, n: int, i: int) -> float:
    """Return which share of the others is in another room than the agent."""
    away, others = 0.0, 0.0
    for j in range(n):
        if j != i and state[ZONE * n + j] > 0.0:
            others += 1.0
            if state[ROOM * n + j] > 0.0 and state[ROOM * n + j] != state[ROOM * n + i]:
                away += 1.0
    return away / max(others, 1.0)


@hook(COMPONENT)
def component(state, sight, n, i, parameters, out):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Add a component about the direction of the way out while another's leaving is fresh."""
    since_s = since(state, n, i, parameters[4])
    if parameters[5] + parameters[6] > 0.0:
        return 0.0
    if not state[ROOM * n + i] > 0.0 or since_s > 4.0 * parameters[1]:
        return 0.0
    out[0], out[1], out[2] = state[MOUTH_X * n + i], state[MOUTH_Y * n + i], _KAPPA
    fresh = 1.0 - beyond(since_s, parameters[1])
    return _PER_STRENGTH * max(parameters[0], 0.0) * parameters[3] * fresh


@hook(FACTOR)
def factor(state, sight, n, i, parameters, ux, uy, speed, landing):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Weigh headings by the way out while another's leaving is fresh.

    Or by it as much as others are in another room.
    """
    if parameters[6] > 0.0:
        if not state[ROOM * n + i] > 0.0:
            return 1.0
        strength = parameters[0] * elsewhere(state, n, i)
        return tilt(strength, way_out(state, n, i, (ux, uy, landing), parameters[2]), 1.0)
    if parameters[5] > 0.0:
        if not state[FOLLOWS * n + i] > 0.0:
            return 1.0
    elif parameters[3] > 0.0:
        return 1.0
    since_s = since(state, n, i, parameters[4])
    if not state[ROOM * n + i] > 0.0 or since_s > 4.0 * parameters[1]:
        return 1.0
    fresh = 1.0 - beyond(since_s, parameters[1])
    if parameters[5] > 0.0:
        fresh *= RAD_PER_STRENGTH
    return tilt(parameters[0] * fresh, way_out(state, n, i, (ux, uy, landing), parameters[2]), 1.0)


@hook(ROTATION)
def rotation(state, sight, n, i, parameters):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Turn to the way out while another's leaving is fresh; not along a wall."""
    if not parameters[5] > 0.0 or parameters[6] > 0.0 or not state[ROOM * n + i] > 0.0:
        return 0.0
    since_s = since(state, n, i, parameters[4])
    if since_s > 4.0 * parameters[1]:
        return 0.0
    fresh = 1.0 - beyond(since_s, parameters[1])
    out = turn_to(state, n, i, state[MOUTH_X * n + i], state[MOUTH_Y * n + i])
    return RAD_PER_STRENGTH * parameters[0] * fresh * out


def _features(arena: Arena) -> tuple[Feature, ...]:
    rooms = find_rooms(arena)[1]
    if not rooms:
        return _FEATURES
    alone = Leaving(label="who", weights=who)
    return (
        *_FEATURES, Leaving(label="others elsewhere", weights=_elsewhere(rooms), over=alone),
    )  # fmt: skip


def _lacks(company: Company) -> str | None:
    return needs_neighbour(company) if company.has_rooms else "rooms"


_KNOTS_S = (0.0, 1.0, 2.5, 5.0, 10.0)
_JUST_S = 3.0


def _freshly_left(seen: Seen) -> Floats:
    return hats(seen.left_s, _KNOTS_S)[:, :-1]


def _each_left(seen: Seen) -> Floats:
    """Return how many others have left, by the time since, though they may be back."""
    return np.asarray(hats(seen.each_left_s, _KNOTS_S)[..., :-1].sum(axis=1))


def _just_left(seen: Seen) -> Floats:
    """Return how many others have just left, shape (step, 1)."""
    return np.exp(-seen.each_left_s / _JUST_S).sum(axis=1, keepdims=True)


def _out_after(seen: Seen) -> Floats:
    return np.asarray(_just_left(seen)[..., None] * seen.way_out[:, None])


def _way_out(seen: Seen) -> Floats:
    return only(seen.way_out)


def _freshly(seen: Seen) -> Floats:
    return only(_freshly_left(seen))


def _each(seen: Seen) -> Floats:
    return only(_each_left(seen))


def _leaning(seen: Seen) -> Floats:
    return np.asarray(_freshly_left(seen)[..., None] * seen.way_out[:, None])


def _turning(seen: Seen, *, along_walls: bool = False) -> Floats:
    aside = aside_of(seen, only(seen.way_out), along_walls=along_walls)
    return np.asarray(aside * _freshly_left(seen))


def _elsewhere(rooms: Sequence[shapely.Geometry]) -> Weights:
    """Return which share of the others is in another room than the fish, after who each fish is.

    Shape (step, fish): one who leaves seldom has others elsewhere more often, and that is its own.
    """

    def weights(seen: Seen) -> Floats:
        mine, theirs = rooms_of(seen, rooms)
        in_room = mine.any(axis=-1, keepdims=True)
        away = in_room & (theirs & ~mine[:, None]).any(axis=-1) & seen.here
        share = away.sum(axis=1) / np.maximum(seen.here.sum(axis=1), 1)
        return np.column_stack([who(seen), share])

    return weights


_BY_TIME = Along(cue="time since the other left (s)", knots=_KNOTS_S[:-1])

_FEATURES: tuple[Feature, ...] = (
    Leaving(label="time", weights=_freshly_left, along=_BY_TIME),
    Leaving(label="time, though it came back", weights=_each_left, along=_BY_TIME),
    by_circumstances(
        Leaving(label="just after others", weights=_just_left),
        alone=each_under(Leaving(label="at any time", weights=every_step)),
        without=("the zone",),
    ),
    Component(
        label="drawn to the way out", toward=_way_out, weights=_freshly, kappa=3.0, along=_BY_TIME
    ),
    Component(label="drawn out by each", toward=_way_out, weights=_each, kappa=3.0, along=_BY_TIME),
    Tilt(label="leaning to the way out", vectors=_leaning, along=_BY_TIME),
    by_circumstances(
        Tilt(label="leaning to the way out after others", vectors=_out_after),
        alone=LEANING_OUT,
    ),
    Turned(label="turning to the way out", by=_turning, neighbours=False, along=_BY_TIME),
    *turning_as_a_whole(
        partial(_turning, along_walls=True),
        label="turning to the way out as a whole",
        along=_BY_TIME,
    ),
)


EFFECT = Effect(
    name="collective-departure",
    says="A fish leaves a room when others have left it.",
    opposite="A fish stays in a room when others have left it.",
    reference="Pillot et al. 2011, PLoS ONE 6: e14487",
    parameters=(
        EffectParameter(
            name="strength",
            low=-3.0,
            high=5.0,
            default=1.5,
            says="Log of the preference for the way out, just after another left.",
        ),
        EffectParameter(
            name="memory_s",
            low=0.5,
            high=30.0,
            default=5.0,
            says="How long another's leaving has an effect, in seconds.",
        ),
        EffectParameter(
            name="heading_share",
            low=0.0,
            high=1.0,
            default=1.0,
            says="1: headings toward the way out, all over the room; 0: steps across it. Of those "
            "that lean.",
        ),
        EffectParameter(
            name="drawn",
            low=0.0,
            high=1.0,
            default=0.0,
            says="0: all headings lean toward the way out; 1: some are drawn about its direction, "
            "as a component of the weight 0.1 per strength.",
        ),
        EffectParameter(
            name="back",
            low=0.0,
            high=1.0,
            default=0.0,
            says="0: the leaving of those that are still away; 1: of those that came back as well.",
        ),
        EffectParameter(
            name="turning",
            low=0.0,
            high=1.0,
            default=0.0,
            says="1: all turn to the way out, by a tenth of a radian per strength times the sine "
            "of the angle to it; along a wall they prefer the sense that is nearer to it.",
        ),
        EffectParameter(
            name="elsewhere",
            low=0.0,
            high=1.0,
            default=0.0,
            says="1: headings lean by the share of the others that is in another room, whenever "
            "these left.",
        ),
    ),
    probe=0.01,
    component=component,
    factor=factor,
    rotation=rotation,
    harmonics=1,
    by_landing=True,
    shapes=lambda _arena: tuple(
        {"memory_s": memory_s, "heading_share": share}
        for share in (1.0, 0.0)
        for memory_s in (2.0, 5.0, 12.0)
    ),
    further_shapes=lambda _arena: (
        *(
            {"memory_s": memory_s, **form}
            for form in (
                {"drawn": 1.0},
                {"drawn": 1.0, "back": 1.0},
                {"heading_share": 0.0, "back": 1.0},
                {"back": 1.0},
                {"turning": 1.0},
            )
            for memory_s in (1.0, 2.0, 4.0, 8.0)
        ),
        *({"elsewhere": 1.0, "heading_share": share} for share in (1.0, 0.0)),
    ),
    idle=lambda values: ("memory_s",) if values["elsewhere"] > 0 else (),
    lacks=_lacks,
    identity_s=10.0,
    fixed=("heading_share", "drawn", "back", "turning", "elsewhere"),
    needs={"component": ("drawn",), "rotation": ("turning",)},
    features=_features,
)

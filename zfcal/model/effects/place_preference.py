"""Place preference: attraction to a place in the tank, or avoidance of it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import TypeAlias

import numpy as np
import shapely
from numpy.typing import NDArray

from zfcal.arena import Arena
from zfcal.arrays import Floats
from zfcal.model.directions import lengths
from zfcal.model.effects.base import Effect, EffectParameter, Likeness
from zfcal.model.effects.circumstances import by_circumstances
from zfcal.model.effects.forms import RAD_PER_STRENGTH, beyond, of_base, sine_to, tilt, turn_to
from zfcal.model.effects.weights import LEANING_OUT, aside_of, only
from zfcal.model.features import Along, Component, Feature, Landing, OneOf, Seen, Tilt, Turned
from zfcal.model.kernels.compiled import hook
from zfcal.model.kernels.hats import hats
from zfcal.model.kernels.hooks import COMPONENT, FACTOR, ROTATION
from zfcal.model.kernels.rooms import find_rooms
from zfcal.model.kernels.state import DT_S, FOLLOWS, X, Y
from zfcal.model.kernels.ways_to import distances_to, write_ways_to
from zfcal.model.places import places

_AT_IT_M = 0.02


@hook(COMPONENT)
def component(state, sight, n, i, parameters, out):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Add a component about the bearing of the place; far from it less, and at it not at all.

    Of a strength below 0 it is about the way from there.
    """
    dx, dy = parameters[1] - state[X * n + i], parameters[2] - state[Y * n + i]
    away = math.sqrt(dx * dx + dy * dy)
    is_drawn = parameters[4] > 0.0 and not (parameters[6] > 0.0 or parameters[7] > 0.0)
    if not (away > 0.0 and is_drawn):
        return 0.0
    along = math.copysign(1.0, parameters[0]) / away
    out[0], out[1], out[2] = along * dx, along * dy, parameters[5]
    pull = away / (away + _AT_IT_M) / (1.0 + (away / parameters[3]) ** 4)
    return abs(parameters[0]) * pull


@hook(FACTOR)
def factor(state, sight, n, i, parameters, ux, uy, speed, landing):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Weigh headings by the bearing of the place, near it; or by whether they end in its reach."""
    dx, dy = parameters[1] - state[X * n + i], parameters[2] - state[Y * n + i]
    away = math.sqrt(dx * dx + dy * dy)
    if parameters[7] > 0.0:
        step_m = speed * state[DT_S * n + i]
        dx, dy = dx - step_m * ux, dy - step_m * uy
        # Over the largest value that this step can have: far from the place nothing is rejected.
        best = abs(away - step_m) if parameters[0] > 0.0 else away + step_m
        ended = beyond(math.sqrt(dx * dx + dy * dy), parameters[3])
        return min(1.0, math.exp(parameters[0] * (beyond(best, parameters[3]) - ended)))
    if not away > 0.0 or (parameters[4] > 0.0 and not parameters[6] > 0.0):
        return 1.0
    pull = away / (away + _AT_IT_M) / (1.0 + (away / parameters[3]) ** 4)
    if parameters[6] > 0.0:
        pull *= RAD_PER_STRENGTH * state[FOLLOWS * n + i] * of_base(parameters[6])
    return tilt(parameters[0], pull * (ux * dx + uy * dy) / away, pull)


@hook(ROTATION)
def rotation(state, sight, n, i, parameters):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Turn to the place by the sine of the angle to it; not along a wall."""
    dx, dy = parameters[1] - state[X * n + i], parameters[2] - state[Y * n + i]
    away = math.sqrt(dx * dx + dy * dy)
    if not away > 0.0 or not of_base(parameters[6]) or parameters[7] > 0.0:
        return 0.0
    pull = away / (away + _AT_IT_M) / (1.0 + (away / parameters[3]) ** 4)
    return RAD_PER_STRENGTH * parameters[0] * pull * turn_to(state, n, i, dx / away, dy / away)


@hook(ROTATION)
def whole_rotation(state, sight, n, i, parameters):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Turn all directions to the place, along walls too."""
    dx, dy = parameters[1] - state[X * n + i], parameters[2] - state[Y * n + i]
    away = math.sqrt(dx * dx + dy * dy)
    if not away > 0.0 or not parameters[6] > 1.0 or parameters[7] > 0.0:
        return 0.0
    pull = away / (away + _AT_IT_M) / (1.0 + (away / parameters[3]) ** 4)
    return RAD_PER_STRENGTH * parameters[0] * pull * sine_to(state, n, i, dx / away, dy / away)


def _one_sided(xy_m: Floats, values: Mapping[str, float]) -> float:
    """Return how much one way the place pulls where fish were, from 0 to 1.

    The length of the mean of the unit vectors to the place, weighed by its pull (the mean
    resultant length; Mardia and Jupp 2000, Directional Statistics, section 2.3). One in which steps
    end pulls no way.
    """
    if values.get("lands", 0.0) > 0:
        return 0.0
    dx, dy = values["x_m"] - xy_m[:, 0], values["y_m"] - xy_m[:, 1]
    away = np.maximum(np.hypot(dx, dy), 1e-9)
    pull = 1.0 / (1.0 + (away / values["reach_m"]) ** 4)
    mean = np.average(np.column_stack([dx / away, dy / away]), axis=0, weights=pull)
    return float(np.hypot(*mean))


_KNOTS_M = (0.0, 0.07, 0.15, 0.3, 0.6)
_BY_DISTANCE = Along(cue="distance to the place (m)", knots=_KNOTS_M)
_UP_TO = np.linspace(0.05, 0.95, 9)
"""Of the tank's width and height: corners as well, which fish like and keep away from."""

_NEAR_M = 0.2
_VARYING = ("who", "the time", "the speed")
"""Circumstances under which places are asked for: of so many places others take too long."""

_WALL_M = 0.1
"""Shorter pieces of wall are none: a round tank has many."""

_LANDS_M = (0.0, 0.02, 0.03, 0.04, 0.05, 0.07, 0.1)
_TO_WALL = Along(cue="distance to the wall (m)", knots=_LANDS_M[:-1])
_SPOT_M = (0.0, 0.04, 0.07, 0.1, 0.15)

_BETWEEN = (-1 / 3, 0.0, 1 / 3)
_CLOSELY = (-0.4, -0.2, 0.0, 0.2, 0.4)
"""Of the way to the next of these places; those in which steps end have edges."""

_KAPPA = 3.0

_SHELTERS_M = (0.04, 0.06, 0.09, 0.14)
"""Reaches of a place in which headings end, as it is first asked for."""


_Asked: TypeAlias = tuple[Floats, shapely.Polygon | None]
"""A place, and the room in which it is felt; None where it is everywhere."""


def _features(arena: Arena) -> tuple[Feature, ...]:
    """Return features of places all over the tank, felt everywhere or in their own room."""
    return _of_tank(arena.outline.wkb, arena)


@lru_cache(maxsize=8)
def _of_tank(_outline: bytes, arena: Arena) -> tuple[Feature, ...]:
    """Return them, looked for once: a diagnosis asks for them again and again."""
    x_min, y_min, x_max, y_max = arena.outline.bounds
    spots = [
        np.array([x, y])
        for x in x_min + _UP_TO * (x_max - x_min)
        for y in y_min + _UP_TO * (y_max - y_min)
        if arena.outline.covers(shapely.Point(x, y))
    ]
    _, rooms = find_rooms(arena)
    shapely.prepare(rooms)
    asked: list[_Asked] = [(spot, None) for spot in spots]
    asked += [(spot, room) for room in rooms for spot in spots if room.covers(shapely.Point(spot))]
    apart = np.array([x_max - x_min, y_max - y_min]) * (_UP_TO[1] - _UP_TO[0])

    def near(asked_: _Asked, shares: Sequence[float] = _BETWEEN) -> list[_Asked]:
        spot, room = asked_
        inside = arena.outline if room is None else room
        spots = [spot + apart * (x, y) for x in shares for y in shares]
        return [(each, room) for each in spots if inside.covers(shapely.Point(each))]

    places = [(each, near(each)) for each in asked]
    closely = [[spot for spot, _ in near((each, None), _CLOSELY)] for each in spots]
    walls = [end for end in arena.segments_m if np.hypot(*(end[2:] - end[:2])) > _WALL_M]
    sorts = (
        ("drawn", _drawn),
        ("driven away", _driven_away),
        ("leaning", _leaning),
        ("turning", _turning),
        ("turning as a whole", _turning_as_a_whole),
    )
    at_walls = [_at_wall(wall) for wall in walls]
    return (
        *(_of_sort(kind, sort, places) for kind, sort in sorts),
        OneOf(
            kind="leaning, by circumstances",
            features=[
                each
                for spot in spots
                for each in by_circumstances(
                    _leaning_near(spot), alone=LEANING_OUT, among=_VARYING
                ).features
            ],
        ),
        *((OneOf(kind="landing at a wall", features=at_walls),) if at_walls else ()),
        OneOf(
            kind="landing at a place",
            features=[_at_spot(spot) for spot in spots],
            near=lambda k: [_at_spot(spot) for spot in closely[k]],
        ),
    )


def _of_sort(
    kind: str,
    sort: Callable[..., Component | Tilt | Turned],
    places: Sequence[tuple[_Asked, Sequence[_Asked]]],
) -> OneOf:
    """Return features of one sort of the places, and of those between them."""
    return OneOf(
        kind=kind,
        features=[sort(*each) for each, _ in places],
        near=lambda k: [sort(*each) for each in places[k][1]],
    )


def _at_wall(wall: Floats) -> Landing:
    """Return landings by how far they are from a straight piece of wall."""
    start, way = wall[:2], wall[2:] - wall[:2]

    def away_m(_seen: Seen, _rows: NDArray[np.intp], xy_m: Floats) -> Floats:
        share = np.clip((xy_m - start) @ way / (way @ way), 0.0, 1.0)
        return lengths(xy_m - start - share[..., None] * way)

    middle = start + way / 2
    return Landing(
        label=f"landing at the wall at {middle[0]:.2f}, {middle[1]:.2f}", away_m=away_m,
        knots_m=_LANDS_M, along=_TO_WALL,
    )  # fmt: skip


def _at_spot(spot: Floats) -> Landing:
    return Landing(
        label=f"landing at {spot[0]:.2f}, {spot[1]:.2f}",
        away_m=lambda _seen, _rows, xy_m: distances_to(xy_m, spot),
        knots_m=_SPOT_M,
        along=Along(cue="distance to the place (m)", knots=_SPOT_M[:-1]),
        forms=tuple(
            {"x_m": float(spot[0]), "y_m": float(spot[1]), "reach_m": reach_m, "lands": 1.0}
            for reach_m in _SHELTERS_M
        ),
    )


def _toward(seen: Seen, spot: Floats) -> tuple[Floats, Floats]:
    """Return unit vectors to a place, shape (step, 2), and the hat functions of how far it is."""
    toward, far_m = _to(seen, spot)
    return toward, hats(far_m, _KNOTS_M)


def _to(seen: Seen, spot: Floats) -> tuple[Floats, Floats]:
    """Return unit vectors to a place, shape (step, 2), and how far it is in metres."""
    toward, far_m = np.empty((len(seen.xy_m), 2)), np.empty(len(seen.xy_m))
    write_ways_to(seen.xy_m, seen.x_axis, spot, toward, far_m)
    return toward, far_m


def _within(seen: Seen, room: shapely.Polygon | None) -> Floats:
    if room is None:
        return np.ones(len(seen.xy_m))
    return np.asarray(shapely.contains_xy(room, seen.xy_m), dtype=np.float64)


def _drawn(spot: Floats, room: shapely.Polygon | None) -> Component:
    return Component(
        label=f"drawn to {spot[0]:.2f}, {spot[1]:.2f}",
        toward=lambda seen: only(_to(seen, spot)[0]),
        weights=lambda seen: only(_toward(seen, spot)[1] * _within(seen, room)[:, None]),
        kappa=_KAPPA,
        along=_BY_DISTANCE,
    )


def _driven_away(spot: Floats, room: shapely.Polygon | None) -> Component:
    """Return a component about the way from a place."""
    drawn = _drawn(spot, room)
    return replace(
        drawn,
        label=f"driven from {spot[0]:.2f}, {spot[1]:.2f}",
        toward=lambda seen: -only(_to(seen, spot)[0]),
    )


def _leaning(spot: Floats, room: shapely.Polygon | None) -> Tilt:
    def vectors(seen: Seen) -> Floats:
        toward, weights = _toward(seen, spot)
        return np.asarray((weights * _within(seen, room)[:, None])[..., None] * toward[:, None])

    return Tilt(
        label=f"leaning to {spot[0]:.2f}, {spot[1]:.2f}", vectors=vectors, along=_BY_DISTANCE
    )


def _leaning_near(spot: Floats) -> Tilt:
    def vectors(seen: Seen) -> Floats:
        toward, far_m = _to(seen, spot)
        return np.asarray((np.exp(-far_m / _NEAR_M)[:, None] * toward)[:, None])

    return Tilt(label=f"leaning to {spot[0]:.2f}, {spot[1]:.2f}, near it", vectors=vectors)


def _turning(spot: Floats, room: shapely.Polygon | None) -> Turned:
    return _turned(spot, room, as_a_whole=False)


def _turning_as_a_whole(spot: Floats, room: shapely.Polygon | None) -> Turned:
    return _turned(spot, room, as_a_whole=True)


def _turned(spot: Floats, room: shapely.Polygon | None, *, as_a_whole: bool) -> Turned:
    """Return turns to a place: of the base's direction, or of all, along walls too."""

    def by(seen: Seen) -> Floats:
        toward, weights = _toward(seen, spot)
        aside = aside_of(seen, toward[:, None], along_walls=as_a_whole)
        return np.asarray(weights * aside * _within(seen, room)[:, None])

    what = "turning as a whole" if as_a_whole else "turning"
    return Turned(
        label=f"{what} to {spot[0]:.2f}, {spot[1]:.2f}", by=by, neighbours=as_a_whole,
        along=_BY_DISTANCE,
    )  # fmt: skip


EFFECT = Effect(
    name="place-preference",
    says="Fish are drawn to a place in the tank.",
    opposite="Fish keep away from a place in the tank.",
    reference="Mathur et al. 2011, Nature Protocols 6: 338-345",
    parameters=(
        EffectParameter(
            name="strength",
            low=-4.0,
            high=4.0,
            default=1.0,
            says="Log of the preference for headings toward the place, or for those that end "
            "there; the weight of those drawn.",
        ),
        EffectParameter(
            name="x_m", low=-100.0, high=100.0, default=0.0, says="The place's x, in metres."
        ),
        EffectParameter(
            name="y_m", low=-100.0, high=100.0, default=0.0, says="The place's y, in metres."
        ),
        EffectParameter(
            name="reach_m",
            low=0.03,
            high=2.0,
            default=0.3,
            says="Distance at which half of the pull, or of the preference, is left, in metres.",
        ),
        EffectParameter(
            name="drawn",
            low=0.0,
            high=1.0,
            default=0.0,
            says="0: all headings lean toward the place; 1: some are drawn about its bearing, with "
            "the strength as their weight beside the base's one; below 0 about the way from it.",
        ),
        EffectParameter(
            name="kappa",
            low=0.0,
            high=30.0,
            default=3.0,
            says="Von Mises concentration about that bearing of those that are drawn.",
        ),
        EffectParameter(
            name="turning",
            low=0.0,
            high=2.0,
            default=0.0,
            says="1: all turn to the place, by a tenth of a radian per strength times the sine "
            "of the angle to it; along a wall they prefer the sense that is nearer to it. 2: so do "
            "the directions to neighbours and those along walls.",
        ),
        EffectParameter(
            name="lands",
            low=0.0,
            high=1.0,
            default=0.0,
            says="1: headings that end within reach of the place are likelier, as at a shelter; "
            "nothing draws fish there, and none turn or lean.",
        ),
    ),
    probe=0.01,
    component=component,
    factor=factor,
    rotation=rotation,
    whole_rotation=whole_rotation,
    harmonics=1,
    not_harmonic="lands",
    shapes=lambda arena: tuple({"x_m": x, "y_m": y} for x, y in places(arena)),
    further_shapes=lambda arena: tuple(
        {"x_m": x, "y_m": y, **form}
        for form in ({"drawn": 1.0}, {"turning": 1.0}, {"turning": 2.0})
        for x, y in places(arena)
    ),
    fixed=("drawn", "turning", "lands"),
    idle=lambda at: ("kappa",) if at["turning"] or at["lands"] or not at["drawn"] else (),
    needs={"component": ("drawn",), "rotation": ("turning",), "whole_rotation": ("turning",)},
    other_forms=("generic:heading:place",),
    # A place with a reach of its own bends to a drift of any form.
    looks_like=Likeness(name="directional-drift", share=_one_sided),
    features=_features,
)

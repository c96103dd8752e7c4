"""Generic effects on the speed: faster by a power of e for each unit of a cue, of either sign."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Literal

from zfcal.arena import Arena
from zfcal.model.effects.base import Company, Effect, EffectParameter, Shapes
from zfcal.model.effects.cues import (
    FIXED,
    PLACE,
    REFERENCE,
    WHEN,
    bearing,
    number,
    quick,
    too_far,
    window,
)
from zfcal.model.effects.forms import apart, beyond, nearest_seen, needs_neighbour, times_faster
from zfcal.model.kernels.compiled import hook
from zfcal.model.kernels.hooks import SPEED as SPEED_HOOK
from zfcal.model.kernels.state import HX, HY, PAST_HX, PAST_HY, SPEED, WALL, X, Y
from zfcal.model.places import places


@hook(SPEED_HOOK)
def neighbour_bearing(state, sight, n, i, parameters, chance):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Follow the cosine of the nearest neighbour's bearing: 1 ahead, -1 behind."""
    j = nearest_seen(state, sight, n, i)
    if j < 0:
        return 1.0
    x, y = bearing(state, n, i, j)
    return times_faster(parameters[0] * (state[HX * n + i] * x + state[HY * n + i] * y))


@hook(SPEED_HOOK)
def neighbour_distance(state, sight, n, i, parameters, chance):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Follow whether the nearest neighbour is farther than a distance."""
    j = nearest_seen(state, sight, n, i)
    if j < 0:
        return 1.0
    return times_faster(parameters[0] * too_far(apart(state, n, i, j), parameters[1], 0.05))


@hook(SPEED_HOOK)
def neighbour_heading(state, sight, n, i, parameters, chance):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Follow the cosine between the nearest neighbour's heading and the own."""
    j = nearest_seen(state, sight, n, i)
    if j < 0:
        return 1.0
    along = state[HX * n + i] * state[HX * n + j] + state[HY * n + i] * state[HY * n + j]
    return times_faster(parameters[0] * along)


@hook(SPEED_HOOK)
def neighbour_speed(state, sight, n, i, parameters, chance):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Follow the speed of the nearest neighbour."""
    j = nearest_seen(state, sight, n, i)
    return times_faster(parameters[0] * quick(state[SPEED * n + j])) if j >= 0 else 1.0


@hook(SPEED_HOOK)
def wall(state, sight, n, i, parameters, chance):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Follow whether a wall is close."""
    return times_faster(parameters[0] * (1.0 - beyond(state[WALL * n + i], parameters[1])))


@hook(SPEED_HOOK)
def place(state, sight, n, i, parameters, chance):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Follow whether a place is close."""
    dx, dy = parameters[1] - state[X * n + i], parameters[2] - state[Y * n + i]
    return times_faster(parameters[0] * (1.0 - beyond(math.sqrt(dx * dx + dy * dy), parameters[3])))


@hook(SPEED_HOOK)
def time(state, sight, n, i, parameters, chance):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Follow a window of time."""
    when = window(state, n, i, (parameters[1], parameters[2], parameters[3]), 0.5)
    return times_faster(parameters[0] * when)


@hook(SPEED_HOOK)
def own_turn(state, sight, n, i, parameters, chance):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Follow how sharp the last turn was: 0 straight on, 1 right back."""
    along = state[PAST_HX * n + i] * state[HX * n + i] + state[PAST_HY * n + i] * state[HY * n + i]
    return times_faster(parameters[0] * 0.5 * (1.0 - along))


@hook(SPEED_HOOK)
def own_speed(state, sight, n, i, parameters, chance):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Follow the own last speed."""
    return times_faster(parameters[0] * quick(state[SPEED * n + i]))


_N_WIDE = 4
_WIDE_M = 0.35
"""A place as wide as a room: narrow ones in it would share between them what it explains."""


def _anywhere(_company: Company) -> str | None:
    return None


def _each(name: str, *values: float) -> Callable[[Arena], Shapes]:
    return lambda _arena: tuple({name: value} for value in values)


def _times(_arena: Arena) -> Shapes:
    return tuple(
        {"from_s": from_s, "for_s": 120.0, "every_s": 480.0}
        for from_s in (0.0, 120.0, 240.0, 360.0)
    )


def _places(arena: Arena) -> Shapes:
    narrow = [{"x_m": x, "y_m": y} for x, y in places(arena)]
    wide = [{"x_m": x, "y_m": y, "reach_m": _WIDE_M} for x, y in places(arena, _N_WIDE)]
    return (*narrow, *wide)


def _effect(
    cue: str, speed: Any, sentences: tuple[str, str], *parameters: EffectParameter
) -> Effect:
    shapes = _ASKED.get(cue, lambda _arena: ({},))
    return Effect(
        name=f"generic:speed:{cue}",
        says=sentences[0],
        opposite=sentences[1],
        reference=REFERENCE,
        parameters=(
            number("strength", (-1.5, 1.5), 0.3, "Log of the change of speed with the whole cue."),
            *parameters,
        ),
        speed=speed,
        shapes=shapes,
        lacks=needs_neighbour if cue.startswith("neighbour") else _anywhere,
        generic=True,
        by_place=cue in {"place", "wall"},
        shown_against=_SHOWN.get(cue, "neighbour"),
        fixed=tuple(own.name for own in parameters if own.name in FIXED),
    )


_ASKED: dict[str, Callable[[Arena], Shapes]] = {
    "neighbour-distance": _each("preferred_m", 0.05, 0.12, 0.25),
    "wall": _each("reach_m", 0.025, 0.05, 0.1),
    "place": _places,
    "time": _times,
}

_SHOWN: dict[str, Literal["time", "speed", "turn", "wall"]] = {
    "wall": "wall",
    "place": "wall",
    "time": "time",
    "own-turn": "turn",
    "own-speed": "speed",
}
"""What pictures show a cue against, where that is no neighbour."""

EFFECTS = (
    _effect(
        "neighbour-bearing",
        neighbour_bearing,
        (
            "Fish speed up when their nearest neighbour is ahead, and slow down when it is behind.",
            "Fish slow down when their nearest neighbour is ahead, and speed up when it is behind.",
        ),
    ),
    _effect(
        "neighbour-distance",
        neighbour_distance,
        (
            "Fish speed up when their nearest neighbour is far, and slow down when it is near.",
            "Fish slow down when their nearest neighbour is far, and speed up when it is near.",
        ),
        number("preferred_m", (0.0, 0.6), 0.1, "The distance between far and near, in metres."),
    ),
    _effect(
        "neighbour-heading",
        neighbour_heading,
        (
            "Fish speed up when their nearest neighbour swims the same way.",
            "Fish slow down when their nearest neighbour swims the same way.",
        ),
    ),
    _effect(
        "neighbour-speed",
        neighbour_speed,
        (
            "Fish speed up when their nearest neighbour is fast.",
            "Fish slow down when their nearest neighbour is fast.",
        ),
    ),
    _effect(
        "wall",
        wall,
        ("Fish speed up close to walls.", "Fish slow down close to walls."),
        number("reach_m", (0.01, 0.5), 0.05, "Distance within which a wall counts, in metres."),
    ),
    _effect(
        "place",
        place,
        ("Fish speed up near a place.", "Fish slow down near a place."),
        *PLACE,
        number("reach_m", (0.03, 2.0), 0.12, "Distance within which it counts, in metres."),
    ),
    _effect(
        "time",
        time,
        ("Fish speed up at certain times.", "Fish slow down at certain times."),
        *WHEN,
    ),
    _effect(
        "own-turn",
        own_turn,
        ("Fish speed up after a turn.", "Fish slow down after a turn."),
    ),
    _effect(
        "own-speed",
        own_speed,
        (
            "Fish that were fast stay fast, and slow ones slow.",
            "Fish that were fast slow down, and slow ones speed up.",
        ),
    ),
)

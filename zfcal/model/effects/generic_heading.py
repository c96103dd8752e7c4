"""Generic effects on the heading: a tilt along a cue's vector, of either sign."""

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
    WAVE,
    WHEN,
    bearing,
    number,
    quick,
    too_far,
    toward_place,
    wave,
    window,
)
from zfcal.model.effects.forms import apart, beyond, nearest_seen, needs_neighbour, tilt
from zfcal.model.kernels.compiled import hook
from zfcal.model.kernels.hooks import FACTOR
from zfcal.model.kernels.state import (
    FOLLOWS,
    HX,
    HY,
    PAST_HX,
    PAST_HY,
    SPEED,
    TAU_X,
    TAU_Y,
    WALL,
)
from zfcal.model.places import places


@hook(FACTOR)
def neighbour_bearing(state, sight, n, i, parameters, ux, uy, speed, landing):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Weigh headings by an angle from the bearing of the nearest neighbour that is seen."""
    j = nearest_seen(state, sight, n, i)
    if j < 0:
        return 1.0
    x, y = bearing(state, n, i, j)
    along, across = ux * x + uy * y, x * uy - y * ux
    cue = along * math.cos(parameters[1]) + across * math.sin(parameters[1])
    return tilt(parameters[0], cue, 1.0)


@hook(FACTOR)
def neighbour_distance(state, sight, n, i, parameters, ux, uy, speed, landing):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Weigh headings toward the nearest neighbour beyond a distance, away from it within."""
    j = nearest_seen(state, sight, n, i)
    if j < 0:
        return 1.0
    x, y = bearing(state, n, i, j)
    off = too_far(apart(state, n, i, j), parameters[1], 0.03)
    return tilt(parameters[0], off * (ux * x + uy * y), abs(off))


@hook(FACTOR)
def neighbour_heading(state, sight, n, i, parameters, ux, uy, speed, landing):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Weigh headings by that of the nearest neighbour that is seen."""
    j = nearest_seen(state, sight, n, i)
    if j < 0:
        return 1.0
    return tilt(parameters[0], ux * state[HX * n + j] + uy * state[HY * n + j], 1.0)


@hook(FACTOR)
def neighbour_speed(state, sight, n, i, parameters, ux, uy, speed, landing):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Weigh headings toward the nearest neighbour if it is fast, away from it if slow."""
    j = nearest_seen(state, sight, n, i)
    if j < 0:
        return 1.0
    x, y = bearing(state, n, i, j)
    off = quick(state[SPEED * n + j])
    return tilt(parameters[0], off * (ux * x + uy * y), abs(off))


@hook(FACTOR)
def wall(state, sight, n, i, parameters, ux, uy, speed, landing):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Weigh headings away from a wall that is close."""
    near = 1.0 - beyond(state[WALL * n + i], parameters[1])
    away = ux * state[TAU_Y * n + i] - uy * state[TAU_X * n + i]
    return tilt(parameters[0], near * away, near)


@hook(FACTOR)
def wall_time(state, sight, n, i, parameters, ux, uy, speed, landing):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Weigh headings along the wall, or on along it, by a slow wave of time."""
    if not state[FOLLOWS * n + i] > 0.0:
        return 1.0
    tau_x, tau_y = state[TAU_X * n + i], state[TAU_Y * n + i]
    along = ux * tau_x + uy * tau_y
    now = state[HX * n + i] * tau_x + state[HY * n + i] * tau_y
    either, same = 2.0 * along * along - 1.0, along * now
    cue = (1.0 - parameters[3]) * either + parameters[3] * same
    return tilt(parameters[0] * wave(state, n, i, parameters[1], parameters[2]), cue, 1.0)


@hook(FACTOR)
def place(state, sight, n, i, parameters, ux, uy, speed, landing):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Weigh headings toward a place."""
    x, y = toward_place(state, n, i, (parameters[1], parameters[2]), parameters[3])
    return tilt(parameters[0], ux * x + uy * y, math.sqrt(x * x + y * y))


@hook(FACTOR)
def place_time(state, sight, n, i, parameters, ux, uy, speed, landing):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Weigh headings toward a place at certain times."""
    when = window(state, n, i, (parameters[3], parameters[4], parameters[5]), 0.5)
    x, y = toward_place(state, n, i, (parameters[1], parameters[2]), 0.6)
    return tilt(parameters[0] * when, ux * x + uy * y, math.sqrt(x * x + y * y))


@hook(FACTOR)
def time(state, sight, n, i, parameters, ux, uy, speed, landing):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Weigh headings along a compass direction at certain times."""
    when = window(state, n, i, (parameters[2], parameters[3], parameters[4]), 0.5)
    along = ux * math.cos(parameters[1]) + uy * math.sin(parameters[1])
    return tilt(parameters[0] * when, along, 1.0)


@hook(FACTOR)
def own_turn(state, sight, n, i, parameters, ux, uy, speed, landing):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Weigh headings about straight on, carried on by a share of the last turn."""
    hx, hy = state[HX * n + i], state[HY * n + i]
    px, py = state[PAST_HX * n + i], state[PAST_HY * n + i]
    turn = parameters[1] * math.atan2(px * hy - py * hx, px * hx + py * hy)
    cue = (hx * ux + hy * uy) * math.cos(turn) + (hx * uy - hy * ux) * math.sin(turn)
    return tilt(parameters[0], cue, 1.0)


@hook(FACTOR)
def own_speed(state, sight, n, i, parameters, ux, uy, speed, landing):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Weigh headings straight on after a fast step, turns after a slow one."""
    off = quick(state[SPEED * n + i])
    straight = state[HX * n + i] * ux + state[HY * n + i] * uy
    return tilt(parameters[0], off * straight, abs(off))


_HARMONICS = 2
"""Along a wall either way; all others have one."""


_USUAL = 4.0
"""Largest strength of a preference: at a right angle to it a heading is 55 times less likely."""

_STRAIGHT = 40.0
"""The same where the preference is for straight on: real fish, which turn by 12 to 27 degrees at a
step, have one of 5 to more than 20."""


def _needs_wall(company: Company) -> str | None:
    return None if company.follows_walls else "a zone that follows walls"


def _anywhere(_company: Company) -> str | None:
    return None


def _each(name: str, *values: float) -> Callable[[Arena], Shapes]:
    return lambda _arena: tuple({name: value} for value in values)


def _waves(_arena: Arena) -> Shapes:
    return tuple(
        {"period_s": period_s, "crest_s": period_s * phase, "on": on}
        for period_s in (120.0, 240.0, 480.0)
        for phase in (0.0, 0.25)
        for on in (0.0, 1.0)
    )


def _place_times(arena: Arena) -> Shapes:
    return tuple(
        {"x_m": x, "y_m": y, "from_s": from_s, "for_s": 60.0, "every_s": 180.0}
        for x, y in places(arena, 4)
        for from_s in (0.0, 60.0, 120.0)
    )


def _times(_arena: Arena) -> Shapes:
    return tuple(
        {"direction_rad": direction, "from_s": from_s, "for_s": 300.0}
        for direction in (0.0, math.pi / 2)
        for from_s in (0.0, 300.0, 600.0, 900.0, 1200.0, 1500.0)
    )


def _effect(
    cue: str,
    factor: Any,
    sentences: tuple[str, str],
    *parameters: EffectParameter,
    most: float = _USUAL,
) -> Effect:
    shapes, lacks = _ASKED.get(cue, (lambda _arena: ({},), _anywhere))
    return Effect(
        name=f"generic:heading:{cue}",
        says=sentences[0],
        opposite=sentences[1],
        reference=REFERENCE,
        parameters=(
            number(
                "strength", (-_USUAL, most), 0.5, "Log of the preference for the cue's direction."
            ),
            *parameters,
        ),
        factor=factor,
        harmonics=_HARMONICS,
        shapes=shapes,
        lacks=lacks,
        generic=True,
        shown_against=_SHOWN.get(cue, "neighbour"),
        fixed=tuple(own.name for own in parameters if own.name in FIXED),
    )


_ASKED: dict[str, tuple[Callable[[Arena], Shapes], Callable[[Company], str | None]]] = {
    "neighbour-bearing": (_each("offset_rad", 0.0, math.pi / 2), needs_neighbour),
    "neighbour-distance": (_each("preferred_m", 0.04, 0.07, 0.11, 0.17, 0.25), needs_neighbour),
    "neighbour-heading": (lambda _arena: ({},), needs_neighbour),
    "neighbour-speed": (lambda _arena: ({},), needs_neighbour),
    "wall": (_each("reach_m", 0.025, 0.05, 0.1), _anywhere),
    "wall-time": (_waves, _needs_wall),
    "place": (lambda arena: tuple({"x_m": x, "y_m": y} for x, y in places(arena)), _anywhere),
    "place-time": (_place_times, _anywhere),
    "time": (_times, _anywhere),
    "own-turn": (_each("carried", -1.0, 0.0, 1.0), _anywhere),
}

_SHOWN: dict[str, Literal["time", "speed", "turn", "wall"]] = {
    "wall": "wall",
    "wall-time": "wall",
    "place": "wall",
    "place-time": "time",
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
            "Fish turn to a certain angle from their nearest neighbour's bearing.",
            "Fish turn away from a certain angle from their nearest neighbour's bearing.",
        ),
        number("offset_rad", (-7.0, 7.0), 0.0, "That angle, left of the neighbour, in radians."),
    ),
    _effect(
        "neighbour-distance",
        neighbour_distance,
        (
            "Fish keep a certain distance from their nearest neighbour.",
            "Fish leave a certain distance from their nearest neighbour.",
        ),
        number("preferred_m", (0.0, 0.6), 0.08, "That distance, in metres."),
    ),
    _effect(
        "neighbour-heading",
        neighbour_heading,
        (
            "Fish turn toward the heading of their nearest neighbour.",
            "Fish turn against the heading of their nearest neighbour.",
        ),
    ),
    _effect(
        "neighbour-speed",
        neighbour_speed,
        (
            "Fish turn toward a neighbour that is fast, and away from a slow one.",
            "Fish turn away from a neighbour that is fast, and toward a slow one.",
        ),
    ),
    _effect(
        "wall",
        wall,
        ("Fish turn away from walls that are close.", "Fish turn toward walls that are close."),
        number("reach_m", (0.01, 0.5), 0.05, "Distance within which a wall counts, in metres."),
    ),
    _effect(
        "wall-time",
        wall_time,
        (
            "How closely fish follow the walls waxes and wanes.",
            "How closely fish follow the walls wanes and waxes.",
        ),
        *WAVE,
        number("on", (0.0, 1.0), 0.0, "0: along the wall either way; 1: on, the way they swim."),
    ),
    _effect(
        "place",
        place,
        ("Near a place fish turn toward it.", "Near a place fish turn away from it."),
        *PLACE,
        number("reach_m", (0.03, 2.0), 0.15, "Distance within which it counts, in metres."),
    ),
    _effect(
        "place-time",
        place_time,
        (
            "At certain times fish turn toward a place.",
            "At certain times fish turn away from a place.",
        ),
        *PLACE,
        *WHEN,
    ),
    _effect(
        "time",
        time,
        (
            "At certain times fish prefer a compass direction.",
            "At certain times fish avoid a compass direction.",
        ),
        number("direction_rad", (-7.0, 7.0), 0.0, "That direction, in radians."),
        *WHEN,
    ),
    _effect(
        "own-turn",
        own_turn,
        (
            "Fish swim on in the direction that their last turn sets.",
            "Fish do not swim on in the direction that their last turn sets.",
        ),
        number("carried", (-2.0, 2.0), 0.0, "Share of the last turn that is done once more."),
        most=_STRAIGHT,
    ),
    _effect(
        "own-speed",
        own_speed,
        (
            "After a fast step fish swim on straight, after a slow one they turn.",
            "After a slow step fish swim on straight, after a fast one they turn.",
        ),
        most=_STRAIGHT,
    ),
)

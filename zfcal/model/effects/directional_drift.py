"""Directional drift: a preferred compass direction."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial

import numpy as np

from zfcal.arrays import Floats
from zfcal.model.directions import doubled, of_tank
from zfcal.model.effects.base import Effect, EffectParameter
from zfcal.model.effects.circumstances import by_circumstances
from zfcal.model.effects.forms import (
    RAD_PER_STRENGTH,
    SLOWEST_M_S,
    SPEED_M_S,
    cut,
    of_base,
    sine_to,
    tilt,
    turn_to,
)
from zfcal.model.effects.weights import LEANING_OUT, aside_of, only, turning_as_a_whole
from zfcal.model.features import Along, Component, Feature, OneOf, Seen, Tilt, Turned
from zfcal.model.kernels.compiled import hook
from zfcal.model.kernels.hats import hats
from zfcal.model.kernels.hooks import COMPONENT, FACTOR, ROTATION
from zfcal.model.kernels.state import FOLLOWS

_MOST = 4.0


@hook(COMPONENT)
def component(state, sight, n, i, parameters, out):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Add a component about the direction, or one off the walls alone."""
    out[0], out[1], out[2] = math.cos(parameters[1]), math.sin(parameters[1]), parameters[4]
    if parameters[3] > 1.0 and state[FOLLOWS * n + i] > 0.0:
        return 0.0
    is_drawn = parameters[3] > 0.0 and not parameters[5] + parameters[6] > 0.0
    return parameters[0] if is_drawn else 0.0


@hook(FACTOR)
def factor(state, sight, n, i, parameters, ux, uy, speed, landing):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Weigh headings by their component along the direction, those of slow steps more.

    Where fish turn to it, those along walls alone. Along an axis both ways count alike.
    """
    if parameters[6] > 0.0:
        ahead = ux * math.cos(parameters[1]) + uy * math.sin(parameters[1])
        return tilt(parameters[0], 2.0 * ahead * ahead - 1.0, 1.0)
    if parameters[5] > 0.0:
        if parameters[5] > 1.0 or not state[FOLLOWS * n + i] > 0.0:
            return 1.0
    elif parameters[3] > 0.0:
        return 1.0
    along = ux * math.cos(parameters[1]) + uy * math.sin(parameters[1])
    if parameters[5] > 0.0:
        return tilt(RAD_PER_STRENGTH * parameters[0], along, 1.0)
    strength = parameters[0] * (SPEED_M_S / max(speed, SLOWEST_M_S)) ** parameters[2]
    return tilt(cut(strength, 0.0, _MOST), along, 1.0)


@hook(ROTATION)
def rotation(state, sight, n, i, parameters):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Turn to the direction by the sine of the angle to it; not along a wall."""
    if not of_base(parameters[5]) or parameters[6] > 0.0:
        return 0.0
    aside = turn_to(state, n, i, math.cos(parameters[1]), math.sin(parameters[1]))
    return RAD_PER_STRENGTH * parameters[0] * aside


@hook(ROTATION)
def whole_rotation(state, sight, n, i, parameters):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Turn all directions to it, along walls too."""
    if not parameters[5] > 1.0 or parameters[6] > 0.0:
        return 0.0
    aside = sine_to(state, n, i, math.cos(parameters[1]), math.sin(parameters[1]))
    return RAD_PER_STRENGTH * parameters[0] * aside


def _idle(values: Mapping[str, float]) -> tuple[str, ...]:
    """Return what does nothing: slowness where fish do not lean, kappa where none are drawn."""
    is_drawn = values["drawn"] > 0 and not values["turning"] + values["axial"] > 0
    leans = not values["drawn"] + values["turning"] + values["axial"] > 0
    return (*(() if leans else ("by_slowness",)), *(() if is_drawn else ("kappa",)))


_DIRECTIONS = tuple(float(angle) for angle in np.arange(6) * np.pi / 3)
_SLOW_M_S = 0.01
_BEGINS = (0.2, 0.35, 0.5, 0.65, 0.8)


def _compass(seen: Seen) -> Floats:
    """Return six directions of the tank, shape (step, 6, 2)."""
    return of_tank(seen.x_axis, np.stack([np.cos(_DIRECTIONS), np.sin(_DIRECTIONS)], axis=-1)[None])


def _each(seen: Seen) -> Floats:
    return np.broadcast_to(np.eye(len(_DIRECTIONS)), (len(seen.zone),) + 2 * (len(_DIRECTIONS),))


def _axes(seen: Seen) -> Floats:
    return of_tank(seen.x_axis, np.eye(2)[None])


def _doubled(seen: Seen) -> Floats:
    """Return unit vectors at twice the angle of axes of the tank, shape (step, 2, 2)."""
    return of_tank(doubled(seen.x_axis), np.eye(2)[None])


_TIMES = (0.0, 0.5, 1.0)


def _axes_by_time(seen: Seen) -> Floats:
    """Return the axes by the time, shape (step, time and axis, 2): what draws them may move."""
    by = hats(seen.time, _TIMES)[:, :, None, None] * _axes(seen)[:, None]
    return by.reshape(len(seen.time), -1, 2)


def _aside(seen: Seen, *, along_walls: bool = False) -> Floats:
    return aside_of(seen, _axes(seen), along_walls=along_walls)


def _from(begin: float) -> Tilt:
    return Tilt(
        label=f"leaning, from {begin:.0%} of the time on",
        vectors=lambda seen: (seen.time > begin)[:, None, None] * _axes(seen),
    )


def _swinging(cycles: float) -> Tilt:
    """Return that what draws along the axes swings so often in the recording."""

    def vectors(seen: Seen) -> Floats:
        angle = 2 * math.pi * cycles * seen.time
        by = np.stack([np.cos(angle), np.sin(angle)], axis=1)[:, :, None, None]
        return np.asarray((by * _axes(seen)[:, None]).reshape(len(seen.time), -1, 2))

    return Tilt(label=f"leaning, {cycles:g} times to and fro", vectors=vectors)


def _carried(seen: Seen) -> Floats:
    """Return the axes, heavier for slow steps: a current carries fish that swim."""
    by = 1.0 / np.maximum(seen.own_speed_m_s, _SLOW_M_S)
    return np.asarray((by / by.mean())[:, None, None] * _axes(seen))


def _off_the_walls(angle_rad: float) -> Component:
    way = np.array([[[math.cos(angle_rad), math.sin(angle_rad)]]])
    return Component(
        label=f"drawn to {math.degrees(angle_rad):.0f} degrees, off the walls",
        toward=lambda seen: np.broadcast_to(of_tank(seen.x_axis, way), (len(seen.zone), 1, 2)),
        weights=lambda seen: only((~seen.follows_walls).astype(np.float64)[:, None]),
        kappa=3.0,
    )


def _both_ways(angle_rad: float) -> Component:
    """Return that headings are drawn to a direction and to its opposite alike, as by a compass."""
    way = np.array([math.cos(angle_rad), math.sin(angle_rad)])
    ways = np.stack([way, -way])[None]
    return Component(
        label=f"drawn along {math.degrees(angle_rad):.0f} degrees",
        toward=lambda seen: np.broadcast_to(of_tank(seen.x_axis, ways), (len(seen.zone), 2, 2)),
        weights=lambda seen: np.ones((len(seen.zone), 2, 1)),
        kappa=2.0,
    )


def _and_across_walls(seen: Seen) -> Floats:
    """Return the axes, and what of them is across the wall a fish follows, shape (step, 4, 2).

    A current carries both ways along a wall to the same side: there headings lean across it by more
    than they prefer one of these ways. Who prefers a direction does both alike.
    """
    axes, wall = _axes(seen), seen.along_wall[:, None]
    along = (axes * wall).sum(axis=-1, keepdims=True) * wall
    across = np.where(seen.follows_walls[:, None, None], axes - along, 0.0)
    return np.concatenate([axes, across], axis=1)


def _axes_off_the_walls(seen: Seen) -> Floats:
    return np.asarray((~seen.follows_walls)[:, None, None] * _axes(seen))


_BY_DIRECTION = Along(cue="direction (rad)", knots=_DIRECTIONS)


_LEANING = Tilt(label="leaning", vectors=_axes)

_FEATURES: tuple[Feature, ...] = (
    Component(
        label="drawn, widely", toward=_compass, weights=_each, kappa=1.0, along=_BY_DIRECTION
    ),
    Component(label="drawn", toward=_compass, weights=_each, kappa=3.0, along=_BY_DIRECTION),
    OneOf(
        kind="drawn, off the walls",
        features=tuple(_off_the_walls(k * math.pi / 6) for k in range(12)),
    ),
    OneOf(
        kind="drawn along an axis", features=tuple(_both_ways(k * math.pi / 6) for k in range(6))
    ),
    _LEANING,
    by_circumstances(
        _LEANING,
        # A direction of each room is a place, and of each fish it may be the way out.
        alone=LEANING_OUT,
        without=("the time", "the zone", "the stay"),
    ),
    Tilt(label="leaning, by the time", vectors=_axes_by_time),
    Tilt(label="leaning along an axis", vectors=_doubled, axial=True),
    Tilt(label="leaning, off the walls", vectors=_axes_off_the_walls),
    # Half a cycle apart: what is between two of these still shows four fifths in one.
    OneOf(kind="leaning to and fro", features=tuple(_swinging(k / 2) for k in range(2, 25))),
    OneOf(kind="leaning, from some time on", features=tuple(map(_from, _BEGINS))),
    Turned(label="turning", by=_aside, neighbours=False),
    *turning_as_a_whole(partial(_aside, along_walls=True)),
    Tilt(label="carried", vectors=_carried),
    Tilt(label="leaning, more across walls", vectors=_and_across_walls),
)


EFFECT = Effect(
    name="directional-drift",
    says="All over the tank fish prefer one compass direction, or one axis, as with a current, a "
    "light or a slope.",
    reference="Montgomery et al. 1997, Nature 389: 960-963",
    parameters=(
        EffectParameter(
            name="strength",
            low=0.0,
            high=_MOST,
            default=0.4,
            says="Log of the preference for headings along the direction.",
        ),
        EffectParameter(
            name="direction_rad",
            low=-7.0,
            high=7.0,
            default=0.0,
            says="The direction, counter-clockwise from x, in radians.",
        ),
        EffectParameter(
            name="by_slowness",
            low=0.0,
            high=1.0,
            default=0.0,
            says="How much more slow steps have of it: 0 for all steps alike, as with a light; 1 "
            "for the inverse of the speed, as where a current carries fish that swim. Of "
            "those that lean.",
        ),
        EffectParameter(
            name="drawn",
            low=0.0,
            high=2.0,
            default=0.0,
            says="0: all headings lean that way; 1: some are drawn about it, with the strength as "
            "their weight beside the base's one; 2: so are they off the walls alone.",
        ),
        EffectParameter(
            name="kappa",
            low=0.0,
            high=30.0,
            default=2.0,
            says="Von Mises concentration about the direction of those that are drawn.",
        ),
        EffectParameter(
            name="turning",
            low=0.0,
            high=2.0,
            default=0.0,
            says="1: all turn to that direction, by a tenth of a radian per strength times the "
            "sine of the angle to it; along a wall they prefer the sense that is nearer to it. 2: "
            "so do the directions to neighbours and those along walls.",
        ),
        EffectParameter(
            name="axial",
            low=0.0,
            high=1.0,
            default=0.0,
            says="1: headings lean along the direction and against it alike, by the strength times "
            "the cosine of twice the angle; nothing else.",
        ),
    ),
    probe=0.01,
    component=component,
    factor=factor,
    harmonics=2,
    shapes=lambda _arena: tuple({"direction_rad": eighth * math.pi / 4} for eighth in range(-3, 5)),
    rotation=rotation,
    whole_rotation=whole_rotation,
    further_shapes=lambda _arena: (
        *(
            {"direction_rad": eighth * math.pi / 4, **form}
            for form in ({"drawn": 1.0}, {"drawn": 2.0}, {"turning": 1.0}, {"turning": 2.0})
            for eighth in range(-3, 5)
        ),
        *({"direction_rad": eighth * math.pi / 4, "axial": 1.0} for eighth in range(4)),
    ),
    fixed=("drawn", "turning", "axial"),
    idle=_idle,
    needs={"component": ("drawn",), "rotation": ("turning",), "whole_rotation": ("turning",)},
    shown_against="wall",
    features=lambda _arena: _FEATURES,
)

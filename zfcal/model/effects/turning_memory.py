"""Turning memory: the next turn depends on the last one."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from zfcal.arrays import Floats
from zfcal.model.directions import left_of, turned_by
from zfcal.model.effects.base import Control, Effect, EffectParameter
from zfcal.model.effects.circumstances import by_circumstances
from zfcal.model.effects.forms import leftward, tilt
from zfcal.model.effects.weights import only, own_heading_by, turning_as_a_whole
from zfcal.model.features import (
    LAGS,
    Along,
    Component,
    Feature,
    OneOf,
    Seen,
    Sharper,
    Tilt,
    Turned,
)
from zfcal.model.kernels.compiled import hook
from zfcal.model.kernels.hats import hats
from zfcal.model.kernels.hooks import COMPONENT, FACTOR, ROTATION
from zfcal.model.kernels.state import FOLLOWS, HX, HY, PAST_HX, PAST_HY

_PER_STRENGTH = 0.1
_KAPPA = 9.0
_USUAL_RAD = 0.6
"""A turn after which the next ones are as the base model has them."""

_SLIGHT = 0.09
"""Sine of a turn that is none."""

_STRAIGHT_S = (0.0, 1.0, 3.0, 6.0)
_WIDER_RAD = (0.0, 0.5, 1.5)
_KNOTS_RAD = (0.0, 0.4, 0.8, 1.6, math.pi)


@hook(FACTOR)
def factor(state, sight, n, i, parameters, ux, uy, speed, landing):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Weigh headings by the sine of their turn times that of the last, or by both their sizes."""
    if parameters[3] > 0.0 or parameters[4] > 0.0:
        return 1.0
    hx, hy = state[HX * n + i], state[HY * n + i]
    px, py = state[PAST_HX * n + i], state[PAST_HY * n + i]
    if parameters[5] > 0.0:
        narrow = _USUAL_RAD - abs(math.atan2(px * hy - py * hx, px * hx + py * hy))
        if state[FOLLOWS * n + i] > 0.0 or (px == 0.0 and py == 0.0):  # both ways, or not known
            return 1.0
        return tilt(parameters[0], narrow * (hx * ux + hy * uy), abs(narrow))
    # A fish that has turned back has no side to go on to.
    last = (px * hy - py * hx) * max(0.0, px * hx + py * hy) ** parameters[2]
    return tilt(parameters[0], last * leftward(state, n, i, ux, uy, parameters[1]), abs(last))


@hook(ROTATION)
def rotation(state, sight, n, i, parameters):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Turn the own direction on by a share of the last turn."""
    if not parameters[3] > 0.0 or state[FOLLOWS * n + i] > parameters[1]:
        return 0.0
    hx, hy = state[HX * n + i], state[HY * n + i]
    px, py = state[PAST_HX * n + i], state[PAST_HY * n + i]
    on = px * hx + py * hy
    last = math.atan2(px * hy - py * hx, on) * max(0.0, on) ** parameters[2]
    return _PER_STRENGTH * parameters[0] * last


@hook(COMPONENT)
def component(state, sight, n, i, parameters, out):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Add a component about the heading that the last turn leads on to; not along a wall."""
    if state[FOLLOWS * n + i] > 0.0:
        return 0.0
    hx, hy = state[HX * n + i], state[HY * n + i]
    px, py = state[PAST_HX * n + i], state[PAST_HY * n + i]
    c, s = px * hx + py * hy, px * hy - py * hx
    if parameters[0] < 0.0:
        s = -s
    out[0], out[1], out[2] = c * hx - s * hy, s * hx + c * hy, _KAPPA
    return _PER_STRENGTH * abs(parameters[0]) * parameters[4] if s != 0.0 else 0.0


def _shuffled(states: Floats, _dt_s: float, random: np.random.Generator) -> Floats:
    """Return states in which the last turns are dealt anew among all agents and times."""
    changed = states.copy()
    now = np.arctan2(changed[:, HY], changed[:, HX])
    turn = now - np.arctan2(changed[:, PAST_HY], changed[:, PAST_HX])
    dealt = random.permutation(turn.ravel()).reshape(turn.shape)
    changed[:, PAST_HX], changed[:, PAST_HY] = np.cos(now - dealt), np.sin(now - dealt)
    return changed


def _last_turn(seen: Seen) -> Floats:
    return np.where(seen.follows_walls, 0.0, seen.last_turn_rad)


def _slight_turn(seen: Seen) -> Floats:
    """Return the last turn, of which less counts the wider it was, along walls as well."""
    return np.asarray(seen.last_turn_rad * np.maximum(np.cos(seen.last_turn_rad), 0.0))


def _before(seen: Seen) -> Floats:
    return only(_heading_before(seen))


def _remembers(seen: Seen) -> Floats:
    """Return one where the turn before is known and no wall is followed: there all forget."""
    return np.where(seen.follows_walls | (seen.last_turn_rad == 0), 0.0, 1.0)


def _one(seen: Seen) -> Floats:
    return _remembers(seen)[:, None, None]


def _heading_before(seen: Seen) -> Floats:
    return turned_by(seen.own_heading, -seen.last_turn_rad)


def _on(seen: Seen) -> Floats:
    return only(turned_by(seen.own_heading, seen.last_turn_rad))


def _leaning(seen: Seen) -> Floats:
    """Return what of the heading before is aside of the present one: that is the memory."""
    left = left_of(seen.own_heading)
    aside = _remembers(seen) * np.sin(seen.last_turn_rad)
    return np.asarray((aside[:, None] * left)[:, None])


def _earlier(seen: Seen) -> Floats:
    """Return what earlier headings have aside of the present one, shape (step, lag, 2)."""
    left = left_of(seen.own_heading)
    return np.moveaxis((seen.ago_heading * left).sum(axis=-1, keepdims=True) * left, 0, 1)


def _before_the_last(seen: Seen) -> Floats:
    """Return the headings before the last one, along walls too, shape (step, lag, 2)."""
    return np.moveaxis(seen.ago_heading[1:], 0, 1)


def _by_last_turn(seen: Seen) -> Floats:
    """Return hat functions of how wide the last turn was, less their mean."""
    weights = hats(np.abs(seen.last_turn_rad), _KNOTS_RAD)
    return np.asarray((weights - weights.mean(axis=0))[:, 1:])


def _straight_by_last_turn(seen: Seen) -> Floats:
    return own_heading_by(seen, hats(np.abs(seen.last_turn_rad), _WIDER_RAD))


def _off_walls(seen: Seen) -> Floats:
    return _straight_by_last_turn(seen) * ~seen.follows_walls[:, None, None]


def _straight_by_time(seen: Seen) -> Floats:
    return own_heading_by(seen, hats(seen.straight_s, _STRAIGHT_S))


def _aside(degrees: int) -> Component:
    """Return wide turns to either side, by how long the fish has gone without one."""

    def toward(seen: Seen) -> Floats:
        both = [turned_by(seen.own_heading, side * math.radians(degrees)) for side in (-1, 1)]
        return np.stack(both, axis=1)

    def weights(seen: Seen) -> Floats:
        return np.repeat(hats(seen.straight_s, _STRAIGHT_S)[:, None], 2, axis=1)

    label = f"turned by {degrees} degrees"
    alike = Component(
        label=label, toward=toward, kappa=_KAPPA,
        weights=lambda seen: np.ones((len(seen.zone), 2, 1)),
    )  # fmt: skip
    # More than at all times alike, which would be another law of turns.
    along = Along(cue="time since a wide turn (s)", knots=_STRAIGHT_S)
    return replace(
        alike, label=f"{label}, by how long it swam straight", weights=weights,
        along=along, over=alike,
    )  # fmt: skip


def _by_last_turn_off_walls(seen: Seen) -> Floats:
    return _by_last_turn(seen) * _remembers(seen)[:, None]


def _old(k: int, *, off_walls: bool) -> Component:
    """Return headings drawn to the one of some steps before, as `LAGS` has them."""

    def weights(seen: Seen) -> Floats:
        return _one(seen) if off_walls else np.ones((len(seen.zone), 1, 1))

    where = "off the walls" if off_walls else "everywhere"
    return Component(
        label=f"drawn to the heading {LAGS[k]} steps before, {where}",
        toward=lambda seen: only(seen.ago_heading[k]),
        weights=weights,
        kappa=_KAPPA,
    )


def _last_two(seen: Seen) -> tuple[Floats, Floats]:
    """Return the sines of the last turn and of the one before it; left is positive."""
    last, before = seen.ago_heading[0], seen.ago_heading[1]
    return np.sin(seen.last_turn_rad), (before * -left_of(last)).sum(axis=1)


def _on_that_side(degrees: int, *, twice: bool) -> Component:
    """Return headings drawn to the side of the last turn, or where two were to one side."""

    def toward(seen: Seen) -> Floats:
        return only(
            turned_by(seen.own_heading, np.sign(_last_two(seen)[0]) * math.radians(degrees))
        )

    def weights(seen: Seen) -> Floats:
        last, before = _last_two(seen)
        least = np.minimum(np.abs(last), np.abs(before))
        counts = (last * before > 0) & (least > _SLIGHT) if twice else last != 0.0
        return only(counts.astype(np.float64)[:, None])

    where = "after two turns to one side" if twice else "after a turn"
    return Component(
        label=f"drawn {degrees} degrees on, {where}", toward=toward, weights=weights, kappa=_KAPPA
    )


def _course(n: int) -> Component:
    """Return headings drawn to the mean of the present one and some before, as `LAGS` has them."""

    def toward(seen: Seen) -> Floats:
        total = seen.own_heading + seen.ago_heading[:n].sum(axis=0)
        return only(total / np.maximum(np.linalg.norm(total, axis=1), 1e-9)[:, None])

    label = f"drawn to the course of {LAGS[n - 1] + 1} steps"
    return Component(label=label, toward=toward, weights=_one, kappa=_KAPPA)


_OFFSET = Turned(label="offset", by=_last_turn, neighbours=False)
_LEANING = Tilt(label="leaning to the heading before", vectors=_leaning)

_FEATURES: tuple[Feature, ...] = (
    _OFFSET,
    by_circumstances(_OFFSET, without=("the last turn",)),
    *turning_as_a_whole(lambda seen: seen.last_turn_rad, label="offset as a whole"),
    Turned(label="offset by recent turns", by=lambda seen: seen.recent_turn_rad, neighbours=False),
    Turned(label="offset by slight turns", by=_slight_turn, neighbours=True),
    Component(label="drawn to the heading before", toward=_before, weights=_one, kappa=5.0),
    Component(label="drawn on as it turned", toward=_on, weights=_one, kappa=_KAPPA),
    OneOf(kind="drawn to the course", features=tuple(_course(n) for n in (2, 4, 6))),
    OneOf(
        kind="drawn to an earlier heading",
        features=tuple(
            _old(k, off_walls=off_walls) for k in range(1, len(LAGS)) for off_walls in (False, True)
        ),
    ),
    OneOf(
        kind="drawn to that side",
        features=tuple(
            _on_that_side(degrees, twice=twice)
            for degrees in (30, 50, 80)
            for twice in (False, True)
        ),
    ),
    *map(_aside, (50, 70, 100)),
    Tilt(label="going straight, by the last turn", vectors=_straight_by_last_turn),
    Tilt(label="going straight, by the last turn, off the walls", vectors=_off_walls),
    Tilt(label="going straight, by how long it did", vectors=_straight_by_time),
    Sharper(label="sharper by the last turn", by=_by_last_turn),
    Sharper(label="sharper by the last turn, off the walls", by=_by_last_turn_off_walls),
    _LEANING,
    by_circumstances(_LEANING, without=("the last turn",)),
    Tilt(label="leaning to earlier headings", vectors=_earlier),
    Tilt(label="leaning to earlier headings, along walls too", vectors=_before_the_last),
)


EFFECT = Effect(
    name="turning-memory",
    says="A fish that has just turned goes on turning to the same side.",
    opposite="A fish that has just turned turns back to the other side.",
    reference="Gautrais et al. 2009, Journal of Mathematical Biology 58: 429-445",
    parameters=(
        EffectParameter(
            name="strength",
            low=-4.0,
            high=4.0,
            default=0.8,
            says="Half the log of how much more likely a right angle to the same side is than one "
            "to the other side, after a right angle.",
        ),
        EffectParameter(
            name="along_walls",
            low=0.0,
            high=1.0,
            default=0.0,
            says="0: the side of the present heading everywhere; 1: where fish follow walls, the "
            "side of the way along the wall.",
        ),
        EffectParameter(
            name="forgets_wide",
            low=0.0,
            high=4.0,
            default=0.0,
            says="Power of the cosine of the last turn by which wide turns count for less.",
        ),
        EffectParameter(
            name="turning",
            low=0.0,
            high=1.0,
            default=0.0,
            says="1: the own direction, and that along a wall if along_walls is 1, is turned on by "
            "a tenth of the last turn per strength.",
        ),
        EffectParameter(
            name="drawn",
            low=0.0,
            high=1.0,
            default=0.0,
            says="1: some headings are drawn about the one that the last turn leads on to, or back "
            "to, as a component of the weight 0.1 per strength; not along a wall.",
        ),
        EffectParameter(
            name="sizes",
            low=0.0,
            high=1.0,
            default=0.0,
            says="1: wide turns follow wide ones, to either side: straight on against a right "
            "angle loses a factor of e to the strength per radian of the last turn beyond 0.6; "
            "not along a wall.",
        ),
    ),
    probe=0.01,
    component=component,
    factor=factor,
    rotation=rotation,
    harmonics=2,
    shapes=lambda _arena: tuple(
        {"along_walls": along, "forgets_wide": wide} for along in (0.0, 1.0) for wide in (0.0, 1.0)
    ),
    further_shapes=lambda _arena: (
        {"drawn": 1.0},
        {"sizes": 1.0},
        *(
            {"turning": 1.0, "along_walls": along, "forgets_wide": wide}
            for along in (0.0, 1.0)
            for wide in (0.0, 1.0)
        ),
    ),
    fixed=("along_walls", "forgets_wide", "turning", "drawn", "sizes"),
    needs={"rotation": ("turning",), "component": ("drawn",)},
    identity_s=0.8,
    shown_against="turn",
    # generic:heading:own-turn is no other form of it: without its share of the last turn fish keep
    # their heading, which is no memory of turns, and what real fish do most.
    control=Control(name="a shuffled turn", states=_shuffled),
    features=lambda _arena: _FEATURES,
)

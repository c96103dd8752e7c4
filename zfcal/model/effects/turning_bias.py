"""Turning bias: handedness."""

from __future__ import annotations

import math

import numpy as np

from zfcal.arrays import Floats
from zfcal.model.directions import left_of, turned_by
from zfcal.model.effects.base import Effect, EffectParameter
from zfcal.model.effects.circumstances import by_circumstances, each_fish
from zfcal.model.effects.forms import RAD_PER_STRENGTH, leftward, tilt
from zfcal.model.effects.weights import both_senses, only, to_one_sense, turning_as_a_whole
from zfcal.model.features import Component, Feature, OneOf, Seen, Tilt, Turned
from zfcal.model.kernels.compiled import hook
from zfcal.model.kernels.hooks import COMPONENT, FACTOR, ROTATION
from zfcal.model.kernels.state import FOLLOWS, HX, HY, TAU_X, TAU_Y

_KAPPA = 4.0
_PER_STRENGTH = 0.1
_ASIDE_DEGREES = (30, 60, 90, 135)


@hook(FACTOR)
def factor(state, sight, n, i, parameters, ux, uy, speed, landing):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Weigh headings by the sine of the turn that they are; left is positive.

    Or those along walls by which side the wall is on.
    """
    if parameters[2] > 0.0 or parameters[3] > 0.0:
        return 1.0
    if parameters[1] > 1.0:
        if not state[FOLLOWS * n + i] > 0.0:
            return 1.0
        return tilt(parameters[0], -ux * state[TAU_X * n + i] - uy * state[TAU_Y * n + i], 1.0)
    return tilt(parameters[0], leftward(state, n, i, ux, uy, parameters[1]), 1.0)


@hook(COMPONENT)
def component(state, sight, n, i, parameters, out):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Add a component about the left of the heading, or the right; not along a wall."""
    if state[FOLLOWS * n + i] > 0.0 or parameters[3] > 0.0:
        return 0.0
    side = 1.0 if parameters[0] > 0.0 else -1.0
    out[0], out[1] = -side * state[HY * n + i], side * state[HX * n + i]
    out[2] = _KAPPA
    return _PER_STRENGTH * abs(parameters[0]) * parameters[2]


@hook(ROTATION)
def rotation(state, sight, n, i, parameters):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Turn the base's directions to the left, along walls as well."""
    return RAD_PER_STRENGTH * parameters[0] if parameters[3] > 0.0 else 0.0


def _drawn(angle_rad: float, where: str) -> Component:
    def toward(seen: Seen) -> Floats:
        return only(turned_by(seen.own_heading, angle_rad))

    def weights(seen: Seen) -> Floats:
        here = ~seen.follows_walls if where == "off the walls" else np.ones(len(seen.zone))
        return only(here.astype(np.float64)[:, None])

    return Component(
        label=f"drawn to {math.degrees(angle_rad):.0f} degrees, {where}", toward=toward,
        weights=weights, kappa=_KAPPA,
    )  # fmt: skip


def _everywhere(seen: Seen) -> Floats:
    return np.ones(len(seen.zone))


def _left(seen: Seen) -> Floats:
    """Return the left of each heading, for each zone apart, shape (step, zone, 2)."""
    left = left_of(seen.own_heading)
    zones = np.unique(seen.zone)
    return np.asarray((seen.zone[:, None] == zones)[..., None] * left[:, None])


def _left_by_who(seen: Seen) -> Floats:
    return np.asarray(seen.once(each_fish)[..., None] * left_of(seen.own_heading)[:, None])


def _to_left(seen: Seen) -> Floats:
    return np.asarray(left_of(seen.own_heading)[:, None])


_OWN_OFFSET = Turned(label="offset of the own direction", by=_everywhere, neighbours=False)
_ALONG_WALL = Component(
    label="along the wall",
    toward=both_senses,
    weights=to_one_sense,
    kappa="own",
    low=-0.98,
    high=0.98,
)

_FEATURES: tuple[Feature, ...] = (
    *turning_as_a_whole(_everywhere, label="offset"),
    # The base's own direction alone: what is drawn to others stays as it is.
    _OWN_OFFSET,
    by_circumstances(_OWN_OFFSET, without=("who",)),
    OneOf(
        kind="drawn to a side",
        features=tuple(
            _drawn(side * math.radians(degrees), where)
            for degrees in _ASIDE_DEGREES
            for side in (1, -1)
            for where in ("everywhere", "off the walls")
        ),
    ),
    Tilt(label="leaning", vectors=_left),
    by_circumstances(Tilt(label="leaning to the left", vectors=_to_left), without=("who",)),
    # Some turn left, others right, as individuals do that have a side of their own.
    Turned(label="offset, by who", by=each_fish, neighbours=True),
    Turned(label="offset of the own direction, by who", by=each_fish, neighbours=False),
    Tilt(label="leaning, by who", vectors=_left_by_who),
    _ALONG_WALL,
    by_circumstances(_ALONG_WALL),
)


EFFECT = Effect(
    name="turning-bias",
    says="Fish turn left more than right.",
    opposite="Fish turn right more than left.",
    reference="Bisazza et al. 2000, Laterality 5: 269-284",
    parameters=(
        EffectParameter(
            name="strength",
            low=-4.0,
            high=4.0,
            default=0.5,
            says="Half the log of how much more likely a right angle to the left is than one to "
            "the right.",
        ),
        EffectParameter(
            name="along_walls",
            low=0.0,
            high=2.0,
            default=0.0,
            says="0: left of the present heading everywhere; 1: where fish follow walls, left of "
            "the way along the wall; 2: there alone, the way with the wall on the right, which is "
            "how fish go round that turn left.",
        ),
        EffectParameter(
            name="drawn",
            low=0.0,
            high=1.0,
            default=0.0,
            says="0: all headings lean to the side; 1: some are drawn at right angles to it, as "
            "a component of the weight 0.1 per strength; not along a wall.",
        ),
        EffectParameter(
            name="turning",
            low=0.0,
            high=1.0,
            default=0.0,
            says="1: the base's directions turn to the side, by a tenth of a radian per strength, "
            "along walls as well.",
        ),
    ),
    probe=0.01,
    component=component,
    factor=factor,
    harmonics=2,
    shapes=lambda _arena: ({"along_walls": 0.0}, {"along_walls": 1.0}),
    rotation=rotation,
    further_shapes=lambda _arena: ({"drawn": 1.0}, {"turning": 1.0}, {"along_walls": 2.0}),
    fixed=("along_walls", "drawn", "turning"),
    needs={"component": ("drawn",), "rotation": ("turning",)},
    shown_against="wall",
    features=lambda _arena: _FEATURES,
)

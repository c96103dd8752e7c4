"""Wall persistence: a fish keeps its sense of travel along a wall.

The base model forgets it: along a wall both ways are alike.
"""

from __future__ import annotations

import numpy as np

from zfcal.arrays import Floats
from zfcal.model.effects.base import Company, Effect, EffectParameter
from zfcal.model.effects.circumstances import by_circumstances
from zfcal.model.effects.forms import sense_along, tilt
from zfcal.model.effects.weights import to_one_sense
from zfcal.model.features import Component, Feature, Seen, Tilt
from zfcal.model.kernels.compiled import hook
from zfcal.model.kernels.hooks import FACTOR
from zfcal.model.kernels.state import FOLLOWS, HX, HY, TAU_X, TAU_Y


@hook(FACTOR)
def factor(state, sight, n, i, parameters, ux, uy, speed, landing):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Weigh headings by whether they keep the sense of travel; nearly all or nothing."""
    if not state[FOLLOWS * n + i] > 0.0:
        return 1.0
    tau_x, tau_y = state[TAU_X * n + i], state[TAU_Y * n + i]
    now = sense_along(state[HX * n + i] * tau_x + state[HY * n + i] * tau_y)
    then = sense_along(ux * tau_x + uy * tau_y)
    return tilt(parameters[0], now * then, abs(now))


def _lacks(company: Company) -> str | None:
    return None if company.follows_walls else "a zone that follows walls"


def _both_ways(seen: Seen) -> Floats:
    """Return along the wall as the fish swims, and against it, shape (step, 2, 2)."""
    along = (seen.along_wall * seen.own_heading).sum(axis=1, keepdims=True)
    ahead = np.where(along >= 0, 1.0, -1.0) * seen.along_wall
    return np.stack([ahead, -ahead], axis=1)


def _leaning(seen: Seen) -> Floats:
    return np.asarray((seen.follows_walls[:, None] * seen.own_heading)[:, None])


def _earlier(seen: Seen) -> Floats:
    """Return the headings of earlier steps along a wall, shape (step, lag, 2)."""
    along = (seen.ago_heading * seen.along_wall).sum(axis=-1, keepdims=True) * seen.along_wall
    return np.moveaxis(np.where(seen.follows_walls[:, None], along, 0.0), 0, 1)


_SHARE = Component(
    label="share", toward=_both_ways, weights=to_one_sense, kappa="own", low=-0.98, high=0.98
)
_LEANING = Tilt(label="leaning", vectors=_leaning)

# What turns of fast and slow steps differ in is `speed-turn-coupling`, along walls too.
_OTHER = ("the speed",)

_FEATURES: tuple[Feature, ...] = (
    _SHARE,
    by_circumstances(_SHARE, without=_OTHER),
    _LEANING,
    by_circumstances(_LEANING, without=_OTHER),
    Tilt(label="leaning, by earlier headings", vectors=_earlier),
)


EFFECT = Effect(
    name="wall-persistence",
    says="Along a wall fish keep the direction in which they already swim.",
    opposite="Along a wall fish turn back more often than by chance.",
    reference="Jeanson et al. 2003, Journal of Theoretical Biology 225: 443-451",
    parameters=(
        EffectParameter(
            name="strength",
            low=-3.0,
            high=3.0,
            default=0.7,
            says="Half the log odds of swimming on against turning back.",
        ),
    ),
    probe=0.01,
    factor=factor,
    lacks=_lacks,
    shown_against="wall",
    features=lambda _arena: _FEATURES,
)

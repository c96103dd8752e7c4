"""Leader following: fast neighbours get more attention than slow ones."""

from __future__ import annotations

import math

import numpy as np

from zfcal.arrays import Floats
from zfcal.model.effects.base import Effect, EffectParameter
from zfcal.model.effects.forms import needs_neighbour, quickness
from zfcal.model.features import Feature, Seen, factor_on_attention, hats
from zfcal.model.kernels.compiled import hook
from zfcal.model.kernels.hooks import SIGHT
from zfcal.model.kernels.state import SPEED


@hook(SIGHT)
def sight(state, sight, n, i, parameters, j):  # type: ignore[no-untyped-def]
    """Weigh a neighbour by how much faster than 0.07 m/s it swims, or one of them alone."""
    if parameters[2] >= 0.0:
        return math.exp(parameters[0]) if j == int(parameters[2]) else 1.0
    if parameters[1] > 0.0:
        if not state[SPEED * n + j] >= 0.0:  # Of unknown speed: it has just come into sight.
            return 1.0
        for k in range(n):
            if sight[i * n + k] > 0.0 and state[SPEED * n + k] > state[SPEED * n + j]:
                return 1.0
        return math.exp(parameters[0])
    return math.exp(parameters[0] * quickness(state[SPEED * n + j]))


_MOST_FISH = 12
"""With more than so many tracks nobody is known for long enough to be followed as such."""

_MOST_LED = 8
"""Of so many agents each is tried as the one that is followed."""

_KNOTS_M_S = (0.0, 0.05, 0.1, 0.15, 0.2)


def _attention(seen: Seen) -> Floats:
    return hats(seen.speed_m_s, _KNOTS_M_S)[..., 1:]


def _fastest(seen: Seen) -> Floats:
    chosen = np.zeros(seen.here.shape)
    quick = np.where(seen.attention > 0, seen.speed_m_s, -1.0)
    chosen[np.arange(len(chosen)), quick.argmax(axis=1)] = 1.0
    return chosen[..., None]


def _who(seen: Seen) -> Floats:
    """Return one for each fish but the first, shape (step, other, fish - 1)."""
    fish = np.unique(np.where(seen.is_robot, -1, seen.other))
    fish = fish[fish >= 0]
    if len(fish) > _MOST_FISH:
        return np.zeros((*seen.other.shape, 0))
    return np.asarray((seen.other[..., None] == fish[1:]) & ~seen.is_robot[..., None], float)


_FEATURES: tuple[Feature, ...] = (
    factor_on_attention(_attention),
    factor_on_attention(_fastest, label="the fastest in view"),
    factor_on_attention(_who, label="who"),
)


EFFECT = Effect(
    name="leader-following",
    says="Fish attend more to neighbours that swim fast.",
    opposite="Fish attend more to neighbours that swim slowly.",
    reference="Pettit et al. 2015, Current Biology 25: 3132-3137",
    parameters=(
        EffectParameter(
            name="strength",
            low=-2.0,
            high=2.0,
            default=0.7,
            says="Log of the attention gained per 0.05 m/s that a neighbour is faster than "
            "0.07 m/s.",
        ),
        EffectParameter(
            name="fastest",
            low=0.0,
            high=1.0,
            default=0.0,
            says="1: the fastest of those that are seen gets all of it, as one 0.05 m/s faster.",
        ),
        EffectParameter(
            name="who",
            low=-1.0,
            high=99.0,
            default=-1.0,
            says="Number of the agent that gets all of it, whatever its speed, the first one 0; "
            "-1: nobody in particular.",
        ),
    ),
    probe=0.01,
    sight=sight,
    further_shapes=lambda _arena: (
        {"fastest": 1.0},
        *({"who": float(who)} for who in range(_MOST_LED)),
    ),
    fixed=("fastest", "who"),
    lacks=needs_neighbour,
    features=lambda _arena: _FEATURES,
)

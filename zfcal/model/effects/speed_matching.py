"""Speed matching: a fish swims at its neighbours' speed."""

from __future__ import annotations

from zfcal.model.effects.base import Effect, EffectParameter
from zfcal.model.effects.forms import SPEED_M_S, apart, log_speed, needs_neighbour, times_faster
from zfcal.model.kernels.compiled import hook
from zfcal.model.kernels.hooks import SPEED as SPEED_HOOK
from zfcal.model.kernels.state import SPEED

_LEAST_M = 0.01


@hook(SPEED_HOOK)
def speed(state, sight, n, i, parameters, chance):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Return a power of the mean speed of those that are seen, over the usual speed."""
    total, whole = 0.0, 0.0
    for j in range(n):
        if sight[i * n + j] > 0.0:
            weight = max(_LEAST_M, apart(state, n, i, j)) ** -parameters[1]
            total += weight * state[SPEED * n + j]
            whole += weight
    if not whole > 0.0:
        return 1.0
    return times_faster(parameters[0] * log_speed(total / whole, parameters[2]))


EFFECT = Effect(
    name="speed-matching",
    says="Fish swim fast when the neighbours that they see swim fast.",
    opposite="Fish swim slowly when the neighbours that they see swim fast.",
    reference="Katz et al. 2011, Proceedings of the National Academy of Sciences 108: 18720-18725",
    parameters=(
        EffectParameter(
            name="exponent",
            low=-1.5,
            high=1.5,
            default=0.5,
            says="Power of the neighbours' speed to which the own speed is proportional.",
        ),
        EffectParameter(
            name="focus",
            low=0.0,
            high=6.0,
            default=0.0,
            says="0: all that are seen count alike; the larger, the more the nearest counts.",
        ),
        EffectParameter(
            name="usual_m_s",
            low=0.01,
            high=0.3,
            default=SPEED_M_S,
            says="Neighbours' speed at which a fish swims as it would alone, in m/s.",
        ),
    ),
    strength="exponent",
    probe=0.01,
    speed=speed,
    shapes=lambda _arena: ({"focus": 0.0}, {"focus": 4.0}),
    lacks=needs_neighbour,
    fixed=("focus", "usual_m_s"),
    other_forms=("generic:speed:neighbour-speed",),
)

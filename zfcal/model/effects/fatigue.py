"""Fatigue: speed drifts over the trial."""

from __future__ import annotations

from zfcal.arrays import Floats
from zfcal.model.effects.base import Effect, EffectParameter
from zfcal.model.effects.circumstances import paces_by
from zfcal.model.effects.forms import times_faster
from zfcal.model.kernels.compiled import hook
from zfcal.model.kernels.hats import hats
from zfcal.model.kernels.hooks import SPEED as SPEED_HOOK
from zfcal.model.kernels.state import TIME
from zfcal.model.paces import Pace, Swum


@hook(SPEED_HOOK)
def speed(state, sight, n, i, parameters, chance):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Return an exponential of the time since the moment of the usual speed."""
    return times_faster(-parameters[0] * (state[TIME * n + i] - parameters[1]) / 3600.0)


_TIMES = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)


def _by_time(swum: Swum) -> Floats:
    return hats(swum.time, _TIMES)[:, 1:]


EFFECT = Effect(
    name="fatigue",
    says="Fish get slower in the course of the trial.",
    opposite="Fish get faster in the course of the trial.",
    reference="Wong et al. 2010, Behavioural Brain Research 208: 450-457",
    parameters=(
        EffectParameter(
            name="per_hour",
            low=-30.0,
            high=30.0,
            default=1.5,
            says="Loss of speed, as a log per hour.",
        ),
        EffectParameter(
            name="usual_at_s",
            low=0.0,
            high=1e5,
            default=900.0,
            says="When the speed is as the base model has it, in seconds of the trial.",
        ),
    ),
    strength="per_hour",
    probe=0.02,
    speed=speed,
    fixed=("usual_at_s",),
    per_hour=True,
    shown_against="time",
    paces=(
        Pace(label="speed, by the time", weights=_by_time),
        *paces_by(Pace(label="steadily", weights=lambda swum: swum.time[:, None]), "who"),
    ),
)

"""Cues of the generic family, as scalars and vectors that are at most one long."""

from __future__ import annotations

import math

from zfcal.model.effects.base import EffectParameter
from zfcal.model.effects.forms import Hooked, apart, beyond, cut, quickness
from zfcal.model.kernels.compiled import inlined
from zfcal.model.kernels.state import TIME, X, Y

REFERENCE = "Fortin et al. 2005, Ecology 86: 1320-1330"
"""Step selection: a habitat's cue weighs the steps that an animal could have taken."""

_MOST_QUICK = 2.0


@inlined
def quick(speed_m_s: float) -> float:
    """Return how far a speed is above 0.07 m/s, 1 from 0.17 m/s on, in [-0.7, 1]."""
    return quickness(speed_m_s) / _MOST_QUICK


@inlined
def bearing(state: Hooked, n: int, i: int, j: int) -> tuple[float, float]:
    """Return the unit vector from one agent to another; zero at the same place."""
    away = apart(state, n, i, j)
    if not away > 0.0:
        return 0.0, 0.0
    return (state[X * n + j] - state[X * n + i]) / away, (
        state[Y * n + j] - state[Y * n + i]
    ) / away


@inlined
def too_far(distance_m: float, preferred_m: float, within_m: float) -> float:
    """Return 1 far beyond a preferred distance, -1 far within, 0 at it."""
    return math.tanh((distance_m - preferred_m) / within_m)


@inlined
def toward_place(
    state: Hooked, n: int, i: int, place: tuple[float, float], reach_m: float
) -> tuple[float, float]:
    """Return the vector toward a place: shorter beyond its reach, and close to it."""
    dx, dy = place[0] - state[X * n + i], place[1] - state[Y * n + i]
    away = math.sqrt(dx * dx + dy * dy)
    if not away > 0.0:
        return 0.0, 0.0
    pull = (1.0 - beyond(away, reach_m)) * away / (away + 0.02)
    return pull * dx / away, pull * dy / away


@inlined
def wave(state: Hooked, n: int, i: int, period_s: float, from_s: float) -> float:
    """Return the cosine of a slow wave that is highest at a time and a period later."""
    return math.cos(2.0 * math.pi * (state[TIME * n + i] - from_s) / period_s)


@inlined
def window(state: Hooked, n: int, i: int, when: tuple[float, float, float], soft_s: float) -> float:
    """Return 1 within a window of time that comes back, 0 outside, with soft edges.

    Parameters
    ----------
    when
        Start and length of the window, and from start to start, in seconds.
    """
    from_s, for_s, every_s = when
    since = state[TIME * n + i] - from_s
    since -= every_s * math.floor((since + soft_s) / every_s)
    opened = cut(0.5 + since / soft_s, 0.0, 1.0)
    return opened * cut(0.5 + (for_s - since) / soft_s, 0.0, 1.0)


def number(name: str, bounds: tuple[float, float], default: float, says: str) -> EffectParameter:
    """Return a parameter."""
    return EffectParameter(name=name, low=bounds[0], high=bounds[1], default=default, says=says)


PLACE = (
    number("x_m", (-100.0, 100.0), 0.0, "The place's x, in metres."),
    number("y_m", (-100.0, 100.0), 0.0, "The place's y, in metres."),
)

WHEN = (
    number("from_s", (-1e5, 1e5), 0.0, "When it begins, in seconds of the trial."),
    number("for_s", (1.0, 1e5), 60.0, "How long it lasts, in seconds."),
    number("every_s", (1.0, 1e6), 1e6, "From one beginning to the next, in seconds."),
)

WAVE = (
    number("period_s", (20.0, 1e5), 240.0, "From one crest of the wave to the next, in seconds."),
    number("crest_s", (-1e5, 1e5), 0.0, "When it is strongest, in seconds of the trial."),
)

FIXED = ("from_s", "for_s", "every_s", "period_s", "crest_s", "on")
"""Names of parameters whose likelihood has many hills: a fit would climb the wrong one."""

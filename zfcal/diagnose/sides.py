"""Whether a place is one: fish that are all on one side of it show a direction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from zfcal.diagnose.heats import Heat
from zfcal.diagnose.naming import Refit
from zfcal.diagnose.screening import Screen
from zfcal.model.extended import maximise
from zfcal.model.kernels.state import X, Y

_PLACE, _DIRECTION = "place-preference", "directional-drift"

_ONE_SIDE = 0.8
"""Mean of the unit vectors to a place, weighed by its pull, from which on it lies on one side:
round a place in the tank they add up to little, and to 0.9 over the quarter of a circle that a
corner has."""

_CLEARLY = 1.5
"""Times what a direction gains, from which on a place on one side is one nevertheless."""


def one_sided(refit: Refit) -> float:
    """Return how much one way a place pulls where fish were, from 0 to 1.

    Parameters
    ----------
    refit
        With the place in it: ``x_m``, ``y_m`` and ``reach_m`` of `place-preference`.

    Returns
    -------
    float
        Length of the mean of the unit vectors to the place, weighed by its pull (the mean
        resultant length; Mardia and Jupp 2000, Directional Statistics, section 2.3).
    """
    scene, values = refit.screen.scene, refit.values
    turns = scene.turns
    dx = values["x_m"] - scene.states[turns.at, X, turns.who]
    dy = values["y_m"] - scene.states[turns.at, Y, turns.who]
    away = np.maximum(np.hypot(dx, dy), 1e-9)
    pull = 1.0 / (1.0 + (away / values["reach_m"]) ** 4)
    mean = np.average(np.column_stack([dx / away, dy / away]), axis=0, weights=pull)
    return float(np.hypot(*mean))


def feigned(refits: Sequence[Refit], before: Screen) -> list[Refit]:
    """Return the suspects that are a place and as well a direction.

    A place that is near the edge of where fish were, or reaches far, bends to any direction whose
    strength is not the same all over the tank, and so gains more than the direction itself. Where
    the model has the direction already, a place must gain so much more beside it, and so must one
    that fish are all round: what is weaker in one part of the tank than in another is left over
    there as a place.

    Parameters
    ----------
    refits
        Each in the model by itself.
    before
        The model without any of them.
    """
    places = [each for each in refits if each.name == _PLACE]
    if places and _DIRECTION in before.fitted.parameters.effects:
        needed = (_CLEARLY - 1.0) * _gained(before)
    else:
        places = [each for each in places if one_sided(each) >= _ONE_SIDE]
        needed = _CLEARLY * max((e.nats for e in refits if e.name == _DIRECTION), default=0.0)
    return [each for each in places if each.nats <= needed]


def _gained(screen: Screen) -> float:
    """Return what the direction that is in a model gains there, in nats."""
    fitted, model = screen.fitted, screen.fitted.parameters
    rest = {name: values for name, values in model.effects.items() if name != _DIRECTION}
    free = tuple(pair for pair in fitted.free if pair[0] != _DIRECTION)
    without = maximise(screen.scene, replace(model, effects=rest), free=free, start=fitted.x)
    return fitted.nats - without.nats - (len(fitted.free) - len(free))


def directions(refits: Sequence[Refit], without: Sequence[Refit]) -> list[Refit]:
    """Return the directions among suspects, but for those among some others.

    Where a place is put aside for one, a direction is worth what the place is.
    """
    return [each for each in refits if each.name == _DIRECTION and each not in without]


def with_direction(kept: Sequence[Heat], heats: Sequence[Heat]) -> list[Heat]:
    """Return heats, and the direction's whatever it gained if a place on one side is among them.

    Parameters
    ----------
    kept
        Those that may still win.
    heats
        All of them.
    """
    names = {heat.score.candidate.name for heat in kept}
    places = [heat.first for heat in kept if heat.score.candidate.name == _PLACE]
    if _DIRECTION in names or not any(p is not None and one_sided(p) >= _ONE_SIDE for p in places):
        return list(kept)
    return [*kept, *(heat for heat in heats if heat.score.candidate.name == _DIRECTION)]

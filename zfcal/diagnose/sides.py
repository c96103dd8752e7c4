"""Whether a place is one: fish that are all on one side of it show a direction."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from zfcal.diagnose.naming import Refit
from zfcal.model.kernels.world import X, Y

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


def without_feigned(refits: Sequence[Refit]) -> list[Refit]:
    """Return suspects without a place that is as well a direction.

    A place that is near the edge of where fish were, or reaches far, bends to any direction whose
    strength is not the same all over the tank, and so gains more than the direction itself.

    Parameters
    ----------
    refits
        Each in the model by itself.
    """
    gained = {each.name: each.nats for each in refits}
    needed = _CLEARLY * gained.get(_DIRECTION, 0.0)
    return [
        each
        for each in refits
        if each.name != _PLACE or each.nats > needed or one_sided(each) < _ONE_SIDE
    ]

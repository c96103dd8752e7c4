"""Whether a place is one: fish that are all on one side of it show a direction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from zfcal.diagnose.naming import Refit
from zfcal.diagnose.screening import Screen
from zfcal.model.extended import maximise
from zfcal.model.kernels.state import X, Y

_ONE_SIDE = 0.8
"""Mean of the unit vectors to a place, weighed by its pull, from which on it lies on one side:
round a place in the tank they add up to little, and to 0.9 over the quarter of a circle that a
corner has."""

_CLEARLY = 1.5
"""Times what a direction gains, from which on a place on one side is one nevertheless."""


def one_sided(refit: Refit) -> float:
    """Return how like a direction a place is where fish were, from 0 to 1; 0 for what is none.

    Parameters
    ----------
    refit
        With the place in it.
    """
    like, scene = refit.candidate.effect.looks_like, refit.screen.scene
    if like is None:
        return 0.0
    turns = scene.turns
    return like.share(scene.states[turns.at, :, turns.who][:, [X, Y]], refit.values)


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
    return [each for each in refits if each.looks_like and _is_feigned(each, refits, before)]


def _is_feigned(place: Refit, refits: Sequence[Refit], before: Screen) -> bool:
    name = place.looks_like
    if name in before.fitted.parameters.effects:
        return place.nats <= (_CLEARLY - 1.0) * _gained(before, name)
    direction = max((each.nats for each in refits if each.name == name), default=0.0)
    return one_sided(place) >= _ONE_SIDE and place.nats <= _CLEARLY * direction


def _gained(screen: Screen, direction: str) -> float:
    """Return what the direction that is in a model gains there, in nats."""
    fitted, model = screen.fitted, screen.fitted.parameters
    rest = {name: values for name, values in model.effects.items() if name != direction}
    free = tuple(pair for pair in fitted.free if pair[0] != direction)
    without = maximise(screen.scene, replace(model, effects=rest), free=free, start=fitted.x)
    return fitted.nats - without.nats - (len(fitted.free) - len(free))

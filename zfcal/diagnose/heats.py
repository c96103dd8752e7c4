"""Which suspects are worth a whole fit: all are fitted to some of the minutes first.

A clear recording asks for nearly every effect there is, since each explains a part of
what the right one explains. Most of them are beaten by so much that a quarter of the
steps says so.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

from zfcal.diagnose.heldout import evaluate
from zfcal.diagnose.naming import HEAT_TURNS, Refit, refit, some_of
from zfcal.diagnose.scores import Score
from zfcal.diagnose.screening import Screen
from zfcal.model.scene import Moves, Scene, thin

_FEWEST = 3
_BEATEN = 5.0
"""Standard errors behind the best: that far no further steps bring it back."""


def unbeaten(screen: Screen, scores: Sequence[Score], n_workers: int) -> list[bool]:
    """Return which suspects may still be the one that explains most.

    Parameters
    ----------
    screen
        The model so far.
    scores
        Of the suspects in it, each at the shape that is asked for most.
    n_workers
        Threads.

    Returns
    -------
    list of bool
        True for all where there are too few suspects or steps for a heat.
    """
    share = len(screen.scene.turns) // HEAT_TURNS
    if len(scores) < _FEWEST or share < 2:
        return [True] * len(scores)
    turns, moves = (some_of(screen.scene, steps, share) for steps in _both(screen.scene))
    small = evaluate(screen, thin(screen.scene, turns, moves))

    def fitted(score: Score) -> Refit:
        rows = moves if score.candidate.effect.on_speed else turns
        return refit(small, replace(score, steps=score.steps[rows]))

    with ThreadPoolExecutor(max(1, n_workers)) as pool:
        made = list(pool.map(fitted, scores))
    first = max(made, key=lambda each: each.nats)
    return [each is first or bool(first.over(each) < _BEATEN) for each in made]


def _both(scene: Scene) -> tuple[Moves, Moves]:
    return scene.turns, scene.moves

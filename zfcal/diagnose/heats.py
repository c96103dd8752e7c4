"""Which suspects are worth a whole fit: all are fitted to some of the minutes first.

A clear recording asks for nearly every effect there is, since each explains a part of
what the right one explains. Most of them are beaten by so much that a quarter of the
steps says so.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

from zfcal.diagnose.heldout import evaluate
from zfcal.diagnose.naming import HEAT_TURNS, Refit, refit, some_of
from zfcal.diagnose.scores import Score
from zfcal.diagnose.screening import Screen
from zfcal.model.scene import Moves, Scene, thin

_BEATEN = 5.0
"""Standard errors behind the best: that far no further steps bring it back."""

_BEHIND = 1.0
"""Standard errors behind another at which a suspect that must be ahead in the end is out."""

_SHORT = 1.5
"""Standard errors by which a suspect falls short of what it must gain."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Heat:
    """A suspect, and its fit to some of the steps.

    Parameters
    ----------
    score
        Of the suspect, with all steps.
    first
        It in the model, fitted to every so-many-th block; None where there are too few steps.
    share
        Of so many steps one was fitted.
    """

    score: Score
    first: Refit | None
    share: int = 1

    def gains(self, nats: float) -> bool:
        """Return whether all steps together may gain so much."""
        if self.first is None:
            return True
        gain = self.first.gain
        error = float(gain.std()) * math.sqrt(len(gain))
        return self.share * (self.first.nats + _SHORT * error) > nats


def run_heats(screen: Screen, scores: Sequence[Score], n_workers: int) -> list[Heat]:
    """Return suspects, each fitted to some of the steps.

    Parameters
    ----------
    screen
        The model so far.
    scores
        Of the suspects in it, each at the shape that is asked for most.
    n_workers
        Threads; the numbers do not depend on them.
    """
    share = len(screen.scene.turns) // HEAT_TURNS
    if not scores or share < 2:
        return [Heat(score=score, first=None) for score in scores]
    turns, moves = (some_of(screen.scene, steps, share) for steps in _both(screen.scene))
    small = evaluate(screen, thin(screen.scene, turns, moves))

    def fitted(score: Score) -> Heat:
        rows = moves if score.candidate.effect.on_speed else turns
        first = refit(small, replace(score, steps=score.steps[rows]))
        return Heat(score=score, first=first, share=share)

    with ThreadPoolExecutor(max(1, n_workers)) as pool:
        return list(pool.map(fitted, scores))


def unbeaten(heats: Sequence[Heat]) -> list[Heat]:
    """Return the suspects that may still be the one that explains most."""
    made = [heat.first for heat in heats if heat.first is not None]
    if not made:
        return list(heats)
    best = max(made, key=lambda each: each.nats)
    return [heat for heat in heats if _behind(heat, best) < _BEATEN]


def ahead(heats: Sequence[Heat], of: Sequence[Heat]) -> list[Heat]:
    """Return the suspects that may still turn out to be clearly ahead of all of some others."""
    made = [heat.first for heat in of if heat.first is not None]
    if not made:
        return list(heats)
    best = max(made, key=lambda each: each.nats)
    return [heat for heat in heats if _behind(heat, best) < _BEHIND]


def _behind(heat: Heat, best: Refit) -> float:
    if heat.first is None or heat.first is best:
        return 0.0
    return float(best.over(heat.first))


def _both(scene: Scene) -> tuple[Moves, Moves]:
    return scene.turns, scene.moves

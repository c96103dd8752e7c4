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
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from zfcal.diagnose.candidates import Candidate
from zfcal.diagnose.heldout import evaluate
from zfcal.diagnose.naming import HEAT_TURNS, Refit, refit, some_of
from zfcal.diagnose.scores import Score
from zfcal.diagnose.screening import Screen, ask_all
from zfcal.model.scene import thin

_BEATEN = 5.0
"""Standard errors behind the best: that far no further steps bring it back."""

_BEHIND = 1.0
"""Standard errors behind another at which a suspect that must be ahead in the end is out."""

_SHORT = 1.5
"""Standard errors by which a suspect falls short of what it must gain."""

_HOPE = 2.0
"""Standard errors by which some of the steps may say less than they should."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Sampled:
    """A model, and the same on as many of its steps as a first answer is taken from.

    Parameters
    ----------
    whole
        With all steps.
    """

    whole: Screen

    @property
    def share(self) -> int:
        """Of so many steps one is in the part; 1 where there are too few to leave any out."""
        return max(1, len(self.whole.scene.turns) // HEAT_TURNS)

    @cached_property
    def rows(self) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Which turns and moves are in the part, shape (turn,) and (move,)."""
        scene = self.whole.scene
        return some_of(scene, scene.turns, self.share), some_of(scene, scene.moves, self.share)

    @cached_property
    def part(self) -> Screen:
        """With every so-many-th block, nothing fitted anew."""
        if self.share == 1:
            return self.whole
        return evaluate(self.whole, thin(self.whole.scene, *self.rows))


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


def hopeful(
    sampled: Sampled, candidates: Sequence[Candidate], z: float, n_workers: int
) -> list[Candidate]:
    """Return the candidates that all steps together may ask for so clearly.

    Parameters
    ----------
    sampled
        The model so far.
    candidates
        How individuals differ, and rests, show in all steps alone: they stay.
    z
        Standard errors that are wanted with all steps.
    n_workers
        Threads; the answer does not depend on them.
    """
    least = z / math.sqrt(sampled.share) - _HOPE
    if sampled.share == 1 or least <= 0:
        return list(candidates)
    told = [each for each in candidates if each.effect.in_any_steps]
    scores = ask_all(sampled.part, told, n_workers)
    hopeless = {id(score.candidate) for score in scores if score.clearness <= least}
    return [each for each in candidates if id(each) not in hopeless]


def run_heats(sampled: Sampled, scores: Sequence[Score], n_workers: int) -> list[Heat]:
    """Return suspects, each fitted to some of the steps.

    Parameters
    ----------
    sampled
        The model so far.
    scores
        Of the suspects in it, each at the shape that is asked for most.
    n_workers
        Threads; the numbers do not depend on them.
    """
    if sampled.share == 1 or not scores:
        return [Heat(score=score, first=None) for score in scores]
    part, rows, each = sampled.part, sampled.rows, max(1, n_workers // len(scores))

    def fitted(score: Score) -> Heat:
        steps = score.steps[rows[score.candidate.effect.on_speed]]
        first = refit(part, replace(score, steps=steps), n_workers=each)
        return Heat(score=score, first=first, share=sampled.share)

    with ThreadPoolExecutor(max(1, n_workers)) as pool:
        return list(pool.map(fitted, scores))


def unbeaten(heats: Sequence[Heat]) -> list[Heat]:
    """Return the suspects that may still be the one that explains most."""
    made = [heat.first for heat in heats if heat.first is not None]
    if not made:
        return list(heats)
    best = max(made, key=lambda each: each.worth)
    return [heat for heat in heats if _behind(heat, best) < _BEATEN]


def ahead(heats: Sequence[Heat], of: Sequence[Heat]) -> list[Heat]:
    """Return the suspects that may still turn out to be clearly ahead of all of some others."""
    made = [heat.first for heat in of if heat.first is not None]
    if not made:
        return list(heats)
    best = max(made, key=lambda each: each.worth)
    return [heat for heat in heats if _behind(heat, best) < _BEHIND]


def _behind(heat: Heat, best: Refit) -> float:
    if heat.first is None or heat.first is best:
        return 0.0
    return float(best.over(heat.first))

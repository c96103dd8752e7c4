"""An objective that remembers what it was asked, and the time that this took.

It ends the search that asks: optimisers of all kinds, none of which knows of the others.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from zfcal.calibrate.evolve import overall_score
from zfcal.calibrate.objective import Objective
from zfcal.parameters import n_genes

Floats = NDArray[np.float64]


class EnoughError(Exception):
    """The search has had its evaluations and its seconds."""


class QuietClock:
    """The time that has passed, as if nobody else were at work on the machine.

    The processor time of the main thread, and that of all others divided by how many
    of them can work at the same time. On a quiet machine that is the time on the wall;
    on a shared one it is what that would be.
    """

    def __init__(self, cores: int) -> None:
        self._cores = cores
        self._main_s, self._all_s = time.thread_time(), time.process_time()
        self.elapsed_s = 0.0

    def advance(self, at_once: int) -> None:
        """Add what has passed since the last call, in which so many things ran at once."""
        main_s, all_s = time.thread_time(), time.process_time()
        own_s = main_s - self._main_s
        others_s = max(0.0, all_s - self._all_s - own_s)
        self.elapsed_s += own_s + others_s / min(self._cores, at_once)
        self._main_s, self._all_s = main_s, all_s


@dataclass(slots=True, kw_only=True)
class Recorder:
    """An objective that keeps what it answered and when.

    Parameters
    ----------
    evaluate
        From genes, shape (genome, gene), to features, shape (genome, feature).
    evaluations, seconds
        The search ends when it has had both of them.
    at_most_s
        It ends then in any case.
    clock
        Runs from the start of the search.
    """

    evaluate: Objective
    evaluations: int
    seconds: float
    clock: QuietClock
    at_most_s: float = math.inf
    answers: list[tuple[float, Floats, Floats]] = field(default_factory=list)

    @property
    def n_genes(self) -> int:
        """Length of a genome."""
        return n_genes(len(self.evaluate.group.template.zones))

    def __call__(self, genes: Floats) -> Floats:
        """Return the features of genomes, or end the search."""
        self.clock.advance(at_once=self.evaluate.group.n_workers)
        features = self.evaluate(genes)
        self.clock.advance(at_once=len(genes))
        now = self.clock.elapsed_s
        self.answers.append((now, genes.copy(), features))
        n = sum(len(part) for _, part, _ in self.answers)
        if now > self.at_most_s or (n >= self.evaluations and now > self.seconds):
            raise EnoughError
        return features

    def score(self, genome: Floats) -> float:
        """Return S of one genome, 0 where it is null: what single-objective searches ask."""
        scores = overall_score(self(np.atleast_2d(np.asarray(genome, dtype=np.float64))))
        return float(np.nan_to_num(scores[0], nan=0.0))

    def until(self, *, evaluations: int | None = None, seconds: float = math.inf) -> Outcome:
        """Return what had been answered after so many evaluations or so much time."""
        parts = [part for part in self.answers if part[0] <= seconds] or self.answers[:1]
        genes = np.concatenate([genes for _, genes, _ in parts])[:evaluations]
        features = np.concatenate([features for _, _, features in parts])[:evaluations]
        ends = np.cumsum([len(part) for _, part, _ in parts])
        last = parts[int(np.searchsorted(ends, len(genes)))]
        return Outcome(genes=genes, features=features, seconds=last[0])


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """All genomes that a search had evaluated at some time.

    Parameters
    ----------
    genes : ndarray, shape (genome, gene)
    features : ndarray, shape (genome, feature)
    seconds
        Since it began.
    """

    genes: Floats
    features: Floats
    seconds: float

"""The independent second look: long simulations with new seeds.

The best of a thousand noisy scores is partly luck. Whoever is handed to the robot,
and every score that is reported, comes from here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from zfcal.arrays import Floats
from zfcal.behaviour.scores import Scores
from zfcal.behaviour.statistics import Statistics
from zfcal.calibrate.evolve import State
from zfcal.calibrate.objective import Objective, score_each
from zfcal.errors import InputError


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Confirmed:
    """The best of some genomes by long simulations with seeds of their own.

    Parameters
    ----------
    genes : ndarray, shape (gene,)
        The winner.
    scores
        Its similarities with the window; NaN where every feature is null.
    long_run
        The counts of its simulation, all agents.
    candidates : ndarray, shape (genome,)
        Score of all genomes that were compared, in the order given.
    """

    genes: Floats
    scores: Scores
    long_run: Statistics
    candidates: Floats


def confirm(objective: Objective, genes: Floats) -> Confirmed:
    """Simulate genomes anew and return the one that scores best.

    Parameters
    ----------
    objective
        With long runs and seeds that the search has not seen.
    genes : ndarray, shape (genome, gene)
        At least one; of equals the first wins.
    """
    if len(genes) == 0:
        raise InputError("No genome to confirm: the search has evaluated none.")
    found = objective.simulate(genes)
    scores = score_each(found, objective.control, objective.features)
    candidates = np.array([each.overall for each in scores])
    best = int(np.argmax(np.nan_to_num(candidates, nan=-1.0)))
    return Confirmed(
        genes=genes[best],
        scores=scores[best],
        long_run=found.as_statistics(best, objective.control.zone_names),
        candidates=candidates,
    )


def unconfirmed(evaluation: Objective, long: Objective, population: State) -> Confirmed:
    """Return the best of a population by the search's own score, as the published rig did.

    That score is luck in part: the best of hundreds on one set of random numbers.

    Parameters
    ----------
    evaluation
        What the search maximised; simulated once more, it gives the same score with its parts.
    long
        With long runs, which say what the genome does. They choose nothing.
    population
        The last one of a search.
    """
    best = int(np.argmax(np.nan_to_num(population.scores, nan=-1.0)))
    genes = population.genes[best]
    (scores,) = score_each(
        evaluation.simulate(genes[None, :]), evaluation.control, evaluation.features
    )
    run = long.simulate(genes[None, :]).as_statistics(0, long.control.zone_names)
    return Confirmed(genes=genes, scores=scores, long_run=run, candidates=population.scores)


def best_distinct(genes: Floats, scores: Floats, n: int) -> Floats:
    """Return the ``n`` best different genomes, best first.

    Parameters
    ----------
    genes : ndarray, shape (genome, gene)
        May hold copies.
    scores : ndarray, shape (genome,)
        NaN comes last; of equals the earlier is better.
    n
        How many; fewer where there are not so many different ones.
    """
    order = np.argsort(-np.nan_to_num(scores, nan=-1.0), kind="stable")
    _, first = np.unique(genes[order], axis=0, return_index=True)
    return genes[order][np.sort(first)[:n]]

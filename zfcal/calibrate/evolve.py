"""The evolution of a population of genomes: its state, its objectives, one generation.

The state is plain data, so a run that was stopped goes on as if nothing had
happened. What a genome is worth comes from a callable; the operators are in
``nsga2``; when to stop is decided in ``search``.

DEAP is not used here: it draws from two random streams that belong to the whole
process, and its generation takes 6.4 ms of processor time (3.9 of them the selection
of 60 out of 120) where this one takes 1.0, measured with 18 genes and without the
evaluation.
``evolve_deap`` runs DEAP's operators on the same state.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from zfcal.arrays import Floats, Ints
from zfcal.behaviour.scores import geometric_mean
from zfcal.calibrate.nsga2 import (
    crossover,
    crowding_distances,
    front_ranks,
    mutate,
    survivors,
    tournament,
)
from zfcal.errors import InputError

Evaluate = Callable[[Floats], Floats]
"""From genes, shape (individual, gene), to similarities, shape (individual, feature)."""
Objectives = Callable[[Floats, Floats], Floats]
"""From genes and features to objectives to maximise, shape (individual, objective)."""

GROUP = 4
"""A population is a multiple of this: two tournaments of two make one pair."""


@dataclass(frozen=True, slots=True, kw_only=True)
class State:
    """A population between two generations, best first by crowded rank.

    Parameters
    ----------
    genes : ndarray, shape (individual, gene)
        In [0, 1].
    features : ndarray, shape (individual, feature)
        What the evaluation gave; NaN where a feature is null.
    objectives : ndarray, shape (individual, objective)
        As they stood at the selection, among parents and offspring.
    rank : ndarray of int64, shape (individual,)
        Number of the front, 0 the best.
    crowding : ndarray, shape (individual,)
        Crowding distance within the front.
    generation
        Generations bred so far; 0 for an initial population.
    evaluations
        Genomes evaluated so far.
    rng
        State of the random numbers, as plain data.
    """

    genes: Floats
    features: Floats
    objectives: Floats
    rank: Ints
    crowding: Floats
    generation: int
    evaluations: int
    rng: dict[str, Any]

    @property
    def scores(self) -> Floats:
        """Score of each individual: S, or that of the features named; shape (individual,)."""
        return overall_score(self.features)


def overall_score(features: Floats) -> Floats:
    """Return the geometric mean of the features that are not null; S, of D, W, O and T.

    Parameters
    ----------
    features : ndarray, shape (individual, feature)
        Similarities in [0, 1]; NaN is null.

    Returns
    -------
    ndarray, shape (individual,)
        NaN where every feature is null.
    """
    return geometric_mean(np.ascontiguousarray(features))[0]


def mean_distances(points: Floats, n_among: int | None = None) -> Floats:
    """Return the mean Euclidean distance of each point to the others.

    Parameters
    ----------
    points : ndarray, shape (point, dimension)
        NaN counts as 0, so that a null feature sets nobody apart.
    n_among
        Distances are those to the first so many points; None for all.

    Returns
    -------
    ndarray, shape (point,)
        0 where there is no other point.
    """
    n = len(points) if n_among is None else min(n_among, len(points))
    squares = np.zeros((len(points), n))
    for column in np.nan_to_num(points, nan=0.0).T:
        squares += np.square(column[:, None] - column[None, :n])
    others = n - (np.arange(len(points)) < n)
    return np.asarray(np.sqrt(squares).sum(axis=1) / np.maximum(others, 1))


def score_and_diversities(genes: Floats, features: Floats) -> Floats:
    """Return the published three objectives, all maximised (Cazenille et al.).

    Parameters
    ----------
    genes : ndarray, shape (individual, gene)
    features : ndarray, shape (individual, feature)
        Similarities; NaN is null.

    Returns
    -------
    ndarray, shape (individual, 3)
        The score (0 where it is null), the mean distance of the genome to the others', and
        the mean distance of the features to the others'.
    """
    scores = np.nan_to_num(overall_score(features), nan=0.0)
    return np.column_stack([scores, mean_distances(genes), mean_distances(features)])


def diversities_in(population: int) -> Objectives:
    """Return the same three objectives with distances to the current population alone.

    By the words of Cazenille et al. both diversities are mean distances to the individuals of
    the current population. Where parents and offspring are ranked together, those are the
    parents, which come first.

    Parameters
    ----------
    population
        Individuals of the current population.
    """

    def objectives(genes: Floats, features: Floats) -> Floats:
        scores = np.nan_to_num(overall_score(features), nan=0.0)
        apart = (mean_distances(genes, population), mean_distances(features, population))
        return np.column_stack([scores, *apart])

    return objectives


def begin(
    genes: ArrayLike,
    features: ArrayLike,
    *,
    seed: int | np.random.SeedSequence,
    objectives: Objectives = score_and_diversities,
) -> State:
    """Return the state of an initial population that has been evaluated.

    Parameters
    ----------
    genes : array_like, shape (individual, gene)
        In [0, 1]; a multiple of four individuals.
    features : array_like, shape (individual, feature)
    seed
        All random numbers of the run derive from it.
    objectives
        What is maximised.

    Raises
    ------
    InputError
        The genes are no such table.
    """
    table = np.array(genes, dtype=np.float64)
    _check_genes(table)
    return _rank_population(
        table,
        _checked_features(features, len(table)),
        n=len(table),
        objectives=objectives,
        progress=(0, len(table), np.random.PCG64(seed).state),
    )


def _check_genes(genes: Floats) -> None:
    if genes.ndim != 2 or genes.shape[1] == 0 or len(genes) == 0 or len(genes) % GROUP:
        raise InputError(
            f"A population needs a multiple of {GROUP} genomes, "
            f"got a table of shape {genes.shape}.",
            hint="The published population is 60.",
        )
    if not ((genes >= 0.0) & (genes <= 1.0)).all():
        rows = np.flatnonzero(~((genes >= 0.0) & (genes <= 1.0)).all(axis=1))
        raise InputError(f"Genes must lie in [0, 1], got {genes[rows[0]]} for genome {rows[0]}.")


def _checked_features(features: ArrayLike, n: int) -> Floats:
    values = np.asarray(features, dtype=np.float64)
    if values.ndim != 2 or len(values) != n:
        raise InputError(
            f"An evaluation must give a row of features per genome, shape ({n}, feature), "
            f"got shape {values.shape}."
        )
    return values


def _rank_population(
    genes: Floats,
    features: Floats,
    *,
    n: int,
    objectives: Objectives,
    progress: tuple[int, int, Any],
) -> State:
    """Return the best ``n`` of the individuals, best first by crowded rank.

    Parameters
    ----------
    genes, features : ndarray, shape (individual, ...)
        Parents and offspring together.
    n
        How many are kept.
    objectives
        What is maximised, computed over all of them.
    progress
        Generation, evaluations and random state of the new state.
    """
    values = objectives(genes, features)
    ranks = front_ranks(values)
    crowding = crowding_distances(values, ranks)
    kept = survivors(ranks, crowding, n)
    generation, evaluations, rng = progress
    return State(
        genes=genes[kept],
        features=features[kept],
        objectives=values[kept],
        rank=ranks[kept],
        crowding=crowding[kept],
        generation=generation,
        evaluations=evaluations,
        rng=rng,
    )


def step(state: State, evaluate: Evaluate, objectives: Objectives = score_and_diversities) -> State:
    """Return the population one generation later.

    Parents keep their features: within a round all genomes meet the same random
    numbers, so simulating a parent again would give the same.

    Parameters
    ----------
    state
        Is left as it was.
    evaluate
        Called once, with all offspring.
    objectives
        What is maximised, computed over parents and offspring merged.
    """
    bits = np.random.PCG64(0)
    bits.state = cast("Any", state.rng)
    rng = np.random.Generator(bits)
    parents = state.genes[tournament(state.objectives, state.crowding, rng)]
    offspring = mutate(crossover(parents, rng), rng)
    features = _checked_features(evaluate(offspring), len(offspring))
    return _rank_population(
        np.concatenate([state.genes, offspring]),
        np.concatenate([state.features, features]),
        n=len(state.genes),
        objectives=objectives,
        progress=(state.generation + 1, state.evaluations + len(offspring), bits.state),
    )

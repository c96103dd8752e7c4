"""The operators of NSGA-II on whole arrays: rank, crowding, tournament, crossover, mutation.

All objectives are maximised and all genes lie in [0, 1]. What is measured on an
individual, and the loop over generations, belong in ``evolve``.

References
----------
Deb, Pratap, Agarwal and Meyarivan 2002, "A fast and elitist multiobjective genetic
algorithm: NSGA-II". Deb and Agrawal 1995, "Simulated binary crossover for continuous
search space"; its bounded form, and the polynomial mutation, as in Deb's own program,
which DEAP follows too.
"""

from __future__ import annotations

import numpy as np

from zfcal.arrays import Bools, Floats, Ints
from zfcal.errors import InputError

ETA = 20.0
CROSSOVER_PROBABILITY = 0.9
_GENE_SWAP_PROBABILITY = 0.5

_SAME = 1e-14
"""Genes closer than this are one value: there is nothing to cross."""


def dominance(objectives: Floats) -> Bools:
    """Return which individual dominates which.

    Parameters
    ----------
    objectives : ndarray, shape (individual, objective)
        Maximised; finite.

    Returns
    -------
    ndarray of bool, shape (individual, individual)
        ``[i, j]``: i is nowhere worse than j and somewhere better.

    Raises
    ------
    InputError
        An objective is NaN or infinite; NaN would never be dominated.
    """
    if not np.isfinite(objectives).all():
        rows = np.flatnonzero(~np.isfinite(objectives).all(axis=1))
        raise InputError(
            f"Objectives must be finite, got {objectives[rows[0]]} for individual {rows[0]} "
            f"({rows.size} of {len(objectives)} are not)."
        )
    no_worse = np.ones((len(objectives), len(objectives)), dtype=np.bool_)
    better = np.zeros_like(no_worse)
    for column in objectives.T:
        no_worse &= column[:, None] >= column[None, :]
        better |= column[:, None] > column[None, :]
    return no_worse & better


def front_ranks(objectives: Floats) -> Ints:
    """Return the number of the front of each individual; 0 is not dominated.

    Parameters
    ----------
    objectives : ndarray, shape (individual, objective)
        Maximised; finite.

    Returns
    -------
    ndarray of int64, shape (individual,)
    """
    beats = dominance(objectives)
    better = beats.sum(axis=0)
    ranks = np.full(len(objectives), -1, dtype=np.int64)
    rank = 0
    while (front := (better == 0) & (ranks < 0)).any():
        ranks[front] = rank
        better = better - beats[front].sum(axis=0)
        rank += 1
    return ranks


def crowding_distances(objectives: Floats, ranks: Ints) -> Floats:
    """Return how far each individual's neighbours in its front lie apart.

    Per objective the gap between both neighbours over the front's range, summed and
    divided by the number of objectives; infinite at either end of a front.

    Parameters
    ----------
    objectives : ndarray, shape (individual, objective)
    ranks : ndarray of int64, shape (individual,)
        From `front_ranks`.

    Returns
    -------
    ndarray, shape (individual,)
    """
    total = np.zeros(len(objectives))
    for column in objectives.T:
        order = np.lexsort((column, ranks))
        rank, value = ranks[order], column[order]
        first = np.r_[True, rank[1:] != rank[:-1]]
        last = np.r_[first[1:], True]
        front = np.cumsum(first) - 1
        spread = (value[last] - value[first])[front]
        inner = ~(first | last)
        gap = np.zeros(len(value))
        gap[1:-1] = value[2:] - value[:-2]
        # A front without spread in this objective has ends all the same.
        share = np.divide(gap, spread, out=np.zeros_like(gap), where=inner & (spread > 0))
        total[order] += np.where(inner, share, np.inf)
    return total / objectives.shape[1]


def survivors(ranks: Ints, crowding: Floats, n: int) -> Ints:
    """Return the best ``n`` individuals by crowded rank, best first.

    Parameters
    ----------
    ranks, crowding : ndarray, shape (individual,)
    n
        How many are kept.

    Returns
    -------
    ndarray of int64, shape (n,)
        Indices: lower fronts first, within a front the less crowded first, then as given.
    """
    return np.lexsort((-crowding, ranks))[:n]


def tournament(objectives: Floats, crowding: Floats, rng: np.random.Generator) -> Ints:
    """Return as many parents as there are individuals, in pairs that mate.

    Everybody competes twice, each time in a new random order against the next:
    the one that dominates wins, else the less crowded, else a coin decides.

    Parameters
    ----------
    objectives : ndarray, shape (individual, objective)
        An even number of individuals.
    crowding : ndarray, shape (individual,)
    rng
        Is advanced.

    Returns
    -------
    ndarray of int64, shape (individual,)
        Indices; rows 2 k and 2 k + 1 mate.
    """
    n = len(objectives)
    entrants = np.concatenate([rng.permutation(n), rng.permutation(n)]).reshape(-1, 2)
    a, b = entrants.T
    beats = dominance(objectives)
    coin = rng.random(n) <= 0.5
    by_crowding = np.where(crowding[a] == crowding[b], coin, crowding[a] > crowding[b])
    return np.where(np.where(beats[a, b] | beats[b, a], beats[a, b], by_crowding), a, b)


def crossover(parents: Floats, rng: np.random.Generator, *, eta: float = ETA) -> Floats:
    r"""Return the children of each pair of rows by bounded simulated binary crossover.

    Parameters
    ----------
    parents : ndarray, shape (2 pair, gene)
        Genes in [0, 1]; rows 2 k and 2 k + 1 are a pair.
    rng
        Is advanced.
    eta
        Distribution index: the higher, the nearer children stay to their parents.

    Returns
    -------
    ndarray, shape (2 pair, gene)

    Notes
    -----
    A pair mates with probability 0.9, and then each gene with probability 1/2. With
    :math:`x_1 < x_2`, the room below :math:`\beta = 1 + 2 x_1 / (x_2 - x_1)`,
    :math:`\alpha = 2 - \beta^{-(\eta + 1)}` and u uniform, the lower child is
    :math:`(x_1 + x_2 - \beta_q (x_2 - x_1)) / 2`, where
    :math:`\beta_q^{\eta + 1} = u \alpha` for :math:`u \le 1 / \alpha`, else
    :math:`1 / (2 - u \alpha)`; the upper child likewise, with the same u.
    """
    first, second = parents[0::2], parents[1::2]
    mates = rng.random((len(first), 1)) <= CROSSOVER_PROBABILITY
    crossed = mates & (rng.random(first.shape) <= _GENE_SWAP_PROBABILITY)
    u = rng.random(first.shape)
    swap = rng.random(first.shape) <= 0.5

    low, high = np.minimum(first, second), np.maximum(first, second)
    span = high - low
    crossed &= span > _SAME
    width = np.where(crossed, span, 1.0)
    middle = 0.5 * (low + high)
    lower = np.clip(middle - 0.5 * _spread_factor(low / width, u, eta) * width, 0.0, 1.0)
    upper = np.clip(middle + 0.5 * _spread_factor((1.0 - high) / width, u, eta) * width, 0.0, 1.0)

    children = np.empty_like(parents)
    children[0::2] = np.where(crossed, np.where(swap, upper, lower), first)
    children[1::2] = np.where(crossed, np.where(swap, lower, upper), second)
    return children


def _spread_factor(room: Floats, u: Floats, eta: float) -> Floats:
    """Return beta_q, with the room to the bound in units of the parents' distance."""
    alpha = 2.0 - (1.0 + 2.0 * room) ** -(eta + 1.0)
    inside = u * alpha <= 1.0
    power = np.where(inside, u * alpha, 1.0 / np.where(inside, 1.0, 2.0 - u * alpha))
    return np.asarray(power ** (1.0 / (eta + 1.0)))


def mutate(genes: Floats, rng: np.random.Generator, *, eta: float = ETA) -> Floats:
    r"""Return the genes after bounded polynomial mutation.

    Parameters
    ----------
    genes : ndarray, shape (individual, gene)
        In [0, 1].
    rng
        Is advanced.
    eta
        Distribution index: the higher, the smaller the steps.

    Returns
    -------
    ndarray, shape (individual, gene)

    Notes
    -----
    Each gene mutates with probability 1 / genes, by
    :math:`(2u + (1 - 2u)(1 - x)^{\eta + 1})^{1 / (\eta + 1)} - 1` for u < 1/2, and by
    the mirror image of it (x to 1 - x, u to 1 - u) otherwise.
    """
    chosen = rng.random(genes.shape) <= 1.0 / genes.shape[1]
    u = rng.random(genes.shape)
    down = u < 0.5
    v = np.where(down, u, 1.0 - u)
    far = np.where(down, 1.0 - genes, genes)
    length = 1.0 - (2.0 * v + (1.0 - 2.0 * v) * far ** (eta + 1.0)) ** (1.0 / (eta + 1.0))
    moved = np.clip(genes + np.where(down, -length, length), 0.0, 1.0)
    return np.where(chosen, moved, genes)

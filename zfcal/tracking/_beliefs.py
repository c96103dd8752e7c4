"""What is compiled of telling who is who: chances, and the looks that they are weighed by."""

from __future__ import annotations

import math

import numpy as np

from zfcal.arrays import Floats, Indices
from zfcal.cameras._kernels import kernel


@kernel
def balance(chance: Floats, least: float, rounds: int) -> None:
    """Make rows and columns of a matrix sum to one, in place (Sinkhorn 1964)."""
    n = len(chance)
    for i in range(n):
        for j in range(n):
            chance[i, j] = max(chance[i, j], least)
    for _ in range(rounds):
        for i in range(n):
            chance[i] /= chance[i].sum()
        for j in range(n):
            chance[:, j] /= chance[:, j].sum()


@kernel
def weigh(  # noqa: PLR0913, PLR0917 - a kernel
    chance: Floats,
    rows: Indices,
    seen: Floats,
    n: Floats,
    mean: Floats,
    within: Floats,
    between: Floats,
    weight: float,
    most: float,
) -> None:
    """Let looks speak for identities, in place: a normal law for each, its mean not known exactly.

    Parameters
    ----------
    chance : ndarray, shape (row, identity)
    rows : ndarray, shape (track,)
        Those that are looked at.
    seen : ndarray, shape (track, measure)
    n : ndarray, shape (identity,)
        Sightings of each so far.
    mean : ndarray, shape (identity, measure)
        Of those sightings.
    within, between : ndarray, shape (measure,)
        Variance over time, and of identities.
    weight
        What one look counts.
    most
        By how much one look may speak against an identity, in log odds.
    """
    n_agents = len(n)
    middle = np.zeros(2)
    n_known = 0
    for who in range(n_agents):
        if n[who] > 0:
            middle += mean[who]
            n_known += 1
    if n_known:
        middle /= n_known
    else:
        for k in range(len(rows)):
            middle += seen[k] / len(rows)
    tells = np.empty(n_agents)
    for k in range(len(rows)):
        for who in range(n_agents):
            odd = 0.0
            for axis in range(2):
                sights = n[who] * weight / within[axis]
                sure = 1 / between[axis] + sights
                at = (middle[axis] / between[axis] + sights * mean[who, axis]) / sure
                spread = within[axis] + 1 / sure
                odd += (seen[k, axis] - at) ** 2 / spread + math.log(spread)
            tells[who] = -0.5 * odd
        best = tells.max()
        for who in range(n_agents):
            chance[rows[k], who] *= math.exp(weight * max(tells[who] - best, -most))


@kernel
def learn(  # noqa: PLR0913, PLR0917 - a kernel
    chance: Floats,
    rows: Indices,
    seen: Floats,
    lengths: Floats,
    n: Floats,
    mean: Floats,
    length: Floats,
    within: Floats,
    looks: float,
    limits: tuple[float, float, float],
) -> float:
    """Learn from looks what identities look like, in place; return how many spreads are known from.

    Parameters
    ----------
    chance, rows, seen, n, mean
        As of `weigh`.
    lengths : ndarray, shape (track,)
        One more measure, of which the mean alone is learnt.
    length : ndarray, shape (identity,)
    within : ndarray, shape (measure,)
        Squares summed over looks.
    looks
        How many.
    limits
        The chance from which a look is learnt from, the sightings from which it tells of spread,
        and the sightings that are remembered.
    """
    sure, known, memory = limits
    for k in range(len(rows)):
        who = chance[rows[k]].argmax()
        if chance[rows[k], who] < sure:
            continue
        n[who] += 1
        weight = 1 / min(n[who], memory)
        for axis in range(2):
            away = seen[k, axis] - mean[who, axis]
            if n[who] > known:
                within[axis] += min(away**2, 9 * within[axis] / looks)
            mean[who, axis] += weight * away
        if n[who] > known:
            looks += 1
        length[who] += weight * (lengths[k] - length[who])
    return looks


def prepare() -> None:
    """Compile all, so that no frame has to wait for it."""
    two, rows = np.ones((2, 2)), np.zeros(2, np.intp)
    balance(two.copy(), 0.1, 1)
    weigh(two, rows, two, two[0], two, two[0], two[0], 1.0, 1.0)
    learn(two, rows, two, two[0], two[0], two, two[0], two[0], 1.0, (0.5, 1.0, 1.0))

"""Scores of weights at each step, in one pass where arrays take one for each operation.

Products and sums are those of numpy in its order, so that numbers are the same to the last bit.
"""

from __future__ import annotations

import numpy as np

from zfcal.arrays import Floats
from zfcal.model.kernels.compiled import kernel


@kernel
def write_weighed(
    columns: tuple[Floats, Floats], weights: Floats, made: tuple[Floats, Floats]
) -> None:
    """Write columns of sources, weighed and added up.

    Parameters
    ----------
    columns, made : tuple of ndarray, shapes (step, source) and (step, weight)
        At the heading taken, and integrated.
    weights : ndarray, shape (step, source, weight)
    """
    at, over = made
    for s in range(weights.shape[0]):
        for b in range(weights.shape[2]):
            at[s, b], over[s, b] = 0.0, 0.0
        for j in range(weights.shape[1]):
            for b in range(weights.shape[2]):
                at[s, b] += columns[0][s, j] * weights[s, j, b]
                over[s, b] += columns[1][s, j] * weights[s, j, b]


@kernel
def write_scores(
    added: tuple[Floats, Floats], base: tuple[Floats, Floats], no_lapse: Floats, made: Floats
) -> None:
    """Write the scores of what adds to a mixture.

    Parameters
    ----------
    added, base : tuple of ndarray, shapes (step, weight) and (step, 1)
        What adds to the mixture, and that as it is: at the heading taken, and integrated.
    no_lapse : ndarray, shape (step,)
        Probability of each step that it was no lapse.
    made : ndarray, shape (step, weight)
    """
    for s in range(made.shape[0]):
        for b in range(made.shape[1]):
            change = added[0][s, b] / base[0][s, 0] - added[1][s, b] / base[1][s, 0]
            made[s, b] = no_lapse[s] * change


@kernel
def write_slopes(at: Floats, over: Floats, by_top: Floats, by_whole: Floats, made: Floats) -> None:
    """Write how log densities change by the strengths of columns, as the first ones there.

    Parameters
    ----------
    at, over : ndarray, shape (step, column)
    by_top, by_whole : ndarray, shape (step,)
        Changes by what the columns add at the heading taken, and to the integral.
    made : ndarray, shape (step, column or more)
    """
    for s in range(at.shape[0]):
        for c in range(at.shape[1]):
            made[s, c] = by_top[s] * at[s, c] - by_whole[s] * over[s, c]


@kernel
def write_tried(  # noqa: PLR0913, PLR0917 - a kernel
    here: Floats, base: tuple[Floats, Floats], added: tuple[Floats, Floats],
    share: float, uniform: Floats, made: Floats,
) -> None:  # fmt: skip
    """Write the densities of steps with a share of one more component.

    Parameters
    ----------
    here : ndarray, shape (step,)
        Attraction of where it landed, times that it was no lapse.
    base, added : tuple of ndarray, shape (step,)
        At the heading taken, and integrated.
    share
        Of what is added.
    uniform : ndarray, shape (step,)
        Density of lapses.
    made : ndarray, shape (step,)
    """
    for s in range(here.size):
        top = here[s] * (base[0][s] + share * added[0][s])
        made[s] = top / (base[1][s] + share * added[1][s]) + uniform[s]


@kernel
def add_up(columns: Floats, sums: Floats) -> None:
    """Add columns of shape (step, column) to sums, one step after the other."""
    for s in range(columns.shape[0]):
        for c in range(columns.shape[1]):
            sums[c] += columns[s, c]


@kernel
def add_squares(columns: Floats, sums: Floats) -> None:
    """Add the squares of columns likewise."""
    for s in range(columns.shape[0]):
        for c in range(columns.shape[1]):
            sums[c] += columns[s, c] * columns[s, c]


def sums_of(columns: Floats) -> Floats:
    """Return the sums of columns of shape (step, column), as numpy does, which takes longer."""
    if columns.shape[1] == 1:  # Which numpy adds up in pairs.
        return np.asarray(columns.sum(axis=0))
    made = np.zeros(columns.shape[1])
    add_up(np.ascontiguousarray(columns), made)
    return made


def lengths_of(columns: Floats) -> Floats:
    """Return the lengths of columns of shape (step, column), likewise."""
    if columns.shape[1] == 1:
        return np.asarray(np.linalg.norm(columns, axis=0))
    made = np.zeros(columns.shape[1])
    add_squares(np.ascontiguousarray(columns), made)
    return np.sqrt(made)


def weighed(columns: tuple[Floats, Floats], weights: Floats) -> tuple[Floats, Floats]:
    """Return columns of sources, weighed and added up, shape (step, weight).

    Parameters
    ----------
    columns
        Of each source, shape (step, source).
    weights : ndarray, shape (step, source, weight)
    """
    if columns[0].shape != weights.shape[:2]:  # Which compiled code would not notice.
        raise ValueError(f"Weights {weights.shape} are of other sources than {columns[0].shape}.")
    at, over = np.empty((2, len(weights), weights.shape[2]))
    write_weighed(columns, np.ascontiguousarray(weights), (at, over))
    return at, over

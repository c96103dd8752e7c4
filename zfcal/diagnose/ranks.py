r"""Headings and speeds as ranks in what the model expected of each.

The probability integral transform of a step, :math:`u = F(\theta \mid c)`, is uniform and
independent of all that came before when the model is right (Smith 1985, Journal of
Forecasting 4: 283-291); within a cell of headings it is drawn at random (Brockwell 2007,
Statistics and Probability Letters 77: 1473-1478). Since a heading has no natural beginning,
it is ranked in several orders: each asks another question.
"""

from __future__ import annotations

import numpy as np

from zfcal.arrays import Floats
from zfcal.diagnose.kernels import cell_ranks
from zfcal.diagnose.surroundings import Surroundings
from zfcal.model.scene import Moves, Turns

DEGREES = 2
"""Legendre polynomials of a rank that are taken: one for the place, one for the spread."""


def heading_ranks(
    turns: Turns, about: Surroundings, probability: Floats, rng: np.random.Generator
) -> dict[str, Floats]:
    """Return the ranks of headings in several orders, each of shape (turn,).

    NaN where an order has nothing to count from, such as a neighbour.

    Parameters
    ----------
    probability : ndarray, shape (turn, cell)
        Of each cell of headings under the model.
    rng
        Where in its cell a heading is taken to be.
    """
    east = np.broadcast_to(np.array([1.0, 0.0]), turns.taken.shape)
    orders = {
        "turn": (about.heading, False),
        "turn size": (about.heading, True),
        "angle to the nearest neighbour": (about.toward_near, True),
        "angle to the wall": (about.from_wall, True),
        "angle to the sense along the wall": (about.along_wall, True),
        "angle to the x axis": (east, True),
        "angle to the y axis": (east[:, ::-1], True),
    }
    lot = rng.random(len(turns))
    found = {}
    for name, (axis, folded) in orders.items():
        ranks = np.empty(len(turns))
        cell_ranks(probability, turns.taken, np.ascontiguousarray(axis), folded, lot, ranks)
        found[name] = np.where((axis**2).sum(axis=1) > 0, ranks, np.nan)
    return found


def speed_ranks(moves: Moves, factor: Floats, rng: np.random.Generator) -> Floats:
    """Return the ranks of speeds among those that begin in the same zone, shape (move,).

    Parameters
    ----------
    factor : ndarray, shape (move,)
        By which the model's effects multiply a speed that was drawn.
    rng
        Orders equal speeds.
    """
    speed = moves.speed_m_s / np.maximum(factor, 1e-6)
    # Quantised positions give equal speeds: a hair of noise orders them.
    speed = speed * (1 + 1e-9 * rng.random(len(moves))) + 1e-12 * rng.random(len(moves))
    ranks = np.empty(len(moves))
    for zone in np.unique(moves.zone):
        rows = np.flatnonzero(moves.zone == zone)
        ranks[rows[np.argsort(speed[rows], kind="stable")]] = (np.arange(len(rows)) + 0.5) / len(
            rows
        )
    return ranks


def scores_of(ranks: Floats) -> Floats:
    """Return Legendre polynomials of ranks, with mean 0 and variance 1, shape (step, DEGREES).

    They are the components of Neyman's smooth test of uniformity (1937, Skandinavisk
    Aktuarietidskrift 20: 149-199).
    """
    return np.stack(
        [np.sqrt(3.0) * (2 * ranks - 1), np.sqrt(5.0) * (6 * ranks * (ranks - 1) + 1)], axis=1
    )

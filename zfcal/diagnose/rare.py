"""What is rare and tells much: headings that a model hardly expects, and runs of like speeds.

A hundredth of all steps that turn where the model puts hardly any probability leave means and
spreads as they are. The score of a small component about a direction counts each heading by
one over its density; it is bounded here, so that a few lapses of the tracker do not decide.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.special import bdtr, bdtrc

from zfcal.diagnose.chances import LEAST_IN_BIN, normal_of_tail, rare_by_context
from zfcal.diagnose.contexts import contexts
from zfcal.diagnose.kernels import rare_headings
from zfcal.diagnose.ranks import speed_ranks
from zfcal.diagnose.standing import Standing

_FLOOR = 0.03
_CONTEXTS = (
    "zone",
    "minute",
    "nearest neighbour's distance",
    "nearest neighbour's bearing",
    "agent",
)
TAIL = 0.1
"""Share of the speeds of a zone that count as fast, and as slow."""


def rare_statistics(standing: Standing) -> dict[str, float]:
    """Return how headings that the model hardly expects lie about some directions."""
    turns, about = standing.scene.turns, standing.turns
    east = np.broadcast_to(np.array([1.0, 0.0]), turns.taken.shape)
    ways = {
        "the nearest neighbour": about.toward_near,
        "the neighbours' heading": about.company_heading,
        "the robot": about.toward_robot,
        "the way from the wall": about.from_wall,
        "the sense along the wall": about.along_wall,
        "the heading before": about.heading,
        "the way out": about.toward_exit,
        "the x axis": east,
        "the y axis": east[:, ::-1],
    }
    axis = np.stack(list(ways.values()), axis=1)
    names = [f"{sign} {way}" for way in ways for sign in ("along", "against")]
    residual = np.empty((len(axis), len(names)))
    variance = np.empty_like(residual)
    rare_headings(standing.probability, turns.taken, axis, _FLOOR, residual, variance)
    unused = ~standing.fitted.used
    residual[unused], variance[unused] = np.nan, np.nan
    found = contexts(standing.scene, turns, about)
    sorted_by = {"": np.zeros(len(turns), dtype=np.int64)}
    sorted_by |= {f" by {context}": found[context] for context in _CONTEXTS}
    table = {
        context: rare_by_context(residual, variance, bins, 1 / _FLOOR)
        for context, bins in sorted_by.items()
    }
    return {
        f"rare headings {name}{context}": by_column[column]
        for column, name in enumerate(names)
        for context, by_column in table.items()
    }


def run_statistics(standing: Standing, rng: np.random.Generator) -> dict[str, float]:
    """Return how often a fast step follows two, and a slow one two slow ones.

    In the model speeds are drawn anew at each step: after two fast steps, one's own or the
    nearest neighbour's, the number of fast ones is binomial.

    Parameters
    ----------
    rng
        Orders equal speeds.
    """
    scene, moves = standing.scene, standing.scene.moves
    ranks = speed_ranks(moves, standing.speed_factor, rng)
    near = standing.moves.near
    table = np.full((len(scene.k) + 2, scene.states.shape[2]), np.nan)
    track = np.full(table.shape, -1, dtype=np.int64)
    table[moves.at + 2, moves.who], track[moves.at + 2, moves.who] = ranks, moves.track
    made = {}
    for name, size in (("fast", 1 - table), ("slow", table)):
        low = size < TAIL
        now = low[moves.at + 2, moves.who]
        for whose, column in (("own", moves.who), ("the nearest neighbour's", near)):
            one, two = (low[moves.at + 2 - lag, column] & (column >= 0) for lag in (1, 2))
            same = track[moves.at + 1, column] == track[moves.at, column]
            if whose == "own":
                same &= track[moves.at + 1, column] == moves.track
            made[f"{name} after {whose} two {name} steps"] = _excess(now[one & two & same])
            made[f"{name} after {whose} {name} step"] = _excess(now[one])
    return made


def _excess(hits: NDArray[np.bool_]) -> float:
    """Return a number of hits among so many trials as a normal number, by the middle p."""
    n, k = len(hits), int(hits.sum())
    if n < LEAST_IN_BIN:
        return math.nan
    above = float(bdtrc(k, n, TAIL))
    equal = float(bdtr(k, n, TAIL) - (bdtr(k - 1, n, TAIL) if k else 0.0))
    return normal_of_tail(above + equal / 2)

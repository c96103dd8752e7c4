"""Where a log likelihood is highest, by the scores of single steps."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeAlias

import numpy as np
from scipy.linalg import solve_triangular
from scipy.optimize import lsq_linear
from scipy.special import logit

from zfcal.arrays import Floats
from zfcal.model.extended import LAPSE

_CLIMBS = 100
_NOTHING = 0.01
"""Nats: a step of a search that promises less is the last one."""

_PART = 1e-3
"""Share of what a step promises that it has to gain."""

_RIDGE = 1e-9
"""Added to the squares of scores of length one: columns may be sums of each other."""

Bounds: TypeAlias = tuple[float | None, float | None]
Objective: TypeAlias = Callable[[Floats], tuple[float, Callable[[], Floats]]]
"""Of strengths: a log likelihood, and what gives its derivatives, shape (step, strength)."""


def climb(objective: Objective, x0: Floats, bounds: Sequence[Bounds]) -> Floats:
    """Return where a log likelihood is highest; the last of its arguments is the lapse.

    The squares of the scores of single steps stand for the curvature, so that a step of the search
    is a least squares problem with bounds (Berndt et al. 1974, Annals of Economic and Social
    Measurement 3: 653-665).

    Parameters
    ----------
    objective
        The log likelihood, and what gives the scores of single steps.
    x0
        Where the search begins.
    bounds
        Of all arguments but the lapse.

    Returns
    -------
    ndarray, shape (strength,)
    """
    all_ = [*bounds, (float(logit(LAPSE[0])), float(logit(LAPSE[1])))]
    low = np.array([-np.inf if pair[0] is None else pair[0] for pair in all_])
    high = np.array([np.inf if pair[1] is None else pair[1] for pair in all_])
    x = np.clip(x0, low, high)
    value, scores_of = objective(x)
    for _ in range(_CLIMBS):
        scores = scores_of()
        step = _step_of(scores, low - x, high - x)
        promised = float(scores.sum(axis=0) @ step)
        share = 1.0
        while promised * share > _NOTHING:
            tried = np.clip(x + share * step, low, high)
            reached, their_scores = objective(tried)
            if reached > value + _PART * share * promised:
                break
            share /= 2
        else:
            break
        x, value, scores_of = tried, reached, their_scores
    return x


def _step_of(scores: Floats, low: Floats, high: Floats) -> Floats:
    """Return the change that sets the scores of single steps nearest to one, within bounds."""
    size = np.maximum(np.linalg.norm(scores, axis=0), 1e-300)
    square = (scores / size).T @ (scores / size) + _RIDGE * np.eye(len(size))
    root = np.linalg.cholesky(square)
    toward = solve_triangular(root, scores.sum(axis=0) / size, lower=True)
    found = lsq_linear(root.T, toward, (low * size, high * size), method="bvls", tol=1e-8)
    return np.asarray(found.x / size)

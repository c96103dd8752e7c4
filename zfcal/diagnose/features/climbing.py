"""Where a log likelihood is highest, by the scores of single steps."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from scipy.linalg import solve_triangular
from scipy.optimize import lsq_linear
from scipy.special import logit

from zfcal.arrays import Floats
from zfcal.diagnose.features.lapses import Lapses
from zfcal.diagnose.features.score_kernels import sums_of
from zfcal.model.extended import LAPSE

_CLIMBS = 100
_NOTHING = 0.01
"""Nats: a step of a search that promises less is the last one."""

_PART = 1e-3
"""Share of what a step promises that it has to gain."""

_RIDGE = 1e-9
"""Added to the squares of scores of length one: columns may be sums of each other."""

_IDLE = 1e-30
"""Sum of the squares of scores of an argument that no step asks for: the rest is rounding."""

_AT_END = 1e-6
_SIDES = 1.96
"""Standard errors to either side of a 95 % interval."""

Bounds: TypeAlias = tuple[float | None, float | None]
Objective: TypeAlias = Callable[[Floats], tuple[float, Callable[[], Floats]]]
"""Of strengths: a log likelihood, and what gives its derivatives, shape (step, strength)."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Peak:
    """Where a log likelihood is highest.

    Parameters
    ----------
    x : ndarray, shape (argument,)
        There.
    scores : ndarray, shape (step, argument)
        Derivatives of the log density of each step.
    low, high : ndarray, shape (argument,)
        Bounds.
    """

    x: Floats
    scores: Floats
    low: Floats
    high: Floats

    def interval(self) -> Floats:
        """Return the 95 % interval of each argument, shape (argument, 2).

        The squares of single steps' scores stand for the curvature. One at a bound has the range in
        which the likelihood falls by 1.92 nats, the others being fitted again.
        """
        size = np.maximum(np.linalg.norm(self.scores, axis=0), 1e-300)
        units = self.scores / size
        square, slope = units.T @ units + _RIDGE * np.eye(len(size)), units.sum(axis=0)
        near = _AT_END * np.maximum(np.abs(self.x), 1.0)
        at_high = self.high - self.x <= near
        free = ~(at_high | (self.x - self.low <= near))
        inner = np.linalg.inv(square[np.ix_(free, free)])
        half = np.zeros(len(self.x))
        half[free] = _SIDES * np.sqrt(np.diag(inner))
        for k in np.flatnonzero(~free):
            beside = square[k, free]
            curved = max(float(square[k, k] - beside @ inner @ beside), _RIDGE)
            falls = max(float(slope[k] if at_high[k] else -slope[k]), 0.0)
            half[k] = (math.sqrt(falls**2 + _SIDES**2 * curved) - falls) / curved
        half /= size
        return np.column_stack(
            [np.maximum(self.x - half, self.low), np.minimum(self.x + half, self.high)]
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class Fit:
    """A feature at the maximum.

    Parameters
    ----------
    log_p : ndarray, shape (step,)
        What it adds to the log densities; without a feature these themselves.
    peak
        Of the search, whose last arguments but the lapses are the feature's strengths.
    n
        How many these are.
    n_lapses
        How many arguments after them are lapses.
    scale : ndarray, shape (argument,)
        What the search's arguments are divided by.
    factor : ndarray
        Of a tilt its vectors, shape (step, 2); of leaving its logs, shape (step,); of landing the
        strengths of all its weights. Else empty.
    """

    log_p: Floats
    peak: Peak
    n: int
    n_lapses: int
    scale: Floats
    factor: Floats

    @property
    def strengths(self) -> Floats:
        """Of the feature, shape (strength,)."""
        return self.x[self._own]

    @property
    def _own(self) -> slice:
        end = len(self.peak.x) - self.n_lapses
        return slice(end - self.n, end)

    @property
    def x(self) -> Floats:
        """Strengths of all that was fitted, and the lapses."""
        return self.peak.x / self.scale

    @property
    def interval(self) -> Floats:
        """95 % of each strength, shape (strength, 2)."""
        with np.errstate(over="ignore"):  # Of a strength that no step asks for nothing is known.
            return (self.peak.interval() / self.scale[:, None])[self._own]


def climb(objective: Objective, x0: Floats, bounds: Sequence[Bounds]) -> Peak:
    """Return where a log likelihood is highest; the last of its arguments are lapses.

    Parameters
    ----------
    objective
        The log likelihood, and what gives the scores of single steps.
    x0
        Where the search begins.
    bounds
        Of all arguments but the lapses.
    """
    lapse = (float(logit(LAPSE[0])), float(logit(LAPSE[1])))
    return climb_within(objective, x0, [*bounds, *[lapse] * (len(x0) - len(bounds))])


def lapses_alone(lapses: Lapses, density: Floats) -> Floats:
    """Return the logits of lapses that are most likely where all else stays, shape (zone,).

    Parameters
    ----------
    lapses
        Of a law.
    density : ndarray, shape (step,)
        Without them.
    """

    def objective(levels: Floats) -> tuple[float, Callable[[], Floats]]:
        value, _, slopes = lapses.mixed(density, levels)
        return value, lambda: slopes

    return climb(objective, lapses.start, []).x


def climb_within(objective: Objective, x0: Floats, bounds: Sequence[Bounds]) -> Peak:
    """Return where a log likelihood is highest.

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
        Of all arguments.
    """
    low = np.array([-np.inf if pair[0] is None else pair[0] for pair in bounds])
    high = np.array([np.inf if pair[1] is None else pair[1] for pair in bounds])
    x = np.clip(x0, low, high)
    value, scores_of = objective(x)
    for _ in range(_CLIMBS):
        scores = scores_of()
        slope = sums_of(scores)
        step = _step_of(scores, slope, low - x, high - x)
        promised = float(slope @ step)
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
    else:
        scores = scores_of()
    return Peak(x=x, scores=scores, low=low, high=high)


def scaled(pair: Bounds, scale: float) -> Bounds:
    """Return bounds of an argument that is multiplied by a number above 0."""
    low, high = (None if end is None else end * scale for end in pair)
    return low, high


def _step_of(scores: Floats, slope: Floats, low: Floats, high: Floats) -> Floats:
    """Return the change that sets the scores of single steps nearest to one, within bounds."""
    gram = scores.T @ scores
    squares = np.diag(gram)
    # What no step asks for stays as it is: in units of next to nothing rounding would move it.
    size = np.sqrt(np.where(squares > _IDLE, squares, 1.0))
    square = gram / size / size[:, None] + _RIDGE * np.eye(len(size))
    root = np.linalg.cholesky(square)
    toward = solve_triangular(root, slope / size, lower=True)
    found = lsq_linear(root.T, toward, (low * size, high * size), method="bvls", tol=1e-8)
    return np.asarray(found.x / size)

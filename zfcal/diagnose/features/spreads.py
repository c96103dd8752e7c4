"""How normal scores of speeds are spread, and what features add to that.

A few slow steps among many change the mean of speeds by next to nothing, and so do speeds that a
fish keeps in some of its steps. So the law of scores is taken as it is, for each fish: from the
scores themselves. A feature multiplies it by an exponential family of the score (Efron and
Tibshirani 1996, Annals of Statistics 24: 2431-2461), or adds a component about a certain one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d
from scipy.stats import norm

from zfcal.arrays import Floats
from zfcal.diagnose.features.climbing import climb_within
from zfcal.model.kernels.hats import hats

_GRID = np.linspace(-5.0, 5.0, 51)
"""Scores at which laws are known; between them they are linear."""

_SORTS = (-2.0, -1.0, 0.0, 1.0, 2.0)
"""Scores of very slow, slow, middling, fast and very fast steps."""

_MIDDLING = 2
"""Of these: the others change beside them."""

_ABOUT = 0.25
"""Standard deviation of scores that are drawn about a certain one: about a centimetre a second."""

_SMOOTH = 1.0
"""Of the law of scores that a component is compared with, in steps of the grid."""

_SPARE = 1e-4
"""Density of scores that nobody had."""

_MOST = 3.0
_MOST_SHARE = 0.95
_LEAST = 0.02


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Drawn:
    """What a feature adds to the law of scores, at its maximum.

    Parameters
    ----------
    log_p : ndarray, shape (step,)
        Log density that it adds.
    expected : ndarray, shape (step,)
        What it would add in the mean if scores were drawn from it.
    n_strengths
        That were fitted.
    log_more : ndarray, shape (step, grid)
        The log of its factor on the law of each step.
    """

    log_p: Floats
    expected: Floats
    n_strengths: int
    log_more: Floats


@dataclass(frozen=True, kw_only=True, eq=False)
class Spreads:
    """The law of the scores of some steps, each fish with one of its own.

    Parameters
    ----------
    scores : ndarray, shape (step,)
    who : ndarray of int, shape (step,)
        Whose law it is, from 0 on.
    log_more : ndarray, shape (step, grid), optional
        The log of a factor of what is there already.
    """

    scores: Floats
    who: NDArray[np.intp]
    log_more: Floats | None = None

    @cached_property
    def _at(self) -> tuple[NDArray[np.intp], Floats]:
        """Place of each score on the grid: the point before it, and the share of the next one."""
        place = np.clip((self.scores - _GRID[0]) / (_GRID[1] - _GRID[0]), 0, len(_GRID) - 1)
        low = np.minimum(place.astype(np.intp), len(_GRID) - 2)
        return low, place - low

    def _here(self, values: Floats) -> Floats:
        """Return values on the grid, shape (step, grid), at the scores."""
        (low, share), rows = self._at, np.arange(len(self.scores))
        return np.asarray((1 - share) * values[rows, low] + share * values[rows, low + 1])

    @cached_property
    def _counts(self) -> Floats:
        """Scores of each fish at the points of the grid, shape (fish, grid)."""
        low, share = self._at
        n, width = int(self.who.max(initial=-1)) + 1, len(_GRID)
        made = np.bincount(self.who * width + low, 1 - share, n * width)
        made += np.bincount(self.who * width + low + 1, share, n * width)
        return np.asarray(made.reshape(n, width))

    def _law(self, counts: Floats) -> Floats:
        """Return the law of each step at the points of the grid, shape (step, grid)."""
        made = (counts / np.maximum(counts.sum(axis=1, keepdims=True), 1e-9))[self.who]
        if self.log_more is not None:
            made = made * np.exp(self.log_more)
            made = made / made.sum(axis=1, keepdims=True)
        return made

    def spread(self, columns: Floats) -> Drawn:
        """Return what a factor adds that differs between slow and fast scores.

        Parameters
        ----------
        columns : ndarray, shape (step, column)
            What it goes by; their mean is nothing.
        """
        kept = [k for k in range(len(_SORTS)) if k != _MIDDLING]
        sorts, own = (hats(values, _SORTS)[:, kept] for values in (_GRID, self.scores))
        law = self._law(self._counts)
        n = columns.shape[1]

        def bent(x: Floats) -> tuple[Floats, Floats]:
            """Return the weights of sorts, and those of the law that they bend."""
            ways = columns @ x.reshape(n, len(kept))
            return ways, law * np.exp(ways @ sorts.T)

        def objective(x: Floats) -> tuple[float, Callable[[], Floats]]:
            ways, weights = bent(x)
            whole = weights.sum(axis=1)
            value = float(((ways * own).sum(axis=1) - np.log(whole)).sum())

            def scores() -> Floats:
                apart = own - weights @ sorts / whole[:, None]
                return np.asarray(np.einsum("sn,sk->snk", columns, apart).reshape(len(own), -1))

            return value, scores

        bounds = [(-_MOST, _MOST)] * (n * len(kept))
        peak = climb_within(objective, np.zeros(len(bounds)), bounds)
        ways, weights = bent(peak.x)
        log_whole = np.log(weights.sum(axis=1))
        return Drawn(
            log_p=(ways * own).sum(axis=1) - log_whole,
            expected=(ways * (weights @ sorts)).sum(axis=1) / np.exp(log_whole) - log_whole,
            n_strengths=len(bounds),
            log_more=ways @ sorts.T - log_whole[:, None],
        )

    def copied(self, about: Floats, weights: Floats) -> Drawn:
        """Return what components about certain scores add.

        Parameters
        ----------
        about : ndarray, shape (step, source)
            These scores; NaN where there is none.
        weights : ndarray, shape (step, source, weight)
        """
        smooth = gaussian_filter1d(self._counts, _SMOOTH, axis=1)
        law = self._law(smooth + _SPARE * smooth.sum(axis=1, keepdims=True))
        density = law / (_GRID[1] - _GRID[0])
        here = self._here(density)
        known = np.isfinite(about)
        more = norm.pdf(self.scores[:, None], np.where(known, about, 0.0), _ABOUT) / here[:, None]
        columns = np.einsum("sj,sjb->sb", np.where(known, more - 1, 0.0), weights)
        is_asked = (columns != 0).any(axis=0)
        columns, weights = columns[:, is_asked], weights[..., is_asked]
        n = columns.shape[1]

        def objective(x: Floats) -> tuple[float, Callable[[], Floats]]:
            factor = np.maximum(1 + columns @ x, _LEAST)
            return float(np.log(factor).sum()), lambda: columns / factor[:, None]

        peak = climb_within(objective, np.zeros(n), [(0.0, _MOST_SHARE / max(n, 1))] * n)
        shares = np.where(known, weights @ peak.x, 0.0)
        factors = np.ones_like(density) - shares.sum(axis=1)[:, None]
        for own, share in zip(about.T, shares.T, strict=True):
            bell = norm.pdf(_GRID, np.where(share > 0, own, 0.0)[:, None], _ABOUT)
            factors += share[:, None] * bell / density
        factors = np.maximum(factors, _LEAST)
        log_more = np.log(factors)
        drawn = law * factors
        return Drawn(
            log_p=np.log(np.maximum(1 + columns @ peak.x, _LEAST)),
            expected=(drawn * log_more).sum(axis=1) / drawn.sum(axis=1),
            n_strengths=n,
            log_more=log_more,
        )

    def beside(self, drawn: Drawn) -> Spreads:
        """Return the law in which what a feature adds is there."""
        more = drawn.log_more if self.log_more is None else self.log_more + drawn.log_more
        return replace(self, log_more=more)

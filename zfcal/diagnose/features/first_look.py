"""A first look at features, which says what each may gain before any is fitted.

By the scores of their weights where these have no strength (Rao 1948, Proceedings of the Cambridge
Philosophical Society 44: 50-57), and what is fitted with them is at its maximum.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import orth
from scipy.optimize import nnls

from zfcal.arrays import Floats
from zfcal.diagnose.features.columns import Columns
from zfcal.diagnose.features.lapses import UNIFORM
from zfcal.diagnose.features.law import Law
from zfcal.diagnose.features.score_kernels import (
    lengths_of,
    sums_of,
    write_scores,
    write_tried,
)
from zfcal.diagnose.features.ways import ways_of, ways_of_cells
from zfcal.model.features import Choosable, Landing, Leaving, OneOf, Tilt, Turned

_TRIED = (0.005, 0.02, 0.06)
"""Strengths of a component at which it is first asked for."""

LOOKED_AT = 10
"""Of more than twice as many features these are looked at in all steps."""

ONE_IN = 4
"""The others in one of so many steps."""

_NEXT_TO_NOTHING = 1e-6
"""Share of a score's length that is rounding: columns may be sums of what is fitted with them."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Null:
    """A law's mixture where what is fitted with every feature is at its maximum.

    The law of noisy positions has that elsewhere than the model, which was fitted to the measured
    ones: there its lapses take the headings that a component would explain.

    Parameters
    ----------
    base : tuple of ndarray, shape (step, 1)
        At the heading taken, and integrated.
    changing : tuple of ndarray, shape (step, 1)
        That, infinite where it is at a floor: there it does not change by what is added.
    lapse : ndarray, shape (step,)
        Share of lapses.
    """

    base: Columns
    changing: Columns
    lapse: Floats

    def take(self, rows: NDArray[np.intp]) -> Null:
        """Return that of some steps."""
        base, changing = ((at[rows], over[rows]) for at, over in (self.base, self.changing))
        return Null(base=base, changing=changing, lapse=self.lapse[rows])


@dataclass(frozen=True, kw_only=True, eq=False)
class FirstLook:
    """A first look at features of a law.

    Parameters
    ----------
    law
        Of the steps.
    null
        Its mixture before any feature is there.
    own
        Columns that are fitted with every feature.
    landing_scores
        Scores of features of landing, shape (step, weight).
    leaving_scores
        Of features of leaving, given the probability of each step that it was none; and of what is
        fitted beside them.
    one_in
        Of so many steps each of the law's is one.
    """

    law: Law
    null: Null
    own: Sequence[Columns]
    landing_scores: Callable[[Landing], Floats]
    leaving_scores: Callable[[Leaving, Floats], tuple[Floats, Floats]]
    one_in: int = 1

    @property
    def prepared(self) -> tuple[object, ...]:
        """What all features need, worked out before they are asked side by side."""
        return self._no_lapse, self._mean_heading, self._own_basis, self._untried

    def nats(self, feature: Choosable) -> float:
        """Return about how many nats a feature gains beyond what it has to, less its strengths.

        The density of one more component has no variance where that of the base is next to
        nothing, so it is asked for by what a few strengths of it gain, all else as it is.
        """
        if feature.over is None or isinstance(feature, Landing):
            return self._nats(feature)
        if feature.over not in self._commons:
            self._commons[feature.over] = self._nats(feature.over)
        return self._nats(feature) - self._commons[feature.over]

    @cached_property
    def _commons(self) -> dict[Choosable, float]:
        """Nats of what has to be gained more than, by feature: several share one."""
        return {}

    def _nats(self, feature: Choosable) -> float:
        """Return what is gained less the strengths, of all steps if these are a few of them.

        Idle strengths gain half a nat each, of however many steps (Wilks 1938).
        """
        gained, n = self._gained(feature)
        return self.one_in * (gained - n / 2) - n / 2

    def _gained(self, feature: Choosable) -> tuple[float, int]:
        """Return about how many nats a feature gains of these steps, and its strengths."""
        if isinstance(feature, Landing):
            return _gained_by(self.landing_scores(feature))
        if isinstance(feature, Leaving):
            scores, beside = self.leaving_scores(feature, self._no_lapse)
            return _gained_by(off(scores, basis_of(beside)))
        if isinstance(feature, Tilt):
            taken = ways_of(self.law.turns.taken, axial=feature.axial)
            apart = self._no_lapse[:, None] * (taken - self._mean_heading[int(feature.axial)])
            vectors = feature.vectors(self.law.draws[0].seen)
            return _gained_by(np.einsum("sbd,sd->sb", vectors, apart), low=feature.low)
        if isinstance(feature, Turned):
            scores = self._scores_of(self.law.turned(feature))
            return _gained_by(off(scores, self._own_basis), low=feature.low)
        columns = self.law.component(feature, first=True)
        if feature.low >= 0 and not feature.instead:
            return self._gained_tried(columns)
        scores = off(self._scores_of(columns), self._own_basis)
        return _gained_by(scores, low=feature.low, high=feature.high)

    def _scores_of(self, columns: Columns) -> Floats:
        """Return the scores of what adds to the mixture, shape (step, weight)."""
        made = np.empty(columns[0].shape)
        write_scores(columns, self.null.changing, self._no_lapse_at_null, made)
        return made

    @cached_property
    def _own_basis(self) -> Floats:
        """Orthonormal columns with the span of the scores of what is fitted with every feature."""
        return basis_of(np.concatenate([self._scores_of(columns) for columns in self.own], axis=1))

    def _gained_tried(self, columns: Columns) -> tuple[float, int]:
        """Return what a few strengths of a component gain: of all weights alike, or of each.

        Their scores have no variance where the density is next to nothing.
        """
        at, over = columns
        alike = self._best_tried(at.sum(axis=1), over.sum(axis=1))
        each = (self._best_tried(*pair) for pair in zip(at.T.copy(), over.T.copy(), strict=True))
        return max(alike, sum(max(nats, 0.0) for nats in each)), at.shape[1]

    def _best_tried(self, at: Floats, over: Floats) -> float:
        base_at, base_over = self.null.base
        base, added = (base_at[:, 0], base_over[:, 0]), (at, over)
        density, uniform = np.empty(len(at)), self.null.lapse * UNIFORM
        gains = []
        for share in _TRIED:
            write_tried(self._here, base, added, share, uniform, density)
            gains.append(float(np.log(density).sum()))
        return max(gains) - self._untried

    @cached_property
    def _here(self) -> Floats:
        """Attraction of where each step landed, times that it was no lapse, shape (step,)."""
        return np.asarray((1 - self.null.lapse) * np.exp(self.law.log_here))

    @cached_property
    def _at_null(self) -> Floats:
        """Density of each step without a feature, times that it was no lapse, shape (step,)."""
        base_at, base_over = self.null.base
        return np.asarray(self._here * (base_at / base_over)[:, 0])

    @cached_property
    def _untried(self) -> float:
        """Log likelihood without a feature."""
        return float(np.log(self._at_null + self.null.lapse * UNIFORM).sum())

    @cached_property
    def _no_lapse_at_null(self) -> Floats:
        """Probability of each step that it was none, shape (step,)."""
        return np.asarray(self._at_null / (self._at_null + self.null.lapse * UNIFORM))

    @cached_property
    def _no_lapse(self) -> Floats:
        """That by the law as it is, which factors on headings are fitted to."""
        (base_at, base_over), lapse = self.law.base, self.law.lapses.likely
        density = (1 - lapse) * np.exp(self.law.log_here) * (base_at / base_over)[:, 0]
        return np.asarray(density / (density + lapse * UNIFORM))

    @cached_property
    def _mean_heading(self) -> tuple[Floats, Floats]:
        """Mean headings under the law, and those of twice their angle, shapes (step, 2)."""
        chances = self.law.cells / self.law.cells.sum(axis=1, keepdims=True)
        return chances @ ways_of_cells(), chances @ ways_of_cells(axial=True)


def has_many(choice: OneOf) -> bool:
    """Return whether some of these are looked at in a few steps alone."""
    return len(choice.features) > 2 * LOOKED_AT


def best_of(
    look: FirstLook, choice: OneOf, among: Sequence[int], *, least: float = -math.inf
) -> list[int]:
    """Return the places of features that promise more than something, those that do most first.

    Parameters
    ----------
    look
        At the steps.
    choice
        The features.
    among
        Places of those that are looked at.
    least
        In nats.
    """
    promise = {k: look.nats(choice.features[k]) for k in among}
    some = [k for k in among if promise[k] > least]
    return sorted(some, key=lambda k: (promise[k], k), reverse=True)


def thinned(law: Law, one_in: int) -> tuple[Law, NDArray[np.intp]]:
    """Return the law of some steps, by one draw of where all were, and which steps these are.

    They are chosen by chance, always the same ones: every fourth one would be of one fish in four.

    Parameters
    ----------
    law
        Of all steps.
    one_in
        One of so many is chosen.
    """
    kept = np.flatnonzero(np.random.default_rng(one_in).random(len(law.rows)) < 1 / one_in)
    made = replace(
        law,
        n_draws=1,
        bent=law.bent and (law.bent[0][kept], law.bent[1][kept]),
        leaving=tuple((zone, log_factor[kept]) for zone, log_factor in law.leaving),
    )
    made.__dict__.update(rows=law.rows[kept])
    return made, kept


def basis_of(scores: Floats) -> Floats:
    """Return orthonormal columns with the span of others, shape (step, column)."""
    size = np.linalg.norm(scores, axis=0)
    return np.asarray(orth(scores[:, size > 0] / size[size > 0], rcond=_NEXT_TO_NOTHING))


def off(scores: Floats, basis: Floats) -> Floats:
    """Return scores less what is fitted with them, shape (step, weight).

    Those of which nothing but rounding is left are zeros: they are sums of what is there.

    Parameters
    ----------
    scores : ndarray, shape (step, weight)
    basis : ndarray, shape (step, column)
        Orthonormal.
    """
    left = scores - basis @ (basis.T @ scores)
    left[:, lengths_of(left) <= _NEXT_TO_NOTHING * lengths_of(scores)] = 0.0
    return left


def _gained_by(
    scores: Floats, *, low: float | None = None, high: float | None = None
) -> tuple[float, int]:
    """Return about how many nats weights gain by their scores, and their number.

    The log likelihood is taken as quadratic where no weight has a strength. It has its maximum at
    strengths that may have one sign alone, if they are bounded by zero.

    Parameters
    ----------
    scores : ndarray, shape (step, weight)
        Of these, less what is fitted with them.
    low, high
        Bounds of the strengths.
    """
    n, size = scores.shape[1], lengths_of(scores)
    some = np.isfinite(size) & (size > 0)
    if not some.any():
        return 0.0, n
    units = (scores if some.all() else scores[:, some]) / size[some]
    values, ways = np.linalg.eigh(units.T @ units)
    kept = values > _NEXT_TO_NOTHING * values[-1]
    root = np.sqrt(values[kept])
    square, aim = root[:, None] * ways[:, kept].T, ways[:, kept].T @ sums_of(units) / root
    missed = 0.0
    if low is not None and low >= 0:
        missed = float(nnls(square, aim)[1])
    elif high is not None and high <= 0:
        missed = float(nnls(-square, aim)[1])
    return float(aim @ aim - missed**2) / 2, n

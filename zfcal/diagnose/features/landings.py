"""Steps that end near something: what a preference for that adds to the law.

A tilt toward a thing has no edge. Fish may like to be within a band along a wall, or in a spot:
then headings that land there are likelier than those that land beside it, in the few steps that
could do either. So the factor is on where a heading lands, by how far that is from the thing.

A fish has a body, and its middle keeps off every wall: that is no preference for a place. What all
walls have in common is fitted first, and a landing is what there is beyond it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from zfcal.arena import Arena
from zfcal.arrays import Floats
from zfcal.diagnose.features.climbing import Fit, climb, lapses_alone
from zfcal.diagnose.features.columns import Columns
from zfcal.diagnose.features.landing_kernels import (
    expected_hats,
    hat_sums,
    places_among,
    wall_distances,
)
from zfcal.diagnose.features.lapses import UNIFORM
from zfcal.diagnose.features.law import Law
from zfcal.diagnose.features.ways import ways_of, ways_of_cells
from zfcal.diagnose.selection import LEVEL
from zfcal.model.features import Landing, Seen, Tilt
from zfcal.model.kernels.hats import hats
from zfcal.model.kernels.state import X, Y

_MOST = 6.0

_OFF_WALLS_M = (0.0, 0.01, 0.02, 0.03, 0.04, 0.05, 0.07, 0.1)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Near:
    """The steps that may end near a thing, and the weights of where they would.

    Parameters
    ----------
    rows : ndarray of int, shape (row,)
        Of these steps, among those of the law.
    places : ndarray, shape (row, cell)
        Where the distance of each cell's end from the thing lies among the knots.
    taken : ndarray, shape (row, weight)
    """

    rows: NDArray[np.intp]
    places: Floats
    taken: Floats

    def log_factors(self, strengths: Floats) -> Floats:
        """Return the log of the factor on each cell, shape (row, cell)."""
        made = np.empty(self.places.shape)
        hat_sums(self.places, np.append(strengths, [0.0, 0.0]), made)
        return made

    def expected(self, chances: Floats, rows: NDArray[np.intp]) -> Floats:
        """Return the mean weights, shape (row, weight).

        Parameters
        ----------
        chances : ndarray, shape (step, cell)
            Of each cell.
        rows : ndarray of int, shape (row,)
            Where these steps are among those of the chances.
        """
        made = np.empty(self.taken.shape)
        expected_hats(chances, rows, self.places, made)
        return made


@dataclass(frozen=True, kw_only=True, eq=False)
class Landings:
    """Fits of features of landing to the steps of a law.

    Parameters
    ----------
    law
        Of the steps.
    walls
        Log of what all walls have in common, on each cell and at the heading taken; None where
        that is nothing.
    """

    law: Law
    walls: Columns | None = None

    def beyond_walls(self) -> Landings:
        """Return fits beside what all walls have in common, if that gains more than chance."""
        walls = _at_any_wall(self.law.scene.arena)
        fit = self.fit(walls)
        if chdtrc(len(fit.strengths), 2 * max(float(fit.log_p.sum()), 0.0)) > LEVEL:
            return self
        made = replace(self, walls=self.bent(walls, fit))
        made.__dict__.update(_ends=self._ends, _places=self._places)
        return made

    @cached_property
    def _cells(self) -> Floats:
        cells = self.law.cells
        return cells if self.walls is None else np.asarray(cells * np.exp(self.walls[0]))

    @cached_property
    def chances(self) -> Floats:
        """The law of each step on cells of headings, shape (step, cell)."""
        return np.asarray(self._cells / self._cells.sum(axis=1, keepdims=True))

    @property
    def prepared(self) -> tuple[Floats, ...]:
        """What all features need, worked out before they are asked side by side."""
        return self.chances, self._at, self._ends

    @cached_property
    def _at(self) -> Floats:
        """Density of the heading taken, shape (step,)."""
        law = self.law
        here = law.log_here if self.walls is None else law.log_here + self.walls[1]
        return np.asarray(np.exp(here) * law.base[0][:, 0] / self._cells.sum(axis=1))

    @cached_property
    def _places(self) -> tuple[Floats, Floats]:
        """Where each step begins, and how far it goes, shapes (step, 2) and (step,)."""
        law = self.law
        turns = law.turns
        return law.scene.states[turns.at, :, turns.who][:, [X, Y]], (
            turns.speed_m_s * law.scene.dt_s
        )

    @cached_property
    def _ends(self) -> Floats:
        """Where the heading of each cell would lead, shape (step, cell, 2)."""
        xy, reach = self._places
        return np.asarray(xy[:, None] + reach[:, None, None] * ways_of_cells())

    def _near(self, feature: Landing) -> _Near:
        """Return the steps that may end near what a feature is about."""
        seen, (xy, reach) = self.law.draws[0].seen, self._places
        every = np.arange(len(reach))
        away = feature.away_m(seen, every, xy[:, None])[:, 0]
        rows = np.flatnonzero(away - reach < feature.knots_m[-1])
        ended = xy[rows, None] + reach[rows, None, None] * self.law.turns.taken[rows, None]
        away, away_taken = (feature.away_m(seen, rows, at) for at in (self._ends[rows], ended))
        places = np.empty(away.shape)
        places_among(np.ascontiguousarray(away), np.array(feature.knots_m), places)
        return _Near(rows=rows, places=places, taken=hats(away_taken, feature.knots_m)[:, 0, :-1])

    def scores(self, feature: Landing) -> Floats:
        """Return the scores of a feature's weights where none has a strength, shape (row, weight).

        Of the steps alone that may end near what it is about.
        """
        near = self._near(feature)
        own, lapse = self._at[near.rows], self.law.lapses.likely[near.rows]
        share = (1 - lapse) * own / ((1 - lapse) * own + lapse * UNIFORM)
        return np.asarray(share[:, None] * (near.taken - near.expected(self.chances, near.rows)))

    def fit(self, feature: Landing) -> Fit:
        """Return a feature at the maximum, and what it adds to each step."""
        near = self._near(feature)
        chances, taken = self.chances[near.rows], near.taken
        every = np.arange(len(near.rows))
        n, lapses = taken.shape[1], self.law.lapses

        def density(x: Floats) -> tuple[Floats, Floats]:
            bent = near.log_factors(x[:n])
            np.multiply(chances, np.exp(bent, out=bent), out=bent)
            whole = bent.sum(axis=1)
            found = self._at.copy()
            found[near.rows] *= np.exp(taken @ x[:n]) / whole
            return found, np.divide(bent, whole[:, None], out=bent)

        def objective(x: Floats) -> tuple[float, Callable[[], Floats]]:
            found, bent = density(x)
            value, share, slopes = lapses.mixed(found, x[n:])

            def scores() -> Floats:
                made = np.zeros((len(found), len(x)))
                apart = taken - near.expected(bent, every)
                made[near.rows, :n] = share[near.rows, None] * apart
                made[:, n:] = slopes
                return made

            return value, scores

        nothing = lapses_alone(lapses, self._at)
        peak = climb(objective, np.append(np.zeros(n), nothing), [(-_MOST, _MOST)] * n)
        log_p = lapses.log_mixed(density(peak.x)[0], peak.x[n:])
        return Fit(
            log_p=log_p - lapses.log_mixed(self._at, nothing),
            peak=peak,
            n=n,
            n_lapses=len(nothing),
            scale=np.ones(1),
            factor=peak.x[:n],
        )

    def bent(self, feature: Landing, fit: Fit) -> tuple[Floats, Floats]:
        """Return the log of the factor on each cell, and at the heading taken.

        Parameters
        ----------
        feature
            Of landing.
        fit
            Of it.
        """
        near = self._near(feature)
        cells, taken = np.zeros(self.chances.shape), np.zeros(len(self.chances))
        cells[near.rows] = near.log_factors(fit.factor)
        taken[near.rows] = near.taken @ fit.factor
        return cells, taken


def _at_any_wall(arena: Arena) -> Landing:
    """Return landings by how far they are from the nearest wall."""

    def away_m(_seen: Seen, _rows: NDArray[np.intp], xy_m: Floats) -> Floats:
        away = np.empty(xy_m.shape[:-1])
        flat = np.ascontiguousarray(xy_m).reshape(-1, 2)
        wall_distances(flat, arena.segments_m, away.reshape(-1))
        return away

    return Landing(label="landing at any wall", away_m=away_m, knots_m=_OFF_WALLS_M)


def leaned(law: Law, feature: Tilt, vectors: Floats) -> tuple[Floats, Floats]:
    """Return the log of the factor of a tilt on each cell, and at the heading taken.

    Parameters
    ----------
    law
        Of the steps.
    feature
        The tilt.
    vectors : ndarray, shape (step, 2)
        Of it, all its weights together.
    """
    taken = ways_of(law.turns.taken, axial=feature.axial)
    return vectors @ ways_of_cells(axial=feature.axial).T, (vectors * taken).sum(axis=1)

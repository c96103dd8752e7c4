"""Intervals of a zone's parameters by profile likelihood.

An interval holds the values at which the likelihood, all other parameters of the zone at their best
for that value, is below its maximum by no more than chance (Venzon and Moolgavkar 1988, Applied
Statistics 37: 87-94). It needs no symmetry and no scale of the parameter, and it ends at a bound
only where the bound itself is likely enough.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from zfcal.arrays import Floats
from zfcal.model.fitted import ZoneTurns, zone_scores
from zfcal.model.views import View

_MOST_VALUES = 8
"""Values of a parameter at which its profile is looked at, on each side."""

_MOST_STEPS = 12
"""Steps uphill at each of them."""

_ENOUGH_NATS = 0.005
_CLOSE = 0.02
"""Of the wanted depth, in standard normal units."""

_RIDGE = 1e-8
_NOTHING = 1e-9
_SHARES = (0.1, 0.9)
"""Of the stretch that holds an end: the next value to look at is no nearer to either side."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Profile:
    """The likelihood of one zone's turns about its maximum.

    Parameters
    ----------
    x : ndarray, shape (4 + zone,)
        The maximum, as `zfcal.model.fitted.zone_scores` takes it.
    low, high : ndarray, shape (4 + zone,)
        Within which parameters are looked for, finite; equal where one is fixed.
    told : ndarray of bool, shape (zone,)
        Zones of whose gamma the turns tell.
    turns
        The zone's.
    view
        Of all turns of the scene.
    n_workers
        Threads; the numbers do not depend on them.
    """

    x: Floats
    low: Floats
    high: Floats
    told: NDArray[np.bool_]
    turns: ZoneTurns
    view: View
    n_workers: int = 1

    def interval(self, of: Floats, depth: float) -> tuple[float, float]:
        """Return the interval of a weighted sum of the parameters.

        Parameters
        ----------
        of : ndarray, shape (4 + zone,)
            The weights: a single one for a parameter, one and minus one for a difference.
        depth
            In standard normal units: 1.96 for 95 %.
        """
        return -self._end(-of, depth), self._end(of, depth)

    def _end(self, of: Floats, depth: float) -> float:
        """Return the upper end; the bound where the likelihood does not fall far enough."""
        most = float(np.where(of > 0, of * self.high, of * self.low).sum())
        best, at = float(of @ self.x), self.x
        top, scores = self._at(at)
        inner, outer = (best, 0.0), (most, math.inf)
        value = best + depth * self._error(of, scores)
        for _ in range(_MOST_VALUES):
            value = min(value, most)
            at, nats = self._best(at, of, value)
            fallen = math.sqrt(max(0.0, 2 * (top - nats)))
            if abs(fallen - depth) < _CLOSE or (fallen < depth and value >= most):
                break
            inner, outer = ((value, fallen), outer) if fallen < depth else (inner, (value, fallen))
            value = _next(inner, outer, best, depth)
        return value

    def _best(self, start: Floats, of: Floats, value: float) -> tuple[Floats, float]:
        """Return where the likelihood is highest while a sum is held, and the nats there."""
        x = self._held(start, of, value)
        nats, scores = self._at(x)
        for _ in range(_MOST_STEPS):
            by, promise = self._uphill(x, scores, of)
            length, gain = 1.0, 0.0
            while length * promise > _ENOUGH_NATS:
                there = self._held(x + length * by, of, value)
                nats_there, scores_there = self._at(there)
                if nats_there > nats:
                    gain = nats_there - nats
                    x, nats, scores = there, nats_there, scores_there
                    break
                length /= 3
            if gain < _ENOUGH_NATS:
                break
        return x, nats

    def _uphill(self, x: Floats, scores: Floats, of: Floats) -> tuple[Floats, float]:
        """Return the way uphill that leaves a sum as it is, and the nats that it promises."""
        slope, information = scores.sum(axis=0), scores.T @ scores
        free = self.high > self.low
        by = np.zeros_like(x)
        for _ in range(x.size):
            by = _step_across(slope, information, of, free)
            beyond = ((x <= self.low) & (by < 0)) | ((x >= self.high) & (by > 0))
            if not beyond.any():
                break
            free &= ~beyond
        return by, 0.5 * float(slope @ by)

    def _held(self, x: Floats, of: Floats, value: float) -> Floats:
        """Return the point within the bounds beside another one at which a sum has a value."""
        x = np.clip(x, self.low, self.high)
        for _ in range(x.size):
            missing = value - float(of @ x)
            room = (of != 0) & np.where(of * missing > 0, x < self.high, x > self.low)
            if abs(missing) < _NOTHING or not room.any():
                break
            by = np.where(room, of, 0.0) * missing / (of[room] ** 2).sum()
            x = np.clip(x + by, self.low, self.high)
        return x

    def _error(self, of: Floats, scores: Floats) -> float:
        """Return the standard error of a sum, by outer products; huge where nothing tells."""
        free = self.high > self.low
        inner = (scores.T @ scores)[np.ix_(free, free)] + _NOTHING * np.eye(int(free.sum()))
        return math.sqrt(float(of[free] @ linalg.solve(inner, of[free], assume_a="pos")))

    def _at(self, x: Floats) -> tuple[float, Floats]:
        log_p, scores, _ = zone_scores(x, self.turns, self.view, n_workers=self.n_workers)
        return float(log_p.sum()), scores


def profile_about(
    x: Floats, turns: ZoneTurns, view: View, limits: tuple[Floats, Floats], *, n_workers: int = 1
) -> Profile:
    """Return the likelihood of a zone's turns about its maximum.

    Parameters
    ----------
    x : ndarray, shape (4 + zone,)
        The maximum.
    turns
        The zone's.
    view
        Of all turns of the scene.
    limits : tuple of ndarray, shape (4 + zone,)
        Within which the maximum was looked for.
    n_workers
        Threads.
    """
    low, high = (ends.copy() for ends in limits)
    scores = zone_scores(x, turns, view, n_workers=n_workers)[1][:, 3:-1]
    told = np.square(scores).sum(axis=0) > _NOTHING
    fixed = ~told
    if told.any():
        # The scale of a row is free: one of its gammas may stand still, wherever it is.
        fixed[np.argmax(np.where(told, x[3:-1], -np.inf))] = True
    least = low[3:-1].copy()
    low[3:-1], high[3:-1] = np.where(fixed, x[3:-1], least), np.where(fixed, x[3:-1], -least)
    return Profile(x=x, low=low, high=high, told=told, turns=turns, view=view, n_workers=n_workers)


def _step_across(slope: Floats, information: Floats, of: Floats, free: NDArray[np.bool_]) -> Floats:
    """Return the step to the maximum of a parabola among those that leave a sum as it is."""
    by = np.zeros_like(slope)
    if not free.any():
        return by
    inner = information[np.ix_(free, free)]
    ridge = _RIDGE * np.diag(inner).mean() + _NOTHING
    solved = linalg.cho_factor(inner + ridge * np.eye(len(inner)))
    uphill, held = linalg.cho_solve(solved, slope[free]), of[free]
    if held.any():
        across = linalg.cho_solve(solved, held)
        uphill -= across * (held @ uphill) / (held @ across)
    by[free] = uphill
    return by


def _next(
    inner: tuple[float, float], outer: tuple[float, float], best: float, depth: float
) -> float:
    """Return the next value to look at: the root of the likelihood's fall is nearly straight."""
    (near, fallen), (far, fallen_there) = inner, outer
    if math.isinf(fallen_there):
        # Nothing beyond is known yet: at most three times as far from the maximum.
        return min(best + (near - best) * min(depth / max(fallen, _NOTHING), 3.0), far)
    share = (depth - fallen) / (fallen_there - fallen)
    return near + min(max(share, _SHARES[0]), _SHARES[1]) * (far - near)

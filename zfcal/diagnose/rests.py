"""Fish that stop now and then: a chain of swimming and resting, seen through their speeds.

A step too short for a heading is a rest, or a draw that happens to be short; a longer one is
none. What lies behind is a Markov chain, so its rate and duration are at their maximum
likelihood by the forward recursion (Zucchini, MacDonald and Langrock 2016, Hidden Markov
Models for Time Series, chapter 2). Since a fish that moves does not rest, all that counts of
the past is for how many steps it has been still.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import linalg, optimize, special

from zfcal.arrays import Bools, Floats, Ints
from zfcal.diagnose.screening import Screen

_LONGEST = 30
"""Steps at rest after which one more says nothing new."""

_SURE = 1e-6
_DIFFERENCE = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Chain:
    """A fish that swims or rests; its steps by the time that it has been still.

    Parameters
    ----------
    begins, stays
        Chance that a step is at rest after one that was not, and after one that was.
    at_first
        Chance that a fish that was still when its track began was at rest, before that is seen.
    short : ndarray, shape (zone,)
        Share of drawn steps that are too short to be told from a rest.
    """

    begins: float
    stays: float
    at_first: float
    short: Floats

    def still(self) -> Floats:
        """Return the chance that a step is still, shape (2, steps still before, zone).

        First where the past is known back to a step that was not still, then where it began
        while the fish was still.
        """
        resting = np.zeros((2, len(self.short)))
        chance = np.empty((2, _LONGEST + 1, len(self.short)))
        for steps in range(_LONGEST + 1):
            rest = self.begins + (self.stays - self.begins) * resting
            if steps == 0:
                rest[1] = self.at_first
            chance[:, steps] = rest + (1 - rest) * self.short
            resting = rest / chance[:, steps]
        return chance


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Runs:
    """For how long fish have been still before each of their steps.

    Parameters
    ----------
    open_ : ndarray of int64, shape (move,)
        1 where the fish was still since its track began, else 0.
    length : ndarray of int64, shape (move,)
        Steps still before.
    zone : ndarray of int64, shape (move,)
        From 0.
    now : ndarray of bool, shape (move,)
        Whether the step is still.
    n_zones
        Zones of the arena.
    """

    open_: Ints
    length: Ints
    zone: Ints
    now: Bools
    n_zones: int

    def counts(self, rows: Bools) -> Floats:
        """Return how many of some steps there are, shape (2, steps still before, zone, now)."""
        counts = np.zeros((2, _LONGEST + 1, self.n_zones, 2))
        at = (self.open_[rows], self.length[rows], self.zone[rows], self.now[rows].astype(int))
        np.add.at(counts, at, 1.0)
        return counts

    def still_chance(self, chain: Chain) -> Floats:
        """Return the chance that each step had to be still, given those before, shape (move,)."""
        return np.asarray(chain.still()[self.open_, self.length, self.zone])

    def log_chance(self, chain: Chain) -> Floats:
        """Return the log of the chance that each step had to be as it was, shape (move,)."""
        still = self.still_chance(chain)
        return np.asarray(np.log(np.where(self.now, still, 1 - still)))


def runs_of(screen: Screen) -> Runs:
    """Return the runs of a recording's moves."""
    moves, (now, before) = screen.scene.moves, screen.still
    order = np.lexsort((moves.at, moves.who))
    at, who, track = moves.at[order], moves.who[order], moves.track[order]
    here = np.arange(len(order))
    new = np.ones(len(order), dtype=bool)
    new[1:] = (np.diff(at) != 1) | (np.diff(who) != 0) | (np.diff(track) != 0)
    began = np.maximum.accumulate(np.where(new, here, 0))
    swam = np.maximum.accumulate(np.where(before[order], -1, here))
    known = swam >= began
    length, open_ = np.empty(len(order), dtype=np.int64), np.empty(len(order), dtype=np.int64)
    length[order] = np.minimum(np.where(known, here - swam, here - began + 1), _LONGEST)
    open_[order] = ~known
    return Runs(
        open_=open_, length=length, zone=moves.zone - 1, now=now,
        n_zones=len(screen.scene.arena.zones),
    )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ChainFit:
    """A chain at its maximum likelihood.

    Parameters
    ----------
    chain
        The chain.
    alike
        The same without rests: each zone has its share of still steps.
    errors
        Standard errors of the logits of ``begins`` and ``stays``; infinite where the steps
        say nothing.
    """

    chain: Chain
    alike: Chain
    errors: tuple[float, float]


def fit_chain(counts: Floats, limits: tuple[tuple[float, float], tuple[float, float]]) -> ChainFit:
    """Return the chain that fits best.

    Parameters
    ----------
    counts : ndarray, shape (2, steps still before, zone, now)
        As `Runs.counts` gives them.
    limits
        Of ``begins`` and ``stays``.
    """
    by_zone = counts.sum(axis=(0, 1))
    alike = np.clip(by_zone[:, 1] / np.maximum(by_zone.sum(axis=1), 1.0), _SURE, 1 - _SURE)
    bounds = np.array([special.logit(limit) for limit in limits])
    rest = np.tile(special.logit([_SURE, 1 - _SURE]), (1 + len(alike), 1))
    bounds = np.concatenate([bounds, rest])

    def lacks(x: Floats) -> float:
        still = _chain(x).still()
        logs = counts[..., 1] * np.log(still) + counts[..., 0] * np.log1p(-still)
        return -float(logs.sum())

    start = np.clip(_start(counts, alike), *bounds.T)
    best = optimize.minimize(
        lacks, start, method="L-BFGS-B", bounds=optimize.Bounds(*bounds.T), options={"ftol": 1e-10}
    )
    errors = _errors(lacks, np.asarray(best.x), bounds)
    return ChainFit(
        chain=_chain(best.x),
        alike=Chain(begins=0.0, stays=0.5, at_first=0.0, short=alike),
        errors=(float(errors[0]), float(errors[1])),
    )


def _chain(x: Floats) -> Chain:
    chance = special.expit(x)
    begins, stays, at_first = map(float, chance[:3])
    return Chain(begins=begins, stays=stays, at_first=at_first, short=chance[3:])


def _start(counts: Floats, alike: Floats) -> Floats:
    """Return where the search begins, from steps that follow on two still ones or on none."""
    long, swims = counts[0, 2:].sum(axis=(0, 1)), counts[0, 0].sum()
    stays = min(max(long[1] / max(long.sum(), 1.0), 0.3), 0.98)
    begins = min(max(long.sum() * (1 - stays) / max(swims, 1.0), 1e-4), 0.3)
    return np.asarray(special.logit(np.concatenate([[begins, stays, 0.3], 0.5 * alike])))


def _errors(lacks: Callable[[Floats], float], x: Floats, bounds: Floats) -> Floats:
    """Return standard errors from the observed information, of what is not at its bound."""
    inside = (x > bounds[:, 0] + 2 * _DIFFERENCE) & (x < bounds[:, 1] - 2 * _DIFFERENCE)
    own = np.flatnonzero(inside)
    information = np.empty((len(own), len(own)))
    for i, p in enumerate(own):
        up, down = x.copy(), x.copy()
        up[p] += _DIFFERENCE
        down[p] -= _DIFFERENCE
        slopes = (_slope(lacks, up, own) - _slope(lacks, down, own)) / (2 * _DIFFERENCE)
        information[i] = slopes
    errors = np.full(len(x), math.inf)
    if len(own):
        inverse = linalg.pinvh((information + information.T) / 2)
        variance = np.diag(inverse)
        errors[own] = np.where(variance > 0, np.sqrt(np.abs(variance)), math.inf)
    return errors


def _slope(lacks: Callable[[Floats], float], x: Floats, own: Ints) -> Floats:
    slope = np.empty(len(own))
    for i, p in enumerate(own):
        up, down = x.copy(), x.copy()
        up[p] += _DIFFERENCE
        down[p] -= _DIFFERENCE
        slope[i] = (lacks(up) - lacks(down)) / (2 * _DIFFERENCE)
    return slope

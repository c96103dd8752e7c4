"""What efficient scores are made of, and what their sums are worth.

How each effect is asked for stands in `zfcal.diagnose.screening`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Floats
from zfcal.diagnose.candidates import Candidate
from zfcal.diagnose.chances import normal_of_log
from zfcal.model.fitted import Fitted

_FLOOR = 0.01
"""Share of a uniform law in a heading's density, beside the lapse that was fitted."""

_SEVERAL = 60.0
"""Steps of one size that a score must be made of, to be as good as normal."""

_STEEPEST = 8.0
"""What a speed responds to counts for no more than so many standard deviations: one
swapped identity must not look like an effect."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Score:
    """How strongly a recording asks for an effect at one shape.

    Parameters
    ----------
    candidate
        What was asked for.
    z
        Standard normal, analytically, when the model is right.
    strength
        One step of Newton from the null.
    information
        Of the strength: one over the square of its standard error.
    steps : ndarray, shape (step,)
        Efficient scores of the scene's turns, or of its moves for an effect on speed.
    """

    candidate: Candidate
    z: float
    strength: float
    information: float
    steps: Floats

    @property
    def clearness(self) -> float:
        """The size of z; where the effect has one sign only, or is asked on one side, z itself."""
        if self.candidate.side:
            return self.candidate.side * self.z
        return abs(self.z) if self.candidate.signed else self.z


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Tables:
    """The fitted density of each cell of headings.

    Parameters
    ----------
    mixture : ndarray, shape (turn, cell)
        Before attraction and tilts, not scaled.
    probability, with_lapse : ndarray, shape (turn, cell)
        Of each cell, without and with the lapse.
    taken : ndarray, shape (turn,)
        The mixture at the heading taken.
    floor : ndarray, shape (turn,)
        What is added to it, so that no heading counts for too much.
    """

    mixture: Floats
    probability: Floats
    with_lapse: Floats
    taken: Floats
    floor: Floats

    def mixtures(
        self, rows: NDArray[np.intp] | slice = slice(None)
    ) -> tuple[Floats, Floats, Floats, Floats]:
        """Return what the scores of mixtures need of some turns."""
        return self.mixture[rows], self.with_lapse[rows], self.taken[rows], self.floor[rows]


def tables_of(fitted: Fitted) -> Tables:
    """Return the density of each cell of headings of a fitted model."""
    mixture, probability, taken = fitted.tables()
    lapse = np.zeros(len(taken))
    for x, turns in zip(fitted.x, fitted.turns, strict=True):
        lapse[turns.rows] = x[-1]
    inside = probability > 0
    evenly = inside / np.maximum(inside.sum(axis=1), 1)[:, None]
    with_lapse = (1 - lapse)[:, None] * probability + lapse[:, None] * evenly
    return Tables(
        mixture=mixture,
        probability=probability,
        with_lapse=with_lapse,
        taken=taken,
        floor=(lapse / (1 - lapse) + _FLOOR) * mixture.mean(axis=1),
    )


def by_track(track: NDArray[np.int32], steps: Floats) -> tuple[Floats, Floats]:
    """Return the sums of scores and of their squares for each track, in ascending order."""
    _, place = np.unique(track, return_inverse=True)
    sums = np.bincount(place, weights=steps).astype(np.float64)
    squares = np.bincount(place, weights=steps**2).astype(np.float64)
    return sums, squares


def excess_deviate(count: float, expected: float) -> float:
    r"""Return a count as a normal deviate, where it was to be so large; however small both are.

    By the inequality of Freedman (1975, Annals of Probability 3: 100-118) no such count has a
    tail above :math:`\exp(-n \log(n / m) + n - m)`, whatever the dependence along the way.
    """
    if not expected > 0.0:
        return 0.0
    away = expected - count + (count * math.log(count / expected) if count > 0.0 else 0.0)
    if count <= expected:
        return -math.sqrt(2 * max(away, 0.0))
    return max(0.0, normal_of_log(-away))


def summed(candidate: Candidate, steps: Floats) -> Score:
    """Return the score of a candidate from its efficient scores."""
    squares = steps * steps
    total, information = float(steps.sum()), float(squares.sum())
    if not information > 0:
        return Score(candidate=candidate, z=0.0, strength=0.0, information=0.0, steps=steps)
    # Where a few steps make up all of the sum it is not normal: they count for less.
    several = information**2 / float((squares * squares).sum())
    return Score(
        candidate=candidate,
        z=total / np.sqrt(information) * min(1.0, np.sqrt(several / _SEVERAL)),
        strength=total / information,
        information=information,
        steps=steps,
    )


def tame(scores: Floats) -> Floats:
    """Return values with what lies beyond eight standard deviations set there."""
    limit = _STEEPEST * float(scores.std()) if scores.size else 0.0
    return np.clip(scores, -limit, limit)


def centred(values: Floats, zone: NDArray[np.int64], kept: NDArray[np.bool_]) -> Floats:
    """Return values less their mean in each zone; zero for what is not kept."""
    sums = np.bincount(zone, np.where(kept, values, 0.0))
    means = sums / np.maximum(np.bincount(zone, kept), 1.0)
    return np.where(kept, values - means[zone], 0.0)


def basis_of(columns: Floats) -> Floats:
    """Return an orthonormal basis of columns; those that say nothing are left out."""
    size = np.sqrt((columns**2).sum(axis=0))
    columns = columns[:, size > 1e-9 * max(float(size.max(initial=0.0)), 1e-300)]
    if not columns.size:
        return np.zeros((len(columns), 0))
    left, values, _ = np.linalg.svd(columns / np.linalg.norm(columns, axis=0), full_matrices=False)
    return np.ascontiguousarray(left[:, values > 1e-6])

"""Rests that last: whether more of them follow on each other than short draws make.

A speed next to nothing looks like a rest of one step. Where fish freeze, steps at rest follow on
steps at rest more often.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from zfcal.diagnose.candidates import Candidate
from zfcal.diagnose.scores import Score, excess_deviate, summed

_LONG_RESTS_S = (1.0, 2.0)
"""Rests that last longer are asked for after one step at rest more."""


def rested_steps(candidate: Candidate) -> int:
    """Return after how many steps at rest it is asked whether one more follows."""
    return 1 + sum(candidate.rest_s > limit_s for limit_s in _LONG_RESTS_S)


def rest_score(
    candidate: Candidate,
    now: NDArray[np.bool_],
    rested: NDArray[np.bool_],
    zone: NDArray[np.integer],
    dt_s: float,
) -> Score:
    """Return how many more steps at rest follow on steps at rest than short draws make.

    Parameters
    ----------
    candidate
        An effect that makes fish rest, at a duration.
    now, rested : ndarray of bool, shape (move,)
        Whether each move is none, and whether so many before it were none as are asked for: a
        short draw looks like a rest of one step, after several of them few are left.
    zone : ndarray of int, shape (move,)
    dt_s
        Between samples.
    """
    share = np.bincount(zone, weights=now) / np.maximum(np.bincount(zone), 1)
    expected = np.where(rested, share[zone], 0.0)
    steps = np.where(rested, now, 0.0) - expected
    count, n_rested = float((rested & now).sum()), float(rested.sum())
    more = _Freezes.of(candidate, len(now), dt_s)
    as_rare = float(now.mean()) + more.at_rest / max(len(now), 1)
    faint = excess_deviate(count + more.after_rest, as_rare * (n_rested + more.rested))
    return replace(
        summed(candidate, steps),
        z=excess_deviate(count, float(expected.sum())),
        strength=float(steps.sum() / max(n_rested, 1.0)),
        information=(max(faint, 0.0) / candidate.faint) ** 2,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Freezes:
    """Steps that a faint rate of freezing would add to a recording.

    Parameters
    ----------
    at_rest
        Of them all.
    rested, after_rest
        Steps after so many at rest as are asked for, and of these the ones at rest themselves.
    """

    at_rest: float
    rested: float
    after_rest: float

    @classmethod
    def of(cls, candidate: Candidate, n_moves: int, dt_s: float) -> _Freezes:
        """Return them for an effect at its shape."""
        goes_on = math.exp(-dt_s / candidate.rest_s)
        n_freezes = candidate.faint * n_moves * dt_s
        rested = n_freezes * goes_on ** (rested_steps(candidate) - 1) / (1 - goes_on)
        return cls(at_rest=n_freezes / (1 - goes_on), rested=rested, after_rest=rested * goes_on)

"""Features of speeds: what an effect's name means for how fast a step is, whatever its form.

As `zfcal.model.features` has them for headings: a name is a set of features, each with weights by
hat functions and a strength for each weight. Speeds are normal scores here: 0 is the median of the
zone, 1 the speed that one step in six exceeds. How features are fitted stands in
`zfcal.diagnose.features.paces`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Floats

LATELY_S = 2.0
"""Means of last speeds are over so long."""

LONGER_S = 4.0
"""Means of the own last speeds are over so long as well."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Swum:
    """What there was before some steps of fish, and how these turned.

    Parameters
    ----------
    last, before_last, third : ndarray, shape (step,)
        Normal scores of the own speed one, two and three steps ago; 0 where it is not known.
    lately : ndarray, shape (step,)
        Mean of the own ones over two seconds.
    longer : ndarray, shape (step,)
        Mean of the own ones over four seconds.
    earlier, before_earlier : ndarray, shape (step,)
        Scores of two steps in a row, the later one about a second before the last step.
    last_m_s, last_ago_m_s : ndarray, shape (step,)
        The own speed one step ago, and about a second before that; NaN where it is not known.
    last_turn_rad : ndarray, shape (step,)
        Between the last two steps, to either side; 0 where it is not known.
    bent_rad : ndarray, shape (step,)
        The widest of the last three turns; NaN where one of them is not known.
    turn_rad : ndarray, shape (step,)
        Of the step itself, to either side: no cause of its speed where the law draws that first.
    others : ndarray, shape (step, other)
        Normal scores of the others' last speeds; 0 where they are not known.
    others_lately : ndarray, shape (step, other)
        Their means over two seconds.
    others_m_s, others_ago_m_s : ndarray, shape (step, other)
        Their last speeds, and those of about a second before; NaN where they are not known.
    distance_m : ndarray, shape (step, other)
        To them; `zfcal.model.features.AWAY_M` for who is not there.
    ahead : ndarray of bool, shape (step, other)
        Whether the other is before the fish.
    ahead_m : ndarray, shape (step,)
        To the nearest one that is; `zfcal.model.features.AWAY_M` without one.
    since_fast : ndarray, shape (step,)
        Steps since the last one whose speed one in eight exceeds; many if it is not known.
    here : ndarray of bool, shape (step, other)
    time : ndarray, shape (step,)
        Share of the recording that has passed.
    track : ndarray of int, shape (step,)
    """

    last: Floats
    before_last: Floats
    third: Floats
    lately: Floats
    longer: Floats
    earlier: Floats
    before_earlier: Floats
    last_m_s: Floats
    last_ago_m_s: Floats
    last_turn_rad: Floats
    bent_rad: Floats
    turn_rad: Floats
    others: Floats
    others_lately: Floats
    others_m_s: Floats
    others_ago_m_s: Floats
    distance_m: Floats
    ahead: NDArray[np.bool_]
    ahead_m: Floats
    since_fast: Floats
    here: NDArray[np.bool_]
    time: Floats
    track: NDArray[np.int32]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pace:
    """A change of the mean speed, in normal scores.

    Parameters
    ----------
    label
        Tells it from other features of the effect.
    weights
        Shape (step, weight): a strength is fitted for each weight.
    past_s
        How far back it looks, where that is more than a few steps: it is asked of tracks that are
        many times as long.
    """

    label: str
    weights: Callable[[Swum], Floats]
    past_s: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Spread:
    """A change of how speeds are spread: slow, middling and fast ones each in a measure of its own.

    Parameters
    ----------
    label
        Tells it from other features of the effect.
    weights
        Shape (step, weight): each has a strength for each sort of speed.
    ago
        The same of about a second before. What these gain as well is no answer to what has just
        been: fish may vary their speed more at some times than at others.
    """

    label: str
    weights: Callable[[Swum], Floats]
    ago: Callable[[Swum], Floats] | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Copied:
    """Some speeds drawn about a known one: one more component of their law.

    Parameters
    ----------
    label
        Tells it from other features of the effect.
    of
        The known speeds in m/s, shape (step, source); NaN where there is none.
    ago
        The same of about a second before. What these gain as well is no copy: speeds are alike
        that change slowly.
    weights
        Shape (step, source, weight): a strength is fitted for each weight.
    """

    label: str
    of: Callable[[Swum], Floats]
    ago: Callable[[Swum], Floats]
    weights: Callable[[Swum], Floats]


PaceFeature: TypeAlias = Pace | Spread | Copied

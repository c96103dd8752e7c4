"""Features of speeds: what an effect's name means for how fast a step is, whatever its form.

As `zfcal.model.features` has them for headings: a name is a set of features, each with weights by
hat functions and a strength for each weight. Speeds are normal scores here: 0 is the median of the
zone, 1 the speed that one step in six exceeds. How features are fitted stands in
`zfcal.diagnose.features.paces`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Floats


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Swum:
    """What there was before some steps of fish.

    Parameters
    ----------
    last, before_last, third : ndarray, shape (step,)
        Normal scores of the own speed one, two and three steps ago; 0 where it is not known.
    last_turn_rad : ndarray, shape (step,)
        Between the last two steps, to either side; 0 where it is not known.
    others : ndarray, shape (step, other)
        Normal scores of the others' last speeds; 0 where they are not known.
    distance_m : ndarray, shape (step, other)
        To them; `zfcal.model.features.AWAY_M` for who is not there.
    here : ndarray of bool, shape (step, other)
    time : ndarray, shape (step,)
        Share of the recording that has passed.
    track : ndarray of int, shape (step,)
    """

    last: Floats
    before_last: Floats
    third: Floats
    last_turn_rad: Floats
    others: Floats
    distance_m: Floats
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
    """

    label: str
    weights: Callable[[Swum], Floats]

"""What the paper says of its figure, held against the scores of virtual trials.

Each statement is a number per trial with a 95 % interval over trials (Student's t), and holds,
does not hold, or is open.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np

from zfcal.artifacts.lineage import JSON
from zfcal.report.followed import mean_interval
from zfcal.reproduction.courses import Course
from zfcal.reproduction.document import Way
from zfcal.reproduction.reference import Reference

Holds = Literal["holds", "does not hold", "open"]

_FIRST_S, _SECOND_S, _SETTLED_S = 180, 300, 360
_FLAT = 0.05
"""A change in the mean that is less than this is nearly none."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Statement:
    """A statement and what it comes to.

    Parameters
    ----------
    way
        Of which scores.
    says
        The statement.
    measured
        What was taken from each trial.
    n, mean, low, high
        Trials, mean and 95 % interval; NaN where there are too few trials.
    holds
        Whether the interval lies where the statement puts it.
    """

    way: str
    says: str
    measured: str
    n: int
    mean: float
    low: float
    high: float
    holds: Holds

    def as_dict(self) -> dict[str, JSON]:
        """Return it for a document; what is not known is null."""
        numbers = {"mean": self.mean, "low": self.low, "high": self.high}
        known = {key: None if math.isnan(value) else value for key, value in numbers.items()}
        return {
            "way": self.way,
            "says": self.says,
            "measured": self.measured,
            "n": self.n,
            **known,
            "holds": self.holds,
        }


def statements_of(ways: Sequence[Way], reference: Reference) -> list[Statement]:
    """Return all statements for each way.

    Parameters
    ----------
    ways
        Scores of virtual trials.
    reference
        Its contrasts say how large the published rise is.
    """
    values = {each.name: each.value for each in reference.contrasts if each.feature == "S"}
    rise = max(values.values()) - min(values.values())
    return [each for way in ways for each in _of_way(way, rise)]


def _of_way(way: Way, published_rise: float) -> list[Statement]:
    def said(
        says: str, measured: str, of: Callable[[Course], float], low: float, high: float = math.inf
    ) -> Statement:
        return _statement(way, says, measured, of, (low, high))

    return [
        said(
            f"S rises as published, by {published_rise:.2f} (half of it or more)",
            "S from 360 s on less S at 180 s",
            partial(_rise, "S"),
            published_rise / 2.0,
        ),
        said(
            "most of the rise is over at 300 s",
            "S at 300 s less the middle of S at 180 s and from 360 s on",
            lambda course: (
                _at(course, "S", _SECOND_S)
                - (_at(course, "S", _FIRST_S) + _late(course, "S")) / 2.0
            ),
            0.0,
        ),
        said(
            "O is high at first",
            "O less S at 180 s",
            lambda course: _at(course, "O", _FIRST_S) - _at(course, "S", _FIRST_S),
            0.0,
        ),
        said(
            "O stays nearly flat",
            "O from 360 s on less O at 180 s",
            partial(_rise, "O"),
            -_FLAT,
            _FLAT,
        ),
        *(
            said(
                f"{name} rises with S",
                f"{name} from 360 s on less {name} at 180 s",
                partial(_rise, name),
                0.0,
            )
            for name in ("W", "T")
        ),
        said(
            "D varies more than O, W and T from window to window",
            "sd of D over a trial's windows less the mean sd of the others",
            _variation,
            0.0,
        ),
    ]


def _statement(
    way: Way,
    says: str,
    measured: str,
    of: Callable[[Course], float],
    bounds: tuple[float, float],
) -> Statement:
    values = np.array([of(course) for course in way.courses.values()])
    values = values[np.isfinite(values)]
    n, mean = len(values), float(values.mean()) if len(values) else math.nan
    low, high = mean_interval(values)
    holds: Holds = "open"
    if low > bounds[0] and high < bounds[1]:
        holds = "holds"
    elif high < bounds[0] or low > bounds[1]:
        holds = "does not hold"
    return Statement(
        way=way.name, says=says, measured=measured, n=n, mean=mean, low=low, high=high, holds=holds
    )


def _rise(feature: str, course: Course) -> float:
    return _late(course, feature) - _at(course, feature, _FIRST_S)


def _at(course: Course, feature: str, end_s: int) -> float:
    return course.get((feature, end_s), math.nan)


def _late(course: Course, feature: str) -> float:
    values = [v for (name, end), v in course.items() if name == feature and end >= _SETTLED_S]
    return float(np.nanmean(values)) if values and not np.isnan(values).all() else math.nan


def _variation(course: Course) -> float:
    sds = {}
    for feature in ("D", "W", "O", "T"):
        values = [v for (name, end), v in course.items() if name == feature and end >= _SETTLED_S]
        known = np.array([value for value in values if not math.isnan(value)])
        sds[feature] = float(known.std(ddof=1)) if len(known) > 1 else math.nan
    return sds["D"] - float(np.mean([sds[name] for name in ("W", "O", "T")]))

"""A measure of the robot beside its ceiling and its floor.

How what fish in the robot's place give, and what chance gives, become a few numbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from zfcal.arrays import Floats

CHANCE = 0.95
"""Quantile of the shifted tracks that is the floor."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Measured:
    """A measure of the robot, with its ceiling and its floor; NaN where one is not defined.

    Parameters
    ----------
    measure
        Its name.
    lag_s
        The lag that it is of; NaN for none.
    value
        Of the robot.
    low, high
        2.5 and 97.5 % quantiles over the fish, each in the robot's place.
    ceiling
        Their mean.
    floor
        95 % quantile of what the robot's track gives against another time of the fish.
    n
        On how many observations the value stands; None where it is not defined.
    """

    measure: str
    value: float
    lag_s: float = float("nan")
    low: float = float("nan")
    high: float = float("nan")
    ceiling: float = float("nan")
    floor: float = float("nan")
    n: int | None = 0


def measured(
    names: Sequence[tuple[str, float, int]], value: Floats, *, in_place: Floats, floor: Floats
) -> list[Measured]:
    """Return measures with what the fish in the robot's place give.

    Parameters
    ----------
    names
        For each measure its name, its lag and its number of observations.
    value, floor : ndarray, shape (measure,)
        Of the robot, and of chance.
    in_place : ndarray, shape (fish, measure)
        Of each fish in the robot's place.
    """
    low, high = (quantile_of(in_place, q) for q in (0.025, 0.975))
    known = ~np.isnan(in_place)
    n_known = known.sum(axis=0)
    ceiling = np.where(known, in_place, 0.0).sum(axis=0) / np.where(n_known > 0, n_known, np.nan)
    return [
        Measured(
            measure=measure,
            value=float(value[i]),
            lag_s=lag_s,
            low=float(low[i]),
            high=float(high[i]),
            ceiling=float(ceiling[i]),
            floor=float(floor[i]),
            n=n,
        )
        for i, (measure, lag_s, n) in enumerate(names)
    ]


def floor_of(values: Floats) -> Floats:
    """Return what chance gives of measures: the 95 % quantile over the shifts.

    Parameters
    ----------
    values : ndarray, shape (shift, measure)

    Returns
    -------
    ndarray, shape (measure,)
        One of the values, not one between two of them; NaN where no shift has any.
    """
    return quantile_of(values, CHANCE, between=False)


def quantile_of(values: Floats, share: float, *, between: bool = True) -> Floats:
    """Return a quantile of each column, NaN left out; NaN of a column without a value.

    That of `numpy.nanquantile`, which goes column by column and takes some fifty times as long
    for 19 shifts of 24 measures.

    Parameters
    ----------
    values : ndarray, shape (row, column)
    share
        In [0, 1].
    between
        Whether it may lie between two values, rather than on the higher one of them.
    """
    if not len(values):
        return np.full(values.shape[1], np.nan)
    # NaN is sorted to the end.
    ordered = np.sort(values, axis=0)
    place = (np.count_nonzero(~np.isnan(values), axis=0) - 1) * share
    low, high = (np.maximum(f(place), 0).astype(np.intp) for f in (np.floor, np.ceil))
    columns = np.arange(values.shape[1])
    if not between:
        return np.asarray(ordered[high, columns], dtype=np.float64)
    part = place - low
    found: Floats = (1 - part) * ordered[low, columns] + part * ordered[high, columns]
    return found

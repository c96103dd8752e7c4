"""Whether fish follow the robot, over the windows of a trial: from the rows to what is shown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats

from zfcal.arrays import Bools, Floats
from zfcal.units import WINDOW_S

DIRECTION, FOLLOWING, LEAD, DELAY = "direction", "following", "lead", "delay"
LED, FOLLOWED = "departures_led", "departures_followed"
_SHARES = (LED, FOLLOWED)
_LEAST_WINDOWS = 3
"""With fewer windows that do not overlap there is no interval of their mean."""

_NUMBERS = ("value", "low", "high", "ceiling", "floor")


@dataclass(frozen=True, slots=True, kw_only=True)
class Level:
    """A measure over the windows; NaN where it is not known.

    Parameters
    ----------
    value
        Mean over the windows; of a share of departures over all departures.
    low, high
        95 % interval of the mean, from windows that do not overlap; NaN for fewer than three, and
        of shares of departures.
    ceiling, ceiling_low, ceiling_high
        A fish in the robot's place: mean over the windows of the mean and the 2.5 and 97.5 %
        quantiles over the fish.
    floor
        What chance gives, mean over the windows.
    n
        Observations in all windows, those that overlap twice; None where not defined.
    n_windows, n_above
        Windows that do not overlap, and in how many of them the value is above its own floor.
    """

    value: float
    low: float
    high: float
    ceiling: float
    ceiling_low: float
    ceiling_high: float
    floor: float
    n: int | None
    n_windows: int
    n_above: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Followed:
    """Whether fish follow the robot of a trial.

    Parameters
    ----------
    start_s, end_s
        The stretch of time that the windows cover.
    lags
        The correlation of directions, by the lag in seconds, ascending.
    measures
        The others by name.
    """

    start_s: int
    end_s: int
    lags: Mapping[float, Level]
    measures: Mapping[str, Level]

    @property
    def has_rooms(self) -> bool:
        """Whether departures from a room are defined."""
        return self.measures[LED].n is not None


def followed_from(rows: Sequence[Mapping[str, Any]], *, start_s: int) -> Followed | None:
    """Return what the rows of all windows say; None without any.

    Parameters
    ----------
    rows
        Of the tables ``zfcal.following/1`` of a trial.
    start_s
        Windows that begin earlier are left out, if any begins later.
    """
    length_s = int(WINDOW_S)
    late = [row for row in rows if row["window_end_s"] - length_s >= start_s] or list(rows)
    if not late:
        return None
    ends = [row["window_end_s"] for row in late]
    of: dict[tuple[str, float | None], list[Mapping[str, Any]]] = {}
    for row in late:
        of.setdefault((row["measure"], row["lag_s"]), []).append(row)
    levels = {key: _level(key[0], found) for key, found in of.items()}
    lags = {lag: level for (name, lag), level in levels.items() if lag is not None}
    return Followed(
        start_s=min(ends) - length_s,
        end_s=max(ends),
        lags=dict(sorted(lags.items())),
        measures={name: level for (name, lag), level in levels.items() if lag is None},
    )


def _level(name: str, rows: Sequence[Mapping[str, Any]]) -> Level:
    ordered = sorted(rows, key=lambda row: int(row["window_end_s"]))
    value, low, high, ceiling, floor = (
        np.array([np.nan if row[key] is None else row[key] for row in ordered], dtype=np.float64)
        for key in _NUMBERS
    )
    counts = [row["n"] for row in ordered]
    n = np.array([count or 0 for count in counts], dtype=np.float64)
    weights = n if name in _SHARES else np.ones(len(ordered))
    own = _apart([int(row["window_end_s"]) for row in ordered], ~np.isnan(value))
    interval = (
        (np.nan, np.nan) if name in _SHARES else mean_interval(value[own], least=_LEAST_WINDOWS)
    )
    return Level(
        value=_mean(value, weights),
        low=interval[0],
        high=interval[1],
        ceiling=_mean(ceiling, weights),
        ceiling_low=_mean(low, weights),
        ceiling_high=_mean(high, weights),
        floor=_mean(floor, weights),
        n=None if all(count is None for count in counts) else int(n.sum()),
        n_windows=len(own),
        n_above=int((value[own] > floor[own]).sum()),
    )


def _apart(ends_s: Sequence[int], known: Bools) -> list[int]:
    """Return indices of windows with a value that do not overlap, from the first on."""
    chosen: list[int] = []
    for i, end_s in enumerate(ends_s):
        if known[i] and (not chosen or end_s - ends_s[chosen[-1]] >= WINDOW_S):
            chosen.append(i)
    return chosen


def mean_interval(values: Floats, *, least: float = 2) -> tuple[float, float]:
    """Return the 95 % interval of a mean, by Student's t.

    Parameters
    ----------
    values : ndarray, shape (observation,)
        All of them known.
    least
        With fewer there is none: NaN.
    """
    if len(values) < least:
        return np.nan, np.nan
    half = float(stats.t.ppf(0.975, len(values) - 1)) * float(stats.sem(values))
    mean = float(values.mean())
    return mean - half, mean + half


def _mean(values: Floats, weights: Floats) -> float:
    known = ~np.isnan(values) & (weights > 0)
    return float(np.average(values[known], weights=weights[known])) if known.any() else np.nan


def followed_document(found: Followed) -> dict[str, Any]:
    """Return it as JSON; what is not known is null."""
    return {
        "start_s": found.start_s,
        "end_s": found.end_s,
        "direction": [{"lag_s": lag, **_entry(level)} for lag, level in found.lags.items()],
        **{name: _entry(level) for name, level in found.measures.items()},
    }


def _entry(level: Level) -> dict[str, float | int | None]:
    names = ("value", "low", "high", "ceiling", "ceiling_low", "ceiling_high", "floor")
    numbers = {name: getattr(level, name) for name in names}
    known = {name: None if np.isnan(number) else number for name, number in numbers.items()}
    return {**known, "n": level.n, "n_windows": level.n_windows, "n_above": level.n_above}

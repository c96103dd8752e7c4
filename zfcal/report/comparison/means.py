"""What the fish of a trial do on average, from where they were, stretch by stretch."""

from __future__ import annotations

from collections import defaultdict
from typing import final

import numpy as np

from zfcal.arena import Arena
from zfcal.arrays import Floats, Ints
from zfcal.behaviour.features.registry import statistics
from zfcal.behaviour.features.statistic import Points, Statistic, count
from zfcal.behaviour.located import Located, join
from zfcal.report.comparison.quantities import quantities_of
from zfcal.tracks import FISH
from zfcal.units import WINDOW_S


@final
class FishMeans:
    """Means over all fish and samples of a trial; robots are no fish.

    Values are taken as they are: no bin rounds them, and no range cuts them. They are counted
    in windows that do not overlap, so that a stay is cut as `zfcal analyse` cuts it.
    """

    def __init__(self) -> None:
        self._waiting: list[Located] = []
        self._sums: dict[str, tuple[float, int]] = {}
        self._counts: dict[str, Ints] = defaultdict(lambda: np.zeros(1, dtype=np.int64))
        self._arena: Arena | None = None
        self._dt_s = float("nan")

    def add(self, part: Located) -> None:
        """Add the segment that follows; it lies within one window."""
        fish = part.of_kind(FISH)
        if not len(fish):
            return
        self._arena, self._dt_s = part.arena, part.dt_s
        if self._waiting and _window_of(self._waiting[0]) != _window_of(fish):
            self._flush()
        self._waiting.append(fish)

    def values(self) -> dict[str, float]:
        """Return the mean of each quantity that has an observation, by its name."""
        self._flush()
        if self._arena is None:
            return {}
        found: dict[str, float] = {}
        for statistic in statistics().values():
            names = [each.name for each in quantities_of(statistic, self._arena.zone_names)]
            values = self._values_of(statistic)
            found |= {n: float(v) for n, v in zip(names, values, strict=False) if np.isfinite(v)}
        return found

    def _flush(self) -> None:
        if not self._waiting:
            return
        located = join(self._waiting)
        self._waiting = []
        inside = located.take(located.zone > 0)
        everybody = np.ones(len(inside), dtype=np.bool_)
        points = Points(located=inside, role=everybody, within=True)
        for statistic in statistics().values():
            if statistic.form == "bins":
                self._sum(statistic, points)
            else:
                counts = self._counts[statistic.name] + count(statistic, points)
                self._counts[statistic.name] = counts

    def _sum(self, statistic: Statistic, points: Points) -> None:
        total, n = self._sums.get(statistic.name, (0.0, 0))
        for seen in statistic.observe(points):
            values = np.asarray(seen.value, dtype=np.float64)
            total, n = total + float(values.sum()), n + values.size
        self._sums[statistic.name] = (total, n)

    def _values_of(self, statistic: Statistic) -> Floats:
        """Return a statistic's values, in the order of its quantities."""
        if statistic.form == "bins":
            total, n = self._sums[statistic.name]
            return np.array([total / n if n else np.nan])
        counts = self._counts[statistic.name]
        n = int(counts.sum())
        if not n:
            return np.array([np.nan])
        if statistic.form == "zones":
            return counts / n
        return np.array([1.0 - float(np.trace(counts)) / n]) / self._dt_s


def _window_of(part: Located) -> int:
    """Return the number of the window in which a stretch begins."""
    return int(part.k[0] * part.dt_s / WINDOW_S + 1e-9)

"""What the report shows of the tracks, gathered part by part: a day needs no more memory.

Where everybody was stays in the files; kept are the paths of the last window, counts
for the maps, and the counts of the two halves that are compared.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import final

import numpy as np

from zfcal.arena import Arena
from zfcal.arrays import Floats, Ints
from zfcal.behaviour.located import Located, join
from zfcal.behaviour.pooling import Halves
from zfcal.tracks import FISH, ROBOT
from zfcal.units import WINDOW_S

_TOGETHER = 100_000
"""Points that are counted at once: a call for every minute would take longer than the counts."""

_CELLS = 60
"""Squares of a map along the longer side of the tank."""

Extent = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Visits:
    """How often the animals of one kind were where.

    Parameters
    ----------
    cells : ndarray, shape (row, column)
        Points in each square of the grid; rows go up (y), columns right (x).
    zones : ndarray of int64, shape (zone + 1,)
        Points in each zone, the void's first.
    """

    cells: Floats
    zones: Ints

    def __add__(self, other: Visits) -> Visits:
        return Visits(cells=self.cells + other.cells, zones=self.zones + other.zones)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Seen:
    """The tracks of a trial, as far as the report shows them.

    Parameters
    ----------
    n_points
        Agents seen, sample by sample.
    first_k, last_k
        The first and the last sample in which anybody was seen; 0 and -1 for none.
    last
        All points of the last window.
    visits
        By kind, only of kinds that were seen.
    halves
        The fish of every other minute, and those of the others.
    """

    n_points: int
    first_k: int
    last_k: int
    last: Located
    visits: dict[int, Visits]
    halves: Halves

    @property
    def arena(self) -> Arena:
        """Where they swam."""
        return self.last.arena

    @property
    def dt_s(self) -> float:
        """The model's step, in seconds."""
        return self.last.dt_s

    @property
    def end_s(self) -> float:
        """Seconds of the recording up to the last sample; 0 if nobody was seen."""
        return float(self.last_k + 1) * self.dt_s


def see(parts: Iterable[Located]) -> Seen | None:
    """Return what the report shows of tracks; None if there is no part.

    Parameters
    ----------
    parts
        Consecutive stretches; each is let go before the next is taken.
    """
    watcher: _Watcher | None = None
    for part in _together(parts):
        watcher = watcher or _Watcher(part)
        watcher.add(part)
    return None if watcher is None else watcher.seen()


def _together(parts: Iterable[Located]) -> Iterator[Located]:
    """Yield the parts, several at once."""
    waiting: list[Located] = []
    for part in parts:
        waiting.append(part)
        if sum(map(len, waiting)) >= _TOGETHER:
            yield join(waiting)
            waiting = []
    if waiting:
        yield join(waiting)


@final
class _Watcher:
    """Sees one part after the other."""

    def __init__(self, first: Located) -> None:
        self._n_points = 0
        self._first_k = 0
        self._last = first.take(slice(0, 0))
        self._visits: dict[int, Visits] = {}
        self._halves = Halves(first.arena)

    def add(self, part: Located) -> None:
        if not len(part):
            return
        if not self._n_points:
            self._first_k = int(part.k[0])
        self._n_points += len(part)
        end_s = float(part.k[-1] + 1) * part.dt_s
        self._last = join([self._last, part]).between(end_s - WINDOW_S, end_s)
        self._halves.add(part.of_kind(FISH))
        for kind in (FISH, ROBOT):
            points = part.of_kind(kind)
            if len(points):
                found = visits_of(points)
                known = self._visits.get(kind)
                self._visits[kind] = found if known is None else known + found

    def seen(self) -> Seen:
        last_k = int(self._last.k[-1]) if self._n_points else -1
        return Seen(
            n_points=self._n_points,
            first_k=self._first_k,
            last_k=last_k,
            last=self._last,
            visits=dict(sorted(self._visits.items())),
            halves=self._halves,
        )


def grid_of(arena: Arena) -> tuple[tuple[int, int], Extent]:
    """Return rows and columns of the grid over a tank, and ``x0, x1, y0, y1`` in metres."""
    x0, y0, x1, y1 = arena.outline.bounds
    cell_m = arena.extent_m / _CELLS
    columns, rows = (max(1, int(np.ceil(length / cell_m - 1e-9))) for length in (x1 - x0, y1 - y0))
    return (rows, columns), (x0, x0 + columns * cell_m, y0, y0 + rows * cell_m)


def visits_of(points: Located) -> Visits:
    """Return how often points lie in each square of the grid, and in each zone.

    Points in the void are in no square.
    """
    bins, extent = grid_of(points.arena)
    seen_m = points.xy_m[points.zone > 0]
    cells, _, _ = np.histogram2d(
        seen_m[:, 1], seen_m[:, 0], bins=bins, range=(extent[2:], extent[:2])
    )
    zones = np.bincount(points.zone, minlength=len(points.arena.zones) + 1)
    return Visits(cells=cells, zones=zones.astype(np.int64))

"""Counts over a stretch that grows part by part, without keeping its points.

What a pool tells is, count for count, what ``statistics`` and ``ceilings`` find in
the joined parts. Its size depends on the number of track ids alone, and a part costs
the same however long the stretch is already.
"""

from __future__ import annotations

from dataclasses import replace
from typing import final

import numpy as np
from numpy.typing import NDArray

from zfcal.arena import Arena
from zfcal.arrays import Indices, Ints
from zfcal.behaviour.ceilings import block_numbers, piece_together, places_of_fish
from zfcal.behaviour.located import Located, join
from zfcal.behaviour.scores import Scores, compare
from zfcal.behaviour.statistics import (
    Statistics,
    from_counts,
    measure_each,
    measure_robot,
    n_counts,
)
from zfcal.tracks import FISH, ROBOT
from zfcal.units import SEGMENT_S


@final
class Pool:
    """What fish and robots did over consecutive stretches, as counts.

    Parameters
    ----------
    arena
        In which all points are located.
    """

    def __init__(self, arena: Arena) -> None:
        self.arena = arena
        self.first_robot_k: int | None = None
        n_zones = len(arena.zones)
        nothing = np.zeros(n_counts(n_zones), dtype=np.int64)
        self._robot = from_counts(nothing, arena.zone_names)
        self._row: dict[int, int] = {}
        # For each fish's id its counts, its first and last sample, and its points.
        self._counts = nothing[None, :][:0]
        self._spans = np.zeros((0, 3), dtype=np.int64)
        self._last: Located | None = None

    def add(self, part: Located) -> None:
        """Add the stretch that follows.

        Parameters
        ----------
        part
            In the same arena, and after all that was added before.

        Raises
        ------
        InputError
            It overlaps what was added before, or is of another step.
        """
        if not len(part):
            return
        # A step from the last sample of one stretch to the first of the next counts as well.
        points = part
        if self._last is not None:
            points = join([self._last, part])
            self._robot -= measure_robot(self._last, self.arena)
            self._count_fish(self._last, -1)
        self._robot += measure_robot(points, self.arena)
        self._count_fish(points, 1)
        self._last = part.take(part.k == part.k[-1])
        robots = part.k[part.kind == ROBOT]
        if self.first_robot_k is None and len(robots):
            self.first_robot_k = int(robots[0])

    def fish(self) -> Statistics:
        """Return what `zfcal.behaviour.statistics.measure` finds for the fish alone."""
        total = from_counts(self._counts.sum(axis=0), self.arena.zone_names)
        # A pair stands with both of its fish.
        return replace(total, distance=total.distance // 2)

    def robot(self) -> Statistics:
        """Return what `zfcal.behaviour.statistics.measure_robot` finds."""
        return self._robot

    def robot_ceiling(self) -> list[Scores]:
        """Return what `zfcal.behaviour.ceilings.robot_ceiling` finds."""
        ids = np.argsort(np.fromiter(self._row, dtype=np.int64, count=len(self._row)))
        first, last, seen = self._spans[ids].T
        place = piece_together(first, last)
        n_places = int(place.max(initial=-1)) + 1
        if not n_places:
            return []
        counts = np.zeros((n_places, self._counts.shape[1]), dtype=np.int64)
        np.add.at(counts, place, self._counts[ids])
        seen_there = np.zeros(n_places, dtype=np.int64)
        np.add.at(seen_there, place, seen)
        group = self.fish()
        alone = [from_counts(counts[f], self.arena.zone_names) for f in places_of_fish(seen_there)]
        return [compare(one, group - one) for one in alone]

    def _count_fish(self, points: Located, sign: int) -> None:
        fish = points.of_kind(FISH)
        agents, first, column = np.unique(fish.agent, return_index=True, return_inverse=True)
        rows = self._rows_of(agents, fish.k[first])
        self._counts[rows] += sign * measure_each(fish, column, len(agents))
        self._spans[rows[column], 1] = fish.k  # ascending: the last one stays
        self._spans[rows, 2] += sign * np.bincount(column, minlength=len(agents))

    def _rows_of(self, agents: NDArray[np.int32], first_k: Ints) -> Indices:
        """Return the rows of some ids; ids that are new get one."""
        new = [(int(a), k) for a, k in zip(agents, first_k, strict=True) if int(a) not in self._row]
        if new:
            self._row |= {agent: len(self._row) + i for i, (agent, _) in enumerate(new)}
            fresh = np.zeros((len(new), self._counts.shape[1]), dtype=np.int64)
            spans = np.array([(k, k, 0) for _, k in new], dtype=np.int64)
            self._counts = np.concatenate([self._counts, fresh])
            self._spans = np.concatenate([self._spans, spans])
        return np.array([self._row[int(agent)] for agent in agents], dtype=np.intp)


@final
class Halves:
    """The fish of every other block of time against those of the others.

    Parameters
    ----------
    arena
        In which all points are located.
    block_s
        Length of a block, counted from the first sample.
    """

    def __init__(self, arena: Arena, *, block_s: float = SEGMENT_S) -> None:
        self._block_s = block_s
        self._start_k: int | None = None
        self._pools = (Pool(arena), Pool(arena))

    def add(self, fish: Located) -> None:
        """Add the stretch that follows, of fish alone."""
        if not len(fish):
            return
        if self._start_k is None:
            self._start_k = int(fish.k[0])
        half = block_numbers(fish, self._start_k, self._block_s) % 2
        for number, pool in enumerate(self._pools):
            pool.add(fish.take(half == number))

    def scores(self) -> Scores | None:
        """Return what `zfcal.behaviour.ceilings.halves_ceiling` finds."""
        even, odd = (pool.fish() for pool in self._pools)
        if not (odd.occupation.any() or odd.n_void):
            return None
        return compare(even, odd)

"""Where in the arena every agent is, found once and shared by all that counts.

Classifying points is the slow part of the statistics. Windows overlap, and a
comparison looks at the same points several times, so this is done once.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from itertools import pairwise
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from zfcal.arena import Arena
from zfcal.arrays import Bools, Floats, Indices, Ints
from zfcal.errors import InputError
from zfcal.sampling import sample_range
from zfcal.tracks import Samples


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Located:
    """One row per agent and sample in which it was seen; sorted by sample, then agent.

    Missing agents have no row, so many short track ids cost nothing.

    Parameters
    ----------
    arena
        The arena in which the points were located.
    dt_s
        The model's step, in seconds.
    k : ndarray of int64, shape (point,)
        Sample number.
    agent : ndarray of int32, shape (point,)
        Track id.
    kind : ndarray of int8, shape (point,)
        Index into `zfcal.tracks.KINDS`.
    xy_m : ndarray of float64, shape (point, 2)
        Position in metres, after points a little outside were put at the wall.
    zone : ndarray of int8, shape (point,)
        Zone id; 0 is void.
    wall_distance_m : ndarray of float64, shape (point,)
        To the nearest wall.
    settled : ndarray of bool, shape (point,)
        Whether the point was moved to the wall.
    """

    arena: Arena
    dt_s: float
    k: Ints
    agent: NDArray[np.int32]
    kind: NDArray[np.int8]
    xy_m: Floats
    zone: NDArray[np.int8]
    wall_distance_m: Floats
    settled: Bools

    def __len__(self) -> int:
        return len(self.k)

    def take(self, rows: Bools | Indices | slice) -> Located:
        """Return the chosen points; they must be chosen in order."""
        per_point = {f.name: getattr(self, f.name)[rows] for f in fields(self)[2:]}
        return Located(arena=self.arena, dt_s=self.dt_s, **per_point)

    def of_kind(self, kind: int) -> Located:
        """Return the points of one kind of agent only."""
        return self.take(self.kind == kind)

    def between(self, start_s: float, end_s: float) -> Located:
        """Return the points with ``start_s <= k * dt_s < end_s``."""
        edges = sample_range(start_s, end_s, dt_s=self.dt_s)
        return self.take(slice(*np.searchsorted(self.k, edges)))


SamplesOrLocated: TypeAlias = Samples | Located
"""Functions of this package take samples, or what `locate` made of them."""


def locate(samples: SamplesOrLocated, arena: Arena) -> Located:
    """Find every agent's zone and distance to the wall, at every sample.

    Parameters
    ----------
    samples
        Positions on the model's clock; NaN is missing. What is located already
        is returned as it is.
    arena
        Points up to its ``wall_tolerance_m`` outside are put at the wall.

    Returns
    -------
    Located

    Raises
    ------
    InputError
        The points were located in another arena.
    """
    if isinstance(samples, Located):
        if samples.arena is not arena:
            raise InputError(
                f"The points were located in arena {samples.arena.name!r}, "
                f"not in the given {arena.name!r}."
            )
        return samples
    row, column = np.nonzero(~np.isnan(samples.xy_m).any(axis=-1))
    seen_m = samples.xy_m[row, column]
    xy_m, _ = arena.settle(seen_m)
    return Located(
        arena=arena,
        dt_s=samples.dt_s,
        k=samples.k[row],
        agent=samples.agent[column],
        kind=samples.kind[column],
        xy_m=xy_m,
        zone=arena.zone_of(xy_m),
        wall_distance_m=arena.wall_distance(xy_m),
        settled=(xy_m != seen_m).any(axis=-1),
    )


def join(parts: list[Located]) -> Located:
    """Return the points of consecutive stretches, such as the segments of a window.

    Parameters
    ----------
    parts
        At least one; of one arena and step, in order of time, none overlapping.

    Returns
    -------
    Located

    Raises
    ------
    InputError
        There is no part, they differ in arena or step, or they overlap.
    """
    if not parts:
        raise InputError("Nothing to join: no stretch of points was given.")
    first = parts[0]
    if any(part.arena is not first.arena or part.dt_s != first.dt_s for part in parts):
        raise InputError("Points to join must be of one arena and one step dt_s.")
    filled = [part for part in parts if len(part)]
    for a, b in pairwise(filled):
        if b.k[0] <= a.k[-1]:
            raise InputError(
                f"Points to join overlap: sample {b.k[0]} follows sample {a.k[-1]}.",
                hint="Give the stretches in order of time.",
            )
    per_point = {
        f.name: np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(first)[2:]
    }
    return Located(arena=first.arena, dt_s=first.dt_s, **per_point)

"""The counts that describe a group in a window: D, W, O, T and V.

Names of features are the paper's. Counts, not frequencies, so that windows can
be pooled; what is alike about two of them is in ``scores``.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from zfcal.arena import N_BINS, Arena
from zfcal.behaviour.histograms import count_by_zone, count_cells
from zfcal.behaviour.located import Located, SamplesOrLocated, locate
from zfcal.errors import InputError
from zfcal.tracks import ROBOT

Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Statistics:
    """What a group did in a window, as counts; sums pool windows.

    Parameters
    ----------
    zone_names
        The arena's zones, in its order.
    distance : ndarray of int64, shape (zone, 10)
        D: distances of pairs of agents that are both in the zone.
    wall : ndarray of int64, shape (zone, 10)
        W: distances to the nearest wall.
    occupation : ndarray of int64, shape (zone,)
        O: agent-samples in the zone.
    transition : ndarray of int64, shape (zone, zone)
        T: steps from the zone (row) to a zone (column), stays included.
    speed : ndarray of int64, shape (zone, 10)
        V: speeds, in the zone where the step starts.
    n_settled
        Agent-samples that lay a little outside and were put at the wall.
    n_void
        Agent-samples farther outside; they are in no other count.
    """

    zone_names: tuple[str, ...]
    distance: Ints
    wall: Ints
    occupation: Ints
    transition: Ints
    speed: Ints
    n_settled: int = 0
    n_void: int = 0

    def __post_init__(self) -> None:
        n = len(self.zone_names)
        shapes = {
            "distance": (n, N_BINS),
            "wall": (n, N_BINS),
            "occupation": (n,),
            "transition": (n, n),
            "speed": (n, N_BINS),
        }
        for name, shape in shapes.items():
            counts = getattr(self, name)
            if counts.shape != shape or counts.dtype != np.int64 or (counts < 0).any():
                raise InputError(
                    f"Statistics of {n} zones need {name} as counts of shape {shape}, "
                    f"got {counts.dtype} of shape {counts.shape}, least {counts.min(initial=0)}."
                )

    def __add__(self, other: Statistics) -> Statistics:
        check_zones(self.zone_names, other.zone_names)
        sums = {f.name: getattr(self, f.name) + getattr(other, f.name) for f in fields(self)[1:]}
        return Statistics(zone_names=self.zone_names, **sums)

    def __sub__(self, part: Statistics) -> Statistics:
        check_zones(self.zone_names, part.zone_names)
        rests = {f.name: getattr(self, f.name) - getattr(part, f.name) for f in fields(self)[1:]}
        return Statistics(zone_names=self.zone_names, **rests)


def check_zones(a: tuple[str, ...], b: tuple[str, ...]) -> None:
    """Refuse to bring together statistics of different arenas.

    Raises
    ------
    InputError
        The names or their order differ.
    """
    if a != b:
        raise InputError(
            f"Statistics are of different zones: {', '.join(a)} and {', '.join(b)}.",
            hint="Only trials in the same arena can be compared.",
        )


def measure(samples: SamplesOrLocated, arena: Arena) -> Statistics:
    """Count what all the given agents did.

    Parameters
    ----------
    samples
        The agents of a window; take those of one kind for the control case.
    arena
        Gives zones, walls and the ranges of the bins.

    Returns
    -------
    Statistics
        Missing agents (NaN) and those in the void count nowhere. A step counts
        when one track id is inside at sample k and at k + 1 of the window.
    """
    located = locate(samples, arena)
    return measure_role(located, np.ones(len(located), dtype=np.bool_), pairs_within=True)


def measure_robot(samples: SamplesOrLocated, arena: Arena) -> Statistics:
    """Count what the robot did: its own W, O, T and V, and D of robot-fish pairs.

    Parameters
    ----------
    samples
        Fish and robots of a window.
    arena
        Gives zones, walls and the ranges of the bins.

    Returns
    -------
    Statistics
        Several robots are pooled; pairs of two robots do not count.
    """
    located = locate(samples, arena)
    return measure_role(located, located.kind == ROBOT)


def measure_role(located: Located, role: Bools, *, pairs_within: bool = False) -> Statistics:
    """Count what the agents in a role did, and their distances to the others.

    Parameters
    ----------
    located
        All agents of a window.
    role : ndarray of bool, shape (point,)
        The points that count for W, O, T and V.
    pairs_within
        Whether D is over pairs with both ends in the role, rather than over
        pairs with one end in it.

    Returns
    -------
    Statistics
    """
    arena, n_zones = located.arena, len(located.arena.zones)
    present = located.zone > 0
    ends = role[present]
    points = located.take(present)
    own = points.take(ends)
    transition, speed = _steps(own)
    return Statistics(
        zone_names=arena.zone_names,
        distance=_pairs(points, ends, within=pairs_within),
        wall=count_by_zone(
            own.zone, own.wall_distance_m, limits=arena.bins.wall_distance_m, n_zones=n_zones
        ),
        occupation=np.bincount(own.zone, minlength=n_zones + 1)[1:].astype(np.int64),
        transition=transition,
        speed=speed,
        n_settled=int(located.settled[role].sum()),
        n_void=int((role & ~present).sum()),
    )


def _pairs(points: Located, role: Bools, *, within: bool) -> Ints:
    """Count distances of pairs in one zone at one sample."""
    limits, n_zones = points.arena.bins.distance_m, len(points.arena.zones)
    counts = np.zeros((n_zones, N_BINS), dtype=np.int64)
    # The points of a sample follow each other: compare each with the next, the one after, ...
    # This needs no table of agents, whatever the number of track ids.
    for lag in range(1, len(points)):
        together = points.k[lag:] == points.k[:-lag]
        if not together.any():
            break
        wanted = role[lag:] & role[:-lag] if within else role[lag:] ^ role[:-lag]
        first = np.flatnonzero(together & wanted & (points.zone[lag:] == points.zone[:-lag]))
        apart_m = _length(points.xy_m[first + lag] - points.xy_m[first])
        counts += count_by_zone(points.zone[first], apart_m, limits=limits, n_zones=n_zones)
    return counts


def _steps(points: Located) -> tuple[Ints, Ints]:
    """Count steps from zone to zone, and their speeds by the zone where they start."""
    n_zones = len(points.arena.zones)
    order = np.argsort(points.agent, kind="stable")
    agent, k = points.agent[order], points.k[order]
    follows = (agent[1:] == agent[:-1]) & (k[1:] == k[:-1] + 1)
    start, end = order[:-1][follows], order[1:][follows]
    zone = points.zone.astype(np.intp) - 1
    transition = count_cells(zone[start] * n_zones + zone[end], (n_zones, n_zones))
    speed_m_s = _length(points.xy_m[end] - points.xy_m[start]) / points.dt_s
    speed = count_by_zone(
        points.zone[start], speed_m_s, limits=points.arena.bins.speed_m_s, n_zones=n_zones
    )
    return transition, speed


def _length(xy_m: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.hypot(xy_m[:, 0], xy_m[:, 1])

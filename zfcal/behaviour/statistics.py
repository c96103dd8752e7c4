"""The counts that describe a group in a window: D, W, O, T and V.

Names of features are the paper's. Counts, not frequencies, so that windows can
be pooled; what is counted is in ``features``, what is alike about two of them in ``scores``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np

from zfcal.arena import N_BINS, Arena
from zfcal.arrays import Bools, Indices, Ints
from zfcal.behaviour.features.registry import named
from zfcal.behaviour.features.statistic import Points, count, count_each
from zfcal.behaviour.located import Located, SamplesOrLocated, locate
from zfcal.errors import InputError
from zfcal.tracks import ROBOT

ATTRIBUTES: Mapping[str, str] = MappingProxyType(
    {"D": "distance", "W": "wall", "O": "occupation", "T": "transition", "V": "speed"}
)
"""Under which names the statistics that the compiled simulation counts are held."""

_SUMMED = tuple(ATTRIBUTES.values())


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
    further
        Counts of further statistics by name, shape as `Statistic.shape` says.
    """

    zone_names: tuple[str, ...]
    distance: Ints
    wall: Ints
    occupation: Ints
    transition: Ints
    speed: Ints
    n_settled: int = 0
    n_void: int = 0
    further: Mapping[str, Ints] = field(default_factory=dict)

    def __post_init__(self) -> None:
        n = len(self.zone_names)
        shapes = {
            "distance": (n, N_BINS),
            "wall": (n, N_BINS),
            "occupation": (n,),
            "transition": (n, n),
            "speed": (n, N_BINS),
        }
        for name, counts in self.further.items():
            if counts.ndim not in {1, 2} or counts.dtype != np.int64 or (counts < 0).any():
                raise InputError(
                    f"Statistic {name} needs counts of one or two axes, got {counts.dtype} of "
                    f"shape {counts.shape}, least {counts.min(initial=0)}."
                )
        for name, shape in shapes.items():
            counts = getattr(self, name)
            if counts.shape != shape or counts.dtype != np.int64 or (counts < 0).any():
                raise InputError(
                    f"Statistics of {n} zones need {name} as counts of shape {shape}, "
                    f"got {counts.dtype} of shape {counts.shape}, least {counts.min(initial=0)}."
                )

    def of(self, name: str) -> Ints:
        """Return the counts of the statistic with a name.

        Raises
        ------
        InputError
            It was not counted.
        """
        if name in ATTRIBUTES:
            counts: Ints = getattr(self, ATTRIBUTES[name])
            return counts
        if name not in self.further:
            raise InputError(
                f"Statistic {name} was not counted, only {', '.join(self.names)}.",
                hint=f"Count it with: zfcal analyse TRIAL --features {name}",
            )
        return self.further[name]

    @property
    def names(self) -> tuple[str, ...]:
        """What was counted: D, W, O, T, V and the further statistics."""
        return (*ATTRIBUTES, *self.further)

    def __add__(self, other: Statistics) -> Statistics:
        return self._joined(other, np.add)

    def __sub__(self, part: Statistics) -> Statistics:
        return self._joined(part, np.subtract)

    def _joined(self, other: Statistics, join: np.ufunc) -> Statistics:
        check_zones(self.zone_names, other.zone_names)
        if set(self.names) != set(other.names):
            raise InputError(
                f"Statistics hold different ones: {', '.join(self.names)} and "
                f"{', '.join(other.names)}."
            )
        counts = {name: join(getattr(self, name), getattr(other, name)) for name in _SUMMED}
        return Statistics(
            zone_names=self.zone_names,
            n_settled=int(join(self.n_settled, other.n_settled)),
            n_void=int(join(self.n_void, other.n_void)),
            further={name: join(own, other.further[name]) for name, own in self.further.items()},
            **counts,
        )


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


def measure(samples: SamplesOrLocated, arena: Arena, *, further: Sequence[str] = ()) -> Statistics:
    """Count what all the given agents did.

    Parameters
    ----------
    samples
        The agents of a window; take those of one kind for the control case.
    arena
        Gives zones, walls and the ranges of the bins.
    further
        Names of statistics to count beside D, W, O, T and V.

    Returns
    -------
    Statistics
        Missing agents (NaN) and those in the void count nowhere. A step counts
        when one track id is inside at sample k and at k + 1 of the window.
    """
    located = locate(samples, arena)
    everybody = np.ones(len(located), dtype=np.bool_)
    return measure_role(located, everybody, pairs_within=True, further=further)


def measure_robot(
    samples: SamplesOrLocated, arena: Arena, *, further: Sequence[str] = ()
) -> Statistics:
    """Count what the robot did: its own W, O, T and V, and D of robot-fish pairs.

    Parameters
    ----------
    samples
        Fish and robots of a window.
    arena
        Gives zones, walls and the ranges of the bins.
    further
        Names of statistics to count beside D, W, O, T and V.

    Returns
    -------
    Statistics
        Several robots are pooled; pairs of two robots do not count.
    """
    located = locate(samples, arena)
    return measure_role(located, located.kind == ROBOT, further=further)


def measure_role(
    located: Located, role: Bools, *, pairs_within: bool = False, further: Sequence[str] = ()
) -> Statistics:
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
    further
        Names of statistics to count beside D, W, O, T and V.

    Returns
    -------
    Statistics
    """
    present = located.zone > 0
    points = Points(located=located.take(present), role=role[present], within=pairs_within)
    return Statistics(
        zone_names=located.arena.zone_names,
        **{attribute: count(named(name), points) for name, attribute in ATTRIBUTES.items()},
        n_settled=int(located.settled[role].sum()),
        n_void=int((role & ~present).sum()),
        further={name: count(named(name), points) for name in further},
    )


def measure_each(located: Located, column: Indices, n_columns: int) -> Ints:
    """Count what each of several agents did, and its distances to all the others.

    Parameters
    ----------
    located
        All agents of a window.
    column : ndarray of int, shape (point,)
        Whose point it is, from 0; one agent may have several track ids.
    n_columns
        How many agents there are.

    Returns
    -------
    ndarray of int64, shape (column, count)
        For each agent the counts that `measure_role` finds for it alone, in the
        order of `from_counts`; no further statistics.
    """
    present = located.zone > 0
    seen, who = located.take(present), column[present]
    points = Points(located=seen, role=np.ones(len(seen), dtype=np.bool_), within=True)
    n_settled = np.bincount(column[located.settled], minlength=n_columns)
    n_void = np.bincount(column[~present], minlength=n_columns)
    parts = [count_each(named(name), points, who, n_columns) for name in ATTRIBUTES]
    return np.concatenate(
        [part.reshape(n_columns, -1) for part in (*parts, n_settled, n_void)], axis=1
    )


def n_counts(n_zones: int) -> int:
    """Return how many counts statistics of so many zones hold."""
    return n_zones * (3 * N_BINS + 1 + n_zones) + 2


def from_counts(counts: Ints, zone_names: tuple[str, ...]) -> Statistics:
    """Return statistics from their counts one after the other, as `measure_each` gives them.

    Parameters
    ----------
    counts : ndarray of int64, shape (count,)
        D, W, O, T, V, settled and void, in the order of the zones.
    zone_names
        The arena's zones.
    """
    n = len(zone_names)
    shapes = ((n, N_BINS), (n, N_BINS), (n,), (n, n), (n, N_BINS))
    *parts, rest = np.split(counts, np.cumsum([math.prod(shape) for shape in shapes]))
    arrays: dict[str, Any] = {
        name: part.reshape(shape)
        for name, part, shape in zip(ATTRIBUTES.values(), parts, shapes, strict=True)
    }
    return Statistics(zone_names=zone_names, n_settled=int(rest[0]), n_void=int(rest[1]), **arrays)

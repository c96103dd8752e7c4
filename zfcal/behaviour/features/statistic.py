"""What a statistic of a group is, and how its observations become counts.

The statistics themselves are beside it, one file each, and are found by ``registry``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal

import numpy as np

from zfcal.arena import N_BINS, Arena
from zfcal.arrays import Bools, Floats, Indices, Ints
from zfcal.behaviour.histograms import bin_of, similarity
from zfcal.behaviour.located import Located
from zfcal.errors import InputError

GROUP_ROW = "all"
"""What the zone column says of a statistic that belongs to the group and to no zone."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Points:
    """What a statistic looks at: where everybody was in a window, and who counts.

    Parameters
    ----------
    located
        All agents of the window that are in a zone, sorted by sample, then agent.
    role : ndarray of bool, shape (point,)
        The points that count.
    within
        Whether pairs have both ends in the role, rather than one.
    """

    located: Located
    role: Bools
    within: bool

    @cached_property
    def own(self) -> Indices:
        """Indices of the points in the role, shape (own,)."""
        return np.flatnonzero(self.role)

    @cached_property
    def moves(self) -> tuple[Indices, Indices]:
        """Indices of the points where steps of agents in the role start and end.

        A step joins one track id at sample k and k + 1.
        """
        agent, k = self.located.agent[self.own], self.located.k[self.own]
        order = np.argsort(agent, kind="stable")
        agent, k = agent[order], k[order]
        follows = (agent[1:] == agent[:-1]) & (k[1:] == k[:-1] + 1)
        return self.own[order[:-1][follows]], self.own[order[1:][follows]]

    def pairs(self) -> Iterator[tuple[Indices, Indices]]:
        """Yield the ends of pairs of agents that are seen at one sample, each pair once."""
        # The points of a sample follow each other: compare each with the next, the one after, ...
        # This needs no table of agents, whatever the number of track ids.
        k, role = self.located.k, self.role
        for lag in range(1, len(k)):
            together = k[lag:] == k[:-lag]
            if not together.any():
                break
            wanted = role[lag:] & role[:-lag] if self.within else role[lag:] ^ role[:-lag]
            first = np.flatnonzero(together & wanted)
            yield first, first + lag


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Observed:
    """Some observations of a statistic.

    Parameters
    ----------
    at : ndarray of int, shape (observation,)
        The point whose zone and agent an observation belongs to; of a statistic of the
        group any point of the sample.
    value : ndarray, shape (observation,)
        In the statistic's unit; for a table the id of the zone that is reached. What
        stands here has no meaning for a statistic that counts zones alone.
    also : ndarray of int, shape (observation,)
        The other end of a pair; None where an observation is of one agent.
    """

    at: Indices
    value: Floats | Ints
    also: Indices | None = None


Observe = Callable[[Points], Iterator[Observed]]
Form = Literal["bins", "zones", "table"]
Draw = Callable[[Any, Mapping[str, Ints]], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Statistic:
    """One way to describe what a group does, as counts.

    Parameters
    ----------
    name
        What the feature column of a file says.
    label
        What a figure of scores calls it.
    phrase
        What a sentence calls it, such as ``the distances to the wall``.
    observe
        Gives the observations of some points.
    form
        ``bins``: a histogram of values, in each zone or of the group. ``zones``: one
        histogram over the zones. ``table``: for each zone a histogram over the zones.
    edges
        For ``bins``: gives the edges of the bins in an arena, ascending; at most ten bins.
        A bin holds its lower edge, the last one what lies beyond as well, and the first
        what lies below.
    bounded
        For ``bins``: whether nothing can lie beyond the last edge. Where something can,
        pictures set the last bin apart.
    per_zone
        For ``bins``: whether each zone has a histogram, rather than the group.
    unit
        Of the values; empty for a pure number.
    title
        Of its panel in a picture.
    axis
        What the values are, for the axis of that panel.
    source
        Where the definition comes from.
    compare
        How alike two histograms are, along the last axis; 1 for equal, NaN for neither seen.
    drawn
        Whether pictures show it.
    draw
        Draws the counts of each case into axes of matplotlib instead of the usual panel.
    """

    name: str
    label: str
    phrase: str
    observe: Observe = field(repr=False)
    form: Form = "bins"
    edges: Callable[[Arena], Floats] | None = None
    bounded: bool = False
    per_zone: bool = True
    unit: str = ""
    title: str = ""
    axis: str = ""
    source: str = ""
    compare: Callable[[Any, Any], Floats] = similarity
    drawn: bool = True
    draw: Draw | None = None

    def __post_init__(self) -> None:
        if not self.name or not self.name.replace("_", "").replace("-", "").isalnum():
            raise InputError(
                f"A statistic's name is made of letters, digits, - and _, got {self.name!r}."
            )
        if (self.form == "bins") != (self.edges is not None):
            raise InputError(
                f"Statistic {self.name!r}: form 'bins' needs edges and no other has any, "
                f"got form {self.form!r}."
            )
        if self.form != "bins" and not self.per_zone:
            raise InputError(f"Statistic {self.name!r}: only one of bins can be of the group.")

    def edges_in(self, arena: Arena) -> Floats:
        """Return the edges of the bins in an arena, shape (bin + 1,).

        Raises
        ------
        InputError
            They do not ascend, or are of no bin or more than ten.
        """
        if self.edges is None:
            raise InputError(f"Statistic {self.name!r} counts zones and has no bins.")
        edges = np.asarray(self.edges(arena), dtype=np.float64)
        if not 2 <= len(edges) <= N_BINS + 1 or not (np.diff(edges) > 0).all():
            raise InputError(
                f"Statistic {self.name!r} needs ascending edges of 1 to {N_BINS} bins, got {edges}."
            )
        return edges

    def shape(self, arena: Arena) -> tuple[int, ...]:
        """Return the shape of its counts: (zone, bin), (1, bin), (zone,) or (zone, zone)."""
        n = len(arena.zones)
        if self.form == "zones":
            return (n,)
        if self.form == "table":
            return (n, n)
        return (n if self.per_zone else 1, len(self.edges_in(arena)) - 1)


def count(statistic: Statistic, points: Points) -> Ints:
    """Count a statistic's observations, shape as `Statistic.shape`."""
    one = np.zeros(len(points.located), dtype=np.intp)
    return count_each(statistic, points, one, 1, ends=False)[0]


def count_each(
    statistic: Statistic, points: Points, column: Indices, n_columns: int, *, ends: bool = True
) -> Ints:
    """Count a statistic's observations for each of several agents.

    Parameters
    ----------
    statistic
        What to count.
    points
        Of all agents.
    column : ndarray of int, shape (point,)
        Whose point it is, from 0.
    n_columns
        How many agents there are.
    ends
        Whether a pair counts for both of its ends, rather than once for the first.

    Returns
    -------
    ndarray of int64, shape (column, ...)
        For each agent counts of `Statistic.shape`.
    """
    shape = statistic.shape(points.located.arena)
    size = int(np.prod(shape))
    edges = statistic.edges_in(points.located.arena) if statistic.form == "bins" else None
    zone = points.located.zone.astype(np.intp) - 1
    total = np.zeros(n_columns * size, dtype=np.int64)
    for seen in statistic.observe(points):
        value = _zone_index(seen.value) if edges is None else bin_of(seen.value, edges)
        for at in (seen.at, seen.also) if ends else (seen.at,):
            if at is None:
                continue
            row = zone[at] if statistic.per_zone else 0
            cell = row if statistic.form == "zones" else row * shape[-1] + value
            total += np.bincount(column[at] * size + cell, minlength=len(total))
    return total.reshape(n_columns, *shape)


def _zone_index(ids: Floats | Ints) -> Indices:
    return np.asarray(ids, dtype=np.intp) - 1


def lengths(xy_m: Floats) -> Floats:
    """Return the lengths of vectors, shape (vector,)."""
    return np.hypot(xy_m[:, 0], xy_m[:, 1])

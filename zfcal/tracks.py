"""Positions of agents over time: as measured (rows) and on the model's clock.

The two shapes in which every other part sees a trial. Files are read in
``artifacts``; statistics are taken in ``behaviour``.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Bools, Floats, Floats32, Indices, Ints
from zfcal.errors import InputError

FISH = 0
ROBOT = 1
KINDS = ("fish", "robot")
"""Names of the kinds, in the order of their codes."""

GUESS = 0.5
"""A position of a lower confidence is a guess. It counts as a place wherever places count, and is
seen by the others; no step of a likelihood begins or ends in it, and no robot is driven by it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Tracks:
    """One row per agent and frame in which it was seen; sorted by frame, then agent.

    Parameters
    ----------
    time_s : ndarray of float64, shape (row,)
        Seconds since the start of the trial.
    frame : ndarray of int64, shape (row,)
    agent : ndarray of int32, shape (row,)
        Track id, unique in the trial; a lost agent returns under a new id.
    kind : ndarray of int8, shape (row,)
        Index into `KINDS`.
    x_m, y_m : ndarray of float64, shape (row,)
        Position in metres, finite.
    heading_rad : ndarray of float32, shape (row,)
        Counter-clockwise from x; NaN where unknown.
    confidence : ndarray of float32, shape (row,)
        In [0, 1]; below `GUESS` a position is a guess.
    """

    time_s: Floats
    frame: Ints
    agent: NDArray[np.int32]
    kind: NDArray[np.int8]
    x_m: Floats
    y_m: Floats
    heading_rad: Floats32
    confidence: Floats32

    def __post_init__(self) -> None:
        sizes = {field.name: getattr(self, field.name).shape for field in fields(self)}
        if len(set(sizes.values())) != 1 or self.frame.ndim != 1:
            raise InputError(f"Tracks need columns of one length, got {sizes}.")

    def __len__(self) -> int:
        return len(self.frame)

    def take(self, rows: Bools | Indices | slice) -> Tracks:
        """Return the chosen rows, in the order in which they are chosen."""
        return Tracks(**{f.name: getattr(self, f.name)[rows] for f in fields(self)})


def concatenate(parts: list[Tracks]) -> Tracks:
    """Return the rows of several tracks, sorted by frame, then agent."""
    joined = Tracks(
        **{
            f.name: np.concatenate([getattr(part, f.name) for part in parts])
            for f in fields(Tracks)
        }
    )
    return joined.take(np.lexsort((joined.agent, joined.frame)))


@dataclass(frozen=True, slots=True, kw_only=True)
class AgentPose:
    """Where one agent is.

    Parameters
    ----------
    agent
        Track id, unique in the trial.
    kind
        Index into `KINDS`.
    x_m, y_m
        In metres.
    heading_rad
        Counter-clockwise from x; NaN where unknown.
    confidence
        In [0, 1].
    """

    agent: int
    kind: int
    x_m: float
    y_m: float
    heading_rad: float
    confidence: float


@dataclass(frozen=True, slots=True, kw_only=True)
class FramePoses:
    """Where everybody is in one frame, by ascending id."""

    time_s: float
    frame: int
    agents: tuple[AgentPose, ...]


def tracks_of(frames: Iterable[FramePoses]) -> Tracks:
    """Return the rows of frames, which come in order."""
    rows = [(poses, agent) for poses in frames for agent in poses.agents]
    return Tracks(
        time_s=np.array([poses.time_s for poses, _ in rows], np.float64),
        frame=np.array([poses.frame for poses, _ in rows], np.int64),
        agent=np.array([agent.agent for _, agent in rows], np.int32),
        kind=np.array([agent.kind for _, agent in rows], np.int8),
        x_m=np.array([agent.x_m for _, agent in rows], np.float64),
        y_m=np.array([agent.y_m for _, agent in rows], np.float64),
        heading_rad=np.array([agent.heading_rad for _, agent in rows], np.float32),
        confidence=np.array([agent.confidence for _, agent in rows], np.float32),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Samples:
    """Agents on the model's clock: sample k is the state at ``k * dt_s``.

    Parameters
    ----------
    dt_s
        The model's step, in seconds.
    k : ndarray of int64, shape (sample,)
        Sample numbers, ascending and without gaps.
    agent : ndarray of int32, shape (agent,)
        Track ids, ascending.
    kind : ndarray of int8, shape (agent,)
        Index into `KINDS`.
    xy_m : ndarray of float64, shape (sample, agent, 2)
        Positions in metres; NaN where an agent is missing. Never interpolated.
    confidence : ndarray of float32, shape (sample, agent)
        NaN where an agent is missing.
    """

    dt_s: float
    k: Ints
    agent: NDArray[np.int32]
    kind: NDArray[np.int8]
    xy_m: Floats
    confidence: Floats32

    @property
    def guessed(self) -> Bools:
        """Whether a position is a guess, shape (sample, agent); False where there is none."""
        return np.asarray(self.confidence < GUESS)

    def of_kind(self, kind: int) -> Samples:
        """Return the samples of one kind of agent only."""
        return self.take_agents(self.kind == kind)

    def take_agents(self, chosen: Bools | Indices) -> Samples:
        """Return the samples of the chosen agents."""
        return Samples(
            dt_s=self.dt_s,
            k=self.k,
            agent=self.agent[chosen],
            kind=self.kind[chosen],
            xy_m=self.xy_m[:, chosen],
            confidence=self.confidence[:, chosen],
        )


def joined(parts: Iterable[Samples], *, first: int, stop: int) -> Samples:
    """Return the samples of consecutive parts of a recording, such as its segments.

    Parameters
    ----------
    parts
        One at least, of one step; in order of time, none overlapping. What lies between two
        of them is missing.
    first, stop
        The samples are ``range(first, stop)``; agents that are in none of them are left out.

    Raises
    ------
    InputError
        There is no part, they differ in their step, or an agent is of two kinds.
    """
    parts = list(parts)
    if not parts or any(part.dt_s != parts[0].dt_s for part in parts):
        steps = sorted({part.dt_s for part in parts})
        raise InputError(f"Samples to join must be of one step dt_s, got {steps}.")
    kept = [_between(part, first, stop) for part in parts]
    agent, row, column = np.unique(
        np.concatenate([part.agent for part in kept]), return_index=True, return_inverse=True
    )
    kinds = np.concatenate([part.kind for part in kept])
    changed = np.flatnonzero(kinds != kinds[row][column])
    if changed.size:
        who = int(agent[column[changed[0]]])
        raise InputError(f"Tracks: agent {who} is of two kinds; an id belongs to one agent.")
    shape = (max(stop - first, 0), len(agent))
    xy_m = np.full((*shape, 2), np.nan)
    confidence = np.full(shape, np.nan, dtype=np.float32)
    for part, columns in zip(kept, _pieces(column, [len(p.agent) for p in kept]), strict=True):
        at = np.ix_(part.k - first, columns)
        xy_m[at], confidence[at] = part.xy_m, part.confidence
    return Samples(
        dt_s=parts[0].dt_s,
        k=np.arange(first, first + shape[0], dtype=np.int64),
        agent=agent,
        kind=kinds[row],
        xy_m=xy_m,
        confidence=confidence,
    )


def _between(part: Samples, first: int, stop: int) -> Samples:
    """Return the samples from one to another, and the agents that are in them."""
    rows = (part.k >= first) & (part.k < stop)
    xy_m, confidence = part.xy_m[rows], part.confidence[rows]
    cut = replace(part, k=part.k[rows], xy_m=xy_m, confidence=confidence)
    return cut.take_agents(np.flatnonzero((~np.isnan(xy_m[..., 0])).any(axis=0)))


def _pieces(values: Indices, sizes: list[int]) -> list[Indices]:
    return np.split(values, np.cumsum(sizes)[:-1])

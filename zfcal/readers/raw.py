"""What a file holds, in its own unit and axes, before anything is decided about it."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Floats, Ints
from zfcal.readers.options import Idle
from zfcal.tracks import KINDS

_NAMED = re.compile(rf"(?P<kind>{'|'.join(KINDS)})_(?P<number>\d+)")
"""What `zfcal export` calls agents: the kind, and the track id."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Rows:
    """One row per agent and frame.

    Parameters
    ----------
    time_s : ndarray of float64, shape (row,)
        Seconds since the start of the trial.
    frame, agent : ndarray of int64, shape (row,)
    x, y : ndarray of float64, shape (row,)
        In `unit`; NaN where the agent is missing.
    unit
        ``m``, ``cm``, ``mm`` or ``px``.
    heading_rad : ndarray of float64, shape (row,), optional
        From x towards y, in the file's axes; NaN where unknown.
    confidence : ndarray of float64, shape (row,), optional
        In [0, 1]; NaN is taken as certain.
    kind : ndarray of int8, shape (row,), optional
        Index into `zfcal.tracks.KINDS`; all are fish without it.
    names
        What the file calls an agent, by agent number.
    y_down
        Whether the format is known to count y downwards.
    notes
        What a person should know of the file, a sentence each.
    idle
        Options of its format that take no effect in this file.
    """

    time_s: Floats
    frame: Ints
    agent: Ints
    x: Floats
    y: Floats
    unit: str
    heading_rad: Floats | None = None
    confidence: Floats | None = None
    kind: NDArray[np.int8] | None = None
    names: Mapping[int, str] = field(default_factory=dict)
    y_down: bool = True
    notes: tuple[str, ...] = ()
    idle: Idle = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class Grid:
    """Every agent in every frame.

    Parameters
    ----------
    xy : ndarray of float64, shape (frame, agent, 2)
        In `unit`; NaN where the agent is missing.
    frame : ndarray of int64, shape (frame,)
    time_s : ndarray of float64, shape (frame,)
        Seconds since the start of the trial.
    unit
        ``m``, ``cm``, ``mm`` or ``px``.
    heading_rad, confidence : ndarray of float64, shape (frame, agent), optional
        As in `Rows`.
    names
        Names of the agents, in the order of the columns.
    y_down, notes
        As in `Rows`.
    """

    xy: Floats
    frame: Ints
    time_s: Floats
    unit: str
    heading_rad: Floats | None = None
    confidence: Floats | None = None
    names: tuple[str, ...] = ()
    y_down: bool = True
    notes: tuple[str, ...] = ()

    def rows(self) -> Rows:
        """Return the same, one row per agent and frame.

        Agents keep their names where these are whole numbers. Those that are all called
        ``fish_3`` or ``robot_4``, as `zfcal export` has it, get that number and kind; else they
        are numbered from 0, in the order of the columns.
        """
        n_frames, n_agents = self.xy.shape[:2]
        numbers, kinds = self._known()
        agents = np.array(numbers if len(set(numbers)) == n_agents else range(n_agents))
        return Rows(
            time_s=np.repeat(self.time_s, n_agents),
            frame=np.repeat(self.frame, n_agents),
            agent=np.tile(agents.astype(np.int64), n_frames),
            x=self.xy[..., 0].ravel(),
            y=self.xy[..., 1].ravel(),
            unit=self.unit,
            heading_rad=None if self.heading_rad is None else self.heading_rad.ravel(),
            confidence=None if self.confidence is None else self.confidence.ravel(),
            kind=np.tile(kinds, n_frames) if len(kinds) == n_agents else None,
            names=dict(zip(agents.tolist(), self.names, strict=False)),
            y_down=self.y_down,
            notes=self.notes,
        )

    def _known(self) -> tuple[list[int], NDArray[np.int8]]:
        """Return the numbers and the kinds that the names tell; empty where one tells none."""
        named = [match for name in self.names if (match := _NAMED.fullmatch(name))]
        if len(named) == len(self.names):
            kinds = [KINDS.index(match["kind"]) for match in named]
            return [int(match["number"]) for match in named], np.array(kinds, dtype=np.int8)
        is_numbered = all(map(str.isdecimal, self.names))
        return [int(name) for name in self.names] if is_numbered else [], np.empty(0, np.int8)

"""An effect's own statistic by place, minute, agent and cue: a trace made small enough to keep.

The steps of a recording are many; what a person looks at is a few hundred numbers, which
stand in the findings, so that a page can be drawn again without a new diagnosis.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from zfcal.arena import Arena
from zfcal.arrays import Floats, Ints
from zfcal.diagnose.findings import Trace

_CELLS = 24
"""Squares of the map along the longer side of the tank."""

_MINUTE_S = 60.0
MOST_AGENTS = 12


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Parts:
    """An effect's statistic, averaged over the steps of each part of a recording.

    Parameters
    ----------
    label : ndarray of int, shape (part,)
        What the parts are: the minute they begin with, or a track id.
    n : ndarray of int, shape (part,)
        Steps in each.
    before, after : ndarray, shape (part,)
        Mean efficient score in units of its standard deviation over all steps: zero
        where the model is right. NaN without a step.
    """

    label: Ints
    n: Ints
    before: Floats
    after: Floats

    @property
    def half_width(self) -> Floats:
        """Half the 95 % interval of a right model's mean, shape (part,); NaN without a step."""
        return np.where(self.n > 0, 1.96 / np.sqrt(np.maximum(self.n, 1)), np.nan)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Curve:
    """What was measured and expected against what the effect responds to.

    Parameters
    ----------
    cue, observed, before, after : ndarray, shape (bin,)
        Middle of the bin; mean response as measured, and as the models without and with
        the effect expect it.
    cue_name, response_name
        With units.
    """

    cue: Floats
    observed: Floats
    before: Floats
    after: Floats
    cue_name: str
    response_name: str


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pictured:
    """All that the pictures of one finding show.

    Parameters
    ----------
    origin_m, cell_m
        Lower left corner of the map, and the side of its squares, in metres.
    place_n : ndarray of int, shape (row, column)
        Steps that began in each square; rows go up (y), columns right (x).
    place : ndarray, shape (row, column)
        Mean score there, as in `Parts`; NaN where nobody was.
    minutes, agents
        By minute of the trial, and by track: the longest ones.
    curve
        Against what the effect responds to.
    """

    origin_m: tuple[float, float]
    cell_m: float
    place_n: Ints
    place: Floats
    minutes: Parts
    agents: Parts
    curve: Curve


def picture_of(trace: Trace, arena: Arena) -> Pictured:
    """Return what the pictures of a finding show.

    Parameters
    ----------
    trace
        The effect's own statistic, step by step.
    arena
        Gives the extent of the map.
    """
    scale = _scale(trace.before)
    before, after = trace.before / scale, trace.after / scale
    x0, y0, x1, y1 = arena.outline.bounds
    cell_m = arena.extent_m / _CELLS
    shape = tuple(max(1, int(np.ceil(side / cell_m - 1e-9))) for side in (y1 - y0, x1 - x0))
    row, column = (
        np.clip(((at - low) / cell_m).astype(np.int64), 0, size - 1)
        for at, low, size in ((trace.y_m, y0, shape[0]), (trace.x_m, x0, shape[1]))
    )
    squares = _averages(row * shape[1] + column, before, after, shape[0] * shape[1])
    minute = (trace.time_s // _MINUTE_S).astype(np.int64)
    first = int(minute.min()) if len(minute) else 0
    count = int(minute.max()) - first + 1 if len(minute) else 0
    by_minute = _averages(minute - first, before, after, count)
    return Pictured(
        origin_m=(float(x0), float(y0)),
        cell_m=float(cell_m),
        place_n=squares.n.reshape(shape),
        place=squares.before.reshape(shape),
        minutes=Parts(
            label=by_minute.label + first,
            n=by_minute.n,
            before=by_minute.before,
            after=by_minute.after,
        ),
        agents=_by_agent(trace.track, before, after),
        curve=Curve(
            cue=trace.cue,
            observed=trace.observed,
            before=trace.expected_before,
            after=trace.expected_after,
            cue_name=trace.cue_name,
            response_name=trace.response_name,
        ),
    )


def _scale(scores: Floats) -> float:
    size = float(np.sqrt(np.mean(scores**2))) if len(scores) else 0.0
    return size if size > 0 else 1.0


def _averages(part: Ints, before: Floats, after: Floats, n_parts: int) -> Parts:
    n = np.bincount(part, minlength=n_parts)
    some = np.maximum(n, 1)
    means = [
        np.where(n > 0, np.bincount(part, weights=scores, minlength=n_parts) / some, np.nan)
        for scores in (before, after)
    ]
    return Parts(label=np.arange(n_parts), n=n, before=means[0], after=means[1])


def _by_agent(track: NDArray[np.int32], before: Floats, after: Floats) -> Parts:
    """Return the averages of the tracks with the most steps, in the order of their ids."""
    ids, part = np.unique(track, return_inverse=True)
    found = _averages(part.astype(np.int64), before, after, len(ids))
    kept = np.sort(np.argsort(-found.n, kind="stable")[:MOST_AGENTS])
    return Parts(
        label=ids[kept].astype(np.int64),
        n=found.n[kept],
        before=found.before[kept],
        after=found.after[kept],
    )

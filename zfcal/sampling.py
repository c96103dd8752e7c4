"""From rows at the camera's rate to the states at the model's step.

Sample k is the frame nearest to ``k * dt_s`` since the start of the trial,
within half a frame. Nothing is interpolated: an agent that is not in that
frame is missing in that sample.
"""

from __future__ import annotations

import math

import numpy as np

from zfcal.arrays import Bools, Floats, Ints
from zfcal.errors import InputError
from zfcal.tracks import Samples, Tracks

_SLACK = 1e-6
"""Share of a frame or a step below which a difference of times is rounding."""


def sample_range(start_s: float, end_s: float, *, dt_s: float) -> tuple[int, int]:
    """Return the first sample of a stretch of time and the one after its last.

    Parameters
    ----------
    start_s, end_s
        Seconds since the start of the trial: ``start_s <= k * dt_s < end_s``.
    dt_s
        The model's step, in seconds.

    Returns
    -------
    tuple of int
        ``k`` runs over ``range(first, stop)``.

    Raises
    ------
    InputError
        The step is not positive, or the end lies before the start.
    """
    if not 0 < dt_s < math.inf:
        raise InputError(f"The step dt_s must be a positive time in seconds, got {dt_s!r}.")
    if not -math.inf < start_s <= end_s < math.inf:
        raise InputError(f"A window must end after it starts, got {start_s!r} s to {end_s!r} s.")
    # 600 * 0.2 is exact, 360 * (1 / 3) too, 1800 * (3 / 15) need not be.
    first, stop = (math.ceil(edge_s / dt_s - _SLACK) for edge_s in (start_s, end_s))
    return first, stop


def sample(tracks: Tracks, *, fps: float, dt_s: float, start_s: float, end_s: float) -> Samples:
    """Take the agents' states on the model's clock.

    A sample near an edge may be a frame just outside the window, so give rows
    of half a frame more on both sides where there are any.

    Parameters
    ----------
    tracks
        Rows that cover the window; others are ignored.
    fps
        Frame rate in hertz.
    dt_s
        The model's step in seconds, at least one frame.
    start_s, end_s
        The samples with ``start_s <= k * dt_s < end_s``.

    Returns
    -------
    Samples
        Every such k, and the agents that are in at least one of them. A frame
        as near as the next is left for the sample after, so none is used twice.

    Raises
    ------
    InputError
        Rows are out of order, a frame has two times, an agent two kinds or two
        rows in a frame, or the step is shorter than a frame.
    """
    if not fps > 0 or not dt_s * fps >= 1 - 1e-3:
        raise InputError(
            f"The step must be at least one frame, got dt_s = {dt_s!r} s at fps = {fps!r} Hz.",
            hint="dt_s in trial.toml is a whole number of frame intervals.",
        )
    k = np.arange(*sample_range(start_s, end_s, dt_s=dt_s), dtype=np.int64)
    first_row, time_s = _frames(tracks)
    chosen = _nearest(time_s, k * np.float64(dt_s), half_s=0.5 / fps)
    seen = chosen >= 0
    bounds = np.append(first_row, len(tracks))
    n_rows = np.diff(bounds)[chosen[seen]]
    row = _ranges(first_row[chosen[seen]], n_rows)
    return _fill(tracks, k, dt_s, row=row, at=np.repeat(np.flatnonzero(seen), n_rows))


def _frames(tracks: Tracks) -> tuple[Ints, Floats]:
    """Return each frame's first row and its time, having checked their order."""
    if not len(tracks):
        return np.zeros(0, dtype=np.int64), np.zeros(0)
    step = np.diff(tracks.frame)
    disordered = (step < 0) | ((step == 0) & (np.diff(tracks.agent) <= 0))
    _refuse(disordered, tracks, "rows must be sorted by frame, then agent, one a frame and agent")
    _refuse((step == 0) & (np.diff(tracks.time_s) != 0), tracks, "a frame has one time")
    first = np.concatenate([[0], np.flatnonzero(step) + 1]).astype(np.int64)
    _refuse((step > 0) & ~(np.diff(tracks.time_s) > 0), tracks, "time must grow with the frame")
    return first, tracks.time_s[first]


def _refuse(wrong: Bools, tracks: Tracks, rule: str) -> None:
    if wrong.any():
        row = int(np.flatnonzero(wrong)[0])
        a, b = (
            f"frame {tracks.frame[r]}, agent {tracks.agent[r]}, {tracks.time_s[r]:.6g} s"
            for r in (row, row + 1)
        )
        raise InputError(
            f"Tracks: {rule}; got {a} and then {b} (rows {row} and {row + 1}).",
            hint="Import the recording again; zfcal import sorts and checks what it reads.",
        )


def _nearest(time_s: Floats, wanted_s: Floats, *, half_s: float) -> Ints:
    """Return the index of the frame nearest to each time; -1 where none is near enough."""
    if not len(time_s):
        return np.full(len(wanted_s), -1, dtype=np.int64)
    slack_s = 2 * half_s * _SLACK
    after = np.searchsorted(time_s, wanted_s).clip(0, len(time_s) - 1)
    before = (after - 1).clip(0)
    later = time_s[after] - wanted_s <= wanted_s - time_s[before] + slack_s
    nearest = np.where(later, after, before)
    away_s = time_s[nearest] - wanted_s
    near = (away_s > -half_s + slack_s) & (away_s <= half_s + slack_s)
    return np.where(near, nearest, -1).astype(np.int64)


def _ranges(start: Ints, length: Ints) -> Ints:
    """Return ``start[i], start[i] + 1, ...`` of each length, one after the other."""
    offset = np.cumsum(length) - length
    rows: Ints = np.arange(length.sum(), dtype=np.int64) + np.repeat(start - offset, length)
    return rows


def _fill(tracks: Tracks, k: Ints, dt_s: float, *, row: Ints, at: Ints) -> Samples:
    """Spread rows over samples and agents."""
    agent, first, column = np.unique(tracks.agent[row], return_index=True, return_inverse=True)
    kind = tracks.kind[row]
    changed = kind != kind[first][column]
    if changed.any():
        who = int(agent[column[np.flatnonzero(changed)[0]]])
        raise InputError(f"Tracks: agent {who} is of two kinds; an id belongs to one agent.")
    xy_m = np.full((len(k), len(agent), 2), np.nan)
    xy_m[at, column, 0] = tracks.x_m[row]
    xy_m[at, column, 1] = tracks.y_m[row]
    confidence = np.full((len(k), len(agent)), np.nan, dtype=np.float32)
    confidence[at, column] = tracks.confidence[row]
    return Samples(dt_s=dt_s, k=k, agent=agent, kind=kind[first], xy_m=xy_m, confidence=confidence)

"""Every agent in every frame: what most programs store."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Floats, Ints
from zfcal.errors import InputError
from zfcal.tracks import KINDS, Tracks

_MOST_CELLS = 100_000_000
"""Agents times frames: more would take gigabytes."""

_SAME_TIME_S = 1e-6
"""Times that differ by less are the same: less than any camera tells."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Dense:
    """Agents by frames, from frame 0 to the last in which anybody was seen.

    Parameters
    ----------
    fps
        Frame rate, in hertz.
    time_s : ndarray of float64, shape (frame,)
        Seconds since the start of the trial. Where nobody was seen it lies evenly between its
        neighbours.
    agent : ndarray of int32, shape (agent,)
        Track ids, ascending.
    kind : ndarray of int8, shape (agent,)
        Index into `zfcal.tracks.KINDS`.
    xy_m : ndarray of float64, shape (frame, agent, 2)
        NaN where an agent was not seen.
    heading_rad, confidence : ndarray of float64, shape (frame, agent)
        NaN where unknown, or not seen.
    """

    fps: float
    time_s: Floats
    agent: NDArray[np.int32]
    kind: NDArray[np.int8]
    xy_m: Floats
    heading_rad: Floats
    confidence: Floats

    @property
    def frame(self) -> Ints:
        """Numbers of the frames, shape (frame,)."""
        return np.arange(len(self.time_s))

    @property
    def names(self) -> tuple[str, ...]:
        """What files call the agents: the kind and the track id, by which they are read back."""
        return tuple(
            f"{KINDS[kind]}_{agent}" for kind, agent in zip(self.kind, self.agent, strict=True)
        )

    @property
    def time_off_s(self) -> float:
        """By how much a time differs from frame / fps at most, in seconds; 0 for rounding."""
        off_s = float(np.abs(self.time_s - self.frame / self.fps).max())
        return off_s if off_s > _SAME_TIME_S else 0.0

    @property
    def times_tell_frames(self) -> bool:
        """Whether the frame is found again from its time and the rate."""
        return bool((np.rint(self.time_s * self.fps) == self.frame).all())


def dense(tracks: Tracks, fps: float) -> Dense:
    """Return tracks as arrays of agents by frames.

    Parameters
    ----------
    tracks
        At least one row.
    fps
        Frame rate, in hertz.

    Raises
    ------
    InputError
        There are no rows, or the arrays would be larger than any program reads.
    """
    if not len(tracks):
        raise InputError("There is no position to export.", hint="Nobody was seen in the trial.")
    agent, column = np.unique(tracks.agent, return_inverse=True)
    n_frames = int(tracks.frame[-1]) + 1
    if n_frames * len(agent) > _MOST_CELLS:
        raise InputError(
            f"{len(agent)} track ids in {n_frames} frames are too many for a format that has a "
            f"place for each agent in each frame: expected at most {_MOST_CELLS} places.",
            hint="csv and parquet have a row for each position: --to csv",
        )
    kind = np.zeros(len(agent), dtype=np.int8)
    kind[column] = tracks.kind
    cells = np.full((n_frames, len(agent), 4), np.nan)
    cells[tracks.frame, column] = np.stack(
        [tracks.x_m, tracks.y_m, tracks.heading_rad, tracks.confidence], axis=-1
    )
    return Dense(
        fps=fps,
        time_s=_times(tracks, n_frames, fps),
        agent=agent,
        kind=kind,
        xy_m=cells[..., :2],
        heading_rad=cells[..., 2],
        confidence=cells[..., 3],
    )


def _times(tracks: Tracks, n_frames: int, fps: float) -> Floats:
    frames, rows = np.unique(tracks.frame, return_index=True)
    times = tracks.time_s[rows]
    if np.abs(times - frames / fps).max() <= _SAME_TIME_S:
        # Written as they are; those between them as others of the same rate would have them.
        time_s: Floats = np.arange(n_frames) / fps
        time_s[frames] = times
        return time_s
    if frames[0] > 0 and times[0] > 0:
        frames, times = np.append(0, frames), np.append(max(times[0] - frames[0] / fps, 0.0), times)
    return np.interp(np.arange(n_frames), frames, times)

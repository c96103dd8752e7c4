"""Where a simulation begins: anywhere, or where all animals were seen.

Where fish are changes slowly: in two rooms it takes them longer than a quarter of an hour to forget
it. Two minutes of a group are therefore not those of its model from anywhere, even if the model is
true, but those of its model from where the group was.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from zfcal.arrays import Floats, Ints
from zfcal.tracks import FISH, ROBOT, Samples
from zfcal.units import HEADING_MIN_STEP_M

_NEAR_S = 1.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Start:
    """Where all agents are when a simulation begins.

    Parameters
    ----------
    poses : ndarray, shape (agent, 3)
        x and y in metres, heading in radians, fish first. An agent whose place is NaN or outside
        begins anywhere; one without a heading in any direction.
    time_s
        When that is, in seconds since trial start.

    Notes
    -----
    Effects with memory begin without any: nobody has moved before, nor left a room.
    """

    poses: Floats
    time_s: float


def seen_at(samples: Samples, k: int, *, n_fish: int, n_robots: int) -> Start:
    """Return where agents were at one sample.

    One that was not seen then is where it was seen last or next, within a second. A heading is that
    of the last displacement of 2 mm or more; where there is none before, that of the first after.

    Parameters
    ----------
    samples
        They may begin and end anywhere.
    k
        Number of the sample.
    n_fish, n_robots
        Agents of the simulation. Of more tracks that are there the first ones count; who has none
        is NaN.
    """
    poses = np.full((n_fish + n_robots, 3), np.nan)
    for kind, first, n in ((FISH, 0, n_fish), (ROBOT, n_fish, n_robots)):
        own = samples.of_kind(kind)
        found = [_pose(own.xy_m[:, j], own.k - k, samples.dt_s) for j in range(len(own.agent))]
        there = [pose for pose in found if pose is not None][:n]
        if there:
            poses[first : first + len(there)] = there
    return Start(poses=poses, time_s=k * samples.dt_s)


def _pose(xy_m: Floats, away: Ints, dt_s: float) -> Floats | None:
    """Return one agent's pose, shape (3,); None where it was not seen within a second.

    Parameters
    ----------
    xy_m : ndarray, shape (sample, 2)
        Its places.
    away : ndarray, shape (sample,)
        How many samples each is after the one that is meant.
    dt_s
        The step.
    """
    near = np.where(np.isfinite(xy_m).all(axis=1), np.abs(away), np.iinfo(np.int64).max)
    if not len(near) or near.min() * dt_s > _NEAR_S:
        return None
    row = int(np.argmin(near))
    moved = np.diff(xy_m, axis=0)
    far = np.hypot(*moved.T) >= HEADING_MIN_STEP_M
    before, after = np.flatnonzero(far[:row]), np.flatnonzero(far[row:])
    heading = np.nan
    if len(before) or len(after):
        dx, dy = moved[before[-1] if len(before) else row + after[0]]
        heading = np.arctan2(dy, dx)
    return np.array([*xy_m[row], heading])

"""Where a simulation begins: anywhere, or where all animals were seen.

Where fish are changes slowly: in two rooms it takes them longer than a quarter of an hour to forget
it. Two minutes of a group are therefore not those of its model from anywhere, even if the model is
true, but those of its model from where the group was.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from zfcal.arrays import Floats
from zfcal.tracks import FISH, ROBOT, Samples
from zfcal.units import HEADING_MIN_STEP_M


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
    """

    poses: Floats
    time_s: float


def seen_at(samples: Samples, k: int, *, n_fish: int, n_robots: int) -> Start:
    """Return where agents were at one sample.

    A heading is that of the last displacement of 2 mm or more; where there is none before, that of
    the first one after.

    Parameters
    ----------
    samples
        They may begin and end anywhere.
    k
        Number of the sample.
    n_fish, n_robots
        Agents of the simulation. Of more tracks the first ones count; who has none is NaN.
    """
    poses = np.full((n_fish + n_robots, 3), np.nan)
    row = int(np.searchsorted(samples.k, k))
    if row == len(samples.k) or samples.k[row] != k:
        return Start(poses=poses, time_s=k * samples.dt_s)
    for kind, first, n in ((FISH, 0, n_fish), (ROBOT, n_fish, n_robots)):
        own = samples.of_kind(kind)
        for agent in range(min(n, len(own.agent))):
            poses[first + agent] = _pose(own.xy_m[:, agent], row)
    return Start(poses=poses, time_s=k * samples.dt_s)


def _pose(xy_m: Floats, row: int) -> Floats:
    """Return one agent's pose at a row of its places, shape (3,)."""
    moved = np.diff(xy_m, axis=0)
    far = np.hypot(*moved.T) >= HEADING_MIN_STEP_M
    before, after = np.flatnonzero(far[:row]), np.flatnonzero(far[row:])
    heading = np.nan
    if len(before) or len(after):
        dx, dy = moved[before[-1] if len(before) else row + after[0]]
        heading = np.arctan2(dy, dx)
    return np.array([*xy_m[row], heading])

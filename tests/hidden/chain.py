"""From where the animals were to what a tracker writes down."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from hidden.states import DT_S

_SWAP_M = 0.03


@dataclass(frozen=True, slots=True, kw_only=True)
class Chain:
    """What happens between the animals and the table.

    Parameters
    ----------
    noise_mm
        Standard deviation of each coordinate in each frame.
    drops_per_min
        How often an agent is lost, a minute and agent; for 2 s in the mean.
    renamed
        Share of the lost that return under a new track id.
    swaps_per_min
        How often two fish within 3 cm of each other exchange their ids, a minute.
    """

    noise_mm: float = 0.0
    drops_per_min: float = 0.0
    renamed: float = 1.0
    swaps_per_min: float = 0.0


def filmed(states_m, *, fps):
    """Return positions at a frame rate, straight between the model's steps.

    Parameters
    ----------
    states_m : ndarray, shape (state, agent, 2)
        At steps of 0.2 s.
    fps
        Hertz.

    Returns
    -------
    ndarray, shape (frame, agent, 2)
    """
    n_frames = round((len(states_m) - 1) * DT_S * fps)
    at = np.arange(n_frames) / fps / DT_S
    # 3 / 15 / 0.2 may come out a hair below 1.
    at = np.where(np.abs(at - np.rint(at)) < 1e-6, np.rint(at), at)
    a = np.minimum(at.astype(int), len(states_m) - 2)
    share = (at - a)[:, None, None]
    return (1 - share) * states_m[a] + share * states_m[a + 1]


def swapped_ids(xy_m, n_fish, *, per_min, fps, rng):
    """Return the id under which each agent goes in each frame, (frame, agent)."""
    n_frames, n = xy_m.shape[:2]
    ids = np.tile(np.arange(n), (n_frames, 1))
    for frame in np.flatnonzero(rng.random(n_frames) < per_min / 60 / fps):
        # The swap waits for the next moment at which two fish are close.
        for later in range(frame, min(frame + round(5 * fps), n_frames)):
            gap = np.linalg.norm(xy_m[later, :n_fish, None] - xy_m[later, None, :n_fish], axis=2)
            np.fill_diagonal(gap, np.inf)
            if gap.min() < _SWAP_M:
                a, b = np.unravel_index(gap.argmin(), gap.shape)
                ids[later:, [a, b]] = ids[later:, [b, a]]
                break
    return ids


def drop(ids, chain, *, fps, rng):
    """Return the ids with -1 where an agent is lost, and new ids after a loss."""
    n_frames = len(ids)
    out, fresh = ids.copy(), ids.max() + 1
    for track in np.unique(ids):
        for frame in np.flatnonzero(rng.random(n_frames) < chain.drops_per_min / 60 / fps):
            end = min(n_frames, frame + 1 + round(rng.exponential(2.0) * fps))
            was = out[frame][ids[frame] == track][0]
            here = ids == track
            here[:frame] = False
            out[here & (np.arange(n_frames)[:, None] < end)] = -1
            if was >= 0 and rng.random() < chain.renamed:
                here[:end] = False
                out[here], fresh = fresh, fresh + 1
    return out


def measure(states_m, n_fish, chain, *, fps, rng):
    """Return the tracks of a trial as a tracker writes them.

    Parameters
    ----------
    states_m : ndarray, shape (state, agent, 2)
        True positions; agents from ``n_fish`` on are robots.

    Returns
    -------
    DataFrame
        ``time_s``, ``agent``, ``kind``, ``x_m``, ``y_m``; a row per agent and frame
        in which it was seen.
    """
    xy = filmed(states_m, fps=fps)
    ids = swapped_ids(xy, n_fish, per_min=chain.swaps_per_min, fps=fps, rng=rng)
    ids = drop(ids, chain, fps=fps, rng=rng)
    xy = xy + rng.normal(0.0, 1.0, xy.shape) * chain.noise_mm / 1000
    frame, agent = np.nonzero(ids >= 0)
    rows = pd.DataFrame(
        {
            "time_s": frame / fps,
            "agent": ids[frame, agent],
            "kind": np.where(agent < n_fish, "fish", "robot"),
            "x_m": xy[frame, agent, 0],
            "y_m": xy[frame, agent, 1],
        }
    )
    return rows.sort_values(["time_s", "agent"], kind="stable", ignore_index=True)


def sampled(tracks, *, fps):
    """Return the tracks on the model's clock.

    Returns
    -------
    tuple
        Positions (sample, track, 2), NaN where a track was not seen; the track ids
        (track,); whether each is a robot (track,).
    """
    every = round(fps * DT_S)
    if every < 1 or abs(every - fps * DT_S) > 1e-9:
        raise ValueError(f"Frames must fall on steps of {DT_S} s, got {fps} frames per second.")
    frame = np.rint(tracks["time_s"].to_numpy() * fps).astype(int)
    rows = tracks[frame % every == 0]
    sample = frame[frame % every == 0] // every
    ids, column = np.unique(rows["agent"].to_numpy(), return_inverse=True)
    xy = np.full((frame.max() // every + 1, len(ids), 2), np.nan)
    xy[sample, column] = rows[["x_m", "y_m"]].to_numpy()
    robot = np.zeros(len(ids), bool)
    robot[column] = rows["kind"].to_numpy() == "robot"
    return xy, ids, robot

"""How exact the tracker's own positions are, and how whole: what a diagnosis has to know.

Noise is that of the animals seen alone. Errors of a tracker are not white: the posture of a
body moves its seen centroid for several frames in a row. What is estimated is the white noise
with the same second differences, which is what the diagnosis takes noise to be.
"""

from __future__ import annotations

import math

import numpy as np

from zfcal.diagnose.noise import from_frames
from zfcal.tracks import GUESS, Tracks

_ALONE = 0.75
"""Confidence from which an animal was alone in its blob, and known for a while."""


def tracker_noise(tracks: Tracks, *, fps: float, dt_s: float) -> float | None:
    """Return the position noise of tracks, standard deviation per coordinate in metres.

    Parameters
    ----------
    tracks
        As tracked, at the full frame rate.
    fps
        Frames per second.
    dt_s
        The model's step.

    Returns
    -------
    float or None
        None where there are too few frames in a row, or none between two steps.
    """
    per_step = max(1, round(fps * dt_s))
    if per_step < 2:
        return None
    for least in (_ALONE, 0.0):
        # In a crowd for most of the time: noise is then that of crowds as well.
        chosen = tracks.take(tracks.confidence >= least)
        if len(chosen) >= 3:
            sd_m, _ = from_frames(chosen, fps=fps, per_step=per_step)
            if math.isfinite(sd_m):
                return sd_m
    return None


def losses(tracks: Tracks, *, n_agents: int) -> dict[str, int]:
    """Return how often the tracker lost somebody.

    Parameters
    ----------
    tracks
        Of one segment; its frames without anybody do not count.
    n_agents
        Fish and robots in the tank.

    Returns
    -------
    dict
        ``drops``: agents that were not seen, summed over frames. ``suspected_swaps``: ids
        that begin after the first frame, since an agent gets a new one when it is not sure
        any more which one it is. ``guesses``: rows with a confidence below one half.
    """
    frames, seen = np.unique(tracks.frame, return_counts=True)
    _, first = np.unique(tracks.agent, return_index=True)
    return {
        "drops": int(np.maximum(n_agents - seen, 0).sum()),
        "suspected_swaps": int((tracks.frame[first] > frames[:1]).sum()),
        "guesses": int((tracks.confidence < GUESS).sum()),
    }

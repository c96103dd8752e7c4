"""Scores from tracks against those from the truth, beside how one model's own scores scatter."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from zfcal.arena import Arena
from zfcal.behaviour.scores import Scores, compare
from zfcal.behaviour.statistics import Statistics, measure
from zfcal.sampling import sample
from zfcal.tracks import FISH, ROBOT, Tracks

DT_S = 1 / 3
NAMES = ("S", "D", "W", "O", "T")
_NEAR_M = 0.05

Row = tuple[int, float, float]
"""A track id and its place, in metres."""


def as_tracks(told: Sequence[Sequence[Row]], truth: Tracks, *, fps: float) -> Tracks:
    """Return what a tracker told as tracks; the robot is who is nearest to it.

    In a trial the camera below tells where the robot is; here its true place does.
    """
    robot = {int(f): (x, y) for f, x, y, k in zip(truth.frame, truth.x_m, truth.y_m, truth.kind,
                                                  strict=True) if k == ROBOT}  # fmt: skip
    rows = []
    for frame, seen in enumerate(told):
        at = robot.get(frame)
        away = [np.hypot(x - at[0], y - at[1]) if at else np.inf for _, x, y in seen]
        nearest = int(np.argmin(away)) if away and min(away) < _NEAR_M else -1
        # The robot's id is its own: a track may be a fish a moment later.
        named = [
            (1000 if k == nearest else agent, ROBOT if k == nearest else FISH, x, y)
            for k, (agent, x, y) in enumerate(seen)
        ]
        rows += [(frame / fps, frame, *each) for each in sorted(named)]
    time_s, frame, agent, kind, x, y = np.array(rows, np.float64).reshape(-1, 6).T
    return Tracks(
        time_s=time_s,
        frame=frame.astype(np.int64),
        agent=agent.astype(np.int32),
        kind=kind.astype(np.int8),
        x_m=x,
        y_m=y,
        heading_rad=np.full(len(x), np.nan, np.float32),
        confidence=np.ones(len(x), np.float32),
    )


def statistics_of(tracks: Tracks, arena: Arena, *, fps: float, end_s: float) -> Statistics:
    """Return the statistics of the fish of a film."""
    return measure(sample(tracks, fps=fps, dt_s=DT_S, start_s=0.0, end_s=end_s), arena)


def differences(
    tracked: Statistics, truth: Statistics, others: Sequence[Statistics]
) -> dict[str, dict[str, float]]:
    """Return how tracking changes scores, and how much those of one model scatter.

    Parameters
    ----------
    tracked, truth
        Of one film.
    others
        Of other runs of the same model: against each of them both are scored.

    Returns
    -------
    dict
        For each score: ``change``, the largest difference between tracks and truth against any
        of the others; ``noise``, half the range that holds 95 % of the scores of the others among
        themselves.
    """
    by_tracks = _table([compare(tracked, other) for other in others])
    by_truth = _table([compare(truth, other) for other in others])
    among = _table([compare(a, b) for k, a in enumerate(others) for b in others[:k]])
    low, high = np.nanquantile(among, [0.025, 0.975], axis=0)
    change = np.nanmax(np.abs(by_tracks - by_truth), axis=0)
    return {
        name: {"change": float(change[k]), "noise": float(high[k] - low[k]) / 2}
        for k, name in enumerate(NAMES)
    }


def _table(scores: Sequence[Scores]) -> np.ndarray:
    return np.array([(s.S, s.I_D, s.I_W, s.I_O, s.I_T) for s in scores])


def summary(found: dict[str, Any]) -> str:
    """Return in words what was found."""
    return ", ".join(f"{name} {v['change']:.3f} ({v['noise']:.3f})" for name, v in found.items())

"""What there was before each step of fish, as features of speeds ask for it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri
from scipy.stats import rankdata

from zfcal.arrays import Floats
from zfcal.model.features import AWAY_M
from zfcal.model.kernels.state import HX, HY, SPEED, ZONE, X, Y
from zfcal.model.paces import LATELY_S, LONGER_S, Swum
from zfcal.model.scene import Moves, Scene

_AGO_S, _AGO_STEPS = 1.0, 2
"""Before the last step, and at least so many: what changes slowly was much the same then, and what
answers to the last step does not answer to that one."""

_AHEAD = 0.5
"""Cosine of the angle from the heading within which another one is ahead."""

_FAST, _LONG_AGO = 1.15, 12
"""Score of a fast step, and steps after which it is forgotten."""

_LEAST_RANK = 0.3
"""Rank of a speed that is slower than all, or faster from the other end."""


def swum_of(scene: Scene, moves: Moves, scores: Floats) -> Swum:
    """Return what was there before some moves, and how these turned.

    Parameters
    ----------
    scene
        The recording.
    moves
        That count.
    scores : ndarray, shape (move,)
        Normal scores of their speeds.
    """
    at, who, states = moves.at, moves.who, scene.states
    table = _table(scene, moves, scores)
    columns = states.shape[2]
    each = [[j for j in range(columns) if j != i] for i in range(columns)]
    others = np.array(each, dtype=np.int64).reshape(columns, columns - 1)[who]
    own, theirs = states[at, :, who], np.moveaxis(states[at], 1, 2)
    theirs = np.take_along_axis(theirs, others[..., None], axis=1)
    here = theirs[..., ZONE] > 0
    x, y = theirs[..., X] - own[:, None, X], theirs[..., Y] - own[:, None, Y]
    away = np.hypot(x, y)
    is_ahead = own[:, None, HX] * x + own[:, None, HY] * y > _AHEAD * away
    all_paces = _paces_of_all(states)
    paces = all_paces[at[:, None], others]
    few = range(_steps(scene, LATELY_S))
    theirs_lately = [np.nan_to_num(_ago(all_paces, scene, at[:, None], others, 1 + k)) for k in few]
    speed = np.where(states[:, SPEED] >= 0, states[:, SPEED], np.nan)
    ago = 1 + max(_AGO_STEPS, round(_AGO_S / scene.dt_s))
    all_others, turns = (at[:, None], others), _turns_of_all(states)
    return Swum(
        last=np.nan_to_num(_ago(table, scene, at, who, 1)),
        before_last=np.nan_to_num(_ago(table, scene, at, who, 2)),
        third=np.nan_to_num(_ago(table, scene, at, who, 3)),
        lately=_mean_over(table, scene, (at, who), LATELY_S),
        longer=_mean_over(table, scene, (at, who), LONGER_S),
        earlier=np.nan_to_num(_ago(table, scene, at, who, ago)),
        before_earlier=np.nan_to_num(_ago(table, scene, at, who, ago + 1)),
        last_m_s=_ago(speed, scene, at, who, 1),
        last_ago_m_s=_ago(speed, scene, at, who, ago),
        last_turn_rad=np.nan_to_num(turns[at, who]),
        bent_rad=np.max([_ago(turns, scene, at, who, 1 + k) for k in range(3)], axis=0),
        turn_rad=np.nan_to_num(turns[at + 1, who]),
        others=np.where(here, np.nan_to_num(paces), 0.0),
        others_lately=np.where(here, np.mean(theirs_lately, axis=0), 0.0),
        others_m_s=_ago(speed, scene, *all_others, 1),
        others_ago_m_s=_ago(speed, scene, *all_others, ago),
        distance_m=np.where(here, np.nan_to_num(away, nan=AWAY_M), AWAY_M),
        ahead=here & is_ahead,
        ahead_m=np.where(here & is_ahead, away, AWAY_M).min(axis=1, initial=AWAY_M),
        since_fast=_since_fast(table, scene, at, who),
        here=here,
        time=at / max(1, len(scene.k) - 1),
        track=moves.track,
    )


def _steps(scene: Scene, long_s: float) -> int:
    return max(1, round(long_s / scene.dt_s))


def _mean_over(
    table: Floats, scene: Scene, whose: tuple[NDArray[np.int64], NDArray[np.int64]], long_s: float
) -> Floats:
    """Return the mean of what the steps of some time before ended with; 0 for unknown ones."""
    total = np.zeros(len(whose[0]))
    for k in range(_steps(scene, long_s)):
        total += np.nan_to_num(_ago(table, scene, *whose, 1 + k))
    return total / _steps(scene, long_s)


def scores_of_speeds(speeds: Floats, of: Floats, zone: NDArray[np.int64]) -> Floats:
    """Return the normal scores that speeds would have among those of a zone.

    Parameters
    ----------
    speeds : ndarray, shape (step, source)
        NaN where there is none.
    of : ndarray, shape (step,)
        All speeds.
    zone : ndarray of int, shape (step,)
    """
    made = np.full(speeds.shape, np.nan)
    for number in np.unique(zone):
        rows = zone == number
        known, own = np.sort(of[rows]), speeds[rows]
        ends = [np.searchsorted(known, own, side=side) for side in ("left", "right")]
        rank = np.clip((ends[0] + ends[1] + 1) / 2, _LEAST_RANK, len(known) + 1 - _LEAST_RANK)
        made[rows] = np.where(np.isfinite(own), ndtri(rank / (len(known) + 1)), np.nan)
    return made


def normal_scores(values: Floats, group: NDArray[np.int64]) -> Floats:
    """Return the normal scores of values within each group; equal ones share their mean rank."""
    made = np.zeros_like(values)
    for number in np.unique(group):
        rows = group == number
        made[rows] = ndtri(rankdata(values[rows]) / (rows.sum() + 1))
    return made


def _table(scene: Scene, moves: Moves, values: Floats) -> Floats:
    """Return values of moves by the sample in which each ends, shape (sample, column)."""
    made = np.full((len(scene.k) + 1, scene.states.shape[2]), np.nan)
    made[moves.at + 1, moves.who] = values
    return made


def _ago(
    table: Floats, scene: Scene, at: NDArray[np.int64], who: NDArray[np.int64], ago: int
) -> Floats:
    """Return what the step so many before ended with, of the same track; NaN where there is none.

    Parameters
    ----------
    table : ndarray, shape (sample, column)
        By the sample in which each step ended.
    scene
        The recording.
    at, who
        Sample in which a step begins, and column.
    ago
        1 for the step that ended there.
    """
    then = at + 1 - ago
    same = (then > 0) & (scene.tracks[np.maximum(then - 1, 0), who] == scene.tracks[at, who])
    return np.where(same, table[np.maximum(then, 0), who], np.nan)


def _since_fast(
    table: Floats, scene: Scene, at: NDArray[np.int64], who: NDArray[np.int64]
) -> Floats:
    """Return how many steps ago the last fast one was, 1 for the last step, shape (step,)."""
    made = np.full(len(at), float(_LONG_AGO))
    for ago in range(_LONG_AGO - 1, 0, -1):
        made[_ago(table, scene, at, who, ago) > _FAST] = ago
    return made


def _paces_of_all(states: Floats) -> Floats:
    """Return the normal score of everybody's last speed, robots' too, within the zone it began in.

    Shape (sample, column); NaN where it is not known.
    """
    speed, zone = states[:, SPEED], np.roll(states[:, ZONE], 1, axis=0)
    made = np.full(speed.shape, np.nan)
    known = np.isfinite(speed) & (speed >= 0) & (zone > 0)
    known[0] = False
    made[known] = normal_scores(speed[known], zone[known].astype(np.int64))
    return made


def _turns_of_all(states: Floats) -> Floats:
    """Return the angle between everybody's last two steps, shape (sample, column).

    NaN where one of them is not known.
    """
    hx, hy = states[:, HX], states[:, HY]
    known = (states[:, ZONE] > 0) & (np.hypot(hx, hy) > 0)
    made = np.full(hx.shape, np.nan)
    cross, dot = hx[:-1] * hy[1:] - hy[:-1] * hx[1:], hx[:-1] * hx[1:] + hy[:-1] * hy[1:]
    made[1:] = np.where(known[1:] & known[:-1], np.abs(np.arctan2(cross, dot)), np.nan)
    return made

"""What states say of the past: how fast, where and on which course everybody was until a sample."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Floats
from zfcal.model.features import LAGS
from zfcal.model.kernels.state import FOLLOWS, HX, HY, ROOM, SPEED, ZONE, X, Y

_LATELY_S = 2.0
"""How fast others were lately is taken over so long."""

_OPEN_S = 5.0
"""Whether others were off the walls is taken over so long."""

_STRAIGHT_RAD = 0.6
"""Wider turns are no straight swimming."""

_RECENT, _FADING = 5, 0.6
"""So many turns are remembered, each that much less than the one after it."""

_WIDE_RAD = 1.2
"""Wider turns count as that: a fish that turns round does not spin."""


def lately(states: Floats, dt_s: float) -> Floats:
    """Return the mean speed over two seconds up to each sample, since who is there came."""
    return mean_speed(states[:, SPEED], states[:, ZONE] > 0, _LATELY_S / dt_s)


def mean_speed(speed: Floats, present: NDArray[np.bool_], n_steps: float) -> Floats:
    """Return the mean speed over some steps up to each sample, since who is there came.

    Parameters
    ----------
    speed, present : ndarray, shape (sample, agent)
    n_steps
        Rounded; at least one.
    """
    since, total, count = present, np.zeros_like(speed), np.zeros_like(speed)
    for ago in range(min(len(speed), max(1, round(n_steps)))):
        since = since.copy()
        since[ago:] &= present[: len(speed) - ago]
        since[:ago] = False
        then = np.roll(speed, ago, axis=0)
        known = since & np.isfinite(then) & (then >= 0)
        total += np.where(known, then, 0.0)
        count += known
    return np.asarray(total / np.maximum(count, 1))


def in_open(states: Floats, dt_s: float) -> Floats:
    """Return the share of the last seconds that everybody was off the walls, (sample, agent)."""
    n = max(1, round(_OPEN_S / dt_s))
    there = states[:, ZONE] > 0
    off = there & ~(states[:, FOLLOWS] > 0)
    passed, known = (np.cumsum(np.pad(each, ((n, 0), (0, 0))), axis=0) for each in (off, there))
    return np.asarray((passed[n:] - passed[:-n]) / np.maximum(known[n:] - known[:-n], 1))


def stayed(states: Floats, tracks: NDArray[np.int32], dt_s: float) -> Floats:
    """Return for how long everybody has been in its room, or between rooms, (sample, agent).

    Infinite for who has been there since it was first seen. A gap in a track counts as no change.
    """
    there, sample = states[:, ZONE] > 0, np.arange(len(states))[:, None]
    last = np.maximum.accumulate(np.where(there, sample, 0), axis=0)
    room, track = (np.take_along_axis(values, last, axis=0) for values in (states[:, ROOM], tracks))
    moved, other = np.zeros((2, *room.shape), dtype=bool)
    moved[1:], other[1:] = room[1:] != room[:-1], track[1:] != track[:-1]
    # Odd where the one that is there was seen to come.
    event = np.maximum.accumulate(2 * sample * (moved | other) + (moved & ~other), axis=0)
    return np.where(event % 2 == 1, (sample - event // 2) * dt_s, np.inf)


def straight(states: Floats, dt_s: float) -> Floats:
    """Return for how long everybody has not turned widely, or has been there, (sample, agent).

    Steps too short to have a heading do not count: who rests does not swim straight.
    """
    heading = np.moveaxis(states[:, [HX, HY]], 1, 2)
    there, sample = states[:, ZONE] > 0, np.arange(len(states))[:, None]
    turns = np.ones(there.shape, dtype=bool)
    narrow = (heading[1:] * heading[:-1]).sum(axis=-1) > math.cos(_STRAIGHT_RAD)
    turns[1:] = ~(narrow & there[1:] & there[:-1])
    moved = np.zeros(there.shape, dtype=bool)
    moved[1:] = (heading[1:] != heading[:-1]).any(axis=-1)
    n_moved = np.cumsum(moved, axis=0)
    last = np.maximum.accumulate(np.where(turns, sample, 0), axis=0)
    return np.asarray((n_moved - np.take_along_axis(n_moved, last, axis=0)) * dt_s)


def courses(states: Floats, dt_s: float) -> Floats:
    """Return everybody's mean velocity over two seconds, shape (sample, agent, 2), in m/s."""
    n = max(1, round(_LATELY_S / dt_s))
    xy = np.moveaxis(states[:, [X, Y]], 1, 2)
    made = np.zeros_like(xy)
    made[n:] = (xy[n:] - xy[:-n]) / (n * dt_s)
    was_there = np.zeros(made.shape[:2], dtype=bool)
    was_there[n:] = np.lib.stride_tricks.sliding_window_view(
        states[:, ZONE] > 0, n + 1, axis=0
    ).all(axis=-1)  # fmt: skip
    return np.where(was_there[..., None] & np.isfinite(made), made, 0.0)


def ago_heading(states: Floats, at: NDArray[np.int64], who: NDArray[np.int64]) -> Floats:
    """Return own headings so many steps before, shape (lag, step, 2); zeros before a gap."""
    made = np.zeros((len(LAGS), len(at), 2))
    is_known = np.ones(len(at), dtype=bool)
    for ago in range(1, max(LAGS) + 1):
        then = at - ago
        is_known &= (then >= 0) & (states[np.maximum(then, 0), ZONE, who] > 0)
        if ago in LAGS:
            ways = states[np.maximum(then, 0), :, who][:, [HX, HY]]
            made[LAGS.index(ago)] = np.where(is_known[:, None], np.nan_to_num(ways), 0.0)
    return made


def recent_turn(states: Floats, at: NDArray[np.int64], who: NDArray[np.int64]) -> Floats:
    """Return the mean of the turns before some samples, the later the more it counts."""
    headings = [states[np.maximum(at - k, 0), :, who][:, [HX, HY]] for k in range(_RECENT + 1)]
    total, weights = np.zeros(len(at)), _FADING ** np.arange(_RECENT)
    is_known = np.ones(len(at), dtype=bool)
    for k, (weight, (now, before)) in enumerate(zip(weights, pairwise(headings), strict=True)):
        # Before a gap it may have been another one.
        is_known &= states[np.maximum(at - k - 1, 0), ZONE, who] > 0
        left = before[:, 0] * now[:, 1] - before[:, 1] * now[:, 0]
        turned = np.arctan2(left, (before * now).sum(axis=1))
        total += np.where(is_known, weight * np.clip(turned, -_WIDE_RAD, _WIDE_RAD), 0.0)
    return np.asarray(total / weights.sum())

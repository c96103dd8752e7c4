"""Measured positions as the states that agents decided in."""

from __future__ import annotations

import math

import numpy as np

from zfcal.arrays import Floats, Ints
from zfcal.model.kernels.compiled import inlined, kernel
from zfcal.model.kernels.geometry import Tank, zone_of
from zfcal.model.kernels.perception import REPULSION_M, make_sight, see
from zfcal.model.kernels.placing import forget, remember, settle
from zfcal.model.kernels.state import (
    DT_S,
    HX,
    HY,
    KIND,
    LEFT_AT_S,
    LEFT_S,
    NEVER_S,
    PAST_HX,
    PAST_HY,
    SPEED,
    STATES,
    TIME,
    ZONE,
    X,
    Y,
)


@kernel
def fill_states(
    xy_m: Floats, kinds: Floats, clock: tuple[float, float], least_m: float, tank: Tank
) -> Floats:
    """Return the state of all agents at all samples.

    Parameters
    ----------
    xy_m : ndarray, shape (sample, agent, 2)
        Inside the tank, or NaN for who is not seen.
    kinds : ndarray, shape (agent,)
    clock
        Time of the first sample, and the step, in seconds.
    least_m
        A shorter displacement has no heading.

    Returns
    -------
    ndarray, shape (sample, state, agent)
        Rows as in `zfcal.model.kernels.state`. Zone 0 and the last known place for who
        is not seen; a heading of (0, 0) and a speed of NaN while they are unknown.
    """
    n = xy_m.shape[1]
    states = np.zeros((xy_m.shape[0], STATES, n))
    for k in range(xy_m.shape[0]):
        state = states[k]
        if k > 0:
            state[:] = states[k - 1]
        else:
            state[LEFT_AT_S], state[LEFT_S] = -NEVER_S, NEVER_S
            state[KIND] = kinds
        state[TIME], state[DT_S] = clock[0] + k * clock[1], clock[1]
        for i in range(n):
            x, y = xy_m[k, i, 0], xy_m[k, i, 1]
            zone = 0 if math.isnan(x) else zone_of(x, y, tank)
            length = math.nan
            if zone > 0 and k > 0 and states[k - 1, ZONE, i] > 0.0:
                dx, dy = x - states[k - 1, X, i], y - states[k - 1, Y, i]
                length = math.sqrt(dx * dx + dy * dy)
                if length >= least_m:
                    state[PAST_HX, i], state[PAST_HY, i] = state[HX, i], state[HY, i]
                    state[HX, i], state[HY, i] = dx / length, dy / length
            elif zone > 0:
                forget(i, state)
            state[SPEED, i] = length / clock[1]
            state[ZONE, i] = zone
            if zone > 0:
                state[X, i], state[Y, i] = x, y
                settle(i, state, tank)
        remember(state, tank)
    return states


@inlined
def _once(states: Floats, now: int, lag: float, row: int, j: int) -> float:
    """Return a state of an agent some steps before, between two of them if need be."""
    whole = math.ceil(lag)
    part = lag - whole + 1.0
    before = states[max(0, now - int(whole)), row, j]
    if part >= 1.0:
        return before
    return (1.0 - part) * states[max(0, now - int(whole) + 1), row, j] + part * before


@inlined
def _was_there(states: Floats, now: int, lag: float, j: int) -> bool:
    """Tell whether an agent was inside, at both ends of the step if it was between two."""
    whole = int(math.ceil(lag))  # noqa: RUF046 - of a kernel it is a float
    there = states[max(0, now - whole), ZONE, j] > 0.0
    return there and (lag >= whole or states[max(0, now - whole + 1), ZONE, j] > 0.0)


@kernel
def perceive(
    states: Floats, at: Ints, who: Ints, lag: float, cos_fov: float, is_then: bool
) -> tuple[Floats, Floats]:  # fmt: skip
    """Return unit vectors to neighbours and the solid angles at which they are seen.

    Parameters
    ----------
    at, who : ndarray of int64, shape (step,)
        Sample and agent of each step.
    lag
        Steps by which others are seen late; between two steps they swam straight.
    is_then
        Whether they are seen from where the fish itself was then.

    Returns
    -------
    toward : ndarray, shape (step, agent, 2)
        Away from a neighbour that is too near.
    angle_sr : ndarray, shape (step, agent)
    """
    n = states.shape[2]
    toward, angle = np.zeros((at.size, n, 2)), np.zeros((at.size, n))
    sight = make_sight(n)
    for s in range(at.size):
        i = who[s]
        own_lag = lag if is_then else 0.0
        x, y = _once(states, at[s], own_lag, X, i), _once(states, at[s], own_lag, Y, i)
        own_hx, own_hy = _once(states, at[s], own_lag, HX, i), _once(states, at[s], own_lag, HY, i)
        length = math.hypot(own_hx, own_hy)
        if own_lag > math.floor(own_lag) and length > 0.0:
            own_hx, own_hy = own_hx / length, own_hy / length
        was_there = not is_then or _was_there(states, at[s], lag, i)
        for j in range(n):
            there = j != i and was_there and _was_there(states, at[s], lag, j)
            dx = _once(states, at[s], lag, X, j) - x if there else 0.0
            dy = _once(states, at[s], lag, Y, j) - y if there else 0.0
            hx, hy = _once(states, at[s], lag, HX, j), _once(states, at[s], lag, HY, j)
            length = math.hypot(hx, hy)
            if lag > math.floor(lag) and length > 0.0:
                hx, hy = hx / length, hy / length
            if hx == 0.0 and hy == 0.0:  # of unknown heading: it swims straight away
                away = math.sqrt(dx * dx + dy * dy)
                hx, hy = (dx / away, dy / away) if away > 0.0 else (1.0, 0.0)
            sight.dx_m[j], sight.dy_m[j] = dx, dy
            sight.hx[j], sight.hy[j] = hx, hy
            sight.ahead_m[j] = dx * own_hx + dy * own_hy
        see(sight, cos_fov)
        for j in range(n):
            if sight.angle_sr[j] > 0.0:
                angle[s, j] = sight.angle_sr[j]
                toward[s, j, 0] = sight.dx_m[j] * sight.toward_per_m[j]
                toward[s, j, 1] = sight.dy_m[j] * sight.toward_per_m[j]
    return toward, angle


@kernel
def head_late(
    states: Floats, at: Ints, who: Ints, lag: float, felt_m: float, is_then: bool, toward: Floats,
    made: Floats,
) -> None:  # fmt: skip
    """Write unit vectors to where others were, away from there for who is too near now.

    Parameters
    ----------
    lag
        Steps by which others are late.
    felt_m
        Neighbours as near as that are felt at once: their directions are those of ``toward``.
    is_then
        Whether it is the direction from where the fish itself was.
    toward, made : ndarray, shape (step, agent, 2)
        As at once, and as received.
    """
    for s in range(at.size):
        own, i = states[at[s]], who[s]
        own_lag = lag if is_then and _was_there(states, at[s], lag, i) else 0.0
        x, y = _once(states, at[s], own_lag, X, i), _once(states, at[s], own_lag, Y, i)
        for j in range(states.shape[2]):
            made[s, j, 0], made[s, j, 1] = toward[s, j, 0], toward[s, j, 1]
            now_m = math.hypot(own[X, j] - own[X, i], own[Y, j] - own[Y, i])
            if now_m <= felt_m or not _was_there(states, at[s], lag, j):
                continue
            dx, dy = _once(states, at[s], lag, X, j) - x, _once(states, at[s], lag, Y, j) - y
            away = math.hypot(dx, dy)
            if away > 0.0:
                away = -away if now_m < REPULSION_M else away
                made[s, j, 0], made[s, j, 1] = dx / away, dy / away

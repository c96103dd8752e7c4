"""Where agents are put and found, and what follows from it: walls, rooms, how fast they were."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Floats
from zfcal.model.kernels.compiled import inlined, kernel
from zfcal.model.kernels.geometry import Tank, clearance, nearest_wall, zone_of
from zfcal.model.kernels.random import uniform
from zfcal.model.kernels.state import (
    CLEAR,
    DT_S,
    EXIT,
    FOLLOWS,
    HX,
    HY,
    KIND,
    LATELY,
    LEFT_AT_S,
    LEFT_FROM,
    LEFT_S,
    MOUTH_M,
    MOUTH_X,
    MOUTH_Y,
    NEVER_S,
    PAST_HX,
    PAST_HY,
    ROOM,
    SPEED,
    TAU_X,
    TAU_Y,
    TIME,
    TRAIT,
    WALL,
    ZONE,
    X,
    Y,
)

_FADES_S = 2.0
"""After so long a speed counts 1/e as much in the mean of the own ones, in seconds."""


@inlined
def settle(i: int, state: Floats, tank: Tank) -> None:
    """Write an agent's distance to the wall, the direction along it, and its clearance."""
    distance, tau_x, tau_y = nearest_wall(state[X, i], state[Y, i], tank)
    state[WALL, i], state[TAU_X, i], state[TAU_Y, i] = distance, tau_x, tau_y
    state[CLEAR, i] = clearance(state[X, i], state[Y, i], tank)


@inlined
def forget(i: int, state: Floats) -> None:
    """Drop what is known of an agent's past: whoever comes back may be another one."""
    for row in (HX, HY, PAST_HX, PAST_HY, ROOM, LEFT_FROM, LATELY):
        state[row, i] = 0.0
    state[LEFT_AT_S, i], state[SPEED, i] = -NEVER_S, math.nan


@kernel
def place(state: Floats, tank: Tank, individuals: Floats, random: NDArray[np.uint64]) -> None:
    """Put all agents at uniform places inside, with uniform headings.

    Parameters
    ----------
    individuals : ndarray, shape (2, agent)
        Rows KIND and TRAIT of the state.
    """
    height, width = tank.cells.shape
    for i in range(state.shape[1]):
        zone = 0
        while zone == 0:
            state[X, i] = tank.x0_m + uniform(random) * width / tank.per_m
            state[Y, i] = tank.y0_m + uniform(random) * height / tank.per_m
            zone = zone_of(state[X, i], state[Y, i], tank)
        state[ZONE, i] = zone
        heading = 2.0 * math.pi * uniform(random)
        state[HX, i], state[HY, i] = math.cos(heading), math.sin(heading)
        settle(i, state, tank)
        state[KIND, i], state[TRAIT, i] = individuals[0, i], individuals[1, i]
        state[PAST_HX, i], state[PAST_HY, i] = state[HX, i], state[HY, i]
        state[LEFT_AT_S, i] = -NEVER_S
    remember(state, tank)


@kernel
def place_at(state: Floats, poses: Floats, tank: Tank) -> None:
    """Put agents where they were seen; who was not stays where `place` has put it.

    Parameters
    ----------
    poses : ndarray, shape (agent, 3) or (0, 3)
        x and y in metres and heading in radians. One that is NaN or outside is none; without a
        heading an agent keeps the one that it has.
    """
    if poses.shape[0] == 0:
        return
    for i in range(poses.shape[0]):
        zone = zone_of(poses[i, 0], poses[i, 1], tank)
        if zone == 0:
            continue
        state[X, i], state[Y, i], state[ZONE, i] = poses[i, 0], poses[i, 1], zone
        if math.isfinite(poses[i, 2]):
            state[HX, i], state[HY, i] = math.cos(poses[i, 2]), math.sin(poses[i, 2])
            state[PAST_HX, i], state[PAST_HY, i] = state[HX, i], state[HY, i]
        settle(i, state, tank)
    # Nobody has left the room in which chance had put it.
    state[ROOM] = 0.0
    remember(state, tank)


@kernel
def remember(state: Floats, tank: Tank) -> None:
    """Write what effects may ask of rooms, walls and speeds, for all agents that are there."""
    rooms = tank.rooms
    for i in range(state.shape[1]):
        zone = int(state[ZONE, i])
        if zone == 0:  # who is not seen has not left
            continue
        if state[SPEED, i] >= 0.0:  # known
            kept = math.exp(-state[DT_S, i] / _FADES_S) if state[LATELY, i] > 0.0 else 0.0
            state[LATELY, i] = kept * state[LATELY, i] + (1.0 - kept) * state[SPEED, i]
        state[FOLLOWS, i] = 1.0 if tank.follows[zone] else 0.0
        state[EXIT, i] = rooms.exit_zone
        before, room = state[ROOM, i], 0.0
        if rooms.exit_zone > 0 and zone != rooms.exit_zone:
            room = room_of(state[X, i], state[Y, i], tank)
        if before > 0.0 and room != before:
            state[LEFT_AT_S, i], state[LEFT_FROM, i] = state[TIME, i], before
        state[ROOM, i] = room
        _find_mouth(i, state, tank)
    for i in range(state.shape[1]):
        state[LEFT_S, i] = NEVER_S
        for j in range(state.shape[1]):
            away = state[ROOM, j] != state[ROOM, i] and state[ZONE, j] > 0.0
            if j != i and state[ROOM, i] > 0.0 and state[LEFT_FROM, j] == state[ROOM, i] and away:
                since_s = state[TIME, i] - state[LEFT_AT_S, j]
                state[LEFT_S, i] = min(state[LEFT_S, i], since_s)


@kernel
def room_of(x: float, y: float, tank: Tank) -> float:
    """Return the number of the room that is nearest to a place, 0 in an arena without."""
    cells = tank.rooms.cells
    row = min(cells.shape[0] - 1, max(0, int((y - tank.y0_m) * tank.per_m)))
    column = min(cells.shape[1] - 1, max(0, int((x - tank.x0_m) * tank.per_m)))
    return float(cells[row, column])


@kernel
def _find_mouth(i: int, state: Floats, tank: Tank) -> None:
    """Write the direction of the way out of an agent's room; zero vector without one."""
    mouths = tank.rooms.mouths
    state[MOUTH_X, i], state[MOUTH_Y, i], state[MOUTH_M, i] = 0.0, 0.0, NEVER_S
    for m in range(mouths.shape[0]):
        if mouths[m, 0] == state[ROOM, i]:
            dx, dy = mouths[m, 1] - state[X, i], mouths[m, 2] - state[Y, i]
            away = math.sqrt(dx * dx + dy * dy)
            if 0.0 < away < state[MOUTH_M, i]:
                state[MOUTH_X, i], state[MOUTH_Y, i] = dx / away, dy / away
                state[MOUTH_M, i] = away

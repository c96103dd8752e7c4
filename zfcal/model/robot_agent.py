"""One agent that a model moves among others that are measured: the robot among the fish."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import final

import numpy as np

from zfcal.arena import Arena
from zfcal.arrays import Floats
from zfcal.model.kernels.compiled import kernel
from zfcal.model.kernels.geometry import Tank, zone_of
from zfcal.model.kernels.looking import look
from zfcal.model.kernels.moves import draw_one
from zfcal.model.kernels.perception import Sight, make_sight
from zfcal.model.kernels.placing import forget, remember, settle
from zfcal.model.kernels.random import seeded
from zfcal.model.kernels.run import see_late
from zfcal.model.kernels.state import (
    DT_S,
    GRID,
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
    Packed,
    Work,
    X,
    Y,
    make_work,
)
from zfcal.model.simulate import tank_of


@dataclass(frozen=True, slots=True, kw_only=True)
class Move:
    """Where a step of the model leads.

    Parameters
    ----------
    x_m, y_m
        In metres.
    heading_rad
        Direction of the step; the one before where the agent stays.
    speed_m_s
        0 where it stays.
    """

    x_m: float
    y_m: float
    heading_rad: float
    speed_m_s: float


@final
class Among:
    """A robot's agent among animals whose places are measured at each step.

    Parameters
    ----------
    arena
        The tank.
    kinds : ndarray, shape (other,)
        Of the others: 0 for fish, 1 for robots. Who is which is the caller's business.
    dt_s
        The model's step.

    Notes
    -----
    What effects ask of the past (rooms that were left, headings before, responses that
    lag) is kept from step to step. The agent's trait is the mean one.
    """

    def __init__(self, arena: Arena, kinds: Floats, *, dt_s: float) -> None:
        n = len(kinds) + 1
        self._arena, self._tank = arena, tank_of(arena)
        self._state = np.zeros((STATES, n))
        self._state[DT_S], self._state[KIND, :-1], self._state[KIND, -1] = dt_s, kinds, 1.0
        self._state[[X, Y], :-1] = np.nan
        self._state[LEFT_AT_S], self._state[LEFT_S] = -NEVER_S, NEVER_S
        # As many as `in_vectors` says, which alone would have to be compiled.
        self._sight = make_sight(-(-n * n // 8) * 8)
        self._work = make_work(n, 0, GRID)

    @property
    def zone(self) -> int:
        """Zone id of the agent; 0 before it was placed, and outside."""
        return int(self._state[ZONE, -1])

    def measure(self, time_s: float, others: Floats) -> None:
        """Take where the others are.

        Parameters
        ----------
        time_s
            Seconds since the start of the trial.
        others : ndarray, shape (other, 3)
            x, y in metres and heading in radians: NaN for who is not seen, and a heading of
            NaN where it is unknown; then the one before counts.
        """
        xy = self._arena.settle(others[:, :2])[0]
        _measure(self._state, time_s, np.column_stack([xy, others[:, 2]]), 0, self._tank)

    def place(self, x_m: float, y_m: float, heading_rad: float) -> None:
        """Put the agent itself somewhere; a heading of NaN leaves the one it has."""
        xy = self._arena.settle(np.array([[x_m, y_m]]))[0]
        own = np.array([[xy[0, 0], xy[0, 1], heading_rad]])
        _measure(self._state, float(self._state[TIME, 0]), own, len(self._state[X]) - 1, self._tank)

    def step(self, packed: Packed, seed: int) -> Move | None:
        """Draw the agent's next step and return where it leads; nobody is moved.

        Parameters
        ----------
        packed
            The model, the first of those that were packed.
        seed
            64 bits: the same state, model and seed give the same step.

        Returns
        -------
        Move or None
            None while the agent is nowhere inside the tank.
        """
        if self.zone == 0:
            return None
        if self._work.parts.shape[0] < 2 * self._state.shape[1] + packed.components.shape[0]:
            fresh = make_work(self._state.shape[1], packed.components.shape[0], GRID)
            self._work = fresh._replace(past=self._work.past, steps=self._work.steps)
        _draw(self._state, packed, self._tank, self._sight, np.uint64(seed), self._work)
        ux, uy, _, speed = self._work.moves[-1]
        reach = speed * packed.dt_s
        return Move(
            x_m=float(self._state[X, -1] + reach * ux),
            y_m=float(self._state[Y, -1] + reach * uy),
            heading_rad=math.atan2(uy, ux),
            speed_m_s=float(speed),
        )


@kernel
def _measure(state: Floats, time_s: float, found: Floats, first: int, tank: Tank) -> None:
    """Write where agents from ``first`` on are, and what follows from where they were."""
    state[TIME] = time_s
    for row in range(found.shape[0]):
        i, x, y, heading = first + row, found[row, 0], found[row, 1], found[row, 2]
        zone = zone_of(x, y, tank) if np.isfinite(x) and np.isfinite(y) else 0
        was_there = state[ZONE, i] > 0.0
        state[ZONE, i] = zone
        if zone == 0:
            # Nobody sees what is nowhere.
            state[X, i], state[Y, i], state[SPEED, i] = np.nan, np.nan, np.nan
            continue
        if not was_there:
            forget(i, state)
        else:
            dx, dy = x - state[X, i], y - state[Y, i]
            state[SPEED, i] = math.sqrt(dx * dx + dy * dy) / state[DT_S, i]
            state[PAST_HX, i], state[PAST_HY, i] = state[HX, i], state[HY, i]
        state[X, i], state[Y, i] = x, y
        if np.isfinite(heading):
            state[HX, i], state[HY, i] = math.cos(heading), math.sin(heading)
        settle(i, state, tank)


@kernel
def _draw(
    state: Floats, packed: Packed, tank: Tank, sight: Sight, seed: np.uint64, work: Work
) -> None:
    own = state.shape[1] - 1
    if state[HX, own] == 0.0 and state[HY, own] == 0.0:
        # Of an agent that was never seen to move nobody knows the heading; any will do.
        state[HX, own], state[HY, own] = 1.0, 0.0
    for j in range(own):
        if state[ZONE, j] > 0.0 and state[HX, j] == 0.0 and state[HY, j] == 0.0:
            # Who has no heading yet is taken to swim straight away.
            dx, dy = state[X, j] - state[X, own], state[Y, j] - state[Y, own]
            away = max(math.sqrt(dx * dx + dy * dy), 1e-9)
            state[HX, j], state[HY, j] = dx / away, dy / away
    if packed.effects.shape[1] > 0:
        remember(state, tank)
    if packed.lags[0] > 0:
        see_late(state, 0, packed, sight, work)
    else:
        look(state, 0, packed, sight)
    draw_one(own, state, packed, tank, sight, seeded(seed), work)

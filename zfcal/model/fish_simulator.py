"""Fish of a virtual tank, moved step by step beside robots that somebody else moves."""

from __future__ import annotations

from typing import final

import numpy as np
from numpy.typing import NDArray

from zfcal.arena import Arena
from zfcal.arrays import Floats
from zfcal.errors import InputError
from zfcal.model.kernels.compiled import kernel
from zfcal.model.kernels.geometry import Tank, zone_of
from zfcal.model.kernels.heading import apply_move
from zfcal.model.kernels.looking import look
from zfcal.model.kernels.moves import draw_one
from zfcal.model.kernels.perception import Sight, in_vectors, make_sight
from zfcal.model.kernels.placing import forget, place, remember, settle
from zfcal.model.kernels.random import seeded
from zfcal.model.kernels.run import see_late
from zfcal.model.kernels.state import (
    DT_S,
    GRID,
    HX,
    HY,
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
from zfcal.model.packing import pack
from zfcal.model.simulate import burn_in_steps, individuals, tank_of
from zfcal.parameters import Parameters

_AWAY_M = 1e9


@final
class Shoal:
    """A group of fish that swim by a model among robots.

    All fish move at once, each sees where the others were; the model may be another one
    at each step, with the same effects. They have swum for 60 s, alone, before the first
    step.

    Parameters
    ----------
    parameters
        The model of the first steps.
    arena
        The tank.
    n_fish, n_robots
        Agents; robots come last.
    seed
        Of places and moves, by `numpy.random.SeedSequence`.

    Raises
    ------
    InputError
        There is no fish.
    """

    def __init__(
        self, parameters: Parameters, arena: Arena, *, n_fish: int, n_robots: int, seed: int
    ) -> None:
        if n_fish < 1 or n_robots < 0 or seed < 0:
            raise InputError(
                f"A shoal needs a fish and a seed from 0 on; got {n_fish} fish, {n_robots} robots, "
                f"seed {seed}."
            )
        self._arena, self._tank = arena, tank_of(arena)
        self._n_fish = n_fish
        self._effects = tuple(parameters.effects)
        self._packed = pack([parameters], arena)
        n = n_fish + n_robots
        self._state = np.zeros((STATES, n))
        burn_in = burn_in_steps(parameters.dt_s)
        self._state[DT_S], self._state[TIME] = parameters.dt_s, -burn_in * parameters.dt_s
        self._work = make_work(n, len(self._packed.components), GRID)
        self._sight = make_sight(in_vectors(n * n))
        self._random = seeded(np.random.SeedSequence(seed).generate_state(1, np.uint64)[0])
        place(self._state, self._tank, individuals(n, n_robots), self._random)
        nobody = np.full((n_robots, 3), np.nan)
        for _ in range(burn_in):
            self.step(nobody)

    @property
    def fish_xy_m(self) -> Floats:
        """Where the fish are, in metres, shape (fish, 2)."""
        return self._state[[X, Y], : self._n_fish].T.copy()

    @property
    def fish_heading_rad(self) -> Floats:
        """Headings of the fish, shape (fish,): of the step that led there."""
        return np.arctan2(self._state[HY, : self._n_fish], self._state[HX, : self._n_fish])

    def change(self, parameters: Parameters) -> None:
        """Let the fish swim by other parameters from the next step on.

        Raises
        ------
        InputError
            The model has another step or other effects.
        """
        if parameters.dt_s != self._packed.dt_s or tuple(parameters.effects) != self._effects:
            raise InputError(
                f"A shoal that swims at {self._packed.dt_s:g} s with effects {self._effects} "
                f"cannot change to {parameters.dt_s:g} s with {tuple(parameters.effects)}."
            )
        self._packed = pack([parameters], self._arena)

    def step(self, robots: Floats) -> None:
        """Move all fish by one step of the model.

        Parameters
        ----------
        robots : ndarray, shape (robot, 3)
            x and y in metres and heading in radians at the beginning of the step; NaN for
            one that is not there.
        """
        _step(
            self._state, self._n_fish, robots, self._packed, self._tank, self._sight,
            self._random, self._work,
        )  # fmt: skip


@kernel
def _step(
    state: Floats, n_fish: int, robots: Floats, packed: Packed, tank: Tank, sight: Sight,
    random: NDArray[np.uint64], work: Work,
) -> None:  # fmt: skip
    for r in range(robots.shape[0]):
        _put(n_fish + r, robots[r], state, tank)
    if packed.effects.shape[1] > 0:
        remember(state, tank)
    if packed.lags[0] > 0:
        see_late(state, 0, packed, sight, work)
    else:
        look(state, 0, packed, sight)
    for i in range(n_fish):
        draw_one(i, state, packed, tank, sight, random, work)
    for i in range(n_fish):
        apply_move(i, work, packed.dt_s, state)
        settle(i, state, tank)
    state[TIME] += packed.dt_s


@kernel
def _put(i: int, pose: Floats, state: Floats, tank: Tank) -> None:
    if not np.isfinite(pose).all():
        # So far away that nobody sees it.
        state[X, i], state[Y, i], state[ZONE, i] = _AWAY_M, _AWAY_M, 0.0
        return
    if state[X, i] < _AWAY_M:
        dx, dy = pose[0] - state[X, i], pose[1] - state[Y, i]
        state[SPEED, i] = np.sqrt(dx * dx + dy * dy) / state[DT_S, i]
    else:
        forget(i, state)
    state[X, i], state[Y, i] = pose[0], pose[1]
    state[HX, i], state[HY, i] = np.cos(pose[2]), np.sin(pose[2])
    state[ZONE, i] = zone_of(pose[0], pose[1], tank)
    if state[ZONE, i] > 0:
        settle(i, state, tank)

"""What the kernels work on: the packed models, the agents, and what they see."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from zfcal.model.compiled import inlined, kernel
from zfcal.model.geometry import Tank, clearance, nearest_wall, zone_of
from zfcal.model.kernels.hooks import call_sight
from zfcal.model.kernels.perception import Sight, see
from zfcal.model.kernels.random import uniform

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# Rows of the state, each with a number per agent. TIME counts from the first sample.
X, Y, HX, HY, SPEED, ZONE, WALL, TAU_X, TAU_Y, TIME, CLEAR, STATES = range(12)

# Columns of a zone's parameters.
KAPPA_BASE, KAPPA_F, ALPHA, ZONE_COLUMNS = range(4)

# Laws of a zone's tables of von Mises draws.
LAW_BASE, LAW_F, LAWS = range(3)


GRID = 360
"""Angles of the numeric density, -pi to pi, unless asked otherwise."""


class Packed(NamedTuple):
    """A population of models in arrays; zone ids index the second axis, 0 is void.

    Attributes
    ----------
    zones : ndarray, shape (model, zone + 1, 3)
        Columns KAPPA_BASE, KAPPA_F, ALPHA.
    turns : ndarray, shape (model, zone + 1, 2, 3, 66)
        Tables of `zfcal.model.kernels.staircase` for LAW_BASE and LAW_F.
    gamma : ndarray, shape (model, zone + 1, zone + 1)
        Rows scaled to a maximum of one; attraction to void is zero.
    speed_take, speed_other : ndarray, shape (model, zone + 1, bin)
        Alias tables (Walker 1977) of the speed histograms.
    cos_fov : ndarray, shape (model,)
    dt_s
        The step, the same for all.
    components, factors, speeds, sights : ndarray of int64, shape (hook, 2)
        Address of an effect's function and its row of ``effects``.
    effects : ndarray, shape (model, effect, 8)
        Parameters of the effects.
    """

    zones: Floats
    turns: Floats
    gamma: Floats
    speed_take: Floats
    speed_other: Ints
    cos_fov: Floats
    dt_s: float
    components: Ints
    factors: Ints
    speeds: Ints
    sights: Ints
    effects: Floats


class Work(NamedTuple):
    """Room for one step, made once: nothing is allocated in the loop.

    Attributes
    ----------
    moves : ndarray, shape (agent, 4)
        Unit vector x and y of the next heading, landing zone, speed.
    parts : ndarray, shape (agent + component, 5)
        The heading mixture of one agent.
    zones : ndarray, shape (agent,)
        Zone ids before the step.
    grid_x, grid_y, values, density : ndarray, shape (angle + 1,)
        Unit vectors of the grid's angles, and densities on it.
    """

    moves: Floats
    parts: Floats
    zones: Floats
    grid_x: Floats
    grid_y: Floats
    values: Floats
    density: Floats


@kernel
def make_work(n: int, n_components: int, grid: int) -> Work:
    """Return room for n agents, so many components of effects, and a grid of angles."""
    angles = np.linspace(-math.pi, math.pi, grid + 1)
    return Work(
        np.zeros((n, 4)), np.zeros((n + n_components, 5)), np.zeros(n),
        np.cos(angles), np.sin(angles), np.zeros(grid + 1), np.zeros(grid + 1),
    )  # fmt: skip


@inlined
def settle(i: int, state: Floats, tank: Tank) -> None:
    """Write an agent's distance to the wall, the direction along it, and its clearance."""
    distance, tau_x, tau_y = nearest_wall(state[X, i], state[Y, i], tank)
    state[WALL, i], state[TAU_X, i], state[TAU_Y, i] = distance, tau_x, tau_y
    state[CLEAR, i] = clearance(state[X, i], state[Y, i], tank)


@kernel
def place(state: Floats, tank: Tank, random: NDArray[np.uint64]) -> None:
    """Put all agents at uniform places inside, with uniform headings."""
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


@inlined
def look(state: Floats, model: int, packed: Packed, sight: Sight) -> None:
    """Write what each agent sees of each other one."""
    n = state.shape[1]
    for i in range(n):
        for j in range(n):
            k = i * n + j
            # An agent stands on itself, at distance zero, and does not see itself.
            sight.dx_m[k] = state[X, j] - state[X, i]
            sight.dy_m[k] = state[Y, j] - state[Y, i]
            sight.hx[k], sight.hy[k] = state[HX, j], state[HY, j]
            sight.ahead_m[k] = sight.dx_m[k] * state[HX, i] + sight.dy_m[k] * state[HY, i]
    see(sight, packed.cos_fov[model])
    if packed.sights.shape[0] > 0:
        _attend(state, model, packed, sight)


@kernel
def _attend(state: Floats, model: int, packed: Packed, sight: Sight) -> None:
    n = state.shape[1]
    for h in range(packed.sights.shape[0]):
        parameters = packed.effects[model, packed.sights[h, 1]].ctypes.data
        for k in range(n * n):
            if sight.angle_sr[k] > 0.0:
                sight.angle_sr[k] *= call_sight(
                    packed.sights[h, 0], state.ctypes.data, sight.angle_sr.ctypes.data,
                    n, k // n, parameters, k % n,
                )  # fmt: skip

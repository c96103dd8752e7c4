"""One step of one agent: the density of its heading, and draws from it."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from zfcal.arena import Arena
from zfcal.arrays import Floats
from zfcal.errors import InputError
from zfcal.model.kernels.compiled import kernel
from zfcal.model.kernels.geometry import Tank, zone_of
from zfcal.model.kernels.heading import density_on_grid, draw_exact, draw_on_grid
from zfcal.model.kernels.looking import look
from zfcal.model.kernels.mixture import gather
from zfcal.model.kernels.perception import Sight, make_sight
from zfcal.model.kernels.placing import remember, settle
from zfcal.model.kernels.random import seeded
from zfcal.model.kernels.state import (
    DT_S,
    GRID,
    HX,
    HY,
    LEFT_AT_S,
    NEVER_S,
    PAST_HX,
    PAST_HY,
    STATES,
    ZONE,
    Packed,
    Work,
    X,
    Y,
    make_work,
)
from zfcal.model.packing import pack
from zfcal.model.simulate import check_sampler, tank_of
from zfcal.parameters import Parameters


def heading_density(
    parameters: Parameters,
    arena: Arena,
    *,
    xy_m: ArrayLike,
    heading_rad: ArrayLike,
    speed_m_s: float,
    agent: int = 0,
) -> tuple[Floats, Floats]:
    """Return the density of an agent's next heading, given where everybody is.

    Parameters
    ----------
    xy_m : array_like, shape (agent, 2)
        Positions in metres, all inside.
    heading_rad : array_like, shape (agent,)
    speed_m_s
        The speed of the step: it decides where a heading lands.

    Returns
    -------
    theta_rad : ndarray, shape (361,)
        From -pi to pi.
    density : ndarray, shape (361,)
        Per radian, with trapezoidal integral one; all zero where no direction
        is admissible.
    """
    state, packed, tank = _prepare(parameters, arena, xy_m, heading_rad, agent)
    work = make_work(state.shape[1], len(packed.components), GRID)
    density = _density(agent, speed_m_s, state, packed, tank, work, make_sight(state.shape[1] ** 2))
    theta = np.linspace(-np.pi, np.pi, GRID + 1)
    total = np.trapezoid(density, theta)
    return theta, density / total if total > 0 else density


def draw_headings(
    parameters: Parameters,
    arena: Arena,
    *,
    xy_m: ArrayLike,
    heading_rad: ArrayLike,
    speed_m_s: float,
    n: int,
    seed: int,
    sampler: str = "exact",
    grid: int = GRID,
    agent: int = 0,
) -> Floats:
    """Return n independent draws of an agent's next heading at a given speed.

    Parameters are those of `heading_density`; ``sampler`` is ``exact``
    or ``grid``, the latter on so many angles.

    Returns
    -------
    ndarray, shape (n,)
        Radians; NaN where no direction is admissible.
    """
    check_sampler(sampler, grid)
    state, packed, tank = _prepare(parameters, arena, xy_m, heading_rad, agent)
    word = np.random.SeedSequence(seed).generate_state(1, np.uint64)[0]
    work = make_work(state.shape[1], len(packed.components), grid)
    sight = make_sight(state.shape[1] ** 2)
    return _draw(agent, speed_m_s, n, word, state, packed, tank, work, sight, sampler == "grid")


def _prepare(
    parameters: Parameters, arena: Arena, xy_m: ArrayLike, heading_rad: ArrayLike, agent: int
) -> tuple[Floats, Packed, Tank]:
    xy = np.asarray(xy_m, dtype=np.float64)
    heading = np.asarray(heading_rad, dtype=np.float64)
    if xy.shape != (*heading.shape, 2) or heading.ndim != 1 or not 0 <= agent < len(xy):
        raise InputError(
            f"One step of agent {agent} needs positions (agent, 2) and headings (agent,), "
            f"got shapes {xy.shape} and {heading.shape}."
        )
    if not np.isfinite(heading).all():
        raise InputError("One step needs a heading of every agent; leave out whose is unknown.")
    tank = tank_of(arena)
    state = np.zeros((STATES, len(xy)))
    state[X], state[Y] = xy.T
    state[HX], state[HY] = np.cos(heading), np.sin(heading)
    state[DT_S] = parameters.dt_s
    if not _settle_all(state, tank):
        raise InputError("Agents must be inside the arena, got one outside.")
    packed = pack([parameters], arena)
    # Of one step alone nobody knows where the others were: they count as having stood still.
    return state, packed._replace(lags=np.zeros_like(packed.lags)), tank


@kernel
def _settle_all(state: Floats, tank: Tank) -> bool:
    for i in range(state.shape[1]):
        state[ZONE, i] = zone_of(state[X, i], state[Y, i], tank)
        if state[ZONE, i] == 0:
            return False
        settle(i, state, tank)
        state[PAST_HX, i], state[PAST_HY, i] = state[HX, i], state[HY, i]
        state[LEFT_AT_S, i] = -NEVER_S
    remember(state, tank)
    return True


@kernel
def _density(
    i: int, speed: float, state: Floats, packed: Packed, tank: Tank, work: Work, sight: Sight
) -> Floats:
    look(state, 0, packed, sight)
    density_on_grid(i, speed, state, 0, packed, tank, sight, work)
    return work.density.copy()


@kernel
def _draw(
    i: int, speed: float, n: int, seed: np.uint64, state: Floats, packed: Packed, tank: Tank,
    work: Work, sight: Sight, grid: bool,
) -> Floats:  # fmt: skip
    look(state, 0, packed, sight)
    random = seeded(seed)
    theta = np.empty(n)
    count, total = gather(i, state, 0, packed, sight, work)
    density_on_grid(i, speed, state, 0, packed, tank, sight, work)
    for k in range(n):
        if grid:
            drawn = draw_on_grid(i, speed, state, 0, packed, tank, sight, random, work)
        else:
            drawn = draw_exact(i, speed, state, 0, packed, tank, sight, random, work, count, total)
        theta[k] = np.arctan2(work.moves[i, 1], work.moves[i, 0]) if drawn else np.nan
    return theta

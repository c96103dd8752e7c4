"""Parameters of the base law, and its density for one state."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import i0e

from hidden import geometry, heading, states
from hidden.worlds import WALL_ZONE_M, Floats, Tank

# Shares of speeds of AB zebrafish in bins of 0.02 m/s, as published.
_SPEED = {
    1: (.0304615, .07993734, .10186769, .12054464, .14286059,
        .15312688, .14098084, .10748283, .07632245, .04641523),
    2: (.04810033, .13980081, .17786795, .17989672, .15912947,
        .12113611, .08011804, .04758392, .02788639, .01848027),
    3: (.02276516, .09278528, .16815177, .19097442, .18189135,
        .13670595, .10106352, .05881, .03190572, .01494682),
}  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Base:
    """Parameters by zone id; row 0 (outside) is unused.

    Parameters
    ----------
    kappa_0, kappa_f, alpha : ndarray, shape (4,)
    gamma : ndarray, shape (4, 4)
        From a zone (row) to a zone (column).
    speed : ndarray, shape (4, 10)
        Shares of bins of 0.02 m/s.
    fov_rad
        Field of view to each side.
    """

    kappa_0: Floats
    kappa_f: Floats
    alpha: Floats
    gamma: Floats
    speed: Floats
    fov_rad: float = math.radians(135)

    def plain(self) -> dict:
        """Return the numbers as lists, for a file."""
        names = ("kappa_0", "kappa_f", "alpha", "gamma", "speed")
        return {k: getattr(self, k).tolist() for k in names} | {"fov_rad": self.fov_rad}


def natural() -> Base:
    """Return the parameters that make fish change rooms every quarter of a minute."""
    speed = np.zeros((4, 10))
    for zone, shares in _SPEED.items():
        speed[zone] = np.array(shares) / sum(shares)
    gamma = np.zeros((4, 4))
    gamma[1, 1:], gamma[2, 1:], gamma[3, 1:] = (0.6, 0.9, 0.9), (0.6, 0.5, 0.4), (0.6, 0.8, 0.9)
    return Base(
        kappa_0=np.array([0.0, 9.0, 9.0, 8.0]),
        kappa_f=np.array([0.0, 8.0, 9.0, 20.0]),
        alpha=np.array([0.0, 17.0, 42.0, 49.0]),
        gamma=gamma,
        speed=speed,
    )


def shifted(rng: np.random.Generator) -> Base:
    """Return other parameters that fish might have, drawn far and wide."""
    base, gamma = natural(), np.zeros((4, 4))
    gamma[1:, 1:] = rng.uniform(0.25, 1.0, (3, 3))
    shares = np.zeros((4, 10))
    centre = 0.02 * (np.arange(10) + 0.5)
    for zone in (1, 2, 3):
        mean, sd = rng.uniform(0.05, 0.12), rng.uniform(0.03, 0.05)
        bell = np.exp(-0.5 * ((centre - mean) / sd) ** 2)
        shares[zone] = 0.9 * bell / bell.sum() + 0.1 * base.speed[zone]
    return replace(
        base,
        kappa_0=np.array([0.0, *rng.uniform(3, 18, 3)]),
        kappa_f=np.array([0.0, *rng.uniform(4, 25, 3)]),
        alpha=np.array([0.0, *rng.uniform(5, 50, 3)]),
        gamma=gamma,
        speed=shares,
    )


def law_of(base: Base) -> states.Law:
    """Return the parameters as the loops take them."""

    def scale(kappa):
        return 1 / (2 * math.pi * i0e(kappa))

    return states.Law(
        base.kappa_0, base.kappa_f, base.alpha, base.gamma, base.speed,
        scale(base.kappa_0), scale(base.kappa_f), base.fov_rad,
    )  # fmt: skip


def world_of(tank: Tank) -> geometry.World:
    """Return a tank as the loops take it."""
    far = np.full((2, 2), 1e6)
    mouths = tank.mouths if len(tank.mouths) else far
    return geometry.World(tank.outline, tank.corridor, mouths, WALL_ZONE_M)


def no_plan(n_agents: int) -> states.Plan:
    """Return a plan that hides nothing."""
    return states.Plan(
        np.zeros((n_agents, states.N_EFFECTS)), np.zeros(2), np.zeros(2), 0.0, 0.0,
        np.zeros(n_agents), -1, np.zeros((states.N_EFFECTS, states.N_CONSTANTS)), 0,
    )  # fmt: skip


def empty_past(n_steps: int, n_agents: int, *, first: int) -> states.Past:
    """Return the arrays of a run, to be filled; the trial begins at step ``first``."""
    a, b = (n_steps + 1, n_agents), (n_steps, n_agents)
    return states.Past(
        np.zeros((*a, 2)), np.zeros(a), np.zeros(a, np.int64), np.zeros(b), np.zeros(b),
        np.zeros(b), np.zeros(b, np.int64), np.zeros(b, np.int64), np.full(b, np.nan),
        np.full(b, np.nan), np.full((2, n_agents), -(10**6)), first,
    )  # fmt: skip


def heading_density(base, tank, *, xy_m, heading_rad, speed_m_s, agent=0):
    """Return angles and the base law's density there, for one state.

    Parameters
    ----------
    xy_m : array_like, shape (agent, 2)
    heading_rad : array_like, shape (agent,)
    speed_m_s
        The speed of the step.
    agent
        Whose heading.

    Returns
    -------
    tuple of ndarray, shape (180,)
        Middles of the cells, and density per radian there.
    """
    world, past = world_of(tank), empty_past(1, len(xy_m), first=0)
    past.xy[0], past.heading[0] = np.asarray(xy_m, float), np.asarray(heading_rad, float)
    past.zone[0] = [geometry.zone_of(x, y, world) for x, y in past.xy[0]]
    cells = np.empty(states.N_CELLS)
    plan = no_plan(len(xy_m))
    heading.heading_cells(agent, 0, speed_m_s, world, law_of(base), past, plan, cells)
    return states.ANGLE, cells

"""The model written down plainly and compiled: no tables, no vectors, a library's random numbers.

What a careful person gets in an afternoon, to set the kernel beside it. It draws
from the same law: a component, its von Mises law, and rejection.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from zfcal.model.kernels.geometry import Tank, zone_exact
from zfcal.model.kernels.state import Packed

Floats = NDArray[np.float64]


@njit(error_model="numpy")
def von_mises(kappa: float) -> float:
    """Return an angle about zero (Best and Fisher 1979)."""
    tau = 1 + math.sqrt(1 + 4 * kappa * kappa)
    rho = (tau - math.sqrt(2 * tau)) / (2 * kappa)
    r = (1 + rho * rho) / (2 * rho)
    while True:
        z = math.cos(math.pi * np.random.random())
        f = (1 + r * z) / (r + z)
        c = kappa * (r - f)
        u = np.random.random()
        if c * (2 - c) > u or math.log(c / u) + 1 - c >= 0:
            angle = math.acos(min(1.0, max(-1.0, f)))
            return angle if np.random.random() < 0.5 else -angle


@njit(error_model="numpy")
def solid_angle(dx: float, dy: float, heading: float) -> float:
    """Return what a body covers whose head is at an offset."""
    hx, hy = math.cos(heading), math.sin(heading)
    mx, my = dx - 0.02 / 3 * hx, dy - 0.02 / 3 * hy
    xs = (dx, dx - 0.02 * hx, mx - 0.01 * hy, mx + 0.01 * hy)
    ys = (dy, dy - 0.02 * hy, my + 0.01 * hx, my - 0.01 * hx)
    widest, a, b = -1.0, 0, 1
    for i in range(4):
        for j in range(i):
            turn = math.atan2(ys[i], xs[i]) - math.atan2(ys[j], xs[j])
            turn = abs((turn + math.pi) % (2 * math.pi) - math.pi)
            if turn > widest:
                widest, a, b = turn, i, j
    na, nb = math.hypot(xs[a], ys[a]), math.hypot(xs[b], ys[b])
    nt = math.sqrt(mx * mx + my * my + 0.005**2)
    above = 0.005 * abs(xs[a] * ys[b] - ys[a] * xs[b])
    below = na * nt * nb + (xs[a] * mx + ys[a] * my) * nb
    below += (xs[a] * xs[b] + ys[a] * ys[b]) * nt + (mx * xs[b] + my * ys[b]) * na
    return 4 * math.atan2(above, below)


@njit(error_model="numpy")
def along_wall(x: float, y: float, walls: Floats) -> float:
    """Return the direction along the nearest wall."""
    best, angle = math.inf, 0.0
    for s in range(len(walls)):
        px, py = x - walls[s, 0], y - walls[s, 1]
        t = min(1.0, max(0.0, (px * walls[s, 2] + py * walls[s, 3]) * walls[s, 4]))
        ex, ey = px - t * walls[s, 2], py - t * walls[s, 3]
        if ex * ex + ey * ey < best:
            best, angle = ex * ex + ey * ey, math.atan2(ey, ex) + math.pi / 2
    return angle


@njit(error_model="numpy")
def run(
    n_agents: int, n_steps: int, seed: int, packed: Packed, speeds: Floats, tank: Tank
) -> Floats:
    """Return where all were at each step, shape (step, agent, 2).

    Parameters
    ----------
    speeds : ndarray, shape (zone, 10)
        Frequencies of the speed histograms.
    """
    np.random.seed(seed)
    xy, heading = np.empty((n_steps, n_agents, 2)), np.empty(n_agents)
    zone = np.zeros(n_agents, np.int64)
    for i in range(n_agents):
        while zone[i] == 0:
            xy[0, i] = np.random.random(2)
            zone[i] = zone_exact(xy[0, i, 0], xy[0, i, 1], tank)
        heading[i] = 2 * math.pi * np.random.random()
    weight, toward = np.empty(n_agents), np.empty(n_agents)
    following, landing = np.empty(n_agents), np.empty(n_agents, np.int64)
    fov = math.acos(packed.cos_fov[0])
    for k in range(1, n_steps):
        for i in range(n_agents):
            x, y, z = xy[k - 1, i, 0], xy[k - 1, i, 1], zone[i]
            kappa_0, kappa_f, alpha = packed.zones[0, z]
            total = 1.0
            for j in range(n_agents):
                weight[j] = 0.0
                if j == i:
                    continue
                dx, dy = xy[k - 1, j, 0] - x, xy[k - 1, j, 1] - y
                bearing = math.atan2(dy, dx)
                off = abs((bearing - heading[i] + math.pi) % (2 * math.pi) - math.pi)
                if off <= fov:
                    weight[j] = alpha * solid_angle(dx, dy, heading[j])
                    toward[j] = bearing + (math.pi if math.hypot(dx, dy) < 0.02 else 0.0)
                    total += weight[j]
            column = np.searchsorted(np.cumsum(speeds[z - 1]), np.random.random())
            reach = packed.dt_s * 0.02 * (min(column, 9) + np.random.random())
            while True:
                level = total * np.random.random() - 1.0
                if level < 0:
                    mean, kappa = heading[i], kappa_0
                    if tank.follows[z]:
                        mean = along_wall(x, y, tank.walls)
                        mean += math.pi if np.random.random() < 0.5 else 0.0
                else:
                    j = 0
                    while j < n_agents - 1 and level >= weight[j]:
                        level -= weight[j]
                        j += 1
                    mean, kappa = toward[j], kappa_f
                theta = mean + von_mises(kappa)
                to_x, to_y = x + reach * math.cos(theta), y + reach * math.sin(theta)
                landing[i] = zone_exact(to_x, to_y, tank)
                if np.random.random() < packed.gamma[0, z, landing[i]]:
                    break
            following[i], xy[k, i, 0], xy[k, i, 1] = theta, to_x, to_y
        heading[:], zone[:] = following, landing
    return xy

"""What an agent has around it, and how a bell or a leaning enters the cells of its next heading.

Lengths are metres, times seconds, angles radians.
"""

from __future__ import annotations

import math

from numba import njit

from hidden.states import ANGLE, CELL_RAD, COS, DT_S, N_CELLS, SIN


@njit(cache=True)
def room_of(x, y):
    """Return the room of a point: 0 up left, 1 down right."""
    return 0 if y > x else 1


@njit(cache=True)
def clock_s(t, past):
    """Return the time since the trial began; 0 before."""
    return max(0, t - past.first) * DT_S


@njit(cache=True)
def gap_m(i, j, t, past):
    """Return the distance of two agents."""
    return math.hypot(past.xy[t, j, 0] - past.xy[t, i, 0], past.xy[t, j, 1] - past.xy[t, i, 1])


@njit(cache=True)
def bearing_rad(i, j, t, past):
    """Return the direction from one agent to another."""
    return math.atan2(past.xy[t, j, 1] - past.xy[t, i, 1], past.xy[t, j, 0] - past.xy[t, i, 0])


@njit(cache=True)
def nearest_of(i, t, past):
    """Return the nearest other, and its distance; -1 where there is none."""
    nearest, away = -1, math.inf
    for j in range(past.xy.shape[1]):
        d = gap_m(i, j, t, past)
        if j != i and d < away:
            nearest, away = j, d
    return nearest, away


@njit(cache=True)
def company(i, t, past, reach_m):
    """Return the mean heading of the others within reach, as a vector, and how many."""
    c, s, n = 0.0, 0.0, 0
    for j in range(past.xy.shape[1]):
        d = math.hypot(past.xy[t, j, 0] - past.xy[t, i, 0], past.xy[t, j, 1] - past.xy[t, i, 1])
        if j != i and d < reach_m:
            c, s, n = c + math.cos(past.heading[t, j]), s + math.sin(past.heading[t, j]), n + 1
    return c, s, n


@njit(cache=True)
def centroid_of(i, t, past):
    """Return the distance and direction of the centroid of all others."""
    n = max(past.xy.shape[1] - 1, 1)
    dx = (past.xy[t, :, 0].sum() - past.xy[t, i, 0]) / n - past.xy[t, i, 0]
    dy = (past.xy[t, :, 1].sum() - past.xy[t, i, 1]) / n - past.xy[t, i, 1]
    return math.hypot(dx, dy), math.atan2(dy, dx)


@njit(cache=True)
def n_leavers(i, t, past, memory_s):
    """Return how many others left this agent's room within so many seconds."""
    room, n = room_of(past.xy[t, i, 0], past.xy[t, i, 1]), 0
    for j in range(past.xy.shape[1]):
        if j != i and 0 <= (t - past.left[room, j]) * DT_S < memory_s:
            n += 1
    return n


@njit(cache=True)
def add_mode(out, weight, mode_rad, kappa, scale):
    """Add one bell to the cells."""
    if weight <= 0:
        return
    c, s = math.cos(mode_rad), math.sin(mode_rad)
    for k in range(N_CELLS):
        out[k] += weight * scale * math.exp(kappa * (COS[k] * c + SIN[k] * s - 1))


@njit(cache=True)
def scale_of(kappa):
    """Return what makes a bell of the cells one that sums to 1.

    The sum over cells of a smooth periodic function is its integral, to rounding, as long
    as the bell is wider than a cell.
    """
    total = 0.0
    for k in range(N_CELLS):
        total += math.exp(kappa * (COS[k] - 1))
    return 1 / (total * CELL_RAD)


@njit(cache=True)
def add_wide(out, weight, mode_rad, kappa):
    """Add one bell of any width to the cells."""
    if weight > 0:
        add_mode(out, weight, mode_rad, kappa, scale_of(kappa))


@njit(cache=True)
def lean_toward(out, weight, x, y, to_x, to_y):
    """Make directions toward a point up to 1 + weight times as likely as those away from it."""
    bearing = math.atan2(to_y - y, to_x - x)
    c, s = math.cos(bearing), math.sin(bearing)
    for k in range(N_CELLS):
        out[k] *= 1 + weight * (1 + COS[k] * c + SIN[k] * s) / 2


@njit(cache=True)
def tilt(out, weight, mode_rad):
    """Weigh the cells by exp(weight cos), of the angle to a direction."""
    c, s = math.cos(mode_rad), math.sin(mode_rad)
    for k in range(N_CELLS):
        out[k] *= math.exp(weight * (COS[k] * c + SIN[k] * s))


@njit(cache=True)
def favour_left(out, share, phi):
    """Weigh the cells by 1 + share sin, of the angle to the left of a heading."""
    for k in range(N_CELLS):
        out[k] *= max(0.0, 1 + share * math.sin(ANGLE[k] - phi))


@njit(cache=True)
def mean_speed(i, t, past, reach_m):
    """Return the mean last speed of the others within reach, and how many they are."""
    total, n = 0.0, 0
    for j in range(past.xy.shape[1]):
        if j != i and gap_m(i, j, t, past) < reach_m:
            total, n = total + past.speed[t - 1, j], n + 1
    return total / max(n, 1), n


@njit(cache=True)
def cell_of(theta):
    """Return the cell of a heading."""
    return min(N_CELLS - 1, max(0, int((theta + math.pi) / CELL_RAD)))

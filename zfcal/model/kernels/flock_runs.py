"""Whole simulations of small groups abreast, counted on the fly; the steps are in ``flock``."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from zfcal.model.compiled import kernel, lean
from zfcal.model.geometry import ON_WALL_M, Tank, nearest_listed
from zfcal.model.kernels.flock import (
    Flock,
    decide_alone,
    draw_headings,
    draw_speeds,
    find_tables,
    make_flock,
    nowhere,
    observe,
    repeat,
)
from zfcal.model.kernels.pairs import bin_of
from zfcal.model.kernels.perception import Sight, in_vectors, make_sight
from zfcal.model.kernels.random import next_word, seeded
from zfcal.model.kernels.run import Counts, start
from zfcal.model.kernels.world import (
    GRID,
    HX,
    HY,
    STATES,
    TAU_X,
    TAU_Y,
    WALL,
    ZONE,
    Packed,
    Work,
    X,
    Y,
    make_work,
)

_BINS = 10

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Words = NDArray[np.uint64]


@lean
def arrive(size: int, flock: Flock, tank: Tank) -> None:
    """Move all agents, and look up their walls."""
    walls, nearest = tank.walls.reshape(-1), tank.nearest.reshape(-1)
    columns, per_wall = tank.cells.shape[1], tank.walls.shape[1]
    for s in range(size):
        flock.before[s] = flock.zone[s]
    for s in range(size):
        flock.zone[s] = flock.to_zone[s]
    for s in range(size):
        flock.hx[s] = flock.to_hx[s]
    for s in range(size):
        flock.hy[s] = flock.to_hy[s]
    for s in range(size):
        x, y = flock.to_x[s], flock.to_y[s]
        at = int((y - tank.y0_m) * tank.per_m) * columns + int((x - tank.x0_m) * tank.per_m)
        near = int(nearest[np.uintp(at)])
        if near < 0:
            near = nearest_listed(x, y, -near - 1, tank.walls, tank.lists)
        w = np.uintp(per_wall * near)
        along_x, along_y = walls[w + np.uintp(2)], walls[w + np.uintp(3)]
        px, py = x - walls[w], y - walls[w + np.uintp(1)]
        t = min(1.0, max(0.0, (px * along_x + py * along_y) * walls[w + np.uintp(4)]))
        ex, ey = px - t * along_x, py - t * along_y
        distance = math.sqrt(ex * ex + ey * ey)
        tau_x, tau_y, length = -ey, ex, distance
        if distance < ON_WALL_M:
            tau_x, tau_y, length = along_x, along_y, walls[w + np.uintp(5)]
        flock.x[s], flock.y[s], flock.wall[s] = x, y, distance
        flock.tau_x[s], flock.tau_y[s] = tau_x / length, tau_y / length
    repeat(size, flock)


@kernel
def advance_flock(
    step: int, sizes: tuple[int, int], flock: Flock, packed: Packed, tank: Tank, state: Floats,
    sight: Sight, work: Work,
) -> None:  # fmt: skip
    """Move all agents of all lanes at once by one step.

    Parameters
    ----------
    sizes
        Agents of a lane, and lanes.
    state, sight, work
        Room for one group.
    """
    size = sizes[0] * sizes[1]
    find_tables(size, flock, packed)
    observe(sizes[0], sizes[1], flock)
    draw_speeds(step, size, flock, packed, tank)
    left = draw_headings(step, sizes, flock, packed, tank)
    for p in range(left):
        decide_alone(step, flock.pending[p], True, sizes, flock, packed, tank, state, sight, work)
    for p in range(nowhere(size, flock)):
        decide_alone(step, flock.pending[p], False, sizes, flock, packed, tank, state, sight, work)
    arrive(size, flock, tank)


@lean
def count_flock(
    n_counted: int, lanes: int, moved: bool, flock: Flock, tank: Tank, counts: Ints
) -> None:
    """Count the first agents of all lanes.

    Parameters
    ----------
    moved
        Whether a step led here; else there is neither transition nor speed.
    counts : ndarray of int64, shape (lane * bin,)
        For each lane the histograms of `_hand_over`.
    """
    zones = tank.follows.size
    per_lane, per_zone = counts.size // lanes, _BINS * zones
    per_speed = _BINS / (tank.speed_high - tank.speed_low)
    x, y, zone, column = flock.x, flock.y, flock.zone, flock.column
    for i in range(n_counted):
        a = i * lanes
        for m in range(lanes):
            bin_ = bin_of(flock.wall[a + m], tank.wall_low_m, tank.wall_per_m)
            counts[np.uintp(m * per_lane + per_zone + _BINS * zone[a + m] + bin_)] += 1
        for m in range(lanes if moved else 0):
            before, at = flock.before[a + m], m * per_lane + 2 * per_zone
            bin_ = bin_of(flock.speed[a + m], tank.speed_low, per_speed)
            counts[np.uintp(at + _BINS * before + bin_)] += 1
            counts[np.uintp(at + per_zone + zones * before + zone[a + m])] += 1
        for j in range(i):
            b = j * lanes
            for m in range(lanes):
                dx, dy = x[a + m] - x[b + m], y[a + m] - y[b + m]
                away = math.sqrt(dx * dx + dy * dy)
                bin_ = bin_of(away, tank.distance_low_m, tank.distance_per_m)
                # Pairs of two zones go where nobody looks: the bins of zone 0.
                both = zone[a + m] if zone[a + m] == zone[b + m] else 0
                column[m] = m * per_lane + _BINS * both + bin_
            for m in range(lanes):
                counts[np.uintp(column[m])] += 1


@kernel
def _hand_over(own: Ints, model: int, run: int, counts: Counts) -> None:
    """Add the histograms of one lane to those of all.

    They stand one behind the other, with zone 0 in each: distance, wall, speed (all by
    zone and bin), transition.
    """
    zones = counts.occupation.shape[2]
    per_zone = _BINS * (zones + 1)
    rows = own[: 3 * per_zone].reshape(3, zones + 1, _BINS)
    counts.distance[model, run] += rows[0, 1:]
    counts.wall[model, run] += rows[1, 1:]
    counts.speed[model, run] += rows[2, 1:]
    for zone in range(zones):
        counts.occupation[model, run, zone] += rows[1, zone + 1].sum()
    counts.transition[model, run] += own[3 * per_zone :].reshape(zones + 1, zones + 1)[1:, 1:]


@kernel
def _set_out(
    first: int, seeds: Words, sizes: tuple[int, int], burn_in: int, individuals: Floats,
    flock: Flock, packed: Packed, tank: Tank, state: Floats, work: Work,
) -> None:  # fmt: skip
    """Put all agents of all lanes into the tank; lane m is job ``first + m``."""
    n, lanes = sizes
    for m in range(lanes):
        job = first + m
        random = seeded(seeds[job % seeds.size])
        state[:] = 0.0
        start(state, burn_in, packed, tank, individuals, work, random)
        for i in range(n):
            s = i * lanes + m
            flock.x[s], flock.y[s] = state[X, i], state[Y, i]
            flock.hx[s], flock.hy[s] = state[HX, i], state[HY, i]
            flock.tau_x[s], flock.tau_y[s] = state[TAU_X, i], state[TAU_Y, i]
            flock.wall[s], flock.zone[s] = state[WALL, i], int(state[ZONE, i])
            flock.model[s] = job // seeds.size
            flock.cos_fov[s] = packed.cos_fov[job // seeds.size]
            flock.key[s] = next_word(random)
    repeat(n * lanes, flock)


@kernel
def count_flock_runs(
    first: int, last: int, seeds: Words, sizes: tuple[int, int, int, int], individuals: Floats,
    packed: Packed, tank: Tank, counts: Counts,
) -> None:  # fmt: skip
    """Simulate jobs ``first`` to ``last - 1`` abreast; parameters are those of `run.count_runs`."""
    n, n_counted, burn_in, samples = sizes
    lanes = last - first
    flock, state, work = make_flock(n, lanes), np.zeros((STATES, n)), make_work(n, 0, GRID)
    sight = make_sight(in_vectors(n * n))
    zones = tank.follows.size
    own = np.zeros(lanes * (3 * _BINS * zones + zones * zones), np.int64)
    _set_out(first, seeds, (n, lanes), burn_in, individuals, flock, packed, tank, state, work)
    for step in range(burn_in + samples):
        if step > 0:
            advance_flock(step, (n, lanes), flock, packed, tank, state, sight, work)
        if step >= burn_in:
            count_flock(n_counted, lanes, step > burn_in, flock, tank, own)
    for m in range(lanes):
        per_lane = own.size // lanes
        job = first + m
        _hand_over(
            own[m * per_lane : (m + 1) * per_lane], job // seeds.size, job % seeds.size, counts
        )


@kernel
def record_flock_run(
    seed: np.uint64, individuals: Floats, burn_in: int, samples: int, packed: Packed, tank: Tank
) -> Floats:
    """Simulate the first model and return its states, as `run.record_run` does.

    The run is that which `count_flock_runs` counts.
    """
    n = individuals.shape[1]
    flock, state, work = make_flock(n, 1), np.zeros((STATES, n)), make_work(n, 0, GRID)
    sight = make_sight(in_vectors(n * n))
    seeds = np.empty(1, np.uint64)
    seeds[0] = seed
    _set_out(0, seeds, (n, 1), burn_in, individuals, flock, packed, tank, state, work)
    record = np.empty((samples, n, 5))
    for step in range(burn_in + samples):
        if step > 0:
            advance_flock(step, (n, 1), flock, packed, tank, state, sight, work)
        if step >= burn_in:
            for i in range(n):
                record[step - burn_in, i, 0] = flock.x[i]
                record[step - burn_in, i, 1] = flock.y[i]
                record[step - burn_in, i, 2] = flock.hx[i]
                record[step - burn_in, i, 3] = flock.hy[i]
                record[step - burn_in, i, 4] = flock.speed[i]
    return record

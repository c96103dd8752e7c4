"""Whole simulations: steps of all agents, counted on the fly or recorded."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Floats, Ints
from zfcal.model.kernels.compiled import inlined, kernel, lean
from zfcal.model.kernels.geometry import Tank
from zfcal.model.kernels.heading import apply_move, draw_move
from zfcal.model.kernels.looking import look, look_back, note_late
from zfcal.model.kernels.pairs import bin_of
from zfcal.model.kernels.perception import Sight, in_vectors, make_sight
from zfcal.model.kernels.placing import place, place_at, remember, settle
from zfcal.model.kernels.random import seeded
from zfcal.model.kernels.state import (
    DT_S,
    GRID,
    HX,
    HY,
    LATE_PART,
    LATE_WHOLE,
    SPEED,
    STATES,
    TIME,
    WALL,
    ZONE,
    Packed,
    Work,
    X,
    Y,
    make_work,
    splits,
)

Random = NDArray[np.uint64]


class Counts(NamedTuple):
    """Histograms of simulations, each with leading axes (model, run).

    Attributes
    ----------
    distance, wall, speed : ndarray of int64, shape (model, run, zone, 10)
    occupation : ndarray of int64, shape (model, run, zone)
    transition : ndarray of int64, shape (model, run, zone, zone)
    """

    distance: Ints
    wall: Ints
    occupation: Ints
    transition: Ints
    speed: Ints


@lean
def advance(
    state: Floats, model: int, packed: Packed, tank: Tank, sight: Sight, random: Random,
    work: Work, grid: bool,
) -> None:  # fmt: skip
    """Move all agents at once by one step: each sees where the others were."""
    if packed.lags[model] > 0:
        see_late(state, model, packed, sight, work)
    else:
        look(state, model, packed, sight)
    n = state.shape[1]
    for i in range(n):
        draw_move(i, state, model, packed, tank, sight, random, work, grid)
    for i in range(n):
        apply_move(i, work, packed.dt_s, state)
        settle(i, state, tank)
        state[TIME, i] += packed.dt_s * packed.clock_s[1]
    if packed.effects.shape[1] > 0:
        remember(state, tank)


@inlined
def _between(past: Floats, after: int, before: int, part: float) -> None:
    """Write into the last row where all were between two steps, ``part`` of the way back."""
    for row in range(past.shape[1]):
        for i in range(past.shape[2]):
            past[-1, row, i] = (1.0 - part) * past[after, row, i] + part * past[before, row, i]
    for i in range(past.shape[2]):
        length = math.hypot(past[-1, 2, i], past[-1, 3, i])
        if length > 0.0:
            past[-1, 2, i], past[-1, 3, i] = past[-1, 2, i] / length, past[-1, 3, i] / length


@inlined
def see_late(state: Floats, model: int, packed: Packed, sight: Sight, work: Work) -> None:
    """Look at where the others were some steps ago, and keep where all are now.

    Where but a share is late, that goes to ``work.late``, and sight is of the present.
    """
    slots = work.past.shape[0] - 1
    step = int(work.steps[0])
    for i in range(state.shape[1]):
        work.past[step % slots, 0, i], work.past[step % slots, 1, i] = state[X, i], state[Y, i]
        work.past[step % slots, 2, i], work.past[step % slots, 3, i] = state[HX, i], state[HY, i]
    seen = max(0, step - packed.lags[model]) % slots
    work.steps[0] = step + 1.0
    late = packed.lates[model]
    if late[LATE_PART] < 1.0:
        after = max(0, step - packed.lags[model] + 1) % slots
        _between(work.past, after, seen, late[LATE_PART])
        seen = slots
    if late[LATE_WHOLE] > 0.0:
        look_back(state, work.past, seen, model, packed, sight)
    else:
        look(state, model, packed, sight)
    if splits(model, packed):
        note_late(state, work.past, seen, late, sight, work.late)
        if late[LATE_WHOLE] > 0.0:
            look(state, model, packed, sight)


@inlined
def _count_state(
    state: Floats, n_counted: int, tank: Tank, model: int, run: int, counts: Counts
) -> None:
    for i in range(n_counted):
        zone = int(state[ZONE, i])
        counts.occupation[model, run, zone - 1] += 1
        column = bin_of(state[WALL, i], tank.wall_low_m, tank.wall_per_m)
        counts.wall[model, run, zone - 1, column] += 1
        for j in range(i):
            # Of another zone none is added: whether it is one no processor can foresee.
            away = math.sqrt((state[X, i] - state[X, j]) ** 2 + (state[Y, i] - state[Y, j]) ** 2)
            column = bin_of(away, tank.distance_low_m, tank.distance_per_m)
            counts.distance[model, run, zone - 1, column] += state[ZONE, j] == state[ZONE, i]


@inlined
def count_step(
    zones_before: Floats, state: Floats, n_counted: int, tank: Tank, model: int, run: int,
    counts: Counts,
) -> None:  # fmt: skip
    """Count the first agents' transitions and speeds."""
    per = 10.0 / (tank.speed_high - tank.speed_low)
    for i in range(n_counted):
        before = int(zones_before[i]) - 1
        counts.transition[model, run, before, int(state[ZONE, i]) - 1] += 1
        counts.speed[model, run, before, bin_of(state[SPEED, i], tank.speed_low, per)] += 1


@kernel
def own_counts(n_zones: int) -> Counts:
    """Return histograms of one simulation, for one thread.

    Those of neighbouring models lie side by side in memory, and two processors that
    count there take the same lines from one another at every step.
    """
    return Counts(
        np.zeros((1, 1, n_zones, 10), dtype=np.int64),
        np.zeros((1, 1, n_zones, 10), dtype=np.int64),
        np.zeros((1, 1, n_zones), dtype=np.int64),
        np.zeros((1, 1, n_zones, n_zones), dtype=np.int64),
        np.zeros((1, 1, n_zones, 10), dtype=np.int64),
    )


@kernel
def clear_counts(own: Counts) -> None:
    """Set the histograms of one simulation to zero."""
    own.distance[:] = 0
    own.wall[:] = 0
    own.occupation[:] = 0
    own.transition[:] = 0
    own.speed[:] = 0


@kernel
def hand_over(own: Counts, model: int, run: int, counts: Counts) -> None:
    """Add the histograms of one simulation to those of all."""
    counts.distance[model, run] += own.distance[0, 0]
    counts.wall[model, run] += own.wall[0, 0]
    counts.occupation[model, run] += own.occupation[0, 0]
    counts.transition[model, run] += own.transition[0, 0]
    counts.speed[model, run] += own.speed[0, 0]


@kernel
def count_runs(
    first: int, last: int, seeds: Random, sizes: tuple[int, int, int, int], individuals: Floats,
    poses: Floats, packed: Packed, tank: Tank, counts: Counts,
) -> None:  # fmt: skip
    """Simulate jobs ``first`` to ``last - 1`` and add up their histograms.

    Parameters
    ----------
    first, last
        Job ``k`` is run ``k % R`` of model ``k // R``.
    seeds : ndarray of uint64, shape (R,)
        One per run, the same for all models (common random numbers).
    sizes
        Agents, agents that count (the first ones), steps of burn-in, samples.
    individuals : ndarray, shape (2, agent)
        Kind and trait of each agent.
    poses : ndarray, shape (agent, 3) or (0, 3)
        Where each agent begins, see `start`.
    """
    n, n_counted, burn_in, samples = sizes
    state = np.zeros((STATES, n))
    work = make_work(n, packed.components.shape[0], GRID)
    sight = make_sight(in_vectors(n * n))
    own = own_counts(counts.occupation.shape[2])
    for job in range(first, last):
        model, run = job // seeds.size, job % seeds.size
        clear_counts(own)
        random = seeded(seeds[run])
        state[:] = 0.0
        start(state, burn_in, packed, tank, individuals, poses, work, random)
        for _ in range(burn_in):
            advance(state, model, packed, tank, sight, random, work, False)
        state[TIME] = packed.clock_s[0]
        _count_state(state, n_counted, tank, 0, 0, own)
        for _ in range(samples - 1):
            for i in range(n_counted):
                work.zones[i] = state[ZONE, i]
            advance(state, model, packed, tank, sight, random, work, False)
            count_step(work.zones, state, n_counted, tank, 0, 0, own)
            _count_state(state, n_counted, tank, 0, 0, own)
        hand_over(own, model, run, counts)


@inlined
def start(
    state: Floats, burn_in: int, packed: Packed, tank: Tank, individuals: Floats, poses: Floats,
    work: Work, random: Random,
) -> None:  # fmt: skip
    """Put all agents into the tank, so long before the first sample.

    Parameters
    ----------
    poses : ndarray, shape (agent, 3) or (0, 3)
        Where each begins, see `place_at`; with none, anywhere.
    """
    state[TIME] = packed.clock_s[0] - burn_in * packed.dt_s * packed.clock_s[1]
    state[DT_S] = packed.dt_s
    place(state, tank, individuals, random)
    place_at(state, poses, tank)
    work.steps[0] = 0.0


@kernel
def record_run(
    seed: np.uint64, individuals: Floats, burn_in: int, samples: int, packed: Packed, tank: Tank,
    grid: int,
) -> Floats:  # fmt: skip
    """Simulate the first model and return its states.

    Parameters
    ----------
    individuals : ndarray, shape (2, agent)
        Kind and trait of each agent.
    grid
        Angles of the numeric sampler; 0 for the exact one.

    Returns
    -------
    ndarray, shape (sample, agent, 5)
        x, y in metres, unit vector x, y of the heading, speed of the step that
        led here in m/s.
    """
    n = individuals.shape[1]
    state = np.zeros((STATES, n))
    work = make_work(n, packed.components.shape[0], grid if grid > 0 else GRID)
    sight = make_sight(in_vectors(n * n))
    random = seeded(seed)
    start(state, burn_in, packed, tank, individuals, np.empty((0, 3)), work, random)
    for _ in range(burn_in):
        advance(state, 0, packed, tank, sight, random, work, grid > 0)
    state[TIME] = packed.clock_s[0]
    record = np.empty((samples, n, 5))
    for k in range(samples):
        if k > 0:
            advance(state, 0, packed, tank, sight, random, work, grid > 0)
        for i in range(n):
            record[k, i, 0], record[k, i, 1] = state[X, i], state[Y, i]
            record[k, i, 2], record[k, i, 3] = state[HX, i], state[HY, i]
            record[k, i, 4] = state[SPEED, i]
    return record

"""Whole simulations of large groups, as `zfcal.model.kernels.run` does those of small ones.

They are by themselves, so that who has five fish does not wait for their compilation.
"""

from __future__ import annotations

import numpy as np

from zfcal.arrays import Floats
from zfcal.model.kernels.compiled import inlined, kernel
from zfcal.model.kernels.crowd import advance_crowd
from zfcal.model.kernels.crowd_cells import make_crowd
from zfcal.model.kernels.geometry import Tank
from zfcal.model.kernels.pairs import Pairs, add_pairs, bin_of, make_pairs
from zfcal.model.kernels.random import seeded
from zfcal.model.kernels.run import Counts, Random, count_step, start
from zfcal.model.kernels.state import (
    GRID,
    HX,
    HY,
    SPEED,
    STATES,
    WALL,
    ZONE,
    Packed,
    X,
    Y,
    make_work,
)


@inlined
def _count_state(
    state: Floats, n_counted: int, tank: Tank, model: int, run: int, pairs: Pairs, counts: Counts
) -> None:
    for i in range(n_counted):
        zone = int(state[ZONE, i])
        counts.occupation[model, run, zone - 1] += 1
        column = bin_of(state[WALL, i], tank.wall_low_m, tank.wall_per_m)
        counts.wall[model, run, zone - 1, column] += 1
    add_pairs(state, n_counted, pairs, counts.distance[model, run])


@kernel
def count_crowd_runs(
    first: int, last: int, seeds: Random, sizes: tuple[int, int, int, int], individuals: Floats,
    poses: Floats, packed: Packed, tank: Tank, counts: Counts,
) -> None:  # fmt: skip
    """Simulate jobs ``first`` to ``last - 1``; parameters are those of `count_runs`."""
    n, n_counted, burn_in, samples = sizes
    state = np.zeros((STATES, n))
    work = make_work(n, 0, GRID)
    crowd, pairs = make_crowd(n, tank), make_pairs(n_counted, tank)
    for job in range(first, last):
        model, run = job // seeds.size, job % seeds.size
        random = seeded(seeds[run])
        state[:] = 0.0
        start(state, burn_in, packed, tank, individuals, poses, work, random)
        for step in range(burn_in + samples):
            if step > 0:
                for i in range(n_counted):
                    work.zones[i] = state[ZONE, i]
                advance_crowd(state, model, packed, tank, random, work, crowd)
            if step > burn_in:
                count_step(work.zones, state, n_counted, tank, model, run, counts)
            if step >= burn_in:
                _count_state(state, n_counted, tank, model, run, pairs, counts)


@kernel
def record_crowd_run(
    seed: np.uint64, individuals: Floats, burn_in: int, samples: int, packed: Packed, tank: Tank
) -> Floats:
    """Simulate the first model by the exact sampler; see `record_run`.

    Returns
    -------
    ndarray, shape (sample, agent, 5)
    """
    n = individuals.shape[1]
    state = np.zeros((STATES, n))
    work = make_work(n, 0, GRID)
    crowd = make_crowd(n, tank)
    random = seeded(seed)
    start(state, burn_in, packed, tank, individuals, np.empty((0, 3)), work, random)
    record = np.empty((samples, n, 5))
    for step in range(burn_in + samples):
        if step > 0:
            advance_crowd(state, 0, packed, tank, random, work, crowd)
        if step >= burn_in:
            row = record[step - burn_in]
            for i in range(n):
                row[i, 0], row[i, 1] = state[X, i], state[Y, i]
                row[i, 2], row[i, 3] = state[HX, i], state[HY, i]
                row[i, 4] = state[SPEED, i]
    return record

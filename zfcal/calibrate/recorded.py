"""What the compiled simulation does not count, from the tracks of simulated groups.

Statistics beside D, W, O, T and V, and everything where headings are drawn by the numeric sampler.

The same seeds give the same paths as where D, W, O, T and V are counted on the fly. To
record the paths and to look at them with the registry costs more than the simulation.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np

from zfcal.arena import Arena
from zfcal.arrays import Floats, Ints, Seeds
from zfcal.behaviour.features.registry import named
from zfcal.behaviour.features.statistic import Points, count
from zfcal.behaviour.located import locate
from zfcal.model.kernels.crowd_runs import record_crowd_run
from zfcal.model.kernels.run import record_run
from zfcal.model.simulate import Packed, burn_in_steps, individuals, is_crowd
from zfcal.model.tank import tank_of
from zfcal.tracks import FISH, Samples


class Runs(NamedTuple):
    """What is simulated, and of how many agents.

    Attributes
    ----------
    n_agents, n_counted, n_robots
        Agents in the tank; how many count, from the first one; how many are robots, from
        the last one.
    n_steps
        Samples, after 60 s of burn-in.
    seeds : ndarray of uint64, shape (run,)
        The same for all models.
    n_threads
        The numbers do not depend on it.
    grid
        Angles of the numeric sampler's grid; 0 for the exact sampler.
    """

    n_agents: int
    n_counted: int
    n_robots: int
    n_steps: int
    seeds: Seeds
    n_threads: int = 1
    grid: int = 0


def count_recorded(
    models: Sequence[Packed], arena: Arena, names: Sequence[str], runs: Runs
) -> dict[str, Ints]:
    """Simulate every model with every seed and count further statistics.

    Parameters
    ----------
    models
        One model each, from `zfcal.model.simulate.pack` or ``pack_genes``.
    arena
        Where they swim.
    names
        What to count.
    runs
        How many agents, and how long.

    Returns
    -------
    dict of ndarray of int64, shape (model, run, ...)
    """
    seeds = runs.seeds
    people, tank = individuals(runs.n_agents, runs.n_robots), tank_of(arena)

    def one(job: int) -> dict[str, Ints]:
        packed, seed = models[job // len(seeds)], np.uint64(seeds[job % len(seeds)])
        burn_in = burn_in_steps(packed.dt_s)
        if not runs.grid and is_crowd(runs.n_agents, packed):
            record = record_crowd_run(seed, people, burn_in, runs.n_steps, packed, tank)
        else:
            record = record_run(seed, people, burn_in, runs.n_steps, packed, tank, runs.grid)
        located = locate(as_samples(record[:, : runs.n_counted, :2], packed.dt_s), arena)
        inside = located.take(located.zone > 0)
        everybody = np.ones(len(inside), dtype=np.bool_)
        points = Points(located=inside, role=everybody, within=True)
        return {name: count(named(name), points) for name in names}

    with ThreadPoolExecutor(runs.n_threads) as pool:
        parts = list(pool.map(one, range(len(models) * len(seeds))))
    lead = (len(models), len(seeds))
    tables = {name: np.stack([part[name] for part in parts]) for name in names}
    return {name: table.reshape(lead + table.shape[1:]) for name, table in tables.items()}


def as_samples(xy_m: Floats, dt_s: float) -> Samples:
    """Return simulated positions, shape (step, agent, 2), as samples of fish."""
    n_steps, n_agents = xy_m.shape[:2]
    return Samples(
        dt_s=dt_s,
        k=np.arange(n_steps, dtype=np.int64),
        agent=np.arange(n_agents, dtype=np.int32),
        kind=np.full(n_agents, FISH, dtype=np.int8),
        xy_m=np.ascontiguousarray(xy_m),
        confidence=np.ones((n_steps, n_agents), dtype=np.float32),
    )

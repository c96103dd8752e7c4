"""Simulate models: a whole population counted in one call, or one run recorded."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from zfcal.arena import Arena
from zfcal.errors import InputError
from zfcal.model.kernels.crowd_runs import count_crowd_runs, record_crowd_run
from zfcal.model.kernels.run import Counts, count_runs, record_run
from zfcal.model.kernels.state import GRID, Packed
from zfcal.model.packing import pack, pack_genes
from zfcal.model.start import Start
from zfcal.model.tank import tank_of
from zfcal.parameters import Parameters
from zfcal.units import BURN_IN_S

__all__ = [
    "Counts",
    "Packed",
    "Start",
    "burn_in_steps",
    "check_sampler",
    "individuals",
    "pack",
    "pack_genes",
    "simulate_counts",
    "simulate_tracks",
    "tank_of",
]

_LEAST_GRID = 36

MOST_IN_FULL = 32
"""Larger groups draw by thinning, where that costs less than to look at all pairs (measured)."""

_JOB_STEPS = 20_000
"""Agent-steps in a piece of work: some milliseconds, much more than a call costs."""


def burn_in_steps(dt_s: float) -> int:
    """Return the number of steps dropped at the start of a simulation (60 s)."""
    return int(np.ceil(BURN_IN_S / dt_s - 1e-9))


def simulate_counts(
    packed: Packed,
    arena: Arena,
    *,
    n_agents: int,
    n_steps: int,
    seeds: NDArray[np.uint64],
    n_counted: int | None = None,
    n_robots: int = 0,
    n_threads: int | None = None,
    start: Start | None = None,
) -> Counts:
    """Simulate every model with every seed and return the histograms.

    Parameters
    ----------
    packed
        From `pack` or `pack_genes`.
    n_agents
        Agents in the tank, all driven by the model.
    n_steps
        Samples that count, after 60 s of burn-in; there is one transition less.
    seeds : ndarray of uint64, shape (run,)
        The same for all models: common random numbers.
    n_counted
        How many of the agents count, from the first one; None for all.
    n_robots
        How many of the agents are robots, from the last one; the base model treats
        all alike.
    n_threads
        None for one per core. The numbers do not depend on it.
    start
        Where all agents are at the first sample; there is no burn-in then.

    Returns
    -------
    Counts
        With leading axes (model, run).
    """
    counted = n_agents if n_counted is None else n_counted
    if not 0 < counted <= n_agents or n_steps < 1 or len(seeds) < 1:
        raise InputError(
            f"A simulation needs agents, steps and seeds; got {n_agents} agents of which "
            f"{counted} count, {n_steps} steps, {len(seeds)} seeds."
        )
    if start is not None and len(start.poses) != n_agents:
        raise InputError(
            f"A simulation of {n_agents} agents begins at as many poses, got {len(start.poses)}."
        )
    tank = tank_of(arena)
    counts = empty_counts(len(packed.zones), len(seeds), len(arena.zones))
    burn_in, poses = burn_in_steps(packed.dt_s), np.empty((0, 3))
    if start is not None:
        burn_in, poses = 0, start.poses
        packed = packed._replace(clock_s=np.array([start.time_s, 1.0]))
    sizes = (n_agents, counted, burn_in, n_steps)
    jobs = len(packed.zones) * len(seeds)
    # Pieces of some milliseconds, so that the last one is short on every core.
    per_piece = max(1, _JOB_STEPS // (n_agents * (n_steps + sizes[2])))
    words = np.array(seeds, dtype=np.uint64)
    people = individuals(n_agents, n_robots)

    run = count_crowd_runs if is_crowd(n_agents, packed) else count_runs

    def work(first: int) -> None:
        run(first, min(first + per_piece, jobs), words, sizes, people, poses, packed, tank, counts)

    with ThreadPoolExecutor(n_threads or os.cpu_count() or 1) as pool:
        list(pool.map(work, range(0, jobs, per_piece)))
    return counts


def is_crowd(n_agents: int, packed: Packed) -> bool:
    """Tell whether a group is large and without effects, which may ask what each agent sees."""
    return n_agents > MOST_IN_FULL and packed.effects.shape[1] == 0


def individuals(n_agents: int, n_robots: int) -> NDArray[np.float64]:
    """Return kind and trait of each agent, shape (2, agent).

    The traits of n fish are the normal quantiles of ``(i + 1/2) / n``, scaled to a
    variance of one: every simulated group is as mixed as its model says. Robots have
    the mean.
    """
    if not 0 <= n_robots <= n_agents:
        raise InputError(f"Of {n_agents} agents {n_robots} cannot be robots.")
    table = np.zeros((2, n_agents))
    n_fish = n_agents - n_robots
    table[0, n_fish:] = 1.0
    if n_fish > 1:
        inverse = NormalDist().inv_cdf
        quantiles = np.array([inverse((k + 0.5) / n_fish) for k in range(n_fish)])
        table[1, :n_fish] = quantiles / quantiles.std()
    return table


def check_sampler(sampler: str, grid: int) -> None:
    """Raise an `InputError` unless it is a sampler's name and a grid that carries a density."""
    if sampler not in {"exact", "grid"}:
        raise InputError(f"Sampler must be 'exact' or 'grid', got {sampler!r}.")
    if grid < _LEAST_GRID:
        raise InputError(f"The sampler's grid needs {_LEAST_GRID} angles or more, got {grid}.")


def empty_counts(n_models: int, n_runs: int, n_zones: int) -> Counts:
    """Return histograms of zeros."""
    lead = (n_models, n_runs, n_zones)
    shapes = ((*lead, 10), (*lead, 10), lead, (*lead, n_zones), (*lead, 10))
    return Counts(*(np.zeros(shape, dtype=np.int64) for shape in shapes))


def simulate_tracks(
    parameters: Parameters,
    arena: Arena,
    *,
    n_agents: int,
    n_steps: int,
    seed: int,
    n_robots: int = 0,
    clock_s: tuple[float, float] = (0.0, 1.0),
    sampler: str = "exact",
    grid: int = GRID,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Simulate one model and return where the agents were.

    Parameters
    ----------
    n_steps
        Samples, after 60 s of burn-in.
    seed
        Not negative; the run's numbers derive from it by `numpy.random.SeedSequence`.
    n_robots
        How many of the agents are robots, from the last one.
    clock_s
        Time of the trial at the first sample, and seconds of the trial in a second
        that is simulated.
    sampler
        ``exact``, or ``grid`` for the paper's numeric way.
    grid
        Angles of that grid.

    Returns
    -------
    xy_m : ndarray, shape (step, agent, 2)
    heading_rad : ndarray, shape (step, agent)
        Direction of the step that led there.
    """
    check_sampler(sampler, grid)
    if n_agents < 1 or n_steps < 1 or seed < 0:
        raise InputError(
            f"A simulation needs agents, steps and a seed from 0 on; got {n_agents} agents, "
            f"{n_steps} steps, seed {seed}."
        )
    packed = pack([parameters], arena)._replace(clock_s=np.array(clock_s, dtype=np.float64))
    word = np.random.SeedSequence(seed).generate_state(1, np.uint64)[0]
    people, tank, burn_in = (
        individuals(n_agents, n_robots), tank_of(arena), burn_in_steps(packed.dt_s)
    )  # fmt: skip
    if sampler == "exact" and is_crowd(n_agents, packed):
        record = record_crowd_run(word, people, burn_in, n_steps, packed, tank)
    else:
        angles = grid if sampler == "grid" else 0
        record = record_run(word, people, burn_in, n_steps, packed, tank, angles)
    return record[:, :, :2], np.arctan2(record[:, :, 3], record[:, :, 2])

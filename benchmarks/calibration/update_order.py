"""What equation 1's order of update changes: move by the old velocity, then turn.

In zfcal an agent turns and moves by the new velocity. Here the same law is simulated in both
orders, with the same models; where the old velocity would lead through the wall the agent stays.
What is printed: S of two-minute windows of one order against the long run of each, and how often
the old velocity leads outside.

    .venv/bin/python benchmarks/calibration/update_order.py
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from zfcal.arrays import Floats
from zfcal.artifacts.arenas import load_arena
from zfcal.behaviour.scores import compare
from zfcal.behaviour.statistics import Statistics, measure
from zfcal.model.kernels.compiled import kernel
from zfcal.model.kernels.geometry import Tank, zone_of
from zfcal.model.kernels.perception import in_vectors, make_sight
from zfcal.model.kernels.placing import settle
from zfcal.model.kernels.random import seeded
from zfcal.model.kernels.run import advance, start
from zfcal.model.kernels.state import GRID, STATES, ZONE, Packed, X, Y, make_work
from zfcal.model.simulate import burn_in_steps, individuals, pack, tank_of
from zfcal.parameters import Parameters, natural
from zfcal.tracks import FISH, Samples
from zfcal.virtual.trial import starting_model

N_AGENTS, DT_S = 5, 0.2
LONG_RUNS, LONG_S, WINDOWS, WINDOW_S = 20, 1800.0, 200, 120.0
FIRST_SEED = 8800
"""Of the runs; written down before the first."""


@kernel
def record(
    seed: np.uint64, sizes: tuple[int, int, int], people: Floats, packed: Packed, tank: Tank
) -> tuple[Floats, int]:
    """Return places, shape (step, agent, 2), and how often an old velocity led outside.

    Parameters
    ----------
    sizes
        Steps, steps of burn-in, and 1 for the old velocity.
    """
    steps, burn_in, late = sizes
    n = people.shape[1]
    state, work = np.zeros((STATES, n)), make_work(n, 0, GRID)
    sight, random = make_sight(in_vectors(n * n)), seeded(seed)
    start(state, burn_in, packed, tank, people, np.empty((0, 3)), work, random)
    places, outside = np.empty((steps, n, 2)), 0
    old, moved = np.zeros((n, 2)), np.zeros((n, 2))
    for step in range(burn_in + steps):
        before = state[: Y + 1].copy()
        advance(state, 0, packed, tank, sight, random, work, False)
        for i in range(n if late else 0):
            moved[i, 0], moved[i, 1] = state[X, i] - before[X, i], state[Y, i] - before[Y, i]
            x, y = before[X, i] + old[i, 0], before[Y, i] + old[i, 1]
            zone = zone_of(x, y, tank)
            if zone == 0:
                outside += 1
                x, y = before[X, i], before[Y, i]
                zone = zone_of(x, y, tank)
            state[X, i], state[Y, i], state[ZONE, i] = x, y, zone
            settle(i, state, tank)
            old[i] = moved[i]
        if step >= burn_in:
            places[step - burn_in, :, 0], places[step - burn_in, :, 1] = state[X], state[Y]
    return places, outside


def simulate(
    model: Parameters, *, late: bool, runs: int, seconds: float, first_seed: int
) -> tuple[list[Statistics], float]:
    """Return the statistics of each run, and the share of steps that led outside."""
    arena = load_arena("two-rooms", Path())
    packed, tank, steps = pack([model], arena), tank_of(arena), round(seconds / DT_S)
    found, outside = [], 0
    for run in range(runs):
        seed = np.uint64(first_seed + run)
        people = individuals(N_AGENTS, 0)
        sizes = (steps, burn_in_steps(DT_S), int(late))
        places, n = record(seed, sizes, people, packed, tank)
        outside += n
        samples = Samples(
            dt_s=DT_S,
            k=np.arange(steps),
            agent=np.arange(N_AGENTS, dtype=np.int32),
            kind=np.full(N_AGENTS, FISH, dtype=np.int8),
            xy_m=places,
            confidence=np.ones(places.shape[:2], dtype=np.float32),
        )
        found.append(measure(samples, arena))
    return found, outside / (runs * N_AGENTS * (steps + burn_in_steps(DT_S)))


def main() -> None:
    """Print a table for each of two models."""
    arena = load_arena("two-rooms", Path())
    zones = tuple((zone.name, zone.follows_walls) for zone in arena.zones)
    models = {
        "natural": natural(zones, dt_s=DT_S),
        "starting": starting_model(arena, dt_s=DT_S, robot="fixed"),
    }
    for name, model in models.items():
        long, short = {}, {}
        for late in (False, True):
            runs, share = simulate(
                model, late=late, runs=LONG_RUNS, seconds=LONG_S, first_seed=FIRST_SEED
            )
            long[late] = sum(runs[1:], runs[0])
            short[late], _ = simulate(
                model, late=late, runs=WINDOWS, seconds=WINDOW_S, first_seed=FIRST_SEED + 1000
            )
            if late:
                print(f"{name}: the old velocity leads outside in {100 * share:.1f} % of steps")
        both = compare(long[True], long[False])
        parts = ", ".join(f"{key} {getattr(both, f'I_{key}'):.3f}" for key in "DWOT")
        print(f"{name}: S of the two long runs {both.S:.3f} ({parts})")
        for windows, of in ((False, "new"), (True, "old")):
            scores = [
                [compare(long[late], each).S for late in (False, True)] for each in short[windows]
            ]
            new, old = np.nanmean(scores, axis=0)
            apart = np.diff(np.array(scores), axis=1)[:, 0]
            error = apart.std(ddof=1) / np.sqrt(len(apart))
            print(
                f"{name}: windows by the {of} velocity score {new:.3f} against the new order, "
                f"{old:.3f} against the old one ({apart.mean():+.3f}, se {error:.3f})"
            )


if __name__ == "__main__":
    main()

"""Measure what one agent-step needs at least, what the kernel takes, and what others take.

Makes ``roofline.json`` and ``benchmarks-roofline.md``: in ``build/benchmarks``, with
``--write`` in ``benchmarks/results`` and ``docs``.

    .venv/bin/python benchmarks/speed/bench_roofline.py
"""

from __future__ import annotations

import sys
import textwrap
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from benchmarks.shared import naive
from benchmarks.shared.measuring import load, machine, table
from benchmarks.shared.regressions import Ratio, conclude, parser, written
from zfcal.artifacts.arenas import load_arena
from zfcal.model.kernels.compiled import kernel, lean
from zfcal.model.kernels.geometry import Tank, nearest_wall, zone_of
from zfcal.model.kernels.perception import Sight, in_vectors, make_sight, see_first
from zfcal.model.kernels.random import next_word, seeded, uniform
from zfcal.model.kernels.run import advance, record_run, start
from zfcal.model.kernels.staircase import staircase_turn
from zfcal.model.kernels.state import GRID, LAW_F, STATES, Packed, make_work
from zfcal.model.simulate import individuals, pack, simulate_counts, tank_of
from zfcal.parameters import natural

N_AGENTS = 5

Random = np.ndarray
Floats = np.ndarray


@kernel
def words_per_step(steps: int, people: Floats, packed: Packed, tank: Tank, random: Random) -> float:
    """Return how many random words an agent-step takes, by a twin that catches up."""
    n = people.shape[1]
    state, work, sight = np.zeros((STATES, n)), make_work(n, 0, GRID), make_sight(in_vectors(n * n))
    start(state, 0, packed, tank, people, np.empty((0, 3)), work, random)
    twin, words = random.copy(), 0
    for _ in range(steps):
        advance(state, 0, packed, tank, sight, random, work, False)
        while (twin != random).any():
            next_word(twin)
            words += 1
    return words / steps / n


@lean
def draw_words(times: int, random: Random) -> float:
    """Draw so many uniform numbers."""
    total = 0.0
    for _ in range(times):
        total += uniform(random)
    return total


@lean
def draw_turns(times: int, packed: Packed, random: Random) -> float:
    """Draw so many von Mises angles."""
    total = 0.0
    kappa = packed.zones[0, 1, 1]
    for _ in range(times):
        cosine, sine = staircase_turn(kappa, packed.turns, (0, 1, LAW_F), random)
        total += cosine + sine
    return total


@lean
def see_often(times: int, n_pairs: int, sight: Sight) -> float:
    """Compute so many solid angles, a group's at a time."""
    total = 0.0
    for _ in range(times // n_pairs):
        see_first(in_vectors(n_pairs), sight, -0.7)
        sight.dx_m[0] += 1e-12
        total += sight.angle_sr[0]
    return total


@lean
def look_up_zones(times: int, xy: Floats, tank: Tank) -> float:
    """Look up the zones of so many places."""
    total = 0.0
    for k in range(times):
        at = k % xy.shape[0]
        total += zone_of(xy[at, 0], xy[at, 1], tank)
    return total


@lean
def look_up_walls(times: int, xy: Floats, tank: Tank) -> float:
    """Look up the nearest wall of so many places."""
    total = 0.0
    for k in range(times):
        at = k % xy.shape[0]
        total += nearest_wall(xy[at, 0], xy[at, 1], tank)[0]
    return total


def least_ns(
    runs: dict[str, Callable[[], object]], per: dict[str, float], *, repeats: int
) -> dict[str, float]:
    """Return the least time of each, in nanoseconds per unit; all by turns, so side by side."""
    least = dict.fromkeys(runs, np.inf)
    for run in runs.values():
        run()
    for _ in range(repeats):
        for name, run in runs.items():
            begin = time.process_time()
            run()
            least[name] = min(least[name], time.process_time() - begin)
    return {name: 1e9 * value / per[name] for name, value in least.items()}


def measure(*, repeats: int, size: int) -> dict[str, Any]:
    """Measure primitives, samplers and the scaling to all cores.

    Parameters
    ----------
    size
        Agent-steps of a run of the kernel; the others do as much as takes as long.
    """
    arena = load_arena("two-rooms", Path())
    zones = tuple((zone.name, zone.follows_walls) for zone in arena.zones)
    model = natural(zones, dt_s=0.2)
    packed, tank = pack([model], arena), tank_of(arena)
    people = individuals(N_AGENTS, 0)
    speeds = np.array([zone.speed_frequency for zone in model.zones])
    speeds /= speeds.sum(axis=1, keepdims=True)
    steps = size // N_AGENTS
    xy = record_run(np.uint64(1), people, 0, 2000, packed, tank, 0)[..., :2].reshape(-1, 2).copy()
    random, sight = seeded(np.uint64(1)), make_sight(in_vectors(N_AGENTS**2))
    rng = np.random.default_rng(1)
    turn = rng.random(sight.hx.size) * 2 * np.pi
    sight.dx_m[:], sight.dy_m[:] = rng.normal(0, 0.2, (2, turn.size))
    sight.hx[:], sight.hy[:], sight.ahead_m[:] = np.cos(turn), np.sin(turn), 1.0
    n_pairs = N_AGENTS * (N_AGENTS - 1)

    def simulate(threads: int) -> Callable[[], object]:
        seeds = np.arange(2 * max(1, size // 20_000), dtype=np.uint64)
        return lambda: simulate_counts(
            packed, arena, n_agents=N_AGENTS, n_steps=3700, seeds=seeds, n_threads=threads
        )

    parts = least_ns(
        {
            "word": lambda: draw_words(size, random),
            "turn": lambda: draw_turns(size, packed, random),
            "angle": lambda: see_often(size, n_pairs, sight),
            "zone": lambda: look_up_zones(size, xy, tank),
            "wall": lambda: look_up_walls(size, xy, tank),
            "kernel": simulate(1),
            "grid": lambda: record_run(np.uint64(1), people, 0, steps // 40, packed, tank, GRID),
            "naive": lambda: naive.run(N_AGENTS, steps // 5, 1, packed, speeds, tank),
        },
        dict.fromkeys(("word", "turn", "angle", "zone", "wall"), float(size))
        | {
            "kernel": 2 * max(1, size // 20_000) * N_AGENTS * 4000.0,
            "grid": N_AGENTS * (steps // 40 - 1.0),
            "naive": N_AGENTS * (steps // 5 - 1.0),
        },
        repeats=repeats,
    )  # fmt: skip
    words = words_per_step(2000, people, packed, tank, random)
    return {"ns": parts, "words": words, "scaling": scaling(simulate, repeats)}


def scaling(simulate: Callable[[int], Callable[[], object]], repeats: int) -> dict[str, float]:
    """Return wall-clock seconds of one and the same work on one thread and on two, by turns."""
    least = {1: np.inf, 2: np.inf}
    for _ in range(repeats):
        for threads in (1, 2):
            run = simulate(threads)
            begin = time.perf_counter()
            run()
            least[threads] = min(least[threads], time.perf_counter() - begin)
    return {"one_s": least[1], "two_s": least[2], "ratio": least[1] / least[2]}


def needs(found: dict[str, Any]) -> list[tuple[str, float, float]]:
    """Return what an agent-step needs: what, how often, and nanoseconds for one."""
    ns = found["ns"]
    return [
        ("von Mises draw, its random words included", 1.0, ns["turn"]),
        ("random word beside it: two for the speed, one for the component", 3.0, ns["word"]),
        ("solid angle, in vectors", N_AGENTS - 1.0, ns["angle"]),
        ("zone look-up, of the landing point", 1.0, ns["zone"]),
        ("nearest wall, with a root and a division", 1.0, ns["wall"]),
    ]


def bound_ns(found: dict[str, Any]) -> float:
    """Return the least that an agent-step takes, in nanoseconds."""
    return sum(times * cost for _, times, cost in needs(found))


def prose(text: str) -> str:
    """Return a paragraph."""
    return textwrap.fill(" ".join(text.split()), 120) + "\n"


def markdown(found: dict[str, Any]) -> str:
    """Return the tables of what was measured, and what they say."""
    ns, rows = found["ns"], needs(found)
    bound = bound_ns(found)
    others = [
        ("the kernel", ns["kernel"]),
        ("the same law written plainly, compiled (`benchmarks/shared/naive.py`)", ns["naive"]),
        ("the grid of 360 angles (`--sampler grid`)", ns["grid"]),
    ]
    quoted = [("a naive compiled exact sampler", 1600.0), ("the authors' C++, `-O3`", 57_000.0)]
    scale = found["scaling"]
    parts = [
        "# Roofline: what one agent-step needs\n",
        prose(
            f"""Made by `benchmarks/speed/bench_roofline.py`; numbers in
            `benchmarks/results/roofline.json`. Machine: {found["machine"]}; load
            {found["load_before"]:.1f} before, {found["load_after"]:.1f} after. Five agents in
            `two-rooms`, natural parameters, processor time, one thread, least of many short runs,
            all by turns in one process. Where the load is above the number of cores, others were
            at work and all figures are too large."""
        ),
        "## At least\n",
        table(
            ("what", "how often", "ns each", "ns"),
            [(what, times, cost, times * cost) for what, times, cost in rows],
        ),
        prose(
            f"""Together {bound:.0f} ns: each at the speed that it has in a loop by itself, where
            nothing waits for it. The kernel takes {ns["kernel"]:.0f} ns, of which the bound is
            {100 * bound / ns["kernel"]:.0f} %; burn-in, statistics and placing included. The rest
            are draws that are rejected (an agent-step takes {found["words"]:.1f} random words, not
            the least six), branches that no processor can foresee since a random number decides
            them, the weights of the mixture, and the histograms."""
        ),
        prose(
            """Memory: the state of five agents, what they see of each other, and the tables of one
            model's laws are 13 kB and stay in the first cache. The grid of zones and walls is
            2 MB, one byte and two numbers of four bytes a cell of 2 mm; a fish stays in a few
            cells, which the second cache holds. Nothing is allocated in the loop."""
        ),
        "## Side by side\n",
        table(
            ("sampler", "ns per agent-step", "times the kernel"),
            [(name, value, value / ns["kernel"]) for name, value in others],
        ),
        "Quoted from the project's description, not measured here:\n",
        table(("program", "ns per agent-step"), quoted),
        "## Cores\n",
        prose(
            f"""The same work takes {scale["one_s"]:.3f} s on one thread and
            {scale["two_s"]:.3f} s on two: {scale["ratio"]:.2f} times as fast. Runs share nothing
            but the tables."""
        ),
    ]
    return "\n".join(parts)


def ratios(found: dict[str, Any]) -> dict[str, Ratio]:
    """Return the kernel over its bound and over the other samplers, and two threads over one."""
    ns = found["ns"]
    over = {
        "the kernel over the bound": bound_ns(found),
        "the kernel over the same law written plainly": ns["naive"],
        "the kernel over the grid sampler": ns["grid"],
    }
    return {name: Ratio(value=ns["kernel"] / other) for name, other in over.items()} | {
        "speed of two threads over one": Ratio(value=found["scaling"]["ratio"], better="more")
    }


def main() -> None:
    """Measure, or read again what was measured, write both files, and compare."""
    options_of = parser(__doc__)
    options_of.add_argument("--draw", action="store_true", help="Measure nothing; read the JSON.")
    options = options_of.parse_args()
    if options.draw:
        found = written("roofline", options)
    else:
        found = {"machine": machine(), "load_before": load()}
        found |= measure(repeats=1 if options.tiny else 25, size=4000 if options.tiny else 100_000)
        found["load_after"] = load()
    conclude("roofline", found, markdown(found), ratios=ratios, options=options)


if __name__ == "__main__":
    main()

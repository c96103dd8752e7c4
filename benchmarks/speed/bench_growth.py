"""Measure how the cost grows: with agents, duration, population and trials.

Makes ``growth.json``, ``pictures/growth.png`` and ``benchmarks-growth.md``: in
``build/benchmarks``, with ``--write`` in ``benchmarks/results`` and ``docs``.

    .venv/bin/python benchmarks/speed/bench_growth.py
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import shapely

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from benchmarks.shared.measuring import load, machine, processor_s
from benchmarks.shared.regressions import Ratio, conclude, parser, places, written
from benchmarks.speed import growth_document
from zfcal.arena import Arena, make_arena
from zfcal.artifacts.arenas import load_arena
from zfcal.calibrate import evolve
from zfcal.calibrate.group import Group, as_statistics, pool_runs
from zfcal.calibrate.objective import Objective
from zfcal.model.kernels.perception import make_sight, see
from zfcal.model.kernels.run import count_runs
from zfcal.model.simulate import (
    MOST_IN_FULL,
    burn_in_steps,
    empty_counts,
    individuals,
    pack,
    simulate_counts,
    tank_of,
)
from zfcal.parameters import Parameters, natural

AGENT_COSTS = ("two_rooms", "roomy", "two_rooms_all_pairs", "roomy_all_pairs")
ZFCAL = [sys.executable, "-m", "zfcal_cli.main"]
DT_S = 0.2
AREA_M2 = 0.278
"""Of two-rooms; the square tanks that grow give five fish this much room."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Effort:
    """What is measured, and how long.

    Parameters
    ----------
    agents, durations_s, populations, trials
        The sizes.
    analysed_s
        Durations of trials on disk that are analysed.
    agent_steps
        Of each simulation with many agents, about.
    repeats
        The median of so many counts.
    """

    agents: tuple[int, ...] = (2, 5, 10, 20, 50, 100, 200, 350, 500)
    durations_s: tuple[int, ...] = (60, 600, 1800, 7200, 21_600, 86_400)
    populations: tuple[int, ...] = (12, 32, 60, 120, 240, 480)
    trials: tuple[int, ...] = (1, 2, 4, 8)
    analysed_s: tuple[int, ...] = (600, 1800, 7200)
    agent_steps: int = 200_000
    repeats: int = 3


TINY = Effort(
    agents=(2, 5, 50),
    durations_s=(60, 600),
    populations=(12, 32),
    trials=(1, 2),
    analysed_s=(120, 240),
    agent_steps=2_000,
    repeats=1,
)


def model_of(arena: Arena) -> Parameters:
    """Return the natural model of an arena."""
    return natural(tuple((zone.name, zone.follows_walls) for zone in arena.zones), dt_s=DT_S)


def two_rooms() -> Arena:
    """Return the default arena."""
    return load_arena("two-rooms", Path())


def roomy(n_agents: int) -> Arena:
    """Return a square tank in which each agent has as much room as five have in two rooms."""
    side_m = (AREA_M2 * n_agents / 5) ** 0.5
    return make_arena(name="square", outline=shapely.box(0, 0, side_m, side_m))


def simulation_s(
    arena: Arena, n_agents: int, n_steps: int, *, repeats: int, n_counted: int
) -> float:
    """Return the processor time of one simulation, burn-in included, on one thread."""
    packed = pack([model_of(arena)], arena)
    seeds = np.zeros(1, dtype=np.uint64)

    def run() -> None:
        simulate_counts(
            packed, arena, n_agents=n_agents, n_steps=n_steps, seeds=seeds, n_counted=n_counted,
            n_threads=1,
        )  # fmt: skip

    return processor_s(run, repeats=repeats)


def both_ways_ns(arena: Arena, n_agents: int, n_steps: int, *, repeats: int) -> tuple[float, float]:
    """Return the least time per agent-step as simulated, and looking at all pairs, by turns."""
    packed, tank, people = pack([model_of(arena)], arena), tank_of(arena), individuals(n_agents, 0)
    seeds = np.zeros(1, dtype=np.uint64)
    sizes = (n_agents, n_agents, burn_in_steps(DT_S), n_steps)
    n_zones = len(arena.zones)

    def run() -> None:
        simulate_counts(packed, arena, n_agents=n_agents, n_steps=n_steps, seeds=seeds, n_threads=1)

    def run_all_pairs() -> None:
        counts = empty_counts(1, 1, n_zones)
        count_runs(0, 1, seeds, sizes, people, np.empty((0, 3)), packed, tank, counts)

    least = [np.inf, np.inf]
    for _ in range(1 + repeats):
        for way, work in enumerate((run, run_all_pairs)):
            begin = time.process_time()
            work()
            least[way] = min(least[way], time.process_time() - begin)
    per_step = 1e9 / (n_agents * (n_steps + sizes[2]))
    return least[0] * per_step, least[1] * per_step


def sight_ns(n_agents: int, repeats: int) -> float:
    """Return the time of one solid angle, in nanoseconds, among so many agents."""
    # Of small groups several in one call, which itself takes as long as twenty angles.
    n_pairs = max(n_agents**2, 4096)
    rng = np.random.default_rng(1)
    sight = make_sight(n_pairs)
    heading = rng.random(n_pairs) * 2 * np.pi
    sight.dx_m[:], sight.dy_m[:] = rng.normal(0, 0.3, size=(2, n_pairs))
    sight.hx[:], sight.hy[:] = np.cos(heading), np.sin(heading)
    sight.ahead_m[:] = rng.normal(size=n_pairs)
    times = max(1, 500_000 // n_pairs)

    def run() -> None:
        for _ in range(times):
            see(sight, -0.7)

    return processor_s(run, repeats=repeats) / times / n_pairs * 1e9


def by_agents(effort: Effort) -> list[dict[str, float]]:
    """Return nanoseconds per agent-step for groups of every size."""
    rows = []
    for n in effort.agents:
        burn_in = burn_in_steps(DT_S)
        n_steps = max(20, effort.agent_steps // n - burn_in)
        row = {"agents": n, "sight_ns_per_pair": sight_ns(n, effort.repeats)}
        for name, arena in {"two_rooms": two_rooms(), "roomy": roomy(n)}.items():
            now, all_pairs = both_ways_ns(arena, n, n_steps, repeats=effort.repeats)
            row |= {f"{name}_ns": now, f"{name}_all_pairs_ns": all_pairs}
            row[f"{name}_ratio"] = all_pairs / now
        rows.append(row)
    return rows


def by_duration(effort: Effort) -> list[dict[str, float]]:
    """Return the processor time of one simulation of five agents of every length."""
    rows = []
    for duration_s in effort.durations_s:
        steps = round(duration_s / DT_S)
        seconds = simulation_s(two_rooms(), 5, steps, repeats=effort.repeats, n_counted=5)
        rows.append({"duration_s": duration_s, "simulate_s": seconds})
    return rows


def by_population(effort: Effort) -> list[dict[str, float]]:
    """Return the processor time of one generation, and the optimiser's own share of it."""
    arena = two_rooms()
    group = Group(arena=arena, template=model_of(arena), n_fish=4, n_robots=1, n_workers=1)
    seeds = np.zeros(1, dtype=np.uint64)
    truth = np.full((1, 18), 0.5)
    counts = group.simulate(truth, n_counted=4, n_steps=600, seeds=seeds)
    control = as_statistics(pool_runs(counts), 0, arena.zone_names)
    evaluate = Objective(group=group, control=control, n_steps=3000, seeds=seeds)
    rows = []
    for n in effort.populations:
        genes = np.random.default_rng(1).random((n, 18))
        features = np.random.default_rng(2).random((n, 4))
        state = evolve.begin(genes, features, seed=1)
        own_s = processor_s(_stepper(state, lambda table: table[:, :4]), repeats=9)
        whole_s = processor_s(_stepper(state, evaluate), repeats=effort.repeats)
        rows.append({"population": n, "generation_s": whole_s, "optimiser_s": own_s})
    return rows


def _stepper(state: evolve.State, evaluate: evolve.Evaluate) -> Callable[[], object]:
    return lambda: evolve.step(state, evaluate)


def command(*words: object) -> dict[str, float]:
    """Run a command of zfcal as a process; return its time and its largest memory."""
    begin = time.perf_counter()
    words = (*ZFCAL, *map(str, words))
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE}
    with subprocess.Popen(words, **quiet) as process:
        said = process.stderr.read() if process.stderr else b""
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise SystemExit(said.decode())
    return {
        "wall_s": time.perf_counter() - begin,
        "processor_s": used.ru_utime + used.ru_stime,
        "peak_mb": used.ru_maxrss / 1024,
    }


def make_trials(folder: Path, n: int, duration_s: int) -> list[Path]:
    """Return simulated trials of four fish and a robot, with their tracks."""
    roots = []
    for number in range(n):
        root = folder / f"trial{number}"
        fish = ("--arena", "two-rooms", "--fish", 4, "--robot", "--fps", 5, "--seed", number)
        command("init", root, *fish)
        model = root / "models" / "000000.toml"
        command("simulate", root, "--model", model, "--duration", duration_s)
        roots.append(root)
    return roots


def by_trials(effort: Effort) -> list[dict[str, float]]:
    """Return time and memory of one round of every trial of an archive, in one command."""
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        roots = make_trials(Path(folder), max(effort.trials), 120)
        command("analyse", *roots)
        for n in effort.trials:
            words = ("--generations", 5, "--workers", 1, "--force")
            rows.append({"trials": n, **command("calibrate", *roots[:n], *words)})
    return rows


def by_length(effort: Effort) -> list[dict[str, float]]:
    """Return time and memory of analysing trials of every length."""
    rows = []
    for duration_s in effort.analysed_s:
        with tempfile.TemporaryDirectory() as folder:
            (root,) = make_trials(Path(folder), 1, duration_s)
            rows.append({"duration_s": duration_s, **command("analyse", root)})
    return rows


def slope(rows: Sequence[dict[str, float]], x: str, y: str) -> float:
    """Return the exponent of growth over the larger half of the sizes."""
    half = rows[len(rows) // 2 - 1 :]
    logs = np.log([[row[x], row[y]] for row in half])
    return float(np.polyfit(logs[:, 0], logs[:, 1], 1)[0])


def crossing(rows: Sequence[dict[str, float]], key: str) -> dict[str, float]:
    """Return the parts of the cost per agent-step: fixed, per other agent, and where they meet.

    Fitted by least squares of relative errors.
    """
    n = np.array([row["agents"] for row in rows])
    cost = np.array([row[key] for row in rows])
    design = np.stack([np.ones(len(n)), n - 1.0], axis=1) / cost[:, None]
    (fixed, per_other), *_ = np.linalg.lstsq(design, np.ones(len(n)), rcond=None)
    return {
        "fixed_ns": float(fixed),
        "per_other_ns": float(per_other),
        "equal_at_agents": float(1 + fixed / per_other),
    }


def measure(effort: Effort, *, known: dict[str, Any], only: str | None = None) -> dict[str, Any]:
    """Measure all four ways of growing, or one of them beside what is known of the others."""
    found: dict[str, Any] = {**known, "machine": machine(), "load_before": load()}
    found |= {"most_in_full": MOST_IN_FULL, "only": only}
    for name, part in (
        ("agents", by_agents),
        ("duration", by_duration),
        ("population", by_population),
        ("trials", by_trials),
        ("analysed", by_length),
    ):
        if only in {None, name}:
            print(f"{name} ...", file=sys.stderr)
            found[name] = part(effort)
    found["load_after"] = load()
    found["pairs"] = {
        key: crossing(found["agents"], f"{key}_all_pairs_ns") for key in ("two_rooms", "roomy")
    }
    found["slopes"] = {
        "duration": slope(found["duration"], "duration_s", "simulate_s"),
        "population": slope(found["population"], "population", "generation_s"),
        "trials": slope(found["trials"], "trials", "processor_s"),
        "analysed": slope(found["analysed"], "duration_s", "processor_s"),
        **{key: 1 + slope(found["agents"], "agents", f"{key}_ns") for key in AGENT_COSTS},
    }
    return found


def ratios(found: dict[str, Any]) -> dict[str, Ratio]:
    """Return the exponents of growth, and what is small beside the rest.

    Two parts of one cost are compared on the same machine: the fixed part of an
    agent-step and a pair, a generation and the optimiser's share of it.
    """
    growth = {f"exponent over {name}": Ratio(value=v) for name, v in found["slopes"].items()}
    parts = {
        f"a pair over the fixed part, {key}": Ratio(value=pair["per_other_ns"] / pair["fixed_ns"])
        for key, pair in found["pairs"].items()
    }
    shares = {
        f"optimiser's share of a generation of {row['population']}": Ratio(
            value=row["optimiser_s"] / row["generation_s"]
        )
        for row in found["population"]
    }
    return growth | parts | shares


def main() -> None:
    """Measure, or draw again what was measured, write the three files, and compare."""
    options_of = parser(__doc__)
    options_of.add_argument("--draw", action="store_true", help="Measure nothing; read the JSON.")
    options_of.add_argument(
        "--only", help="Measure one part anew, the rest is as written: agents, duration, ..."
    )
    options = options_of.parse_args()
    known = written("growth", options) if options.draw or options.only else {}
    found = known
    if not options.draw:
        found = measure(TINY if options.tiny else Effort(), known=known, only=options.only)
    growth_document.draw(found, places(options).docs / "pictures" / "growth.png")
    conclude(
        "growth",
        found,
        growth_document.markdown(found),
        ratios=ratios,
        options=options,
    )


if __name__ == "__main__":
    main()

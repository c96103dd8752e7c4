"""Measure how far a calibration round comes in its 50 s, and what the optimiser itself takes.

Makes ``calibration.json`` and ``benchmarks-calibration.md``: in ``build/benchmarks``, with
``--write`` in ``benchmarks/results`` and ``docs``.

    .venv/bin/python benchmarks/calibration/bench_calibration.py
"""

from __future__ import annotations

import json
import math
import os
import statistics
import subprocess
import sys
import tempfile
import textwrap
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from benchmarks.calibration.synthetic import two_rooms
from benchmarks.shared import naive
from benchmarks.shared.measuring import load, machine, table
from benchmarks.shared.regressions import Ratio, conclude, parser
from zfcal.calibrate.evolve import Evaluate
from zfcal.calibrate.group import Group, SeedSource, as_statistics, pool_runs
from zfcal.calibrate.search import advance, begin
from zfcal.calibrate.task import Settings, Task
from zfcal.model.simulate import pack, tank_of
from zfcal.stages.calibrate.searching import Checkpoint

ZFCAL = [sys.executable, "-m", "zfcal_cli.main"]
SCHEDULES = {"default, 1 x 3000 steps": (1, 3000), "authors', 10 x 1800 steps": (10, 1800)}
"""Runs and steps of an evaluation."""
TARGETS = {"default, 1 x 3000 steps": 300, "authors', 10 x 1800 steps": 45}
"""Generations of 60 individuals in 50 s on two cores."""
OVERHEAD_MS = 3.0
REFERENCE_NS = 1600.0
"""Of the plainly written sampler on the machine that the targets were set for."""
FEWEST = 3
"""Of fewer generations a round says nothing about the time of one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Effort:
    """How much is measured.

    Parameters
    ----------
    budget_s
        Of a round.
    bred
        Generations of which the optimiser's own time is taken.
    """

    budget_s: int = 50
    bred: int = 300


def run(*words: object) -> dict[str, Any]:
    """Run a command of zfcal as a process; return what it said, its time and processor time."""
    begun = time.perf_counter()
    with subprocess.Popen([*ZFCAL, *map(str, words)], stdout=subprocess.PIPE) as process:
        said = process.stdout.read() if process.stdout else b""
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise SystemExit(process.returncode)
    return {
        "said": said.decode(),
        "wall_s": time.perf_counter() - begun,
        "processor_s": used.ru_utime + used.ru_stime,
    }


def make_trial(root: Path) -> Path:
    """Return a trial of four fish and a robot with one window that is analysed."""
    tank = ("--arena", "two-rooms", "--fish", 4, "--robot", "--fps", 5, "--seed", 1)
    run("init", root, *tank, "-q")
    run("simulate", root, "--model", root / "models" / "000000.toml", "--duration", 120, "-q")
    run("analyse", root, "-q")
    return root


def a_round(root: Path, runs: int, steps: int, budget_s: int) -> dict[str, float]:
    """Return how far a round came, and what it took.

    What does not depend on the number of generations, from the first import to the
    confirmation and the ceiling, is taken from a round of no generation.
    """
    words = ("calibrate", root, "--runs", runs, "--steps", steps, "--force", "--json", "-q")
    least = run(*words, "--generations", 0)
    whole = run(*words, "--budget", f"{budget_s}s")
    n = json.loads(whole["said"])["results"][-1]["generations"]
    more_s = whole["processor_s"] - least["processor_s"]
    return {
        "generations": n,
        "wall_s": whole["wall_s"],
        "processor_s": whole["processor_s"],
        "no_generation_wall_s": least["wall_s"],
        "no_generation_processor_s": least["processor_s"],
        "processor_s_per_generation": more_s / n if n >= FEWEST else math.nan,
        "load_after": load(),
    }


def overhead(bred: int) -> dict[str, float]:
    """Return the optimiser's own processor time per generation, its checkpoint included.

    The evaluation is a formula that takes no time to speak of. Medians over the first
    and the last twenty generations, in milliseconds.
    """
    task = _task()
    weights = np.random.default_rng(1).random((18, 4))

    def evaluate(genes: np.ndarray) -> np.ndarray:
        return 1.0 - 0.5 * np.abs(np.sin(2.0 * genes @ weights))

    progress = begin(task, Settings(), evaluate)
    breeding, keeping = [], []
    with tempfile.TemporaryDirectory() as folder:
        checkpoint = Checkpoint(Path(folder) / ".checkpoint", "benchmark")
        for _ in range(bred):
            begun = time.thread_time()
            progress = advance(progress, evaluate)
            between = time.thread_time()
            checkpoint.save(progress)
            breeding.append(between - begun)
            keeping.append(time.thread_time() - between)
    return {
        f"{what}_{when}_ms": 1e3 * statistics.median(part)
        for what, times in (("breeding", breeding), ("checkpoint", keeping))
        for when, part in (("first", times[:20]), ("last", times[-20:]))
    } | {"simulations_ms": 1e3 * _simulations_s(task.evaluation(Settings()))}


def _simulations_s(evaluate: Evaluate) -> float:
    """Return the processor time of the simulations of one generation."""
    genes = np.random.default_rng(2).random((60, 18))
    times = []
    for _ in range(5):
        begun = time.process_time()
        evaluate(genes)
        times.append(time.process_time() - begun)
    return statistics.median(times)


def naive_ns() -> float:
    """Return processor time per agent-step of ``naive.py``: how fast the machine is, right now."""
    arena, template = two_rooms()
    speeds = np.array([zone.speed_frequency for zone in template.zones])
    speeds /= speeds.sum(axis=1, keepdims=True)
    packed, tank, times = pack([template], arena), tank_of(arena), []
    naive.run(5, 2, 1, packed, speeds, tank)
    for _ in range(5):
        begun = time.process_time()
        naive.run(5, 20_001, 1, packed, speeds, tank)
        times.append((time.process_time() - begun) / 1e5)
    return 1e9 * statistics.median(times)


def _task() -> Task:
    arena, template = two_rooms()
    group = Group(arena=arena, template=template, n_fish=4, n_robots=1)
    seeds = np.zeros(1, dtype=np.uint64)
    counts = group.simulate(np.full((1, 18), 0.5), n_counted=4, n_steps=600, seeds=seeds)
    control = as_statistics(pool_runs(counts), 0, arena.zone_names)
    return Task(group=group, control=control, seeds=SeedSource(trial_seed=1, window_end_s=120))


def measure(effort: Effort) -> dict[str, Any]:
    """Measure both schedules and the optimiser."""
    found: dict[str, Any] = {
        "machine": machine(),
        "cores": len(os.sched_getaffinity(0)),
        "budget_s": effort.budget_s,
        "load_before": load(),
        "overhead": overhead(effort.bred),
        "naive_before_ns": naive_ns(),
    }
    with tempfile.TemporaryDirectory() as folder:
        root = make_trial(Path(folder) / "trial")
        found["rounds"] = {
            name: a_round(root, *size, effort.budget_s) for name, size in SCHEDULES.items()
        }
    found["naive_after_ns"] = naive_ns()
    return found


def on_a_quiet_machine(
    row: dict[str, float], found: dict[str, Any], *, slower: float = 1.0
) -> float:
    """Return the generations that the processor time allows where all cores are the round's own.

    An estimate: what begins and ends a round is taken to run on one core. On a machine that
    is so many times slower than this one all processor time is taken to be longer by that.
    """
    left_s = found["budget_s"] - slower * row["no_generation_processor_s"]
    return max(0.0, left_s) * found["cores"] / (slower * row["processor_s_per_generation"])


def slower_reference(found: dict[str, Any]) -> float:
    """Return how many times slower the reference machine is than this one was."""
    return 2 * REFERENCE_NS / (found["naive_before_ns"] + found["naive_after_ns"])


def ratios(found: dict[str, Any]) -> dict[str, Ratio]:
    """Return the optimiser's share, and what a generation of the authors' length takes."""
    own = found["overhead"]
    default, authors = (row["processor_s_per_generation"] for row in found["rounds"].values())
    return {
        f"{what} over the simulations of a generation": Ratio(
            value=own[f"{what}_last_ms"] / own["simulations_ms"]
        )
        for what in ("breeding", "checkpoint")
    } | {
        "a generation of a round over its simulations": Ratio(
            value=1e3 * default / own["simulations_ms"]
        ),
        "a generation of 10 x 1800 over one of 1 x 3000": Ratio(value=authors / default),
    }


def markdown(found: dict[str, Any]) -> str:
    """Return the tables of what was measured."""
    rows = [
        [
            name,
            TARGETS[name],
            int(row["generations"]),
            1e3 * row["processor_s_per_generation"],
            row["load_after"],
            f"{on_a_quiet_machine(row, found):.0f}",
            f"{on_a_quiet_machine(row, found, slower=slower_reference(found)):.0f}",
        ]
        for name, row in found["rounds"].items()
    ]
    own = found["overhead"]
    times = [
        ["breeding, selection, history", own["breeding_first_ms"], own["breeding_last_ms"]],
        ["checkpoint on disk", own["checkpoint_first_ms"], own["checkpoint_last_ms"]],
        ["together", *(own[f"breeding_{w}_ms"] + own[f"checkpoint_{w}_ms"]
                       for w in ("first", "last"))],
    ]  # fmt: skip
    return "\n".join(
        [
            "# A calibration round, measured\n",
            _prose(
                f"""Made by `benchmarks/calibration/bench_calibration.py`; numbers in
                `benchmarks/results/calibration.json`. Machine: {found["machine"]}; load
                {found["load_before"]:.1f} before."""
            ),
            "## How far it comes\n",
            _prose(
                f"""`zfcal calibrate --budget {found["budget_s"]}s`, generations of 60 individuals,
                from the start of the process to the written model, confirmation and ceiling
                included. The load is that after the round: above {found["cores"]} others were at
                work, and a wall-clock budget is shared with them. "On a quiet machine" says how
                many generations the processor time allows where {found["cores"]} cores are its
                own, with all that comes before and after the search on one of them. Machines, and
                this one from hour to hour, differ: the same law written plainly
                (`benchmarks/shared/naive.py`) took {found["naive_before_ns"]:,.0f} ns per
                agent-step before and {found["naive_after_ns"]:,.0f} ns after, on the machine that
                the targets were set for {REFERENCE_NS:,.0f} ns; "scaled" is the column before it
                with all processor times multiplied by that ratio, {slower_reference(found):.2f}."""
            ),
            table(
                (
                    "evaluation",
                    "wanted",
                    "generations",
                    "processor time (ms per generation)",
                    "load",
                    "on a quiet machine",
                    "scaled to the reference machine",
                ),
                rows,
            ),
            "## The optimiser itself\n",
            _prose(
                f"""Processor time in ms per generation, beside {own["simulations_ms"]:.0f} ms for
                the simulations of 60 individuals at the default evaluation; medians of the first
                twenty and the last twenty of a search. Wanted: under {OVERHEAD_MS:.0f} ms."""
            ),
            table(("", "first", "last"), times),
        ]
    )


def _prose(text: str) -> str:
    return textwrap.fill(" ".join(text.split()), 120) + "\n"


def main() -> None:
    """Measure, write both files, and compare with the committed results."""
    options = parser(__doc__).parse_args()
    found = measure(Effort(budget_s=6, bred=40) if options.tiny else Effort())
    conclude("calibration", found, markdown(found), ratios=ratios, options=options)


if __name__ == "__main__":
    main()

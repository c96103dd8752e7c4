"""Measure the main job: start-up, analyse, kernel, generations, recovery of parameters.

Makes ``main_job.json`` and ``benchmarks-main-job.md``: in ``build/benchmarks``, with
``--write`` in ``benchmarks/results`` and ``docs``.

    .venv/bin/python benchmarks/calibration/bench_main_job.py
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from benchmarks.shared.measuring import load, machine
from benchmarks.shared.regressions import Ratio, conclude, parser, written
from zfcal.artifacts.arenas import load_arena
from zfcal.behaviour.statistics import measure
from zfcal.calibrate.group import Group, SeedSource, express
from zfcal.calibrate.rounds import calibrate_window
from zfcal.calibrate.task import Settings, Task
from zfcal.model.likelihood import fit
from zfcal.model.scene import make_scene
from zfcal.model.simulate import pack, simulate_counts, simulate_tracks
from zfcal.parameters import Parameters, gene_names, natural, to_genes
from zfcal.tracks import Samples

ARENA = load_arena("two-rooms", Path())
TRUTH = natural(tuple((zone.name, zone.follows_walls) for zone in ARENA.zones), dt_s=0.2)


@dataclass(frozen=True, slots=True, kw_only=True)
class Effort:
    """What is measured.

    Parameters
    ----------
    starts
        The median of so many counts, of ``--help`` and of ``simulate``.
    analysed
        Duration of the trial that is analysed, as `zfcal simulate` takes it.
    repeats
        Of analyse and of the kernel.
    runs
        Simulated by the kernel at a time.
    generations
        Of the default schedule and of the authors'.
    seeds
        A recording each, of which parameters are recovered.
    searched
        Generations of the search that recovers them.
    n_windows
        Simulated for its ceiling.
    """

    starts: int = 11
    analysed: str = "30min"
    repeats: int = 5
    runs: int = 20
    generations: tuple[int, int] = (12, 3)
    seeds: tuple[int, ...] = (11, 12, 13)
    searched: int = 60
    n_windows: int = 40


TINY = Effort(
    starts=1,
    analysed="3min",
    repeats=1,
    runs=2,
    generations=(1, 1),
    seeds=(11,),
    searched=1,
    n_windows=2,
)


def _zfcal(*words: str | Path | int) -> tuple[float, float, float]:
    """Run a command as a process; return wall clock and processor in seconds, memory in MB."""
    begin = time.perf_counter()
    line = [sys.executable, "-m", "zfcal_cli.main", *map(str, words)]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    with subprocess.Popen(line, **quiet) as process:
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise SystemExit(f"{' '.join(line)}: exit code {process.returncode}")
    took_s = time.perf_counter() - begin
    return took_s, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024


def start_up(effort: Effort) -> dict[str, float]:
    """Return the median time of ``--help`` and of a first simulation, each in a new process.

    Of the simulation, a minute of five agents with kernels that were compiled before, the
    processor time as well: others at work lengthen the wall clock much and this little.
    """
    with tempfile.TemporaryDirectory() as folder:
        trial = Path(folder) / "trial"
        _zfcal("init", trial, "--arena", "two-rooms", "--fish", 4, "--robot")
        model = trial / "models" / "000000.toml"
        swim = ("--model", model, "--duration", "60s")
        _zfcal("simulate", Path(folder) / "warm", *swim)
        helped = [_zfcal("--help") for _ in range(effort.starts)]
        swum = [_zfcal("simulate", Path(folder) / f"{n}", *swim) for n in range(effort.starts)]
    return {
        "help_s": statistics.median(took[0] for took in helped),
        "help_processor_s": statistics.median(took[1] for took in helped),
        "simulate_s": statistics.median(took[0] for took in swum),
        "simulate_processor_s": statistics.median(took[1] for took in swum),
        "load": load(),
    }


def analyse(effort: Effort) -> dict[str, float]:
    """Return time and peak memory of analyse on 30 min of 5 agents at 15 Hz."""
    with tempfile.TemporaryDirectory() as folder:
        trial = Path(folder) / "trial"
        _zfcal("init", trial, "--arena", "two-rooms", "--fish", 4, "--robot", "--fps", 15)
        model = trial / "models" / "000000.toml"
        _zfcal("simulate", trial, "--model", model, "--duration", effort.analysed)
        took = [_zfcal("analyse", trial, "--force", "-q") for _ in range(effort.repeats)]
    return {
        "wall_s": statistics.median(each[0] for each in took),
        "peak_mb": max(each[2] for each in took),
    }


def kernel(effort: Effort) -> dict[str, float]:
    """Return nanoseconds per agent-step of both samplers, the best of five."""
    packed = pack([TRUTH], ARENA)
    found = {}
    for threads in (1, 2):
        seeds = np.arange(effort.runs, dtype=np.uint64)

        def run(threads: int = threads, seeds: np.ndarray = seeds) -> None:
            simulate_counts(packed, ARENA, n_agents=5, n_steps=9000, seeds=seeds, n_threads=threads)

        found[f"exact_{threads}_core_ns"] = (
            _best(run, effort.repeats) / (len(seeds) * 9300 * 5) * 1e9
        )

    def grid() -> None:
        simulate_tracks(TRUTH, ARENA, n_agents=5, n_steps=2000, seed=1, sampler="grid")

    found["grid_1_core_ns"] = _best(grid, effort.repeats) / (2300 * 5) * 1e9
    return found


def _best(run: Callable[[], None], repeats: int) -> float:
    run()
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        run()
        times.append(time.perf_counter() - begin)
    return min(times)


def _samples(xy_m: np.ndarray) -> Samples:
    n, agents = xy_m.shape[:2]
    return Samples(
        dt_s=0.2,
        k=np.arange(n),
        agent=np.arange(agents, dtype=np.int32),
        kind=np.zeros(agents, dtype=np.int8),
        xy_m=xy_m,
        confidence=np.ones((n, agents), dtype=np.float32),
    )


def _task(xy_m: np.ndarray, template: Parameters, seed: int, workers: int) -> Task:
    return Task(
        group=Group(arena=ARENA, template=template, n_fish=4, n_robots=1, n_workers=workers),
        control=measure(_samples(xy_m), ARENA),
        seeds=SeedSource(trial_seed=seed, window_end_s=1800),
    )


def generations(effort: Effort) -> dict[str, float]:
    """Return seconds per generation of 60 individuals on all cores, champion included apart."""
    xy, _ = simulate_tracks(TRUTH, ARENA, n_agents=4, n_steps=600, seed=3)
    task = _task(xy, TRUTH, 1, os.cpu_count() or 1)
    found = {}
    sizes = (("default", 1, 3000), ("authors", 10, 1800))
    for (name, runs, steps), n in zip(sizes, effort.generations, strict=True):
        times = []
        for count in (0, n):
            settings = Settings(generations=count, runs=runs, steps=steps)
            begin = time.perf_counter()
            calibrate_window(task, settings)
            times.append(time.perf_counter() - begin)
        found[f"{name}_s_per_generation"] = (times[1] - times[0]) / n
        found[f"{name}_first_population_and_closing_s"] = times[0]
    return found


def recovery(effort: Effort) -> list[dict[str, object]]:
    """Return true and found parameters of three simulated half hours, both ways."""
    rows = []
    for seed in effort.seeds:
        xy, _ = simulate_tracks(TRUTH, ARENA, n_agents=5, n_steps=9000, seed=seed)
        begin = time.perf_counter()
        by_likelihood = fit(make_scene(_samples(xy), ARENA), TRUTH)
        likelihood_s = time.perf_counter() - begin
        begin = time.perf_counter()
        by_score = calibrate_window(
            _task(xy, TRUTH, seed, os.cpu_count() or 1),
            Settings(generations=effort.searched, window_s=1800.0, n_windows=effort.n_windows),
        )
        score_s = time.perf_counter() - begin
        intervals = {part.name: part for part in by_score.intervals.parameters}
        truth = _scaled(express(to_genes(TRUTH), TRUTH))
        likely = _scaled(by_likelihood.parameters)
        for name in gene_names(ARENA.zone_names):
            part = intervals[name]
            rows.append(
                {
                    "seed": seed,
                    "parameter": name,
                    "true": truth[name],
                    "likelihood": likely[name],
                    "likelihood_interval": by_likelihood.interval[name],
                    "likelihood_identified": by_likelihood.identified[name],
                    "score": part.value,
                    "score_interval": (part.low, part.high),
                    "score_identified": part.identified,
                    "likelihood_s": likelihood_s,
                    "score_s": score_s,
                }
            )
    return rows


def _scaled(parameters: Parameters) -> dict[str, float]:
    found = {}
    for zone in parameters.zones:
        top = max(zone.gamma.values())
        found |= {f"{zone.name}.{k}": getattr(zone, k) for k in ("kappa_0", "kappa_f", "alpha")}
        found |= {f"{zone.name}.gamma.{to}": value / top for to, value in zone.gamma.items()}
    return found


def markdown(found: dict[str, object]) -> str:
    """Return the tables of what was measured."""
    lines = [
        "# The main job, measured",
        "",
        "Made by `benchmarks/calibration/bench_main_job.py`; numbers in",
        "`benchmarks/results/main_job.json`.",
        f"Machine: {found['machine']}. It is shared: times vary by a third, the wall clock by",
        "far more where the load is above the number of cores. A start is a new process, whose",
        "kernels were compiled before; `simulate` is of a minute of five agents.",
        "",
        "| what | value |",
        "|---|---|",
    ]
    for section in ("start_up", "analyse", "kernel", "generations"):
        lines += [f"| {section}: {name} | {value:.4g} |" for name, value in found[section].items()]
    lines += [
        "",
        "## Parameters recovered from simulated half hours",
        "",
        "Five fish in two rooms, natural parameters. By one-step likelihood, and by the score S",
        "(60 generations, one pooled window). 95 % intervals, `-` where the recording is silent.",
        "",
        "| seed | parameter | true | likelihood | interval | score | interval |",
        "|---|---|---|---|---|---|---|",
    ]
    for row in found["recovery"]:
        low, high = row["likelihood_interval"]
        first, last = row["score_interval"]
        likely = f"{low:.3g} to {high:.3g}" if row["likelihood_identified"] else "-"
        scored = f"{first:.3g} to {last:.3g}" if row["score_identified"] else "-"
        lines.append(
            f"| {row['seed']} | {row['parameter']} | {row['true']:.3g} | {row['likelihood']:.3g} "
            f"| {likely} | {row['score']:.3g} | {scored} |"
        )
    return "\n".join(lines) + "\n"


def ratios(found: dict[str, Any]) -> dict[str, Ratio]:
    """Return what was measured side by side, one over the other."""
    kernel, generation = found["kernel"], found["generations"]
    one_s = kernel["exact_2_core_ns"] * 1e-9 * 60 * 3300 * 5
    made = {
        "exact sampler over grid sampler": Ratio(
            value=kernel["exact_1_core_ns"] / kernel["grid_1_core_ns"]
        ),
        "two threads against one": Ratio(
            value=kernel["exact_1_core_ns"] / kernel["exact_2_core_ns"], better="more"
        ),
        "a generation over its simulations": Ratio(
            value=generation["default_s_per_generation"] / one_s
        ),
        "a generation of 10 x 1800 over one of 1 x 3000": Ratio(
            value=generation["authors_s_per_generation"] / generation["default_s_per_generation"]
        ),
    }
    rows = found["recovery"]
    likelihood, score = (sum(row[key] for row in rows) for key in ("likelihood_s", "score_s"))
    return made | {"likelihood over search": Ratio(value=likelihood / score)}


PARTS: dict[str, Callable[[Effort], Any]] = {
    "start_up": start_up,
    "analyse": analyse,
    "kernel": kernel,
    "generations": generations,
    "recovery": recovery,
}


def main() -> None:
    """Measure all or one part, or read again what was measured, write both files, and compare."""
    options_of = parser(__doc__)
    options_of.add_argument("--draw", action="store_true", help="Measure nothing; read the JSON.")
    options_of.add_argument(
        "--only", choices=PARTS, help="Measure one part anew, the rest is as written."
    )
    options = options_of.parse_args()
    found = written("main_job", options) if options.draw or options.only else {}
    if not options.draw:
        effort = TINY if options.tiny else Effort()
        found["machine"] = machine()
        for name in [options.only] if options.only else PARTS:
            print(f"{name} ...", file=sys.stderr)
            found[name] = PARTS[name](effort)
    conclude("main_job", found, markdown(found), ratios=ratios, options=options)


if __name__ == "__main__":
    main()

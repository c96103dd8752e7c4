"""Measure a cluster of one and two worker processes against this process.

Makes ``cluster.json`` and ``benchmarks-cluster.md``: in ``build/benchmarks``, with
``--write`` in ``benchmarks/results`` and ``docs``.

    .venv/bin/python benchmarks/calibration/bench_cluster.py
"""

from __future__ import annotations

import functools
import hashlib
import logging
import os
import sys
import tempfile
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from distributed import LocalCluster

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from benchmarks.shared.measuring import load, machine, table, wall_s
from benchmarks.shared.regressions import Ratio, conclude, parser
from zfcal.artifacts.arenas import load_arena
from zfcal.calibrate.cluster import ClusterGroup
from zfcal.calibrate.group import Group, SeedSource, Simulator, as_statistics, pool_runs
from zfcal.calibrate.rounds import calibrate_window
from zfcal.calibrate.scheduler import connect
from zfcal.calibrate.task import Settings, Task
from zfcal.model.simulate import Counts
from zfcal.parameters import natural
from zfcal.stages.side_by_side import at_once, side_by_side

SCHEDULES = {"default, 1 x 3000 steps": (1, 3000), "authors', 10 x 1800 steps": (10, 1800)}
"""Runs and steps of an evaluation."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Effort:
    """How much is measured.

    Parameters
    ----------
    population
        Genomes of an evaluation.
    repeats
        Of each evaluation; the median counts.
    generations
        Of each whole round.
    trials
        Of the archive.
    """

    population: int = 60
    repeats: int = 5
    generations: int = 15
    trials: int = 4


def local_group() -> Group:
    """Return four fish and a robot in two rooms."""
    arena = load_arena("two-rooms", Path())
    zones = tuple((zone.name, zone.follows_walls) for zone in arena.zones)
    return Group(arena=arena, template=natural(zones, dt_s=0.2), n_fish=4, n_robots=1)


def digest(counts: Counts) -> str:
    """Return a digest of all histograms."""
    return hashlib.sha256(b"".join(values.tobytes() for values in counts)).hexdigest()[:12]


def evaluation(group: Simulator, effort: Effort, runs: int, steps: int) -> dict[str, Any]:
    """Return the time of one evaluation of a population, and the digest of what it counted."""
    genes = np.random.default_rng(1).random((effort.population, 18))
    seeds = np.arange(runs, dtype=np.uint64)
    counted: list[Counts] = []

    def run() -> None:
        counted[:] = [group.simulate(genes, n_counted=5, n_steps=steps, seeds=seeds)]

    seconds = wall_s(run, repeats=effort.repeats)
    return {"s": seconds, "digest": digest(counted[0])}


def archive(group: Simulator, effort: Effort, n_at_once: int) -> dict[str, Any]:
    """Return the time of a round of each of several trials, and the digest of their champions."""
    settings = Settings(population=effort.population, generations=effort.generations)
    champions: dict[int, str] = {}

    def calibrate(number: int, _: object = None) -> None:
        seed = np.array([number], dtype=np.uint64)
        truth = np.full((1, 18), 0.5)
        counts = group.simulate(truth, n_counted=4, n_steps=600, seeds=seed)
        control = as_statistics(pool_runs(counts), 0, tuple(group.template.zone_names))
        seeds = SeedSource(trial_seed=number, window_end_s=120)
        found = calibrate_window(Task(group=group, control=control, seeds=seeds), settings)
        champions[number] = repr(found.champion)

    jobs = [functools.partial(calibrate, number) for number in range(effort.trials)]

    def run() -> None:
        side_by_side(jobs, lambda _: None, lambda part: part(), n_at_once=n_at_once)

    seconds = wall_s(run, repeats=1)
    text = "".join(champions[number] for number in sorted(champions))
    return {"s": seconds, "digest": hashlib.sha256(text.encode()).hexdigest()[:12]}


def measure_place(group: Simulator, effort: Effort, n_at_once: int) -> dict[str, Any]:
    """Return all that is measured at one place."""
    found = {name: evaluation(group, effort, *size) for name, size in SCHEDULES.items()}
    if effort.trials:
        found[f"{effort.trials} trials, a round each"] = archive(group, effort, n_at_once)
    return {"load_before": load(), "times": found}


def measure(effort: Effort, n_workers: tuple[int, ...] = (1, 2)) -> dict[str, Any]:
    """Measure this process with as many threads, and clusters with as many workers."""
    group = local_group()
    places = {
        f"here, {n} thread{'s' if n > 1 else ''}": measure_place(
            replace(group, n_workers=n), effort, 1
        )
        for n in n_workers
    }
    for n in n_workers:
        with ExitStack() as stack:
            folder = stack.enter_context(tempfile.TemporaryDirectory())
            made = stack.enter_context(
                LocalCluster(
                    n_workers=n,
                    threads_per_worker=1,
                    dashboard_address=":0",
                    local_directory=folder,
                    silence_logs=logging.CRITICAL,
                )
            )
            cluster = stack.enter_context(connect(made.scheduler_address))
            remote = ClusterGroup(group=group, cluster=cluster)
            name = f"cluster, {n} worker{'s' if n > 1 else ''}"
            places[name] = measure_place(remote, effort, at_once(effort.trials, n))
    return {"machine": machine(), "effort": repr(effort), "places": places}


def markdown(found: dict[str, Any]) -> str:
    """Return the tables of what was measured."""
    places = found["places"]
    first = next(iter(places.values()))["times"]
    head = ["", *(f"{name}" for name in places)]
    rows, alike = [], []
    for what, base in first.items():
        times = [place["times"][what] for place in places.values()]
        rows.append([what, *(f"{t['s']:.3f} s ({base['s'] / t['s']:.2f}x)" for t in times)])
        alike.append({t["digest"] for t in times})
    loads = ", ".join(f"{place['load_before']:.1f}" for place in places.values())
    same = all(len(digests) == 1 for digests in alike)
    return "\n".join(
        [
            "# A cluster, measured",
            "",
            "Made by `benchmarks/calibration/bench_cluster.py`; numbers in",
            "`benchmarks/results/cluster.json`.",
            f"Machine: {found['machine']}. Scheduler, client and workers share its cores, so what",
            "the cluster costs is seen at its worst: on computers of their own the workers lose",
            "nothing to the client.",
            "",
            f"Load when each place began: {loads} (above 2, others were at work as well).",
            "",
            "Sixty individuals of five agents in two rooms; in brackets the speed against one",
            "thread of one process.",
            "",
            table(head, rows),
            "All places counted the same, bit for bit."
            if same
            else "THE PLACES DID NOT COUNT THE SAME.",
            "",
        ]
    )


def ratios(found: dict[str, Any]) -> dict[str, Ratio]:
    """Return the speed of every place against one thread of one process."""
    base, *others = found["places"].items()
    return {
        f"{what}: {place}": Ratio(value=base[1]["times"][what]["s"] / time["s"], better="more")
        for place, measured in others
        for what, time in measured["times"].items()
    }


def main() -> None:
    """Measure, write both files, and compare."""
    options = parser(__doc__).parse_args()
    os.nice(1)
    tiny = Effort(population=8, repeats=1, generations=1, trials=2)
    found = measure(tiny if options.tiny else Effort())
    conclude(
        "cluster",
        found,
        markdown(found),
        ratios=ratios,
        options=options,
    )


if __name__ == "__main__":
    main()

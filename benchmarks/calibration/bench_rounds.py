"""Measure S over the rounds of a calibration, with and without the likelihood estimate.

Simulated trials whose true models differ are calibrated window by window, each round
starting from the one before, as online. Makes ``rounds.json``, ``pictures/rounds.png``
and ``benchmarks-rounds.md``: in ``build/benchmarks``, with ``--write`` in
``benchmarks/results`` and ``docs``.

    .venv/bin/python benchmarks/calibration/bench_rounds.py
    .venv/bin/python benchmarks/calibration/bench_rounds.py --write
    .venv/bin/python benchmarks/calibration/bench_rounds.py --real ../shared/data
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from benchmarks.calibration import rounds_document
from benchmarks.shared.measuring import load, machine
from benchmarks.shared.regressions import Ratio, conclude, parser, places, written
from zfcal.artifacts.lineage import Lineage
from zfcal.artifacts.models import read_model, write_model
from zfcal.behaviour.scores import compare
from zfcal.behaviour.statistics import Statistics
from zfcal.calibrate.group import (
    Purpose,
    SeedSource,
    as_statistics,
    express,
    pool_runs,
    with_measured_speeds,
)
from zfcal.calibrate.task import DEFAULT_GENERATIONS, Settings
from zfcal.errors import InputError
from zfcal.parameters import Parameters, to_genes
from zfcal.stages.analyse.analyse import AnalyseOptions, analyse
from zfcal.stages.calibrate.calibrate import calibrate
from zfcal.stages.calibrate.holdout import FixedModel, pooled_fish
from zfcal.stages.calibrate.likelihood import estimate
from zfcal.stages.calibrate.rounds import RoundPlaces, read_control
from zfcal.stages.calibrate.searching import CalibrateOptions
from zfcal.stages.events import say_nothing
from zfcal.stages.init import NewTrial, create_trial
from zfcal.stages.segments import Segments
from zfcal.stages.simulate import SimulateOptions, simulate
from zfcal.stages.trial_context import OpenTrial, Task, open_trial
from zfcal.stages.windows import window_ends

REAL = ("fish_only_six", "five-zebrafish", "Feedback_Initiative_model_1")
"""Recordings of `recordings.SOURCES`, if their folder is given."""

SPREAD = 0.3
"""Standard deviation of the logarithm of a true gene over that of the natural model."""

LEAST_GENE = 0.02

LATE_S = 600
"""From here to the end of a simulated trial nothing is calibrated; all rounds are judged on it."""

JUDGE_SEED = 1_000_003
"""Of the simulations that judge on held-out data: no round uses it."""

WINDOW_S = 120


@dataclass(frozen=True, slots=True, kw_only=True)
class Effort:
    """What is measured.

    Parameters
    ----------
    seeds
        A simulated trial each: its true model, its fish and its calibration.
    last_s
        Where the last window ends.
    generations
        Of each round.
    processes
        Times that a new process estimates by likelihood.
    """

    seeds: tuple[int, ...] = (1, 2)
    last_s: int = 480
    generations: int = DEFAULT_GENERATIONS
    processes: int = 3

    @property
    def ends_s(self) -> frozenset[int]:
        """Where the windows of the rounds end."""
        return frozenset(range(WINDOW_S, self.last_s + 1, 60))

    @property
    def settings(self) -> Settings:
        """How much a round does."""
        return Settings(generations=self.generations)


FULL = Effort(seeds=(1, 2, 3, 4, 5, 6))
"""What is committed."""

TINY = Effort(seeds=(1, 2), last_s=180, generations=1, processes=1)


def truth_of(start: Parameters, seed: int) -> Parameters:
    """Return a model near another: each gene times a lognormal factor, at most 1."""
    rng = np.random.default_rng(seed)
    genes = to_genes(start)
    genes = genes * np.exp(rng.normal(0.0, SPREAD, size=genes.shape))
    return express(np.clip(genes, LEAST_GENE, 1.0), start)


def make_trial(root: Path, seed: int) -> Parameters:
    """Simulate and analyse a trial of four fish and a robot; return the true model.

    The robot swims as the fish do. The trial starts from the natural model.
    """
    new = NewTrial(n_fish=4, n_robots=1, fps=5.0, arena="two-rooms", seed=seed)
    trial = create_trial(root, new, say_nothing)
    truth = truth_of(read_model(root / trial.model), seed)
    place = root / "models" / "true.toml"
    write_model(place, truth, Lineage(schema="zfcal.model/1", command="bench"))
    swimming = SimulateOptions(model=place, duration_s=2.0 * LATE_S)
    simulate(root, swimming, say_nothing)
    analyse(root, AnalyseOptions(), say_nothing)
    return truth


def long_run(opened: OpenTrial, model: Parameters) -> Statistics:
    """Return what a model does in ten half hours, simulated with seeds of their own."""
    trial, settings = opened.trial, Settings()
    group = FixedModel(
        arena=opened.arena,
        template=model,
        n_agents=trial.n_agents,
        n_fish=trial.n_fish,
        n_workers=CalibrateOptions().workers,
    )
    counts = group.simulate(
        to_genes(model)[None, :],
        n_counted=trial.n_agents,
        n_steps=round(settings.long_s / trial.dt_s),
        seeds=SeedSource(trial_seed=JUDGE_SEED, window_end_s=0).seeds(
            Purpose.CONFIRMATION, settings.long_runs
        ),
    )
    return as_statistics(pool_runs(counts), 0, opened.arena.zone_names)


@dataclass(frozen=True, slots=True, kw_only=True)
class Judge:
    """Fish that no round has seen: those of the next window, and those of the late stretch."""

    opened: OpenTrial
    late: Statistics | None

    @classmethod
    def of(cls, root: Path) -> Judge:
        """Return the judge of a trial; one shorter than the late stretch has none."""
        opened = open_trial(root)
        try:
            late, _ = pooled_fish(opened, Segments(), (LATE_S, 2 * LATE_S))
        except InputError:
            late = None
        return cls(opened=opened, late=late)

    def window(self, end_s: int) -> Statistics | None:
        """Return the fish of the window that ends then; None where there is none."""
        path = RoundPlaces(root=self.opened.trial.root, end_s=end_s).stats
        return read_control(path, self.opened.arena.zone_names) if path.exists() else None

    def scores(self, model: Parameters, end_s: int) -> dict[str, float | None]:
        """Return S of a model on a round's own window, the next one, and the late stretch."""
        swum = long_run(self.opened, model)
        fish = {
            "own": self.window(end_s),
            "next": self.window(end_s + WINDOW_S),
            "late": self.late,
        }
        return {
            name: None if seen is None else compare(swum, seen).S for name, seen in fish.items()
        }


def rounds_of(root: Path, judge: Judge, effort: Effort, *, guided: bool) -> list[dict[str, Any]]:
    """Calibrate a copy of a trial, round after round; return a row per round."""
    trial = root.with_name(f"{root.name}-{'guided' if guided else 'alone'}")
    shutil.copytree(root, trial)
    options = CalibrateOptions(settings=effort.settings, seed_likelihood=guided)
    ends = effort.ends_s.intersection(window_ends(judge.opened.trial, say_nothing))
    calibrate(trial, options, say_nothing, task=Task(ends_s=ends))
    rows = []
    for end_s in sorted(ends):
        place = RoundPlaces(root=trial, end_s=end_s).model
        result = tomllib.loads(place.read_text(encoding="utf-8"))["result"]
        judged = judge.scores(read_model(place), end_s)
        rows.append(
            {
                "end_s": end_s,
                **{key: result[key] for key in ("S", "ceiling", "optimiser_S", "world_changed")},
                "next": judged["next"],
                "late": judged["late"],
            }
        )
    shutil.rmtree(trial)
    return rows


def likely_rounds(judge: Judge, effort: Effort) -> list[dict[str, Any]]:
    """Return what the likelihood estimate of each window scores by itself."""
    opened, rows = judge.opened, []
    start = read_model(opened.trial.root / opened.trial.model)
    for end_s in sorted(effort.ends_s.intersection(window_ends(opened.trial, say_nothing))):
        found = estimate(opened, start, (end_s - WINDOW_S, end_s), say_nothing)
        control = judge.window(end_s)
        if found is None or control is None:
            continue
        model = with_measured_speeds(found.found.parameters, control)
        rows.append({"end_s": end_s, **judge.scores(model, end_s)})
    return rows


def one_trial(root: Path, effort: Effort) -> dict[str, Any]:
    """Return the rounds of an analysed trial, with and without the estimate, and the estimate."""
    judge = Judge.of(root)
    return {
        "guided": rounds_of(root, judge, effort, guided=True),
        "alone": rounds_of(root, judge, effort, guided=False),
        "likelihood": likely_rounds(judge, effort),
    }


def simulated(effort: Effort) -> list[dict[str, Any]]:
    """Return the rounds of all simulated trials, and what their true models score."""
    rows = []
    for seed in effort.seeds:
        with tempfile.TemporaryDirectory() as folder:
            root = Path(folder) / "trial"
            truth = make_trial(root, seed)
            row: dict[str, Any] = {"seed": seed, **one_trial(root, effort)}
            judge = Judge.of(root)
            row["truth"] = [
                {"end_s": end_s, **judge.scores(truth, end_s)} for end_s in sorted(effort.ends_s)
            ]
            rows.append(row)
        print(f"trial {seed} ...", file=sys.stderr)
    return rows


def recorded(data: Path, effort: Effort) -> list[dict[str, Any]]:
    """Return the rounds of some real recordings."""
    import real_recordings
    from recordings import SOURCES

    rows = []
    for name in REAL:
        with tempfile.TemporaryDirectory() as folder:
            recording = SOURCES[name](data, Path(folder))
            places, _ = real_recordings.prepare(recording, Path(folder))
            analyse(places.trial, AnalyseOptions(), say_nothing)
            rows.append({"title": recording.title, **one_trial(places.trial, effort)})
        print(f"{name} ...", file=sys.stderr)
    return rows


_PROCESS = """
import sys, time
begin_s, used_s = time.perf_counter(), time.process_time()
from pathlib import Path
from zfcal.artifacts.models import read_model
from zfcal.stages.events import say_nothing
from zfcal.stages.calibrate.likelihood import estimate
from zfcal.stages.trial_context import open_trial
opened = open_trial(Path(sys.argv[1]))
start = read_model(opened.trial.root / opened.trial.model)
for end_s in range(120, 601, 60):
    estimate(opened, start, (end_s - 120, end_s), say_nothing)
    print(time.perf_counter() - begin_s, time.process_time() - used_s)
    begin_s, used_s = time.perf_counter(), time.process_time()
"""


def likelihood_times(effort: Effort) -> dict[str, list[float]]:
    """Return the times of estimates: each process's first, imports included, and the others.

    Wall-clock and processor time of each, of the windows of a trial.
    """
    first, others = [], []
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder) / "trial"
        make_trial(root, 0)
        words = (sys.executable, "-c", _PROCESS, str(root))
        # The first process may have to compile, and does not count.
        for _ in range(1 + effort.processes):
            said = subprocess.run(words, capture_output=True, check=True, text=True)
            rows = [[float(part) for part in line.split()] for line in said.stdout.splitlines()]
            first.append(rows[0])
            others.append(rows[1:])
    cold, warm = np.array(first[1:]), np.concatenate(others[1:])
    return {"load": [load()]} | {
        name: values.tolist()
        for name, values in (
            ("cold_median_s", np.median(cold, axis=0)),
            ("warm_median_s", np.median(warm, axis=0)),
            ("warm_largest_s", warm.max(axis=0)),
        )
    }


def measure(effort: Effort) -> dict[str, Any]:
    """Measure everything but the real recordings."""
    begin_s, used_s = time.perf_counter(), time.process_time()
    found: dict[str, Any] = {"machine": machine(), "load_before": load()}
    found["generations"], found["n_trials"] = effort.generations, len(effort.seeds)
    found["likelihood_times"] = likelihood_times(effort)
    found["simulated"] = simulated(effort)
    found["took_s"] = time.perf_counter() - begin_s
    found["processor_s"] = time.process_time() - used_s
    return found


def ratios(found: dict[str, Any]) -> dict[str, Ratio]:
    """Return S of each trial against what it is measured by, and what the estimate takes.

    By trial, so that a run on some of the committed trials is compared with these.
    """
    made = {}
    for trial in found["simulated"]:
        guided, alone, ceiling = (
            float(rounds_document.of_trials([trial], who, key)[0])
            for who, key in (("guided", "S"), ("alone", "S"), ("guided", "ceiling"))
        )
        name = f"trial {trial['seed']}: S with the estimate over"
        made[f"{name} S without"] = Ratio(value=guided / alone, better="more")
        made[f"{name} the ceiling"] = Ratio(value=guided / ceiling, better="more")
    times = {key: values[-1] for key, values in found["likelihood_times"].items()}
    first_s, later_s = times["cold_median_s"], times["warm_median_s"]
    return made | {
        "the first estimate of a process over a later one": Ratio(value=first_s / later_s),
        "processor seconds of an estimate": Ratio(value=later_s),
    }


def effort_of(options: argparse.Namespace) -> Effort:
    """Return what is measured with these options; what is to be committed is measured in full."""
    if options.tiny:
        return TINY
    return FULL if options.full or options.write else Effort()


def main() -> None:
    """Measure, or draw again what was measured, write the three files, and compare."""
    options_of = parser(__doc__)
    options_of.add_argument("--full", action="store_true", help="All trials, as --write does.")
    options_of.add_argument("--draw", action="store_true", help="Measure nothing; read the JSON.")
    options_of.add_argument("--real", type=Path, help="Measure the real recordings there, alone.")
    options_of.add_argument("--times", action="store_true", help="Time the estimate anew, alone.")
    options = options_of.parse_args()
    effort, place = effort_of(options), places(options)
    anew = not (options.draw or options.real or options.times)
    found = measure(effort) if anew else written("rounds", options)
    if options.real:
        found["recorded"] = recorded(options.real, effort)
    elif options.times:
        found["likelihood_times"] = likelihood_times(effort)
    rounds_document.draw(found, place.docs / "pictures" / "rounds.png")
    conclude("rounds", found, rounds_document.markdown(found), ratios=ratios, options=options)


if __name__ == "__main__":
    main()

"""What each deviation from the paper changes in the score.

Makes ``as_published.json`` and ``benchmarks-as-published.md``: in ``build/benchmarks``, with
``--write`` in ``benchmarks/results`` and ``docs``. Trials that are done stay in
``build/as-published`` and are not run again: remove the folder to measure another zfcal.

    .venv/bin/python benchmarks/calibration/bench_as_published.py
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
import textwrap
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
from scipy import stats

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from benchmarks.shared.measuring import ROOT, load, machine, table, zfcal
from benchmarks.shared.regressions import Ratio, conclude, parser
from zfcal.artifacts.models import read_model
from zfcal.behaviour.scores import compare
from zfcal.calibrate.group import as_statistics, pool_runs
from zfcal.model.simulate import pack, simulate_counts
from zfcal.stages.calibrate.rounds import read_control
from zfcal.stages.trial_context import open_trial

BUILD = ROOT / "build" / "as-published"
SEEDS = 751
"""The first trial's; nothing was chosen on them."""

WAYS: dict[str, tuple[str, ...]] = {
    "as published": ("--as-published",),
    "... and zfcal's operators": ("--as-published", "--optimiser", "zfcal"),
    "... and the estimate as a guest": ("--as-published", "--seed-likelihood"),
    "... and ten simulated anew": ("--as-published", "--confirm", "10"),
    "... and merged diversity": ("--as-published", "--diversity", "merged"),
    "default, published by score": ("--publish", "score"),
    "default": (),
}
FURTHER: dict[str, tuple[str, ...]] = {
    "default by score, no renewal": ("--publish", "score", "--no-renewal"),
}
"""With ``--ways`` alone, in longer trials: renewal begins after more than three rounds. The paper's
sampler takes thirty times as long, and is no way of its own."""


def run_one(seed: int, way: str, options: argparse.Namespace) -> list[dict[str, Any]]:
    """Return what each round of a trial came to, by one way; kept where it is there."""
    name = way.replace(" ", "-").replace(".", "").replace("'", "").replace(",", "")
    size = f"{options.minutes}min-{options.generations}"
    folder: Path = options.build / f"{seed}-{size}" / name.strip("-")
    kept = folder.with_suffix(".json")
    if kept.exists():
        found: list[dict[str, Any]] = json.loads(kept.read_text(encoding="utf-8"))
        return found
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(_recorded(seed, options), folder)
    zfcal("calibrate", folder, *(WAYS | FURTHER)[way], "--generations", options.generations)
    found = _rounds(folder)
    kept.write_text(json.dumps(found), encoding="utf-8")
    shutil.rmtree(folder)
    return found


def _recorded(seed: int, options: argparse.Namespace) -> Path:
    """Return a virtual trial with its statistics: four fish that drift, and a fixed robot."""
    folder: Path = options.build / f"{seed}-{options.minutes}min" / "recorded"
    trial = folder / "trial"
    if not (folder / "done").exists():
        # The robot swims by constants: what is calibrated meanwhile is thrown away.
        words = ("--closed-loop", "--no-video", "--swims", "fixed", "--generations", "1")
        zfcal("demo", folder, *words, "--seed", seed, "--duration", f"{options.minutes}min")
        for path in (trial / "models").glob("??????.*"):
            if path.stem != "000000":
                path.unlink()
        for path in (trial / "scores").glob("*-*.parquet"):
            path.unlink()
        (folder / "done").touch()
    return trial


def _rounds(trial: Path) -> list[dict[str, Any]]:
    """Return per round S as reported, S by long runs with new seeds, and S on the next window."""
    opened = open_trial(trial)
    ends = sorted(int(p.stem) for p in (trial / "models").glob("??????.toml") if p.stem != "000000")
    zones = opened.arena.zone_names
    control = {end: read_control(trial / "stats" / f"{end:06d}.parquet", zones) for end in ends}
    rows = []
    for end in ends:
        packed = pack([read_model(trial / "models" / f"{end:06d}.toml")], opened.arena)
        n = opened.trial.n_fish + opened.trial.n_robots
        seeds = np.random.SeedSequence([end, 1]).generate_state(10, np.uint64).astype(np.uint64)
        counts = simulate_counts(
            packed,
            opened.arena,
            n_agents=n,
            n_robots=opened.trial.n_robots,
            n_steps=9000,
            seeds=seeds,
        )
        run = as_statistics(pool_runs(counts), 0, zones)
        scores = pq.read_table(trial / "scores" / f"{end:06d}-model.parquet").to_pylist()
        (said,) = (row for row in scores if row["feature"] == "S")
        ahead = compare(run, control[end + 120]).S if end + 120 in control else None
        own = {"reported": said["value"], "anew": compare(run, control[end]).S}
        rows.append({"end_s": end, **own, "ceiling": said["ceiling"], "forward": ahead})
    return rows


def measure_all(options: argparse.Namespace) -> dict[str, Any]:
    """Run all ways on all trials."""
    options.build.mkdir(parents=True, exist_ok=True)
    found: dict[str, Any] = {"machine": machine(), "load_before": load(), "rows": []}
    for seed in range(SEEDS, SEEDS + options.trials):
        for way in options.ways.split(";") if options.ways else WAYS:
            rounds = run_one(seed, way, options)
            found["rows"].append({"seed": seed, "way": way, "rounds": rounds})
            print(seed, way, _means(rounds), file=sys.stderr, flush=True)
    found["minutes"], found["generations"] = options.minutes, options.generations
    return found


def _means(rounds: list[dict[str, Any]]) -> dict[str, float]:
    """Return means over rounds of what is known."""
    return {
        key: float(np.mean([row[key] for row in rounds if row[key] is not None]))
        for key in ("reported", "anew", "ceiling", "forward")
    }


def markdown(found: dict[str, Any]) -> str:
    """Return the table: each way less the published one, over trials."""
    means: dict[str, dict[int, dict[str, float]]] = {}
    for row in found["rows"]:
        means.setdefault(row["way"], {})[row["seed"]] = _means(row["rounds"])
    base = next(iter(means.values()))
    said = f"""Made by `benchmarks/calibration/bench_as_published.py`; numbers in
        `benchmarks/results/as_published.json`. Machine: {found["machine"]}. {len(base)} virtual
        trials of {found["minutes"]} min, four fish whose parameters drift and a robot that swims by
        constants, with seeds from {SEEDS} on, which were fixed before the first run; how many
        trials there are was decided by time alone. Each way has {found["generations"]} generations
        a round, and one thing of the paper's way (docs/as-published.md) is changed in each row.
        *Reported* is the S that the round states, *anew* the S of its model by ten simulations of
        30 min with other random numbers against the same window, *forward* against the next window
        that shares no second with it (rounds of the last two minutes have none). Mean over rounds,
        then over trials; differences to the first row, trial by trial, ± their standard error. The
        ceiling is that of windows of the model, with which *reported* is compared."""
    rows = [
        [
            way,
            *(_cell(by_seed, base, key) for key in ("reported", "anew", "forward")),
            float(np.mean([each["ceiling"] for each in by_seed.values()])),
        ]
        for way, by_seed in means.items()
    ]
    head = ("way", "S reported", "S anew", "S forward", "ceiling of the model")
    return (
        "# What each deviation from the paper changes\n\n"
        + textwrap.fill(" ".join(said.split()), 120)
        + "\n\n"
        + table(head, rows)
    )


def _cell(by_seed: dict[int, dict[str, float]], base: dict[int, dict[str, float]], key: str) -> str:
    """Return the mean of the published way, or the difference of another, and standard errors."""
    own = np.array([each[key] for each in by_seed.values()])
    is_base = by_seed is base
    apart = own if is_base else own - np.array([base[seed][key] for seed in by_seed])
    error = f" ± {stats.sem(apart):.3f}" if len(apart) > 1 else ""
    return f"{apart.mean():.3f}{error}" if is_base else f"{apart.mean():+.3f}{error}"


def ratios(found: dict[str, Any]) -> dict[str, Ratio]:
    """Return what is compared with the committed results."""
    value: dict[str, list[float]] = {}
    for row in found["rows"]:
        value.setdefault(row["way"], []).append(_means(row["rounds"])["forward"])
    if not {"default", "as published"} <= value.keys():
        return {}
    apart = float(np.mean(value["default"]) / np.mean(value["as published"]))
    return {"forward S, default over as published": Ratio(value=apart, better="more")}


def main() -> None:
    """Run, write, compare."""
    made = parser(__doc__)
    made.add_argument("--trials", type=int, default=8, help="Virtual trials.")
    made.add_argument("--minutes", type=int, default=4, help="Length of a trial.")
    made.add_argument("--generations", type=int, default=10, help="Of a round.")
    made.add_argument("--ways", default="", help="Some of the ways alone, with semicolons.")
    made.add_argument("--build", type=Path, default=BUILD, help="Where finished trials are kept.")
    options = made.parse_args()
    if options.tiny:
        options.trials, options.minutes, options.generations = 1, 4, 1
        options.ways = options.ways or "as published"
    found = measure_all(options)
    conclude("as_published", found, markdown(found), ratios=ratios, options=options)


if __name__ == "__main__":
    main()

"""What each deviation from the paper changes in the score.

Makes ``as_published.json`` and ``benchmarks-as-published.md``: in ``build/benchmarks``, with
``--write`` in ``benchmarks/results`` and ``docs``. Trials that are done stay in
``build/as-published`` and are not run again.

No figures of it are committed yet, so it is no part of `make bench`.

    .venv/bin/python benchmarks/calibration/as_published_ways.py --trials 8
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
    "... and renewal": ("--as-published", "--renewal"),
    "... and the numeric sampler": ("--as-published", "--sampler", "grid"),
    "default, published by score": ("--publish", "score"),
    "default": ("--publish", "forward"),
}


def run_one(seed: int, way: str, options: argparse.Namespace) -> list[dict[str, Any]]:
    """Return what each round of a trial came to, by one way; kept where it is there."""
    name = way.replace(" ", "-").replace(".", "").replace("'", "").replace(",", "")
    folder: Path = options.build / f"{seed}-{options.minutes}min" / name.strip("-")
    kept = folder.with_suffix(".json")
    if kept.exists():
        found: list[dict[str, Any]] = json.loads(kept.read_text(encoding="utf-8"))
        return found
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(_recorded(seed, options), folder)
    zfcal("calibrate", str(folder), *WAYS[way], "-q")
    found = _rounds(folder)
    kept.write_text(json.dumps(found), encoding="utf-8")
    shutil.rmtree(folder)
    return found


def _recorded(seed: int, options: argparse.Namespace) -> Path:
    """Return a virtual trial with its statistics: four fish that drift, and a fixed robot."""
    folder: Path = options.build / f"{seed}-{options.minutes}min" / "recorded"
    trial = folder / "trial"
    if not (folder / "done").exists():
        words = ("--closed-loop", "--no-video", "--swims", "fixed", "--seed", str(seed))
        zfcal("demo", str(folder), *words, "--duration", f"{options.minutes}min")
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
        seeds = np.random.SeedSequence([end, 1]).generate_state(10, np.uint64)
        counts = simulate_counts(packed, opened.arena, n_agents=n, n_steps=9000, seeds=seeds)
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
    found["minutes"] = options.minutes
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
    base = means["as published"]
    said = f"""Made by `benchmarks/calibration/as_published_ways.py`; numbers in
        `benchmarks/results/as_published.json`. Machine: {found["machine"]}. {len(base)} virtual
        trials of {found["minutes"]} min, four fish whose parameters drift and a robot, from seed
        {SEEDS} on, on which nothing was chosen. *Reported* is the S that the round states, *anew*
        the S of its model by ten simulations of 30 min with other random numbers against the same
        window, *forward* against the next window that shares no second with it. Mean over rounds,
        then over trials; differences to the first row with 95 % intervals over trials."""
    rows = []
    for way, by_seed in means.items():
        cells = []
        for key in ("reported", "anew", "forward"):
            own = np.array([by_seed[seed][key] for seed in by_seed if seed in base])
            apart = own - np.array([base[seed][key] for seed in by_seed if seed in base])
            if way == "as published":
                cells.append(f"{own.mean():.3f}")
                continue
            half = stats.t.ppf(0.975, len(apart) - 1) * stats.sem(apart) if len(apart) > 1 else 0.0
            cells.append(f"{apart.mean():+.3f} ± {half:.3f}")
        ceiling = np.mean([each["ceiling"] for each in by_seed.values()])
        rows.append([way, len(by_seed), *cells, float(ceiling)])
    head = ("way", "trials", "S reported", "S anew", "S forward", "ceiling of the model")
    return (
        "# What each deviation from the paper changes\n\n"
        + textwrap.fill(" ".join(said.split()), 120)
        + "\n\n"
        + table(head, rows)
    )


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
    made.add_argument("--trials", type=int, default=3, help="Virtual trials.")
    made.add_argument("--minutes", type=int, default=8, help="Length of a trial.")
    made.add_argument("--ways", default="", help="Some of the ways alone, with semicolons.")
    made.add_argument("--build", type=Path, default=BUILD, help="Where finished trials are kept.")
    options = made.parse_args()
    if options.tiny:
        options.trials, options.minutes = 1, 4
        options.ways = options.ways or "as published"
    found = measure_all(options)
    conclude("as_published", found, markdown(found), ratios=ratios, options=options)


if __name__ == "__main__":
    main()

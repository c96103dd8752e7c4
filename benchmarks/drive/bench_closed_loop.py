"""Repeat the published experiment virtually: closed-loop trials, and the same without calibration.

Makes ``closed_loop.json`` and ``benchmarks-closed-loop.md``: in ``build/benchmarks``, with
``--write`` in ``benchmarks/results`` and ``docs``. Trials that are done stay in
``build/closed-loop`` and are not run again.

    .venv/bin/python benchmarks/drive/bench_closed_loop.py --trials 10 --minutes 30
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import textwrap
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
from scipy import stats

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from benchmarks.shared.measuring import ROOT, load, machine, table, zfcal
from benchmarks.shared.regressions import Ratio, conclude, parser

BUILD = ROOT / "build" / "closed-loop"
WORDS = {
    "calibrated": ("--swims", "calibrated"),
    "by score": ("--swims", "calibrated", "--publish", "score"),
    "fixed": ("--swims", "fixed"),
    "random": ("--swims", "random"),
    "forward": ("--swims", "calibrated", "--publish", "forward"),
}
"""Options of the demo by kind of robot: *calibrated* swims by the likelihood estimate, *by score*
by the published choice of a model, *forward* by the rule that has been better so far."""

KINDS = tuple(WORDS)
KEPT = "found.json"
SEEDS = 501
"""The first trial's; the loop was made on seeds 1 to 9."""

PUBLISHED = {180: 0.610, 300: 0.827, 360: 0.850}
"""S of the model against the fish at the ends of windows (Cazenille et al., 10 trials)."""


def run_one(kind: str, seed: int, options: argparse.Namespace) -> dict[str, Any]:
    """Run a trial unless it is there, and return what came of it."""
    folder, minutes = _folder(kind, seed, options), options.minutes
    kept = folder / KEPT
    if kept.exists():
        found: dict[str, Any] = json.loads(kept.read_text(encoding="utf-8"))
        return found
    begin = time.monotonic()
    words = ["--closed-loop", "--duration", f"{minutes}min", *WORDS[kind], "--seed", str(seed)]
    words += [] if options.video else ["--no-video"]
    try:
        zfcal("demo", str(folder), *words)
    except subprocess.CalledProcessError:
        # Of hours of work one trial may meet with a computer that is too busy.
        zfcal("demo", str(folder), *words)
    took_s = time.monotonic() - begin
    report = folder / "trial" / "report" / "integration.json"
    robot = json.loads(report.read_text(encoding="utf-8"))["trials"][0]["robot_vs_fish"]
    found = {
        "kind": kind,
        "seed": seed,
        "minutes": minutes,
        "video": options.video,
        "times_real_time": 60 * minutes / took_s,
        "robot_vs_fish": robot["features"] if robot else {},
        "rounds": _rounds(folder / "trial"),
    }
    kept.write_text(json.dumps(found), encoding="utf-8")
    return found


def _folder(kind: str, seed: int, options: argparse.Namespace) -> Path:
    name = f"{kind.replace(' ', '-')}-{seed}-{options.minutes}min"
    folder: Path = options.build / (f"{name}-video" if options.video else name)
    return folder


def _rounds(trial: Path) -> list[dict[str, Any]]:
    """Return the scores of each window, with their ceilings."""
    found = []
    for path in sorted((trial / "scores").glob("??????.parquet")):
        row: dict[str, Any] = {"window_end_s": int(path.stem)}
        model = path.with_name(f"{path.stem}-model.parquet")
        for name, place in (("social-vs-control", path), ("model-vs-control", model)):
            if place.exists():
                scores = pq.read_table(place).to_pandas()
                scores = scores[(scores.compared == name) & scores.zone.isna()]
                row[name] = {
                    feature: {"value": float(value), "ceiling": float(ceiling)}
                    for feature, value, ceiling in zip(
                        scores.feature, scores.value, scores.ceiling, strict=True
                    )
                }
        found.append(row)
    return found


def measure_all(options: argparse.Namespace) -> dict[str, Any]:
    """Run all trials, two at a time."""
    options.build.mkdir(parents=True, exist_ok=True)
    jobs = [(kind, SEEDS + k) for k in range(options.trials) for kind in options.kinds.split(",")]
    if options.report:
        jobs = [job for job in jobs if (_folder(*job, options) / KEPT).exists()]
    found: dict[str, Any] = {"machine": machine(), "load_before": load(), "trials": []}
    with ThreadPoolExecutor(options.workers) as pool:
        todo = [pool.submit(run_one, *job, options) for job in jobs]
        for each in todo:
            found["trials"].append(each.result())
            last = found["trials"][-1]
            print(last["kind"], last["seed"], _against(last), file=sys.stderr)
    return found


def _against(trial: dict[str, Any], feature: str = "S") -> float:
    """Return how near the robot's score comes to that of a fish in its place."""
    return _mark(trial, feature, "value") / _mark(trial, feature, "ceiling")


def interval(values: list[float]) -> tuple[float, float, float]:
    """Return the mean and its 95 % interval (Student's t)."""
    kept = np.array([value for value in values if np.isfinite(value)])
    mean = float(kept.mean()) if len(kept) else float("nan")
    if len(kept) < 2:
        return mean, float("nan"), float("nan")
    half = float(stats.t.ppf(0.975, len(kept) - 1) * stats.sem(kept))
    return mean, mean - half, mean + half


def markdown(found: dict[str, Any]) -> str:
    """Return both tables."""
    trials = found["trials"]
    kinds = [kind for kind in KINDS if any(t["kind"] == kind for t in trials)]
    minutes, n = trials[0]["minutes"], len({t["seed"] for t in trials})
    how = "drawn and tracked" if trials[0]["video"] else "tracks with noise, no images"
    said = f"""Made by `benchmarks/drive/bench_closed_loop.py`; numbers in
        `benchmarks/results/closed_loop.json`. Machine: {found["machine"]}. Up to {n} virtual
        trials of {minutes} min for each robot ({how}), four fish whose parameters differ from trial
        to trial and drift ([closed-loop.md](closed-loop.md)); seeds on which nothing
        was tuned; 30 generations a round."""
    text = [textwrap.fill(" ".join(said.split()), 120)]
    text.append(_robot_table(trials, kinds))
    if len(kinds) > 1:
        text.append(_difference_table(trials, kinds))
    text.append(_model_table(trials))
    return "# The published experiment, virtually\n\n" + "\n\n".join(text)


def _robot_table(trials: list[dict[str, Any]], kinds: list[str]) -> str:
    """Return how the robot scores, and over what a fish in its place gets."""
    rows = []
    for kind in kinds:
        own = [t for t in trials if t["kind"] == kind]
        mean, low, high = interval([_mark(t, "S", "value") for t in own])
        shares = []
        for feature in "SDWOT":
            value = np.nanmean([_mark(t, feature, "value") for t in own])
            shares.append(value / _ceiling(trials, feature))
        speed = float(np.median([t["times_real_time"] for t in own]))
        span = f"{low / _ceiling(trials, 'S'):.3f} to {high / _ceiling(trials, 'S'):.3f}"
        rows.append([kind, len(own), mean, *shares[:1], span, *shares[1:], speed])
    head = (
        "robot",
        "trials",
        "S",
        "S over the ceiling",
        "95 % interval",
        "D",
        "W",
        "O",
        "T",
        "times real time",
    )
    return (
        "## The robot among the fish\n\n`robot-vs-fish`, pooled from 300 s to the end, and over "
        f"what a fish in its place gets: S {_ceiling(trials, 'S'):.3f}, the mean over all trials "
        "of the table, since that of one trial comes from four fish and varies.\n\n"
        + table(head, rows)
    )


def _difference_table(trials: list[dict[str, Any]], kinds: list[str]) -> str:
    """Return how much better the calibrated robot is among the very same fish."""
    rows = []
    first = {t["seed"]: t for t in trials if t["kind"] == kinds[0]}
    for kind in kinds[1:]:
        own = [t for t in trials if t["kind"] == kind and t["seed"] in first]
        parts = []
        for feature in "SDWOT":
            apart = [
                _mark(first[t["seed"]], feature, "value") - _mark(t, feature, "value") for t in own
            ]
            mean, low, high = interval(apart)
            parts.append(f"{mean:+.3f} ({low:+.3f} to {high:+.3f})")
        rows.append([f"{kinds[0]} less {kind}", *parts])
    return (
        "Robot by robot among the same fish (same seed, same true parameters), with 95 % "
        "intervals:\n\n" + table(("robots", "S", "D", "W", "O", "T"), rows)
    )


def _mark(trial: dict[str, Any], feature: str, what: str) -> float:
    """Return a score of the robot, or its ceiling; NaN where there is none."""
    found = trial["robot_vs_fish"].get(feature, {}).get(what)
    return float("nan") if found is None else float(found)


def _ceiling(trials: list[dict[str, Any]], feature: str) -> float:
    """Return the mean ceiling over trials."""
    return float(np.nanmean([_mark(t, feature, "ceiling") for t in trials]))


def _model_table(trials: list[dict[str, Any]]) -> str:
    """Return how near the calibrated model comes to the fish, window by window."""
    ends = sorted({row["window_end_s"] for t in trials for row in t["rounds"]})
    rows = []
    for end in ends:
        scores = [
            row["model-vs-control"]
            for t in trials
            if t["kind"] == "calibrated"
            for row in t["rounds"]
            if row["window_end_s"] == end and "model-vs-control" in row
        ]
        if not scores:
            continue
        cells = []
        for feature in "DWOTS":
            values = [s[feature]["value"] for s in scores if feature in s]
            cells.append(
                f"{np.mean(values):.3f} ± {np.std(values, ddof=1) if len(values) > 1 else 0:.3f}"
            )
        share = float(np.mean([s["S"]["value"] / s["S"]["ceiling"] for s in scores]))
        rows.append([f"{end} s", *cells, PUBLISHED.get(end, ""), share])
    head = ("window ends at", "D", "W", "O", "T", "S", "published S", "S against its ceiling")
    return "## The model against the fish\n\nMean and standard deviation over trials.\n\n" + table(
        head, rows
    )


def ratios(found: dict[str, Any]) -> dict[str, Ratio]:
    """Return what is compared with the committed results."""
    means = {
        kind: interval([_mark(t, "S", "value") for t in found["trials"] if t["kind"] == kind])[0]
        / _ceiling(found["trials"], "S")
        for kind in KINDS
        if any(trial["kind"] == kind for trial in found["trials"])
    }
    return {
        f"robot among the fish, {kind}, over its ceiling": Ratio(value=mean, better="more")
        for kind, mean in means.items()
        if np.isfinite(mean)
    }


def main() -> None:
    """Run, write, compare."""
    made = parser(__doc__)
    made.add_argument("--trials", type=int, default=3, help="For each kind of robot.")
    made.add_argument("--minutes", type=int, default=10, help="Length of a trial.")
    made.add_argument("--kinds", default=",".join(KINDS), help="Robots, with commas.")
    made.add_argument("--workers", type=int, default=2, help="Trials at a time.")
    made.add_argument("--report", action="store_true", help="Take the trials that are done.")
    made.add_argument("--video", action="store_true", help="Draw and track the cameras' images.")
    made.add_argument("--build", type=Path, default=BUILD, help="Where finished trials are kept.")
    options = made.parse_args()
    if options.tiny:
        options.trials, options.minutes, options.kinds = 1, 3, "fixed"
    found = measure_all(options)
    conclude("closed_loop", found, markdown(found), ratios=ratios, options=options)


if __name__ == "__main__":
    main()

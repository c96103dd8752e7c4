"""Hide an effect in virtual fish, find it, and see whether the robot is nearer to them by it.

A recording of fish that have an effect, among a robot that another laboratory's model drives, is
diagnosed and the model extended. Two closed loops follow with the same fish: one begins with
the base model, one with the extended one, both estimated from that recording. Both go on with
rounds of calibration. Where nothing is named, both are the same robot and the difference is 0.

Makes ``effect_drives.json`` and ``benchmarks-effect-drives.md``: in ``build/benchmarks``, with
``--write`` in ``benchmarks/results`` and ``docs``. What is done stays in ``build/effect-drives``
and is not run again.

    .venv/bin/python benchmarks/drive/bench_effect_drives.py --trials 20
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import sys
import textwrap
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from benchmarks.drive.bench_closed_loop import interval
from benchmarks.shared.measuring import ROOT, load, machine, table, zfcal
from benchmarks.shared.regressions import Ratio, conclude, parser
from zfcal.arena import Arena
from zfcal.artifacts.arenas import load_arena
from zfcal.artifacts.lineage import Lineage
from zfcal.artifacts.models import write_model
from zfcal.errors import DamagedError
from zfcal.model.effects import find_effect
from zfcal.parameters import natural
from zfcal.report.gather import gather
from zfcal.stages.events import say_nothing
from zfcal.stages.trial_context import Task
from zfcal.virtual.closed_loop import closed_loop
from zfcal.virtual.trial import LOOP_SETTINGS, LoopOptions

BUILD = ROOT / "build" / "effect-drives"
HIDDEN = {
    "a component of the mixture": "alignment",
    "a tilt of the headings": "directional-drift",
    "one on speed": "crowding",
}
"""By the three ways in which an effect enters a step; each with its default parameters."""

KEPT = "found.json"
SEEDS = 901
"""The first trial's; written down before the first run."""

_DT_S = 0.2


def run_one(kind: str, seed: int, options: argparse.Namespace) -> dict[str, Any]:
    """Run a pair unless it is there, and return what came of it."""
    folder = _folder(kind, seed, options)
    kept = folder / KEPT
    if kept.exists():
        found: dict[str, Any] = json.loads(kept.read_text(encoding="utf-8"))
        return found
    folder.mkdir(parents=True, exist_ok=True)
    fish, trial = folder / "fish.toml", folder / "recorded" / "trial"
    _write_fish(fish, HIDDEN[kind])
    _loop(folder / "recorded", seed, options.recorded, fish, robot="fixed")
    named = _diagnosed(trial)
    starts = {"base": _estimated(folder / "base.toml", trial, None, options)}
    if named:
        zfcal("extend", str(trial), *_effort(options))
        model = trial / "models" / "extended.toml"
        starts["extended"] = _estimated(folder / "extended.toml", trial, model, options)
    robots = {
        name: _driven(folder / name, seed, fish, start, options) for name, start in starts.items()
    }
    found = {
        "kind": kind,
        "seed": seed,
        "named": named,
        "robots": {"extended": robots["base"], **robots},
    }
    kept.write_text(json.dumps(found), encoding="utf-8")
    return found


def _folder(kind: str, seed: int, options: argparse.Namespace) -> Path:
    folder: Path = options.build / f"{HIDDEN[kind]}-{seed}-{options.minutes}min"
    return folder


def _write_fish(path: Path, name: str) -> None:
    arena = _arena()
    zones = tuple((zone.name, zone.follows_walls) for zone in arena.zones)
    values = {each.name: each.default for each in find_effect(name).parameters}
    model = dataclasses.replace(natural(zones, dt_s=_DT_S), effects={name: values})
    write_model(path, model, Lineage(schema="zfcal.model/1", command="init", options={}))


def _arena() -> Arena:
    return load_arena("two-rooms", Path())


def _loop(folder: Path, seed: int, minutes: int, fish: Path, **how: Any) -> Path:
    """Run what `zfcal demo --closed-loop --no-video` does, without its report."""
    options = LoopOptions(
        duration_s=60.0 * minutes, video=False, seed=seed, fish_model=fish, n_workers=1, **how
    )
    return closed_loop(folder, options, say_nothing, task=Task(force=True))


def _effort(options: argparse.Namespace) -> list[str]:
    return ["--generations", str(options.generations), "--workers", "1"]


def _diagnosed(trial: Path) -> list[str]:
    """Return the effects that the diagnosis names."""
    zfcal("diagnose", str(trial), "--quick", "--workers", "1")
    path = trial / "diagnosis" / "findings.json"
    found = json.loads(path.read_text(encoding="utf-8"))
    return [effect["name"] for effect in found["effects"]] if found["verdict"] == "named" else []


def _estimated(path: Path, trial: Path, model: Path | None, options: argparse.Namespace) -> Path:
    """Write the likelihood estimate of the whole recording."""
    words = ["--window", f"0:{60 * options.recorded}", "--publish", "likelihood", "-o", str(path)]
    words += [] if model is None else ["--model", str(model)]
    zfcal("calibrate", str(trial), *words, *_effort(options))
    return path


def _driven(
    folder: Path, seed: int, fish: Path, start: Path, options: argparse.Namespace
) -> dict[str, Any]:
    """Return how alike a robot and the fish are that it swims among."""
    settings = dataclasses.replace(LOOP_SETTINGS, generations=options.generations)
    trial = _loop(folder, seed, options.minutes, fish, model=start, settings=settings)
    view = gather(trial, _stop, alone=False)
    return {name: dataclasses.asdict(mark) for name, mark in view.integration.robot.items()}


def _stop(damaged: DamagedError) -> None:
    raise damaged


def measure_all(options: argparse.Namespace) -> dict[str, Any]:
    """Run all pairs."""
    jobs = [(kind, SEEDS + k) for k in range(options.trials) for kind in HIDDEN]
    if options.report:
        jobs = [job for job in jobs if (_folder(*job, options) / KEPT).exists()]
    found: dict[str, Any] = {"machine": machine(), "load_before": load(), "pairs": []}
    found |= {"minutes": options.minutes, "recorded": options.recorded}
    found |= {"generations": options.generations}
    with ProcessPoolExecutor(options.workers) as pool:
        for each in [pool.submit(run_one, *job, options) for job in jobs]:
            pair = each.result()
            found["pairs"].append(pair)
            print(pair["kind"], pair["seed"], pair["named"], _gain(pair), file=sys.stderr)
    return found


def _gain(pair: dict[str, Any], feature: str = "S") -> float:
    """Return how much nearer to the fish the robot comes by the extended model."""
    base, extended = (
        pair["robots"][name].get(feature, {}).get("value") for name in ("base", "extended")
    )
    return float("nan") if base is None or extended is None else extended - base


def markdown(found: dict[str, Any]) -> str:
    """Return the table of differences."""
    pairs = found["pairs"]
    said = f"""Made by `benchmarks/drive/bench_effect_drives.py`; numbers in
        `benchmarks/results/effect_drives.json`. Machine: {found["machine"]}. Four virtual fish with
        a hidden effect among a robot ([closed-loop.md](closed-loop.md)), {found["recorded"]} min
        recorded, diagnosed with `--quick` and extended. Then two closed loops of
        {found["minutes"]} min with the same fish: the robot begins with the base model and with
        the extended one, both the likelihood estimate of the recording, and goes on with rounds of
        {found["generations"]} generations that publish the likelihood estimate. Seeds written down
        before the first run. Where nothing is named the difference is 0."""
    text = textwrap.fill(" ".join(said.split()), 120)
    rows = [_row(kind, [pair for pair in pairs if pair["kind"] == kind]) for kind in HIDDEN]
    head = ("effect", "pairs", "named", "S, base", "S, extended", "ceiling", *_DIFFERENCES)
    about = (
        "`robot-vs-fish`, pooled from 300 s to the end. Means; differences pair by pair, extended "
        "less base, with 95 % intervals (Student's t)."
    )
    return f"# A robot that drives by the effect that was found\n\n{text}\n\n{about}\n\n" + table(
        head, [row for row in rows if row]
    )


_DIFFERENCES = ("S, difference", "D", "W", "O", "T")


def _row(kind: str, pairs: list[dict[str, Any]]) -> list[object]:
    if not pairs:
        return []
    base, extended = (
        float(np.mean([pair["robots"][name]["S"]["value"] for pair in pairs]))
        for name in ("base", "extended")
    )
    ceiling = float(np.mean([pair["robots"]["base"]["S"]["ceiling"] for pair in pairs]))
    n_named = sum(HIDDEN[kind] in pair["named"] for pair in pairs)
    cells = []
    for feature in "SDWOT":
        mean, low, high = interval([_gain(pair, feature) for pair in pairs])
        cells.append(f"{mean:+.3f} ({low:+.3f} to {high:+.3f})")
    return [f"{kind} ({HIDDEN[kind]})", len(pairs), n_named, base, extended, ceiling, *cells]


def ratios(found: dict[str, Any]) -> dict[str, Ratio]:
    """Return what is compared with the committed results."""
    made = {}
    for kind in HIDDEN:
        robots = [pair["robots"] for pair in found["pairs"] if pair["kind"] == kind]
        marks = {
            name: float(np.mean([robot[name]["S"]["value"] for robot in robots]))
            for name in ("base", "extended")
            if robots and all("S" in robot[name] for robot in robots)
        }
        if len(marks) == 2:
            value = marks["extended"] / marks["base"]
            made[f"robot with {kind}, over the base model"] = Ratio(value=value, better="more")
    return made


def main() -> None:
    """Run, write, compare."""
    made = parser(__doc__)
    made.add_argument("--trials", type=int, default=20, help="Pairs of each kind.")
    made.add_argument("--minutes", type=int, default=12, help="Length of a closed loop.")
    made.add_argument("--recorded", type=int, default=15, help="Minutes that are diagnosed.")
    made.add_argument("--generations", type=int, default=5, help="Of a round.")
    made.add_argument("--workers", type=int, default=2, help="Pairs at a time.")
    made.add_argument("--report", action="store_true", help="Take the pairs that are done.")
    made.add_argument("--build", type=Path, default=BUILD, help="Where finished pairs are kept.")
    options = made.parse_args()
    if options.tiny:
        options.trials, options.minutes, options.recorded, options.generations = 1, 6, 6, 0
    found = measure_all(options)
    conclude("effect_drives", found, markdown(found), ratios=ratios, options=options)


if __name__ == "__main__":
    main()

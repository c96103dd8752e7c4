"""The main job on real recordings: import, analyse, calibrate on one half, judge on the other.

Runs the commands of zfcal on each recording, in trial directories that stay (a second
run makes nothing again), and writes

    benchmarks/results/real_recordings.json    every number
    docs/pictures/real-NAME.png                statistics of the held-out half beside the model's
    docs/real-recordings.md                    its tables

    .venv/bin/python benchmarks/real/real_recordings.py --data ../shared/data
"""

from __future__ import annotations

import argparse
import json
import os
import shlex
import subprocess
import sys
import time
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from PIL import Image

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from benchmarks.real import measures
from benchmarks.real.document import RESULTS, as_json, fill
from benchmarks.real.measures import SEGMENTS, Places
from benchmarks.real.recordings import SOURCES, Recording, write_arena
from benchmarks.shared.measuring import DOCS, ROOT
from zfcal import __version__
from zfcal.artifacts.models import read_model
from zfcal.behaviour.statistics import Statistics, measure, measure_robot
from zfcal.errors import ZfcalError
from zfcal.report.figures.panels import write_picture
from zfcal.report.figures.statistics import statistics_picture
from zfcal.report.simulated import long_run
from zfcal.report.views import Round

PICTURES = DOCS / "pictures"

SEED = 1
SEEDS = (1, 2, 3)
RESEEDED = ("ring-fish-only-six", "five-zebrafish", "two-rooms-one-fish")
"""One recording of each arena is calibrated again with other seeds."""

N_COLOURS = 256
"""Of a picture's palette: so many leave the theme's colours as they are."""

ALONE = ("ring-fish-only-six", "ring-fish-only-three")
"""Trials without a robot: the control groups of those with one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Effort:
    """How much is done.

    Parameters
    ----------
    generations
        Of each calibration.
    workers
        Threads.
    """

    generations: int
    workers: int


def zfcal(*arguments: str | Path) -> str:
    """Run a command of zfcal, quietly, and return it as a person would type it."""
    words = [str(argument) for argument in arguments]
    begin = time.monotonic()
    program = Path(sys.executable).with_name("zfcal")
    done = subprocess.run([program, *words, "-q"], stdout=subprocess.DEVNULL, check=False)
    line = shlex.join(["zfcal", *words])
    print(f"{time.monotonic() - begin:7.1f} s  {line}", file=sys.stderr, flush=True)
    if done.returncode:
        raise ZfcalError(f"{line}: ended with exit code {done.returncode}, see above.")
    return line


def prepare(recording: Recording, work: Path) -> tuple[Places, list[str]]:
    """Make the trials of a recording and import it, with and without guessed positions."""
    arena = write_arena(recording, work)
    trial, certain = work / recording.name, work / f"{recording.name}-certain"
    lines = []
    sure = ("--min-confidence", "0.5")
    more: tuple[str, ...]
    for root, more in ((trial, ()), (certain, sure)):
        options: tuple[str | Path, ...] = ("--arena", arena, *recording.init, "--seed", str(SEED))
        lines += [
            zfcal("init", root, *options, "--source", recording.title),
            zfcal("import", recording.source, root, *recording.import_, *more),
        ]
    model = trial / "models" / "first-half.toml"
    return Places(trial=trial, certain=certain, model=model), lines


def run(recording: Recording, places: Places, effort: Effort) -> list[str]:
    """Analyse a trial, in the ring against fish alone, and calibrate on its first half."""
    control = places.trial.parent / ALONE[0]
    comparable = recording.name.startswith("ring-") and places.trial != control
    against = ("--control", control) if comparable and control.is_dir() else ()
    train, held_out = (f"{a}:{b}" for a, b in (recording.train_s, recording.held_out_s))
    how = ("--generations", str(effort.generations), "--workers", str(effort.workers))
    lines = [zfcal("analyse", places.trial, *against)]
    for seed, model in models_of(recording, places).items():
        luck = () if seed == SEED else ("--seed", str(seed))
        halves = ("--window", train, "--held-out", held_out)
        lines.append(zfcal("calibrate", places.trial, *halves, *how, *luck, "-o", model))
    return lines


def models_of(recording: Recording, places: Places) -> dict[int, Path]:
    """Return the models of a recording by seed, that of the trial's own seed first."""
    seeds = SEEDS if recording.name in RESEEDED else (SEED,)
    others = {s: places.model.with_stem(f"{places.model.stem}-seed-{s}") for s in seeds}
    return {**others, SEED: places.model}


def gather(recording: Recording, places: Places, lines: list[str]) -> dict[str, Any]:
    """Return every number of a recording."""
    arena = SEGMENTS.open(places.trial).arena
    table: dict[str, Any] = {
        "title": recording.title,
        "said": list(recording.said),
        "facts": recording.facts,
        "commands": [line.replace(f"{places.trial.parent}{os.sep}", "") for line in lines],
        "train_s": list(recording.train_s),
        "held_out_s": list(recording.held_out_s),
        "positions": measures.positions_table(places.trial),
        "statistics": {},
    }
    for name, span in (("first_half", recording.train_s), ("second_half", recording.held_out_s)):
        points = measures.fish_between(places.trial, span)
        table["statistics"][name] = measures.statistics_table(measure(points, arena), points)
    return {
        **table,
        "without_model": measures.without_model_table(recording, places.trial),
        "held_out": measures.held_out_table(recording, places),
        "seeds": measures.seeds_table(models_of(recording, places)),
        "certain": measures.certain_table(recording, places),
    }


def against_the_alone(work: Path, found: dict[str, dict[str, Any]]) -> None:
    """Add to each trial in the ring how alike it is to the fish alone, and its robot to a fish."""
    alone = {name: (work / name,) for name in ALONE if (work / name).is_dir()}
    groups = {**alone, **({"both": tuple(work / name for name in alone)} if len(alone) > 1 else {})}
    for name, table in found.items():
        if not name.startswith("ring-") or not alone:
            continue
        others = {key: roots for key, roots in groups.items() if work / name not in roots}
        table["against_fish_alone"] = measures.control_table(work / name, others)
        if table["positions"]["n_robots"]:
            table["robot"] = measures.robot_table(work / name)
            named = table["facts"]["robot_column_in_file"]
            if named != table["facts"]["robot_column"]:
                table["robot_in_file"] = measures.robot_if_table(work / name, named)


def draw(recording: Recording, places: Places, folder: Path) -> Path:
    """Draw the statistics of the held-out half beside those of the calibrated model, as PNG."""
    opened = SEGMENTS.open(places.trial)
    start_s, end_s = recording.held_out_s
    points = measures.located(places.trial).between(start_s, end_s)
    champion = Round(second=end_s, parameters=read_model(places.model))
    cases: dict[str, Statistics] = {
        "fish": measure(measures.fish_between(places.trial, recording.held_out_s), opened.arena),
        # The very runs by which `zfcal calibrate --held-out` scores the model.
        "model": long_run(champion, opened.trial, opened.arena),
    }
    if recording.has_robot:
        cases["robot"] = measure_robot(points, opened.arena)
    title = f"{recording.title[:1].upper()}{recording.title[1:]}: {start_s} to {end_s} s, "
    picture = statistics_picture(
        cases, opened.arena, title=f"{title}and the model of the first half"
    )
    if not any(stats.distance.any() for stats in cases.values()):
        # A lone fish has no distances to others: the first row would be empty.
        picture = replace(picture, panels=picture.panels[len(opened.arena.zones) :])
    path = folder / f"real-{recording.name}.png"
    path.parent.mkdir(parents=True, exist_ok=True)
    write_picture(picture, path)
    shrink(path)
    return path


def shrink(path: Path) -> None:
    """Make a PNG of few colours a third as large, by a palette."""
    with Image.open(path) as picture:
        small = picture.convert("RGB").quantize(N_COLOURS, dither=Image.Dither.NONE)
    small.save(path, optimize=True)


def main() -> int:
    """Do it all; print the path of each file that is written."""
    options = _options()
    effort = Effort(generations=options.generations, workers=options.workers)
    options.work.mkdir(parents=True, exist_ok=True)
    pictures, told = (options.work, sys.stderr) if options.only else (PICTURES, sys.stdout)
    found: dict[str, dict[str, Any]] = {}
    for prepare_source in (SOURCES[name] for name in options.only or SOURCES):
        recording = prepare_source(options.data, options.work)
        places, lines = prepare(recording, options.work)
        lines += run(recording, places, effort)
        found[recording.name] = gather(recording, places, lines)
        print(draw(recording, places, pictures), file=told, flush=True)
    against_the_alone(options.work, found)
    results = {
        "command": f"make bench-real (--generations {effort.generations}, seed {SEED})",
        "zfcal": __version__,
        "recordings": found,
    }
    if options.only:
        print(json.dumps(results, indent=1))
        return 0
    RESULTS.parent.mkdir(exist_ok=True)
    RESULTS.write_text(as_json(results), encoding="utf-8")
    print(RESULTS)
    print(fill(results))
    return 0


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0] if __doc__ else None)
    data = os.environ.get("ZFCAL_SHARED_DATA", ROOT.parent / "shared" / "data")
    cores = len(os.sched_getaffinity(0))
    add = partial(parser.add_argument)
    add("--data", type=Path, default=Path(data), help="folder of the recordings")
    add(
        "--work", type=Path, default=ROOT / "trials-real", help="folder of the trials that are made"
    )
    add("--generations", type=int, default=40, help="of each calibration")
    add("--workers", type=int, default=cores, help="threads; the numbers do not depend on it")
    add(
        "--only",
        choices=SOURCES,
        nargs="+",
        help="numbers of these on standard output, pictures in --work",
    )
    options = parser.parse_args()
    if not options.data.is_dir():
        parser.error(f"no recordings at {options.data}; --data names another place")
    return options


if __name__ == "__main__":
    try:
        sys.exit(main())
    except ZfcalError as error:
        sys.exit(f"error: {error}\n{error.hint}")

"""Measure what share of a round judging the publishing rules takes.

A simulated trial of four fish and a robot has a few late rounds of one generation, and then
one with a budget and the default settings, which is measured: the estimate over all minutes,
the simulations of the rules' models, their scores, and the second judge.

    .venv/bin/python benchmarks/calibration/publishing_cost.py
    .venv/bin/python benchmarks/calibration/publishing_cost.py --minutes 30 --budget 50
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from zfcal.artifacts.reading.contents import numbered_of
from zfcal.calibrate import rounds
from zfcal.calibrate.task import Settings
from zfcal.stages.analyse.analyse import AnalyseOptions, analyse
from zfcal.stages.calibrate import calibrate as stage
from zfcal.stages.calibrate.searching import CalibrateOptions
from zfcal.stages.events import say_nothing
from zfcal.stages.init import NewTrial, create_trial
from zfcal.stages.simulate import SimulateOptions, simulate
from zfcal.stages.trial_context import Task

_ROUNDS_BEFORE = 15
"""Of which each leaves four models that may be the nearest: as many as are kept."""

_PARTS = {
    "estimate over all minutes": (stage, "remembered"),
    "simulations of the models": (rounds, "_made"),
    "all of judging and handing on": (rounds, "hand_on"),
    "whole round": (stage, "_search"),
}


def main(argv: list[str] | None = None) -> None:
    """Print the seconds of each part, and the share of the rules."""
    parser = argparse.ArgumentParser(description="What judging the publishing rules costs.")
    parser.add_argument("--minutes", type=int, default=30)
    parser.add_argument("--budget", type=float, default=50.0)
    asked = parser.parse_args(argv)
    with tempfile.TemporaryDirectory() as folder:
        found = measure(Path(folder) / "trial", asked.minutes, asked.budget)
    print(json.dumps(found, indent=2))


def measure(root: Path, minutes: int, budget_s: float) -> dict[str, Any]:
    """Return the seconds of each part of a late round, and the share of the rules."""
    new = NewTrial(arena="two-rooms", n_fish=4, n_robots=1, fps=15.0, seed=1)
    create_trial(root, new, say_nothing)
    model = root / "models" / "000000.toml"
    simulate(root, SimulateOptions(model=model, duration_s=60.0 * minutes), say_nothing)
    analyse(root, AnalyseOptions(), say_nothing)
    last_s = 60 * minutes
    for end_s, path in numbered_of(root / "stats", ".parquet").items():
        if end_s < last_s - 60 * _ROUNDS_BEFORE:
            path.unlink()
    short = CalibrateOptions(settings=Settings(generations=1, champion="forward"))
    before = Task(ends_s=frozenset(range(last_s - 60 * _ROUNDS_BEFORE, last_s, 60)))
    stage.calibrate(root, short, say_nothing, task=before)
    options = CalibrateOptions(settings=Settings(champion="forward"), budget_s=budget_s)
    with timed() as seconds:
        stage.calibrate(root, options, say_nothing, task=Task(ends_s=frozenset({last_s})))
    rules_s = seconds["estimate over all minutes"] + seconds["all of judging and handing on"]
    return {"seconds": seconds, "share_of_the_rules": rules_s / seconds["whole round"]}


@contextmanager
def timed() -> Iterator[dict[str, float]]:
    """Give the seconds that each of the parts takes."""
    seconds = dict.fromkeys(_PARTS, 0.0)
    kept = {part: getattr(*place) for part, place in _PARTS.items()}
    for part, (module, name) in _PARTS.items():
        setattr(module, name, _watched(kept[part], part, seconds))
    try:
        yield seconds
    finally:
        for part, (module, name) in _PARTS.items():
            setattr(module, name, kept[part])


def _watched(work: Callable[..., Any], part: str, seconds: dict[str, float]) -> Callable[..., Any]:
    def watched(*args: Any, **named: Any) -> Any:
        began_s = time.monotonic()
        try:
            return work(*args, **named)
        finally:
            seconds[part] += time.monotonic() - began_s

    return watched


if __name__ == "__main__":
    main()

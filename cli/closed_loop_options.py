"""The options of `zfcal demo --closed-loop`."""

from __future__ import annotations

import functools
from typing import Any

import click

from .durations import seconds
from .options import EXISTING, POSITIVE, SEED, Command, FiniteRange, adds

_PRESENT = (
    "real_time", "no_video", "duration_s", "generations", "publish", "champion", "budget_s",
    "robot", "model", "fish_model", "seed", "wariness", "between_sd", "drift_sd", "drift_s",
    "noise_mm",
)  # fmt: skip

_FLAGS = {name: f"--{name.replace('_', '-')}" for name in _PRESENT} | {
    "duration_s": "--duration",
    "budget_s": "--budget",
    "robot": "--swims",
}


_OPTIONS = adds(
    click.option(
        "--closed-loop",
        is_flag=True,
        help="Let virtual fish and the driven robot react to each other.",
    ),
    click.option(
        "--real-time",
        is_flag=True,
        help="As on a rig: zfcal watch and zfcal drive beside the tank.",
    ),
    click.option(
        "--budget", "budget_s", type=seconds, metavar="TIME", help="Of a round.  [default: 50s]"
    ),
    click.option("--no-video", is_flag=True, help="Tracks with the tracker's noise, no images."),
    click.option(
        "--duration", "duration_s", type=seconds, metavar="TIME", help="How long.  [default: 10min]"
    ),
    click.option("--generations", type=click.IntRange(min=0), help="Of a round.  [default: 30]"),
    click.option(
        "--publish",
        type=click.Choice(["forward", "score", "likelihood"]),
        help="Which model of a round drives the robot.  [default: likelihood]",
    ),
    click.option(
        "--champion",
        type=click.Choice(["score", "likely", "likelihood"]),
        hidden=True,
        help="The older name of --publish.",
    ),
    click.option(
        "--swims",
        "robot",
        type=click.Choice(["calibrated", "fixed", "random"]),
        help="What the robot swims by.  [default: calibrated]",
    ),
    click.option(
        "--model", type=EXISTING, help="What the robot begins with; effects drive it as well."
    ),
    click.option(
        "--fish-model",
        type=EXISTING,
        help="What the fish swim by, effects and all, before they differ and drift.",
    ),
    click.option("--seed", type=SEED, help="Of everything.  [default: 1]"),
    click.option(
        "--wariness",
        type=FiniteRange(-3, 5),
        help="Log of the attention that the robot loses.  [default: 0.3]",
    ),
    click.option(
        "--between-sd",
        type=FiniteRange(min=0),
        help="How trials differ, sd of logs.  [default: 0.2]",
    ),
    click.option(
        "--drift-sd",
        type=FiniteRange(min=0),
        help="How parameters drift, sd of logs.  [default: 0.1]",
    ),
    click.option("--drift-s", type=POSITIVE, help="Correlation time of the drift.  [default: 600]"),
    click.option(
        "--noise-mm", type=FiniteRange(min=0), help="Position noise of the tracker.  [default: 0.4]"
    ),
)


def closed_loop_options(command: Command) -> Command:
    """Add --closed-loop and what goes with it, handed over as ``loop``; None without it."""

    @functools.wraps(command)
    def run(*args: Any, closed_loop: bool, **options: Any) -> None:
        asked = {name: options.pop(name) for name in _PRESENT}
        if not closed_loop:
            given = [name for name, value in asked.items() if value not in (None, False)]
            if given:
                raise click.UsageError(f"{_FLAGS[given[0]]} is for --closed-loop.")
        if asked["real_time"] and asked["generations"] is not None:
            raise click.UsageError("--real-time gives rounds a --budget, not --generations.")
        if asked["budget_s"] is not None and not asked["real_time"]:
            raise click.UsageError("--budget is for --real-time: time stands still in lock-step.")
        command(*args, loop=asked if closed_loop else None, **options)

    return _OPTIONS(run)

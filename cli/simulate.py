"""`zfcal simulate`: tracks from a model."""

from __future__ import annotations

from pathlib import Path

import click

from .durations import seconds
from .options import EXISTING, PLACE, count_robots, makes_artifacts, seed_option, speaks
from .output import Output


@click.command("simulate")
@click.argument("trial", type=PLACE)
@click.option("--model", type=EXISTING, required=True, help="A model file.")
@click.option(
    "--duration", "duration_s", type=seconds, required=True, metavar="TIME", help="Such as 30min."
)
@seed_option("Seed of the simulation.  [default: the trial's]")
@click.option("--arena", metavar="NAME|FILE", help="Arena of a new trial; default: the model's.")
@click.option("--fish", "n_fish", type=click.IntRange(min=0), help="Fish of a new trial.")
@click.option("--robot", is_flag=True, help="One robot; the same as --robots 1.")
@click.option("--robots", "n_robots", type=click.IntRange(min=0), help="Robots of a new trial.")
@makes_artifacts
@speaks
def command(
    out: Output,
    trial: Path,
    *,
    model: Path,
    duration_s: float,
    seed: int | None,
    arena: str | None,
    n_fish: int | None,
    robot: bool,
    n_robots: int | None,
    dry_run: bool,
    force: bool,
) -> None:
    r"""Simulate fish that a model drives, and write their tracks.

    A trial that does not exist is made, at the model's own step, with the arena
    and the fish of the trial in which the model lies unless others are given.
    The first 60 s of the simulation are dropped.

    \b
    Example:
        zfcal simulate other --model trial/models/000120.toml --duration 1800 --seed 2
        zfcal simulate alone --model my.toml --arena two-rooms --fish 5 --duration 600
    """
    from zfcal.online.opening import Task
    from zfcal.online.simulate import SimulateOptions, simulate

    def work() -> None:
        options = SimulateOptions(
            model=model,
            duration_s=duration_s,
            seed=seed,
            arena=arena,
            n_fish=n_fish,
            n_robots=count_robots(robot=robot, n_robots=n_robots),
        )
        simulate(trial, options, out.tell, task=Task(dry_run=dry_run, force=force))

    out.attempt(work)

"""`zfcal simulate`: tracks from a model, and images of them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .durations import seconds
from .film_options import film_options
from .options import EXISTING, PLACE, makes_artifacts, new_trial_options, seed_option, speaks
from .output import Output

if TYPE_CHECKING:
    from zfcal.virtual.film import FilmOptions


@click.command("simulate")
@click.argument("trial", type=PLACE)
@click.option("--model", type=EXISTING, required=True, help="A model file.")
@click.option(
    "--duration", "duration_s", type=seconds, required=True, metavar="TIME", help="Such as 30min."
)
@seed_option("Seed of the simulation.  [default: the trial's]")
@new_trial_options
@film_options
@makes_artifacts
@speaks
def command(
    out: Output,
    trial: Path,
    *,
    model: Path,
    duration_s: float,
    seed: int | None,
    new: dict[str, Any],
    film: FilmOptions | None,
    dry_run: bool,
    force: bool,
) -> None:
    r"""Simulate fish that a model drives: their tracks, and images of them.

    A trial that does not exist is made, at the model's own step (with images: at
    15 Hz or so), with the arena and the fish of the trial in which the model lies
    unless others are given. The first 60 s of the simulation are dropped.

    With --video the tank is drawn as its cameras would see it: frames/overhead/
    and, if there is a robot, frames/below/. Each body's centroid is the position
    that the tracks state; the cameras' files are exact.

    \b
    Example:
        zfcal simulate other --model trial/models/000120.toml --duration 1800 --seed 2
        zfcal simulate alone --model my.toml --arena two-rooms --fish 5 --duration 600
        zfcal simulate filmed --model trial/models/000120.toml --duration 2min --video
    """
    from zfcal.stages.simulate import SimulateOptions, simulate
    from zfcal.stages.trial_context import Task

    def work() -> None:
        options = SimulateOptions(model=model, duration_s=duration_s, seed=seed, **new)
        task = Task(dry_run=dry_run, force=force)
        if film is None:
            simulate(trial, options, out.tell, task=task)
            return
        # What draws images takes a third of a second to import.
        from zfcal.virtual.filming import simulate_on_film

        simulate_on_film(trial, options, film, out.tell, task=task)

    out.attempt(work)

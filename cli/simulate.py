"""`zfcal simulate`: tracks from a model, and images of them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from .durations import seconds
from .film_options import film_options
from .options import EXISTING, NEW_PLACE, makes_artifacts, new_trial_options, seed_option, speaks
from .output import Output


@click.command("simulate")
@click.argument("trial", type=NEW_PLACE)
@click.option("--model", type=EXISTING, required=True, help="A model file.")
@click.option("--duration", type=seconds, required=True, metavar="TIME", help="Such as 30min.")
@seed_option("Seed of the simulation.  [default: the trial's]")
@new_trial_options
@film_options
@makes_artifacts
@speaks
def command(out: Output, /, trial: Path, **options: Any) -> None:
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
    from zfcal.api.simulating import simulation_of

    work = simulation_of(options)
    out.attempt(lambda: work(trial, out.tell))

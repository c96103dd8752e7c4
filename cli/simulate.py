"""`zfcal simulate`: tracks from a model, and images of them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from .durations import seconds
from .film_options import film_options, filmed
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
@click.option("--fps", type=float, help="Frame rate of a new trial, in hertz.")
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
    arena: str | None,
    n_fish: int | None,
    robot: bool,
    n_robots: int | None,
    fps: float | None,
    video_file: Path | None,
    dry_run: bool,
    force: bool,
    **images: Any,
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
        zfcal simulate filmed --model my.toml --arena two-rooms --fish 4 --robot \
            --duration 2min --video --look hard --video-file filmed.avi
    """
    from zfcal.online.filming import simulate_on_film
    from zfcal.online.opening import Task
    from zfcal.online.simulate import SimulateOptions, simulate

    film = filmed(**images, seed=seed, video_file=video_file)

    def work() -> None:
        options = SimulateOptions(
            model=model,
            duration_s=duration_s,
            seed=seed,
            arena=arena,
            n_fish=n_fish,
            n_robots=count_robots(robot=robot, n_robots=n_robots),
            fps=fps,
        )
        task = Task(dry_run=dry_run, force=force)
        if film is None:
            simulate(trial, options, out.tell, task=task)
        else:
            simulate_on_film(trial, options, film, out.tell, task=task, video=video_file)

    out.attempt(work)

"""`zfcal init`: make a trial directory."""

from __future__ import annotations

from pathlib import Path

import click

from .options import (
    NEW_PLACE,
    POSITIVE,
    arena_options,
    makes_artifacts,
    seed_option,
    speaks,
)
from .output import Output


@click.command("init")
@click.argument("trial", type=NEW_PLACE)
@arena_options
@click.option(
    "--fps",
    type=POSITIVE,
    default=15.0,
    show_default=True,
    help="Frame rate of the tracks.",
)
@click.option("--dt-s", type=POSITIVE, help="The model's step; default: frames nearest to 0.2 s.")
@seed_option("All random numbers of the trial derive from it.  [default: 0]")
@click.option("--source", default="", help="Where the data come from, in words.")
@makes_artifacts
@speaks
def command(
    out: Output,
    trial: Path,
    *,
    arena: str | None,
    radius_m: float | None,
    side_m: float | None,
    n_fish: int | None,
    robot: bool,
    n_robots: int | None,
    fps: float,
    dt_s: float | None,
    seed: int | None,
    source: str,
    dry_run: bool,
    force: bool,
) -> None:
    r"""Make a trial directory: trial.toml and a starting model.

    An arena is one that comes with zfcal (two-rooms, open-square, circular,
    ring) or a GeoJSON file in metres, which is copied into the trial.
    --force writes the settings of an existing trial anew and leaves the rest.

    \b
    Example:
        zfcal init trial --arena two-rooms --fish 4 --robot --fps 15
        zfcal init tank --radius-m 0.25 --fish 6 --source "shoal 3, Tuesday"
    """
    from zfcal.api.simulating import count_robots
    from zfcal.stages.init import NewTrial, create_trial
    from zfcal.stages.trial_context import Task

    if n_fish is None:
        raise click.UsageError("Missing option '--fish'.")
    new = NewTrial(
        n_fish=n_fish,
        n_robots=count_robots(robot=robot, n_robots=n_robots) or 0,
        fps=fps,
        arena=arena,
        radius_m=radius_m,
        side_m=side_m,
        dt_s=dt_s,
        seed=seed or 0,
        source=source,
    )
    task = Task(dry_run=dry_run, force=force)
    out.attempt(lambda: create_trial(trial, new, out.tell, task=task))

"""`zfcal calibrate`: models for a trial's windows."""

from __future__ import annotations

from typing import Any

import click

from .durations import seconds, span
from .options import PLACE, makes_artifacts, seed_option, speaks, takes_trials
from .output import Output


@click.command("calibrate")
@takes_trials
@click.option("--generations", type=click.IntRange(min=0), help="Per round.  [default: 15]")
@click.option(
    "--budget",
    "budget_s",
    type=seconds,
    metavar="TIME",
    help="Wall-clock time per round, such as 50s.",
)
@click.option("--population", type=int, default=60, show_default=True, help="A multiple of four.")
@click.option("--runs", type=int, default=1, show_default=True, help="Simulations an evaluation.")
@click.option("--steps", type=int, default=3000, show_default=True, help="Steps of each of them.")
@click.option(
    "--optimiser",
    type=click.Choice(["zfcal", "deap"]),
    default="zfcal",
    show_default=True,
    help="NSGA-II as arrays, or with DEAP's operators.",
)
@click.option(
    "--seed-likelihood/--no-seed-likelihood",
    default=True,
    show_default=True,
    help="Let the maximum-likelihood estimate join the first population.",
)
@click.option("--baselines", is_flag=True, help="Score random search and the last model too.")
@seed_option("Seed of the random numbers.  [default: the trial's]")
@click.option("--workers", type=click.IntRange(min=1), help="Threads.  [default: one per core]")
@click.option("--cluster", metavar="ADDRESS", help="Simulate there, such as tcp://host:8786.")
@click.option("--window", type=span, metavar="START:END", help="One pooled window instead.")
@click.option("--held-out", type=span, metavar="START:END", help="Score the model there as well.")
@click.option("-o", "--out", "output", type=PLACE, help="Where the model of --window goes.")
@makes_artifacts
@speaks
def command(out: Output, trials: tuple[str, ...], **options: Any) -> None:
    r"""Find the model that comes nearest to each window of a trial.

    Writes models/E.toml, models/E.parquet and scores/E-model.parquet for each
    window that `zfcal analyse` has measured. Each round starts from the last
    population of the one before. A killed run goes on where it was.

    \b
    Example:
        zfcal calibrate trial --generations 20 --seed 1
        zfcal calibrate trial --budget 50s
        zfcal calibrate trial*/ --cluster tcp://host:8786
        zfcal calibrate trial --window 0:900 --held-out 900:1800 -o first-half.toml
    """
    from .calibration import choose, each_round, on_cluster, span_task

    chosen, task = choose(options)
    with on_cluster(out, options, chosen) as placed:
        if options["window"] is not None:
            span_task(out, trials, options, (placed, task))
        else:
            each_round(out, trials, placed, task)

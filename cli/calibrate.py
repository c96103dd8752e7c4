"""`zfcal calibrate`: models for a trial's windows."""

from __future__ import annotations

from typing import Any

import click

from .calibration import round_options
from .durations import span
from .options import PLACE, makes_artifacts, names, speaks, takes_trials
from .output import Output


@click.command("calibrate")
@takes_trials
@round_options(generations="  [default: 15]")
@click.option("--cluster", metavar="ADDRESS", help="Simulate there, such as tcp://host:8786.")
@click.option("--window", type=span, metavar="START:END", help="One pooled window instead.")
@click.option("--held-out", type=span, metavar="START:END", help="Score the model there as well.")
@click.option("-o", "--out", "output", type=PLACE, help="Where the model of --window goes.")
@click.option(
    "--features",
    type=names,
    default="D,W,O,T",
    show_default=True,
    metavar="NAMES",
    help="The statistics whose similarity counts.",
)
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
        zfcal calibrate trial --features D,W,O,T,residence,curvature
        zfcal calibrate trial --window 0:900 --held-out 900:1800 -o first-half.toml
    """
    from .calibration import choose, each_round, on_cluster, span_task

    chosen, task = choose(options)
    with on_cluster(out, options, chosen) as placed:
        if options["window"] is not None:
            span_task(out, trials, options, (placed, task))
        else:
            each_round(out, trials, placed, task)

"""`zfcal calibrate`: models for a trial's windows."""

from __future__ import annotations

from typing import Any

import click

from .calibration import round_options
from .durations import span
from .options import PLACE, makes_artifacts, names, speaks, takes_trials
from .output import Output
from .streams import STDIN, each_trial, trials_together


@click.command("calibrate")
@takes_trials
@round_options(generations="  [default: 15]")
@click.option("--cluster", metavar="ADDRESS", help="Simulate there, such as tcp://host:8786.")
@click.option("--window", type=span, metavar="START:END", help="One pooled window instead.")
@click.option("--held-out", type=span, metavar="START:END", help="Score the model there as well.")
@click.option("-o", "--out", type=PLACE, help="Where the model of --window goes.")
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
def command(out: Output, /, trials: tuple[str, ...], **options: Any) -> None:
    r"""Find the model that fits each window of a trial best.

    Writes models/E.toml, models/E.parquet, scores/E-model.parquet and
    scores/E-rules.parquet for each window that `zfcal analyse` has measured.
    Each round starts from the last population of the one before, and says which
    model it publishes, and why. A killed run goes on where it was.

    \b
    Example:
        zfcal calibrate trial --generations 20 --seed 1
        zfcal calibrate trial --budget 50s
        zfcal calibrate trial*/ --cluster tcp://host:8786
        zfcal calibrate trial --features D,W,O,T,residence --publish score
        zfcal calibrate trial --window 0:900 --held-out 900:1800 -o first-half.toml
    """
    from zfcal.api.calibrating import calibration_of

    with calibration_of(options, out.tell) as work:
        if work.span is not None and (len(trials) != 1 or STDIN in trials):
            raise click.UsageError("--window takes one trial, since -o names one file.")
        cluster = work.chosen.cluster
        if cluster is None or work.span is not None or STDIN in trials:
            each_trial(out, trials, lambda found: work(found, out.tell))
        else:
            trials_together(out, trials, work, n_threads=cluster.n_threads)

"""`zfcal calibrate`: models for a trial's windows."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .calibration import choose, round_options
from .durations import span
from .options import PLACE, makes_artifacts, names, speaks, takes_trials
from .output import Output
from .streams import STDIN, each_trial, trials_together

if TYPE_CHECKING:
    from zfcal.stages.calibrate.searching import CalibrateOptions
    from zfcal.stages.events import Tell
    from zfcal.stages.streams import Work

    from .calibration import MakeTask


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

    Writes models/E.toml, models/E.parquet, scores/E-model.parquet and
    scores/E-rules.parquet for each window that `zfcal analyse` has measured.
    Each round starts from the last population of the one before, and says which
    model it publishes, and why. A killed run goes on where it was.

    \b
    Example:
        zfcal calibrate trial --generations 20 --seed 1
        zfcal calibrate trial --budget 50s
        zfcal calibrate trial*/ --cluster tcp://host:8786
        zfcal calibrate trial --features D,W,O,T,residence,curvature
        zfcal calibrate trial --window 0:900 --held-out 900:1800 -o first-half.toml
    """
    chosen, task = choose(options)
    with _on_cluster(out, options, chosen) as placed:
        if options["window"] is not None:
            _span_task(out, trials, options, (placed, task))
        else:
            _each_round(out, trials, placed, task)


@contextmanager
def _on_cluster(
    out: Output, options: Mapping[str, Any], chosen: CalibrateOptions
) -> Iterator[CalibrateOptions]:
    """Give the options the cluster that is asked for; a dry run needs none."""
    if options["cluster"] is None or options["dry_run"]:
        yield chosen
        return
    from zfcal.calibrate.scheduler import connect

    with connect(options["cluster"]) as cluster:
        size = f"workers {cluster.n_workers}, threads {cluster.n_threads}"
        out.note(f"Cluster {cluster.address}: {size}.")
        yield dataclasses.replace(chosen, cluster=cluster)


def _each_round(
    out: Output, trials: tuple[str, ...], chosen: CalibrateOptions, task: MakeTask
) -> None:
    """Calibrate trials round by round; on a cluster, several trials at the same time."""
    from zfcal.stages.calibrate.calibrate import calibrate

    def work(found: Work, tell: Tell) -> None:
        calibrate(found.root, chosen, tell, task=task(found.ends_s))

    if chosen.cluster is None or STDIN in trials:
        each_trial(out, trials, functools.partial(work, tell=out.tell))
    else:
        trials_together(out, trials, work, n_threads=chosen.cluster.n_threads)


def _span_task(
    out: Output,
    trials: tuple[str, ...],
    options: Mapping[str, Any],
    chosen: tuple[CalibrateOptions, MakeTask],
) -> None:
    """Calibrate one pooled window of one trial."""
    from zfcal.stages.calibrate.holdout import Span, calibrate_span

    if len(trials) != 1 or trials[0] == "-":
        raise click.UsageError("--window takes one trial, since -o names one file.")
    asked = Span(
        train_s=options["window"], held_out_s=options["held_out"], output=options["output"]
    )
    calibration, task = chosen
    work = functools.partial(calibrate_span, Path(trials[0]), asked, calibration, out.tell)
    out.attempt(lambda: work(task=task(None)))

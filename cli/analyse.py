"""`zfcal analyse`: statistics and scores of a trial's windows."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from .options import EXISTING, makes_artifacts, names, speaks, takes_trials
from .output import Output
from .streams import each_trial

if TYPE_CHECKING:
    from zfcal.stages.streams import Work


@click.command("analyse")
@takes_trials
@click.option(
    "--control",
    type=EXISTING,
    multiple=True,
    metavar="TRIAL",
    help="A robot-free trial whose fish are the control; repeat it to pool several.",
)
@click.option(
    "--scoring",
    type=click.Choice(["paper", "legacy"]),
    default="paper",
    show_default=True,
    help="legacy: as the authors' published scripts compute the score.",
)
@click.option(
    "--features",
    type=names,
    metavar="NAMES",
    help="Count these as well, such as residence,curvature.",
)
@makes_artifacts
@speaks
def command(
    out: Output,
    trials: tuple[str, ...],
    *,
    control: tuple[Path, ...],
    scoring: str,
    features: tuple[str, ...] | None,
    dry_run: bool,
    force: bool,
) -> None:
    r"""Make statistics and scores of each window of 120 s, every 60 s.

    Writes stats/E.parquet and scores/E.parquet for each second E at which a
    window ends: the distances between agents, to the wall, occupation,
    transitions and speeds, and how alike the group with the robot is to the
    fish alone, and the robot to a fish.

    \b
    Example:
        zfcal analyse trial
        zfcal analyse day1 day2 --control alone1 --control alone2
        zfcal analyse trial --features residence,curvature
        zfcal import tracks.csv trial --format csv | zfcal analyse -
    """
    from zfcal.stages.analyse.analyse import AnalyseOptions, analyse
    from zfcal.stages.segments import Segments
    from zfcal.stages.trial_context import Task

    options = AnalyseOptions(scoring=scoring, control=control, features=features or ())
    if features is not None and not options.further:
        raise click.UsageError("--features names none beyond D, W, O, T and V: these are counted.")
    segments = Segments()

    def work(found: Work) -> None:
        task = Task(dry_run=dry_run, force=force, ends_s=found.ends_s)
        analyse(found.root, options, out.tell, task=task, segments=segments)

    each_trial(out, trials, work)

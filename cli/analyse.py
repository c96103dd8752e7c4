"""`zfcal analyse`: statistics and scores of a trial's windows."""

from __future__ import annotations

from typing import Any

import click

from .options import EXISTING, makes_artifacts, names, speaks, takes_trials
from .output import Output
from .streams import each_trial


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
def command(out: Output, /, trials: tuple[str, ...], **options: Any) -> None:
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
    from zfcal.api.analysing import analysis_of

    work = analysis_of(options)
    each_trial(out, trials, lambda found: work(found, out.tell))

"""`zfcal report`: one page with its figures."""

from __future__ import annotations

from typing import Any

import click

from .options import PLACE, figure_options, makes_artifacts, speaks, takes_trials
from .output import Output
from .streams import roots_of

_OUT = "Where it goes.  [default: TRIAL/report, of several trials report]"


@click.command("report")
@takes_trials
@click.option("-o", "--out", type=PLACE, help=_OUT)
@figure_options
@click.option(
    "--film",
    type=click.Choice(["mp4", "gif"]),
    help="A film of the last window beside the calibrated model; of one trial.",
)
@click.option(
    "--published",
    is_flag=True,
    help="Draw the published scores, which are of other fish, beside these.",
)
@makes_artifacts
@speaks
def command(out: Output, /, trials: tuple[str, ...], **options: Any) -> None:
    r"""Write a page with figures: one trial, or several in one report.

    The page holds its figures and can be sent by itself; they lie beside it as
    files too. Over several trials it shows mean and standard deviation per window,
    and a table of the trials, which leads to a page of each.

    \b
    Example:
        zfcal report trial
        zfcal report trial*/
        zfcal report day1 day2 day3 --out together
        zfcal report trial --format pdf,png --width single
    """
    from zfcal.api.reporting import how_of, write_page
    from zfcal.api.trials import task_of

    roots = roots_of(out, trials)
    if roots and not out.exit_code:
        task, how = task_of(options), how_of(options)
        out.attempt(lambda: write_page(roots, options["out"], out.tell, task=task, how=how))

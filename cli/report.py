"""`zfcal report`: one page with its figures."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from .options import PLACE, makes_artifacts, speaks, takes_trials
from .output import Output
from .streams import roots_of

if TYPE_CHECKING:
    from zfcal.errors import DamagedError
    from zfcal.stages.trial_context import Task

_OUT = "Where it goes.  [default: TRIAL/report, of several trials report]"
_HINT = "Make it again, or copy it again from where it was made."


@click.command("report")
@takes_trials
@click.option("-o", "--out", "folder", type=PLACE, help=_OUT)
@makes_artifacts
@speaks
def command(
    out: Output, trials: tuple[str, ...], *, folder: Path | None, dry_run: bool, force: bool
) -> None:
    r"""Write a page with figures: one trial, or several in one report.

    The page holds its figures and can be sent by itself; they lie beside it as
    PNG too. Over several trials it shows mean and standard deviation per window.

    \b
    Example:
        zfcal report trial
        zfcal report trial*/
        zfcal report day1 day2 day3 --out together
    """
    from zfcal.stages.trial_context import Task

    roots = roots_of(out, trials)
    if len(roots) > 1 and folder is None:
        folder = Path("report")
    if roots and not out.exit_code:
        task = Task(dry_run=dry_run, force=force)
        out.attempt(lambda: write_page(out, roots, folder, task))


def write_page(out: Output, roots: list[Path], folder: Path | None, task: Task) -> None:
    """Write the report of trials, unless it is up to date."""
    from zfcal.report.page import (
        PAGE,
        report_files,
        report_left_out,
        report_reason,
        write_report,
    )
    from zfcal.stages.events import LeftOut, Made, Planned, UpToDate
    from zfcal.stages.stage import settled
    from zfcal.stages.trial_context import at_work

    def work() -> None:
        reason = report_reason(roots, folder) or ("forced" if task.force else None)
        if reason is None:
            for path in report_files(roots, folder):
                out.tell(UpToDate(path=path))
            for line in report_left_out(roots, folder):
                out.tell(LeftOut(path=Path(), problem=line, hint=_HINT))
        elif task.dry_run:
            out.tell(Planned(path=(folder or roots[0] / "report") / PAGE, reason=reason))
        else:
            for path in write_report(roots, folder, on_damage=_damage(out)):
                out.tell(Made(path=path, reason=reason))

    with at_work(roots[0], "report", task):
        settled(work, out.tell)


def _damage(out: Output) -> Callable[[DamagedError], None]:
    from zfcal.stages.events import LeftOut

    return lambda error: out.tell(LeftOut(path=Path(), problem=str(error), hint=error.hint))

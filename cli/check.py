"""`zfcal check`: whether a trial is whole and valid, and the computer fit for it."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import click

from .options import speaks, takes_trials
from .output import Output
from .streams import each_trial

if TYPE_CHECKING:
    from zfcal.stages.streams import Work


@click.command("check")
@takes_trials
@speaks
def command(out: Output, trials: tuple[str, ...]) -> None:
    r"""Check every artifact of a trial, and versions, cores, disk, file system, clock.

    Ends with exit code 3 where something is damaged.

    \b
    Example:
        zfcal check trial
        zfcal check trial --json
    """
    from zfcal.artifacts.checking import check_trial
    from zfcal.artifacts.findings import ERROR, OK

    def work(found: Work) -> None:
        for finding in check_trial(found.root):
            says = f"{finding.level:8}{found.root}: {finding.where}: {finding.says}"
            shown = finding.level != OK or not out.quiet
            out.result(
                {"trial": str(found.root), **dataclasses.asdict(finding)},
                text=(f"{says}\n        {finding.hint}" if finding.hint else says)
                if shown
                else None,
            )
            if finding.level == ERROR:
                out.worsen()

    each_trial(out, trials, work)

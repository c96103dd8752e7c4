"""`zfcal check`: whether a trial is whole and valid, and the computer fit for it."""

from __future__ import annotations

import dataclasses
import functools
from pathlib import Path

import click

from .options import speaks, takes_trials
from .output import Output
from .streams import roots_of


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

    def work(root: Path) -> None:
        for finding in check_trial(root):
            says = f"{finding.level:8}{root}: {finding.where}: {finding.says}"
            shown = finding.level != OK or not out.quiet
            out.result(
                {"trial": str(root), **dataclasses.asdict(finding)},
                text=(f"{says}\n        {finding.hint}" if finding.hint else says)
                if shown
                else None,
            )
            if finding.level == ERROR:
                out.worsen()

    # Once each, however many of its files are named.
    for root in roots_of(out, trials):
        out.attempt(functools.partial(work, root))

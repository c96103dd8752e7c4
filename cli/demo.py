"""`zfcal demo`: a whole small trial from nothing."""

from __future__ import annotations

from pathlib import Path

import click

from .options import PLACE, speaks
from .output import Output
from .report import write_page


@click.command("demo")
@click.argument("folder", metavar="[DIR]", type=PLACE, default=Path("zfcal-demo"))
@click.option("--force", is_flag=True, help="Make it again, even if it is up to date.")
@speaks
def command(out: Output, folder: Path, *, force: bool) -> None:
    r"""Simulate a tank and its cameras, track, analyse, calibrate and report.

    DIR gets tank/ (the simulated truth and the images of it), trial/ (all that
    is made from these images) and a contact sheet of the worst frames. Takes a
    minute or two.

    \b
    Example:
        zfcal demo
        zfcal demo /tmp/demo --force
    """
    from zfcal.online.demo import run_demo
    from zfcal.online.opening import Task

    def work() -> None:
        task = Task(force=force)
        trial = run_demo(folder, out.tell, task=task)
        write_page(out, [trial], None, task)
        out.note(f"Figures: {trial / 'report'} (open {trial / 'report' / 'index.html'})")

    out.attempt(work)

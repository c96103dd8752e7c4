"""`zfcal watch`: the stages on each new segment, until the trial ends."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import Any

import click

from .calibration import round_options
from .durations import seconds
from .options import EXISTING, PLACE, speaks
from .output import Output
from .tracking import tracking_options
from .viewing import view_options


@click.command("watch")
@click.argument("trial", type=PLACE)
@click.option(
    "--stages",
    metavar="STAGE,...",
    help="Of track, analyse, calibrate; or none, for the page alone.  [default: "
    "analyse,calibrate; track where a source is given]",
)
@click.option("--poll", is_flag=True, help="Look again and again; automatic on network disks.")
@click.option("--once", is_flag=True, help="Make all that can be made now, and leave.")
@click.option(
    "--until-idle",
    "until_idle_s",
    type=seconds,
    metavar="TIME",
    help="Leave when nothing has changed for so long.",
)
@view_options
@click.option(
    "-n", "--dry-run", is_flag=True, help="Say what each stage would make now; write nothing."
)
@round_options(budget="  [default: 50s]")
@click.option(
    "--control",
    type=EXISTING,
    multiple=True,
    metavar="TRIAL",
    help="A robot-free trial whose fish are the control; repeat it to pool several.",
)
@tracking_options
@functools.partial(speaks, as_json="A line of JSON for each event instead of paths.")
def command(out: Output, trial: Path, **options: Any) -> None:
    r"""Run the stages on each new segment until the trial ends.

    Each new minute of tracks is analysed at once and calibrated within the
    minute. A round that overruns makes the next ones shorter; windows that
    would come too late are skipped, and a file says so. On one computer
    of several, --stages says which part it does; rsync brings the rest. With
    --view a page shows all that to browsers on this computer, and plays the trial
    once it has ended.

    \b
    Example:
        zfcal watch trial
        zfcal watch trial --dry-run
        zfcal watch trial --overhead 0 --below 1 --budget 50s
        zfcal watch trial --stages calibrate --json
        zfcal watch trial --once --generations 20
        zfcal watch trial --view
    """
    from .viewing import open_page, page_plan, stay
    from .watching import Voice, watch_options

    chosen = watch_options(trial, options)
    if options["dry_run"]:
        from zfcal.online.plan import tell_watch_plan

        out.attempt(lambda: tell_watch_plan(trial, chosen, out.tell))
        if options["view"]:
            out.note(page_plan(options))
        return
    from zfcal.online.watch import watch

    out.in_lines = True
    with (
        open_page(trial, options) as page,
        Voice(out, page, table=options["table"]) as voice,
    ):
        voice.announce()
        for left in watch(trial, chosen, voice.hear) if chosen.jobs(trial) else ():
            out.tell(left)
        if page is not None and not chosen.once and chosen.until_idle_s is None:
            stay(page, out)

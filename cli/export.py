"""`zfcal export`: a trial in the forms of other programs."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import click

from .foreign import pair
from .options import PLACE, POSITIVE, makes_artifacts, speaks, takes_trials
from .output import Output
from .streams import roots_of

# Written out, since the library that knows them is heavy; a test compares the two.
TABLES = ("csv", "parquet")
FORMATS = (*TABLES, "trex", "idtracker", "movement", "deeplabcut", "sleap")

_OUT = "The folder it goes into.  [default: TRIAL/export/FORMAT]"
_SCALE = "Scale of files in pixels.  [default: that of the imported file, or 1]"
_M_PER_MM = 0.001


@click.command("export")
@takes_trials
@click.option(
    "--to", "formats", type=click.Choice(FORMATS), multiple=True, help="A format; may be repeated."
)
@click.option("--layout", is_flag=True, help="A layout of Foxglove for the trial's MCAP files.")
@click.option("-o", "--output", "folder", type=PLACE, help=_OUT)
@click.option("--mm-per-px", type=POSITIVE, help=_SCALE)
@click.option("--origin", type=pair, metavar="X,Y", help="Pixel at which (0, 0) m lies.")
@makes_artifacts
@speaks
def command(
    out: Output,
    trials: tuple[str, ...],
    *,
    formats: tuple[str, ...],
    layout: bool,
    folder: Path | None,
    mm_per_px: float | None,
    origin: tuple[float, float] | None,
    dry_run: bool,
    force: bool,
) -> None:
    r"""Write a trial's tracks for other programs.

    csv and parquet hold statistics, scores, parameters and findings as well,
    as tidy tables. Says what a format has no place for, and how zfcal import
    reads the files back; both stand in export-FORMAT.json beside them.

    \b
    Example:
        zfcal export trial --to csv
        zfcal export trial --to movement --to sleap --layout
        zfcal export trial --to deeplabcut --mm-per-px 0.98 --origin 12,1010 -o for-dlc
    """
    from zfcal.stages.export.export import export
    from zfcal.stages.export.options import ExportOptions
    from zfcal.stages.trial_context import Task

    if not formats and not layout:
        raise click.UsageError("There is nothing to export: give --to FORMAT, --layout, or both.")
    if (mm_per_px or origin) and set(formats) <= set(TABLES):
        raise click.UsageError("--mm-per-px and --origin have no effect: nothing is in pixels.")
    roots = roots_of(out, trials)
    if len(roots) > 1 and folder is not None:
        raise click.UsageError("--output takes the export of one trial, there are several.")
    options = ExportOptions(
        formats=tuple(dict.fromkeys(formats)),
        layout=layout,
        folder=folder,
        m_per_px=None if mm_per_px is None else mm_per_px * _M_PER_MM,
        origin_px=origin,
    )
    task = Task(dry_run=dry_run, force=force)
    for root in roots:
        out.attempt(partial(export, root, options, out.tell, task=task))

"""`zfcal import`: the tracks of another program."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from .foreign import FORMATS, foreign_options, import_options
from .options import EXISTING, PLACE, makes_artifacts, speaks
from .output import Output


@click.command("import")
@click.argument("source", metavar="SRC", type=EXISTING)
@click.argument("trial", type=PLACE)
@click.option(
    "--format", "format_", type=click.Choice(FORMATS), help="What SRC is; default: by its looks."
)
@foreign_options
@click.option(
    "--robot-tracks", type=EXISTING, help="A file of the same format that holds the robots alone."
)
@makes_artifacts
@speaks
def command(
    out: Output,
    source: Path,
    trial: Path,
    *,
    format_: str | None,
    robot_tracks: Path | None,
    dry_run: bool,
    force: bool,
    **options: Any,
) -> None:
    r"""Import tracks into a trial, as closed segments of 60 s.

    Formats: csv (time_s, agent, x_m, y_m or x_px, y_px; kind, heading_rad and
    confidence if there are), cats (positions-*.txt of the older rig), trex,
    idtracker, trajectorytools, mot, sleap (analysis .h5, labels .slp), deeplabcut,
    movement, nwb, robofish (HDF5 of robofish-io), fishmodel (text of the older
    simulator). Pixels need a scale; nothing is called metres without one.

    \b
    Example:
        zfcal import tracks.csv trial --format csv
        zfcal import video.npy ring --format idtracker --mm-per-px 1.08 --origin 0,1024 --flip-y
        zfcal import tank.hdf5 trial --format robofish --origin -50,-50
        zfcal import tracks.csv trial --format csv | zfcal analyse - | zfcal calibrate -
    """
    from zfcal.stages.import_ import Source, import_tracks
    from zfcal.stages.trial_context import Task

    what = Source(
        path=source,
        format=format_,
        options=import_options(options),
        robot_tracks=robot_tracks,
    )
    task = Task(dry_run=dry_run, force=force)
    out.attempt(lambda: import_tracks(trial, what, out.tell, task=task))

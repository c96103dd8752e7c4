"""`zfcal camera align`: overhead and below in one frame."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from .camera_options import figure_option, task_of
from .options import NAME, PLACE, makes_artifacts, speaks
from .output import Output


@click.command("align")
@click.argument("trial", type=PLACE)
@click.option(
    "--overhead", type=NAME, metavar="SRC", help="Images from above; default: the trial's frames/."
)
@click.option(
    "--below", type=NAME, metavar="SRC", help="Images from below; default: the trial's frames/."
)
@click.option(
    "--start-s", type=click.FloatRange(min=0), default=0.0, show_default=True, help="From here on."
)
@click.option(
    "--seconds",
    type=click.FloatRange(min=5),
    default=120.0,
    show_default=True,
    help="So much of the recording is looked at.",
)
@figure_option
@makes_artifacts
@speaks
def align(
    out: Output,
    trial: Path,
    *,
    overhead: str | None,
    below: str | None,
    start_s: float,
    seconds: float,
    **where: Any,
) -> None:
    r"""Bring the camera below into the frame of the one overhead.

    Both are calibrated, and a recording shows the robot driving about among
    the fish. Writes cameras/below-aligned.toml, which the trial uses from then
    on; the calibration that it corrects stays. Says how much the clocks differ.

    \b
    Example:
        zfcal camera align trial
        zfcal camera align trial --overhead above.mp4 --below below.mp4
    """
    from zfcal.stages.camera.align import Recording, align_cameras

    recording = Recording(overhead=overhead, below=below, start_s=start_s, seconds=seconds)
    task = task_of(where)
    out.attempt(lambda: align_cameras(trial, recording, out.tell, task=task))

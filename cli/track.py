"""`zfcal track`: from camera images to tracks."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from .options import PLACE, makes_artifacts, speaks
from .output import Output
from .tracking import track_options, tracking_options


@click.command("track")
@click.argument("trial", type=PLACE)
@tracking_options
@click.option("--trajectories", type=PLACE, help="Draw paths and ids into this PNG.")
@makes_artifacts
@speaks
def command(
    out: Output,
    trial: Path,
    *,
    trajectories: Path | None,
    dry_run: bool,
    force: bool,
    **options: Any,
) -> None:
    r"""Track a recording, or a live camera, into poses and tracks.

    SRC is a video file, a folder or pattern of images, MCAP image segments (a
    file, or a trial's frames/overhead), or a live camera: its number, device or
    address. Poses are written frame by frame, tracks as soon as a minute has
    passed. Cameras and their calibration come from trial.toml unless given.

    \b
    Example:
        zfcal track trial --overhead day3.mp4 --below day3-below.mp4
        zfcal track trial --overhead 'images/*.png' --corners '20,480 480,480 480,20 20,20'
        zfcal track trial --overhead 0 --below 1 --record jpeg | zfcal analyse -
    """
    from zfcal.stages.track.track import track
    from zfcal.stages.trial_context import Task

    task = Task(dry_run=dry_run, force=force)

    def work() -> None:
        track(trial, track_options(options), out.tell, task=task)
        if trajectories is not None and not dry_run:
            _draw(out, trial, trajectories)

    out.attempt(work)


def _draw(out: Output, trial: Path, path: Path) -> None:
    from zfcal.artifacts.atomic import write_whole
    from zfcal.report.figures.trajectories import draw_trajectories
    from zfcal.stages.track_window import read_tracked
    from zfcal.stages.trial_context import open_trial

    arena = open_trial(trial).arena
    write_whole(path, lambda part: draw_trajectories(arena, read_tracked(trial), part))
    out.note(f"{path}: paths drawn.")

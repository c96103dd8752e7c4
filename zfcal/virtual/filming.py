"""`zfcal simulate --video`: tracks from a model, and what the cameras would have seen of them."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from zfcal.artifacts.models import read_model
from zfcal.artifacts.segments import segment_starts
from zfcal.artifacts.settings import read_trial
from zfcal.stages.events import Event, Planned, Tell
from zfcal.stages.recording import starts_between
from zfcal.stages.simulate import SimulateOptions, new_trial, simulate
from zfcal.stages.trial_context import Task
from zfcal.virtual.film import FilmOptions, camera_names, film, frames_path, photograph_of
from zfcal.virtual.film_export import export_video, exported_paths

_RIG_FPS = 15.0
"""Frame rate of the rig's cameras, in hertz."""


def simulate_on_film(
    root: Path,
    options: SimulateOptions,
    filmed: FilmOptions,
    tell: Tell,
    *,
    task: Task | None = None,
) -> None:
    """Simulate a trial, and draw the camera images of its tracks.

    Parameters
    ----------
    root
        The trial's directory; it is made where there is none, at the rig's frame rate.
    options
        What to simulate.
    filmed
        What to draw.
    tell
        Hears of every file.
    task
        How to go about it.
    """
    task = task or Task()
    new = not (root / "trial.toml").exists()
    # What cannot be drawn is said before anything is simulated.
    photograph_of(filmed)
    video = filmed.video
    if video is not None:
        exported_paths(video, camera_names(1))
    if new and options.fps is None:
        options = dataclasses.replace(options, fps=rig_fps(read_model(options.model).dt_s))
    planned: list[Event] = []

    def listen(event: Event) -> None:
        planned.extend([event] if isinstance(event, Planned) else [])
        tell(event)

    simulate(root, options, listen, task=task)
    if task.dry_run and (planned or not segment_starts(root)):
        _plan(root, options, tell, video=video)
        return
    film(root, filmed, listen, task=task)
    if video is None:
        return
    if planned:
        _plan_video(video, read_trial(root).n_robots, tell)
    else:
        export_video(root, video, tell, task=task)


def rig_fps(dt_s: float) -> float:
    """Return the frame rate nearest to the rig's of which a model's step is a whole number.

    >>> rig_fps(0.2)
    15.0
    """
    return max(1, round(_RIG_FPS * dt_s)) / dt_s


def _plan(root: Path, options: SimulateOptions, tell: Tell, *, video: Path | None) -> None:
    """Tell what would be drawn of tracks that are not there."""
    exists = (root / "trial.toml").exists()
    n_robots = read_trial(root).n_robots if exists else new_trial(root, options).n_robots
    for name in camera_names(n_robots):
        for start in starts_between(0.0, options.duration_s):
            path = frames_path(root, name, start)
            reason = "the tracks are to be made anew" if path.exists() else "missing"
            tell(Planned(path=path, reason=reason))
    if video is not None:
        _plan_video(video, n_robots, tell)


def _plan_video(video: Path, n_robots: int, tell: Tell) -> None:
    for path in exported_paths(video, camera_names(n_robots)).values():
        reason = "the images are to be made anew" if path.exists() else "missing"
        tell(Planned(path=path, reason=reason))

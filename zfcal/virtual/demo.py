"""A whole small trial from nothing: a simulated tank, its camera images, and the main job."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from zfcal.artifacts.atomic import write_text_whole
from zfcal.artifacts.segments import segment_path, segment_starts
from zfcal.artifacts.tables import read_tracks
from zfcal.calibrate.task import Settings
from zfcal.stages.analyse.analyse import AnalyseOptions, analyse
from zfcal.stages.calibrate.calibrate import calibrate
from zfcal.stages.calibrate.searching import CalibrateOptions
from zfcal.stages.camera.rig import BELOW, OVERHEAD, CameraChoice
from zfcal.stages.events import Made, Note, Tell, UpToDate
from zfcal.stages.init import NewTrial, create_trial
from zfcal.stages.recording import starts_between
from zfcal.stages.segments import STEP_S
from zfcal.stages.simulate import SimulateOptions, simulate
from zfcal.stages.track.plan import Pictures, TrackOptions
from zfcal.stages.track.track import track
from zfcal.stages.trial_context import Task
from zfcal.stages.windows import LENGTH_S
from zfcal.tracks import KINDS, Tracks, concatenate
from zfcal.trial import CONFIG_NAME, FIRST_MODEL
from zfcal.virtual.compiling import compiled_beside
from zfcal.virtual.demo_steps import Step, drive_demo, tell_steps
from zfcal.virtual.film import FilmOptions, film, frames_folder, frames_path

DURATION_S = 180.0
FPS = 15.0
_TANK_SEED = 27
"""With this one the fish visit both rooms, and the corridor 9 % of the time, within six minutes."""

_TRIAL_SEED = 1

SETTINGS = Settings(
    population=40, generations=10, steps=1500, n_confirmed=4, long_runs=4, n_windows=100
)
"""A quarter of the default effort: two windows in well under a minute on two cores."""

_HEAD = "time_s,agent,kind,x_m,y_m,heading_rad\n"


def run_demo(folder: Path, tell: Tell, *, task: Task | None = None) -> Path:
    """Make a demonstration trial and do the main job on it.

    Parameters
    ----------
    folder
        Gets ``tank/`` (the simulated truth, and what its cameras saw), ``trial/``
        (everything made from the images) and ``contact-sheet.png`` (the frames with
        which most is wrong).
    tell
        Hears of every file.
    task
        How to go about it. A dry run says of each file whether it would be made.

    Returns
    -------
    Path
        The trial.
    """
    task = task or Task()
    trial = folder / "trial"
    if task.dry_run:
        tell_steps(_steps(folder, tell), tell, task)
        return trial
    with compiled_beside():
        for step in _steps(folder, tell):
            step.work(task)
    tell(
        Note(
            text=f"{trial}: a trial of {DURATION_S:g} s, tracked, analysed, calibrated and driven."
        )
    )
    return trial


def _steps(folder: Path, tell: Tell) -> list[Step]:
    """Return what a demonstration does, in order."""
    tank, trial, sheet = folder / "tank", folder / "trial", folder / "contact-sheet.png"
    new = NewTrial(n_fish=4, n_robots=1, fps=FPS, arena="two-rooms", seed=_TANK_SEED)
    seen = dataclasses.replace(new, seed=_TRIAL_SEED, source="zfcal demo: images of a drawn tank")
    swim = SimulateOptions(model=tank / FIRST_MODEL, duration_s=DURATION_S)
    minutes = starts_between(0.0, DURATION_S)
    truth, tracks = ([segment_path(root, start) for start in minutes] for root in (tank, trial))
    images = [frames_path(tank, name, start) for name in (OVERHEAD, BELOW) for start in minutes]
    poses = [trial / "poses" / f"{start:06d}.mcap" for start in minutes]
    ends = range(LENGTH_S, int(DURATION_S) + 1, STEP_S)
    stats = [trial / "stats" / f"{end:06d}.parquet" for end in ends]
    models = [trial / "models" / f"{end:06d}.toml" for end in ends]
    settings = [[root / FIRST_MODEL, root / CONFIG_NAME] for root in (tank, trial)]
    options = _cameras(tank, sheet)
    calibration = CalibrateOptions(settings=SETTINGS)
    return [
        Step(makes=settings[0], work=lambda task: create_trial(tank, new, tell, task=task)),
        Step(makes=truth, work=lambda task: simulate(tank, swim, tell, task=task)),
        Step(makes=images, work=lambda task: film(tank, FilmOptions(), tell, task=task)),
        Step(makes=settings[1], work=lambda task: create_trial(trial, seen, tell, task=task)),
        Step(
            makes=[*tracks, *poses, sheet],
            work=lambda task: track(trial, options, tell, task=task),
        ),
        Step(makes=stats, work=lambda task: analyse(trial, AnalyseOptions(), tell, task=task)),
        Step(makes=models, work=lambda task: calibrate(trial, calibration, tell, task=task)),
        Step(
            makes=[trial / "drive" / "000000.mcap"],
            work=lambda task: drive_demo(trial, tell, task=task),
        ),
    ]


def _cameras(tank: Path, sheet: Path) -> TrackOptions:
    """Return options that track what the cameras of a drawn tank saw."""
    overhead, below = (
        CameraChoice(source=str(frames_folder(tank, name)), file=tank / "cameras" / f"{name}.toml")
        for name in (OVERHEAD, BELOW)
    )
    return TrackOptions(overhead=overhead, below=below, pictures=Pictures(contact_sheet=sheet))


def export_csv(root: Path, path: Path, tell: Tell) -> None:
    """Write a trial's tracks as CSV, to a tenth of a millimetre, unless it is there.

    Parameters
    ----------
    root
        The trial's directory.
    path
        Where it goes.
    tell
        Hears of it.
    """
    segments = [read_tracks(segment_path(root, start)) for start in segment_starts(root)]
    text = _HEAD + "".join(_lines(concatenate(segments)))
    if path.is_file() and path.read_text(encoding="utf-8") == text:
        tell(UpToDate(path=path))
        return
    reason = "changed" if path.exists() else "missing"
    write_text_whole(path, text)
    tell(Made(path=path, reason=reason))


def _lines(tracks: Tracks) -> list[str]:
    columns = (tracks.time_s, tracks.agent, tracks.kind, tracks.x_m, tracks.y_m, tracks.heading_rad)
    return [
        f"{time_s:.6f},{agent},{KINDS[kind]},{x_m:.4f},{y_m:.4f},{heading_rad:.4f}\n"
        for time_s, agent, kind, x_m, y_m, heading_rad in zip(*columns, strict=True)
    ]

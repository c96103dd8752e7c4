"""A trial of the benchmark through video: drawn as two cameras see it, tracked, diagnosed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from benchmarks.diagnosis import trial
from benchmarks.diagnosis.ledger import Row, fingerprint
from benchmarks.diagnosis.plan import Job
from benchmarks.shared.measuring import ROOT

_CODE = (
    *trial.DIAGNOSIS_CODE,
    "benchmarks/diagnosis/film.py",
    "zfcal/stages",
    "zfcal/virtual",
    "zfcal/tracking",
    "zfcal/cameras",
)


def mark() -> str:
    """Return the fingerprint of the code that bears on the answers."""
    return fingerprint(ROOT, _CODE)


def run(job: Job, nats: dict[str, float] | None) -> Row:
    """Draw a trial, track its images and diagnose the tracks, as `trial.run` has it."""
    return trial.run(job, nats, filmed)


def filmed(folder: Path, made: Any, asked: dict[str, Any]) -> Path:
    """Return a trial directory with the tracks of what two cameras see of a hidden trial.

    Parameters
    ----------
    folder
        An empty one.
    made
        What the second simulator made.
    asked
        Its scenario, in an arena that comes with zfcal.
    """
    from zfcal.stages.camera.rig import BELOW, OVERHEAD, CameraChoice
    from zfcal.stages.init import NewTrial, create_trial
    from zfcal.stages.track.plan import TrackOptions
    from zfcal.stages.track.track import track
    from zfcal.virtual.film import FilmOptions, film, frames_folder

    tank, seen = folder / "tank", folder / "trial"
    trial.lay_out(tank, made, asked)
    film(tank, FilmOptions(), trial.silent)
    new = NewTrial(
        n_fish=asked["n_fish"], n_robots=int(asked["robot"]), fps=asked["fps"],
        arena=asked["arena"], seed=asked["seed"],
    )  # fmt: skip
    create_trial(seen, new, trial.silent)
    overhead, below = (
        CameraChoice(source=str(frames_folder(tank, name)), file=tank / "cameras" / f"{name}.toml")
        for name in (OVERHEAD, BELOW)
    )
    track(seen, TrackOptions(overhead=overhead, below=below), trial.silent)
    return seen

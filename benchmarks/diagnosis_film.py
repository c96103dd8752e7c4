"""A trial of the benchmark through video: drawn as two cameras see it, tracked, diagnosed."""

from __future__ import annotations

import resource
import tempfile
import time
from pathlib import Path
from typing import Any

import diagnosis_trial
from diagnosis_ledger import Row, fingerprint, key_of
from diagnosis_plan import Job
from diagnosis_trial import _DIAGNOSIS, _described, _diagnosed
from measuring import ROOT

_CODE = (*_DIAGNOSIS, "benchmarks/diagnosis_film.py", "zfcal/online", "zfcal/vision")


def mark() -> str:
    """Return the fingerprint of the code that bears on the answers."""
    return fingerprint(ROOT, _CODE)


def run(job: Job, nats: dict[str, float] | None) -> Row:
    """Draw a trial, track its images and diagnose the tracks.

    Parameters
    ----------
    job
        What is asked.
    nats
        What an oracle sees in the true tracks, where it is known; it is counted otherwise.

    Returns
    -------
    dict
        As `diagnosis_trial.run` has it.
    """
    row: Row = {"key": key_of(job.said()), **job.said(), "round": job.round}
    begin = time.perf_counter()
    try:
        with tempfile.TemporaryDirectory(prefix="zfcal-bench-") as folder:
            row |= _answer(job, nats, Path(folder))
    # A trial that fails must not end hours of others; its row says how.
    except Exception as error:  # noqa: BLE001
        row |= {"verdict": "error", "effects": [], "error": _described(error)}
    peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return {**row, "all_s": round(time.perf_counter() - begin, 2), "peak_mb": round(peak_mb)}


def _answer(job: Job, nats: dict[str, float] | None, folder: Path) -> Row:
    from hidden.chain import Chain
    from hidden.scenario import Scenario, make_trial

    from zfcal.online.film import FilmOptions, film, frames_folder
    from zfcal.online.rig import BELOW, OVERHEAD, CameraChoice
    from zfcal.online.setup import NewTrial, create_trial
    from zfcal.online.track import track
    from zfcal.online.track_plan import TrackOptions

    said = job.scenario
    asked = Scenario(**{**said, "chain": Chain(**said["chain"])})
    asks = bool(asked.hidden) and nats is None
    made = make_trial(asked, oracle=asks)
    tank, seen = folder / "tank", folder / "trial"
    diagnosis_trial.lay_out(tank, made, said)
    film(tank, FilmOptions(), _silent)
    new = NewTrial(
        n_fish=said["n_fish"], n_robots=int(said["robot"]), fps=said["fps"], arena=said["arena"],
        seed=said["seed"],
    )  # fmt: skip
    create_trial(seen, new, _silent)
    overhead, below = (
        CameraChoice(source=str(frames_folder(tank, name)), file=tank / "cameras" / f"{name}.toml")
        for name in (OVERHEAD, BELOW)
    )
    track(seen, TrackOptions(overhead=overhead, below=below), _silent)
    return {
        "truth": list(asked.hidden),
        "strengths": made.truth["effects"],
        "nats": made.oracle_nats if asks else nats,
        **_diagnosed(seen, job),
    }


def _silent(_event: Any) -> None:
    """Take no notice."""

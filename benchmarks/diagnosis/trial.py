"""One trial of the benchmark of the diagnosis: hidden, written down, imported, diagnosed.

The second simulator under ``tests/hidden`` makes the tracks; everything after that goes the
way of the commands, from `zfcal init` to `zfcal extend`.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

from benchmarks.diagnosis.ledger import Row, fingerprint, key_of
from benchmarks.diagnosis.plan import EXTEND, NULLS, TIME, Job, scenario
from benchmarks.shared.measuring import ROOT
from zfcal.errors import ZfcalError

TESTS = ROOT / "tests"
if str(TESTS) not in sys.path:
    sys.path.append(str(TESTS))

GENERATIONS = 30
"""Of each calibration of an extension."""

ORACLE = "oracle"
"""Section of the rows that hold what an oracle sees."""

Measure = Callable[[Path, Any, dict[str, Any]], Path]
"""Makes a trial directory with tracks in an empty folder, of what was made for a scenario."""

_SCREENED = 3
_WARMING_SEED = 9000

_HIDDEN = ("tests/hidden",)
DIAGNOSIS_CODE = (
    *_HIDDEN,
    "benchmarks/diagnosis/trial.py",
    "zfcal/diagnose",
    "zfcal/model",
    "zfcal/behaviour",
    "zfcal/arenas",
    "zfcal/arena.py",
    "zfcal/parameters.py",
    "zfcal/tracks.py",
    "zfcal/stages/diagnose/diagnose.py",
    "zfcal/stages/track_window.py",
    "zfcal/stages/import_.py",
    "zfcal/readers",
)
_EXTENSION = (*DIAGNOSIS_CODE, "zfcal/stages", "zfcal/calibrate")


def marks(sections: tuple[str, ...]) -> dict[str, str]:
    """Return the fingerprint of the code that bears on the answers of each section."""
    diagnosis, extension = fingerprint(ROOT, DIAGNOSIS_CODE), fingerprint(ROOT, _EXTENSION)
    made = {section: extension if section == EXTEND else diagnosis for section in sections}
    return {**made, ORACLE: fingerprint(ROOT, _HIDDEN)}


def oracle_said(asked: dict[str, Any]) -> dict[str, Any]:
    """Return what decides about the oracle's nats of a scenario: not what the tracker does."""
    return {key: value for key, value in asked.items() if key not in {"chain", "fps"}}


def tabled(folder: Path, made: Any, asked: dict[str, Any]) -> Path:
    """Return a trial directory with the tracks of a hidden trial, imported from a table.

    Parameters
    ----------
    folder
        An empty one.
    made
        What the second simulator made.
    asked
        Its scenario.
    """
    root = folder / "trial"
    lay_out(root, made, asked)
    return root


def run(job: Job, nats: dict[str, float] | None, measure: Measure = tabled) -> Row:
    """Make a trial and diagnose it.

    Parameters
    ----------
    job
        What is asked.
    nats
        What an oracle sees in the true tracks, where it is known; it is counted otherwise.
    measure
        How tracks come from what was made; from a table if not said.

    Returns
    -------
    dict
        What was asked and what came out; the verdict is ``error`` where it failed.
    """
    row: Row = {"key": key_of(job.said()), **job.said(), "round": job.round}
    begin = time.perf_counter()
    try:
        with tempfile.TemporaryDirectory(prefix="zfcal-bench-") as folder:
            row |= _answer(job, nats, Path(folder), measure)
    # A trial that fails must not end hours of others; its row says how.
    except Exception as error:  # noqa: BLE001
        row |= {"verdict": "error", "effects": [], "error": _described(error)}
    # In kilobytes, of this process so far.
    peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return {**row, "all_s": round(time.perf_counter() - begin, 2), "peak_mb": round(peak_mb)}


def warm_up() -> None:
    """Load all compiled code by way of a short trial, so that no time measured holds that."""
    asked = scenario(_WARMING_SEED, minutes=2.0)
    run(Job(section=NULLS, kind="plain", round=0, scenario=asked, quick=True), None)


def _described(error: Exception) -> str:
    if isinstance(error, ZfcalError):
        return f"{type(error).__name__}: {error}"
    where = traceback.extract_tb(error.__traceback__)[-1]
    return f"{type(error).__name__}: {error} ({Path(where.filename).name}:{where.lineno})"


def _answer(job: Job, nats: dict[str, float] | None, folder: Path, measure: Measure) -> Row:
    from hidden.chain import Chain
    from hidden.further import FORMS, name_of
    from hidden.scenario import Scenario, make_trial

    asked = Scenario(**{**job.scenario, "chain": Chain(**job.scenario["chain"])})
    asks = bool(asked.hidden) and nats is None
    made = make_trial(asked, oracle=asks)
    root = measure(folder, made, job.scenario)
    row: Row = {
        "truth": [name_of(key) for key in asked.hidden],
        "forms": list(asked.hidden),
        "also": [name for key in asked.hidden for name in FORMS[key].also],
        "strengths": made.truth["effects"],
        "nats": made.oracle_nats if asks else nats,
    }
    row |= _diagnosed(root, job)
    if job.section == EXTEND:
        row |= _extended(root)
    if job.section == TIME:
        row |= {"command_s": _commanded(root, job)}
    return row


def lay_out(root: Path, made: Any, asked: dict[str, Any]) -> None:
    """Make a trial directory and import the tracks of a hidden trial.

    Parameters
    ----------
    root
        Of the directory.
    made
        What the second simulator made.
    asked
        Its scenario.
    """
    from hidden.scenario import write_csv
    from hidden.worlds import geojson_of, tank_of

    from zfcal.stages.import_ import Source, import_tracks
    from zfcal.stages.init import NewTrial, create_trial

    root.mkdir()
    arena, table = asked["arena"], root.parent / "tracks.csv"
    if arena != "two-rooms":
        place = root.parent / f"{arena}.geojson"
        place.write_text(json.dumps(geojson_of(tank_of(arena))), encoding="utf-8")
        arena = str(place)
    new = NewTrial(
        n_fish=asked["n_fish"], n_robots=int(asked["robot"]), fps=asked["fps"],
        arena=arena, seed=asked["seed"],
    )  # fmt: skip
    create_trial(root, new, silent)
    write_csv(made, table)
    import_tracks(root, Source(path=table, format="csv", options={}), silent)


def silent(_event: object) -> None:
    """Take no notice."""


def _diagnosed(root: Path, job: Job) -> Row:
    """Return what ``zfcal diagnose`` says of a trial, and what that took."""
    from zfcal.stages.diagnose.diagnose import DiagnoseOptions, diagnose

    options = DiagnoseOptions(quick=job.quick, n_workers=job.workers)
    path, wall_s, cpu_s = _timed(lambda: diagnose(root, options, silent))
    document = json.loads(path.read_text(encoding="utf-8"))
    return {**_said(document), "wall_s": wall_s, "cpu_s": cpu_s}


def _commanded(root: Path, job: Job) -> float:
    """Return the wall-clock time of the command from nothing to its page, in seconds."""
    program = Path(sys.executable).with_name("zfcal")
    asked = ["--force", "--quiet", "--workers", str(job.workers), *(["--quick"] * job.quick)]
    words = [str(program), "diagnose", str(root), *asked]
    return _timed(lambda: subprocess.run(words, check=True, stdout=subprocess.DEVNULL))[1]


def _timed(call: Callable[[], Any]) -> tuple[Any, float, float]:
    """Return what a call returns, and its wall-clock and processor time in seconds."""
    wall, cpu = time.perf_counter(), time.process_time()
    found = call()
    return found, round(time.perf_counter() - wall, 3), round(time.process_time() - cpu, 3)


def _said(document: dict[str, Any]) -> Row:
    """Return what is kept of ``findings.json``."""
    notes = {note["name"]: note.get("values", {}) for note in document.get("notes", [])}
    asked = [each for each in document["screened"] if each["z"] is not None]
    ranked = sorted(asked, key=lambda each: -abs(each["z"]))
    keys = ("name", "ties", "strength", "interval", "gain_nats_per_step", "p")
    return {
        "verdict": document["verdict"],
        "effects": [{key: effect[key] for key in keys} for effect in document["effects"]],
        "screened": [{key: each[key] for key in ("name", "z", "p")} for each in ranked[:_SCREENED]],
        "z_of": {each["name"]: each["z"] for each in asked},
        "omnibus_p": notes.get("omnibus", {}).get("p"),
        "noise_m": notes.get("noise", {}).get("noise_m"),
        "replicates": notes.get("null", {}).get("replicates"),
        "n_steps": document.get("details", {}).get("n_steps"),
    }


def _extended(root: Path) -> Row:
    """Return what ``zfcal extend`` says of a trial that was diagnosed, and what that took."""
    from zfcal.calibrate.task import Settings
    from zfcal.stages.calibrate.searching import CalibrateOptions
    from zfcal.stages.extend.extend import ExtendOptions, extend

    settings = Settings(generations=GENERATIONS)
    options = ExtendOptions(calibration=CalibrateOptions(settings=settings, n_workers=1))
    path, wall_s, cpu_s = _timed(lambda: extend(root, options, silent))
    findings = json.loads((root / "diagnosis" / "findings.json").read_text(encoding="utf-8"))
    return {
        "extended": path is not None,
        "gap": findings.get("gap", []),
        "extend_wall_s": wall_s,
        "extend_cpu_s": cpu_s,
    }

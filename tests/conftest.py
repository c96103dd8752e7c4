"""What all tests share: real recordings, how hypothesis runs, and what is compiled before."""

import gc
import importlib.util
import math
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import settings

from zfcal.diagnose.findings import (
    Diagnosis,
    EffectFound,
    Located,
    Note,
    Screened,
    Trace,
    Verdict,
)

REPOSITORY = Path(__file__).resolve().parents[1]

HALVES = ("", "slow", "not slow")

# The first call of a kernel compiles it, which no deadline allows for.
settings.register_profile("zfcal", deadline=None)
settings.register_profile("zfcal-ci", deadline=None, derandomize=True, print_blob=True)
settings.load_profile("zfcal-ci" if os.environ.get("CI") else "zfcal")


def pytest_configure(config):
    """Prepare for workers; compile the kernels before, when the whole suite was asked for.

    With an empty cache each worker would otherwise compile the same ones at the same time.
    What fails here fails once more in a test, which says what it is about.
    """
    # A shell lets what it starts in the background ignore Ctrl-C, and so would what tests start.
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    config.pluginmanager.register(_module("wandering"), "wandering")
    if config.getoption("numprocesses", None):
        # For the workers, and what they start: they are side by side already, and threads that
        # wait for a matrix of ten rows take the processor from the other worker.
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    option = config.option
    # The slow ones, and the others, are halves of the whole: what make asks for.
    is_part = option.keyword or option.markexpr not in HALVES or option.collectonly
    is_whole = config.args_source is pytest.Config.ArgsSource.TESTPATHS and not is_part
    if not is_whole or not config.getoption("numprocesses", None):
        return
    script = Path(__file__).with_name("warming.py")
    started = [
        subprocess.Popen([sys.executable, script, part], cwd=REPOSITORY)
        for part in ("simulator", "observer", "tracker")
    ]
    for process in started:
        process.wait()


def pytest_collection_modifyitems(items):
    """Leave out what needs a real robot or camera, unless it is asked for."""
    if os.environ.get("ZFCAL_HARDWARE") == "1":
        return
    skip = pytest.mark.skip(reason="talks to real hardware; set ZFCAL_HARDWARE=1 to run it")
    for item in items:
        if "hardware" in item.keywords:
            item.add_marker(skip)


def pytest_collection_finish():
    """Do not search what is loaded by now for garbage again and again, which takes time."""
    gc.collect()
    gc.freeze()


@pytest.fixture(scope="session")
def repository():
    """Return the root of the source tree."""
    return REPOSITORY


@pytest.fixture(scope="session")
def examine():
    """Return what lists the problems of an MCAP file, as `mcap doctor` would."""
    return _module("artifacts/doctor").examine


@pytest.fixture(scope="session")
def shared_data():
    """Return the folder of real recordings, or skip: they are no part of the project."""
    asked = os.environ.get("ZFCAL_SHARED_DATA")
    folder = Path(asked) if asked else REPOSITORY.parent / "shared" / "data"
    if not folder.is_dir():
        pytest.skip(f"no real recordings at {folder}; ZFCAL_SHARED_DATA names another place")
    return folder.resolve()


@pytest.fixture(scope="session")
def recording():
    """Return what finds a recording by its name, or skips; `make real-data` brings two."""
    places = [os.environ.get("ZFCAL_SHARED_DATA"), REPOSITORY.parent / "shared" / "data"]
    folders = [Path(place) for place in places if place] + [REPOSITORY / "real-data"]

    def find(name):
        for folder in folders:
            if (folder / name).is_dir():
                return (folder / name).resolve()
        return pytest.skip(f"no recording {name!r} in {', '.join(map(str, folders))}")

    return find


@pytest.fixture(scope="session")
def debian():
    """Return the module whose `need` finds what a Debian package brings, or skips."""
    return _module("debian")


@pytest.fixture(scope="session")
def browsing():
    """Return the module whose `Browser` is a headless Chromium that a test drives."""
    return _module("browsing")


@pytest.fixture(scope="session")
def forking():
    """Return the module whose `Forks` runs commands that a test kills at work."""
    return _module("forks")


@pytest.fixture(scope="session")
def briefly():
    """Return an environment in which each process of Python has brief rounds (`brief.py`)."""
    here = str(REPOSITORY / "tests" / "briefly")
    found = [here, os.environ.get("PYTHONPATH")]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, found))}


@pytest.fixture(scope="module")
def brief_zfcal(briefly, tmp_path_factory):
    """Return a shell's words for a zfcal that is loaded, and whose rounds are brief."""
    place = tmp_path_factory.mktemp("serving")
    with _module("serving").Serving(place, briefly) as served:
        yield served.words


@pytest.fixture(scope="session")
def streaming():
    """Return the module whose `Camera` serves images over HTTP in real time."""
    return _module("streaming")


@pytest.fixture(scope="session")
def drawn_tank():
    """Return the module that draws frames of fish whose positions are known."""
    return _module("tracking/drawn_tank")


def _module(name):
    spec = importlib.util.spec_from_file_location(name, REPOSITORY / "tests" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def _trace(arena, rng, *, n=4000, minutes=10.0):
    """Return an effect's statistic, large near the left wall and gone once it is added."""
    x0, y0, x1, y1 = arena.outline.bounds
    places = rng.uniform((x0, y0), (x1, y1), (4 * n, 2))
    places = places[arena.zone_of(places) > 0][:n]
    here = 1.0 - (places[:, 0] - x0) / (x1 - x0)
    cue = np.linspace(0.02, 0.3, 12)
    return Trace(
        time_s=np.sort(rng.uniform(0, 60 * minutes, n)),
        x_m=places[:, 0],
        y_m=places[:, 1],
        track=rng.integers(0, 4, n).astype(np.int32),
        before=rng.normal(0.4 * here, 1.0),
        after=rng.normal(0.0, 1.0, n),
        cue=cue,
        observed=0.4 + 0.5 * np.exp(-cue / 0.1),
        expected_before=np.full(12, 0.55),
        expected_after=0.4 + 0.48 * np.exp(-cue / 0.1),
        cue_name="distance of the nearest neighbour (m)",
        response_name="alignment (cosine)",
    )


@pytest.fixture(scope="session")
def make_diagnosis():
    """Return what makes a diagnosis up by hand; keywords replace parts of it."""

    def make(arena, model, *, names=("alignment",), **changes):
        rng = np.random.default_rng(1)
        effects = tuple(
            EffectFound(
                name=name,
                says=f"Fish show {name} < as the sentence says & more.",
                strength={"weight": 12.5, "kappa": 8.0},
                interval={"weight": (9.0, 16.0), "kappa": (3.0, math.nan)},
                gain_nats_per_step=0.0123,
                gain_se=0.002,
                p=0.00001,
                trace=_trace(arena, rng),
            )
            for name in names
        )
        screened = (
            Screened(name="alignment", z=14.2, p=1e-12, shape={"kappa": 12.0}),
            Screened(name="group-cohesion", z=-3.1, p=0.2),
            Screened(name="turning-bias", z=0.4, p=0.9),
            Screened(
                name="leader-following", z=math.nan, p=1.0, lacks="tracks of 60 s under one id"
            ),
            Screened(name="robot-avoidance", z=math.nan, p=1.0, lacks="a robot"),
            Screened(name="boldness", z=0.4, p=1.0, minutes_needed=45.0),
        )
        where = (
            Located(
                statistic="alignment",
                zone=arena.zone_names[0],
                time_s=(0.0, 300.0),
                agents=(1, 3),
                observed=0.61,
                expected=0.52,
                z=7.9,
                q=1e-6,
            ),
            Located(
                statistic="turning",
                zone=None,
                time_s=(0.0, 600.0),
                agents=None,
                observed=0.31,
                expected=0.33,
                z=-3.4,
                q=0.02,
            ),
        )
        known = {
            "verdict": Verdict.NAMED if names else Verdict.NO_EFFECT,
            "where": where,
            "effects": effects,
            "screened": screened,
            "notes": (
                Note(name="noise", says="Positions are noisy.", values={"sd_mm": 0.5}),
                Note(name="omnibus", says="Nothing else stands out.", values={"p": math.nan}),
            ),
            "base": model,
            "extended": model,
            "minutes": 10.0,
            "n_steps": 4000,
        }
        return Diagnosis(**{**known, **changes})

    return make


@pytest.fixture
def set_clock(tmp_path, monkeypatch, debian):
    """Return a function that sets the clock of processes started from now on, such as +3600 s.

    Their steady clock stays as it is, as it does where somebody sets a computer's time.
    """
    library = debian.need("faketime")
    step = tmp_path / "step"
    step.write_text("+0")
    monkeypatch.setenv("LD_PRELOAD", str(library))
    monkeypatch.setenv("FAKETIME_TIMESTAMP_FILE", str(step))
    # Looked up once a second: the library is not safe where many threads look at once.
    monkeypatch.setenv("FAKETIME_CACHE_DURATION", "1")
    monkeypatch.setenv("FAKETIME_DONT_FAKE_MONOTONIC", "1")
    return step.write_text

"""Trials made by hand, without the model: fish that wander in a square tank.

The fixtures are there for all tests: `conftest.py` registers this module as a plugin.
"""

import dataclasses
import functools
import os
import shutil
import subprocess
import sys

import numpy as np
import pytest

from zfcal.artifacts.lineage import Lineage
from zfcal.artifacts.tables import write_tracks
from zfcal.calibrate.task import Settings
from zfcal.stages.calibrate.searching import CalibrateOptions
from zfcal.stages.events import say_nothing
from zfcal.stages.init import NewTrial, create_trial
from zfcal.tracks import FISH, ROBOT, Tracks


def wander(seconds, *, fps=5.0, n_fish=3, n_robots=0, seed=1):
    """Return tracks of agents that wander between 0.05 and 0.95 m in both coordinates."""
    rng = np.random.default_rng(seed)
    n_frames, n_agents = round(seconds * fps), n_fish + n_robots
    steps = rng.normal(0, 0.02, size=(n_frames, n_agents, 2)).cumsum(axis=0)
    # A triangle wave keeps a walk inside without sticking to the wall.
    phase = (steps + rng.random((n_agents, 2))) % 1.8
    xy_m = 0.05 + np.where(phase > 0.9, 1.8 - phase, phase)
    frame = np.repeat(np.arange(n_frames), n_agents)
    kind = np.where(np.arange(n_agents) < n_fish, FISH, ROBOT).astype(np.int8)
    return Tracks(
        time_s=frame / fps,
        frame=frame,
        agent=np.tile(np.arange(n_agents, dtype=np.int32), n_frames),
        kind=np.tile(kind, n_frames),
        x_m=xy_m[..., 0].ravel(),
        y_m=xy_m[..., 1].ravel(),
        heading_rad=np.full(n_frames * n_agents, np.nan, dtype=np.float32),
        confidence=np.ones(n_frames * n_agents, dtype=np.float32),
    )


def put_tracks(root, tracks):
    """Write tracks as the closed segments of a trial, as any tracker might."""
    for start in range(0, int(tracks.time_s[-1]) + 1, 60):
        rows = (tracks.time_s >= start) & (tracks.time_s < start + 60)
        lineage = Lineage(schema="zfcal.tracks/1", command="track")
        write_tracks(root / "tracks" / f"{start:06d}.parquet", tracks.take(rows), lineage)


@pytest.fixture(scope="session")
def made_once(tmp_path_factory):
    """Return what makes a trial of wandering fish; of the same fish there is one."""
    place = tmp_path_factory.mktemp("wandering")

    @functools.cache
    def make(seconds, n_fish, n_robots, seed):
        root = place / f"{seconds}-{n_fish}-{n_robots}-{seed}"
        new = NewTrial(n_fish=n_fish, n_robots=n_robots, fps=5.0, side_m=1.0, seed=seed)
        create_trial(root, new, say_nothing)
        put_tracks(root, wander(seconds, n_fish=n_fish, n_robots=n_robots, seed=seed))
        return root

    return make


@pytest.fixture
def make_trial(tmp_path, made_once):
    """Return what makes a trial of wandering fish in a square tank, 5 Hz."""

    def make(name="trial", *, seconds=240, n_fish=3, n_robots=0, seed=1):
        return shutil.copytree(made_once(seconds, n_fish, n_robots, seed), tmp_path / name)

    return make


@pytest.fixture(scope="session")
def wandering():
    """Return the function that makes tracks."""
    return wander


@pytest.fixture
def heard():
    """Return a list that hears every event: pass its ``append``."""
    return []


@pytest.fixture
def quick():
    """Return options under which a round takes a moment: it has no estimate of the likelihood."""
    settings = Settings(
        population=8,
        generations=3,
        steps=40,
        n_confirmed=2,
        long_runs=1,
        long_s=20.0,
        n_windows=4,
    )
    return CalibrateOptions(settings=settings, seed_likelihood=False)


@pytest.fixture
def in_full(quick):
    """Return options of a round that has the estimate."""
    return dataclasses.replace(quick, seed_likelihood=True)


@pytest.fixture
def read_all():
    """Return what reads every file of a trial but dot-files, by its name."""

    def read(root):
        files = (path for path in root.rglob("*") if path.is_file())
        return {
            path.relative_to(root).as_posix(): path.read_bytes()
            for path in files
            if not path.name.startswith(".")
        }

    return read


@pytest.fixture
def copy_trial(tmp_path):
    """Return what copies a trial to another name beside it."""

    def copy(root, name):
        return shutil.copytree(root, tmp_path / name)

    return copy


@pytest.fixture(scope="session")
def granted():
    """Return what tells the niceness that this user gets for the one asked for: of another process.

    Without the right (root, or `ulimit -e`) it is the present one. Who runs CI (where ``CI`` is
    set) as root has the right, or the test fails.
    """

    def of(niceness):
        asks = f"import os; os.setpriority(os.PRIO_PROCESS, 0, {niceness})"
        done = subprocess.run([sys.executable, "-c", asks], capture_output=True, check=False)
        if done.returncode == 0:
            return niceness
        assert not (os.environ.get("CI") and os.geteuid() == 0), (
            "CI runs as root, without the right"
        )
        return os.getpriority(os.PRIO_PROCESS, 0)

    return of

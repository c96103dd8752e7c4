"""Commands, in this process and as processes of their own."""

import contextlib
import importlib.util
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import pytest

from zfcal.calibrate.task import Settings
from zfcal.stages.diagnose.diagnose import KnownNoise
from zfcal_cli.main import run

BRIEF = Path(__file__).resolve().parents[1] / "brief.py"
COMMAND = [sys.executable, str(BRIEF)]
"""Words that start zfcal, with rounds that take a moment."""


@dataclass(frozen=True)
class Outcome:
    """What a command left: its exit code, and what it wrote where."""

    code: int
    out: str
    err: str

    @property
    def lines(self):
        """The lines of standard output."""
        return self.out.splitlines()


@pytest.fixture(scope="module", autouse=True)
def brief():
    """Let rounds in this process be as short as those of `COMMAND`."""
    spec = importlib.util.spec_from_file_location("brief", BRIEF)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    with pytest.MonkeyPatch.context() as patch:
        for name, value in module.LESS.items():
            patch.setitem(Settings.__init__.__kwdefaults__, name, value)
        yield


@pytest.fixture
def zfcal(capsys, monkeypatch, tmp_path):
    """Run a command in this process, standing in an empty folder."""
    monkeypatch.chdir(tmp_path)

    def call(*argv):
        capsys.readouterr()
        code = run([str(word) for word in argv])
        captured = capsys.readouterr()
        return Outcome(code, captured.out, captured.err)

    return call


@pytest.fixture(scope="session")
def command():
    """Return the words that start zfcal as a process."""
    return COMMAND


@pytest.fixture
def process(tmp_path):
    """Run a command as a process of its own, without a terminal, in an empty folder."""

    def call(*argv, stdin=None, env=None):
        done = subprocess.run(
            [*COMMAND, *map(str, argv)],
            cwd=tmp_path,
            input=stdin,
            stdin=subprocess.DEVNULL if stdin is None else None,
            capture_output=True,
            text=True,
            timeout=120,
            check=False,
            env=os.environ | (env or {}),
        )
        return Outcome(done.returncode, done.stdout, done.stderr)

    return call


@pytest.fixture
def tracks_csv(tmp_path, write_tracks):
    """Return what writes such tracks into the folder of the test."""

    def write(name="tracks.csv", *, seconds=200, seed=1):
        return write_tracks(tmp_path / name, seconds=seconds, seed=seed)

    return write


@pytest.fixture(scope="session")
def write_tracks():
    """Write the tracks of 3 fish and a robot that wander in a square metre, 5 Hz, as CSV."""

    def write(path, *, seconds=200, seed=1):
        rng = np.random.default_rng(seed)
        n = round(seconds * 5)
        steps = rng.normal(0, 0.02, size=(n, 4, 2)).cumsum(axis=0)
        phase = (steps + rng.random((4, 2))) % 1.8
        xy_m = 0.05 + np.where(phase > 0.9, 1.8 - phase, phase)
        lines = ["time_s,agent,kind,x_m,y_m"]
        for frame in range(n):
            for agent in range(4):
                kind = "robot" if agent == 3 else "fish"
                x, y = xy_m[frame, agent]
                lines.append(f"{frame / 5:.1f},{agent},{kind},{x:.4f},{y:.4f}")
        path.write_text("\n".join(lines) + "\n")
        return path

    return write


@pytest.fixture(scope="session")
def write_film(drawn_tank):
    """Return what writes a video at 5 Hz: three bodies on a circle, 24 s a round."""

    def write(path, *, seconds):
        paths = drawn_tank.circling(120, turn=2 * np.pi / 120)
        images = [frame.image for frame in drawn_tank.frames(paths)]
        code = cv2.VideoWriter.fourcc(*"FFV1")
        writer = cv2.VideoWriter(str(path), code, 5.0, (200, 200), isColor=False)
        for k in range(5 * seconds):
            writer.write(images[k % 120])
        writer.release()
        return path

    return write


@pytest.fixture
def trial(tmp_path, tracks_csv, monkeypatch):
    """Return a trial of 200 s in a square metre, imported; the test stands beside it."""
    monkeypatch.chdir(tmp_path)
    tracks_csv()
    words = ["trial", "--side-m", "1", "--fish", "3", "--robot", "--fps", "5", "-q"]
    assert run(["init", *words]) == 0
    assert run(["import", "tracks.csv", "trial", "--format", "csv", "-q"]) == 0
    return tmp_path / "trial"


class WatchTools:
    """What tests of watch need."""

    def __init__(self, module):
        self._module = module
        self.quick = module.QUICK
        self.contents = module.contents

    def no_error(self):
        """Return a block in which a process that is gone, or a full disk, is no error."""
        return contextlib.suppress(OSError, TypeError)

    def start(self, *words, **options):
        """Start ``zfcal watch --json``; leaving its block kills it."""
        return self._module.Watching(COMMAND, *words, **options)


@pytest.fixture(scope="session")
def watching(repository):
    """Return what starts a watch and reads its lines."""
    path = repository / "tests" / "watching.py"
    spec = importlib.util.spec_from_file_location("watching", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return WatchTools(module)


@pytest.fixture
def plain(monkeypatch):
    """Have diagnoses take the noise as it is stated, and draw nothing."""
    monkeypatch.setattr(
        "zfcal.stages.diagnose.diagnose._estimate",
        lambda _case, _stretch, stated_m, source: KnownNoise(sd_m=stated_m, source=source),
    )
    monkeypatch.setattr(
        "zfcal.report.diagnosis.drawing.png_of", lambda picture: picture.title.encode()
    )
    monkeypatch.setattr("zfcal.report.render.panel_svg", lambda *_: "<svg></svg>")
    # Processes of their own would draw all the same.
    monkeypatch.setattr("zfcal.report.diagnosis.render_pool.RenderPool.prepare", lambda _pool: None)

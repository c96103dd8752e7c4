"""Every kind of file of a trial x every kind of badness x every command that reads it.

Whatever lies there, a command ends in time, without a traceback, with one of its exit
codes, and has touched nothing outside the trial.
"""

import math
import os
import shutil
import signal
import socket
from contextlib import contextmanager
from pathlib import Path

import pytest

from zfcal.artifacts.atomic import write_bytes_whole
from zfcal.artifacts.lineage import Lineage
from zfcal.artifacts.pose_files import PoseWriter
from zfcal.artifacts.pose_messages import POSES
from zfcal.artifacts.settings import name_camera
from zfcal.report import gather, page
from zfcal.report.figures import arena as arena_figure
from zfcal.stages.diagnose.diagnose import KnownNoise
from zfcal.stages.extend import extend
from zfcal.stages.stage import Draft
from zfcal.tracks import FISH, AgentPose, FramePoses
from zfcal_cli.main import run

pytestmark = pytest.mark.slow

PATIENCE_S = 60
"""A command on such a trial takes a second; one that waits for a pipe takes for ever."""

FILES = (
    "trial.toml",
    "arena.geojson",
    "models/000000.toml",
    "models/000120.toml",
    "models/000120.parquet",
    "models/000180.skipped.json",
    "models/extended.toml",
    "models/.000120.checkpoint",
    "tracks/000120.parquet",
    "stats/000120.parquet",
    "scores/000120.parquet",
    "scores/000120-model.parquet",
    "poses/000060.mcap",
    "frames/overhead/000000.mcap",
    "cameras/overhead.toml",
    "drive/000000.mcap",
    "diagnosis/findings.json",
    "report/index.html",
    ".lock-analyse",
    ".lock-calibrate",
    ".lock-diagnose",
    ".lock-track",
)
FOLDERS = ("tracks", "stats", "scores", "models", "poses", "report", "drive", "diagnosis")


def _special(make):
    def spoil(path, outside):
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path)
        path.unlink(missing_ok=True)
        make(path, outside)

    return spoil


def _bytes(of):
    def spoil(path, _):
        data = path.read_bytes() if path.exists() else b""
        path.unlink(missing_ok=True)
        path.write_bytes(of(data))

    return spoil


def _socket(path, _):
    end = socket.socket(socket.AF_UNIX)
    # Its name may have no more than 107 bytes.
    with _standing_in(path.parent):
        end.bind(path.name)
    end.close()


def _within(path, _):
    """Let the file lie elsewhere in the trial, as people do to save room."""
    elsewhere = path.with_name(f"elsewhere-{path.name.strip('.')}")
    elsewhere.touch()
    path.symlink_to(elsewhere.name)


def _huge(path, _):
    with path.open("wb") as file:
        file.truncate(11 * 10**8)


@contextmanager
def _standing_in(folder):
    here = Path.cwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(here)


BADNESS = {
    "absent": _special(lambda *_: None),
    "empty": _bytes(lambda _: b""),
    "cut": _bytes(lambda data: data[: len(data) // 2]),
    "noise": _bytes(lambda data: bytes(range(256)) * 8 + data),
    "middle": _bytes(lambda data: data[: len(data) // 3] + b"\xff" * 40 + data[len(data) // 3 :]),
    "zeros": _bytes(lambda data: bytes(len(data))),
    "brackets": _bytes(lambda _: b"a = " + b"[" * 100_000),
    "braces": _bytes(lambda _: b'{"a":' * 100_000),
    "long number": _bytes(lambda data: b"n_fish = " + b"9" * 5001 + b"\n" + data),
    "large number": _bytes(lambda data: data.replace(b"1", b"1" + b"0" * 30, 1)),
    "nan": _bytes(lambda data: _numbers(data, b"nan")),
    "infinite": _bytes(lambda data: _numbers(data, b"inf")),
    "far": _bytes(lambda data: _numbers(data, b"1e308")),
    "folder": _special(lambda path, _: path.mkdir()),
    "pipe": _special(lambda path, _: os.mkfifo(path)),
    "socket": _special(_socket),
    "dangling": _special(lambda path, _: path.symlink_to("nowhere")),
    "loop": _special(lambda path, _: path.symlink_to(path.name)),
    "outside": _special(lambda path, outside: path.symlink_to(outside / "file")),
    "device": _special(lambda path, _: path.symlink_to("/dev/zero")),
    "within": _special(_within),
    "huge": _special(_huge),
}
OF_FOLDERS = {
    "pipe": BADNESS["pipe"],
    "file": _special(lambda path, _: path.write_bytes(b"x")),
    "loop": BADNESS["loop"],
    "dangling": BADNESS["dangling"],
    "outside": _special(lambda path, outside: path.symlink_to(outside)),
}
QUICK = ("--generations", "1", "--population", "4", "--steps", "20", "--seed", "1")
LEAST = ("--generations", "0", "--population", "4", "--workers", "1")
MODEL = "trial/models/000120.toml"
IMAGES = "trial/frames/overhead"
COMMANDS = {
    "analyse": ("analyse", "trial", "--force"),
    "calibrate": ("calibrate", "trial", "--force", *QUICK, "--no-seed-likelihood"),
    "estimate": ("calibrate", "trial", "--dry-run", *QUICK),
    "report": ("report", "trial", "--force"),
    "diagnose": ("diagnose", "trial", "--force", "--workers", "1"),
    "extend": ("extend", "trial", "--effect", "turning-bias", "--force", *LEAST),
    "track": ("track", "trial", "--overhead", IMAGES, "--robot-as-fish", "--dark", "--force"),
    "check": ("check", "trial"),
    "simulate": ("simulate", "new", "--model", MODEL, "--duration", "1min", "-n"),
    "replay": ("drive", "trial", "--replay"),
    "inspect": ("inspect",),
}
"""What follows ``zfcal``; `inspect` is given the very file."""

LOOKING = ("check", "inspect", "estimate", "simulate", "replay")
"""Those that leave a trial as it is."""

READ_BY = {
    "trial.toml": ("analyse", "calibrate", "report", "diagnose", "extend", "track", "replay"),
    "arena.geojson": ("analyse", "calibrate", "report", "diagnose", "extend", "track"),
    "tracks": ("analyse", "estimate", "report", "diagnose", "extend", "track"),
    "stats": ("analyse", "calibrate", "report"),
    "scores": ("analyse", "calibrate", "report"),
    "models": ("calibrate", "report", "simulate", "diagnose", "extend"),
    "models/.000120.checkpoint": ("calibrate",),
    "poses": ("track",),
    "frames": ("track",),
    "cameras": ("track",),
    "drive": ("replay",),
    "diagnosis": ("report", "diagnose", "extend"),
    "report": ("report",),
    ".lock-analyse": ("analyse",),
    ".lock-calibrate": ("calibrate",),
    ".lock-diagnose": ("diagnose",),
    ".lock-track": ("track",),
}
"""By folder or file, besides `check` and `inspect`."""


def readers_of(name):
    """Return the commands that read a file, first those that leave the trial as it is."""
    own = READ_BY.get(name, READ_BY.get(name.partition("/")[0], ()))
    return sorted(("check", "inspect", *own), key=lambda command: command not in LOOKING)


def _numbers(data, word):
    """Put a word in place of the first number with a point, as people and tables write it."""
    head, sep, rest = data.partition(b".")
    begin = len(head) - len(head[::-1].lstrip(b"0123456789"[::-1])) if sep else 0
    start = len(head) - begin
    tail = rest.lstrip(b"0123456789")
    return head[:start] + word + tail if sep and begin else data


@pytest.fixture(scope="module")
def template(tmp_path_factory, write_tracks):
    """Return a trial with an artifact of every kind."""
    place = tmp_path_factory.mktemp("whole")
    with _standing_in(place):
        write_tracks(place / "tracks.csv", seconds=200)
        words = ["--side-m", "1", "--fish", "3", "--robot", "--fps", "5"]
        assert run(["init", "trial", *words, "-q"]) == 0
        assert run(["import", "tracks.csv", "trial", "--format", "csv", "-q"]) == 0
        assert run(["analyse", "trial", "-q"]) == 0
        assert run(["calibrate", "trial", *QUICK, "--no-seed-likelihood", "-q"]) == 0
        film = ("--video", "--duration", "2s", "--arena", "trial/arena.geojson", "--fps", "5")
        assert run(["simulate", "film", "--model", MODEL, *film, "-q"]) == 0
        root = place / "trial"
        for name in ("frames/overhead", "cameras"):
            shutil.copytree(place / "film" / name, root / name)
        name_camera(root, "overhead", root / "cameras" / "overhead.toml")
        for name in ("report", "poses", "drive"):
            (root / name).mkdir()
        _write_poses(root / "poses" / "000060.mcap")
        assert run([*COMMANDS["extend"], "-q"]) == 0
    extended = (root / "models" / "extended.toml").read_bytes()
    with pytest.MonkeyPatch.context() as patch:
        # All is read by then; what is left takes as long as all else together.
        def made(output, _):
            yield Draft(output=output, write=lambda path, _: write_bytes_whole(path, extended))

        patch.setattr(extend, "_made", made)
        yield root


def _write_poses(path):
    with PoseWriter(path, Lineage(schema=POSES, command="track")) as writer:
        for frame in range(300, 330):
            place = {"x_m": 0.5, "y_m": 0.5, "heading_rad": math.nan, "confidence": 1.0}
            agents = (AgentPose(agent=0, kind=FISH, **place),)
            writer.add(FramePoses(time_s=frame / 5, frame=frame, agents=agents))


@pytest.fixture(scope="module", autouse=True)
def quick(make_diagnosis):
    """Leave out what takes long and reads nothing: drawing, simulating, answering, flushing."""

    def answer(question, _):
        return make_diagnosis(question.arena, question.model, names=())

    def estimate(_case, _stretch, stated_m, source):
        return KnownNoise(sd_m=stated_m, source=source)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(page, "write_printed", lambda _p, _k, part, _: part.write_bytes(b"drawn"))
        patch.setattr(page, "render_page", lambda *_: "drawn")
        patch.setattr(gather, "_simulated", lambda *_: None)
        patch.setattr(gather, "_model_visits", lambda *_: None)
        patch.setattr(arena_figure, "_GRID_POINTS", 8)
        patch.setattr("zfcal.stages.diagnose.diagnose._engine", answer)
        patch.setattr("zfcal.stages.diagnose.diagnose._estimate", estimate)
        patch.setattr("zfcal.report.diagnosis.drawing.png_of", lambda _: b"drawn")
        patch.setattr("zfcal.report.render.panel_svg", lambda *_: "<svg></svg>")
        patch.setattr("zfcal.report.diagnosis.render_pool.RenderPool.prepare", lambda _: None)
        # Nobody pulls the plug.
        patch.setattr(os, "fsync", lambda _: None)
        yield


@contextmanager
def in_time():
    """Raise where a command takes too long."""

    def late(*_):
        # No `Exception`: a command that goes on after one would hide that it has waited.
        pytest.fail("it waits for ever")

    before = signal.signal(signal.SIGALRM, late)
    signal.alarm(PATIENCE_S)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


@pytest.fixture
def spoilt(template, tmp_path, monkeypatch, zfcal):
    """Return what spoils a file of a copy, fresh if need be, and runs a command on it."""
    root, outside = tmp_path / "trial", tmp_path / "outside"
    now = []

    def prepare(name, spoil):
        for folder in (root, outside):
            shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(template, root)
        outside.mkdir()
        (outside / "file").write_bytes(b"of somebody else")
        spoil(root / name, outside)

    def call(name, spoil, command):
        if now != [name, spoil]:
            prepare(name, spoil)
        now[:] = [name, spoil] if command in LOOKING else []
        words = COMMANDS[command]
        with in_time():
            done = zfcal(*words, *([root / name] if command == "inspect" else []))
        assert sorted(path.name for path in outside.iterdir()) == ["file"]
        assert (outside / "file").read_bytes() == b"of somebody else"
        return done

    return call


def problems_of(done, command):
    """Return what is wrong with how a command ended; empty for nothing."""
    # These are given a file by its name: that it is not there is a mistake in the command line.
    allowed = {0, 1, 2, 3} if command in {"inspect", "simulate"} else {0, 1, 3}
    said = done.err + done.out
    found = [] if done.code in allowed else [f"code {done.code}"]
    return found + [word for word in ("bug in zfcal", "Traceback") if word in said]


@pytest.mark.parametrize("badness", BADNESS)
@pytest.mark.parametrize("name", FILES)
def test_no_bad_file_ends_a_command_badly(spoilt, name, badness):
    """For each command; `inspect` is given the very file."""
    for command in readers_of(name):
        done = spoilt(name, BADNESS[badness], command)
        assert not problems_of(done, command), f"{command}: {done.code}: {done.err[-400:]}"


@pytest.mark.parametrize("badness", OF_FOLDERS)
@pytest.mark.parametrize("name", FOLDERS)
def test_no_bad_folder_ends_a_command_badly(spoilt, name, badness):
    """A folder that leads outside is neither read nor written."""
    for command in set(readers_of(name)) - {"inspect"}:
        done = spoilt(name, OF_FOLDERS[badness], command)
        assert not problems_of(done, command), f"{command}: {done.code}: {done.err[-400:]}"

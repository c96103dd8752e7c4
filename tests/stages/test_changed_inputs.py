"""What is made bears the hash of what it was made from, also of inputs that change meanwhile."""

import dataclasses
import hashlib
import itertools
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import cv2
import numpy as np
import pytest

from zfcal.artifacts.lineage import Lineage, read_lineage
from zfcal.artifacts.reading import contents as reading
from zfcal.artifacts.reading.contents import hash_of, read_bytes
from zfcal.cameras.lens import Lens
from zfcal.diagnose.findings import Note as Said
from zfcal.errors import ChangedError, ZfcalError
from zfcal.report import page
from zfcal.stages.analyse.analyse import AnalyseOptions, analyse
from zfcal.stages.calibrate.calibrate import calibrate
from zfcal.stages.calibrate.holdout import Span, calibrate_span
from zfcal.stages.camera.cameras import write_camera
from zfcal.stages.camera.corners import Corners, make_from_corners
from zfcal.stages.camera.making import CameraTask, place_for
from zfcal.stages.camera.points import Points, make_from_points
from zfcal.stages.camera.rig import CameraChoice
from zfcal.stages.diagnose.diagnose import DiagnoseOptions, KnownNoise, diagnose
from zfcal.stages.events import LeftOut, Note, say_nothing
from zfcal.stages.extend.extend import ExtendOptions, extend
from zfcal.stages.import_ import Source, import_tracks
from zfcal.stages.init import NewTrial, create_trial
from zfcal.stages.making import settled
from zfcal.stages.simulate import SimulateOptions, simulate
from zfcal.stages.track.plan import TrackOptions
from zfcal.stages.track.track import track
from zfcal.stages.trial_context import Task
from zfcal.virtual.film import FilmOptions, film


class Meddler:
    """Somebody who writes to a file at chosen moments of somebody else's work.

    A moment is when the file is about to be opened, or when what was seen of it has just been
    noted.
    """

    def __init__(self, monkeypatch, path, contents):
        self.path, self.contents = path, contents
        self.moments = 0
        self.plan = {}
        self._is_at_it = False
        self.place(0)
        note, opener = reading.Contents.note, os.open

        def noted(contents, path, digest):
            note(contents, path, digest)
            self._at(path)

        def opened(path, flags, *args, **kwargs):
            if not flags & (os.O_WRONLY | os.O_RDWR):
                self._at(path)
            return opener(path, flags, *args, **kwargs)

        monkeypatch.setattr(reading.Contents, "note", noted)
        monkeypatch.setattr(os, "open", opened)

    def place(self, which):
        """Put one of the contents there, as a copy that is renamed."""
        self._is_at_it = True
        part = self.path.with_name(f".{self.path.name}.meddling")
        part.write_bytes(self.contents[which])
        part.replace(self.path)
        self._is_at_it = False

    def _at(self, path):
        same = isinstance(path, str | os.PathLike) and str(Path(path).absolute()) == str(self.path)
        if self._is_at_it or not same:
            return
        moment, self.moments = self.moments, self.moments + 1
        which = self.plan.get(moment)
        if which is not None:
            self.place(which)


FPS, SIZE = 5.0, 200
CORNERS = ((-0.5, 199.5), (199.5, 199.5), (199.5, -0.5), (-0.5, -0.5))
ARENA, MODEL = "arena.geojson", "models/000000.toml"
EDITS = {
    ARENA: (b'"wall_zone_m": 0.07', b'"wall_zone_m": 0.09'),
    MODEL: (b"kappa_f = 9.0", b"kappa_f = 12.0"),
}
"""Of files that people edit: what another content is made of."""


@pytest.fixture
def swum(make_trial):
    """Return what makes a trial of three minutes, and the same of other fish."""

    def make(name, seconds=180):
        trials = ((name, 1), (f"{name}-other", 2))
        return [make_trial(each, seconds=seconds, seed=seed) for each, seed in trials]

    return make


@pytest.fixture
def asked(monkeypatch, make_diagnosis):
    """Answer every question with a diagnosis that says which fish and which model it was about."""

    def engine(question, heard):
        about = np.nan_to_num(question.samples.xy_m).sum(), question.model.zones[0].kappa_f
        found = make_diagnosis(question.arena, question.model)
        values = {"xy_m": float(about[0]), "kappa_f": float(about[1])}
        return dataclasses.replace(found, notes=(Said(name="about", says="x", values=values),))

    def unknown(case, stretch, stated_m, source):
        return KnownNoise(sd_m=stated_m, source=source)

    monkeypatch.setattr("zfcal.stages.diagnose.diagnose._engine", engine)
    monkeypatch.setattr("zfcal.stages.diagnose.diagnose._estimate", unknown)


@pytest.fixture
def analysing(swum):
    """Analyse."""
    root, other = swum("trial")
    return Work(root, other, lambda tell: analyse(root, AnalyseOptions(), tell))


@pytest.fixture
def calibrating(swum, in_full):
    """Calibrate the second round, which stands on the first."""
    both = swum("trial")
    for root in both:
        analyse(root, AnalyseOptions(), say_nothing)
    for root in both:
        calibrate(root, in_full, say_nothing, task=Task(ends_s=frozenset({120})))
    root, other = both
    task = Task(ends_s=frozenset({180}))
    return Work(root, other, lambda tell: calibrate(root, in_full, tell, task=task))


@pytest.fixture
def holding_out(swum, in_full):
    """Calibrate on one stretch and judge on another."""
    root, other = swum("trial")
    span = Span(output=root / "models" / "span.toml", train_s=(0, 120), held_out_s=(120, 180))
    return Work(root, other, lambda tell: calibrate_span(root, span, in_full, tell))


@pytest.fixture
def diagnosing(swum, asked):
    """Diagnose."""
    root, other = swum("trial")
    return Work(root, other, lambda tell: diagnose(root, DiagnoseOptions(), tell))


@pytest.fixture
def extending(swum, asked, quick):
    """Extend, and diagnose before that."""
    root, other = swum("trial", seconds=300)
    options = ExtendOptions(calibration=quick)
    return Work(root, other, lambda tell: extend(root, options, tell))


@pytest.fixture
def reporting(swum, monkeypatch):
    """Report, with one picture: all of them take seconds."""
    all_of_them = page.pictures_of_trial
    monkeypatch.setattr(page, "pictures_of_trial", lambda view: all_of_them(view)[:1])
    root, other = swum("trial")
    for each in (root, other):
        analyse(each, AnalyseOptions(), say_nothing)
    return Work(root, other, lambda tell: settled(lambda: page.write_report([root]), tell))


@pytest.fixture
def importing(tmp_path):
    """Import tracks as text."""
    root = tmp_path / "trial"
    create_trial(root, NewTrial(n_fish=3, n_robots=1, fps=FPS, side_m=1.0, seed=1), say_nothing)
    for seed, folder in enumerate(("sources", "sources-other")):
        rng = np.random.default_rng(seed)
        (tmp_path / folder).mkdir()
        for name, n in (("fish.csv", 3), ("robot.csv", 1)):
            rows = [
                f"{k / FPS},{agent},{x:.4f},{y:.4f}"
                for k in range(320)
                for agent, (x, y) in enumerate(rng.uniform(0.1, 0.9, (n, 2)))
            ]
            text = "\n".join(["time_s,agent,x_m,y_m", *rows])
            (tmp_path / folder / name).write_text(f"{text}\n")
    home = tmp_path / "sources"
    source = Source(
        path=home / "fish.csv", format="csv", options={}, robot_tracks=home / "robot.csv"
    )
    return Work(
        root, tmp_path / "sources-other", lambda tell: import_tracks(root, source, tell), home=home
    )


@pytest.fixture
def simulating(tmp_path):
    """Simulate, by a model that lies elsewhere."""
    root, home = tmp_path / "trial", tmp_path / "home"
    for place in (root, home):
        create_trial(place, NewTrial(n_fish=3, fps=FPS, side_m=1.0, seed=1), say_nothing)
    model = home / "models" / "000000.toml"
    model.rename(home / "wild.toml")
    options = SimulateOptions(model=home / "wild.toml", duration_s=62.0)
    return Work(root, None, lambda tell: simulate(root, options, tell), home=home)


@pytest.fixture
def tracking(tmp_path, drawn_tank):
    """Track a film through a camera file, against a picture of the empty tank."""
    root, home, other = (tmp_path / name for name in ("trial", "home", "other"))
    create_trial(root, NewTrial(n_fish=3, fps=FPS, side_m=0.4, dt_s=0.4), say_nothing)
    for place, turn in ((home, 0.05), (other, 0.06)):
        place.mkdir()
        frames = list(drawn_tank.frames(drawn_tank.circling(40, turn=turn)))
        codec = cv2.VideoWriter.fourcc(*"FFV1")
        writer = cv2.VideoWriter(str(place / "film.avi"), codec, FPS, (SIZE, SIZE))
        for frame in frames:
            image = frame.image
            writer.write(image if image.ndim == 3 else cv2.cvtColor(image, cv2.COLOR_GRAY2BGR))
        writer.release()
        empty = np.median([frame.image for frame in frames], axis=0).astype(np.uint8)
        cv2.imwrite(str(place / "empty.png"), empty)
        task = CameraTask()
        bounds_m = (0.0, 0.0, 0.35 + turn, 0.4)
        given = Corners(px=CORNERS, size_px=(SIZE, SIZE), bounds_m=bounds_m)
        camera = place_for(out=place / "camera.toml", trial=None, name=None)
        make_from_corners(camera, given, say_nothing, task=task)
    options = TrackOptions(
        overhead=CameraChoice(source=str(home / "film.avi"), file=home / "camera.toml"),
        background=home / "empty.png",
    )
    return Work(root, other, lambda tell: track(root, options, tell), home=home)


@pytest.fixture
def surveying(tmp_path):
    """Calibrate a camera from points and a lens."""
    home, other = tmp_path / "home", tmp_path / "other"
    for place, shift in ((home, 0.0), (other, 0.7)):
        place.mkdir()
        lens = Lens(
            size_px=(SIZE, SIZE),
            model="pinhole",
            matrix=((150.0 + shift, 0.0, 99.5), (0.0, 150.0, 99.5), (0.0, 0.0, 1.0)),
            distortion=(0.0, 0.0, 0.0, 0.0),
        )
        write_camera(
            place / "lens.toml", lens, Lineage(schema="zfcal.camera/1", command="camera board")
        )
        rows = [
            f"{20 + 160 * x + shift * y:.3f},{180 - 160 * y:.3f},{0.4 * x:.3f},{0.4 * y:.3f}"
            for x, y in itertools.product((0.0, 0.3, 0.6, 1.0), repeat=2)
        ]
        (place / "points.csv").write_text("\n".join(["x_px,y_px,x_m,y_m", *rows]) + "\n")
    points = Points(path=home / "points.csv", lens=home / "lens.toml")
    camera = place_for(out=home / "made" / "camera.toml", trial=None, name=None)
    return Work(
        home / "made",
        other,
        lambda tell: make_from_points(camera, points, tell, task=CameraTask()),
        home=home,
    )


@pytest.fixture
def drawing(tmp_path):
    """Draw camera images of tracks."""
    roots = tmp_path / "trial", tmp_path / "other"
    for root, seed in zip(roots, (1, 2), strict=True):
        create_trial(root, NewTrial(n_fish=2, fps=1.0, dt_s=1.0, side_m=1.0, seed=1), say_nothing)
        options = SimulateOptions(model=root / MODEL, duration_s=4.0, seed=seed)
        simulate(root, options, say_nothing)
        film(root, FilmOptions(), say_nothing)
        shutil.rmtree(root / "frames")
    root, other = roots
    return Work(root, other, lambda tell: film(root, FilmOptions(), tell))


WORKS = {
    "analysing": ("tracks/000060.parquet", "tracks/000120.parquet", ARENA),
    "calibrating": (
        "stats/000180.parquet",
        "models/000120.parquet",
        "tracks/000060.parquet",
        "tracks/000120.parquet",
        MODEL,
        ARENA,
    ),
    "holding_out": ("tracks/000000.parquet", "tracks/000120.parquet", MODEL, ARENA),
    "diagnosing": ("tracks/000000.parquet", "tracks/000120.parquet", MODEL, ARENA),
    "extending": ("tracks/000000.parquet", MODEL),
    "reporting": ("stats/000120.parquet",),
    "importing": ("fish.csv", "robot.csv"),
    "simulating": ("wild.toml", ARENA),
    "tracking": ("film.avi", "camera.toml", "empty.png"),
    "surveying": ("points.csv", "lens.toml"),
    "drawing": ("tracks/000000.parquet", ARENA),
}


class Work:
    """A stage that is run again and again from the same start."""

    def __init__(self, root, other, run, *, home=None):
        self.root, self.other, self.run = root, other, run
        self.home = home or root
        self.root.mkdir(exist_ok=True)
        self._start = root.with_name(f"{root.name}-start")
        shutil.copytree(root, self._start)

    def place_of(self, name):
        """Return where an input lies."""
        return (self.root if name == ARENA else self.home) / name

    def contents_of(self, name):
        """Return the two contents of an input."""
        first = self.place_of(name).read_bytes()
        if name in EDITS or name == "wild.toml":
            second = first.replace(*EDITS.get(name, EDITS[MODEL]))
        else:
            second = (self.other / name).read_bytes()
        assert first != second
        return first, second

    def restore(self):
        """Go back to the start; what lies elsewhere is the meddler's business."""
        kept = self.root.with_name("kept")
        shutil.rmtree(self.root)
        shutil.copytree(self._start, self.root)
        shutil.rmtree(kept, ignore_errors=True)

    def made(self):
        """Return each artifact that the start has not, by name: its inputs and its bytes."""
        files = [path for path in self.root.rglob("*") if path.is_file()]
        names = {path.relative_to(self.root).as_posix(): path for path in files}
        return {
            name: (path.suffix, path.read_bytes(), path)
            for name, path in names.items()
            if not path.name.startswith(".") and not (self._start / name).exists()
        }


def zfcal(*words):
    """Start a command as a process."""
    program = Path(sys.executable).with_name("zfcal")
    return subprocess.Popen([program, *map(str, words)], stderr=subprocess.DEVNULL)


PAIRS = [(work, name) for work, names in WORKS.items() for name in names]


def attempt(work):
    """Run a stage to its end or its error; return what it told, and the error."""
    told = []
    try:
        work.run(told.append)
    except ChangedError as error:
        return told, error
    return told, None


def check_honest(made, known, digests):
    """Each artifact is that of the content whose hash it bears; pictures are one or the other's."""
    for name, (suffix, data, path) in made.items():
        if suffix == ".mcap" and not data.endswith(b"\x89MCAP0\r\n"):
            # A file of poses that was not closed counts as unfinished.
            continue
        if name == "diagnosis/findings.json" and "models/extended.toml" in known[0]:
            # The gap is written into it at the end.
            continue
        wanted = [whole[name][1] for whole in known if name in whole]
        try:
            inputs = set(read_lineage(path).inputs.values())
        except ZfcalError:
            inputs = set()
        if not inputs & set(digests):
            assert data in wanted, f"{name} is neither of the old content nor of the new one"
        for digest, whole in zip(digests, known, strict=True):
            if digest in inputs:
                assert data == whole[name][1], f"{name} bears the hash of another content"


@pytest.fixture
def meddled(request, monkeypatch):
    """Return a stage, who meddles with one of its inputs, and what it makes of each content."""
    work = request.getfixturevalue(request.param[0])
    name = request.param[1]
    meddler = Meddler(monkeypatch, work.place_of(name), work.contents_of(name))
    known = []
    for which in (1, 0):
        work.restore()
        meddler.place(which)
        meddler.moments = 0
        work.run(say_nothing)
        known.insert(0, work.made())
    assert {key: data for key, (_, data, _) in known[0].items()} != {
        key: data for key, (_, data, _) in known[1].items()
    }
    return work, meddler, known


def plans(n_moments):
    """Yield how the input changes, and whether that is put up with, since it happens once."""
    for share in (0.0, 0.5, 1.0):
        yield {round(share * (n_moments - 1)): 1}, True
    for share in (0.25, 0.75):
        moment = round(share * (n_moments - 1))
        yield {moment: 1, moment + 1: 0}, False
    for seed in (1, 2):
        yield dict(enumerate(np.random.default_rng(seed).integers(0, 2, 200))), False


@pytest.mark.slow
@pytest.mark.parametrize("meddled", PAIRS, indirect=True, ids="-".join)
def test_what_is_made_bears_the_hash_of_what_it_was_made_from(meddled):
    """Replaced once, put back a moment later or replaced all the time; the next run mends it."""
    work, meddler, known = meddled
    digests = [hashlib.sha256(content).hexdigest() for content in meddler.contents]
    for plan, is_put_up_with in plans(meddler.moments):
        work.restore()
        meddler.plan = {}
        meddler.place(0)
        meddler.moments, meddler.plan = 0, plan
        told, error = attempt(work)
        if is_put_up_with:
            assert error is None
            assert not [each for each in told if isinstance(each, LeftOut)]
        check_honest(work.made(), known, digests)
        meddler.plan = {}
        assert attempt(work)[1] is None
        now = known[digests.index(hashlib.sha256(meddler.path.read_bytes()).hexdigest())]
        assert {name: data for name, (_, data, _) in work.made().items()} == {
            name: data for name, (_, data, _) in now.items()
        }


@pytest.mark.slow
def test_a_round_whose_tracks_are_put_back_meanwhile_is_made_of_those_that_are_there(swum):
    """The commands as a person runs them: replaced, analysed, and put back during the search."""
    root, other = swum("trial")
    track = root / "tracks" / "000060.parquet"
    good, bad = track.read_bytes(), (other / "tracks" / "000060.parquet").read_bytes()
    analysing, calibrating = ["analyse", root], ["calibrate", root, "--generations", "8"]
    track.write_bytes(bad)
    assert zfcal(*analysing).wait() == 0
    search = zfcal(*calibrating)
    while not list((root / "models").glob(".*.checkpoint")):
        assert search.poll() is None
        time.sleep(0.01)
    track.write_bytes(good)
    assert zfcal(*analysing).wait() == 0
    assert search.wait() == 0

    made = {path.name: path.read_bytes() for path in (root / "models").glob("0001*")}
    assert len(made) == 4
    assert zfcal(*calibrating, "--force").wait() == 0
    assert {path.name: path.read_bytes() for path in (root / "models").glob("0001*")} == made


def test_settled_work_is_done_twice_at_most(tmp_path):
    """A content that changes each time is an error, and it is said that it was done again."""
    path, n = tmp_path / "x", itertools.count()
    path.write_text("0")
    told = []

    def work():
        read_bytes(path)
        path.write_text(str(next(n)) * 3)
        hash_of(path)

    with pytest.raises(ChangedError):
        settled(work, told.append)
    assert next(n) == 2
    assert [type(each) for each in told] == [Note]


def test_settled_work_gives_its_result(tmp_path):
    """Once, where nothing changes."""
    assert settled(lambda: 7, say_nothing) == 7

"""From tracks to findings: what is asked, what is left out, what is written when."""

import dataclasses
import json
import math
import os

import numpy as np
import pytest

from zfcal.artifacts.lineage import Lineage, read_lineage
from zfcal.artifacts.lock import lock
from zfcal.artifacts.models import read_model, write_model
from zfcal.artifacts.tables import read_tracks, write_tracks
from zfcal.artifacts.validation import check, read_json
from zfcal.errors import InputError, LockedError
from zfcal.stages.diagnose.diagnose import DiagnoseOptions, KnownNoise, diagnose
from zfcal.stages.events import LeftOut, Made, Planned, Progress, Result, UpToDate
from zfcal.stages.trial_context import Task, open_trial
from zfcal.tracks import FISH, ROBOT


class Killed(BaseException):
    """What a test throws into a stage, as a power cut would."""


class Page:
    """A page that is drawn as a line of text, and can be killed before it is."""

    def __init__(self, *, killed=False):
        self.killed = killed
        self.prepared = 0

    def prepare(self):
        """Count how often there was something to get ready for."""
        self.prepared += 1

    def reason(self, folder, findings_sha256):
        """Return why it must be drawn."""
        page = folder / "report.html"
        return None if page.exists() and page.read_text() == findings_sha256 else "missing"

    def files(self, folder):
        """Return it."""
        return [folder / "report.html"]

    def write(self, folder, sheet):
        """Write what it shows."""
        if self.killed:
            raise Killed
        (folder / "report.html").write_text(sheet.provenance["findings"])
        return self.files(folder)


@pytest.fixture
def asked(monkeypatch, make_diagnosis):
    """Answer every question with a diagnosis made by hand, and keep the questions."""
    questions = []

    def engine(question, heard):
        questions.append(question)
        heard("null", 1, 2)
        return make_diagnosis(question.arena, question.model)

    monkeypatch.setattr("zfcal.stages.diagnose.diagnose._engine", engine)
    monkeypatch.setattr(
        "zfcal.stages.diagnose.diagnose._estimate",
        lambda _case, _stretch, stated_m, source: KnownNoise(
            sd_m=stated_m or 0.0007, source=source
        ),
    )
    return questions


def of_type(events, kind):
    """Return the events of a kind."""
    return [event for event in events if type(event) is kind]


def test_findings_of_a_trial(make_trial, asked, heard):
    """They pass their schema, carry their lineage, and are what is told as the result."""
    root = make_trial(seconds=130)
    path = diagnose(root, DiagnoseOptions(), heard.append)
    assert path == root / "diagnosis" / "findings.json"
    document = read_json(path)
    check(document, "findings", path)
    lineage = read_lineage(path)
    assert lineage.command == "diagnose"
    assert set(lineage.inputs) == {
        "tracks/000000.parquet",
        "tracks/000060.parquet",
        "tracks/000120.parquet",
        "models/000000.toml",
        "arena.geojson",
    }
    assert lineage.options["model"] == "models/000000.toml"
    assert [event.value for event in of_type(heard, Result)] == [document]
    assert Progress(stage="null", done=1, total=2) in heard


def test_the_question_holds_all_segments_on_the_models_clock(make_trial, asked, heard, wandering):
    """130 s at 0.2 s are 650 samples, with the noise and where it is known from."""
    root = make_trial(seconds=130, n_robots=1, seed=4)
    diagnose(root, DiagnoseOptions(n_workers=1, seed=7), heard.append)
    (question,) = asked
    assert len(question.samples.k) == 650
    assert question.samples.kind.tolist() == [FISH, FISH, FISH, ROBOT]
    tracks = wandering(130, n_robots=1, seed=4)
    assert np.array_equal(question.samples.xy_m[649, :, 0], tracks.x_m[-4:])
    assert (question.noise_m, question.seed, question.n_null) == (0.0007, 7, 39)


def test_noise_is_taken_from_the_option_then_from_the_tracks(make_trial, asked, heard):
    """Segments state it as metadata; the middle one counts."""
    root = make_trial(seconds=130)
    for start, noise_m in ((0, 0.0001), (60, 0.0004), (120, 0.0003)):
        path = root / "tracks" / f"{start:06d}.parquet"
        write_tracks(path, read_tracks(path), read_lineage(path), extra={"noise_m": noise_m})
    diagnose(root, DiagnoseOptions(), heard.append)
    diagnose(root, DiagnoseOptions(noise_m=0.002), heard.append)
    assert [question.noise_m for question in asked] == [0.0003, 0.002]
    assert [question.noise_source for question in asked][1] == "--noise-mm"


def test_a_window_takes_its_samples_alone(make_trial, asked, heard):
    """From 30 to 90 s; only the segments that it touches are inputs."""
    root = make_trial(seconds=240)
    path = diagnose(root, DiagnoseOptions(window_s=(30, 90)), heard.append)
    assert asked[0].samples.k[[0, -1]].tolist() == [150, 449]
    names = [name for name in read_lineage(path).inputs if name.startswith("tracks/")]
    assert names == ["tracks/000000.parquet", "tracks/000060.parquet"]


def test_the_second_run_does_nothing(make_trial, asked, heard, read_all):
    """And says so; other workers do not make it stale."""
    root = make_trial(seconds=130)
    diagnose(root, DiagnoseOptions(n_workers=1), heard.append, draw=Page())
    before = read_all(root)
    heard.clear()
    diagnose(root, DiagnoseOptions(n_workers=2), heard.append, draw=Page())
    assert len(asked) == 1
    assert [e.path.name for e in of_type(heard, UpToDate)] == ["findings.json", "report.html"]
    assert not of_type(heard, Made)
    assert read_all(root) == before


def test_force_ends_in_the_same_bytes(make_trial, asked, heard, read_all):
    """Nothing of the day is in the files."""
    root = make_trial(seconds=130)
    diagnose(root, DiagnoseOptions(), heard.append, draw=Page())
    before = read_all(root)
    heard.clear()
    diagnose(root, DiagnoseOptions(), heard.append, draw=Page(), task=Task(force=True))
    assert [e.reason for e in of_type(heard, Made)] == ["forced", "forced"]
    assert len(asked) == 2
    assert read_all(root) == before


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"quick": True}, "option null: 39 -> none"),
        ({"n_null": 199}, "option null: 39 -> 199"),
        ({"noise_m": 0.0005}, "option noise_mm: none -> 0.5"),
        ({"seed": 9}, "seed: 1 -> 9"),
        ({"window_s": (0, 120)}, "tracks/000120.parquet is no longer an input"),
    ],
)
def test_what_bears_on_the_result_makes_it_stale(make_trial, asked, heard, options, reason):
    """The reason says what changed."""
    root = make_trial(seconds=130)
    diagnose(root, DiagnoseOptions(), heard.append)
    heard.clear()
    diagnose(root, DiagnoseOptions(**options), heard.append)
    assert [event.reason for event in of_type(heard, Made)] == [reason]


def test_a_new_segment_makes_it_stale(make_trial, asked, heard):
    """A live trial grows."""
    root = make_trial(seconds=130)
    diagnose(root, DiagnoseOptions(), heard.append)
    late = root / "tracks" / "000180.parquet"
    tracks = read_tracks(root / "tracks" / "000060.parquet")
    later = dataclasses.replace(tracks, time_s=tracks.time_s + 120, frame=tracks.frame + 600)
    write_tracks(late, later, Lineage(schema="zfcal.tracks/1", command="track"))
    heard.clear()
    diagnose(root, DiagnoseOptions(), heard.append)
    assert [e.reason for e in of_type(heard, Made)] == ["input tracks/000180.parquet is new"]


def test_a_dry_run_writes_nothing(make_trial, asked, heard, read_all):
    """It says what it would make, holds no lock and asks nobody."""
    root = make_trial(seconds=130)
    before = read_all(root)
    with lock(root, "diagnose"):
        found = diagnose(root, DiagnoseOptions(), heard.append, task=Task(dry_run=True))
    assert found is None
    assert [(e.path.name, e.reason) for e in of_type(heard, Planned)] == [
        ("findings.json", "missing")
    ]
    assert not asked
    assert read_all(root) == before


def test_two_at_a_time_are_refused(make_trial, asked, heard):
    """The second of the same command exits with 75."""
    root = make_trial(seconds=130)
    with lock(root, "diagnose"), pytest.raises(LockedError):
        diagnose(root, DiagnoseOptions(), heard.append)


def test_a_run_killed_before_its_page_goes_on_there(make_trial, asked, heard, read_all):
    """The findings are whole, and are not made again; the files end as if undisturbed."""
    root = make_trial(seconds=130)
    with pytest.raises(Killed):
        diagnose(root, DiagnoseOptions(), heard.append, draw=Page(killed=True))
    heard.clear()
    diagnose(root, DiagnoseOptions(), heard.append, draw=Page())
    assert len(asked) == 1
    assert [e.path.name for e in of_type(heard, Made)] == ["report.html"]
    killed = read_all(root)
    diagnose(root, DiagnoseOptions(), heard.append, draw=Page(), task=Task(force=True))
    assert read_all(root) == killed


@pytest.mark.slow
def test_a_page_gets_ready_while_the_answer_is_worked_out(make_trial, asked, heard):
    """With a thread to spare, and only where there is an answer to wait for."""
    root, page = make_trial(seconds=130), Page()
    two = DiagnoseOptions(n_workers=2)
    diagnose(root, two, heard.append, draw=page, task=Task(dry_run=True))
    assert page.prepared == 0
    diagnose(root, two, heard.append, draw=page)
    assert page.prepared == 1
    diagnose(root, two, heard.append, draw=page)
    alone = DiagnoseOptions(n_workers=1)
    diagnose(root, alone, heard.append, draw=page, task=Task(force=True))
    assert page.prepared == 1
    assert len(asked) == 2


def test_a_damaged_segment_is_left_out_and_noted(make_trial, asked, heard):
    """It is told each time, the findings say so, and the others are used."""
    root = make_trial(seconds=240)
    (root / "tracks" / "000060.parquet").write_bytes(b"PAR1 and no more")
    path = diagnose(root, DiagnoseOptions(), heard.append)
    (told,) = of_type(heard, LeftOut)
    assert told.damaged
    assert "000060.parquet" in told.problem
    notes = {note["name"]: note for note in read_json(path)["notes"]}
    assert notes["left-out"]["values"] == {"left_out": 1.0, "segments": 4.0}
    assert np.isnan(asked[0].samples.xy_m[300:600]).all()
    heard.clear()
    diagnose(root, DiagnoseOptions(), heard.append)
    assert len(of_type(heard, LeftOut)) == len(of_type(heard, UpToDate)) == 1


@pytest.mark.parametrize("kind", ["folder", "pipe", "huge"])
def test_what_is_no_segment_is_left_out_and_no_input(make_trial, asked, heard, kind):
    """It is told each time; once the segment is back the findings are made anew."""
    root = make_trial(seconds=240)
    path = root / "tracks" / "000060.parquet"
    path.rename(root / "away")
    makes = {
        "folder": path.mkdir,
        "pipe": lambda: os.mkfifo(path),
        "huge": lambda: (path.touch(), os.truncate(path, 600 * 10**6)),
    }
    makes[kind]()
    found = diagnose(root, DiagnoseOptions(), heard.append)
    (told,) = of_type(heard, LeftOut)
    assert told.damaged
    assert "tracks/000060.parquet" in told.problem
    assert "tracks/000060.parquet" not in read_lineage(found).inputs
    notes = {note["name"]: note for note in read_json(found)["notes"]}
    assert notes["left-out"]["values"] == {"left_out": 1.0, "segments": 4.0}
    heard.clear()
    diagnose(root, DiagnoseOptions(), heard.append)
    assert len(of_type(heard, LeftOut)) == len(of_type(heard, UpToDate)) == 1
    (path.rmdir if kind == "folder" else path.unlink)()
    (root / "away").rename(path)
    diagnose(root, DiagnoseOptions(), heard.append)
    assert [e.reason for e in of_type(heard, Made)][-1] == "input tracks/000060.parquet is new"
    assert "left-out" not in {note["name"] for note in read_json(found)["notes"]}


def test_a_segment_of_another_minute_is_left_out(make_trial, asked, heard):
    """Its name says where it starts."""
    root = make_trial(seconds=240)
    (root / "tracks" / "000120.parquet").replace(root / "tracks" / "000300.parquet")
    diagnose(root, DiagnoseOptions(), heard.append)
    assert "expected 300 s" in of_type(heard, LeftOut)[0].problem


def test_a_model_with_effects_has_a_folder_of_its_own(make_trial, asked, heard):
    """So the first findings stay."""
    root = make_trial(seconds=130)
    first = diagnose(root, DiagnoseOptions(), heard.append)
    model = read_model(root / "models" / "000000.toml")
    named = root / "models" / "extended.toml"
    effects = {"alignment": {"weight": 10.0}}
    lineage = Lineage(schema="zfcal.model/1", command="extend")
    write_model(named, dataclasses.replace(model, effects=effects), lineage)
    second = diagnose(root, DiagnoseOptions(model=named), heard.append)
    assert second == root / "diagnosis" / "extended" / "findings.json"
    assert first.exists()
    assert asked[1].model.effects == effects
    third = diagnose(root, DiagnoseOptions(out_dir=root / "diagnosis" / "x"), heard.append)
    assert third.parent.name == "x"


def test_the_model_of_the_newest_round_is_asked_about(make_trial, asked, heard):
    """The highest number; extended.toml only when named."""
    root = make_trial(seconds=130)
    model = read_model(root / "models" / "000000.toml")
    lineage = Lineage(schema="zfcal.model/1", command="calibrate")
    for name in ("000120.toml", "extended.toml"):
        write_model(root / "models" / name, model, lineage)
    path = diagnose(root, DiagnoseOptions(), heard.append)
    assert read_lineage(path).options["model"] == "models/000120.toml"


def test_a_model_of_another_arena_or_step_is_one_clear_error(make_trial, asked, heard, tmp_path):
    """Zones, then the step."""
    root = make_trial(seconds=130)
    model = read_model(root / "models" / "000000.toml")
    lineage = Lineage(schema="zfcal.model/1", command="init")
    slow, hall = tmp_path / "slow.toml", tmp_path / "hall.toml"
    write_model(slow, dataclasses.replace(model, dt_s=1.0), lineage)
    zone = dataclasses.replace(model.zones[0], name="hall", gamma={"hall": 1.0})
    write_model(hall, dataclasses.replace(model, zones=(zone,)), lineage)
    with pytest.raises(InputError, match=r"dt_s = 1 s, the trial has 0\.2 s"):
        diagnose(root, DiagnoseOptions(model=slow), heard.append)
    with pytest.raises(InputError, match=r"zone .walls. of .* is missing"):
        diagnose(root, DiagnoseOptions(model=hall), heard.append)
    assert not asked


def test_a_recording_at_another_rate_is_refused(make_trial, asked, heard):
    """Frames every 0.1 s in a trial of 5 Hz."""
    root = make_trial(seconds=50)
    path = root / "tracks" / "000000.parquet"
    tracks = read_tracks(path)
    write_tracks(path, dataclasses.replace(tracks, time_s=tracks.time_s / 2), read_lineage(path))
    with pytest.raises(InputError, match=r"have 10 frames a second, .* says 5"):
        diagnose(root, DiagnoseOptions(), heard.append)


def test_a_trial_without_tracks_is_refused(make_trial, asked, heard):
    """Also a window in which there are none, and one whose every segment is damaged."""
    root = make_trial(seconds=130)
    with pytest.raises(InputError, match="no tracks from 600 s to 700 s"):
        diagnose(root, DiagnoseOptions(window_s=(600, 700)), heard.append)
    for path in (root / "tracks").iterdir():
        path.write_bytes(b"")
    with pytest.raises(InputError, match="none of 3 segments"):
        diagnose(root, DiagnoseOptions(), heard.append)
    for path in (root / "tracks").iterdir():
        path.unlink()
    with pytest.raises(InputError, match="has no tracks"):
        diagnose(root, DiagnoseOptions(), heard.append)


def test_findings_are_plain_json(make_trial, asked, heard):
    """No NaN that only Python reads, and one schema at the head."""
    root = make_trial(seconds=130)
    text = diagnose(root, DiagnoseOptions(), heard.append).read_text()
    assert "NaN" not in text
    assert next(iter(json.loads(text))) == "schema"
    assert math.isfinite(json.loads(text)["effects"][0]["p"])


def test_the_trial_that_was_asked_about_is_sound(make_trial, asked, heard):
    """Zones of the question are those of the arena."""
    root = make_trial(seconds=130)
    diagnose(root, DiagnoseOptions(), heard.append)
    assert asked[0].arena.zone_names == open_trial(root).arena.zone_names

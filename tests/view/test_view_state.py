"""The state of a trial as the page gets it: minutes, rounds, faults, and what is bad."""

import json
import os
import shutil

import numpy as np
import pytest

from zfcal.artifacts.arenas import load_arena
from zfcal.artifacts.lineage import Lineage
from zfcal.artifacts.settings import read_trial
from zfcal.artifacts.tables import read_tracks, write_tracks
from zfcal.errors import DamagedError, InputError
from zfcal.report.figures import theme
from zfcal.view.minutes import minute_of, minute_starts, stamps_of
from zfcal.view.state import TrialState
from zfcal.view.tank import tank_of


def state_of(root):
    """Return what looks at a trial."""
    trial = read_trial(root)
    return TrialState(trial, load_arena(trial.arena, root))


def rewrite(path, tracks):
    """Put other rows into a segment."""
    write_tracks(path, tracks, Lineage(schema="zfcal.tracks/1", command="track"))


def test_a_minute_holds_each_agent_at_even_times(trial):
    """In millimetres, the frame that is nearest: at 5 Hz each frame is one."""
    tracks = read_tracks(trial / "tracks" / "000060.parquet")
    minute = minute_of(read_trial(trial), 60)
    assert (minute["hz"], len(minute["agents"])) == (5.0, 4)
    assert [agent["kind"] for agent in minute["agents"]] == ["fish"] * 3 + ["robot"]
    for agent in minute["agents"]:
        own = tracks.take(tracks.agent == agent["agent"])
        np.testing.assert_array_equal(agent["x"], np.round(1000 * own.x_m))
        np.testing.assert_array_equal(agent["y"], np.round(1000 * own.y_m))
        assert set(agent["heading"]) == {None}


def test_who_is_lost_has_no_place_and_a_guess_is_one(trial):
    """Frames 10 to 19 of the first fish are gone; its frame 30 is a guess."""
    path = trial / "tracks" / "000000.parquet"
    tracks = read_tracks(path)
    tracks.confidence[(tracks.agent == 0) & (tracks.frame == 30)] = 0.2
    lost = (tracks.agent == 0) & (tracks.frame >= 10) & (tracks.frame < 20)
    rewrite(path, tracks.take(~lost))
    first = minute_of(read_trial(trial), 0)["agents"][0]
    gone = [n for n, x in enumerate(first["x"]) if x is None]
    assert gone == list(range(10, 20))
    assert first["guess"] == [30]


def test_poses_stand_in_for_a_segment_that_is_not_there_or_damaged(trial, made):
    """A minute that still grows, and one whose segment was cut short."""
    with made["poses"](trial, 180) as writer:
        for n in range(50):
            writer.add(made["poses_at"](180 + n / 5))
        assert minute_starts(trial) == [0, 60, 120, 180]
        grown = minute_of(read_trial(trial), 180)["agents"]
    assert [len(grown), grown[0]["x"][0], grown[0]["x"][49:51]] == [3, 800, [655, None]]
    with made["poses"](trial, 60) as writer:
        writer.add(made["poses_at"](60.0))
    segment = trial / "tracks" / "000060.parquet"
    segment.write_bytes(segment.read_bytes()[:-100])
    assert len(minute_of(read_trial(trial), 60)["agents"]) == 3


def test_a_minute_that_cannot_be_read_says_why(trial):
    """Damaged without poses, and one of which there is nothing."""
    segment = trial / "tracks" / "000060.parquet"
    segment.write_bytes(segment.read_bytes()[:-100])
    with pytest.raises(DamagedError, match=r"000060\.parquet"):
        minute_of(read_trial(trial), 60)
    with pytest.raises(InputError, match=r"000240\.parquet: no such file"):
        minute_of(read_trial(trial), 240)


def test_targets_belong_to_their_minute(trial, made):
    """In seconds and millimetres, in their order."""
    writer = made["drive"](trial, 60)
    writer.add(made["target"](60.2, 0.25, 0.5))
    writer.add(made["target"](60.4, 0.26, 0.5))
    writer.close()
    trial_ = read_trial(trial)
    assert minute_of(trial_, 60)["targets"] == [[60.2, 250.0, 500.0], [60.4, 260.0, 500.0]]
    assert minute_of(trial_, 0)["targets"] == []


def test_rounds_have_s_its_ceiling_and_parameters_with_intervals(trial):
    """The starting model comes first, without intervals."""
    state = state_of(trial).look()
    found = [(row["end_s"], row["value"], row["ceiling"], row["low"]) for row in state["scores"]]
    assert found == [(120, 0.7, 0.9, 0.8), (180, 0.8, 0.9, 0.8)]
    assert [made["end_s"] for made in state["rounds"]] == [0, 120, 180]
    last = {each["name"]: each for each in state["rounds"][-1]["parameters"]}
    told = last["walls.kappa_0"]
    assert (told["low"], told["high"], told["identified"], told["most"]) == (1.0, 9.0, False, 30.0)
    assert state["rounds"][-1]["rule"] == "nearest"
    assert {each["low"] for each in state["rounds"][0]["parameters"]} == {None}
    assert state["last"] == {"track": 180, "analyse": None, "calibrate": 180}


def test_what_is_bad_is_named_and_the_rest_is_shown_until_it_is_mended(trial):
    """A model cut short, a table cut short, a pipe in a model's place."""
    model, table = trial / "models" / "000120.toml", trial / "scores" / "000180-model.parquet"
    text, data = model.read_text(), table.read_bytes()
    model.write_text(text[:50])
    table.write_bytes(data[:-9])
    os.mkfifo(trial / "models" / "000240.toml")
    looks = state_of(trial)
    state = looks.look()
    assert [made["end_s"] for made in state["rounds"]] == [0, 180]
    assert [row["end_s"] for row in state["scores"]] == [120]
    assert [said.split(":")[0] for said in state["problems"]] == [
        "models/000120.toml",
        "models/000240.toml",
        "scores/000180-model.parquet",
    ]
    model.write_text(text)
    table.write_bytes(data)
    (trial / "models" / "000240.toml").unlink()
    state = looks.look()
    assert len(state["rounds"]) == 3
    assert len(state["scores"]) == 2
    looks.look()
    assert looks.look()["problems"] == []


def test_a_damaged_segment_is_named(trial):
    """Whichever it is, and though its minute may be played from poses."""
    path = trial / "tracks" / "000000.parquet"
    path.write_bytes(path.read_bytes()[:-20])
    problems = state_of(trial).look()["problems"]
    assert len(problems) == 1
    assert problems[0].startswith("tracks/000000.parquet")


def test_what_has_not_changed_is_read_once(trial, monkeypatch):
    """Looks cost what has changed."""
    looks = state_of(trial)
    looks.look()
    read = []
    opened = os.open
    monkeypatch.setattr(
        "os.open", lambda path, *rest: (read.append(str(path)), opened(path, *rest))[1]
    )
    looks.look()
    assert [path for path in read if path.startswith(str(trial))] == []
    (trial / "models" / "000120.toml").touch()
    looks.look()
    assert {path.rpartition("/")[2] for path in read} == {"000120.toml"}


def test_a_trial_that_is_gone_says_so(trial, tmp_path):
    """And is shown again when it is back."""
    looks = state_of(trial)
    looks.look()
    trial.rename(tmp_path / "away")
    state = looks.look()
    assert (state["gone"], state["minutes"], state["rounds"]) == (True, [], [])
    (tmp_path / "away").rename(trial)
    assert looks.look()["minutes"] == [0, 60, 120]


def test_a_recording_is_whole_when_its_last_segment_says_so(trial):
    """Not while one before the last is the newest."""
    path = trial / "tracks" / "000120.parquet"
    tracks, lineage = read_tracks(path), Lineage(schema="zfcal.tracks/1", command="import")
    looks = state_of(trial)
    assert looks.look()["whole"] is False
    write_tracks(path, tracks, lineage, extra={"recording_s": [0.0, 180.0]})
    assert looks.look()["whole"] is True
    write_tracks(path, tracks, lineage, extra={"recording_s": [0.0, 240.0]})
    assert looks.look()["whole"] is False


def test_a_recording_that_goes_on_is_not_whole(trial, made):
    """A trial that is resumed grows beyond the segment that said it was the last."""
    path = trial / "tracks" / "000120.parquet"
    lineage = Lineage(schema="zfcal.tracks/1", command="track")
    write_tracks(path, read_tracks(path), lineage, extra={"recording_s": [0.0, 180.0]})
    with made["poses"](trial, 120) as writer:
        writer.add(made["poses_at"](120.0))
    looks = state_of(trial)
    assert looks.look()["whole"] is True
    with made["poses"](trial, 180) as writer:
        writer.add(made["poses_at"](180.0))
    state = looks.look()
    assert (state["minutes"][-1], state["whole"]) == (180, False)


def test_the_stamp_of_a_minute_changes_when_it_grows(trial, made):
    """And no other: by poses, targets, and the segment that takes their place."""
    with made["poses"](trial, 180) as writer:
        writer.add(made["poses_at"](180.0))
        stamps = [stamps_of(trial)]
        writer.add(made["poses_at"](180.2))
        stamps.append(stamps_of(trial))
    drive = made["drive"](trial, 180)
    drive.add(made["target"](180.2, 0.25, 0.5))
    drive.flush()
    stamps.append(stamps_of(trial))
    drive.close()
    shutil.copy(trial / "tracks" / "000120.parquet", trial / "tracks" / "000180.parquet")
    stamps.append(stamps_of(trial))
    assert [sorted(each) for each in stamps] == [[0, 60, 120, 180]] * 4
    assert len({each[180] for each in stamps}) == 4
    assert len({(each[0], each[60], each[120]) for each in stamps}) == 1


@pytest.mark.parametrize(
    ("score", "says"),
    [
        (0.6, "67 % of its ceiling"),
        (0.85, "within what windows of the model itself score"),
        (0.93, "within what windows of the model itself score"),
        (0.98, "above the range of its ceiling: it fits chance"),
    ],
)
def test_no_score_is_more_than_all_of_its_ceiling(trial, made, score, says):
    """The ceiling is 0.9, and 95 % of windows of the model score 0.8 to 0.95."""
    made["round"](trial, 180, score)
    row = state_of(trial).look()["scores"][-1]
    assert row["says"] == says
    assert row["above"] == says.startswith("above")


def test_findings_are_sentences(trial):
    """The verdict and each effect; a file of another form is named."""
    effect = {"name": "e", "says": "Fish do.", "strength": {}, "interval": {}, "ties": []}
    found = {"schema": "zfcal.findings/1", "verdict": "named", "where": [], "screened": []}
    found["effects"] = [effect | {"gain_nats_per_step": 0.1, "p": 0.01}]
    path = trial / "diagnosis" / "findings.json"
    path.parent.mkdir()
    path.write_text(json.dumps(found))
    looks = state_of(trial)
    told = looks.look()["findings"]
    assert told["effects"] == [{"name": "e", "says": "Fish do.", "p": 0.01}]
    assert told["verdict"] == "An effect is missing in the model."
    path.write_text("{}")
    state = looks.look()
    assert state["findings"] is None
    assert state["problems"][0].startswith("diagnosis/findings.json")


@pytest.mark.parametrize("arena", ["two-rooms", "ring"])
def test_the_tank_has_closed_walls_and_zones_in_colours_of_the_report(arena, repository):
    """Rings end where they begin; each colour is one of the page's variables."""
    tank = tank_of(load_arena(arena, repository))
    rings = [*tank["walls"], *(r for z in tank["zones"] for part in z["parts"] for r in part)]
    assert all(ring[0] == ring[-1] for ring in rings)
    known = {row[0] for row in theme.THEME.values()}
    assert {zone["colour"] for zone in tank["zones"]} <= known

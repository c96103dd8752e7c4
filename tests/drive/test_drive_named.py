"""A drive by a model file that is named: `zfcal drive --model`."""

import hashlib
import importlib.util
import os
import re
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from zfcal.artifacts.drive_files import drive_files, read_drive
from zfcal.artifacts.lineage import Lineage, read_lineage
from zfcal.artifacts.models import read_model, write_model
from zfcal.drive.drive import DriveOptions, drive
from zfcal.drive.models import DriveModels
from zfcal.drive.replay import replay
from zfcal.errors import InputError
from zfcal.stages.events import Note, Result, say_nothing
from zfcal.stages.trial_context import Task, open_trial
from zfcal_cli.main import run as command

_spec = importlib.util.spec_from_file_location("driven", Path(__file__).with_name("driven.py"))
driven = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(driven)

SECONDS = 6
NAMED = "models/extended.toml"
NEW = "models/000120.toml"

KINDS = {
    "component": {"alignment": {"weight": 40.0, "kappa": 10.0}},
    "tilt": {"turning-bias": {"strength": 2.0}},
    "speed": {"crowding": {"per_neighbour": 1.0, "radius_m": 0.3}},
}


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """Return a trial with some seconds of poses and the model of a round."""
    root = driven.make_trial(tmp_path_factory.mktemp("named") / "trial")
    driven.write_poses(root, driven.frames_of(root, SECONDS))
    driven.add_model(root, 120)
    return root


@pytest.fixture
def root(recorded, tmp_path):
    """Return a copy of that trial with an extended model beside the round's."""
    copy = Path(shutil.copytree(recorded, tmp_path / "trial"))
    extend(copy, KINDS["component"])
    return copy


def extend(root, effects, *, place=NAMED):
    """Write the starting model with effects; return where it is."""
    model = replace(read_model(root / "models" / "000000.toml"), effects=effects)
    path = root / place
    write_model(path, model, Lineage(schema="zfcal.model/1", command="extend"))
    return path


def run(root, model, *, tell=say_nothing, force=False):
    """Drive over the recorded poses; return the messages of the log, by their kinds."""
    options = DriveOptions(port="virtual", clock="poses", model=model, duration_s=SECONDS - 1 / 15)
    drive(root, options, tell, task=Task(force=force))
    items = [item for path in drive_files(root).values() for item in read_drive(path)]
    return {
        what: [item for item in items if item["what"] == what]
        for what in ("model", "target", "command")
    }


def places(items):
    """Return where the targets are."""
    return [(target["x_m"], target["y_m"]) for target in items["target"]]


def test_the_named_model_drives_though_a_newer_one_is_there(root, heard):
    """From the first step to the last; log, what is told and the result say its name."""
    items = run(root, root / NAMED, tell=heard.append)
    assert {target["model"] for target in items["target"]} == {NAMED}
    assert len(items["target"]) == 30
    (model,) = items["model"]
    data = (root / NAMED).read_bytes()
    assert (model["model"], model["sha256"]) == (NAMED, hashlib.sha256(data).hexdigest())
    assert model["parameters"] == data.decode()
    texts = [event.text for event in heard if isinstance(event, Note)]
    assert "0.0 s: models/extended.toml drives." in texts
    (result,) = (event.value for event in heard if isinstance(event, Result))
    assert result["models"] == [NAMED]


def test_without_it_the_newest_numbered_one_drives(root):
    """Files of other names only when named."""
    items = run(root, None)
    assert {target["model"] for target in items["target"]} == {NEW}


def test_the_lineage_of_the_log_says_which_was_named(root):
    """Relative to the trial; without the option it says nothing of it."""
    run(root, root / NAMED)
    (path,) = drive_files(root).values()
    assert read_lineage(path).options["model"] == NAMED
    run(root, None, force=True)
    assert "model" not in read_lineage(path).options


@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_of_effect_drives_and_a_replay_decides_the_same(root, kind):
    """Other targets than the base model's, and all of them again from the log."""
    base = places(run(root, root / "models" / "000000.toml"))
    extend(root, KINDS[kind])
    items = run(root, root / NAMED, force=True)
    assert places(items) != base
    tally = replay(root, say_nothing)
    assert (tally.targets, tally.same_targets) == (30, 30)
    assert (tally.commands, tally.same_commands) == (60, 60)


def test_a_named_model_drives_as_a_numbered_one_of_the_same_content(root):
    """Only its name differs."""
    named = places(run(root, root / NAMED))
    shutil.copy(root / NAMED, root / "models" / "000240.toml")
    assert places(run(root, None, force=True)) == named


def test_a_replay_needs_the_file_no_more(root):
    """The log has the model itself; numbered ones that appear meanwhile say nothing."""
    run(root, root / NAMED)
    (root / NAMED).unlink()
    driven.add_model(root, 300, seed=8)
    assert replay(root, say_nothing).is_same


def test_a_model_beside_the_trial_may_be_named(root, tmp_path):
    """The log says where it was, and the drive replays."""
    path = extend(root, KINDS["tilt"], place="../other.toml")
    items = run(root, path)
    assert {target["model"] for target in items["target"]} == {"../other.toml"}
    path.unlink()
    assert replay(root, say_nothing).is_same


def test_a_named_model_that_changes_drives_from_then_on(root, monkeypatch, heard):
    """Three seconds in; the log has both contents under the one name, and replays."""
    before, look = (root / NAMED).read_bytes(), DriveModels.look

    def changing(models, now_s=float("inf")):
        if now_s >= 3.0 and (root / NAMED).read_bytes() == before and now_s < 100:
            extend(root, KINDS["tilt"])
        return look(models, now_s)

    monkeypatch.setattr(DriveModels, "look", changing)
    items = run(root, root / NAMED, tell=heard.append)
    assert [model["model"] for model in items["model"]] == [NAMED, NAMED]
    assert items["model"][1]["time_s"] == pytest.approx(3.0)
    assert len({model["sha256"] for model in items["model"]}) == 2
    told = [event.text for event in heard if isinstance(event, Note) and event.kind == "model"]
    assert told == [f"0.0 s: {NAMED} drives.", f"3.0 s: {NAMED} drives."]
    assert replay(root, say_nothing).is_same


@pytest.fixture
def models(root):
    """Return what looks for the named model alone."""
    return DriveModels(open_trial(root), only=root / NAMED)


def test_numbered_models_are_not_looked_at(models, root):
    """New ones, newer ones and broken ones alike."""
    assert models.first().name == NAMED
    driven.add_model(root, 300)
    (root / "models" / "000360.toml").write_text("half of it = ")
    assert models.look() is None
    assert models.problem == ""


def test_a_named_model_is_read_once_for_each_content(models, root):
    """A look at the same file brings no news; one at a new one does, whatever the time."""
    first = models.first()
    assert [models.look(now_s) for now_s in (0.0, 1.0)] == [None, None]
    extend(root, KINDS["tilt"])
    second = models.look(0.5)
    assert (second.name, list(second.parameters.effects)) == (NAMED, ["turning-bias"])
    assert second.sha256 != first.sha256
    assert models.look(9.0) is None


def test_a_named_model_that_is_broken_later_drives_on_as_it_was(models, root):
    """It is told once; whole again, it drives."""
    models.first()
    good = (root / NAMED).read_bytes()
    (root / NAMED).write_text("half of it = ")
    assert models.look() is None
    assert "extended.toml" in models.problem
    assert models.look() is None
    assert models.problem == ""
    (root / NAMED).write_bytes(good + b"\n")
    assert models.look().name == NAMED


def test_a_named_model_that_is_gone_later_drives_on_as_it_was(models, root):
    """Somebody moves it away and back."""
    models.first()
    away = (root / NAMED).rename(root / "away.toml")
    assert models.look() is None
    away.rename(root / NAMED)
    found = models.look()
    assert found is None or found.name == NAMED


BAD = {
    "half": (b"half of it = ", "TOML"),
    "step": (None, "dt_s"),
    "arena": (None, "zone 'corridor' of arena 'two-rooms' is missing"),
    "effect": (None, "no effect 'allignment'"),
    "bound": (None, "weight must be in"),
    "folder": (None, "extended.toml"),
    "pipe": (None, "extended.toml"),
    "loop": (None, "extended.toml"),
}


def spoil(root, kind):
    """Put something else in the place of the named model."""
    path = root / NAMED
    text = path.read_text()
    if kind in {"folder", "pipe", "loop"}:
        path.unlink()
        made = {"folder": os.mkdir, "pipe": os.mkfifo, "loop": lambda p: p.symlink_to(p.name)}
        made[kind](path)
        return
    changed = {
        "half": "half of it = ",
        "step": text.replace("dt_s = 0.2", "dt_s = 0.1"),
        "arena": text.replace("corridor", "tunnel"),
        "effect": text.replace("alignment", "allignment"),
        "bound": re.sub(r"weight = [0-9.]+", "weight = 60.0", text),
    }[kind]
    assert changed != text
    path.write_text(changed)


@pytest.mark.parametrize("kind", BAD)
def test_a_bad_model_is_refused_before_anything_is_driven(root, kind):
    """What is wrong with it, by its name, and what to do; a numbered one does not stand in."""
    spoil(root, kind)
    with pytest.raises(InputError) as error:
        run(root, root / NAMED)
    assert NAMED in str(error.value)
    assert BAD[kind][1] in str(error.value)
    assert "\n" not in str(error.value)
    assert error.value.hint
    assert not drive_files(root)


@pytest.mark.parametrize("kind", ["half", "step", "folder", "effect"])
def test_a_bad_model_ends_the_command_with_code_1(root, capsys, kind):
    """One line that says why, and a hint."""
    spoil(root, kind)
    words = ["--port", "virtual", "--clock", "poses", "--model", str(root / NAMED)]
    assert command(["drive", str(root), *words]) == 1
    said = capsys.readouterr().err.strip().splitlines()
    (error,) = [line for line in said if line.startswith("zfcal: error: ")]
    assert "extended.toml" in error
    assert said[-1].startswith("hint: ")
    assert "Traceback" not in "".join(said)


def test_a_missing_model_is_wrong_usage(root, capsys):
    """Exit code 2, and its name."""
    words = ["--port", "virtual", "--clock", "poses", "--model", str(root / "models/nothing.toml")]
    assert command(["drive", str(root), *words]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert "--model" in said
    assert "does not exist" in said


@pytest.mark.parametrize(
    "words",
    [
        ["--stop", "--port", "/dev/nothing"],
        ["--publish", "cats2://rig"],
        ["--replay"],
    ],
    ids=lambda words: words[0],
)
def test_a_model_that_cannot_take_effect_is_wrong_usage(root, capsys, words):
    """Nothing is driven by it there."""
    assert command(["drive", str(root), *words, "--model", str(root / NAMED)]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert f"--model cannot be given with {words[0]}" in said
    assert not drive_files(root)


def test_the_command_drives_by_the_model_that_is_named(root, capsys):
    """And says so."""
    words = ["--port", "virtual", "--clock", "poses", "--model", str(root / NAMED)]
    assert command(["drive", str(root), *words, "--duration", "2s"]) == 0
    captured = capsys.readouterr()
    assert "models/extended.toml drives." in captured.err
    assert captured.out.split() == [str(root / "drive" / "000000.mcap")]
    assert command(["drive", str(root), "--replay"]) == 0

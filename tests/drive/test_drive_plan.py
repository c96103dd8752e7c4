"""What a drive says before it drives, and that it ends where no poses can come any more."""

import importlib.util
from pathlib import Path

import pytest

from zfcal.artifacts.drive_files import drive_files, read_drive
from zfcal.drive.drive import drive
from zfcal.drive.options import DriveOptions
from zfcal.errors import InputError
from zfcal.stages.events import Note, Planned, Result
from zfcal.stages.trial_context import Task
from zfcal_cli.main import run

_spec = importlib.util.spec_from_file_location("driven", Path(__file__).with_name("driven.py"))
driven = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(driven)

BY_POSES = DriveOptions(port="virtual", clock="poses", duration_s=2.0)


@pytest.fixture
def recorded(tmp_path):
    """Return a trial with poses of 4 s."""
    root = driven.make_trial(tmp_path / "trial")
    driven.write_poses(root, driven.frames_of(root, 4))
    return root


@pytest.fixture
def imported(tmp_path):
    """Return a trial of 8 s of imported tracks, and no poses."""
    root = driven.make_trial(tmp_path / "trial")
    rows = ["time_s,agent,kind,x_m,y_m"]
    for poses in driven.frames_of(root, 8):
        kinds = ["robot" if agent.agent == 4 else "fish" for agent in poses.agents]
        rows += [
            f"{poses.time_s:.6f},{a.agent},{kind},{a.x_m:.4f},{a.y_m:.4f}"
            for a, kind in zip(poses.agents, kinds, strict=True)
        ]
    source = tmp_path / "tracks.csv"
    source.write_text("\n".join(rows) + "\n")
    assert run(["import", str(source), str(root), "--format", "csv", "-q"]) == 0
    return root


def files_of(root):
    """Return the files of a trial and what is in them."""
    return {path: path.read_bytes() for path in sorted(root.rglob("*")) if path.is_file()}


def test_a_dry_run_says_the_first_target_of_the_drive(recorded):
    """What it says is what the log of the drive that follows says; it has written nothing."""
    before, told = files_of(recorded), []
    drive(recorded, BY_POSES, told.append, task=Task(dry_run=True))
    assert files_of(recorded) == before
    (result,) = [event.value for event in told if isinstance(event, Result)]
    assert [e.path.name for e in told if isinstance(e, Planned)] == ["000000.mcap"]
    assert any("models/000000.toml" in e.text for e in told if isinstance(e, Note))
    drive(recorded, BY_POSES, lambda _: None)
    items = [item for path in drive_files(recorded).values() for item in read_drive(path)]
    target = next(item for item in items if item["what"] == "target")
    assert result["first"]["x_m"] == target["x_m"]
    assert result["first"]["speed_m_s"] == target["speed_m_s"]


def test_a_dry_run_is_refused_where_the_drive_would_be(recorded):
    """The log of an earlier drive is in the way; with --force it would go."""
    drive(recorded, BY_POSES, lambda _: None)
    with pytest.raises(InputError, match="earlier drive"):
        drive(recorded, BY_POSES, lambda _: None, task=Task(dry_run=True))
    told, before = [], files_of(recorded)
    drive(recorded, BY_POSES, told.append, task=Task(dry_run=True, force=True))
    assert any("would remove 1 files" in e.text for e in told if isinstance(e, Note))
    assert files_of(recorded) == before


def test_a_dry_run_says_that_a_port_is_not_there(recorded, capsys):
    """It opens none; with --json all of it is in the document."""
    words = ["drive", str(recorded), "--port", "/dev/no-such-port", "--dry-run"]
    assert run(words) == 0
    said = capsys.readouterr().err
    assert "/dev/no-such-port, which is not there now" in said
    assert "STOP until new poses come" in said
    assert "nothing was written" in said


@pytest.mark.parametrize("other", ["--stop", "--replay", "--events"])
def test_a_dry_run_is_that_of_a_drive(recorded, capsys, other):
    """Options that could not take effect are wrong usage."""
    assert run(["drive", str(recorded), "--port", "virtual", "--dry-run", other]) == 2
    assert "--dry-run" in capsys.readouterr().err


@pytest.mark.parametrize("clock", ["wall", "poses"])
def test_a_drive_of_imported_tracks_ends_with_a_hint(imported, monkeypatch, clock):
    """No process writes poses, and none will; nothing is left of the drive."""
    monkeypatch.setattr("zfcal.drive.loop._OVER_S", 0.3)
    with pytest.raises(InputError, match="the recording has ended") as caught:
        drive(imported, DriveOptions(port="virtual", clock=clock), lambda _: None)
    assert "zfcal track writes" in caught.value.hint
    assert not drive_files(imported)


@pytest.mark.slow
def test_a_drive_ends_with_its_recording(imported, monkeypatch):
    """Poses came, then the recording had its end: that is no error."""
    monkeypatch.setattr("zfcal.drive.loop._OVER_S", 1.0)
    with driven.LivePoses(imported, driven.frames_of(imported, 8)):
        because = drive(imported, DriveOptions(port="virtual"), lambda _: None)
    assert because == "the recording has ended"
    assert drive_files(imported)

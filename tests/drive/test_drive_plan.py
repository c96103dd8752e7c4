"""What a drive says before it drives, and that it ends only where no poses can come."""

import dataclasses
import importlib.util
import os
import threading
from pathlib import Path

import pytest

from zfcal.artifacts.drive_files import drive_files, read_drive
from zfcal.artifacts.lineage import read_lineage
from zfcal.artifacts.lock import lock
from zfcal.artifacts.segments import segment_path
from zfcal.artifacts.tables import read_extra, read_tracks, write_tracks
from zfcal.drive.drive import drive
from zfcal.drive.ending import can_no_tracker_come, is_recorded
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


def written_by(root, command):
    """Let the segment say that another command made it, to its end as before."""
    path = segment_path(root, 0)
    lineage = dataclasses.replace(read_lineage(path), command=command)
    stretch = read_extra(path)["recording_s"]
    write_tracks(path, read_tracks(path), lineage, extra={"recording_s": stretch})


def test_no_tracker_comes_to_imported_tracks(imported):
    """Nor to simulated ones. Without tracks, or a file of them, one can."""
    assert can_no_tracker_come(imported)
    written_by(imported, "simulate")
    assert can_no_tracker_come(imported)
    segment_path(imported, 0).unlink()
    assert not can_no_tracker_come(imported)
    (imported / "tracks").rmdir()
    assert not can_no_tracker_come(imported)


def test_a_tracker_may_go_on_with_tracks_of_a_tracker(imported):
    """An earlier `track --duration` closed them, and says to where it went."""
    written_by(imported, "track")
    assert not can_no_tracker_come(imported)


@pytest.mark.parametrize("name", ["000000.mcap", "000060.mcap.part"])
def test_a_file_of_poses_that_is_newer_says_that_a_tracker_is_there(imported, name):
    """Whatever is in it, and whole or not; an older one says nothing."""
    path = imported / "poses" / name
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(b"")
    written_s = segment_path(imported, 0).stat().st_mtime
    os.utime(path, (written_s + 1, written_s + 1))
    assert not can_no_tracker_come(imported)
    os.utime(path, (written_s - 1, written_s - 1))
    assert can_no_tracker_come(imported)


@pytest.mark.parametrize("command", ["track", "watch-track", "watch-analyse"])
def test_a_tracker_that_is_at_work_may_yet_write_poses(imported, command):
    """One that compiles first holds its lock; when it is gone the lock file stays."""
    with lock(imported, command):
        assert not can_no_tracker_come(imported)
    assert can_no_tracker_come(imported)
    with lock(imported, command):
        pass


@pytest.mark.parametrize("spoil", ["damaged", "loop", "loop of the folder", "half an import"])
def test_tracks_that_cannot_be_read_end_no_drive(imported, spoil):
    """An error of the disk is none of the experiment."""
    path = segment_path(imported, 0)
    if spoil == "damaged":
        path.write_bytes(b"PAR1")
    elif spoil == "loop":
        path.unlink()
        path.symlink_to(path)
    elif spoil == "loop of the folder":
        path.unlink()
        path.parent.rmdir()
        path.parent.symlink_to(path.parent)
    else:
        extra = {"recording_s": [0.0, 120.0]}
        write_tracks(path, read_tracks(path), read_lineage(path), extra=extra)
    assert not can_no_tracker_come(imported)
    assert spoil == "half an import" or not is_recorded(imported)


@pytest.mark.slow
def test_a_live_drive_goes_on_while_the_tracker_pauses(imported, monkeypatch):
    """Poses come, pause, and come again: whatever the tracks say, the duration alone ends it."""
    monkeypatch.setattr("zfcal.drive.loop._OVER_S", 0.2)
    with driven.LivePoses(imported, driven.frames_of(imported, 8)) as poses:
        timers = [threading.Timer(0.7, poses.freeze), threading.Timer(1.7, poses.thaw)]
        for timer in timers:
            timer.start()
        because = drive(imported, DriveOptions(port="virtual", duration_s=2.0), lambda _: None)
    assert because == "the duration is over"


@pytest.mark.slow
def test_a_live_drive_waits_for_a_tracker_that_starts_late(imported, monkeypatch):
    """It holds its lock while it compiles; tracks are looked at once, and never again."""
    monkeypatch.setattr("zfcal.drive.loop._OVER_S", 0.2)
    looks = []

    def look(root):
        looks.append(can_no_tracker_come(root))
        return looks[-1]

    monkeypatch.setattr("zfcal.drive.loop.can_no_tracker_come", look)
    poses = driven.LivePoses(imported, driven.frames_of(imported, 4))
    begin = threading.Timer(1.5, poses.__enter__)
    with lock(imported, "track"):
        begin.start()
        because = drive(imported, DriveOptions(port="virtual", duration_s=0.5), lambda _: None)
        poses.__exit__()
    assert because == "the duration is over"
    assert looks == [False]

"""Poses and logs that were cut short: what is lost is said, by a drive and by a replay."""

import importlib.util
import os
import shutil
import time
from pathlib import Path

import pytest

from zfcal.artifacts.drive_files import drive_files
from zfcal.drive import loop
from zfcal.drive.drive import DriveOptions, drive
from zfcal.drive.pilot import Manner
from zfcal.drive.replay import replay
from zfcal.stages.events import LeftOut, Note, say_nothing
from zfcal.stages.trial_context import Task

_spec = importlib.util.spec_from_file_location("driven", Path(__file__).with_name("driven.py"))
driven = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(driven)


@pytest.fixture(scope="module")
def template(tmp_path_factory):
    """Return a trial with 8 s of poses about the end of its first minute, and its drive's log."""
    root = driven.make_trial(tmp_path_factory.mktemp("driven") / "trial")
    driven.write_poses(root, driven.frames_of(root, 8, first=56 * driven.FPS))
    go(root)
    return root


@pytest.fixture
def root(template, tmp_path):
    """Return a copy of that trial, which a test may change."""
    return Path(shutil.copytree(template, tmp_path / "trial"))


def go(root, *, duration_s=8 - 1 / 15):
    """Drive over the recorded poses anew, and return what was told."""
    told = []
    options = DriveOptions(port="virtual", clock="poses", duration_s=duration_s, manner=Manner())
    drive(root, options, told.append, task=Task(force=True))
    return told


def cut(path, share=2):
    """Cut a file short, an hour ago."""
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // share])
    then_s = time.time() - 3600
    os.utime(path, (then_s, then_s))


def left_out(told):
    """Return the files of which something was left out, and the sentences."""
    return [(event.path, event.problem) for event in told if isinstance(event, LeftOut)]


def test_a_drive_says_which_poses_were_cut(root):
    """When it ends: the minute was followed by another one."""
    path = root / "poses" / "000000.mcap"
    cut(path)
    [(where, says)] = left_out(go(root))

    assert where == path
    assert says.startswith(f"{path}: was cut short, or its writer was stopped")
    assert "bytes behind the last whole record are lost" in says


def test_a_drive_to_the_end_of_poses_that_were_cut_says_so(root, monkeypatch):
    """Nobody has added to the last file for a while."""
    monkeypatch.setattr(loop, "_CUT_S", 0.2)
    path = root / "poses" / "000060.mcap"
    cut(path)

    assert [where for where, _ in left_out(go(root, duration_s=None))] == [path]


def test_whole_poses_and_a_whole_log_lack_nothing(root):
    """Nor does a drive that ends before its poses do."""
    assert left_out(go(root, duration_s=6.0)) == []
    told = []
    assert replay(root, told.append).is_same
    assert left_out(told) == []


def test_a_replay_says_what_is_lost_of_a_log_that_was_cut(root):
    """What lies before the cut came out the same."""
    path = drive_files(root)[60]
    n_whole = replay(root, say_nothing).targets
    cut(path)
    told = []
    tally = replay(root, told.append)

    [(where, says)] = left_out(told)
    assert where == path
    assert f"of {path.stat().st_size} bytes are lost" in says
    assert tally.is_same
    assert 0 < tally.targets < n_whole
    assert tally.not_compared == 0


def test_what_differs_behind_a_loss_is_not_held_against_the_driver(root):
    """What it knew stood in the part that is gone; how many these are is said."""
    cut(drive_files(root)[0])
    told = []
    tally = replay(root, told.append)

    assert [where for where, _ in left_out(told)] == [drive_files(root)[0]]
    assert tally.is_same
    assert tally.not_compared > 0
    says = f"; {tally.not_compared} behind what is lost could not be compared."
    assert [e.text.endswith(says) for e in told if isinstance(e, Note)] == [True]


def test_a_replay_says_that_its_poses_were_cut(root):
    """What came out in another way for that reason is not held against the driver."""
    for start_s in (0, 60):
        path = root / "poses" / f"{start_s:06d}.mcap"
        whole = path.read_bytes()
        cut(path)
        told = []
        tally = replay(root, told.append)
        assert tally.is_same
        assert tally.not_compared > 0
        assert tally.frames_lost > 0
        assert [where for where, _ in left_out(told)] == [path]
        path.write_bytes(whole)


def test_a_minute_that_its_tracker_is_about_to_close_is_not_cut(root):
    """It was written to just now, and the drive ends with the first frame of the next."""
    path = root / "poses" / "000000.mcap"
    cut(path)
    path.touch()

    assert left_out(go(root)) == []

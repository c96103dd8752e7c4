"""The driver as a process, on a live trial in which bad files and frames lie beside the good."""

import importlib.util
import json
import math
import os
import shutil
from pathlib import Path

import pytest

from zfcal.drive.models import DriveModels
from zfcal.drive.pilot import Manner, Pilot
from zfcal.robot.fishbot import FishBot
from zfcal.stages.trial_context import open_trial


def _load(name):
    spec = importlib.util.spec_from_file_location(name, Path(__file__).with_name(f"{name}.py"))
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


driven, faults = _load("driven"), _load("test_drive_faults")

pytestmark = pytest.mark.slow

FIRST_S = 50
"""The poses begin so late in their minute: the file of the next one comes soon."""

SECONDS = 40


@pytest.fixture(scope="module")
def template(tmp_path_factory):
    """Return a trial and frames for it."""
    root = driven.make_trial(tmp_path_factory.mktemp("live") / "trial")
    opened = open_trial(root)
    Pilot(opened, Manner(), FishBot("F", None)).warm_up(DriveModels(opened).first())
    return root, driven.frames_of(root, SECONDS, first=FIRST_S * driven.FPS)


@pytest.fixture(scope="module")
def forks(forking):
    """Return what runs drivers that have loaded what they need."""
    with forking.Forks() as made:
        yield made


@pytest.fixture
def rig(template, forks, tmp_path):
    """Return a rig whose poses have begun."""
    root = Path(shutil.copytree(template[0], tmp_path / "trial"))
    made = faults.Rig(root, template[1], forks)
    with made.poses:
        yield made
    made.close()


def drives_on(rig, *, moves=5):
    """Wait until the robot has heard of some more moves."""
    known = rig.moves()
    rig.until(lambda: rig.moves() > known + moves)


def test_what_is_no_pose_file_does_not_keep_the_next_one_from_being_driven_by(rig):
    """A folder, a loop of links and a pipe come between two minutes: not one tick is held."""
    rig.start()
    drives_on(rig)
    poses = rig.root / "poses"
    (poses / "000030.mcap").mkdir()
    (poses / "000031.mcap").symlink_to("000031.mcap")
    os.mkfifo(poses / "000032.mcap")
    rig.until((poses / "000060.mcap").exists)
    drives_on(rig, moves=20)
    assert rig.items("command")[-1]["time_s"] > 60
    assert not rig.told("fault")
    rig.end()
    for number in (30, 31, 32):
        assert rig.said().count(f"poses/{number:06d}.mcap: cannot be read") == 1


@pytest.mark.parametrize("ahead_s", [1e6, 9e9])
def test_frames_stamped_in_the_far_future_are_left_out(rig, ahead_s):
    """They are no poses: the robot is stopped while there are no others, and goes on after them."""
    rig.start()
    drives_on(rig)
    rig.poses.ahead_s = ahead_s
    rig.until(lambda: rig.heard()[-1][1] == faults.STOP)
    rig.poses.ahead_s = 0.0
    drives_on(rig)
    rig.end()
    assert rig.items("command")[-1]["time_s"] < FIRST_S + SECONDS
    assert "poses/000000.mcap: " in rig.said()
    assert "bug in zfcal" not in rig.said()


@pytest.mark.parametrize(
    ("name", "value"),
    [("x_m", math.nan), ("x_m", math.inf), ("y_m", -1e308), ("heading_rad", 1e308)],
)
def test_a_pose_of_the_robot_that_is_none_stops_it_until_the_next_good_one(
    rig, monkeypatch, name, value
):
    """It is told what is wrong, once, and the driver goes on."""
    # A tracker of others writes what zfcal's own refuses to write.
    monkeypatch.setattr("zfcal.artifacts.pose_messages.to_json", json.dumps)
    rig.start()
    drives_on(rig)
    rig.poses.changes = {name: value}
    rig.until(lambda: rig.heard()[-1][1] == faults.STOP)
    rig.poses.changes = {}
    drives_on(rig)
    rig.end()
    assert rig.said().count("agent 4 has no pose") == 1
    assert "bug in zfcal" not in rig.said()


def test_the_next_good_model_drives_whatever_lies_beside_it(rig):
    """Models of brackets, of a number without end, of 30 MB, and what is no file."""
    rig.start()
    drives_on(rig)
    models = rig.root / "models"
    bad = {
        "000120.toml": "a = " + "[" * 100_000,
        "000180.toml": "schema = " + "9" * 5001,
        "000240.toml": "# " + "x" * 30_000_000,
    }
    for name, text in bad.items():
        (models / name).write_text(text)
    os.mkfifo(models / "000300.toml")
    (models / "000360.toml").symlink_to("000360.toml")
    (models / "000420.toml").mkdir()
    driven.add_model(rig.root, 60)
    rig.until(lambda: [t for t in rig.items("target") if t["model"] == "models/000060.toml"])
    drives_on(rig)
    driven.add_model(rig.root, 480, seed=6)
    rig.until(lambda: [t for t in rig.items("target") if t["model"] == "models/000480.toml"])
    rig.end()
    assert "stale-pose" not in {fault["fault"] for fault in rig.told("fault")}
    for name in (*bad, "000300.toml", "000360.toml", "000420.toml"):
        assert f"models/{name}" in rig.said()

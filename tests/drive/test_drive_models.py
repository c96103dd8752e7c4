"""Which model drives, and from when on: on a rig, and where rounds are done sooner than there."""

import importlib.util
import os
import re
from pathlib import Path

import pytest

from zfcal.drive.models import DriveModels
from zfcal.stages.trial_context import open_trial

_spec = importlib.util.spec_from_file_location("driven", Path(__file__).with_name("driven.py"))
driven = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(driven)


@pytest.fixture
def opened(tmp_path):
    """Return a trial with the models of three windows beside the starting one."""
    root = driven.make_trial(tmp_path / "trial")
    start = (root / "models" / "000000.toml").read_bytes()
    for second in (120, 180, 240):
        (root / "models" / f"{second:06d}.toml").write_bytes(start)
    return open_trial(root)


def names(models, seconds):
    """Return the model that a look at each of some seconds brings; None for no news."""
    found = [models.look(second) for second in seconds]
    return [each and each.name.removeprefix("models/") for each in found]


def test_the_newest_drives_as_soon_as_it_is_there(opened):
    """Whatever the time says: a trial may begin with models of an older one."""
    models = DriveModels(opened)
    assert models.first().name == "models/000240.toml"
    assert names(models, [0.0, 500.0]) == [None, None]
    assert names(DriveModels(opened), [3.0]) == ["000240.toml"]


def test_a_model_that_is_there_too_soon_waits(opened):
    """Until so many seconds after its window has ended, and not a frame longer."""
    models = DriveModels(opened, after_s=55.0)
    assert names(models, [0.0, 174.9, 175.0, 175.2, 234.9, 235.0]) == [
        *("000000.toml", None, "000120.toml", None, None, "000180.toml")
    ]


def test_one_that_comes_late_drives_at_once(opened):
    """Past its time nothing is waited for, and one that was missed is passed over."""
    late = opened.trial.root / "models" / "000300.toml"
    models = DriveModels(opened, after_s=55.0)
    assert names(models, [300.0, 400.0]) == ["000240.toml", None]
    late.write_bytes((late.parent / "000000.toml").read_bytes())
    assert names(models, [400.2]) == ["000300.toml"]


def test_the_starting_model_waits_for_nobody(opened):
    """It has no window."""
    for second in (120, 180, 240):
        (opened.trial.root / "models" / f"{second:06d}.toml").unlink()
    assert names(DriveModels(opened, after_s=55.0), [0.0, 1.0]) == ["000000.toml", None]


@pytest.mark.parametrize("kind", ["brackets", "digits", "large", "folder", "pipe", "loop", "nan"])
def test_a_bad_model_is_named_once_and_the_one_before_drives(opened, kind):
    """A good one behind it drives."""
    models = DriveModels(opened)
    assert models.first().name == "models/000240.toml"
    bad = opened.trial.root / "models" / "000300.toml"
    good = bad.with_name("000240.toml").read_bytes()
    texts = {
        "brackets": b"a = " + b"[" * 100_000,
        "digits": b"a = " + b"9" * 5001,
        "large": good + b"\n#" + b"x" * 30_000_000,
        "nan": re.sub(rb"fov_rad = [0-9.]+", b"fov_rad = nan", good),
    }
    if kind in texts:
        bad.write_bytes(texts[kind])
    elif kind == "folder":
        bad.mkdir()
    elif kind == "pipe":
        os.mkfifo(bad)
    else:
        bad.symlink_to(bad.name)
    assert models.look() is None
    assert "000300.toml" in models.problem
    assert models.look() is None
    assert models.problem == ""
    bad.with_name("000360.toml").write_bytes(good)
    assert models.look().name == "models/000360.toml"


def test_bad_models_that_come_at_once_are_all_named(opened):
    """Not the last one alone."""
    models = DriveModels(opened)
    models.first()
    for second in (300, 360, 420):
        (opened.trial.root / "models" / f"{second:06d}.toml").write_text("half of it = ")
    assert models.look() is None
    assert re.findall(r"000\d{3}\.toml", models.problem) == [
        "000420.toml",
        "000360.toml",
        "000300.toml",
    ]

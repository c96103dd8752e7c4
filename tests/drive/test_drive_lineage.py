"""Where a drive's log comes from: each file names the model by which it begins, with its hash."""

import hashlib
import importlib.util
import shutil
from pathlib import Path

import pytest

from zfcal.artifacts.drive_files import DRIVE, drive_files, read_drive
from zfcal.artifacts.freshness import hash_inputs
from zfcal.artifacts.lineage import Lineage, read_lineage
from zfcal.drive.drive import DriveOptions, drive
from zfcal.drive.log import DriveLog
from zfcal.drive.replay import replay
from zfcal.stages.events import Made, say_nothing
from zfcal.stages.trial_context import Task, open_trial
from zfcal.virtual import demo_steps

_spec = importlib.util.spec_from_file_location("driven", Path(__file__).with_name("driven.py"))
driven = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(driven)

ARENA = {"tank.geojson": "a" * 64}
OLD, NEW = ("models/000000.toml", "0" * 64), ("models/000120.toml", "1" * 64)


@pytest.fixture(scope="module")
def template(tmp_path_factory):
    """Return a trial with 4 s of poses about the end of its first minute."""
    root = driven.make_trial(tmp_path_factory.mktemp("driven") / "trial")
    driven.write_poses(root, driven.frames_of(root, 4, first=58 * driven.FPS))
    return root


@pytest.fixture
def root(template, tmp_path):
    """Return a copy of that trial, which a test may change."""
    return Path(shutil.copytree(template, tmp_path / "trial"))


def inputs_of(root):
    """Return the inputs that each file of a log states, in order."""
    return [dict(read_lineage(path).inputs) for path in drive_files(root).values()]


def logged(root, batches):
    """Write models and other messages of a log, batch by batch; return the inputs of its files."""
    lineage = Lineage(schema=DRIVE, command="drive", inputs=ARENA)
    log = DriveLog(open_trial(root).trial, lineage, say_nothing)
    for batch in batches:
        for time_s, model in batch:
            item = {"what": "fault", "time_s": time_s, "fault": "x", "says": "x", "ended": False}
            if model is not None:
                name, sha256 = model
                item = {"what": "model", "time_s": time_s, "model": name, "sha256": sha256}
            log.add(item)
        log.flush()
    log.close()
    return inputs_of(root)


def test_each_file_states_the_hash_of_the_model_and_of_the_arena(root, repository):
    """As the artifacts of other commands do; the second file has no model among its messages."""
    shutil.copy(repository / "zfcal" / "arenas" / "two-rooms.geojson", root / "tank.geojson")
    config = root / "trial.toml"
    config.write_text(config.read_text().replace('"two-rooms"', '"tank.geojson"'))
    drive(root, DriveOptions(port="virtual", clock="poses", duration_s=3.9), say_nothing)

    paths = [root / "models" / "000000.toml", root / "tank.geojson"]
    assert inputs_of(root) == [hash_inputs(root, paths)] * 2
    last = drive_files(root)[60]
    assert "model" not in {item["what"] for item in read_drive(last)}
    assert replay(root, say_nothing).is_same


def test_a_model_that_is_named_is_an_input_by_its_content(root):
    """A round's newer one is none."""
    path = driven.add_model(root, 120)
    named = path.rename(root / "models" / "mine.toml")
    driven.add_model(root, 180, seed=6)
    options = DriveOptions(port="virtual", clock="poses", model=named, duration_s=1.0)
    drive(root, options, say_nothing)

    sha256 = hashlib.sha256(named.read_bytes()).hexdigest()
    assert inputs_of(root) == [{"models/mine.toml": sha256}]


@pytest.mark.parametrize("is_apart", [False, True])
@pytest.mark.parametrize("changed_s", [59.0, 60.0])
def test_a_new_model_is_an_input_from_the_next_file_on(root, changed_s, is_apart):
    """However many messages are written at once: the same log, the same bytes."""
    items = [(58.0, OLD), (58.5, None), (changed_s, NEW), (60.2, None), (61.0, None)]
    batches = [[item] for item in items] if is_apart else [items]

    assert logged(root, batches) == [ARENA | dict([OLD]), ARENA | dict([NEW])]


def test_a_model_within_a_file_is_no_input_of_that_file(root):
    """Its hash stands among the messages."""
    items = [(1.0, OLD), (1.1, None), (2.0, NEW), (2.1, None)]

    assert logged(root, [items]) == [ARENA | dict([OLD])]


@pytest.mark.slow
def test_a_demonstration_drives_once_by_each_newest_model(root, monkeypatch):
    """What the log states as its model is compared with the newest one."""
    monkeypatch.setattr(demo_steps, "DRIVE_S", 3.0)
    made = []
    for second in (None, None, 120):
        heard = []
        if second is not None:
            driven.add_model(root, second)
        demo_steps.drive_demo(root, heard.append, task=Task())
        made.append(any(isinstance(event, Made) for event in heard))

    assert made == [True, False, True]
    assert [list(inputs) for inputs in inputs_of(root)] == [["models/000120.toml"]] * 2

"""Rounds that were passed over stay so, and the others stay what they are."""

import json

import pytest

from zfcal.artifacts.checking import check_trial
from zfcal.artifacts.findings import ERROR
from zfcal.artifacts.lineage import read_lineage
from zfcal.artifacts.validation import check
from zfcal.stages.analyse.analyse import AnalyseOptions, analyse
from zfcal.stages.calibrate.calibrate import calibrate
from zfcal.stages.events import Made, Note, say_nothing
from zfcal.stages.skipping import skipped_ends, skipped_path, write_skipped
from zfcal.stages.trial_context import Task


@pytest.fixture
def trial(make_trial):
    """Return a trial with windows that end at 120 s, 180 s and 240 s."""
    root = make_trial(seconds=240)
    analyse(root, AnalyseOptions(), say_nothing)
    return root


def models(root):
    """Return the names of the models but the starting one."""
    return sorted(path.name for path in (root / "models").glob("*.toml"))[1:]


def skip(root, end_s=180):
    """Pass a window over."""
    return write_skipped(root, end_s, went_on_with_s=end_s + 60, because="It came late.")


def test_a_record_is_an_artifact_of_its_schema(trial):
    """It holds why, which window came instead, and the hash of the statistics; check knows it."""
    path = skip(trial)
    assert path == skipped_path(trial, 180) == trial / "models" / "000180.skipped.json"
    check(json.loads(path.read_text()), "skipped", path)
    lineage = read_lineage(path)
    assert (lineage.schema, lineage.command) == ("zfcal.skipped/1", "watch")
    assert list(lineage.inputs) == ["stats/000180.parquet"]
    assert skipped_ends(trial) == {180}
    found = check_trial(trial)
    assert [each for each in found if each.level == ERROR or each.where.endswith(".json")] == []


def test_a_round_that_was_passed_over_is_left_out_and_said(trial, quick, heard):
    """The round after it starts from the one before it, and the next run has nothing to do."""
    skip(trial)
    calibrate(trial, quick, heard.append)
    assert models(trial) == ["000120.toml", "000240.toml"]
    inputs = read_lineage(trial / "models" / "000240.toml").inputs
    assert "models/000120.parquet" in inputs
    notes = [event.text for event in heard if isinstance(event, Note)]
    assert any("000180.skipped.json: watch passed this window over" in text for text in notes)
    again = []
    calibrate(trial, quick, again.append)
    assert not [event for event in again if isinstance(event, Made)]


def test_a_later_round_does_not_bring_it_back(trial, quick):
    """Asked for the last window alone, what is missing before it is made, but not that."""
    skip(trial)
    calibrate(trial, quick, say_nothing, task=Task(ends_s=frozenset({240})))
    calibrate(trial, quick, say_nothing, task=Task(ends_s=frozenset({240}), force=True))
    assert models(trial) == ["000120.toml", "000240.toml"]


def test_force_makes_it_and_removes_the_record(trial, quick, read_all, copy_trial):
    """All rounds are then what they would be without it."""
    other = copy_trial(trial, "other")
    skip(trial)
    calibrate(trial, quick, say_nothing)
    calibrate(trial, quick, say_nothing, task=Task(force=True))
    calibrate(other, quick, say_nothing)
    assert skipped_ends(trial) == set()
    assert read_all(trial) == read_all(other)


def test_a_record_without_statistics_and_one_of_another_name(trial):
    """What was passed over before its statistics came has no inputs; other files are none."""
    (trial / "models" / "12.skipped.json").write_text("{}")
    assert read_lineage(skip(trial, 300)).inputs == {}
    assert skipped_ends(trial) == {300}


def test_a_window_that_is_not_asked_for_is_not_spoken_of(trial, quick, heard):
    """Nor does an empty set of windows stumble."""
    skip(trial)
    calibrate(trial, quick, heard.append, task=Task(ends_s=frozenset({120})))
    calibrate(trial, quick, heard.append, task=Task(ends_s=frozenset()))
    assert not [event for event in heard if isinstance(event, Note) and "passed" in event.text]


def test_records_differ_by_what_they_say_alone(trial):
    """The same words make the same bytes."""
    first = skip(trial).read_bytes()
    assert skip(trial).read_bytes() == first

"""What the stages of a watch do with an order, in this process."""

import dataclasses
import json

import pytest

from zfcal.artifacts.models import read_result
from zfcal.artifacts.validation import check
from zfcal.online.watch_events import Happened, Skipped, Takes, told_by
from zfcal.online.watch_stages import (
    AnalyseStage,
    CalibrateStage,
    Turn,
    is_of_a_round,
)
from zfcal.stages.analyse.analyse import AnalyseOptions, analyse
from zfcal.stages.calibrate.calibrate import calibrate
from zfcal.stages.events import LeftOut, Made, Note, say_nothing
from zfcal.stages.recording import STRETCH_KEY, has_ended
from zfcal.stages.skipping import skipped_ends, skipped_path
from zfcal.stages.trial_context import Task


@pytest.fixture
def trial(make_trial):
    """Return a trial with statistics to 120 s, 180 s, 240 s and 300 s."""
    root = make_trial(seconds=300)
    analyse(root, AnalyseOptions(), say_nothing)
    return root


@pytest.fixture
def within(quick):
    """Return options with a budget instead of generations."""
    settings = dataclasses.replace(quick.settings, generations=None)
    return dataclasses.replace(quick, settings=settings, budget_s=50.0)


def stage(root, options, now_s=0.0):
    """Return the stage that calibrates, with a clock that stands still."""
    return CalibrateStage(root=root, options=options, clock=lambda: now_s)


def models(root):
    """Return the ends of the windows that have a model."""
    return [int(path.stem) for path in sorted((root / "models").glob("*.toml"))][1:]


def test_one_window_a_turn_until_there_are_no_more(trial, quick, heard):
    """Oldest first; the last turn has nothing to do."""
    turn = Turn(seen_s={240: 0.0, 120: 0.0, 180: 0.0})
    outcomes = [stage(trial, quick)(turn, heard.append).end_s for _ in range(4)]
    assert outcomes == [120, 180, 240, None]
    assert models(trial) == [120, 180, 240]
    assert [event.end_s for event in heard if isinstance(event, Takes)] == [120, 180, 240]


def test_what_is_overdue_is_passed_over_and_written_down(trial, quick, heard):
    """A round took two minutes: the next ones are skipped, and the newest starts from before."""
    seen_s = {120: 0.0, 180: 60.0, 240: 120.0, 300: 180.0}
    stage(trial, quick)(Turn(seen_s={120: 0.0}, due_after_s=60.0), say_nothing)
    outcome = stage(trial, quick, 200.0)(Turn(seen_s=seen_s, due_after_s=60.0), heard.append)
    assert outcome.end_s == 300
    assert skipped_ends(trial) == {180, 240}
    assert models(trial) == [120, 300]
    told = [event for event in heard if isinstance(event, Skipped)]
    assert [(event.end_s, event.went_on_with_s) for event in told] == [(180, 300), (240, 300)]
    document = json.loads(skipped_path(trial, 180).read_text())
    assert document["because"] == "It waited for 140 s while a round before it overran."


def test_offline_after_a_skip_there_is_nothing_to_do(trial, quick, heard):
    """The record is honoured by the command, which says so."""
    seen_s = {120: 0.0, 180: 60.0}
    stage(trial, quick, 100.0)(Turn(seen_s=seen_s, due_after_s=60.0), say_nothing)
    calibrate(trial, quick, heard.append, task=Task(ends_s=frozenset(seen_s)))
    assert models(trial) == [180]
    assert not [event for event in heard if isinstance(event, Made)]
    assert any(
        isinstance(event, Note) and "passed this window over" in event.text for event in heard
    )


@pytest.mark.parametrize(("now_s", "budget_s"), [(1.0, 50.0), (40.0, 15.0), (58.0, 5.0)])
def test_a_late_round_gets_what_is_left(trial, within, heard, monkeypatch, now_s, budget_s):
    """Of 60 s since its tracks were there, less 5 s, at least 5 s."""
    given = []
    monkeypatch.setattr("zfcal.stages.calibrate.calibrate.calibrate", spy(given))
    stage(trial, within, now_s)(Turn(seen_s={120: 0.0}, due_after_s=60.0), heard.append)
    assert [event.budget_s for event in heard if isinstance(event, Takes)] == [budget_s]
    assert given == [budget_s]


def spy(given):
    """Return `calibrate`, which notes the budget that it was given and does the dry runs."""

    def call(root, options, tell, *, task):
        if task.dry_run:
            calibrate(root, options, tell, task=task)
        else:
            given.append(options.budget_s)

    return call


def test_without_hurry_the_budget_is_whole(trial, within, heard, monkeypatch):
    """A recording that has ended waits for nobody."""
    monkeypatch.setattr("zfcal.stages.calibrate.calibrate.calibrate", spy([]))
    stage(trial, within, 1000.0)(Turn(seen_s={120: 0.0}), heard.append)
    assert [event.budget_s for event in heard if isinstance(event, Takes)] == [50.0]


def test_a_round_with_a_budget_is_made_once(trial, within, quick):
    """A window that comes late would change those after it: they stay the record of the drive."""
    brief = dataclasses.replace(within, budget_s=0.01)
    late = (trial / "stats" / "000120.parquet").rename(trial / "late")
    stage(trial, brief)(Turn(seen_s={180: 0.0}), say_nothing)
    late.rename(trial / "stats" / "000120.parquet")
    assert stage(trial, brief)(Turn(seen_s={120: 0.0}), say_nothing).end_s == 120
    assert stage(trial, brief)(Turn(seen_s={120: 0.0, 180: 0.0}), say_nothing).end_s is None
    counted = stage(trial, quick)
    assert counted(Turn(seen_s={120: 0.0, 180: 0.0}), say_nothing).end_s == 120


def test_rounds_with_a_budget_repeat_bit_by_bit(trial, within, copy_trial, read_all):
    """Each with the generations that its model records, one after the other."""
    again = copy_trial(trial, "again")
    brief = dataclasses.replace(within, budget_s=0.4)
    for end in (120, 180):
        stage(trial, brief)(Turn(seen_s={end: 0.0}), say_nothing)
        n = read_result(trial / "models" / f"{end:06d}.toml")["generations"]
        settings = dataclasses.replace(within.settings, generations=n)
        counted = dataclasses.replace(within, settings=settings, budget_s=None)
        calibrate(again, counted, say_nothing, task=Task(ends_s=frozenset({end})))
    assert read_all(trial) == read_all(again)


def test_damaged_statistics_are_left_out_and_come_with_the_outcome(trial, quick, heard):
    """Every turn says anew what is left out, so that what was mended is not counted."""
    path = trial / "stats" / "000120.parquet"
    path.write_bytes(b"PAR1")
    turn = Turn(seen_s={120: 0.0, 180: 0.0})
    outcome = stage(trial, quick)(turn, heard.append)
    assert list(outcome.left_out) == [str(path)]
    assert outcome.end_s == 180
    analyse(trial, AnalyseOptions(), say_nothing)
    assert stage(trial, quick)(turn, heard.append).left_out == {}
    assert any(isinstance(event, LeftOut) for event in heard)


def test_analysis_takes_all_windows_of_an_order(make_trial, heard):
    """Those that the order does not name are not made."""
    root = make_trial(seconds=240)
    analysing = AnalyseStage(root=root, options=AnalyseOptions())
    analysing(Turn(seen_s={120: 0.0, 180: 0.0}), heard.append)
    names = sorted(path.name for path in (root / "stats").iterdir())
    assert names == ["000120.parquet", "000180.parquet"]


def test_a_recording_ends_where_its_last_segment_says_so(tmp_path, make_trial, monkeypatch):
    """Not before all its segments are there, and not where none says so."""
    root = make_trial(seconds=240)
    whole = dict.fromkeys((0, 60, 120, 180), 0.0)
    assert not has_ended(root, whole)
    said = {180: [0.0, 240.0]}
    monkeypatch.setattr(
        "zfcal.stages.recording.read_extra",
        lambda path: {STRETCH_KEY: said[int(path.stem)]} if int(path.stem) in said else {},
    )
    assert has_ended(root, whole)
    assert not has_ended(root, dict.fromkeys((0, 60, 180), 0.0))
    assert not has_ended(root, dict.fromkeys((0, 60, 120), 0.0))
    said[180] = [0.0, 300.0]
    assert not has_ended(root, whole)


def test_every_event_of_a_stage_has_a_line_that_fits_the_schema(tmp_path):
    """But progress, which is for the status line."""
    events = [
        Made(path=tmp_path, reason="missing"),
        LeftOut(path=tmp_path, problem="It is damaged."),
        Note(text="Something.", warning=True),
        Takes(end_s=120, budget_s=None),
        Skipped(end_s=120, went_on_with_s=180, because="Late.", path=None),
    ]
    for event in events:
        line = told_by("calibrate", event, 1.23456)
        check(line.as_dict(), "watch-event", "a line")
        assert line.as_dict()["at_s"] == 1.235
    assert told_by("calibrate", object(), 0.0) is None
    assert Happened(at_s=0.0, kind="back", values={"path": "x"}).as_dict()["event"] == "back"


def test_an_order_without_windows_makes_the_stage_ready(trial, quick, heard):
    """The simulator is compiled before the first window comes; nothing is written or told."""
    before = sorted(trial.rglob("*"))
    assert stage(trial, quick)(Turn(seen_s={}), heard.append).end_s is None
    assert sorted(trial.rglob("*")) == before
    assert heard == []


@pytest.mark.parametrize(("name", "is_theirs"), [
    ("models/000120.toml", True),
    ("scores/000120-model.parquet", True),
    ("scores/000120-rules.parquet", True),
    ("scores/000120.parquet", False),
    ("stats/000120.parquet", False),
    ("tracks/000060.parquet", False),
])  # fmt: skip
def test_what_rounds_make_gives_analysis_nothing_to_do(name, is_theirs):
    """A round does not wake it."""
    assert is_of_a_round(name) is is_theirs

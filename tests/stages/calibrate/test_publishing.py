"""Rounds that judge publishing rules: their files, what depends on what, and what is told."""

import dataclasses
import shutil
import time

import numpy as np
import pytest

from zfcal.artifacts.checking import check_trial
from zfcal.artifacts.inspecting import describe
from zfcal.artifacts.lineage import read_lineage
from zfcal.artifacts.models import read_result
from zfcal.artifacts.tables import RULES, read_extra, read_table, read_tracks, write_table
from zfcal.calibrate.rules import MADE
from zfcal.errors import DamagedError, InputError
from zfcal.stages.analyse.analyse import AnalyseOptions, analyse
from zfcal.stages.calibrate import calibrate as calibrate_module
from zfcal.stages.calibrate import holdout
from zfcal.stages.calibrate.beginning import seen_first
from zfcal.stages.calibrate.calibrate import calibrate
from zfcal.stages.calibrate.holdout import Span, calibrate_span
from zfcal.stages.calibrate.rounds import RoundPlaces
from zfcal.stages.events import LeftOut, Made, Note, Progress, Result, UpToDate, say_nothing
from zfcal.stages.trial_context import Task, open_trial
from zfcal.tracks import concatenate

pytestmark = pytest.mark.slow

ENDS = (120, 180, 240, 300)


class Killed(BaseException):
    """What a test throws into a round, as a power cut would."""


@pytest.fixture(scope="module")
def analysed(analyse_once):
    """Return a trial of 5 minutes with its statistics, which nobody changes."""
    return analyse_once(300)


@pytest.fixture
def trial(analysed, tmp_path):
    """Return a copy of that trial."""
    return shutil.copytree(analysed, tmp_path / "trial")


@pytest.fixture
def forward(in_full):
    """Return options of a quick round that judges rules."""
    settings = dataclasses.replace(in_full.settings, champion="forward")
    return dataclasses.replace(in_full, settings=settings)


@pytest.fixture(scope="module")
def published(analysed, tmp_path_factory):
    """Return a trial with its four rounds."""
    return shutil.copytree(analysed, tmp_path_factory.mktemp("published") / "trial")


@pytest.fixture
def done(published, forward, tmp_path):
    """Return a copy of a trial with its four rounds, which are made once."""
    calibrate(published, forward, say_nothing)
    return shutil.copytree(published, tmp_path / "done")


def rules_of(root, end):
    """Return the path of a round's record."""
    return root / "scores" / f"{end:06d}-rules.parquet"


def made_of(events):
    """Return why files were made, by name."""
    return {event.path.name: event.reason for event in events if isinstance(event, Made)}


def test_each_round_leaves_the_record_of_all_windows_so_far(done):
    """Models of 120 s are judged at 240 s, those of 180 s at 300 s."""
    n_rows = [len(read_table(rules_of(done, end), RULES)) for end in ENDS]
    assert n_rows == [0, 0, 6, 12]
    last = read_table(rules_of(done, 300), RULES).to_pydict()
    assert list(zip(last["made_at_s"], last["window_end_s"], strict=True)) == (
        [(120, 240)] * 6 + [(180, 300)] * 6
    )
    assert set(MADE) < set(last["rule"])
    assert last["n"] == [1800] * 12


def test_a_model_file_says_what_was_published_and_why(done):
    """The first two are estimates; mean forward scores stand with the later ones."""
    found = [read_result(done / "models" / f"{end:06d}.toml") for end in ENDS]
    published = [each["published"] for each in found]
    assert [each["rule"] for each in published[:2]] == ["likelihood", "likelihood"]
    assert [each["champion"] for each in found[:2]] == ["likely", "likely"]
    assert published[0]["because"] == "no window has followed a model yet"
    assert "forward" not in published[0]
    table = read_table(rules_of(done, 300), RULES).to_pydict()
    mean = np.mean([s for s, rule in zip(table["S"], table["rule"], strict=True) if rule == "keep"])
    assert published[3]["forward"]["keep"] == pytest.approx(mean)


def test_the_lineage_names_the_record_that_a_round_carries_on(done):
    """And none in the first round; tracks are those that the estimate over all minutes reads."""
    first, last = (read_lineage(done / "models" / f"{end:06d}.toml") for end in (120, 300))
    assert not any("rules" in name for name in first.inputs)
    assert "scores/000240-rules.parquet" in last.inputs
    assert {f"tracks/{start:06d}.parquet" for start in range(0, 300, 60)} <= set(last.inputs)
    assert last.options["champion"] == "forward"
    assert read_lineage(rules_of(done, 300)).schema == RULES


def test_models_are_judged_from_where_all_were(done):
    """Poses of the tracks at 120 s, of four fish or so; the record says how leads vary."""
    opened = open_trial(done)
    start = seen_first(opened, 240)
    tracks = concatenate([read_tracks(done / "tracks" / f"{s:06d}.parquet") for s in (60, 120)])
    for agent, pose in enumerate(start.poses):
        own = (tracks.agent == agent) & (tracks.time_s <= 120.0 + 1e-9)
        last = np.flatnonzero(own)[-1]
        assert tracks.time_s[last] == pytest.approx(120.0)
        np.testing.assert_allclose(pose[:2], [tracks.x_m[last], tracks.y_m[last]], atol=1e-9)
        assert np.isfinite(pose[2])
    assert start.time_s == pytest.approx(120.0)
    noise = [read_extra(rules_of(done, end))["lead_noises"] for end in ENDS]
    assert [len(each) for each in noise] == [0, 0, 1, 2]
    assert 0 < noise[3][1] < 0.2
    assert read_extra(rules_of(done, 300))["judged_from"] == "start"
    said = read_lineage(done / "models" / "000240.toml").options
    assert said["judged_from"] == "start"


def test_a_window_whose_beginning_is_lost_has_no_start(trial):
    """Its first minute and the one before are damaged; the next window has one."""
    for start in (60, 120):
        path = trial / "tracks" / f"{start:06d}.parquet"
        path.write_bytes(path.read_bytes()[:1000])
    opened = open_trial(trial)
    assert seen_first(opened, 240) is None
    assert seen_first(opened, 120) is not None


def test_the_second_run_does_nothing(done, forward, heard, read_all):
    """Four files a window are up to date."""
    before = read_all(done)
    calibrate(done, forward, heard.append)
    assert made_of(heard) == {}
    assert sum(isinstance(event, UpToDate) for event in heard) == 16
    assert read_all(done) == before


def test_a_record_that_has_changed_makes_later_rounds_stale(done, forward, heard):
    """Of another content, but whole: its own round stays, the next ones do not."""
    path = rules_of(done, 180)
    extra = read_extra(path)
    extra["n_rounds"] = 9
    write_table(path, read_table(path, RULES), read_lineage(path), extra=extra)
    calibrate(done, forward, heard.append)
    reasons = made_of(heard)
    assert reasons["000240.toml"] == "input scores/000180-rules.parquet changed"
    assert "000300.toml" in reasons
    assert "000120.toml" not in reasons


def test_a_record_that_was_removed_is_made_again(done, published, forward, heard, read_all):
    """With its round; all ends in the same bytes."""
    rules_of(done, 180).unlink()
    calibrate(done, forward, heard.append)
    assert "000180-rules.parquet" in made_of(heard)
    assert read_all(done) == read_all(published)


def test_one_window_at_a_time_ends_in_the_same_bytes(trial, published, done, forward, read_all):
    """As a watch does it."""
    for end in ENDS:
        calibrate(trial, forward, say_nothing, task=Task(ends_s=frozenset({end})))
    assert read_all(trial) == read_all(done) == read_all(published)


def test_a_killed_round_ends_in_the_same_bytes(trial, done, forward, read_all):
    """Killed in the last round, after its second generation."""

    def kill(event):
        is_last = isinstance(event, Progress) and event.stage == "window to 300 s"
        if is_last and event.done == 2:
            raise Killed

    with pytest.raises(Killed):
        calibrate(trial, forward, kill)
    assert not rules_of(trial, 300).exists()
    calibrate(trial, forward, say_nothing)
    assert read_all(trial) == read_all(done)


def test_without_the_estimate_other_rules_are_judged(trial, quick, forward):
    """No tracks are read; score, the nearest and the model in use remain."""
    calibrate(trial, dataclasses.replace(forward, seed_likelihood=False), say_nothing)
    table = read_table(rules_of(trial, 300), RULES).to_pydict()
    assert set(table["rule"]) == {"score", "nearest", "keep"}
    inputs = read_lineage(trial / "models" / "000300.toml").inputs
    assert not any("tracks" in name for name in inputs)
    assert read_extra(rules_of(trial, 300))["judged_from"] == "long runs"
    said = read_lineage(trial / "models" / "000300.toml").options
    assert said["judged_from"] == "long runs"
    assert read_result(trial / "models" / "000120.toml")["published"]["rule"] == "score"


def test_a_record_of_an_earlier_version_is_not_carried_on(done, forward, heard):
    """Its scores were made otherwise; its own round is made again by its lineage."""
    for end in ENDS[:2]:
        path = rules_of(done, end)
        table, extra, lineage = read_table(path, RULES), read_extra(path), read_lineage(path)
        del extra["judged_from"], extra["lead_noises"]
        write_table(path, table, lineage, extra=extra)
    calibrate(done, forward, heard.append, task=Task(ends_s=frozenset({240})))
    assert read_extra(rules_of(done, 240))["n_rounds"] == 1
    assert len(read_table(rules_of(done, 240), RULES)) == 0


def test_a_damaged_minute_costs_the_estimates_that_need_it(trial, forward, heard):
    """Its windows have none; the estimate over all minutes takes the others."""
    path = trial / "tracks" / "000060.parquet"
    path.write_bytes(path.read_bytes()[:1000])
    calibrate(trial, forward, heard.append)
    left_out = [event.problem for event in heard if isinstance(event, LeftOut)]
    assert any("000060.parquet" in text and "no likelihood estimate" in text for text in left_out)
    names = {model["rule"] for model in read_extra(rules_of(trial, 120))["models"]}
    assert "likelihood" not in names
    assert "likelihood" in {m["rule"] for m in read_extra(rules_of(trial, 300))["models"]}


def test_one_fish_is_enough(make_trial, forward):
    """No pair has a distance, and all is judged by the others."""
    root = make_trial("alone", seconds=240, n_fish=1)
    analyse(root, AnalyseOptions(), say_nothing)
    calibrate(root, forward, say_nothing)
    table = read_table(rules_of(root, 240), RULES).to_pydict()
    assert len(table["S"]) >= 3
    assert all(0 <= score <= 1 for score in table["S"] if score is not None)


def test_a_damaged_record_ends_the_rounds(done, forward):
    """It is named, with what to do; what stands before it stays."""
    path = rules_of(done, 180)
    table, lineage = read_table(path, RULES), read_lineage(path)
    write_table(path, table, lineage, extra={"n_rounds": 2})
    with pytest.raises(DamagedError, match="000180-rules") as caught:
        calibrate(done, forward, say_nothing)
    assert caught.value.hint == "Make it again: zfcal calibrate TRIAL --force"
    assert (done / "models" / "000180.toml").exists()
    calibrate(done, forward, say_nothing, task=Task(force=True))
    assert read_extra(path)["n_rounds"] == 2


def test_a_record_of_other_genes_begins_anew(done, forward):
    """Such as of a model that had other effects: its models can be neither scored nor used."""
    path = rules_of(done, 240)
    extra = read_extra(path)
    extra["gene_names"] = [*extra["gene_names"], "alignment.strength"]
    write_table(path, read_table(path, RULES), read_lineage(path), extra=extra)
    calibrate(done, forward, say_nothing, task=Task(ends_s=frozenset({300})))
    assert read_extra(rules_of(done, 300))["n_rounds"] == 1
    assert read_result(done / "models" / "000300.toml")["published"]["rule"] == "likelihood"


def test_check_and_inspect_know_the_record(done):
    """A whole one has no finding, a damaged one does; its rows and its lineage are shown."""
    path = rules_of(done, 300)
    assert not [each for each in check_trial(done) if "rules" in str(each)]
    shown = describe(path)
    assert "zfcal.rules/1" in str(shown)
    path.write_bytes(path.read_bytes()[:-20])
    assert [each for each in check_trial(done) if "000300-rules.parquet" in str(each)]


@pytest.mark.parametrize("champion", ["score", "likely"])
def test_a_trial_that_was_made_before_keeps_its_way(trial, forward, heard, champion):
    """It has nothing to do, and no record of rules comes."""
    settings = dataclasses.replace(forward.settings, champion=champion)
    calibrate(trial, dataclasses.replace(forward, settings=settings), say_nothing)
    calibrate(trial, dataclasses.replace(forward, keeps_way=True), heard.append)
    assert made_of(heard) == {}
    assert sum(isinstance(event, UpToDate) for event in heard) == 12
    assert not list((trial / "scores").glob("*-rules.parquet"))


def test_a_fresh_trial_publishes_by_the_rule_that_leads(trial, done, forward, read_all):
    """Where nothing says otherwise."""
    settings = dataclasses.replace(forward.settings, champion="score")
    unasked = dataclasses.replace(forward, settings=settings, keeps_way=True)
    for end in ENDS:
        calibrate(trial, unasked, say_nothing, task=Task(ends_s=frozenset({end})))
    assert read_all(trial) == read_all(done)


def test_each_round_says_one_line(trial, forward, heard):
    """What was published, by which rule, what it is worth, and the rules so far, best first."""
    calibrate(trial, forward, heard.append)
    texts = [event.text for event in heard if isinstance(event, Note)]
    lines = [text for text in texts if "publishes" in text]
    assert len(lines) == 4
    assert lines[0].startswith(
        "Window to 120 s: publishes the window's likelihood estimate (rule likelihood: no window "
        "has followed a model yet). S 0."
    )
    assert "Forward scores" not in lines[1]
    results = [event.value for event in heard if isinstance(event, Result)]
    listed = lines[3].split("Forward scores so far: ")[1].rstrip(".").split(", ")
    wanted = [f"{rule} {mean:.3f}" for rule, mean in results[3]["forward"].items()]
    assert listed == wanted
    assert sorted(results[3]["forward"].values(), reverse=True) == list(
        results[3]["forward"].values()
    )
    assert results[3]["rule"] == results[3]["published"]["rule"]
    assert results[0]["forward"] is None
    for value, line in zip(results, lines, strict=True):
        assert value["above_ceiling"] is (value["S"] > value["ceiling_high"])
        assert ("it fits chance" in line) is value["above_ceiling"]


def test_a_round_that_judges_none_says_its_line_too(trial, quick, heard):
    """By its score, with the ceiling; there is no rule to list."""
    calibrate(trial, quick, heard.append, task=Task(ends_s=frozenset({120})))
    (line,) = [event.text for event in heard if isinstance(event, Note)]
    assert line.startswith("Window to 120 s: publishes the window's best by its score. S ")
    (value,) = [event.value for event in heard if isinstance(event, Result)]
    assert (value["rule"], value["forward"], "published" in value) == ("score", None, False)


@pytest.mark.parametrize("kind", ["rounds", "window"])
def test_the_estimate_is_a_part_of_the_budget(trial, forward, tmp_path, monkeypatch, kind):
    """The search gets what is left of it, in a round and in one pooled window."""
    settings = dataclasses.replace(forward.settings, generations=None, champion="score")
    options = dataclasses.replace(forward, settings=settings, budget_s=30.0)
    span = Span(train_s=(0, 120), output=tmp_path / "one.toml")
    module, work = {
        "rounds": (calibrate_module, calibrate),
        "window": (holdout, lambda root, *given: calibrate_span(root, span, *given)),
    }[kind]

    def slow(*_):
        time.sleep(0.3)

    def search(_task, given, *_, **__):
        raise Killed(given.budget_s)

    monkeypatch.setattr(module, "estimate", slow)
    monkeypatch.setattr(module, "run_search", search)
    with pytest.raises(Killed) as caught:
        work(trial, options, say_nothing)
    assert 20.0 < caught.value.args[0] <= 29.7


def test_a_record_is_carried_on_by_its_own_round_alone(trial, forward, in_full):
    """Rounds that are published otherwise leave none, and the next record begins anew."""
    calibrate(trial, forward, say_nothing, task=Task(ends_s=frozenset({120})))
    record = RoundPlaces(root=trial, end_s=120).rules
    old = record.read_bytes()
    calibrate(trial, in_full, say_nothing, task=Task(ends_s=frozenset({120})))
    assert not record.exists()
    record.write_bytes(old)
    calibrate(trial, forward, say_nothing, task=Task(ends_s=frozenset({180})))
    path = RoundPlaces(root=trial, end_s=180).rules
    assert "scores/000120-rules.parquet" not in read_lineage(path).inputs
    assert read_extra(path)["n_rounds"] == 1


def test_rounds_that_none_can_read_do_not_change_the_way(trial, in_full):
    """Their file is named, and what to say; nothing is made."""
    calibrate(trial, in_full, say_nothing)
    for path in (trial / "models").glob("000[1-9]*"):
        path.write_bytes(b"damaged")
    asked = dataclasses.replace(in_full, keeps_way=True)
    with pytest.raises(InputError, match=r"000120\.parquet: cannot be read") as caught:
        calibrate(trial, asked, say_nothing)
    assert "--publish" in caught.value.hint


def test_a_damaged_model_alone_is_no_round_to_go_on_from(trial, in_full):
    """No population is beside it: the round is made anew, as in a trial without rounds."""
    path = trial / "models" / "000120.toml"
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(b"damaged")
    asked = dataclasses.replace(in_full, keeps_way=True)
    calibrate(trial, asked, say_nothing, task=Task(ends_s=frozenset({120})))
    assert read_lineage(path).options["champion"] == "forward"


def test_one_readable_round_says_the_way(trial, in_full):
    """The population where the model is damaged."""
    calibrate(trial, in_full, say_nothing, task=Task(ends_s=frozenset({120})))
    (trial / "models" / "000120.toml").write_bytes(b"damaged")
    asked = dataclasses.replace(in_full, keeps_way=True)
    calibrate(trial, asked, say_nothing, task=Task(ends_s=frozenset({120})))
    assert not list((trial / "scores").glob("*-rules.parquet"))


def test_an_estimate_that_is_published_must_be_made(trial, in_full):
    """Rounds of likelihood do not silently become rounds of score."""
    likely = dataclasses.replace(
        in_full, settings=dataclasses.replace(in_full.settings, champion="likely")
    )
    calibrate(trial, likely, say_nothing, task=Task(ends_s=frozenset({120})))
    asked = dataclasses.replace(in_full, keeps_way=True, seed_likelihood=False)
    with pytest.raises(InputError, match="publish the likelihood estimate"):
        calibrate(trial, asked, say_nothing)


def test_other_features_are_published_by_their_score(in_full):
    """Rules are judged by S."""
    with pytest.raises(InputError, match="judged by S, not by D,W"):
        dataclasses.replace(in_full.settings, champion="forward", features=("D", "W"))

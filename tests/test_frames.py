"""A trial's artifacts as pandas tables: `zfcal.open`."""

import doctest
import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import zfcal
from zfcal import frames
from zfcal.artifacts.models import read_model
from zfcal.artifacts.tables import RULES, read_table, read_tracks
from zfcal_cli.main import run

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[1]
SAMPLE = ROOT / "data-samples" / "two-rooms"
QUICK = ("--generations", "1", "--population", "4", "--steps", "20", "--seed", "1", "-q")


@pytest.fixture(scope="module")
def trial(tmp_path_factory):
    """Return the first minutes of the sample, analysed and calibrated: three windows."""
    root = tmp_path_factory.mktemp("frames") / "trial"
    shutil.copytree(SAMPLE, root, ignore=shutil.ignore_patterns("000240.*", "000300.*"))
    assert run(["analyse", str(root), "-q"]) == 0
    assert run(["calibrate", str(root), *QUICK]) == 0
    return zfcal.open(root)


def test_nothing_heavy_is_loaded_before_it_is_asked_for():
    """Importing the package loads nothing large; `dir` says what it exports."""
    code = (
        "import sys, zfcal; dir(zfcal); "
        "print([m for m in ('numpy', 'pandas', 'numba', 'scipy', 'matplotlib', 'pyarrow') "
        "if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
    assert dir(zfcal) == sorted([*zfcal.__all__, "__version__"])
    with pytest.raises(AttributeError, match="no attribute 'close'"):
        _ = zfcal.close


def test_tracks_are_those_of_all_segments_in_the_order_of_time(trial):
    """Each row of each file once, with kinds as words."""
    found = trial.tracks()
    segments = sorted((trial.root / "tracks").glob("*.parquet"))
    assert len(found) == sum(len(read_tracks(path).time_s) for path in segments)
    assert found["time_s"].is_monotonic_increasing
    assert set(found["kind"].unique()) == {"fish", "robot"}
    first = read_tracks(segments[0])
    np.testing.assert_array_equal(found["x_m"][: len(first.x_m)], first.x_m)
    assert isinstance(found["kind"].dtype, pd.CategoricalDtype)


def test_scores_have_their_ceilings_and_comparisons(trial):
    """Of the fish, the robot and the model; the whole tank has no zone."""
    found = trial.scores()
    assert {"model-vs-control", "social-vs-control"} <= set(found["compared"])
    whole = found[(found["feature"] == "S") & (found["compared"] == "model-vs-control")]
    assert whole["zone"].isna().all()
    assert whole["ceiling"].between(0, 1).all()
    assert whole["window_end_s"].is_unique


def test_who_follows_the_robot_is_a_row_for_each_measure_and_lag(trial):
    """Lags are of the directions alone; a count that is not defined is missing."""
    found = trial.following()
    assert found["window_end_s"].is_monotonic_increasing
    lags = found[found["measure"] == "direction"]
    assert lags.groupby("window_end_s")["lag_s"].count().eq(21).all()
    assert found[found["measure"] == "lead"]["lag_s"].isna().all()
    assert set(found["measure"]) >= {"following", "lead", "delay", "departures_led"}


def test_counts_are_whole_numbers_where_a_bin_is_not_defined(trial):
    """Occupation has no bins: the bin of these is missing, not NaN as a number.

    A bin is as wide as in the file.
    """
    found = trial.stats()
    assert (found["count"] >= 0).all()
    assert str(found["bin"].dtype) == "Int32"
    assert found[found["feature"] == "O"]["bin"].isna().all()


def test_parameters_are_those_of_the_model_files(trial):
    """A row for each of every numbered model, with its interval and the rule that published it."""
    found = trial.parameters()
    ends = sorted(int(path.stem) for path in (trial.root / "models").glob("*.toml"))
    assert list(found["window_end_s"].unique()) == ends
    last = found[found["window_end_s"] == ends[-1]].set_index("parameter")
    model = read_model(trial.root / "models" / f"{ends[-1]:06d}.toml")
    assert last.loc["walls.kappa_0", "value"] == model.zones[1].kappa_0
    assert last.loc["walls.gamma.centre", "value"] == model.zones[1].gamma["centre"]
    inside = last.dropna(subset=["low", "high"])
    assert (inside["low"] <= inside["high"]).all()
    assert len(inside)
    start = found[found["window_end_s"] == 0]
    assert start["low"].isna().all()
    assert start["identified"].isna().all()


def test_columns_have_their_types_where_they_are_empty(trial, tmp_path):
    """A starting model has no intervals and no rule, findings of no effect no row."""
    shutil.copytree(trial.root, tmp_path / "new", ignore=shutil.ignore_patterns("000*0.toml"))
    shutil.copy(trial.root / "models" / "000000.toml", tmp_path / "new" / "models")
    alone = zfcal.open(tmp_path / "new").parameters()
    assert alone[["low", "high", "identified", "intervals_by", "rule"]].isna().all(axis=None)
    assert alone.dtypes.to_dict() == trial.parameters().dtypes.to_dict()
    types = [str(each) for each in alone.dtypes]
    assert types == ["int64", "str", *["float64"] * 3, "boolean", "str", "str"]

    place = tmp_path / "findings.json"
    place.write_text(json.dumps(findings_of([])))
    none = trial.findings(place)
    assert len(none) == 0
    types = [str(each) for each in none.dtypes]
    assert types == ["int64", "str", "str", *["float64"] * 5, "str"]


def test_forward_scores_are_those_of_the_newest_record(trial):
    """One row for each rule and judged window."""
    newest = max((trial.root / "scores").glob("*-rules.parquet"))
    table = read_table(newest, RULES)
    found = trial.rules()
    assert list(found.columns) == table.column_names
    assert found["rule"].tolist() == table.column("rule").to_pylist()
    assert len(found) > 0


def test_findings_have_a_row_for_each_parameter(trial, tmp_path):
    """In the order of adding; the verdict stands beside the table."""
    effect = {
        "name": "alignment", "says": "x", "strength": {"weight": 2.0, "kappa": 5.0},
        "interval": {"weight": [1.0, 3.0]}, "gain_nats_per_step": 0.1, "p": 1e-9,
        "ties": ["a", "b"],
    }  # fmt: skip
    path = tmp_path / "findings.json"
    path.write_text(json.dumps(findings_of([effect])))
    found = trial.findings(path)
    assert found.attrs["verdict"] == "tie"
    assert list(found["parameter"]) == ["weight", "kappa"]
    assert (found.loc[0, "low"], found.loc[0, "high"]) == (1.0, 3.0)
    assert found.loc[1, "low"] is None or np.isnan(found.loc[1, "low"])
    assert found.loc[0, "ties"] == "a,b"


def findings_of(effects):
    """Return findings with these effects, as a diagnosis writes them."""
    known = {"schema": "zfcal.findings/1", "where": [], "screened": []}
    return {**known, "verdict": "tie", "effects": effects}


@pytest.mark.parametrize("text", ["{", json.dumps({"effects": 3}), json.dumps(findings_of([{}]))])
def test_findings_that_are_none_are_named(trial, tmp_path, text):
    """No JSON, or not what a diagnosis writes."""
    path = tmp_path / "findings.json"
    path.write_text(text)
    with pytest.raises(zfcal.ZfcalError, match=r"findings\.json"):
        trial.findings(path)


@pytest.mark.parametrize("what", ["stats", "following", "scores", "rules", "findings"])
def test_what_is_not_there_is_named_with_the_command_that_makes_it(what):
    """Of the sample, which has tracks and a starting model alone."""
    with pytest.raises(zfcal.ZfcalError, match="there is nothing to read") as caught:
        getattr(zfcal.open(SAMPLE), what)()
    assert "zfcal " in caught.value.hint


def test_what_is_no_trial_is_told(tmp_path):
    """And a file in a trial opens that trial."""
    with pytest.raises(zfcal.ZfcalError, match=r"trial\.toml"):
        zfcal.open(tmp_path)
    assert repr(zfcal.open(SAMPLE / "tracks")) == f"zfcal.open({str(SAMPLE)!r})"


def test_a_damaged_segment_is_named(tmp_path):
    """Its path, and that it is no Parquet."""
    root = shutil.copytree(SAMPLE, tmp_path / "trial")
    path = min((root / "tracks").glob("*.parquet"))
    path.write_bytes(b"no")
    with pytest.raises(zfcal.ZfcalError, match=path.name):
        zfcal.open(root).tracks()


def test_examples_in_docstrings_give_what_they_show(monkeypatch):
    """From the project's directory, where the samples are."""
    monkeypatch.chdir(ROOT)
    found = doctest.testmod(frames)
    assert (found.failed, found.attempted) == (0, 4)


def test_a_damaged_file_is_left_out_where_somebody_hears_of_it(trial, tmp_path):
    """The others of its table are there; without a hearer the table is refused."""
    root = tmp_path / "copy"
    shutil.copytree(trial.root, root)
    path = root / "tracks" / "000060.parquet"
    n_rows = len(read_tracks(path).frame)
    path.write_bytes(b"PAR1")
    heard = []
    tables = frames.TrialTables(root, on_damage=heard.append)
    assert len(tables.tracks()) == len(trial.tracks()) - n_rows
    assert [str(path) in str(error) for error in heard] == [True]
    with pytest.raises(zfcal.ZfcalError, match="000060"):
        zfcal.open(root).tracks()


@pytest.mark.parametrize("table", frames.TABLES)
def test_every_table_knows_its_files(trial, table):
    """All of them are there, in the trial."""
    assert all(path.is_file() for path in trial.files(table))
    assert bool(trial.files(table)) == (table != "findings")


def test_tables_stay_those_of_their_trial_in_another_folder(trial, tmp_path, monkeypatch):
    """Where another trial has the same name: of all tables, in what is told, and in a function."""
    first = shutil.copytree(trial.root, tmp_path / "first" / "trial")
    second = shutil.copytree(SAMPLE, tmp_path / "second" / "trial")
    min((second / "tracks").glob("*.parquet")).unlink()
    (first / "found.json").write_text(json.dumps(findings_of([])))
    monkeypatch.chdir(first.parent)
    tables = frames.TrialTables("trial", findings="trial/found.json")
    monkeypatch.chdir(second.parent)

    assert tables.root == tables.trial.root == first
    assert len(tables.tracks()) == len(trial.tracks())
    assert tables.findings().attrs["verdict"] == "tie"
    assert repr(tables) == f"zfcal.open({str(first)!r})"
    heard = []
    zfcal.analyse(tables, dry_run=True, force=True, tell=heard.append)
    planned = [event.path for event in heard if hasattr(event, "path")]
    assert planned
    assert all(path.is_relative_to(first) for path in planned)


@pytest.mark.parametrize("value", [None, 5, b"trial", ["trial"]])
def test_what_is_no_path_is_told(value):
    """With what was given."""
    with pytest.raises(zfcal.ZfcalError, match="is no path of a trial"):
        zfcal.open(value)

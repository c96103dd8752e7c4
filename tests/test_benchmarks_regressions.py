"""Where a benchmark's results go, and what it says of those that became worse."""

import json
import math
import sys

import pytest

COMMITTED = ("calibration", "closed_loop", "cluster", "drive", "growth", "long", "main_job",
             "optimisers", "roofline", "rounds", "tracking", "tracking_live")  # fmt: skip


@pytest.fixture
def regressions(scripts, tmp_path, monkeypatch):
    """Return the module, with folders of its own."""
    module = scripts("regressions")
    monkeypatch.setattr(module, "BUILD", tmp_path / "build")
    monkeypatch.setattr(module, "RESULTS", tmp_path / "results")
    monkeypatch.setattr(module, "DOCS", tmp_path / "docs")
    return module


def one_ratio(found):
    """Return the ratio of a benchmark that measures two things."""
    module = sys.modules["regressions"]
    return {"a over b": module.Ratio(value=found["a"] / found["b"])}


def finish(regressions, found, *words):
    """Conclude a run of the benchmark ``two`` with these options."""
    options = regressions.parser("Measure two things.").parse_args(words)
    regressions.conclude("two", found, "# Two\n", ratios=one_ratio, options=options)


def test_a_ratio_by_hand(regressions):
    """From 2 to 3: half as much again where less is better, two thirds where more is."""
    Ratio = regressions.Ratio
    fresh = {"cost": Ratio(value=3.0), "speed": Ratio(value=3.0, better="more")}
    known = {"cost": Ratio(value=2.0), "speed": Ratio(value=2.0, better="more")}
    cost, speed = regressions.changes(fresh, known)
    assert (cost.factor, cost.is_worse) == (1.5, True)
    assert speed.factor == pytest.approx(2 / 3)
    assert not speed.is_worse


@pytest.mark.parametrize(("value", "worse"), [(1.0, False), (1.19, False), (1.21, True)])
def test_a_fifth_is_the_limit(regressions, value, worse):
    """Whichever way is better."""
    Ratio = regressions.Ratio
    (less,) = regressions.changes({"r": Ratio(value=value)}, {"r": Ratio(value=1.0)})
    (more,) = regressions.changes(
        {"r": Ratio(value=1 / value, better="more")}, {"r": Ratio(value=1.0, better="more")}
    )
    assert less.is_worse is more.is_worse is worse


@pytest.mark.parametrize("value", [math.nan, 0.0])
def test_what_cannot_be_compared_is_reported(regressions, value):
    """NaN or zero on one side is no reason for silence."""
    Ratio = regressions.Ratio
    (change,) = regressions.changes({"r": Ratio(value=1.0)}, {"r": Ratio(value=value)})
    assert change.is_worse


def test_new_and_dropped_ratios_are_left_out(regressions):
    """Only what both runs have can be compared."""
    Ratio = regressions.Ratio
    assert regressions.changes({"new": Ratio(value=1.0)}, {"old": Ratio(value=1.0)}) == []


def test_a_fresh_run_leaves_the_committed_results_alone(regressions, tmp_path, capsys):
    """It is compared with them, every time: on stderr and in the table."""
    finish(regressions, {"a": 1.0, "b": 2.0}, "--write")
    assert "Nothing is committed" in capsys.readouterr().out
    for _ in range(2):
        finish(regressions, {"a": 2.0, "b": 2.0})
        said = capsys.readouterr()
        assert "two: a over b got worse by a factor of 2.00: 0.5 committed, 1 now." in said.err
        assert "| a over b | 0.5 | 1 | 2.00 | WORSE |" in said.out
    kept = json.loads((tmp_path / "results" / "two.json").read_text(encoding="utf-8"))
    fresh = json.loads((tmp_path / "build" / "two.json").read_text(encoding="utf-8"))
    assert (kept["a"], fresh["a"]) == (1.0, 2.0)
    assert (tmp_path / "build" / "benchmarks-two.md").read_text(encoding="utf-8") == "# Two\n"


def test_renewing_the_results_compares_first(regressions, tmp_path, capsys):
    """What --write overwrites is read before."""
    finish(regressions, {"a": 1.0, "b": 2.0}, "--write")
    finish(regressions, {"a": 2.0, "b": 2.0}, "--write")
    assert "got worse by a factor of 2.00" in capsys.readouterr().err
    kept = json.loads((tmp_path / "results" / "two.json").read_text(encoding="utf-8"))
    assert kept["a"] == 2.0
    finish(regressions, {"a": 2.0, "b": 2.0})
    assert capsys.readouterr().err == ""


def test_a_tiny_run_is_neither_compared_nor_committed(regressions, tmp_path, capsys):
    """Its sizes are not those of the committed one."""
    finish(regressions, {"a": 1.0, "b": 2.0}, "--write")
    finish(regressions, {"a": 9.0, "b": 2.0}, "--tiny", "--out", str(tmp_path / "mine"))
    assert (tmp_path / "mine" / "two.json").exists()
    assert capsys.readouterr().err == ""
    with pytest.raises(SystemExit, match="leave out --write"):
        finish(regressions, {"a": 9.0, "b": 2.0}, "--tiny", "--write")


@pytest.mark.parametrize("name", COMMITTED)
def test_the_committed_results_have_ratios(scripts, repository, name):
    """Each a positive number, and against themselves none has become worse."""
    path = repository / "benchmarks" / "results" / f"{name}.json"
    found = json.loads(path.read_text(encoding="utf-8"))
    if name == "optimisers":
        for package in ("cma", "pymoo", "skopt"):
            pytest.importorskip(package, reason="in requirements-bench.lock")
    ratios = scripts(f"bench_{name}").ratios(found)
    assert ratios
    assert all(ratio.value > 0 for ratio in ratios.values())
    same = scripts("regressions").changes(ratios, ratios)
    assert [change.factor for change in same] == [1.0] * len(ratios)


def test_every_benchmark_has_committed_results(repository):
    """Each that make bench runs; the diagnosis, which takes a day, has a target of its own."""
    found = {path.stem for path in (repository / "benchmarks").glob("bench_*.py")}
    assert found - {"bench_diagnosis"} == {f"bench_{name}" for name in COMMITTED}


def test_what_an_earlier_run_has_written(regressions, tmp_path):
    """Where a run with the same options puts it; without one it is said where."""
    options = regressions.parser("Measure two things.").parse_args([])
    with pytest.raises(SystemExit, match=r"build has no two\.json"):
        regressions.written("two", options)
    finish(regressions, {"a": 1.0, "b": 2.0})
    assert regressions.written("two", options) == {"a": 1.0, "b": 2.0}


def test_a_benchmark_that_cannot_be_tiny_offers_no_tiny_run(regressions):
    """Its results can be renewed all the same."""
    options_of = regressions.parser("Measure two things.", tiny=False)
    assert regressions.places(options_of.parse_args(["--write"])).results == regressions.RESULTS
    with pytest.raises(SystemExit):
        options_of.parse_args(["--tiny"])


def test_a_cluster_that_became_slower_is_noticed(scripts, repository):
    """Of two workers alone: every ratio of theirs, and no other."""
    path = repository / "benchmarks" / "results" / "cluster.json"
    text = path.read_text(encoding="utf-8")
    committed, fresh = json.loads(text), json.loads(text)
    for time in fresh["places"]["cluster, 2 workers"]["times"].values():
        time["s"] *= 1.5
    ratios = scripts("bench_cluster").ratios
    found = scripts("regressions").changes(ratios(fresh), ratios(committed))
    assert {c.name.partition(": ")[2] for c in found if c.is_worse} == {"cluster, 2 workers"}

"""The committed documents are those of the committed numbers; a run is held against them."""

import json
import math

import pytest

COMMITTED = {
    "calibration.bench_as_published": "calibration.bench_as_published",
    "calibration.bench_calibration": "calibration.bench_calibration",
    "calibration.bench_cluster": "calibration.bench_cluster",
    "calibration.bench_coverage": "calibration.bench_coverage",
    "calibration.bench_main_job": "calibration.bench_main_job",
    "calibration.bench_optimisers": "calibration.optimisers_document",
    "calibration.bench_rounds": "calibration.rounds_document",
    "drive.bench_closed_loop": "drive.bench_closed_loop",
    "drive.bench_drive": "drive.bench_drive",
    "drive.bench_effect_drives": "drive.bench_effect_drives",
    "speed.bench_growth": "speed.growth_document",
    "speed.bench_long": "speed.bench_long",
    "speed.bench_roofline": "speed.bench_roofline",
    "tracking.bench_tracking": "tracking.bench_tracking",
    "tracking.bench_tracking_live": "tracking.bench_tracking_live",
}
"""What each script that make bench runs makes its document with."""


def test_make_bench_runs_what_has_committed_numbers(repository):
    """The diagnosis, which takes a day, has a target of its own."""
    paths = (repository / "benchmarks").glob("*/bench_*.py")
    found = {f"{path.parent.name}.{path.stem}" for path in paths}
    assert found - {"diagnosis.bench_diagnosis"} == set(COMMITTED)


@pytest.mark.parametrize("name", [*COMMITTED, "diagnosis.bench_diagnosis"])
def test_a_committed_document_is_that_of_the_committed_numbers(script, repository, name):
    """Nobody has changed a figure by hand."""
    short = name.partition(".bench_")[2]
    numbers = repository / "benchmarks" / "results" / f"{short}.json"
    document = repository / "docs" / f"benchmarks-{short.replace('_', '-')}.md"
    module = script(COMMITTED.get(name, "diagnosis.document"))
    found = json.loads(numbers.read_text(encoding="utf-8"))
    assert module.markdown(found) == document.read_text(encoding="utf-8")


def test_the_paper_s_way_is_told_with_the_committed_differences(repository):
    """The first columns of the benchmark's table stand in the document about the paper's way."""
    told = (repository / "docs" / "as-published.md").read_text(encoding="utf-8")
    measured = (repository / "docs" / "benchmarks-as-published.md").read_text(encoding="utf-8")
    rows = [line for line in measured.splitlines() if "±" in line and line.startswith("| ")]
    assert len(rows) == 7
    for row in rows:
        assert row.rpartition(" | ")[0] + " |\n" in told


@pytest.mark.parametrize("name", COMMITTED)
def test_committed_numbers_have_ratios_that_a_run_is_held_against(script, repository, name):
    """Each a positive number: with none a run would never be worse."""
    if name == "calibration.bench_optimisers":
        for package in ("cma", "pymoo", "skopt"):
            pytest.importorskip(package, reason="in requirements-bench.lock")
    path = repository / "benchmarks" / "results" / f"{name.partition('.bench_')[2]}.json"
    ratios = script(name).ratios(json.loads(path.read_text(encoding="utf-8")))
    assert ratios
    assert all(ratio.value > 0 for ratio in ratios.values())


@pytest.fixture
def regressions(script, tmp_path, monkeypatch):
    """Return the module, with folders of its own."""
    module = script("shared.regressions")
    monkeypatch.setattr(module, "BUILD", tmp_path / "build")
    monkeypatch.setattr(module, "RESULTS", tmp_path / "results")
    monkeypatch.setattr(module, "DOCS", tmp_path / "docs")
    return module


def finish(regressions, found, *words):
    """Conclude a run of the benchmark ``two``, whose ratio is a over b, with these options."""
    options = regressions.parser("Measure two things.").parse_args(words)
    regressions.conclude(
        "two",
        found,
        "# Two\n",
        ratios=lambda each: {"a over b": regressions.Ratio(value=each["a"] / each["b"])},
        options=options,
    )


def test_a_run_that_became_worse_is_reported_and_leaves_the_committed_one_alone(
    regressions, tmp_path, capsys
):
    """Every time, on stderr and in the table."""
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


def test_renewed_numbers_are_compared_with_those_that_they_replace(regressions, tmp_path, capsys):
    """What --write overwrites is read before."""
    finish(regressions, {"a": 1.0, "b": 2.0}, "--write")
    finish(regressions, {"a": 2.0, "b": 2.0}, "--write")
    assert "got worse by a factor of 2.00" in capsys.readouterr().err
    assert json.loads((tmp_path / "results" / "two.json").read_text(encoding="utf-8"))["a"] == 2.0


def test_a_tiny_run_is_neither_compared_nor_committed(regressions, tmp_path, capsys):
    """Its sizes are not those of the committed one."""
    finish(regressions, {"a": 1.0, "b": 2.0}, "--write")
    finish(regressions, {"a": 9.0, "b": 2.0}, "--tiny", "--out", str(tmp_path / "mine"))
    assert (tmp_path / "mine" / "two.json").exists()
    assert capsys.readouterr().err == ""
    with pytest.raises(SystemExit, match="leave out --write"):
        finish(regressions, {"a": 9.0, "b": 2.0}, "--tiny", "--write")


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

"""Each function and its command: the same files, byte by byte, told of in the same order."""

import shutil

import pandas as pd
import pytest

import zfcal
from zfcal.frames import TrialTables
from zfcal.stages.events import Made, Planned, UpToDate
from zfcal_cli.main import run

MODEL = "trial/models/000000.toml"
ROUND = {"generations": 1, "population": 4, "steps": 20, "seed": 5}
WORDS = "--generations 1 --population 4 --steps 20 --seed 5"
SLOW = pytest.mark.slow

CASES = {
    "analyse": (
        "analyse trial --control alone --features residence,curvature",
        lambda **more: zfcal.analyse(
            "trial", control="alone", features=["residence", "curvature"], **more
        ),
    ),
    "analyse one minute": (
        "analyse alone/tracks/000060.parquet --force",
        lambda **more: zfcal.analyse("alone/tracks/000060.parquet", force=True, **more),
    ),
    "calibrate": (
        f"calibrate trial {WORDS}",
        lambda **more: zfcal.calibrate("trial", **ROUND, **more),
    ),
    "calibrate as published": (
        f"calibrate trial --as-published --confirm 2 --baselines --sampler grid {WORDS}",
        lambda **more: zfcal.calibrate(
            "trial",
            as_published=True,
            confirm=2,
            baselines=True,
            sampler="grid",
            **ROUND,
            **more,
        ),
    ),
    "calibrate one window": (
        f"calibrate trial --window 0:100 --held-out 100:200 -o half --no-seed-likelihood {WORDS}",
        lambda **more: zfcal.calibrate(
            zfcal.open("trial"),
            window=(0, 100),
            held_out="100:200",
            out="half",
            seed_likelihood=False,
            **ROUND,
            **more,
        ),
    ),
    "simulate": (
        f"simulate new --model {MODEL} --duration 1min --fish 2 --robot --fps 10 --seed 3",
        lambda **more: zfcal.simulate(
            "new", model=MODEL, duration=60, fish=2, robot=True, fps=10, seed=3, **more
        ),
    ),
    "simulate images": (
        f"simulate new --model {MODEL} --duration 2s --video --look clean --draw noise_grey=4",
        lambda **more: zfcal.simulate(
            "new",
            model=MODEL,
            duration="2s",
            video=True,
            look="clean",
            draw={"noise_grey": 4.0},
            **more,
        ),
    ),
    "compare": (
        "compare trial --against alone -o both --format svg",
        lambda **more: zfcal.compare(
            ["trial"], against=zfcal.open("alone"), out="both", format="svg", **more
        ),
    ),
    "diagnose": (
        "diagnose trial --quick --window 0:180 --noise-mm 0.5 --seed 2 -o found",
        lambda **more: zfcal.diagnose(
            "trial", quick=True, window=(0, 180), noise_mm=0.5, seed=2, out="found", **more
        ),
    ),
    "extend": (
        "extend trial --effect turning-bias --generations 0 --population 4 --seed 5",
        lambda **more: zfcal.extend(
            "trial", effect="turning-bias", generations=0, population=4, seed=5, **more
        ),
    ),
    "report": (
        "report trial alone",
        lambda **more: zfcal.report(["trial", "alone"], **more),
    ),
}
"""A command line, and the call that says the same."""

LONG = {"calibrate as published", "diagnose", "extend", "report"}
QUICK = [name for name in CASES if name not in LONG]


@pytest.mark.slow
@pytest.mark.parametrize(
    "case", [*QUICK, *(pytest.param(name, marks=SLOW) for name in CASES if name not in QUICK)]
)
def test_a_function_writes_what_its_command_writes(
    case, here, tmp_path, monkeypatch, capsys, read_all, children
):
    """The same files with the same bytes, and the same paths told; no process is left."""
    words, call = CASES[case]
    twin = shutil.copytree(here, tmp_path / "twin")
    capsys.readouterr()
    assert run(words.split()) == 0
    lines = capsys.readouterr().out.splitlines()
    monkeypatch.chdir(twin)
    before, heard = children(), []
    call(tell=heard.append)
    assert children() <= before
    told = [str(event.path) for event in heard if isinstance(event, Made | UpToDate)]
    # A command says each path once.
    assert list(dict.fromkeys(told)) == lines
    assert lines
    assert read_all(twin) == read_all(here)
    assert not [event for event in heard if isinstance(event, Planned)]


@pytest.mark.parametrize("case", [name for name in CASES if name not in {"diagnose", "extend"}])
def test_a_dry_run_writes_nothing_and_says_what_would_be_made(case, here, read_all):
    """To whoever hears; of files that are up to date the same is told as by the command."""
    _, call = CASES[case]
    before, heard = read_all(here), []
    call(tell=heard.append, dry_run=True)
    assert read_all(here) == before
    assert [event for event in heard if isinstance(event, Planned)]


def test_what_was_made_is_returned(here):
    """Tables of the trial; of a comparison a row for each quantity; nothing that is not there."""
    tables = zfcal.analyse("trial")
    assert isinstance(tables, TrialTables)
    assert set(tables.scores()["window_end_s"]) == {120, 180}
    new = zfcal.simulate("new", model=MODEL, duration="1min", seed=2)
    assert len(new.tracks()) == 60 * 5 * 4
    assert zfcal.simulate("later", model=MODEL, duration="1min", dry_run=True) is None
    assert isinstance(
        zfcal.simulate(new, model=MODEL, duration="1min", seed=2, dry_run=True), TrialTables
    )
    assert zfcal.compare("trial", against="alone", out="both", dry_run=True) is None


def test_a_comparison_is_a_table_of_its_document(here):
    """One row per quantity, whatever is not known missing; the sentences beside it."""
    found = zfcal.compare("trial", against=["alone"])
    document = found.attrs["document"]
    assert isinstance(found, pd.DataFrame)
    assert len(found) == len(document["statistics"]) > 5
    row, said = found.iloc[0], document["statistics"][0]
    assert (row["name"], row["n_a"], row["mean_b"]) == (said["name"], 1, said["B"]["mean"])
    assert row["difference"] == pytest.approx(row["mean_a"] - row["mean_b"])
    assert found[["sd_a", "low", "g", "p", "p_family"]].isna().all(axis=None)
    assert "Nothing is tested" in found.attrs["says"][0]


@SLOW
def test_findings_are_those_that_were_asked_for(here):
    """In a folder of their own, or where there are none yet the usual message."""
    found = zfcal.diagnose("trial", quick=True, seed=1, out="elsewhere")
    assert found.files("findings") == [here / "elsewhere" / "findings.json"]
    assert found.findings().attrs["verdict"] == "untestable"
    again = zfcal.diagnose("trial", quick=True, seed=1, out="elsewhere", dry_run=True)
    assert again.files("findings") == found.files("findings")


def test_a_dry_run_returns_no_findings_of_other_options(here):
    """Those that are there answer to something else; a dry run that would make none has them."""
    folder = here / "trial" / "diagnosis"
    folder.mkdir()
    (folder / "findings.json").write_text("{}")
    assert zfcal.diagnose("trial", quick=True, seed=1, dry_run=True) is None


@SLOW
def test_tables_make_the_files_that_their_path_makes(here, tmp_path, monkeypatch, read_all):
    """Byte by byte, though their paths are absolute: of a page, and of findings."""
    twin = shutil.copytree(here, tmp_path / "twin")
    for folder, given in ((here, str), (twin, zfcal.open)):
        monkeypatch.chdir(folder)
        zfcal.diagnose(given("trial"), quick=True, seed=1)
        zfcal.report(given("trial"))
        zfcal.report([given("trial"), given("alone")], out="both")
    assert read_all(twin) == read_all(here)

"""`zfcal diagnose`: what a person types, and what comes back."""

import json
import sys

import pytest

from zfcal.artifacts.validation import check
from zfcal.diagnose.findings import Note


@pytest.fixture
def answered(monkeypatch, plain, make_diagnosis):
    """Answer every question with a diagnosis made by hand, without noise and pictures."""
    questions = []

    def engine(question, heard):
        questions.append(question)
        return make_diagnosis(question.arena, question.model)

    monkeypatch.setattr("zfcal.stages.diagnose.diagnose._engine", engine)
    return questions


def test_paths_of_findings_page_and_pictures(zfcal, trial, answered):
    """One a line; the second run finds them all up to date and says so."""
    first = zfcal("diagnose", "trial")
    assert (first.code, first.lines) == (
        0,
        [
            "trial/diagnosis/findings.json",
            "trial/diagnosis/report.html",
            "trial/diagnosis/1-alignment.png",
            "trial/diagnosis/screened.png",
        ],
    )
    second = zfcal("diagnose", "trial")
    assert (second.code, second.lines) == (0, first.lines)
    assert "nothing to do, 4 up to date" in second.err
    assert len(answered) == 1


def test_pictures_for_a_journal(zfcal, trial, answered):
    """Drawn anew from the same findings; the second run finds them, and PNGs are gone."""
    zfcal("diagnose", "trial")
    words = ("diagnose", "trial", "--format", "pdf", "--width", "single")
    first = zfcal(*words)
    assert first.code == 0
    assert [line for line in first.lines if "/1-" in line] == ["trial/diagnosis/1-alignment.pdf"]
    assert (trial / "diagnosis" / "1-alignment.pdf").read_bytes().startswith(b"%PDF")
    assert not list((trial / "diagnosis").glob("*.png"))
    assert "nothing to do, 4 up to date" in zfcal(*words).err
    assert len(answered) == 1
    assert zfcal("diagnose", "trial", "--width", "3mm").code == 2


def test_json_is_the_document_itself(zfcal, trial, answered):
    """As it stands in findings.json, also when nothing is left to do."""
    for _ in range(2):
        found = zfcal("diagnose", "trial", "--json")
        document = json.loads(found.out)
        check(document, "findings", "stdout")
        assert document == json.loads((trial / "diagnosis" / "findings.json").read_text())


def test_the_verdict_in_words_goes_to_the_person(zfcal, trial, answered):
    """Once, also when all is up to date; not with -q, and never among the paths."""
    for _ in range(2):
        found = zfcal("diagnose", "trial")
        assert found.err.count("trial: The model lacks alignment.") == 1
        assert "lacks" not in found.out
    assert "lacks" not in zfcal("diagnose", "trial", "-q").err
    assert "lacks" not in zfcal("diagnose", "trial", "--force", "--dry-run").err
    assert "trial: The model lacks alignment." in zfcal("diagnose", "trial", "--json").err


def test_the_document_of_several_trials_has_no_second_verdict(zfcal, trial, answered):
    """It stands in the findings of each."""
    found = zfcal("diagnose", "trial", "trial", "--json")
    assert "lacks" not in json.dumps(json.loads(found.out)["messages"])


@pytest.mark.parametrize("command", ["diagnose", "extend"])
def test_a_control_that_fires_is_a_warning(
    zfcal, trial, answered, monkeypatch, make_diagnosis, command
):
    """Extending does not go on in silence either."""
    note = Note(name="controls", says="NEGATIVE CONTROL FIRES: a shuffled turn. Do not trust it.")
    monkeypatch.setattr(
        "zfcal.stages.diagnose.diagnose._engine",
        lambda question, _: make_diagnosis(question.arena, question.model, names=(), notes=(note,)),
    )
    found = zfcal(command, "trial")
    assert f"warning: trial: {note.says}" in found.err
    assert "CONTROL" not in found.out


def test_json_of_a_failure_says_what_is_wrong(zfcal, trial, answered):
    """There are no findings then."""
    found = zfcal("diagnose", "trial", "--window", "900:1000", "--json")
    assert found.code == 1
    assert "no tracks from 900 s" in json.loads(found.out)["errors"][0]["message"]


def test_json_of_several_trials_holds_a_document_each(zfcal, trial, answered):
    """Under results."""
    zfcal("init", "other", "--side-m", "1", "--fish", "3", "--robot", "--fps", "5")
    zfcal("import", "tracks.csv", "other", "--format", "csv")
    found = json.loads(zfcal("diagnose", "trial", "other", "--json").out)
    assert [result["verdict"] for result in found["results"]] == ["named", "named"]


def test_options_reach_the_question(zfcal, trial, answered):
    """Millimetres become metres, one place turns them."""
    words = ["--noise-mm", "0.5", "--null-replicates", "199", "--seed", "3", "--workers", "1"]
    assert zfcal("diagnose", "trial", *words, "--window", "0:60").code == 0
    (question,) = answered
    assert (question.noise_m, question.n_null, question.seed) == (0.0005, 199, 3)
    assert (question.n_workers, question.quick, len(question.samples.k)) == (1, False, 300)
    assert zfcal("diagnose", "trial", "--quick").code == 0
    assert answered[1].quick


@pytest.mark.parametrize("words", [["--null", "199"], ["--null=199"]])
def test_the_earlier_name_of_the_replicates_goes_on_working(zfcal, trial, answered, words):
    """Help lists the new one alone."""
    assert zfcal("diagnose", "trial", *words).code == 0
    assert answered[0].n_null == 199
    listed = zfcal("diagnose", "--help").out
    assert "--null-replicates [39|199]" in listed
    assert "--null " not in listed


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["trial", "--quick", "--null-replicates", "39"], "leave out --null-replicates,"),
        (["trial", "--quick", "--null", "39"], "--quick simulates no null"),
        (["trial", "trial", "-o", "here"], "-o is for one trial"),
        (["-", "-o", "here"], "-o is for one trial"),
        (["trial", "--null-replicates", "40"], "'40' is not one of"),
        (["trial", "--null", "40"], "'--null-replicates': '40' is not one of"),
        (["trial", "--window", "60:0"], "no stretch START:END"),
        (["trial", "--noise-mm", "-1"], "not in the range"),
        (["trial", "--model", "nowhere.toml"], "does not exist"),
    ],
)
def test_wrong_usage(zfcal, trial, answered, words, says):
    """Exit 2, one line, and where to read on."""
    found = zfcal("diagnose", *words)
    assert found.code == 2
    assert says in found.err
    assert not answered


def test_a_dry_run_says_what_it_would_make(zfcal, trial, answered):
    """And writes nothing."""
    found = zfcal("diagnose", "trial", "--dry-run")
    assert (found.code, found.out) == (0, "")
    assert "would make trial/diagnosis/findings.json: missing" in found.err
    assert not (trial / "diagnosis").exists()


def test_paths_on_standard_input_name_the_trial(zfcal, trial, answered, monkeypatch):
    """Every segment of it comes, and it is diagnosed once."""
    lines = zfcal("import", "tracks.csv", "trial", "--format", "csv").lines
    monkeypatch.setattr(sys, "stdin", iter(f"{line}\n" for line in lines))
    found = zfcal("diagnose", "-")
    assert found.lines[0] == "trial/diagnosis/findings.json"
    assert len(answered) == 1


def test_a_damaged_segment_ends_with_three(zfcal, trial, answered):
    """Done, but something was left out."""
    (trial / "tracks" / "000060.parquet").write_bytes(b"no more")
    found = zfcal("diagnose", "trial")
    assert found.code == 3
    assert "left out" in found.err
    assert "findings.json" in found.out


def test_help_has_an_example(zfcal):
    """And is quick: nothing heavy is loaded."""
    found = zfcal("diagnose", "--help")
    assert found.code == 0
    assert "zfcal diagnose trial --model trial/models/extended.toml" in found.out


def test_check_knows_findings_in_every_folder(zfcal, trial, answered):
    """Those of an extended model as well."""
    zfcal("diagnose", "trial", "-o", "trial/diagnosis/extended")
    assert zfcal("check", "trial").code == 0
    (trial / "diagnosis" / "extended" / "findings.json").write_text("{}")
    assert zfcal("check", "trial").code == 3

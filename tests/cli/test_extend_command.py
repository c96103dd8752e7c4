"""`zfcal extend`: what a person types, and what comes back."""

import json

import pytest

from zfcal.artifacts.validation import check

ROUND = ["--generations", "0", "--population", "4", "--workers", "1"]


@pytest.fixture
def answered(monkeypatch, plain, make_diagnosis):
    """Answer every question with a diagnosis made by hand; draw nothing."""
    monkeypatch.setattr(
        "zfcal.stages.diagnose.diagnose._engine",
        lambda question, _: make_diagnosis(question.arena, question.model, names=()),
    )


def test_no_effect_is_nothing_to_do(zfcal, trial, answered):
    """Exit 0 and a line that says so."""
    found = zfcal("extend", "trial", *ROUND)
    assert found.code == 0
    assert "the model lacks no effect: nothing to add" in found.err


def test_a_named_effect_makes_model_and_page(zfcal, trial, answered):
    """Paths on standard output; --json is the findings with their gap."""
    found = zfcal("extend", "trial", "--effect", "turning-bias", *ROUND)
    assert found.code == 0
    assert "trial/models/extended.toml" in found.lines
    assert "trial/diagnosis/gap.png" in found.lines
    again = zfcal("extend", "trial", "--effect", "turning-bias", *ROUND, "--json")
    document = json.loads(again.out)
    check(document, "findings", "stdout")
    assert len(document["gap"]) == 7


@pytest.mark.parametrize(
    ("words", "code", "says"),
    [
        (["--effect", "allignment"], 1, "Did you mean alignment"),
        (["--generations", "3", "--budget", "5s"], 2, "--generations or with its --budget"),
        (["trial", "-o", "x.toml"], 2, "-o is for one trial"),
        (["trial", "--findings", "tracks.csv"], 2, "--findings is for one trial"),
        (["--findings", "nowhere.json"], 2, "does not exist"),
    ],
)
def test_what_is_wrong_is_said(zfcal, trial, answered, words, code, says):
    """One line and a hint."""
    found = zfcal("extend", "trial", *words)
    assert found.code == code
    assert says in found.err


def test_help_has_an_example(zfcal):
    """With the command that asks again."""
    found = zfcal("extend", "--help")
    assert found.code == 0
    assert "zfcal extend trial --effect alignment" in found.out

"""Every command of every page can be typed: options exist, and values are of their kind."""

import json
import re
import tomllib

import click
import pytest

from zfcal_cli.main import COMMANDS, group


@pytest.fixture
def anywhere(monkeypatch, reading):
    """Let files that a command names be missing: no page brings them."""
    monkeypatch.setattr(click.Path, "convert", reading.any_path)


@pytest.fixture
def fault(anywhere, reading):
    """Return what is wrong with a text, as a page or within a sentence; None if nothing is."""

    def ask(text, *, is_block=True):
        snippet = reading.Snippet("page.md", "Heading", 1, "", text, is_block=is_block)
        found = [reading.fault_of(group, typed) for typed in reading.typed_in(snippet)]
        assert found, f"no command in {text!r}"
        return next((each for each in found if each), None)

    return ask


def test_commands_of_the_pages_can_be_typed(snippets, reading, anywhere):
    """In blocks and in sentences, of the README and of every page of docs/."""
    typed = [each for snippet in snippets for each in reading.typed_in(snippet)]
    faults = [(each, reading.fault_of(group, each)) for each in typed]
    assert [f"{each.snippet.place}: {each.line}: {what}" for each, what in faults if what] == []
    assert len(typed) > 250


def test_examples_in_help_can_be_typed(reading, anywhere):
    """Each command has some."""
    typed = list(reading.examples_of(group))
    faults = [(each, reading.fault_of(group, each)) for each in typed]
    assert [f"{each.snippet.page}: {each.line}: {what}" for each, what in faults if what] == []
    assert {each.snippet.page.split()[1] for each in typed} >= set(COMMANDS)


def test_options_that_sentences_name_exist(snippets, reading, repository):
    """An option in backticks is one of some command, or of a script that a page may be about."""
    commands = reading.commands_below(group)
    known = {word for command in commands for word in reading.options_of(command)}
    for script in [*repository.glob("benchmarks/**/*.py"), *repository.glob("zfcal/**/*.py")]:
        known |= set(re.findall(r'"(--[a-z][a-z0-9-]*)"', script.read_text(encoding="utf-8")))
    wrong = [
        f"{each.place}: {word}"
        for each in snippets
        if not each.is_block and each.text.startswith("--")
        for word in re.findall(r"^--[a-z][a-z0-9-]*", each.text)
        if word not in known
    ]
    assert wrong == []


def test_blocks_of_other_languages_are_of_that_language(snippets):
    """Python compiles, TOML and JSON can be read."""
    read = {"json": json.loads, "toml": tomllib.loads}
    read["python"] = lambda text: compile(text, "snippet", "exec") if ">>>" not in text else None
    found = [each for each in snippets if each.is_block and each.language in read]
    for each in found:
        read[each.language](each.text)
    assert {each.language for each in found} == set(read)


@pytest.mark.parametrize(
    "text",
    [
        "zfcal analyse trial --no-such-option",
        "zfcal calibrate trial --generations many",
        "zfcal import tracks.csv trial --format nothing",
        "zfcal analyze trial",
        "zfcal camera corner 1,2 --size 5x5",
        "zfcal camera corners 1,2 3,4 5,6 7,8 --size five",
        "zfcal import tracks.csv",
        "cat list | zfcal analyse - | zfcal calibrate - --buget 50s",
        "* * * * * zfcal analyse T && zfcal calibrate T --buget 50s",
        "while true; do zfcal analyse trial --nope; done",
        "X=1 .venv/bin/zfcal analyse trial --nope",
        "zfcal simulate x --model m.toml \\\n    --nope",
    ],
)
def test_a_mistake_is_found(fault, text):
    """Wherever the command stands in its line."""
    assert fault(text) is not None


@pytest.mark.parametrize(
    ("text", "is_block"),
    [
        ("zfcal analyse trial  # a remark with --nope", True),
        ("zfcal demo loop --closed-loop [--no-video]", True),
        ("pip install 'zfcal[formats]'\nzfcal check trial", True),
        ("zfcal calibrate --as-published", False),
        ("zfcal import SRC TRIAL --format NAME", False),
        ("zfcal export TRIAL --to csv|parquet", False),
        ("zfcal --help", True),
        ("zfcal camera", False),
    ],
)
def test_what_is_right_has_no_fault(fault, text, is_block):
    """Remarks, choices and placeholders are none."""
    assert fault(text, is_block=is_block) is None

"""Words that no command takes: what they would leave behind could not be used."""

import io

import click
import pytest

from zfcal_cli.main import COMMANDS, group
from zfcal_cli.options import Name


def every_command():
    """Return every command, and those of groups, by the words that call them."""
    context = click.Context(group)
    found = {}
    for name in COMMANDS:
        command = group.get_command(context, name)
        if isinstance(command, click.Group):
            found |= {f"{name} {part}": each for part, each in command.commands.items()}
        else:
            found[name] = command
    return found


def taking(word):
    """Return the option of that word of every command that has one, by the command's name."""
    return {
        name: parameter
        for name, command in every_command().items()
        for parameter in command.params
        if word in parameter.opts
    }


NO_PLACES = {
    *("--at", "--board", "--bounds-m", "--cluster", "--corners", "--draw", "--effect"),
    *("--keypoint", "--publish", "--publish-zones", "--size", "--source", "--stages", "corners"),
}
"""What takes a text that names no trial, file or device."""


def parameters():
    """Return all arguments and options as (command, its word, parameter)."""
    return [
        (name, parameter.opts[-1], parameter)
        for name, command in every_command().items()
        for parameter in command.params
    ]


def refused(parameter, text):
    """Return what a parameter says of a text that it refuses; empty for one that it takes."""
    try:
        parameter.type.convert(text, parameter, None)
    except click.BadParameter as error:
        return error.message
    return ""


def test_no_command_takes_a_seed_that_toml_cannot_hold():
    """Whole numbers of 64 bits with a sign, from 0 on."""
    found = taking("--seed")
    assert {"init", "simulate", "demo", "calibrate", "diagnose", "extend", "reproduce"} <= {*found}
    for name, parameter in found.items():
        for seed in (-1, 2**63, 2**64, 10**23):
            assert f"{seed} is not in the range" in refused(parameter, str(seed)), name
        assert parameter.type.convert(str(2**63 - 1), parameter, None) == 2**63 - 1


@pytest.mark.parametrize("seed", [2**63, 2**64])
def test_a_trial_with_too_large_a_seed_is_not_made(zfcal, tmp_path, seed):
    """It is wrong usage, and nothing is written."""
    done = zfcal("init", "new", "--arena", "ring", "--fish", "3", "--seed", seed)
    assert done.code == 2
    assert f"'--seed': {seed} is not in the range" in done.err
    assert list(tmp_path.iterdir()) == []


def test_whatever_names_a_place_refuses_an_empty_name():
    """An unset variable of the shell is no trial, no file and not the current folder."""
    for name, word, parameter in parameters():
        if isinstance(parameter.type, click.Path | Name):
            assert "The name is empty" in refused(parameter, ""), f"{name} {word}"
        else:
            assert parameter.type is not click.STRING or word in NO_PLACES, f"{name} {word}"


@pytest.mark.parametrize(
    "words",
    [
        ("init", "", "--arena", "ring", "--fish", "3"),
        ("init", "new", "--arena", "", "--fish", "3"),
        ("analyse", ""),
        ("analyse", "trial", ""),
        ("check", ""),
        ("compare", "trial", "--against", ""),
        ("demo", "", "--dry-run"),
        ("watch", "", "--dry-run"),
        ("--man", ""),
    ],
)
def test_an_empty_name_is_wrong_usage(zfcal, tmp_path, words):
    """Where a trial lies as well: nothing is made in it, and nothing is done to it."""
    zfcal("init", ".", "--arena", "ring", "--fish", "3")
    before = sorted(tmp_path.rglob("*"))
    done = zfcal(*words)
    assert done.code == 2
    assert "The name is empty: is a variable of the shell not set?" in done.err
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize(
    "words",
    [
        ("init", "-", "--arena", "ring", "--fish", "3"),
        ("simulate", "-", "--model", "m.toml", "--duration", "60"),
        ("demo", "-", "--dry-run"),
    ],
)
def test_what_makes_a_trial_takes_none_from_standard_input(zfcal, tmp_path, words):
    """No folder of that name is made."""
    (tmp_path / "m.toml").touch()
    done = zfcal(*words)
    assert done.code == 2
    assert "Give a folder" in done.err
    assert [path.name for path in tmp_path.iterdir()] == ["m.toml"]


def test_a_check_of_paths_on_standard_input_says_all_once(zfcal, tmp_path, monkeypatch):
    """Of two files of a trial, what a check of the trial says."""
    zfcal("init", "trial", "--arena", "ring", "--fish", "3")
    once = zfcal("check", "trial")
    paths = "trial/trial.toml\ntrial/models/000000.toml\n"
    monkeypatch.setattr("sys.stdin", io.StringIO(paths))
    found = zfcal("check", "-")
    where = [line.split(":")[1] for line in found.lines]
    assert where == [line.split(":")[1] for line in once.lines]
    assert len(set(where)) == len(where)

"""Arguments of functions are the options of their commands, and refused like them."""

import importlib
import inspect
import shlex
import typing

import click
import numpy as np
import pandas as pd
import pytest

import zfcal
from zfcal.errors import OptionError
from zfcal.frames import TrialTables
from zfcal_cli.main import group

NEEDED = {
    "simulate": "new --model trial/models/000000.toml --duration 60",
    "compare": "trial --against alone",
}
"""Of each command what it does not go without."""

FUNCTIONS = ("analyse", "calibrate", "compare", "diagnose", "extend", "report", "simulate")
VOICE = {"as_json", "verbose", "quiet", "traceback"}
"""How a command speaks; a function has ``tell``."""

MODEL = {"model": "trial/models/000000.toml", "duration": 60}


def options_of(command):
    """Return the options of a command by the Python names of their long forms."""
    return {
        max(option.opts, key=len).lstrip("-").replace("-", "_"): option
        for option in command.params
        if isinstance(option, click.Option) and not option.hidden and option.name not in VOICE
    }


def unsaid(name, command):
    """Return what a command gets for each option that nobody gives."""
    context = command.make_context(name, shlex.split(NEEDED.get(name, "trial")))
    return {
        key: ",".join(value) if isinstance(value, tuple) and value else value
        for key, value in context.params.items()
    }


def differences(name, command):
    """Return in what a command and its function differ, a line for each."""
    options, given = options_of(command), unsaid(name, command)
    arguments = dict(inspect.signature(getattr(zfcal, name)).parameters)
    first = next(iter(arguments))
    del arguments[first], arguments["tell"]
    lines = [f"{key}: only one has it" for key in options.keys() ^ arguments.keys()]
    for key in options.keys() & arguments.keys():
        argument = arguments[key]
        if argument.kind is not inspect.Parameter.KEYWORD_ONLY:
            lines.append(f"{key}: not by its name alone")
        if options[key].name != key:
            lines.append(f"{key}: the command calls it {options[key].name}")
        elif options[key].required:
            if argument.default is not inspect.Parameter.empty:
                lines.append(f"{key}: the command needs it")
        elif argument.default != given[key] or type(argument.default) is not type(given[key]):
            lines.append(f"{key}: {argument.default!r} and {given[key]!r}")
    return lines


@pytest.mark.parametrize("name", FUNCTIONS)
def test_arguments_are_the_options_of_the_command(name, here):
    """Each long option by its name, with its default; nothing else but who hears."""
    assert differences(name, group.get_command(None, name)) == []


def test_an_option_without_an_argument_is_noticed(here):
    """And one whose default differs: what the test above is for."""
    command = group.get_command(None, "report")
    added = click.Option(["--paper"], default="a4")
    changed = click.Option(["--out"], default="elsewhere")
    rest = [option for option in command.params if option.name != "out"]
    other = click.Command("report", params=[*rest, added, changed], callback=command.callback)
    assert sorted(differences("report", other)) == [
        "out: None and 'elsewhere'",
        "paper: only one has it",
    ]


@pytest.mark.parametrize("name", FUNCTIONS)
def test_the_words_of_an_option_are_those_of_the_argument(name):
    """As types, so that a checker finds a slip of the pen."""
    function = getattr(zfcal, name)
    module, own = zfcal._LAZY[name]
    function = getattr(importlib.import_module(module), own)
    hints = typing.get_type_hints(function, localns={"TrialTables": TrialTables, "pd": pd})
    for key, option in options_of(group.get_command(None, name)).items():
        words = literals(hints[key])
        if isinstance(option.type, click.Choice):
            assert words == list(map(str, option.type.choices)), key
        else:
            assert words == [], key


def literals(hint):
    """Return the words of the Literal in a type, as texts."""
    if typing.get_origin(hint) is typing.Literal:
        return [str(word) for word in typing.get_args(hint)]
    return [word for part in typing.get_args(hint) for word in literals(part)]


@pytest.mark.parametrize(
    ("name", "options", "says"),
    [
        ("analyse", {"scoring": "papr"}, "--scoring: 'papr' is not one of 'paper', 'legacy'"),
        ("analyse", {"features": "D,W"}, "names none beyond"),
        ("analyse", {"control": "nowhere"}, "--control: Path 'nowhere' does not exist"),
        ("calibrate", {"generations": -1}, "--generations: -1 is below 0"),
        ("calibrate", {"generations": 1.5}, "--generations: 1.5 is no whole number"),
        ("calibrate", {"generations": 1, "budget": 5}, "--generations or with its --budget"),
        ("calibrate", {"budget": "5 weeks"}, "--budget: '5 weeks' is no positive time"),
        ("calibrate", {"budget": float("nan")}, "no positive time"),
        ("calibrate", {"publish": "best"}, "--publish: 'best' is not one of"),
        ("calibrate", {"workers": 0}, "--workers: 0 is below 1"),
        ("calibrate", {"window": (9, 3), "out": "x"}, "no stretch"),
        ("calibrate", {"window": "0:100"}, "needs -o FILE"),
        ("calibrate", {"held_out": (0, 100)}, "--held-out belongs to --window"),
        ("calibrate", {"publish": "likelihood", "seed_likelihood": False}, "is the estimate"),
        ("calibrate", {"features": "D,,W"}, "empty name"),
        ("diagnose", {"quick": True, "null_replicates": 39}, "--quick simulates no null"),
        ("diagnose", {"null_replicates": 40}, "40 is not one of 39, 199"),
        ("diagnose", {"noise_mm": -1}, "--noise-mm: -1 is not at least 0"),
        ("extend", {"generations": 1, "budget": 5}, "--generations or with its --budget"),
        ("extend", {"findings": "nowhere.json"}, "does not exist"),
        ("simulate", {**MODEL, "duration": 0}, "--duration: 0 is no positive time"),
        ("simulate", {**MODEL, "model": "nowhere.toml"}, "does not exist"),
        ("simulate", {**MODEL, "look": "hard"}, "--look is about images"),
        ("simulate", {**MODEL, "video": True, "draw": "noise_grey=x"}, "--draw takes NAME=VALUE"),
        ("simulate", {**MODEL, "robot": True, "robots": 2}, "--robot means one robot"),
        ("simulate", {**MODEL, "fps": 0}, "--fps: 0 is not above 0"),
        ("compare", {"against": "alone", "force": True}, "--force is about the files of --out"),
        ("compare", {"against": "alone", "out": "x", "format": "gif"}, "'gif' is not one of"),
    ],
)
def test_an_option_that_cannot_be_is_refused_by_its_name(name, options, says, here, read_all):
    """Before anything is made, as the command refuses it."""
    before = read_all(here)
    with pytest.raises(OptionError, match=r".") as caught:
        getattr(zfcal, name)("trial", **options)
    assert says in str(caught.value)
    assert read_all(here) == before


@pytest.mark.parametrize("name", FUNCTIONS)
def test_what_is_no_trial_is_told(name, here):
    """With the tree's own error, and without a traceback's help."""
    options = {"simulate": MODEL, "compare": {"against": "alone"}}.get(name, {})
    if name == "simulate":
        (here / "nowhere").mkdir()
        (here / "nowhere" / "trial.toml").write_text("no")
    with pytest.raises(zfcal.ZfcalError, match="nowhere"):
        getattr(zfcal, name)("nowhere", **options)


def test_no_trials_make_no_report(here):
    """And no comparison."""
    with pytest.raises(zfcal.ZfcalError, match="at least one trial"):
        zfcal.report([])
    with pytest.raises(zfcal.ZfcalError, match=r"."):
        zfcal.compare([], against="alone")


def test_numbers_of_numpy_are_numbers(here):
    """They stand in lineage as plain ones, and make the same bytes."""
    zfcal.calibrate("trial", generations=np.int64(0), population=np.int32(4), steps=np.int64(20))
    model = (here / "trial" / "models" / "000120.toml").read_bytes()
    heard = []
    zfcal.calibrate("trial", generations=0, population=4, steps=20, tell=heard.append, force=True)
    assert (here / "trial" / "models" / "000120.toml").read_bytes() == model

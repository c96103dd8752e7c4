"""Arguments of functions are the options of their commands, and refused like them."""

import ast
import importlib
import inspect
import re
import shlex
import typing

import click
import numpy as np
import pytest

import zfcal
from zfcal.api.analysing import analysis_of
from zfcal.api.calibrating import calibration_of
from zfcal.api.diagnosing import diagnosis_of, printing_of
from zfcal.api.extending import extension_of
from zfcal.api.simulating import simulation_of
from zfcal.errors import OptionError
from zfcal.stages.events import say_nothing
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
SEEDED = [("calibrate", {}), ("diagnose", {}), ("extend", {}), ("simulate", MODEL)]
TOO_LARGE = "--seed: 9223372036854775808 is above 9223372036854775807"


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
    hints = typing.get_type_hints(function)
    for key, option in options_of(group.get_command(None, name)).items():
        words = literals(hints[key])
        if isinstance(option.type, click.Choice):
            assert words == list(map(str, option.type.choices)), key
        else:
            assert words == [], key


OTHERS = {
    "analyse": {"control": "alone", "scoring": "legacy", "features": "residence"},
    "calibrate": {
        "generations": 3,
        "budget": "5s",
        "population": 8,
        "runs": 2,
        "steps": 20,
        "optimiser": "deap",
        "seed_likelihood": False,
        "model": "trial/models/000000.toml",
        "publish": "score",
        "as_published": True,
        "confirm": 3,
        "diversity": "population",
        "renewal": False,
        "sampler": "grid",
        "baselines": True,
        "seed": 5,
        "workers": 1,
        "features": ("D", "W"),
    },
    "diagnose": {
        "model": "trial/models/000000.toml",
        "null_replicates": 199,
        "quick": True,
        "noise_mm": 0.5,
        "window": (0, 60),
        "seed": 5,
        "workers": 1,
        "out": "elsewhere",
        "format": "pdf",
        "width": "single",
    },
    "extend": {
        "effect": "alignment",
        "findings": "trial",
        "generations": 3,
        "budget": 2.5,
        "population": 8,
        "seed": 5,
        "workers": 1,
        "out": "elsewhere",
    },
    "simulate": {
        "model": "alone/models/000000.toml",
        "duration": "2min",
        "seed": 5,
        "arena": "ring",
        "fish": 2,
        "robot": True,
        "robots": 2,
        "fps": 10,
        "video": True,
        "video_file": "film.avi",
    },
}
"""For each function other values than the usual ones: each changes what is done."""

WITH_OTHERS = {
    "calibrate": {"window": {"out": "x.toml"}, "held_out": {"window": "0:50", "out": "x.toml"}},
    "simulate": {key: {"video": True} for key in ("look", "draw", "photograph")},
}
"""Of some options those without which they are refused."""

BESIDE = {
    "calibrate": {"window": "0:99", "held_out": "100:200"},
    "simulate": {"look": "hard", "draw": {"noise_grey": 9}, "photograph": "trial/trial.toml"},
}
"""Their other values."""


def chosen(name, **options):
    """Return what options of a function come to, as those who do the work get it."""
    usual = {
        key: argument.default
        for key, argument in inspect.signature(getattr(zfcal, name)).parameters.items()
    }
    needed = MODEL if name == "simulate" else {}
    asked = {**usual, **needed, **options}
    match name:
        case "analyse":
            return analysis_of(asked).chosen
        case "calibrate":
            with calibration_of(asked, say_nothing) as found:
                return found.chosen, found.span
        case "diagnose":
            return diagnosis_of(asked), printing_of(asked)
        case "extend":
            return extension_of(asked)
    found = simulation_of(asked)
    return found.chosen, found.filmed


@pytest.mark.parametrize("name", OTHERS)
def test_each_option_takes_effect(name, here):
    """Whoever does the work gets something else: function and command share how."""
    usual = chosen(name)
    for key, value in OTHERS[name].items():
        assert chosen(name, **{key: value}) != usual, key
    for key, others in WITH_OTHERS.get(name, {}).items():
        value = BESIDE[name][key]
        assert chosen(name, **others, **{key: value}) != chosen_beside(name, others), key
    command = group.get_command(None, name)
    asked = options_of(command).keys() - {"dry_run", "force", "cluster"}
    known = OTHERS[name].keys() | BESIDE.get(name, {}).keys()
    # Of one window: where its model goes is asked for with it.
    assert asked - {"out"} == known - {"out"}


def chosen_beside(name, others):
    """Return what the options that another one needs come to without it."""
    try:
        return chosen(name, **others)
    except OptionError:
        return None


def test_where_the_model_of_a_window_goes(here):
    """From `out`, as a path."""
    _, span = chosen("calibrate", window="0:99", out="x.toml")
    assert (span.train_s, span.held_out_s, str(span.output)) == ((0, 99), None, "x.toml")


def test_what_the_paper_did_gives_way_to_what_is_said(here):
    """Also where that is what is usual otherwise."""
    paper, _ = chosen("calibrate", as_published=True)
    said, _ = chosen("calibrate", as_published=True, confirm=10, renewal=True)
    assert (paper.settings.n_confirmed, paper.settings.renews) == (0, False)
    assert (said.settings.n_confirmed, said.settings.renews) == (10, True)
    assert said.settings.optimiser == paper.settings.optimiser == "deap"


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
        *((name, {**more, "seed": 2**63}, TOO_LARGE) for name, more in SEEDED),
        ("calibrate", {"seed": -1}, "--seed: -1 is below 0"),
        ("calibrate", {"window": "0:100", "out": ""}, "--out: The name of a path is empty"),
        ("analyse", {"control": ""}, "--control: The name of a path is empty"),
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
        ("simulate", {**MODEL, "video": True, "draw": "noise_grey=x"}, "takes NAME=VALUE"),
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
def test_an_empty_name_is_no_trial(name, here, read_all, monkeypatch):
    """The current folder is ``.``, and is left alone."""
    monkeypatch.chdir(here / "trial")
    before = read_all(here)
    model = {**MODEL, "model": here / MODEL["model"]}
    options = {"simulate": model, "compare": {"against": here / "alone"}}.get(name, {})
    with pytest.raises(OptionError, match="The name of a path is empty"):
        getattr(zfcal, name)("", **options)
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


@pytest.mark.slow
def test_numbers_of_numpy_are_numbers(here):
    """They stand in lineage as plain ones, and make the same bytes."""
    zfcal.calibrate("trial", generations=np.int64(0), population=np.int32(4), steps=np.int64(20))
    model = (here / "trial" / "models" / "000120.toml").read_bytes()
    heard = []
    zfcal.calibrate("trial", generations=0, population=4, steps=20, tell=heard.append, force=True)
    assert (here / "trial" / "models" / "000120.toml").read_bytes() == model


def test_calls_in_the_documentation_are_possible(repository):
    """Each function is there, and takes what it is given."""
    text = (repository / "docs" / "python.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    calls = [
        node
        for block in blocks
        for node in ast.walk(ast.parse(block))
        if isinstance(node, ast.Call) and re.fullmatch(r"zfcal\.\w+", ast.unparse(node.func))
    ]
    for call in calls:
        function = getattr(zfcal, ast.unparse(call.func).removeprefix("zfcal."))
        given = {keyword.arg: None for keyword in call.keywords}
        inspect.signature(function).bind(*call.args, **given)
    assert len(calls) >= 8


FLAGS = {
    "analyse": ("dry_run", "force"),
    "calibrate": (
        *("seed_likelihood", "as_published", "renewal", "baselines"),
        *("dry_run", "force"),
    ),
    "diagnose": ("quick", "dry_run", "force"),
    "extend": ("dry_run", "force"),
    "simulate": ("robot", "video", "dry_run", "force"),
    "report": ("published", "dry_run", "force"),
    "compare": ("dry_run", "force"),
}
"""Of each function what is yes or no."""

FOR_NEEDED = {"simulate": MODEL, "compare": {"against": "alone"}}


def test_every_option_that_is_yes_or_no_is_known():
    """As the types of the arguments say."""
    for name in FUNCTIONS:
        function = getattr(importlib.import_module(zfcal._LAZY[name][0]), name)
        hints = typing.get_type_hints(function)
        assert {key for key, hint in hints.items() if hint in {bool, bool | None}} == {*FLAGS[name]}


@pytest.mark.parametrize("value", ["no", "", 0, 1, [], np.int64(1)])
@pytest.mark.parametrize(("name", "flag"), [(name, key) for name in FLAGS for key in FLAGS[name]])
def test_what_is_neither_yes_nor_no_is_refused(name, flag, value, here, read_all):
    """A text counts as yes in Python, also ``no``."""
    before = read_all(here)
    with pytest.raises(OptionError, match="is neither True nor False") as caught:
        getattr(zfcal, name)("trial", **{**FOR_NEEDED.get(name, {}), flag: value})
    assert str(caught.value).startswith(f"--{flag.replace('_', '-')}: {value!r}")
    assert read_all(here) == before


def test_yes_and_no_of_numpy_are_yes_and_no(here):
    """As the plain ones, not as objects that happen to be true."""
    options, _ = chosen("calibrate", renewal=np.False_, baselines=np.True_)
    assert options.settings.renews is False
    assert options.baselines is True


@pytest.mark.parametrize(
    ("name", "options"),
    [
        *(("calibrate", {key: True}) for key in ("budget", "generations", "seed", "workers")),
        ("calibrate", {"window": (False, True), "out": "x"}),
        ("diagnose", {"noise_mm": True}),
        ("simulate", {**MODEL, "duration": np.True_}),
    ],
)
def test_yes_is_no_number(name, options, here):
    """Though it counts as one in Python."""
    with pytest.raises(OptionError, match=r"True_?\)? is no |is no stretch"):
        getattr(zfcal, name)("trial", **options)


@pytest.mark.parametrize(
    "window",
    [
        (np.int64(0), np.int32(120)),
        [0, 120],
        np.array([0, 120]),
        np.array([0.0, 120.0]),
        (np.float64(0), 120.0),
    ],
)
def test_a_stretch_may_be_of_numbers_of_numpy(window, here):
    """They stand in lineage as plain ones."""
    _, span = chosen("calibrate", window=window, out="x.toml")
    assert span.train_s == (0, 120)
    assert [type(second) for second in span.train_s] == [int, int]


WRONG = [
    *(("analyse", {"control": value}, "--control") for value in (None, 5, [5])),
    *(("analyse", {"features": value}, "--features") for value in (5, ["residence", 3])),
    *(("analyse", {"scoring": value}, "--scoring") for value in (None, 3)),
    *(("calibrate", {"window": value, "out": "x"}, "--window") for value in (120, (None, 120))),
    *(("calibrate", {"window": "0:9", "out": value}, "--out") for value in (5, b"x")),
    *(
        ("calibrate", {"budget": value}, "--budget")
        for value in ([50], np.timedelta64(50, "ms"), np.array([50, 60]), 10**400)
    ),
    *(
        ("calibrate", {key: None}, f"--{key}")
        for key in ("population", "runs", "steps", "sampler", "features")
    ),
    ("calibrate", {"model": 5}, "--model"),
    ("calibrate", {"cluster": 5}, "--cluster"),
    ("calibrate", {"features": 5}, "--features"),
    ("diagnose", {"noise_mm": [1]}, "--noise-mm"),
    ("diagnose", {"quick": None}, "--quick"),
    ("diagnose", {"out": 5}, "--out"),
    *(("extend", {"effect": value}, "--effect") for value in (None, 3, [3])),
    ("extend", {"findings": 3}, "--findings"),
    *(("simulate", {**MODEL, "duration": value}, "--duration") for value in (None, [60])),
    *(("simulate", {**MODEL, "model": value}, "--model") for value in (None, 5)),
    *(
        ("simulate", {**MODEL, "draw": value, "video": True}, "--draw")
        for value in (None, 5, [("noise_grey", 4)])
    ),
    ("simulate", {**MODEL, "arena": ["ring"]}, "--arena"),
    ("simulate", {**MODEL, "video_file": 5}, "--video-file"),
    ("report", {"out": 3}, "--out"),
    *(("report", {"format": value}, "--format") for value in ("gif", 5, ["png", "jpg"])),
    *(("report", {"film": value}, "--film") for value in ("avi", 5, ["mp4"])),
    *(("report", {"width": value}, "--width") for value in ("3cm", "59mm", 401, "wide", [85])),
    ("compare", {"against": "alone", "out": 3}, "--out"),
    *((name, {**FOR_NEEDED.get(name, {}), "tell": 5}, "tell: 5") for name in FUNCTIONS),
]


@pytest.mark.parametrize(("name", "options", "says"), WRONG)
def test_a_value_of_another_type_is_refused_by_its_name(name, options, says, here, read_all):
    """On one line, with what it got; Python's own errors would say neither."""
    before = read_all(here)
    with pytest.raises(OptionError, match=says) as caught:
        getattr(zfcal, name)("trial", **options)
    assert "\n" not in str(caught.value)
    assert read_all(here) == before


@pytest.mark.parametrize("name", FUNCTIONS)
@pytest.mark.parametrize("trial", [None, 5, b"trial", ["trial", 5]])
def test_what_cannot_be_a_trial_is_refused(name, trial, here):
    """What is given is named; of several for a function that takes one as well."""
    with pytest.raises(OptionError, match="neither the path of a trial nor its tables") as caught:
        getattr(zfcal, name)(trial, **FOR_NEEDED.get(name, {}))
    assert repr(trial) in str(caught.value) or "5 is neither" in str(caught.value)


def test_several_trials_are_too_many_for_most(here):
    """The message says what was given, the hint what to do."""
    with pytest.raises(OptionError, match=r"\['trial', 'alone'\] is neither") as caught:
        zfcal.analyse(["trial", "alone"])
    assert "loop" in caught.value.hint


def test_a_long_value_is_cut_in_the_message(here):
    """A table given by mistake does not fill the screen."""
    with pytest.raises(OptionError) as caught:
        zfcal.analyse(zfcal.open("trial").tracks())
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 150


def test_effects_may_stand_in_one_text(here):
    """With commas, as other lists of names; each once."""
    assert chosen("extend", effect="alignment, turning-bias").names == (
        "alignment",
        "turning-bias",
    )
    assert chosen("extend", effect=["alignment", "alignment"]).names == ("alignment",)


def test_a_trial_that_is_named_twice_counts_once(here):
    """However it is spelt; on both sides of a comparison it is refused."""
    (here / "link").symlink_to(here / "trial")
    spelt = ["trial", "./trial", here / "trial", zfcal.open("trial"), "link", "trial/tracks"]
    assert str(zfcal.report(spelt, dry_run=True)) == "trial/report/index.html"
    found = zfcal.compare(spelt, against=["alone", "./alone"])
    assert found[["n_a", "n_b"]].max().tolist() == [1, 1]
    with pytest.raises(zfcal.ZfcalError, match="is in both sets"):
        zfcal.compare("trial", against=here / "trial")

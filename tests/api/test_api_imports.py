"""The package's functions in every order of imports, for people, pickles and type checkers."""

import ast
import doctest
import importlib
import inspect
import os
import pickle
import pydoc
import subprocess
import sys
from pathlib import Path

import pytest

import zfcal
from zfcal.api import values

REPOSITORY = Path(__file__).resolve().parents[2]
FUNCTIONS = ("analyse", "calibrate", "compare", "diagnose", "extend", "report", "simulate")
HEAVY = ("numpy", "pandas", "numba", "scipy", "cv2", "matplotlib", "pyarrow", "jsonschema")

ORDERS = (
    "import zfcal; zfcal.calibrate; zfcal.report; zfcal.diagnose",
    "import zfcal.calibrate, zfcal.report, zfcal.diagnose",
    "import zfcal.calibrate.pace, zfcal.report.labels, zfcal.diagnose.chances",
    "from zfcal.calibrate import pace; from zfcal.report import labels; from zfcal import diagnose",
    "from zfcal import calibrate, report; import zfcal.calibrate.pace as pace; pace.__name__",
    "import zfcal; c = zfcal.calibrate; import zfcal.calibrate.pace; assert c is zfcal.calibrate",
    "import zfcal, importlib; zfcal.report; importlib.reload(zfcal); import zfcal.diagnose.chances",
    pytest.param(
        "from zfcal import *; assert all(map(callable, (calibrate, diagnose, report, analyse)))",
        marks=pytest.mark.slow,
    ),
)

HOLDS = """
import importlib, pickle, sys, zfcal
for name in ("calibrate", "diagnose", "report"):
    found = getattr(zfcal, name)
    assert callable(found), name
    assert found is sys.modules["zfcal." + name], name
    assert pickle.loads(pickle.dumps(found)) is found, name
    namespace = {}
    exec("from zfcal import " + name, namespace)
    assert namespace[name] is found, name
assert importlib.import_module("zfcal.calibrate.pace") is zfcal.calibrate.pace
"""


@pytest.mark.parametrize("order", ORDERS)
def test_a_function_that_is_a_package_too_is_both(order):
    """It can be called, has its modules, and is the same one, whatever was imported first."""
    subprocess.run([sys.executable, "-c", f"{order}\n{HOLDS}"], check=True)


def test_a_package_that_is_called_is_the_function(here):
    """With its words for a wrong argument, its signature and its docstring."""
    for name in ("calibrate", "diagnose", "report"):
        module, own = zfcal._LAZY[name]
        function = getattr(importlib.import_module(module), own)
        package = getattr(zfcal, name)
        assert inspect.ismodule(package)
        assert inspect.signature(package) == inspect.signature(function)
        first, _, rest = inspect.getdoc(function).partition("\n\n")
        assert inspect.getdoc(package).startswith(f"{first}\n\n{name}(\n")
        assert inspect.getdoc(package).endswith(rest)
        with pytest.raises(TypeError, match=rf"{name}\(\) got an unexpected keyword"):
            package("trial", generatons=3)


@pytest.mark.parametrize("name", ["calibrate", "diagnose", "report"])
def test_help_of_a_package_shows_how_it_is_called(name):
    """Every argument with its default; its synopsis stays the first line."""
    text = pydoc.render_doc(getattr(zfcal, name), renderer=pydoc.plaintext)
    for argument in inspect.signature(getattr(zfcal, name)).parameters.values():
        assert f"        {argument},\n" in text
    first = inspect.getdoc(getattr(zfcal, name)).splitlines()[0]
    assert f"zfcal.{name} - {first}" in text


HINTS = """
import sys, typing
from importlib import import_module
from zfcal import _LAZY
for name in %r:
    module, own = _LAZY[name]
    typing.get_type_hints(getattr(import_module(module), own))
    print(name)
"""


@pytest.mark.slow
def test_types_are_known_while_a_program_runs():
    """Frameworks ask for them, in a process that has loaded nothing else."""
    code = HINTS % (FUNCTIONS,)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.stdout.split(), done.stderr) == (list(FUNCTIONS), "")


def test_every_function_that_is_a_package_is_known():
    """One that were not would be a package that nobody can call."""
    both = {name for name in FUNCTIONS if (REPOSITORY / "zfcal" / name).is_dir()}
    assert both == set(zfcal._PACKAGES)
    assert not [name for name in FUNCTIONS if (REPOSITORY / "zfcal" / f"{name}.py").exists()]


def test_functions_go_to_other_processes():
    """Pickled by their place."""
    for name in FUNCTIONS:
        function = getattr(zfcal, name)
        assert pickle.loads(pickle.dumps(function)) is function


def test_the_package_exports_these_alone():
    """And loads nothing that is heavy."""
    assert sorted([*FUNCTIONS, "TrialTables", "ZfcalError", "ZfcalWarning", "open"]) == sorted(
        zfcal.__all__
    )
    code = (
        "import sys, time; began = time.perf_counter(); import zfcal; dir(zfcal); "
        "took = time.perf_counter() - began; "
        f"print([m for m in {HEAVY!r} if m in sys.modules], took < 0.3)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[] True"


def test_type_checkers_see_what_is_loaded_later():
    """Each lazy name stands once more where a checker looks, from the same module."""
    tree = ast.parse((REPOSITORY / "zfcal" / "__init__.py").read_text())
    seen = {
        (alias.asname or alias.name): (node.module, alias.name)
        for branch in tree.body
        if isinstance(branch, ast.If)
        for node in branch.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert seen == zfcal._LAZY


@pytest.mark.slow
def test_mypy_types_the_functions(tmp_path):
    """Also where a module of the package of that name is imported; a slip is an error."""
    program = tmp_path / "program.py"
    program.write_text(
        "import zfcal\n"
        "import zfcal.calibrate.task\n"
        "from zfcal import report\n"
        "from zfcal.report.page import PAGE\n"
        'reveal_type(zfcal.calibrate("trial", generations=3))\n'
        'reveal_type(report(["trial"]))\n'
        'reveal_type(zfcal.diagnose(zfcal.open("trial"), quick=True).findings())\n'
        'reveal_type(zfcal.simulate("new", model="m.toml", duration="2min"))\n'
        'reveal_type(zfcal.compare("a", against=["b"], out="c", dry_run=bool(PAGE)))\n'
        'reveal_type(zfcal.diagnose("trial", dry_run=bool(PAGE)))\n'
        "from zfcal.calibrate.task import Settings\n"
        "reveal_type(Settings.__name__)\n"
        'zfcal.calibrate("trial", generatons=3)\n'
        'zfcal.diagnose("trial", null_replicates=40)\n'
    )
    config = ["--config-file", REPOSITORY / "pyproject.toml"]
    cache = ["--cache-dir", REPOSITORY / ".mypy_cache"]
    done = subprocess.run(
        [sys.executable, "-m", "mypy", *config, *cache, program],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "MYPYPATH": str(REPOSITORY)},
    )
    lines = [line.partition("program.py:")[2] for line in done.stdout.splitlines()]
    assert [line.partition('"')[2].rstrip('"') for line in lines if "Revealed" in line] == [
        "zfcal.frames.TrialTables",
        "pathlib.Path",
        "pandas.core.frame.DataFrame",
        "zfcal.frames.TrialTables",
        "pandas.core.frame.DataFrame | None",
        "zfcal.frames.TrialTables | None",
        "str",
    ]
    errors = [line for line in lines if " error: " in line]
    assert [line.partition(":")[0] for line in errors] == ["13", "14"], done.stdout


EXAMPLES = [
    name
    if name not in {"diagnose", "extend", "report"}
    else pytest.param(name, marks=pytest.mark.slow)
    for name in FUNCTIONS
]


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_example_of_a_function_gives_what_it_shows(name, here):
    """In a folder with a small trial and one of fish alone."""
    if name == "simulate":
        # The example makes this one.
        (here / "alone").rename(here / "other")
    module, own = zfcal._LAZY[name]
    module = importlib.import_module(module)
    finder = doctest.DocTestFinder(recurse=False)
    (example,) = finder.find(getattr(module, own), name, module)
    found = doctest.DocTestRunner().run(example)
    assert (found.failed, found.attempted > 1) == (0, True)


def test_examples_of_values_give_what_they_show():
    """Of the forms that people may give them in."""
    found = doctest.testmod(values)
    assert (found.failed, found.attempted) == (0, 6)


SCRIPT = """
import multiprocessing, sys
print("began")
import zfcal
found = zfcal.diagnose("trial", quick=True, seed=1, workers=2)
print(found.findings().attrs["verdict"], multiprocessing.active_children())
"""


@pytest.mark.slow
def test_a_script_needs_no_guard_and_leaves_no_process(here):
    """Nothing imports it a second time; it says what it says once."""
    (here / "script.py").write_text(SCRIPT)
    done = subprocess.run(
        [sys.executable, "script.py"], capture_output=True, text=True, check=True, cwd=here
    )
    assert done.stdout.splitlines() == ["began", "untestable []"]
    assert done.stderr == ""

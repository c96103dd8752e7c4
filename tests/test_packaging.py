"""What is installed is what lies in the tree, from one lock, in layers."""

import ast
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from importlib.metadata import entry_points, packages_distributions, version
from pathlib import Path

import pytest
import yaml
from packaging.markers import Marker
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

import zfcal

PLACES = {"zfcal": "zfcal", "schemas": "zfcal/schemas", "cli": "zfcal_cli"}
"""Top-level folders, and where they are installed."""

LOCKED_WITH_PROGRAMS = "sleap"
"""The extra that brings too much for the lock of zfcal itself."""

TOP = "The command line stands on top"
DOWN = "Imports point down, and siblings do not know each other"
STAGES = "A command's stage knows only what all stages share, and those before it"
ROOT = "No module imports the package root"
PURE = "What computes opens no file, no window and no port"
SILENT = "Only the command line talks to a person"

CROSSED = {
    "a unit that knows the arena": (DOWN, "zfcal/units.py", "from zfcal import arena"),
    "a model that knows the scores": (DOWN, "zfcal/model/extra.py", "import zfcal.behaviour"),
    "a report that knows the stages": (DOWN, "zfcal/report/extra.py", "import zfcal.stages"),
    "a package that no layer names": (DOWN, "zfcal/extra/__init__.py", "X = 1"),
    "a library that knows its commands": (TOP, "zfcal/online/extra.py", "import zfcal_cli"),
    "a module that imports the root": (ROOT, "zfcal/tracks.py", "from zfcal import __version__"),
    "a statistic that opens a file": (PURE, "zfcal/behaviour/extra.py", "import pyarrow"),
    "a stage that prints": (SILENT, "zfcal/stages/extra.py", "import rich"),
    "a stage that knows a later one": (
        STAGES,
        "zfcal/stages/analyse/extra.py",
        "import zfcal.stages.extend",
    ),
}
"""Ways to break the layers: the contract that must notice, a module, a line in it."""


@pytest.fixture(scope="module")
def project(repository):
    """Return pyproject.toml."""
    return tomllib.loads((repository / "pyproject.toml").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def pins(repository):
    """Return for each locked package its version, its marker and its hashes."""
    return locked(repository / "requirements.lock")


def locked(path: Path) -> dict[str, tuple[str, str, list[str]]]:
    """Return for each package of a lock its version, its marker and its hashes."""
    text = path.read_text(encoding="utf-8").replace("\\\n", " ")
    found = {}
    for line in text.splitlines():
        if line and not line.startswith(("#", "-")):
            name, pinned, rest = re.fullmatch(r"([a-z0-9-]+)==(\S+)(.*)", line).groups()
            marker = rest.partition("--hash")[0].strip(" ;")
            found[name] = (pinned, marker, re.findall(r"--hash=sha256:([0-9a-f]{64})", rest))
    return found


@pytest.fixture(scope="module")
def tree(repository, tmp_path_factory):
    """Return a copy of what the wheel is made from: building leaves traces in its tree."""
    copy = tmp_path_factory.mktemp("tree")
    for folder in PLACES:
        ignore = shutil.ignore_patterns("__pycache__", ".*")
        shutil.copytree(repository / folder, copy / folder, ignore=ignore)
    for name in ("pyproject.toml", "LICENSE", "README.md"):
        if (repository / name).exists():
            shutil.copy(repository / name, copy)
    return copy


@pytest.fixture(scope="module")
def wheel(tree, tmp_path_factory):
    """Return the wheel, built with the builder of the lock."""
    place = tmp_path_factory.mktemp("wheel")
    build = f"from setuptools.build_meta import build_wheel; build_wheel({str(place)!r})"
    subprocess.run([sys.executable, "-c", build], cwd=tree, check=True, capture_output=True)
    return next(place.glob("*.whl"))


def installed_name(path: Path) -> str:
    """Return the path under which a file of the tree is installed."""
    return "/".join((PLACES[path.parts[0]], *path.parts[1:]))


def sources(tree: Path) -> list[Path]:
    """Return all files of the installed folders, relative to the tree."""
    return [
        path.relative_to(tree)
        for folder in PLACES
        for path in sorted((tree / folder).rglob("*"))
        if path.is_file()
    ]


def imported(path: Path) -> set[str]:
    """Return the top-level names that a module imports absolutely."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and not node.level:
            names.add(node.module)
    return {name.partition(".")[0] for name in names}


def required(lines: list[str]) -> set[str]:
    """Return the names of requirements, in their canonical form."""
    return {canonicalize_name(Requirement(line).name) for line in lines}


def test_every_package_of_the_tree_is_listed(project, tree):
    """A folder with an __init__.py that pyproject.toml does not name would be lost in a wheel."""
    found = {
        installed_name(path.parent).replace("/", ".")
        for path in sources(tree)
        if path.name == "__init__.py"
    }
    assert sorted(project["tool"]["setuptools"]["packages"]) == sorted(found)


def test_every_module_lies_in_a_package(tree):
    """A module in a folder without __init__.py would be imported from the tree, never installed."""
    folders = {path.parent for path in sources(tree) if path.suffix == ".py"}
    assert [folder for folder in folders if not (tree / folder / "__init__.py").exists()] == []


def test_the_wheel_holds_the_whole_tree(tree, wheel):
    """Modules, arenas, schemas, templates and the typing marker: nothing stays behind."""
    with zipfile.ZipFile(wheel) as archive:
        packed = {name for name in archive.namelist() if ".dist-info/" not in name}
    assert packed == {installed_name(path) for path in sources(tree)}


def test_the_wheel_works_away_from_the_tree(wheel, tmp_path):
    """Both roots, and the schemas as data, come from the wheel alone."""
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(tmp_path)
    program = (
        "import sys; sys.path.insert(0, sys.argv[1])\n"
        "import zfcal, zfcal.schemas, zfcal_cli, importlib.resources as resources\n"
        "for module in (zfcal, zfcal.schemas, zfcal_cli):\n"
        "    assert module.__file__.startswith(sys.argv[1]), module.__file__\n"
        "names = [p.name for p in resources.files('zfcal.schemas').iterdir()]\n"
        "assert any(name.endswith('.json') for name in names), names\n"
    )
    run = [sys.executable, "-c", program, str(tmp_path)]
    subprocess.run(run, cwd=tmp_path, check=True)


def test_the_console_script_finds_its_function():
    """The entry point ``zfcal`` leads to something that can be called."""
    (script,) = entry_points(group="console_scripts", name="zfcal")
    assert script.value == "zfcal_cli.main:main"
    assert callable(script.load())


def test_one_version_everywhere(project):
    """The package, its metadata and pyproject.toml agree."""
    assert zfcal.__version__ == version("zfcal") == project["project"]["version"]


def test_who_cites_or_reads_what_changed_finds_this_version(repository, project):
    """CITATION.cff and the changelog have the version of the project, of the same day."""
    cited = yaml.safe_load((repository / "CITATION.cff").read_text(encoding="utf-8"))
    assert cited["cff-version"] == "1.2.0"
    assert {"message", "title", "authors"} <= cited.keys()
    assert cited["version"] == project["project"]["version"]
    assert cited["license"] == project["project"]["license"]
    text = (repository / "CHANGELOG.md").read_text(encoding="utf-8")
    newest = re.search(r"^## \[(\d.*?)\] - (\S+)$", text, re.MULTILINE)
    assert newest.groups() == (cited["version"], str(cited["date-released"]))


@pytest.mark.slow
def test_every_import_is_a_dependency(project, tree):
    """What the installed code imports is declared, if only by an extra that users can name."""
    distributions = packages_distributions()
    extras = project["project"]["optional-dependencies"]
    optional = [line for name in extras if name != "dev" for line in extras[name]]
    declared = required(project["project"]["dependencies"]) | required(optional)
    own = {"zfcal", "zfcal_cli"} | set(sys.stdlib_module_names)
    undeclared = {
        f"{path}: {name}"
        for path in sources(tree)
        if path.suffix == ".py"
        for name in imported(tree / path) - own
        if not declared & {canonicalize_name(d) for d in distributions.get(name, ())}
    }
    assert undeclared == set()


def test_every_requirement_is_pinned(project, pins):
    """The lock holds a fitting version of everything that pyproject.toml asks for."""
    lines = list(project["project"]["dependencies"]) + list(project["build-system"]["requires"])
    extras = project["project"]["optional-dependencies"]
    for name in extras.keys() - {LOCKED_WITH_PROGRAMS}:
        lines += [line for line in extras[name] if not line.startswith("zfcal[")]
    for requirement in map(Requirement, lines):
        pinned = pins[canonicalize_name(requirement.name)][0]
        assert requirement.specifier.contains(pinned), f"{requirement} is pinned to {pinned}"


def test_every_pin_has_hashes_and_none_an_address(repository, pins):
    """The lock can be used with any package index, and says what the files must be."""
    text = (repository / "requirements.lock").read_text(encoding="utf-8")
    assert not re.search(r"://|--index|--find-links|@ ", text)
    assert [name for name, (_, _, hashes) in pins.items() if not hashes] == []


@pytest.mark.parametrize("group", ["bench", "docs"])
def test_groups_are_locked_apart(repository, project, pins, group):
    """With hashes and without addresses, at zfcal's own versions; zfcal needs none of it."""
    path = repository / f"requirements-{group}.lock"
    assert not re.search(r"://|--index|--find-links|@ ", path.read_text(encoding="utf-8"))
    found = locked(path)
    assert [name for name, (_, _, hashes) in found.items() if not hashes] == []
    shared = pins.keys() & found.keys()
    assert {name: found[name][0] for name in shared} == {name: pins[name][0] for name in shared}
    for requirement in map(Requirement, project["dependency-groups"][group]):
        name = canonicalize_name(requirement.name)
        assert requirement.specifier.contains(found[name][0])
        assert name not in pins


def test_programs_are_locked_apart(repository, project):
    """With hashes and without addresses; zfcal is there too, with the extra that needs them."""
    path = repository / "requirements-programs.lock"
    assert not re.search(r"://|--index|--find-links|@ ", path.read_text(encoding="utf-8"))
    found = locked(path)
    assert [name for name, (_, _, hashes) in found.items() if not hashes] == []
    lines = [
        *project["dependency-groups"]["programs"],
        *project["project"]["dependencies"],
        *project["project"]["optional-dependencies"][LOCKED_WITH_PROGRAMS],
    ]
    for requirement in map(Requirement, lines):
        assert requirement.specifier.contains(found[canonicalize_name(requirement.name)][0])


def test_what_is_installed_here_is_what_the_lock_says(pins):
    """Tests run against the pinned versions, not against what happens to be there."""
    for name, (pinned, marker, _) in pins.items():
        if not marker or Marker(marker).evaluate():
            assert version(name) == pinned, f"{name}: run make install"


@pytest.mark.slow
@pytest.mark.parametrize("case", CROSSED)
def test_import_contracts_notice(case, repository, tree, tmp_path):
    """Each way to cross the layers is found, by the contract that is meant to find it."""
    contract, module, line = CROSSED[case]
    broken = importable(tree, tmp_path / "broken")
    (broken / module).parent.mkdir(exist_ok=True)
    with (broken / module).open("a", encoding="utf-8") as file:
        file.write(f"\n{line}\n")

    code, said = lint_imports(broken, repository)
    assert code == 1
    assert f"{contract} BROKEN" in said


def test_import_contracts_hold(repository, tree, tmp_path):
    """The tree itself crosses no contract."""
    code, said = lint_imports(importable(tree, tmp_path / "same"), repository)
    assert code == 0, said


def importable(tree: Path, target: Path) -> Path:
    """Copy the tree so that both roots have their installed names."""
    shutil.copytree(tree, target)
    (target / "cli").rename(target / "zfcal_cli")
    return target


def lint_imports(tree: Path, repository: Path) -> tuple[int, str]:
    """Return import-linter's exit code and words for another tree than the installed one."""
    program = (
        "import sys; sys.path.insert(0, sys.argv[1])\n"
        "from importlinter.cli import lint_imports\n"
        "sys.exit(lint_imports(config_filename=sys.argv[2], no_cache=True, no_logo=True))\n"
    )
    config = repository / "pyproject.toml"
    run = [sys.executable, "-c", program, str(tree), str(config)]
    done = subprocess.run(run, cwd=tree, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout + done.stderr

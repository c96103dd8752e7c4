"""The code stands where docs/architecture.md says, in rooms that one can overlook."""

import ast
import re

import grimp
import pytest

from zfcal.model.effects import PREFIX, all_effects, generic_effects
from zfcal_cli.main import COMMANDS

MOST_MODULES = 30
MOST_IMPORTS = 6
UNLIMITED = {"zfcal.diagnose"}
DEEP = {"zfcal.diagnose"}
EFFECTS = "zfcal/model/effects"
HOMONYMS = {
    "alignment": ("zfcal/cameras", "zfcal/stages/camera", "zfcal/diagnose/battery.py"),
    "crowding": ("zfcal/calibrate",),
}
"""Names of effects that are the name of something else in other rooms: a camera's correction, a
statistic of headings, a distance within a front of NSGA-II."""


@pytest.fixture(scope="module")
def graph():
    """Return who imports whom in zfcal."""
    return grimp.build_graph("zfcal", cache_dir=None)


@pytest.fixture(scope="module")
def page(repository):
    """Return the document."""
    return (repository / "docs" / "architecture.md").read_text(encoding="utf-8")


def rooms(graph):
    """Return the packages of zfcal."""
    return sorted(name for name in graph.modules if graph.find_children(name))


def deepest(graph, room):
    """Return the longest chain of imports within a room, a folder in it counting as one module."""
    children = graph.find_children(room)
    below = {
        child: {
            other
            for other in children - {child}
            if graph.direct_import_exists(importer=child, imported=other, as_packages=True)
        }
        for child in children
    }
    chains = {}

    def chain(child, above):
        assert child not in above, f"a circle: {above}"
        if child not in chains:
            found = (chain(other, (*above, child)) for other in sorted(below[child]))
            chains[child] = [child, *max(found, key=len, default=[])]
        return chains[child]

    return max((chain(child, ()) for child in sorted(children)), key=len)


def test_every_command_has_its_row_and_every_row_its_module(page, repository):
    """In the order of the commands' own list."""
    found = re.findall(r"^\| `zfcal (\w+)` \| `([\w/.]+)` \|", page, re.MULTILINE)
    assert [command for command, _ in found] == list(COMMANDS)
    assert [place for _, place in found if not (repository / place).exists()] == []


def test_every_room_is_named(page, graph):
    """No package directly under zfcal is left out of the page."""
    names = [name.removeprefix("zfcal.") for name in rooms(graph) if name.count(".") == 1]
    assert [name for name in names if f"`{name}/`" not in page] == []


def test_no_room_is_crowded(graph):
    """At most thirty modules lie side by side."""
    sizes = {
        room: sum(not graph.find_children(child) for child in graph.find_children(room))
        for room in rooms(graph)
    }
    crowded = {room: n for room, n in sizes.items() if n > MOST_MODULES}
    assert set(crowded) <= UNLIMITED, crowded


def test_no_room_is_deep(graph):
    """At most six imports lead from the top of a room to its bottom."""
    chains = {room: deepest(graph, room) for room in rooms(graph) if room != "zfcal"}
    deep = {room: chain for room, chain in chains.items() if len(chain) - 1 > MOST_IMPORTS}
    assert set(deep) <= DEEP, deep


def texts_and_names(source):
    """Yield each string of a module but its docstrings, and each name, with its line."""
    tree = ast.parse(source)
    said = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant):
            if isinstance(node.value, str) and id(node) not in said:
                yield node.lineno, node.value
            continue
        for field in ("id", "attr", "arg", "name", "module"):
            value = getattr(node, field, None)
            if isinstance(value, str):
                yield from ((node.lineno, part) for part in value.split("."))


def effects_in(text, names):
    """Return the effects that a text or name is, or that it holds where they are no plain word."""
    whole = text.replace("_", "-")
    words = {word for word in re.findall(r"[\w:-]+", whole) if not word.isalpha()}
    return {text, whole, *words} & set(names)


@pytest.mark.slow
def test_no_module_names_an_effect(repository):
    """Whoever needs to know something about an effect asks the effect: see "Add an effect"."""
    names = [PREFIX, *(effect.name for effect in (*all_effects(), *generic_effects()))]
    found = []
    for path in sorted(
        part for room in ("zfcal", "cli") for part in (repository / room).rglob("*.py")
    ):
        place = path.relative_to(repository).as_posix()
        known = {name for name in names if place.startswith(HOMONYMS.get(name, ()))}
        for line, text in texts_and_names(path.read_text(encoding="utf-8")):
            found += [
                f"{place}:{line}: {name}" for name in effects_in(text, names) if name not in known
            ]
    assert [each for each in found if not each.startswith(EFFECTS)] == []


@pytest.mark.parametrize(
    "line",
    [
        '_BENDS_TO = {"place-preference": 1}',
        "from zfcal.model.effects.place_preference import EFFECT",
        "def f(place_preference): ...",
        'f"effects.{x}.place-preference"',
        'x = "freezing" in model.effects',
        'x = name.startswith("generic:")',
        '_BY_PLACE = ("generic:speed:place",)',
    ],
)
def test_an_effect_that_is_named_is_seen(line):
    """As a string, within one, and as a name; not in prose, a docstring or a longer name."""
    names = [PREFIX, "place-preference", "freezing", "generic:speed:place"]
    clean = (
        '"""As place-preference."""\nx = "by freezing, or a place preference; generic:speed:places"'
    )

    def seen(source):
        return {each for _, text in texts_and_names(source) for each in effects_in(text, names)}

    assert len(seen(line)) == 1
    assert seen(clean) == set()

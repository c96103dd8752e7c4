"""The code stands where docs/architecture.md says, in rooms that one can overlook."""

import re

import grimp
import pytest

from zfcal_cli.main import COMMANDS

MOST_MODULES = 30
MOST_IMPORTS = 6
UNLIMITED = {"zfcal.diagnose"}
DEEP = {"zfcal.diagnose"}


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

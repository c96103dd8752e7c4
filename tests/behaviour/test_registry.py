"""Statistics are found: ours in their files, and those of other packages."""

import sys

import numpy as np
import pytest

from zfcal.behaviour.features import registry
from zfcal.behaviour.features.registry import COUNTED, further, named, ordered, statistics
from zfcal.behaviour.features.statistic import Points, Statistic, count
from zfcal.behaviour.located import locate
from zfcal.behaviour.statistics import measure
from zfcal.errors import InputError

OWN = """
import numpy as np

from zfcal.behaviour.features.statistic import Observed, Statistic


def observe(points):
    yield Observed(at=points.own, value=points.located.xy_m[points.own, 1])


STATISTICS = (
    Statistic(
        name="{name}", label="Height", phrase="the heights", observe=observe,
        edges=lambda arena: np.array([0.0, 0.2, 0.4]), unit="m",
    ),
)
"""


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """Return what puts a package with an entry point where Python finds it."""
    made = []

    def install(module, text):
        (tmp_path / f"{module}.py").write_text(text, encoding="utf-8")
        about = tmp_path / f"{module}-1.dist-info"
        about.mkdir()
        (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {module}\nVersion: 1\n")
        (about / "entry_points.txt").write_text(f"[zfcal.statistics]\n{module} = {module}\n")
        made.append(module)
        registry.statistics.cache_clear()

    monkeypatch.syspath_prepend(str(tmp_path))
    yield install
    for module in made:
        sys.modules.pop(module, None)
    registry.statistics.cache_clear()


def own(**changed):
    """Return a statistic of one bin."""
    said = {
        "name": "own",
        "label": "Own",
        "phrase": "the own",
        "observe": lambda _: iter(()),
        "edges": lambda _: np.array([0.0, 1.0]),
    }
    return Statistic(**(said | changed))


def test_the_papers_come_first_and_in_its_order():
    """D, W, O, T and V, whatever else there is."""
    assert tuple(statistics())[:5] == COUNTED == ("D", "W", "O", "T", "V")
    assert [named(name).form for name in COUNTED] == ["bins", "bins", "zones", "table", "bins"]


def test_names_are_put_in_order_once_each():
    """The order in which they are named, and how often, changes nothing."""
    assert ordered(["T", "D", "T"]) == ("D", "T")
    assert further(["V", "D"]) == ()


def test_an_unknown_name_says_what_there_is():
    """A slip of the pen."""
    with pytest.raises(InputError, match="No statistic is called 'd'") as refused:
        ordered(["d"])
    assert "D, W, O, T, V" in refused.value.hint


def test_another_package_adds_its_own(installed, tank, samples_of):
    """Found by its entry point, and counted: of 0.1, 0.3 and 0.35 two lie in the upper bin."""
    installed("lab_height", OWN.format(name="height"))

    height = named("height")
    located = locate(samples_of([[(0.1, 0.1), (0.1, 0.3), (0.3, 0.35)]]), tank)
    points = Points(located=located, role=np.ones(3, dtype=bool), within=True)

    assert count(height, points).tolist() == [[1, 1], [0, 1]]
    assert tuple(statistics())[:5] == COUNTED
    assert further(["height", "D"]) == ("height",)


def test_two_statistics_of_one_name_are_refused(installed):
    """Nobody takes the place of the paper's D by accident."""
    installed("lab_clash", OWN.format(name="D"))
    with pytest.raises(InputError, match="Two statistics are called 'D'"):
        statistics()


@pytest.mark.parametrize(
    ("text", "problem"),
    [("1 / 0", "cannot be imported: ZeroDivisionError"), ("", "names no statistics")],
)
def test_a_package_that_is_broken_is_named(installed, text, problem):
    """With what is wrong with it."""
    installed("lab_broken", text)
    with pytest.raises(InputError, match=f"lab_broken.* {problem}"):
        statistics()


def test_a_statistic_is_checked_when_it_is_made(tank):
    """Its name, bins where there are to be bins, edges that ascend, and no more than ten."""
    with pytest.raises(InputError, match="made of letters, digits"):
        own(name="a b")
    with pytest.raises(InputError, match="form 'bins' needs edges"):
        own(edges=None)
    with pytest.raises(InputError, match="form 'bins' needs edges"):
        own(form="table")
    with pytest.raises(InputError, match="of the group"):
        own(form="zones", edges=None, per_zone=False)
    for edges in ([0.0], [0.0, 0.0], np.arange(12.0)):
        with pytest.raises(InputError, match="ascending edges"):
            own(edges=lambda _, edges=edges: edges).edges_in(tank)
    with pytest.raises(InputError, match="has no bins"):
        named("O").edges_in(tank)


def test_each_of_the_five_has_its_place_in_the_counts(tank, wander):
    """`Statistics.of` gives what the statistic's own file counts."""
    located = locate(wander(1), tank)
    inside = located.take(located.zone > 0)
    points = Points(located=inside, role=np.ones(len(inside), dtype=bool), within=True)
    counts = measure(located, tank)
    for name in COUNTED:
        assert np.array_equal(counts.of(name), count(named(name), points)), name
        assert counts.of(name).shape == named(name).shape(tank)

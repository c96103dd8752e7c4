"""Spread, polarisation and nearest neighbours of a shoal."""

import numpy as np
import pytest

from zfcal.behaviour.features.registry import named
from zfcal.behaviour.features.statistic import Points
from zfcal.behaviour.located import locate
from zfcal.behaviour.statistics import measure, measure_robot

NAMES = ("spread", "polarisation", "neighbour")


@pytest.fixture
def observed(tank, samples_of):
    """Return what gives the observations of one of the three."""

    def observe(name, positions, *, role=None, within=True):
        located = locate(samples_of(positions), tank)
        who = np.ones(len(located), dtype=bool) if role is None else located.agent == role
        points = Points(located=located, role=who, within=within)
        parts = [seen.value for seen in named(name).observe(points)]
        return np.concatenate([np.array([]), *parts])

    return observe


def test_spread_by_hand(observed):
    """Corners of a square of 0.2 m are 0.1414 from its middle; two 0.1 apart are 0.05."""
    square = [(0.1, 0.1), (0.3, 0.1), (0.3, 0.3), (0.1, 0.3)]
    assert observed("spread", [square]) == pytest.approx([0.1 * np.sqrt(2)])
    assert observed("spread", [[(0.1, 0.1), (0.2, 0.1)]]) == pytest.approx([0.05])


def test_spread_is_of_those_who_are_seen(observed):
    """Two of three, then one, of whom there is no group."""
    pair, one = [(0.1, 0.1), None, (0.2, 0.1)], [None, None, (0.2, 0.1)]
    assert observed("spread", [pair, one]) == pytest.approx([0.05])


def test_polarisation_by_hand(observed):
    """Side by side 1; a right angle the root of a half; against each other 0."""
    start = [(0.1, 0.1), (0.1, 0.2)]
    for second, expected in (((0.2, 0.2), 1.0), ((0.1, 0.3), np.sqrt(0.5)), ((0.0, 0.2), 0.0)):
        found = observed("polarisation", [start, [(0.2, 0.1), second]])
        assert found == pytest.approx([expected], abs=1e-12)


def test_polarisation_asks_for_directions_not_for_speed(observed):
    """A slow one counts as much as a fast one; one that rests not at all."""
    start = [(0.1, 0.1), (0.1, 0.2), (0.3, 0.3)]
    slow = [(0.2, 0.1), (0.105, 0.2), (0.3, 0.3)]
    assert observed("polarisation", [start, slow]) == pytest.approx([1.0])
    assert len(observed("polarisation", [start[::2], slow[::2]])) == 0


def test_nearest_neighbours_by_hand(observed):
    """On a line at 0.1, 0.15 and 0.3: 0.05, 0.05 and 0.15, also where they are in other zones."""
    line = [(0.1, 0.1), (0.15, 0.1), (0.3, 0.1)]
    assert observed("neighbour", [line]) == pytest.approx([0.05, 0.05, 0.15])
    assert len(observed("neighbour", [[(0.1, 0.1), None, None]])) == 0


def test_neighbours_are_of_one_sample(observed):
    """Where another was before is nothing to be near to."""
    assert observed("neighbour", [[(0.1, 0.1), (0.3, 0.1)]] * 2) == pytest.approx([0.2] * 4)
    assert len(observed("neighbour", [[(0.1, 0.1), None], [None, (0.1, 0.1)]])) == 0


def test_a_robot_has_fish_for_neighbours_and_no_shoal(observed):
    """The third is the robot: 0.15 from the nearest fish."""
    line = [[(0.1, 0.1), (0.15, 0.1), (0.3, 0.1)], [(0.1, 0.2), (0.15, 0.2), (0.3, 0.2)]]
    assert observed("neighbour", line, role=2, within=False) == pytest.approx([0.15, 0.15])
    for name in ("spread", "polarisation"):
        assert len(observed(name, line, role=2, within=False)) == 0


def test_each_is_one_histogram_of_the_group(tank, samples_of):
    """0.05 in bins of 0.02 m, 0.1 in bins of 0.022 m; the last bin of polarisation."""
    two = [[(0.15, 0.1), (0.25, 0.1)], [(0.15, 0.2), (0.25, 0.2)]]
    counts = measure(samples_of(two), tank, further=NAMES)
    at = {name: np.argwhere(counts.of(name)).tolist() for name in NAMES}
    assert {name: counts.of(name).shape for name in NAMES} == dict.fromkeys(NAMES, (1, 10))
    assert at == {"spread": [[0, 2]], "polarisation": [[0, 9]], "neighbour": [[0, 4]]}
    assert [int(counts.of(name).sum()) for name in NAMES] == [2, 1, 4]


def test_an_empty_tank_has_no_shoal(tank, samples_of):
    """No count, and no error."""
    nobody = samples_of(np.full((3, 2, 2), np.nan))
    for counts in (
        measure(nobody, tank, further=NAMES),
        measure_robot(nobody, tank, further=NAMES),
    ):
        assert [int(counts.of(name).sum()) for name in NAMES] == [0, 0, 0]


def test_turning_the_tank_changes_nothing(observed):
    """A quarter turn about the middle of the tank."""
    rng = np.random.default_rng(1)
    xy_m = rng.uniform(0.1, 0.3, (20, 4, 2))
    turned = np.stack([0.4 - xy_m[..., 1], xy_m[..., 0]], axis=-1)
    for name in NAMES:
        assert observed(name, xy_m) == pytest.approx(observed(name, turned))

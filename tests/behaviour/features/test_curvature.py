"""How much paths turn on their way."""

import numpy as np
import pytest

from zfcal.behaviour.features.curvature import EDGES_RAD_M
from zfcal.behaviour.features.registry import named
from zfcal.behaviour.features.statistic import Points
from zfcal.behaviour.located import locate
from zfcal.behaviour.statistics import measure


@pytest.fixture
def bends(tank, samples_of):
    """Return what gives the curvatures of the paths of some animals, in rad/m."""

    def observe(*paths, **how):
        located = locate(samples_of([list(row) for row in zip(*paths, strict=True)], **how), tank)
        points = Points(located=located, role=np.ones(len(located), dtype=bool), within=True)
        return np.concatenate([seen.value for seen in named("curvature").observe(points)])

    return observe


def test_curvature_by_hand(bends):
    """A right angle on ways of 0.1 m is 15.7 rad/m, on 0.1 and 0.05 m 20.9; straight on is 0."""
    assert bends([(0.1, 0.1), (0.2, 0.1), (0.2, 0.2)]) == pytest.approx([np.pi / 2 / 0.1])
    assert bends([(0.1, 0.1), (0.2, 0.1), (0.2, 0.15)]) == pytest.approx([np.pi / 2 / 0.075])
    assert bends([(0.1, 0.1), (0.2, 0.1), (0.25, 0.1)]) == pytest.approx([0.0])


def test_it_is_counted_in_the_zone_of_the_middle(tank, samples_of):
    """Left, left, right, right: two bends, one in each zone; 15.7 rad/m lies from 10 to 20."""
    path = [(0.15, 0.1), (0.15, 0.2), (0.25, 0.2), (0.25, 0.1)]
    counts = measure(samples_of([[xy] for xy in path]), tank, further=["curvature"])
    left, right = counts.of("curvature")
    assert EDGES_RAD_M[4:6] == (10.0, 20.0)
    assert left.tolist() == right.tolist() == [0, 0, 0, 0, 1, 0, 0, 0, 0, 0]


def test_a_circle_has_one_over_its_radius(bends):
    """To the square of the angle between samples: with 100 of them within a thousandth."""
    angle = np.arange(100) * 2 * np.pi / 100
    for radius_m in (0.05, 0.1):
        around = [(0.2 + radius_m * np.cos(a), 0.2 + radius_m * np.sin(a)) for a in angle]
        assert bends(around) == pytest.approx(np.full(98, 1 / radius_m), rel=1e-3)
        assert bends(around[::-1]) == pytest.approx(bends(around))


def test_speed_changes_no_curvature(bends):
    """The same path at half the time."""
    path = [(0.1, 0.1), (0.2, 0.1), (0.2, 0.2)]
    assert bends(path, dt_s=0.1) == bends(path, dt_s=0.2)


def test_a_turn_about_is_half_a_turn(bends):
    """Forth and back: pi over the way, whatever the rounding of its sign."""
    assert bends([(0.1, 0.1), (0.2, 0.1), (0.1, 0.1)]) == pytest.approx([np.pi / 0.1])


def test_a_rest_has_no_curvature(bends):
    """With a step of less than 2 mm there is no observation."""
    assert len(bends([(0.1, 0.1), (0.1015, 0.1), (0.1015, 0.2)])) == 0
    assert len(bends([(0.1, 0.1), (0.1, 0.1), (0.1, 0.1)])) == 0
    assert len(bends([(0.1, 0.1), (0.1025, 0.1), (0.1025, 0.2)])) == 1


def test_nothing_bends_across_a_loss_or_between_animals(bends):
    """Three samples in a row are needed, of one animal."""
    corner = [(0.1, 0.1), (0.2, 0.1), None, (0.2, 0.2), (0.3, 0.2)]
    assert len(bends(corner)) == 0
    straight = [(0.1, 0.1), (0.2, 0.1), (0.3, 0.1)]
    assert bends(straight, [(0.1, 0.1), (0.2, 0.1), (0.2, 0.2)]) == pytest.approx([0, 15.70796])

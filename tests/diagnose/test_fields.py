"""Fields of the tank within which effects on speed are asked for."""

from types import SimpleNamespace

import numpy as np
import pytest

from zfcal.diagnose.fields import fields_of, is_known, is_within_fields
from zfcal.model.kernels.state import STATES


def scene_at(tank, points, zone):
    """Return a scene of one agent's moves that began at these points."""
    states = np.zeros((len(points), STATES, 1))
    states[:, :2, 0] = points
    at = np.arange(len(points))
    moves = SimpleNamespace(at=at, who=np.zeros_like(at), zone=np.asarray(zone))
    return SimpleNamespace(arena=tank, states=states, moves=moves)


@pytest.mark.parametrize(("n", "apart"), [(20, True), (19, False)])
def test_a_field_with_few_moves_is_none_of_its_own(tank, n, apart):
    """Forty in one corner, n each in two others; another zone never shares a field."""
    x0, y0, x1, y1 = tank.outline.bounds
    corners = np.array([(x0, y0), (x1, y0), (x0, y1), (x0, y0)])
    counts = (40, n, n, 40)
    points, zone = np.repeat(corners, counts, axis=0), np.repeat([1, 1, 1, 2], counts)
    field = fields_of(scene_at(tank, points, zone), np.ones(len(points), dtype=bool))
    first, second, third, other = (field[k] for k in np.cumsum((0, *counts))[:-1])
    assert len({first, second, other}) == 3
    assert bool(second != third) is apart


def test_only_moves_that_count_make_a_field(tank):
    """Of forty in each of two corners all but ten are left out."""
    x0, y0, x1, y1 = tank.outline.bounds
    points = np.repeat([(x0, y0), (x1, y1)], 40, axis=0)
    kept = np.arange(80) % 40 < 10
    field = fields_of(scene_at(tank, points, np.ones(80, dtype=int)), kept)
    assert len(set(field)) == 1


def test_places_are_asked_for_across_fields(candidate):
    """They are what fields hold apart."""
    asked = ("crowding", "generic:speed:neighbour-speed", "generic:speed:place", "burst-and-coast")
    assert [is_within_fields(candidate(name)) for name in asked] == [True, True, False, True]


def test_a_field_is_known_by_twenty_moves_that_are_learnt_from():
    """Of fields of 30, 30 and 5 moves 20, 19 and 5 are learnt from."""
    field = np.repeat([2, 5, 9], (30, 30, 5))
    learnt = np.concatenate([np.arange(30) < 20, np.arange(30) < 19, np.arange(5) < 5])
    assert np.array_equal(is_known(field, learnt), field == 2)

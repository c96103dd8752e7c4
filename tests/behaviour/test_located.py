"""Points are classified once, and cut and joined after that."""

from itertools import pairwise

import numpy as np
import pytest
import shapely

from zfcal.arena import make_arena
from zfcal.behaviour.located import join, locate
from zfcal.errors import InputError
from zfcal.tracks import ROBOT


def test_each_point_has_its_zone_and_wall_distance(tank, samples_of):
    """By hand: 0.1 m in from two walls, 0.15 m in, and far outside."""
    located = locate(samples_of([[(0.1, 0.2), (0.25, 0.15)], [(0.5, 0.2), None]]), tank)

    assert located.k.tolist() == [0, 0, 1]
    assert located.agent.tolist() == [0, 1, 0]
    assert located.zone.tolist() == [1, 2, 0]
    assert located.wall_distance_m[:2] == pytest.approx([0.1, 0.15])
    assert not located.settled.any()


def test_a_point_a_little_outside_is_put_at_the_wall(tank, samples_of):
    """8 mm outside is within the tolerance of 10 mm, 16 mm is void."""
    # Sixty-fourths are exact numbers, so that the other coordinate does not change at all.
    located = locate(samples_of([[(0.125, -0.0078125), (0.125, -0.015625)]]), tank)

    assert located.settled.tolist() == [True, False]
    assert located.zone.tolist() == [1, 0]
    assert located.wall_distance_m[0] == pytest.approx(0.0, abs=1e-6)
    assert located.xy_m[0] == pytest.approx([0.125, 0.0], abs=1e-6)


def test_missing_agents_have_no_point(tank, samples_of):
    """Nine hundred ids of which one is seen at a time take one row a sample."""
    positions = [[(0.1, 0.1) if a == k else None for a in range(900)] for k in range(900)]

    assert len(locate(samples_of(positions), tank)) == 900


def test_a_window_of_points_is_that_of_the_samples(tank, wander):
    """Cutting after locating gives what locating after cutting gives."""
    samples = wander(1)
    located = locate(samples, tank)

    part = located.between(2.0, 4.0)

    assert part.k.min() == 10
    assert part.k.max() == 19
    assert len(part) == int((~np.isnan(samples.xy_m[10:20, :, 0])).sum())


def test_windows_side_by_side_join_to_the_whole(tank, wander):
    """Cut at three places and joined, every column is as it was."""
    located = locate(wander(2), tank)
    edges = [0, 3, 3, 7, 20]

    joined = join([located.between(a, b) for a, b in pairwise(edges)])

    for name in ("k", "agent", "kind", "xy_m", "zone", "wall_distance_m", "settled"):
        assert np.array_equal(getattr(joined, name), getattr(located, name))


def test_robots_can_be_taken_alone(tank, wander):
    """The last of three agents is the robot."""
    located = locate(wander(3, n_agents=3, kind=[0, 0, 1]), tank)

    assert set(located.of_kind(ROBOT).agent.tolist()) == {2}


def test_what_is_located_stays_as_it_is(tank, wander):
    """Locating twice does nothing the second time."""
    located = locate(wander(4), tank)

    assert locate(located, tank) is located


def test_points_of_another_arena_are_refused(tank, wander):
    """Zone ids mean something in their own arena only."""
    other = make_arena(name="other", outline=shapely.box(0, 0, 1, 1))

    with pytest.raises(InputError, match="located in arena 'tank'"):
        locate(locate(wander(5), tank), other)


def test_stretches_that_do_not_follow_each_other_are_refused(tank, wander):
    """Nothing, the wrong order, an overlap, another arena, another step."""
    located = locate(wander(6), tank)
    early, late = located.between(0, 6), located.between(5.8, 12)
    other = make_arena(name="other", outline=shapely.box(0, 0, 1, 1))

    with pytest.raises(InputError, match="no stretch"):
        join([])
    with pytest.raises(InputError, match="overlap"):
        join([early, late])
    with pytest.raises(InputError, match="overlap"):
        join([late, early])
    with pytest.raises(InputError, match="one arena"):
        join([early, locate(wander(6), other)])

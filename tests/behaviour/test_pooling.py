"""A pool tells what the joined stretches would."""

from itertools import pairwise

import numpy as np
import pytest

from zfcal.behaviour.ceilings import robot_ceiling
from zfcal.behaviour.located import join, locate
from zfcal.behaviour.pooling import Pool
from zfcal.behaviour.statistics import (
    from_counts,
    measure,
    measure_each,
    measure_robot,
    measure_role,
)
from zfcal.errors import InputError
from zfcal.tracks import FISH

KINDS = [0, 0, 1, 0, 0]


def pool_of(parts, arena):
    """Return a pool to which parts were added one by one."""
    pool = Pool(arena)
    for part in parts:
        pool.add(part)
    return pool


def cut(located, edges):
    """Cut points at some samples."""
    limits = [-1, *edges, 10**9]
    return [located.take((located.k >= a) & (located.k < b)) for a, b in pairwise(limits)]


def same(a, b):
    """Return whether two statistics agree count by count."""
    names = ("distance", "wall", "occupation", "transition", "speed", "n_settled", "n_void")
    return all(np.array_equal(getattr(a, name), getattr(b, name)) for name in names)


def check_pool(parts, arena):
    """Hold a pool of parts against the functions that see all points."""
    pool, whole = pool_of(parts, arena), join(parts)
    assert same(pool.fish(), measure(whole.of_kind(FISH), arena))
    assert same(pool.robot(), measure_robot(whole, arena))
    expected = [one.values for one in robot_ceiling(whole, arena)]
    np.testing.assert_array_equal([one.values for one in pool.robot_ceiling()], expected)


@pytest.mark.parametrize("edges", [(), (30,), (1, 2, 3), (20, 21, 40, 59), (60,)])
def test_a_pool_counts_what_the_joined_parts_hold(tank, wander, edges):
    """Also the steps across the cuts, wherever they are, and across a part of one sample."""
    located = locate(wander(1, kind=KINDS), tank)
    check_pool(cut(located, edges), tank)


def test_a_pool_steps_across_a_cut_by_hand(tank, samples_of):
    """One fish goes from left to right between k = 1 and 2, where the cut is: one such step."""
    path = [[(0.15, 0.2)], [(0.18, 0.2)], [(0.22, 0.2)], [(0.22, 0.25)]]
    located = locate(samples_of(path), tank)

    counts = pool_of(cut(located, (2,)), tank).fish()

    assert counts.transition.tolist() == [[1, 1], [0, 1]]
    assert counts.occupation.tolist() == [2, 2]


def test_there_is_no_step_over_a_part_that_is_missing(tank, wander):
    """The second of three parts was damaged: its neighbours do not touch."""
    first, _, third = cut(locate(wander(2, kind=KINDS), tank), (20, 40))
    check_pool([first, third], tank)


def test_a_part_in_which_nobody_was_seen_changes_nothing(tank, wander):
    """A segment without rows between two others, and at either end."""
    first, second = cut(locate(wander(3, kind=KINDS), tank), (30,))
    nobody = first.take(slice(0, 0))
    check_pool([nobody, first, nobody, second, nobody], tank)


def test_ids_that_come_and_go_are_pieced_together_as_in_the_whole(tank, samples_of):
    """An id that is missing for a part and comes back keeps its place from another."""
    rng = np.random.default_rng(4)
    path = rng.uniform(0.02, 0.38, (90, 9, 2))
    alive = [(0, 90), (0, 30), (35, 90), (0, 20), (50, 90), (5, 45), (46, 60), (61, 90), (88, 90)]
    for agent, (start, end) in enumerate(alive):
        path[:start, agent] = path[end:, agent] = np.nan
    path[25:55, 0] = np.nan
    samples = samples_of(path, agent=[7, 1, 4, 2, 9, 3, 30, 11, 12])
    check_pool(cut(locate(samples, tank), (30, 45, 60)), tank)


def test_a_longer_stretch_does_not_disturb_what_was_asked_before(tank, wander):
    """Asked after every part, a pool tells each time what the parts so far hold."""
    parts = cut(locate(wander(5, kind=KINDS), tank), (15, 30, 45))
    pool = Pool(tank)
    for n, part in enumerate(parts, start=1):
        pool.add(part)
        whole = join(parts[:n])
        assert same(pool.fish(), measure(whole.of_kind(FISH), tank))
        assert len(pool.robot_ceiling()) == len(robot_ceiling(whole, tank))


def test_a_pool_knows_since_when_there_is_a_robot(tank, samples_of):
    """The robot is put in at k = 2."""
    p = (0.1, 0.1)
    samples = samples_of([[p, None], [p, None], [p, p]], kind=[0, 1])
    first, second = cut(locate(samples, tank), (2,))
    pool = pool_of([first], tank)
    assert pool.first_robot_k is None
    pool.add(second)
    assert pool.first_robot_k == 2


def test_parts_that_overlap_are_refused(tank, wander):
    """Nothing counts twice."""
    located = locate(wander(6), tank)
    with pytest.raises(InputError, match="overlap"):
        pool_of([located, located], tank)


def test_an_empty_pool_is_empty(tank):
    """No part at all: no count, no ceiling."""
    pool = Pool(tank)
    assert not pool.fish().occupation.any()
    assert pool.robot_ceiling() == []


def test_all_agents_are_counted_at_once_as_one_by_one(tank, wander):
    """Each row is what `measure_role` finds for one agent, two ids of whom may be one fish."""
    located = locate(wander(7, n_agents=6), tank)
    column = np.array([0, 1, 2, 2, 1, 3])[located.agent]

    table = measure_each(located.take(slice(None)), column, 4)

    for one in (0, 3):
        alone = from_counts(table[one], tank.zone_names)
        assert same(alone, measure_role(located, column == one))

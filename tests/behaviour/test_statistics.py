"""What the agents did is counted as the model's definition says."""

import itertools
import math

import numpy as np
import pytest
import shapely

from zfcal.arena import Bins, Zone, make_arena
from zfcal.behaviour.located import locate
from zfcal.behaviour.statistics import Statistics, measure, measure_robot
from zfcal.errors import InputError
from zfcal.tracks import FISH, ROBOT

COUNTS = ("distance", "wall", "occupation", "transition", "speed")


def ten(**counts):
    """Return ten bins, of which bin ``b3=2`` holds two."""
    bins = [0] * 10
    for name, count in counts.items():
        bins[int(name[1:])] = count
    return bins


def same(a, b):
    """Whether all counts are equal."""
    return all(np.array_equal(getattr(a, name), getattr(b, name)) for name in COUNTS)


def test_every_count_of_a_small_window_by_hand(tank, samples_of):
    """Two fish, three samples a second apart.

    Fish 0 goes (0.10, 0.10) -> (0.10, 0.17) -> (0.10, 0.17), all left.
    Fish 1 goes (0.10, 0.20) -> (0.305, 0.20) -> (0.29, 0.20), left then right.
    D: at k = 0 both are left, 0.10 apart: bin 4 of 0.022 (0.088 to 0.110).
    W, bins of 0.018: left four times 0.10 (bin 5, 0.090 to 0.108); right 0.4 - 0.305
    = 0.095 (bin 5) and 0.4 - 0.29 = 0.11 (bin 6).
    O: four left, two right. T: left to left twice, left to right once, right to
    right once. V, bins of 0.02: 0.07 (bin 3), 0 (bin 0) and 0.205 (beyond: bin 9)
    from left; 0.015 (bin 0) from right.
    """
    counts = measure(
        samples_of(
            [
                [(0.10, 0.10), (0.10, 0.20)],
                [(0.10, 0.17), (0.305, 0.20)],
                [(0.10, 0.17), (0.29, 0.20)],
            ]
        ),
        tank,
    )

    assert counts.zone_names == ("left", "right")
    assert counts.distance.tolist() == [ten(b4=1), ten()]
    assert counts.wall.tolist() == [ten(b5=4), ten(b5=1, b6=1)]
    assert counts.occupation.tolist() == [4, 2]
    assert counts.transition.tolist() == [[2, 1], [0, 1]]
    assert counts.speed.tolist() == [ten(b0=1, b3=1, b9=1), ten(b0=1)]
    assert (counts.n_settled, counts.n_void) == (0, 0)


def test_three_agents_in_a_zone_make_three_pairs(tank, samples_of):
    """At 0.05, 0.08 and 0.19: 0.03, 0.14 and 0.11 apart, that is bins 1, 6 and 5."""
    counts = measure(samples_of([[(0.05, 0.1), (0.08, 0.1), (0.19, 0.1)]]), tank)

    assert counts.distance.tolist() == [ten(b1=1, b5=1, b6=1), ten()]


def test_agents_in_different_zones_make_no_pair(tank, samples_of):
    """2 cm apart, but the border is between them."""
    counts = measure(samples_of([[(0.19, 0.1), (0.21, 0.1)]]), tank)

    assert counts.distance.sum() == 0


def test_far_agents_are_in_the_last_bin(tank, samples_of):
    """0.36 m apart, beyond the 0.22 m of the range."""
    counts = measure(samples_of([[(0.1, 0.02), (0.1, 0.38)]]), tank)

    assert counts.distance[0].tolist() == ten(b9=1)


def test_speed_is_divided_by_the_step(tank, samples_of):
    """3 cm in 0.2 s are 0.15 m/s (bin 7); in 1 s 0.03 m/s (bin 1)."""
    path = [[(0.10, 0.1)], [(0.13, 0.1)]]

    assert measure(samples_of(path, dt_s=0.2), tank).speed[0].tolist() == ten(b7=1)
    assert measure(samples_of(path, dt_s=1.0), tank).speed[0].tolist() == ten(b1=1)


def test_a_missing_sample_breaks_a_step(tank, samples_of):
    """Seen at k = 0 and k = 2 only: two points, no step."""
    counts = measure(samples_of([[(0.1, 0.1)], [None], [(0.1, 0.1)]]), tank)

    assert counts.occupation.tolist() == [2, 0]
    assert counts.transition.sum() == counts.speed.sum() == 0


def test_a_new_track_id_breaks_a_step(tank, samples_of):
    """Lost and found again at once under another id: no step between the two."""
    counts = measure(samples_of([[(0.1, 0.1), None], [(0.1, 0.1), None], [None, (0.1, 0.1)]]), tank)

    assert counts.transition.tolist() == [[1, 0], [0, 0]]


def test_a_point_in_the_void_counts_nowhere(tank, samples_of):
    """5 cm outside at k = 1: no wall distance, no pair, no step in or out."""
    counts = measure(
        samples_of(
            [
                [(0.1, 0.1), (0.1, 0.2)],
                [(0.1, -0.05), (0.1, 0.2)],
                [(0.1, 0.1), (0.1, 0.2)],
            ]
        ),
        tank,
    )

    assert counts.n_void == 1
    assert counts.occupation.tolist() == [5, 0]
    assert counts.wall.sum() == 5
    assert counts.distance.sum() == 2
    assert counts.transition.tolist() == [[2, 0], [0, 0]]


def test_a_point_a_little_outside_counts_at_the_wall(tank, samples_of):
    """5 mm outside is at the wall: bin 0 of W, and the report says how many there were."""
    counts = measure(samples_of([[(0.1, -0.005)], [(0.1, 0.003)]]), tank)

    assert (counts.n_settled, counts.n_void) == (1, 0)
    assert counts.wall[0].tolist() == ten(b0=2)
    assert counts.transition.tolist() == [[1, 0], [0, 0]]


def test_the_arena_gives_the_ranges_of_the_bins(samples_of):
    """Distances binned from 0.05 to 0.15: 0.02 is below (first bin), 0.10 is bin 5."""
    arena = make_arena(
        name="box",
        outline=shapely.box(0, 0, 0.4, 0.4),
        zones=(Zone(name="all", follows_walls=False, polygon=shapely.box(0.0, 0.0, 0.4, 0.4)),),
        bins=Bins(distance_m=(0.05, 0.15), wall_distance_m=(0.0, 0.5), speed_m_s=(0.0, 1.0)),
    )
    counts = measure(samples_of([[(0.12, 0.1), (0.14, 0.1)], [(0.12, 0.1), (0.225, 0.1)]]), arena)

    assert counts.distance.tolist() == [ten(b0=1, b5=1)]
    assert counts.wall.tolist() == [ten(b2=4)]
    assert counts.speed.tolist() == [ten(b0=2)]


def test_the_robot_counts_alone_but_for_its_distances_to_fish(tank, samples_of):
    """Two fish and a robot, all left at k = 0; the robot is right at k = 1.

    D: the robot at 0.05 is 0.03 and 0.14 from the fish at 0.08 and 0.19; the
    0.11 between the fish does not count. W, O, T and V are the robot's: 0.05
    (bin 2) and 0.1 from the walls (bin 5), one step of 0.25 m in 1 s.
    """
    counts = measure_robot(
        samples_of(
            [
                [(0.08, 0.1), (0.19, 0.1), (0.05, 0.1)],
                [(0.08, 0.1), (0.19, 0.1), (0.30, 0.1)],
            ],
            kind=[FISH, FISH, ROBOT],
        ),
        tank,
    )

    assert counts.distance.tolist() == [ten(b1=1, b6=1), ten()]
    assert counts.wall.tolist() == [ten(b2=1), ten(b5=1)]
    assert counts.occupation.tolist() == [1, 1]
    assert counts.transition.tolist() == [[0, 1], [0, 0]]
    assert counts.speed.tolist() == [ten(b9=1), ten()]


def test_two_robots_are_pooled_and_make_no_pair_of_their_own(tank, samples_of):
    """One fish, two robots: two pairs of robot and fish, none of two robots."""
    counts = measure_robot(
        samples_of([[(0.05, 0.1), (0.08, 0.1), (0.19, 0.1)]], kind=[ROBOT, FISH, ROBOT]), tank
    )

    assert counts.distance.sum() == 2
    assert counts.occupation.tolist() == [2, 0]


def test_without_a_robot_the_robot_did_nothing(tank, wander):
    """All counts are 0, also those of points outside."""
    counts = measure_robot(wander(1), tank)

    assert all(getattr(counts, name).sum() == 0 for name in COUNTS)
    assert (counts.n_settled, counts.n_void) == (0, 0)


def test_nobody_in_the_tank_is_no_error(tank, samples_of):
    """Samples without agents, and a window without samples, have no count."""
    for samples in (samples_of([[None, None]]), samples_of(np.zeros((0, 2, 2)))):
        counts = measure(samples, tank)
        assert all(getattr(counts, name).sum() == 0 for name in COUNTS)


def test_fish_and_robot_pairs_make_up_the_whole(tank, wander):
    """Of the pairs of all agents, those with one robot are the robot's, the rest the fish's."""
    samples = wander(2, kind=[0, 0, 0, 0, 1])

    everybody, robot = measure(samples, tank), measure_robot(samples, tank)
    fish = measure(samples.of_kind(FISH), tank)

    assert same(everybody, fish + robot)


def slow_measure(samples, arena):
    """Count as `measure` does, one agent and one pair at a time."""
    names = arena.zone_names
    n = len(names)
    counts = {
        "distance": np.zeros((n, 10), int),
        "wall": np.zeros((n, 10), int),
        "occupation": np.zeros(n, int),
        "transition": np.zeros((n, n), int),
        "speed": np.zeros((n, 10), int),
    }

    def bin_of(value, high):
        return min(int(value / high * 10), 9)

    xy_m = arena.settle(samples.xy_m)[0]
    zone = arena.zone_of(xy_m)
    wall_m = arena.wall_distance(xy_m)
    n_samples, n_agents = zone.shape
    for k, i in itertools.product(range(n_samples), range(n_agents)):
        z = zone[k, i] - 1
        if z < 0:
            continue
        counts["occupation"][z] += 1
        counts["wall"][z, bin_of(wall_m[k, i], 0.18)] += 1
        for j in range(i):
            if zone[k, j] - 1 == z:
                counts["distance"][z, bin_of(math.dist(xy_m[k, i], xy_m[k, j]), 0.22)] += 1
        if k + 1 < n_samples and zone[k + 1, i] > 0:
            counts["transition"][z, zone[k + 1, i] - 1] += 1
            speed_m_s = math.dist(xy_m[k, i], xy_m[k + 1, i]) / samples.dt_s
            counts["speed"][z, bin_of(speed_m_s, 0.2)] += 1
    return Statistics(zone_names=names, **counts)


@pytest.mark.parametrize("seed", range(5))
def test_the_vectorised_counts_are_the_slow_ones(seed, tank, wander):
    """Agents that wander, are lost, leave the tank a little and far."""
    samples = wander(seed, n_samples=80, n_agents=7)

    counts = measure(samples, tank)

    assert same(counts, slow_measure(samples, tank))
    assert counts.n_settled > 0
    assert counts.n_void > 0
    assert counts.distance.sum() > 100


def test_many_short_track_ids_change_only_the_steps_across_them(tank, wander):
    """Every agent gets a new id every ten samples: D, W and O stay, T and V lose those steps."""
    samples = wander(3, n_samples=60, lost=0.0)
    pieces = np.full((60, 30, 2), np.nan)
    for k, i in itertools.product(range(60), range(5)):
        pieces[k, 5 * (k // 10) + i] = samples.xy_m[k, i]
    cut = type(samples)(
        dt_s=samples.dt_s,
        k=samples.k,
        agent=np.arange(30, dtype=np.int32),
        kind=np.zeros(30, dtype=np.int8),
        xy_m=pieces,
        confidence=np.ones((60, 30), dtype=np.float32),
    )

    whole, short = measure(samples, tank), measure(cut, tank)
    inside = locate(samples, tank).zone.reshape(60, 5) > 0
    lost_steps = sum((inside[k - 1] & inside[k]).sum() for k in range(10, 60, 10))

    for name in ("distance", "wall", "occupation"):
        assert np.array_equal(getattr(whole, name), getattr(short, name))
    assert whole.transition.sum() - short.transition.sum() == lost_steps
    assert whole.speed.sum() - short.speed.sum() == lost_steps


def test_pooled_counts_add_up(tank, wander):
    """The sum of two windows, and what is left when one is taken away again."""
    a, b = measure(wander(1), tank), measure(wander(2), tank)

    assert np.array_equal((a + b).wall, a.wall + b.wall)
    assert (a + b).n_void == a.n_void + b.n_void
    assert same(a + b - b, a)


def test_counts_of_other_zones_are_not_pooled(tank, wander):
    """Zones go by name and order."""
    counts = measure(wander(1), tank)
    renamed = Statistics(
        zone_names=("right", "left"), **{name: getattr(counts, name) for name in COUNTS}
    )

    with pytest.raises(InputError, match="different zones: left, right and right, left"):
        counts + renamed


@pytest.mark.parametrize(
    "wrong",
    [
        {"wall": np.zeros((2, 9), dtype=np.int64)},
        {"transition": np.zeros((2, 3), dtype=np.int64)},
        {"occupation": np.array([1, -1])},
        {"speed": np.zeros((2, 10))},
    ],
)
def test_counts_of_a_wrong_shape_or_type_are_refused(wrong):
    """Nine bins, three columns, a negative count, frequencies instead of counts."""
    right = {
        "distance": np.zeros((2, 10), dtype=np.int64),
        "wall": np.zeros((2, 10), dtype=np.int64),
        "occupation": np.zeros(2, dtype=np.int64),
        "transition": np.zeros((2, 2), dtype=np.int64),
        "speed": np.zeros((2, 10), dtype=np.int64),
    }

    with pytest.raises(InputError, match=next(iter(wrong))):
        Statistics(zone_names=("left", "right"), **(right | wrong))


def test_one_zone_for_every_agent_and_sample(tank, wander):
    """O, W and the void together are all that was seen."""
    samples = wander(9)
    counts = measure(samples, tank)

    seen = int((~np.isnan(samples.xy_m[..., 0])).sum())
    assert counts.occupation.sum() + counts.n_void == seen
    assert np.array_equal(counts.wall.sum(axis=1), counts.occupation)
    assert np.array_equal(counts.transition.sum(axis=1), counts.speed.sum(axis=1))

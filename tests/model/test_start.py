"""Where simulations begin: poses from samples, and what kernels make of them."""

import math

import numpy as np
import pytest

from zfcal.calibrate.group import Group
from zfcal.errors import InputError
from zfcal.model.kernels.placing import place, place_at
from zfcal.model.kernels.random import seeded
from zfcal.model.kernels.state import (
    DT_S,
    HX,
    HY,
    LEFT_FROM,
    PAST_HX,
    PAST_HY,
    ROOM,
    STATES,
    WALL,
    ZONE,
    X,
    Y,
)
from zfcal.model.simulate import individuals, pack, simulate_counts, simulate_tracks, tank_of
from zfcal.model.start import Start, seen_at
from zfcal.parameters import to_genes
from zfcal.tracks import FISH, ROBOT, Samples

SEEDS = np.arange(8, dtype=np.uint64)


def samples_of(paths, kinds, *, first=0):
    """Return samples of agents from their places, (agent, sample, 2)."""
    xy_m = np.array(paths, dtype=float).swapaxes(0, 1)
    return Samples(
        dt_s=0.2,
        k=np.arange(first, first + len(xy_m)),
        agent=np.arange(xy_m.shape[1], dtype=np.int32),
        kind=np.array(kinds, dtype=np.int8),
        xy_m=xy_m,
        confidence=np.ones(xy_m.shape[:2], dtype=np.float32),
    )


def test_agents_begin_where_they_were_seen_fish_first():
    """The robot has the first track; a fish without a track is NaN, and so is a second robot."""
    paths = [[[0.5, 0.5], [0.5, 0.4]], [[0.1, 0.2], [0.2, 0.2]]]
    found = seen_at(samples_of(paths, [ROBOT, FISH], first=7), 8, n_fish=2, n_robots=2)
    assert found.time_s == pytest.approx(1.6)
    np.testing.assert_allclose(found.poses[0], [0.2, 0.2, 0.0], atol=1e-12)
    np.testing.assert_allclose(found.poses[2], [0.5, 0.4, -math.pi / 2])
    assert np.isnan(found.poses[[1, 3]]).all()


def test_of_more_tracks_than_agents_those_that_are_there_count():
    """A track that ended long before does not take the place of the one that followed it."""
    gone = [[0.1, 0.1]] * 3 + [[math.nan] * 2] * 20
    here = [[math.nan] * 2] * 3 + [[0.2, 0.2]] * 20
    also = [[0.3, 0.3]] * 23
    samples = samples_of([gone, here, also], [FISH] * 3)
    found = seen_at(samples, 20, n_fish=1, n_robots=0)
    np.testing.assert_array_equal(found.poses[:, :2], [[0.2, 0.2]])
    both = seen_at(samples, 20, n_fish=2, n_robots=0)
    np.testing.assert_array_equal(both.poses[:, :2], [[0.2, 0.2], [0.3, 0.3]])


def test_one_that_is_lost_for_a_moment_is_where_it_was_seen_last_or_next():
    """Within a second, that is five samples."""
    path = [[0.1, 0.1]] * 4 + [[math.nan] * 2] * 12 + [[0.5, 0.5]] * 2
    samples = samples_of([path], [FISH])
    for k, wanted in ((5, 0.1), (8, 0.1), (11, 0.5), (14, 0.5)):
        pose = seen_at(samples, k, n_fish=1, n_robots=0).poses[0]
        np.testing.assert_array_equal(pose[:2], [wanted, wanted])
    for k in (9, 10):
        assert np.isnan(seen_at(samples, k, n_fish=1, n_robots=0).poses).all()


@pytest.mark.parametrize(
    ("path", "row", "heading"),
    [
        ([[0, 0], [0, 0.01], [0, 0.0111], [0.01, 0.0111]], 2, math.pi / 2),
        ([[0, 0], [0.001, 0], [0.001, -0.01]], 1, -math.pi / 2),
        ([[0, 0], [0.001, 0], [0.001, 0.001]], 1, math.nan),
        ([[0, 0], [math.nan, math.nan], [0.05, 0.0]], 2, math.nan),
    ],
    ids=["the last of 2 mm before", "else the first after", "none", "not over a gap"],
)
def test_the_heading_is_that_of_a_displacement_of_2_mm(path, row, heading):
    """By hand."""
    found = seen_at(samples_of([path], [FISH]), row, n_fish=1, n_robots=0)
    assert found.poses[0, 2] == pytest.approx(heading, nan_ok=True)


def test_a_sample_that_is_not_there_is_no_pose():
    """Far beyond the last one, and before the first: such as after a break of the recording."""
    samples = samples_of([[[0.1, 0.1], [0.2, 0.1]]], [FISH], first=10)
    for k in (4, 17, 500):
        assert np.isnan(seen_at(samples, k, n_fish=1, n_robots=0).poses).all()


@pytest.mark.parametrize("n", [5, 40], ids=["a group", "a crowd"])
def test_every_run_begins_at_the_poses(two_rooms, model, n):
    """One sample: what is counted is where they were, not where a burn-in has brought them."""
    xy_m, heading = simulate_tracks(model, two_rooms, n_agents=n, n_steps=1, seed=3)
    start = Start(poses=np.column_stack([xy_m[0], heading[0]]), time_s=0.0)
    found = simulate_counts(
        pack([model], two_rooms), two_rooms, n_agents=n, n_steps=1, seeds=SEEDS, start=start
    )
    alike = found.occupation[0] == found.occupation[0, 0]
    assert alike.all()
    assert (found.distance[0] == found.distance[0, 0]).all()
    assert found.occupation[0, 0].sum() == n
    zones = [zone.name for zone in two_rooms.zones]
    wanted = np.bincount(two_rooms.zone_of(xy_m[0]) - 1, minlength=len(zones))
    np.testing.assert_array_equal(found.occupation[0, 0], wanted)


def test_a_state_is_that_of_the_poses(two_rooms, model):
    """Heading, the one before it, zone and room are; without a heading an agent keeps its own."""
    tank = tank_of(two_rooms)
    state = np.zeros((STATES, 3))
    state[DT_S] = 0.2
    place(state, tank, individuals(3, 0), seeded(np.uint64(5)))
    before = state.copy()
    ((x_m, y_m),) = simulate_tracks(model, two_rooms, n_agents=1, n_steps=1, seed=8)[0][0]
    place_at(state, np.array([[x_m, y_m, 2.0], [x_m, y_m, math.nan], [math.nan] * 3]), tank)
    np.testing.assert_allclose(state[[X, Y], :2].T, [[x_m, y_m]] * 2)
    np.testing.assert_allclose(state[[HX, HY], 0], [math.cos(2.0), math.sin(2.0)])
    np.testing.assert_array_equal(state[[PAST_HX, PAST_HY], 0], state[[HX, HY], 0])
    np.testing.assert_array_equal(state[[HX, HY], 1], before[[HX, HY], 1])
    np.testing.assert_array_equal(
        state[[X, Y, HX, HY, ZONE, WALL], 2], before[[X, Y, HX, HY, ZONE, WALL], 2]
    )
    assert (state[ZONE, :2] == two_rooms.zone_of([[x_m, y_m]])[0]).all()
    assert state[WALL, 0] == pytest.approx(two_rooms.wall_distance([[x_m, y_m]])[0], abs=1e-9)
    assert state[ROOM, 0] == state[ROOM, 1] > 0
    assert (state[LEFT_FROM] == 0).all()


def test_who_was_not_seen_begins_anywhere(two_rooms, model):
    """Without a pose and outside alike: other places in other runs, and all are counted."""
    for poses in (np.full((3, 3), np.nan), np.full((3, 3), 99.0)):
        found = simulate_counts(
            pack([model], two_rooms),
            two_rooms,
            n_agents=3,
            n_steps=1,
            seeds=SEEDS,
            start=Start(poses=poses, time_s=0.0),
        )
        assert (found.occupation[0].sum(axis=-1) == 3).all()
        assert (found.wall[0] != found.wall[0, 0]).any()


def test_poses_of_another_group_are_refused(two_rooms, model):
    """Two poses for three agents."""
    with pytest.raises(InputError, match="3 agents begins at as many poses, got 2"):
        simulate_counts(
            pack([model], two_rooms),
            two_rooms,
            n_agents=3,
            n_steps=5,
            seeds=SEEDS,
            start=Start(poses=np.zeros((2, 3)), time_s=0.0),
        )


def test_a_group_begins_where_it_was_seen_by_either_sampler(two_rooms, model):
    """The numeric sampler gives way: one law, and there is no recording from a start."""
    xy_m, heading = simulate_tracks(model, two_rooms, n_agents=3, n_steps=1, seed=3)
    start = Start(poses=np.column_stack([xy_m[0], heading[0]]), time_s=0.0)
    exact = Group(arena=two_rooms, template=model, n_fish=2, n_robots=1)
    grid = Group(arena=two_rooms, template=model, n_fish=2, n_robots=1, sampler="grid")
    words = {"n_counted": 2, "n_steps": 20, "seeds": SEEDS}
    genes = to_genes(model)[None]
    one, other = (g.begun(start).simulate(genes, **words) for g in (exact, grid))
    assert (one.wall == other.wall).all()
    assert (one.wall != exact.simulate(genes, **words).wall).any()

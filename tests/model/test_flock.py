"""Many groups abreast: what they see, how they draw, and that nobody minds its neighbours."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from scipy import stats

from zfcal.model.geometry import nearest_wall, zone_of
from zfcal.model.kernels.flock import find_tables, make_flock, observe, repeat
from zfcal.model.kernels.flock_runs import advance_flock, record_flock_run
from zfcal.model.kernels.perception import in_vectors, make_sight
from zfcal.model.kernels.world import GRID, STATES, make_work
from zfcal.model.packing import pack
from zfcal.model.simulate import individuals, pack_genes, simulate_counts, tank_of

SPEED_M_S = 0.09
N_LANES = 4_000


def stand(xy, heading, lanes, packed, tank):
    """Return a flock with the same group in each lane."""
    n, size = len(xy), len(xy) * lanes
    flock = make_flock(n, lanes)
    walls = [nearest_wall(x, y, tank) for x, y in xy]
    for row, values in (
        (flock.x, xy[:, 0]), (flock.y, xy[:, 1]), (flock.hx, np.cos(heading)),
        (flock.hy, np.sin(heading)), (flock.zone, [zone_of(x, y, tank) for x, y in xy]),
        (flock.tau_x, [wall[1] for wall in walls]), (flock.tau_y, [wall[2] for wall in walls]),
    ):  # fmt: skip
        row[:size] = np.repeat(values, lanes)
    flock.key[:] = np.random.SeedSequence(77).generate_state(len(flock.key), np.uint64)
    flock.cos_fov[:] = packed.cos_fov[0]
    repeat(size, flock)
    return flock


def draw(xy, heading, lanes, times, packed, tank):
    """Return headings that the first agent of each lane takes, again and again from one place."""
    n, drawn = len(xy), []
    room = (np.zeros((STATES, n)), make_sight(in_vectors(n * n)), make_work(n, 0, GRID))
    for k in range(times):
        flock = stand(xy, heading, lanes, packed, tank)
        advance_flock(k + 1, (n, lanes), flock, packed, tank, *room)
        drawn.append(np.arctan2(flock.hy[:lanes], flock.hx[:lanes]))
    return np.concatenate(drawn)


def weights(xy, heading, lanes, packed, tank):
    """Return weights and their sums, shape (agent, slot) and (slot,), of a flock of one step."""
    flock = stand(xy, heading, lanes, packed, tank)
    find_tables(len(xy) * lanes, flock, packed)
    observe(len(xy), lanes, flock)
    return flock.weight.reshape(len(xy), -1), flock.total


def of_one_speed(tank):
    """Return a tank in which all swim at one speed."""
    return tank._replace(speed_low=SPEED_M_S, speed_high=SPEED_M_S)


def test_they_draw_from_the_twins_density(hard_state, twin, two_rooms, model):
    """Chi-square over 60 angles with 100,000 draws in every hard state, at p > 1e-4.

    Power: were one draw in fifty taken from the uniform law instead, this would be
    noticed with a probability of at least 99 % (computed).
    """
    xy, heading = np.array(hard_state[0]), np.array(hard_state[1])
    packed, tank, times = pack([model], two_rooms), tank_of(two_rooms), 25

    drawn = draw(xy, heading, N_LANES, times, packed, of_one_speed(tank))

    theta, plain = twin.density(0, *hard_state, SPEED_M_S, model, two_rooms, n=7200)
    edges = np.linspace(-np.pi, np.pi, 61)
    seen = np.histogram(drawn, bins=edges)[0]
    cell = np.minimum((np.asarray(theta)[:-1] + np.pi) / (2 * np.pi) * 60, 59).astype(int)
    middle = 0.5 * (plain[:-1] + plain[1:])
    expected = np.bincount(cell, middle, 60) / middle.sum() * drawn.size
    rare = expected < 20
    seen = np.append(seen[~rare], seen[rare].sum())
    expected = np.append(expected[~rare], expected[rare].sum())
    seen, expected = seen[expected > 0], expected[expected > 0]
    statistic = ((seen - expected) ** 2 / np.maximum(expected, 5)).sum()
    freedom = len(expected) - 1
    assert stats.chi2.sf(statistic, freedom) > 1e-4
    wrong = 0.98 * expected + 0.02 * drawn.size / len(expected)
    shift = ((wrong - expected) ** 2 / np.maximum(expected, 5)).sum()
    assert stats.ncx2.sf(stats.chi2.isf(1e-4, freedom), freedom, shift) > 0.99


def test_the_weights_are_alpha_times_the_plain_solid_angle(hard_state, twin, two_rooms, model):
    """All round, each agent of each: to 2e-5, single precision, at lanes far into the vectors."""
    xy, heading = np.array(hard_state[0]), np.array(hard_state[1])
    whole = dataclasses.replace(model, fov_rad=math.pi)
    n, lanes = len(xy), 7

    weight, total = weights(xy, heading, lanes, pack([whole], two_rooms), tank_of(two_rooms))

    alphas = [zone.alpha for zone in model.zones]
    for i in range(n):
        alpha = alphas[two_rooms.zone_of(xy[[i]])[0] - 1]
        plain = [
            alpha * twin.body_solid_angle(xy[i], xy[(i + d) % n], heading[(i + d) % n])
            for d in range(1, n)
        ]
        for m in (0, lanes - 1):
            s = i * lanes + m
            assert weight[: n - 1, s] == pytest.approx(plain, rel=2e-5)
            assert total[s] == pytest.approx(sum(plain), rel=2e-5)


def test_who_is_behind_is_not_seen(two_rooms, model):
    """With a field of view of 90 degrees to each side the one ahead is seen, the others not."""
    xy = np.array([(0.22, 0.77), (0.28, 0.77), (0.16, 0.77), (0.215, 0.80)])
    half = dataclasses.replace(model, fov_rad=math.pi / 2)

    weight, _ = weights(xy, np.zeros(4), 3, pack([half], two_rooms), tank_of(two_rooms))

    assert weight[0, 0] > 0
    assert (weight[1:3, 0] == 0).all()


def test_heads_at_one_place_do_not_see_each_other(two_rooms, model):
    """Weight zero, and no number that is none."""
    xy = np.array([(0.22, 0.77), (0.22, 0.77), (0.30, 0.80)])

    weight, total = weights(xy, np.zeros(3), 2, pack([model], two_rooms), tank_of(two_rooms))

    assert weight[0, 0] == 0
    assert np.isfinite(total).all()


@pytest.mark.parametrize("n_jobs", [1, 7, 33])
def test_a_simulation_is_the_same_whoever_is_abreast(n_jobs, two_rooms, model):
    """The first of 1, 7 or 33 genomes, some of them of many rejections: the same counts."""
    genes = np.random.default_rng(4).random((33, 18)) ** 3
    sizes = {"n_agents": 5, "n_steps": 400, "seeds": np.array([5], dtype=np.uint64)}

    few = simulate_counts(
        pack_genes(genes[:n_jobs], model, two_rooms), two_rooms, n_threads=1, **sizes
    )
    whole = simulate_counts(pack_genes(genes, model, two_rooms), two_rooms, n_threads=2, **sizes)

    for one, all_ in zip(few, whole, strict=True):
        np.testing.assert_array_equal(one, all_[:n_jobs])


def test_who_may_not_stay_and_cannot_leave_stays_where_it_is(two_rooms, model):
    """In the centre with no attraction to the centre: speed zero, for ever."""
    zones = [
        dataclasses.replace(zone, gamma={**zone.gamma, "centre": 0.0}) if zone.name == "centre"
        else zone
        for zone in model.zones
    ]  # fmt: skip
    closed = dataclasses.replace(model, zones=tuple(zones))
    packed, tank = pack([closed], two_rooms), tank_of(two_rooms)
    tank = tank._replace(speed_low=0.001, speed_high=0.002)

    drawn = draw(np.array([(0.226, 0.774)]), np.array([0.7]), 9, 2, packed, tank)

    assert drawn == pytest.approx(0.7)


def test_a_step_is_the_speed_along_the_new_heading(two_rooms, model):
    """Every step of a recorded run, and its heading is a unit vector."""
    run = record_flock_run(
        np.uint64(3), individuals(5, 0), 10, 500, pack([model], two_rooms), tank_of(two_rooms)
    )

    step = run[1:, :, :2] - run[:-1, :, :2]
    assert step == pytest.approx(run[1:, :, 4:] * model.dt_s * run[1:, :, 2:4], abs=1e-12)
    assert np.hypot(run[..., 2], run[..., 3]) == pytest.approx(np.ones(run.shape[:2]))

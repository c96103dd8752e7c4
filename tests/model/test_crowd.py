"""Large groups: the bound of solid angles holds, and thinning draws from the model's own law."""

from __future__ import annotations

import dataclasses
import itertools
import math

import numpy as np
import pytest
import shapely
from scipy import stats

from zfcal.arena import make_arena
from zfcal.model.kernels import crowd as crowds
from zfcal.model.kernels.compiled import kernel
from zfcal.model.kernels.crowd_cells import look_near, make_crowd, sort, weigh_rings
from zfcal.model.kernels.crowd_runs import record_crowd_run
from zfcal.model.kernels.geometry import zone_of
from zfcal.model.kernels.perception import LENGTH_M, make_sight, most_sr, see
from zfcal.model.kernels.placing import settle
from zfcal.model.kernels.random import seeded
from zfcal.model.kernels.run import record_run
from zfcal.model.kernels.state import HX, HY, STATES, ZONE, X, Y, make_work
from zfcal.model.packing import pack
from zfcal.model.simulate import (
    MOST_IN_FULL,
    burn_in_steps,
    individuals,
    simulate_counts,
    simulate_tracks,
    tank_of,
)

SPEED_M_S = 0.09
DRAWS = 100_000
POND = make_arena(name="pond", outline=shapely.box(0, 0, 0.7, 0.5))


@kernel
def _bounds(away_m):
    found = np.empty(away_m.size)
    for k in range(away_m.size):
        found[k] = most_sr(away_m[k])
    return found


def test_no_body_covers_more_than_the_bound():
    """Two million: distances from just beyond a body length to 3 m, headings by the degree.

    And it is no more than twice the largest from 5 cm on, a tenth from 30 cm on.
    """
    reach = LENGTH_M * (1 + np.geomspace(1e-6, 150, 5500))
    heading = np.radians(np.arange(360))
    sight = make_sight(reach.size * heading.size)
    sight.dx_m[:] = np.repeat(reach, heading.size)
    sight.hx[:], sight.hy[:] = np.tile([np.cos(heading), np.sin(heading)], reach.size)
    see(sight, -2.0)

    largest = sight.angle_sr.reshape(reach.size, heading.size).max(axis=1)
    bound = _bounds(reach)

    assert (largest <= bound).all()
    assert (bound < 2.0 * largest)[reach > 0.05].all()
    assert (bound < 1.1 * largest)[reach > 0.3].all()


def test_the_bound_by_hand():
    """At 0.1 m: half a height times a length over 0.0933 m and 0.08 m."""
    assert _bounds(np.array([0.1]))[0] == pytest.approx(1e-4 / ((0.1 - 0.02 / 3) * 0.08), rel=1e-6)


def spread(arena, n, seed, *, first):
    """Return places of n agents all over an arena, and headings; those of the first as asked."""
    rng = np.random.default_rng(seed)
    x0, y0, x1, y1 = arena.outline.bounds
    xy = rng.uniform((x0, y0), (x1, y1), size=(20 * n, 2))
    xy, heading = xy[arena.zone_of(xy) > 0][:n], rng.uniform(-np.pi, np.pi, n)
    xy[0], heading[0] = first[:2], first[2]
    return xy, heading


def huddled(_arena, n, seed, *, first):
    """Return a cloud of n agents about the first one, nearly all of them in its nine cells."""
    rng = np.random.default_rng(seed)
    xy, heading = rng.normal(first[:2], 0.03, size=(n, 2)), rng.uniform(-np.pi, np.pi, n)
    xy[0], heading[0] = first[:2], first[2]
    return xy, heading


def afar(arena, n, seed, *, first):
    """Return n agents of which all but the first are at least 20 cm away from it."""
    xy, heading = spread(arena, 4 * n, seed, first=first)
    far = np.hypot(*(xy - xy[0]).T) > 0.2
    far[0] = True
    return xy[far][:n], heading[far][:n]


# How the others are, how many, where the first one is and heads.
CROWDS = {
    "in a cloud": (huddled, 60, (0.22, 0.78, 0.4)),
    "in a full room": (spread, 300, (0.20, 0.80, 0.3)),
    "at a wall of a full room": (spread, 300, (0.055, 0.80, math.pi)),
    "in the corridor, all others far": (afar, 80, (0.50, 0.50, -0.7)),
    "in the corridor's mouth": (spread, 40, (0.41, 0.655, -0.8)),
    "at a border of zones, all others far": (afar, 200, (0.122, 0.80, 2.0)),
}


@kernel
def _settle_all(state, tank):
    for i in range(state.shape[1]):
        state[ZONE, i] = zone_of(state[X, i], state[Y, i], tank)
        settle(i, state, tank)


_draw_heading = crowds._draw_heading


@kernel
def _drawn(n, speed, seed, state, packed, tank, work, crowd):
    random = seeded(seed)
    sort(state, crowd)
    columns = crowd.before.shape[1] - 1
    at = (crowd.cell[0] // columns, crowd.cell[0] % columns)
    theta = np.empty(n)
    found, near_sr = look_near(0, at[0], at[1], state, packed.cos_fov[0], crowd)
    sums_sr = (near_sr, weigh_rings(at[0], at[1], crowd))
    for k in range(n):
        _draw_heading(
            0, speed, at, state, 0, packed, tank, random, work, crowd, found, sums_sr
        )  # fmt: skip
        theta[k] = math.atan2(work.moves[0, 1], work.moves[0, 0])
    return theta, near_sr, sums_sr[1]


def thinned(xy, heading, arena, model, *, n=DRAWS, seed=7):
    """Return headings of the first agent drawn by thinning, and the bounds' sums."""
    state = np.zeros((STATES, len(xy)))
    state[X], state[Y] = xy.T
    state[HX], state[HY] = np.cos(heading), np.sin(heading)
    tank, packed = tank_of(arena), pack([model], arena)
    _settle_all(state, tank)
    work, crowd = make_work(len(xy), 0, 360), make_crowd(len(xy), tank)
    return _drawn(n, SPEED_M_S, np.uint64(seed), state, packed, tank, work, crowd)


def cell_shares(twin, xy, heading, arena, model):
    """Return the twin's probability of each of 60 cells, from 7,200 angles."""
    theta, density = twin.density(0, xy, heading, SPEED_M_S, model, arena, n=7200)
    steps = (density[1:] + density[:-1]) / 2 * np.diff(theta)
    share = steps.reshape(60, 120).sum(axis=1)
    return share / share.sum()


def pooled(expected, *others):
    """Put cells with fewer than ten expected draws into one, with the least of the others."""
    rare = expected < 10
    rare[np.argsort(expected)[: rare.sum() + 1]] = True
    return [np.append(x[~rare], x[rare].sum()) for x in (expected, *others)]


@pytest.mark.slow
@pytest.mark.parametrize("name", CROWDS, ids=lambda name: name.replace(" ", "-"))
def test_thinned_draws_follow_the_twins_density(name, twin, two_rooms, model):
    """Chi-square over 60 angles with 100,000 draws, at p > 1e-4.

    Power, at least 99 % in each state, against one draw in 25 from the
    uniform law, and against a cut-off that leaves out all beyond 20 cm.
    """
    others, n_agents, first = CROWDS[name]
    xy, heading = others(two_rooms, n_agents, 5, first=first)

    drawn, near_sr, far_sr = thinned(xy, heading, two_rooms, model)
    expected = DRAWS * cell_shares(twin, xy, heading, two_rooms, model)
    near = np.hypot(*(xy - xy[0]).T) < 0.2
    cut = DRAWS * cell_shares(twin, xy[near], heading[near], two_rooms, model)
    seen = np.histogram(drawn, bins=np.linspace(-math.pi, math.pi, 61))[0]
    expected, seen, cut = pooled(expected, seen, cut)

    freedom = len(expected) - 1
    assert stats.chi2.sf(((seen - expected) ** 2 / expected).sum(), freedom) > 1e-4
    limit = stats.chi2.isf(1e-4, freedom)
    uniform = 0.96 * expected + 0.04 * DRAWS / len(expected)
    for wrong in (uniform, cut) if "far" in name else (uniform,):
        shift = ((wrong - expected) ** 2 / expected).sum()
        assert stats.ncx2.sf(limit, freedom, shift) > 0.99
    assert near_sr > 0.3 or "cloud" not in name
    assert far_sr > 0.1 or "far" not in name


@pytest.mark.slow
def test_every_step_of_a_large_group_obeys_the_twins_law(twin, make_natural):
    """The twin's distribution function at 480 headings taken is uniform, given all at time t."""
    model = make_natural(POND)
    people = individuals(40, 0)
    record = record_crowd_run(np.uint64(5), people, 30, 13, pack([model], POND), tank_of(POND))
    xy, speed = record[..., :2], record[..., 4]
    heading = np.arctan2(record[..., 3], record[..., 2])

    levels = []
    for k, agent in itertools.product(range(12), range(40)):
        theta, density = twin.density(agent, xy[k], heading[k], speed[k + 1, agent], model, POND)
        cumulative = np.concatenate([[0], np.cumsum(density[1:] + density[:-1])])
        levels.append(np.interp(heading[k + 1, agent], theta, cumulative / cumulative[-1]))

    assert stats.kstest(levels, "uniform").pvalue > 1e-4


def test_large_groups_do_not_depend_on_threads(two_rooms, model):
    """Four models, two seeds, 60 agents: bit-equal with one, two and five threads."""
    packed = pack([model] * 4, two_rooms)
    seeds = np.array([3, 14], dtype=np.uint64)

    one, two, five = (
        simulate_counts(packed, two_rooms, n_agents=60, n_steps=30, seeds=seeds, n_threads=n)
        for n in (1, 2, 5)
    )

    for alone, pair, many in zip(one, two, five, strict=True):
        assert (alone == pair).all()
        assert (alone == many).all()
        assert (alone[0] == alone[3]).all()


@pytest.mark.parametrize("extra", [0, 1])
def test_only_groups_beyond_the_limit_are_thinned(extra, two_rooms, model):
    """At the limit the run is that of the old kernel bit by bit, above it the other's."""
    n = MOST_IN_FULL + extra
    word = np.random.SeedSequence(8).generate_state(1, np.uint64)[0]
    rest = (individuals(n, 0), burn_in_steps(0.2), 3, pack([model], two_rooms), tank_of(two_rooms))

    xy, _ = simulate_tracks(model, two_rooms, n_agents=n, n_steps=3, seed=8)

    run = record_crowd_run(word, *rest) if extra else record_run(word, *rest, 0)
    assert (xy == run[..., :2]).all()


def test_models_with_effects_look_at_everybody(two_rooms, model):
    """Effects may ask what an agent sees: then no group is large."""
    n = MOST_IN_FULL + 1
    aligned = dataclasses.replace(model, effects={"alignment": {"weight": 0.5, "kappa": 2.0}})
    word = np.random.SeedSequence(8).generate_state(1, np.uint64)[0]
    rest = (burn_in_steps(0.2), 3, pack([aligned], two_rooms), tank_of(two_rooms), 0)

    xy, _ = simulate_tracks(aligned, two_rooms, n_agents=n, n_steps=3, seed=8)

    assert (xy == record_run(word, individuals(n, 0), *rest)[..., :2]).all()


def test_nobody_of_a_large_group_leaves_the_tank(two_rooms, model):
    """Nor is anybody lost in the sorting: 200 agents at all samples, all inside, all moving."""
    xy, heading = simulate_tracks(model, two_rooms, n_agents=200, n_steps=20, seed=4)

    assert (two_rooms.zone_of(xy) > 0).all()
    assert np.isfinite(heading).all()
    assert (np.diff(xy, axis=0) != 0).any(axis=2).mean() > 0.99
    assert np.hypot(*np.diff(xy, axis=0).T).max() <= 0.2 * model.dt_s + 1e-12

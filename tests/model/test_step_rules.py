"""The rules of a step that single draws do not show: all at once, redraws, stays, extremes."""

from __future__ import annotations

import dataclasses
import itertools
import math

import numba
import numpy as np
import pytest
import shapely
from scipy import stats

from zfcal.arena import Bins, make_arena
from zfcal.errors import InputError
from zfcal.model.kernels.compiled import kernel
from zfcal.model.kernels.perception import make_sight
from zfcal.model.kernels.placing import place
from zfcal.model.kernels.random import next_word, seeded
from zfcal.model.kernels.run import advance, record_run
from zfcal.model.kernels.state import STATES, make_work
from zfcal.model.onestep import draw_headings, heading_density
from zfcal.model.packing import pack, pack_genes
from zfcal.model.simulate import (
    burn_in_steps,
    individuals,
    simulate_counts,
    simulate_tracks,
    tank_of,
)
from zfcal.model.tank import make_tank
from zfcal.parameters import to_genes

SAMPLERS = pytest.mark.parametrize("sampler", ["exact", "grid"])
FAST = (*(0.0,) * 9, 1.0)

POND = make_arena(name="pond", outline=shapely.box(0, 0, 0.34, 0.3), wall_zone_m=0.05)
SQUARE = make_arena(name="square", outline=shapely.box(0, 0, 0.5, 0.5))


def changed(model, **changes):
    """Return a model with every zone changed alike."""
    zones = tuple(dataclasses.replace(zone, **changes) for zone in model.zones)
    return dataclasses.replace(model, zones=zones)


def recorded(model, arena, *, n_agents, n_steps, seed=5, sampler="exact", burn_in=100):
    """Return positions, heading angles and speeds of a recorded run."""
    grid = 720 if sampler == "grid" else 0
    record = record_run(
        np.uint64(seed),
        individuals(n_agents, 0),
        burn_in,
        n_steps,
        pack([model], arena),
        tank_of(arena),
        grid,
    )
    return record[..., :2], np.arctan2(record[..., 3], record[..., 2]), record[..., 4]


@pytest.mark.slow
@SAMPLERS
def test_every_step_of_a_run_obeys_the_twins_law(sampler, twin, make_natural):
    """The twin's distribution function at 3,600 headings taken is uniform, given all at time t.

    Six sociable fish in a pond, so that nearly all is neighbours and walls.
    Power: when agents move one after the other, each seeing where the others
    are already, the statistic is 0.05 where 0.037 is the limit.
    """
    model = changed(make_natural(POND), alpha=400.0, kappa_f=30.0, kappa_w=3.0)
    model = dataclasses.replace(model, dt_s=0.4)
    xy, heading, speed = recorded(model, POND, n_agents=6, n_steps=401, sampler=sampler)

    levels = []
    for k, agent in itertools.product(range(400), range(6)):
        theta, density = twin.density(agent, xy[k], heading[k], speed[k + 1, agent], model, POND)
        cumulative = np.concatenate([[0], np.cumsum(density[1:] + density[:-1])])
        levels.append(np.interp(heading[k + 1, agent], theta, cumulative / cumulative[-1]))

    assert stats.kstest(levels, "uniform").pvalue > 1e-4


@kernel
def _words_used(state, packed, tank, random, grid):
    """Advance by one step with the numeric sampler; return how many words that took."""
    look_at, work = make_sight(state.shape[1] ** 2), make_work(state.shape[1], 0, grid)
    twin_random = random.copy()
    advance(state, 0, packed, tank, look_at, random, work, True)
    for used in range(10_000):
        if (twin_random == random).all():
            return used
        next_word(twin_random)
    return -1


@pytest.mark.slow
def test_a_speed_is_drawn_once_and_redrawn_fifty_times(make_natural):
    """Where no speed leads anywhere: 51 draws of two words each, and none for a heading."""
    model = dataclasses.replace(changed(make_natural(SQUARE), speed_frequency=FAST), dt_s=10.0)
    state, tank, random = np.zeros((STATES, 1)), make_tank(SQUARE), seeded(np.uint64(4))
    _place(state, tank, individuals(1, 0), random)

    used = _words_used(state, pack([model], SQUARE), tank, random, 90)

    assert used == 51 * 2


@kernel
def _place(state, tank, people, random):
    place(state, tank, people, random)


@SAMPLERS
def test_who_has_nowhere_to_go_stays_and_keeps_its_heading(sampler, make_natural):
    """Each speed would carry it 1.8 m: positions, headings and zones stay, the speed is zero."""
    model = dataclasses.replace(changed(make_natural(SQUARE), speed_frequency=FAST), dt_s=10.0)

    xy, heading, speed = recorded(model, SQUARE, n_agents=2, n_steps=4, sampler=sampler, burn_in=0)

    assert (xy == xy[0]).all()
    assert (heading == heading[0]).all()
    assert (speed == 0).all()


@SAMPLERS
def test_a_speed_that_leads_nowhere_is_drawn_anew(sampler, make_natural):
    """Half of the draws are too fast for the tank: with up to 50 more nobody ever stays."""
    half = (0.5, *(0.0,) * 8, 0.5)
    model = dataclasses.replace(changed(make_natural(SQUARE), speed_frequency=half), dt_s=5.0)

    _, _, speed = recorded(model, SQUARE, n_agents=3, n_steps=150, sampler=sampler, burn_in=1)

    assert (speed > 0).all()
    assert speed.max() <= 0.02


def test_within_a_bin_all_speeds_are_alike(make_natural):
    """Bin 2 of ten from 0.02 to 0.19 m/s: 12,000 speeds uniform from 0.054 to 0.071 m/s."""
    arena = dataclasses.replace(SQUARE, bins=Bins(speed_m_s=(0.02, 0.19)))
    third = (0.0, 0.0, 1.0, *(0.0,) * 7)

    _, _, speed = recorded(
        changed(make_natural(arena), speed_frequency=third), arena, n_agents=4, n_steps=3000
    )

    assert stats.kstest(speed.ravel(), stats.uniform(0.054, 0.017).cdf).pvalue > 1e-4


def test_stays_count_as_the_slowest_bin(make_natural):
    """And as a transition from the zone to itself."""
    model = dataclasses.replace(changed(make_natural(SQUARE), speed_frequency=FAST), dt_s=10.0)

    counts = simulate_counts(
        pack([model], SQUARE), SQUARE, n_agents=2, n_steps=5, seeds=np.array([1], np.uint64)
    )

    assert counts.speed[0, 0, :, 0].sum() == counts.speed.sum() == 8
    assert np.trace(counts.transition[0, 0]) == 8


def test_without_concentration_and_neighbours_all_headings_are_alike(two_rooms, model):
    """Concentration 0, weight 0, away from borders: the uniform law, as density and as draws."""
    aimless = changed(model, kappa_0=0.0, kappa_f=0.0, alpha=0.0)
    state = {"xy_m": [(0.2, 0.77), (0.24, 0.77)], "heading_rad": [0.3, 0.0], "speed_m_s": 0.05}

    _, density = heading_density(aimless, two_rooms, **state)
    drawn = draw_headings(aimless, two_rooms, n=50_000, seed=3, **state)

    assert density == pytest.approx(np.full(361, 1 / (2 * math.pi)))
    assert stats.kstest(drawn, stats.uniform(-math.pi, 2 * math.pi).cdf).pvalue > 1e-4


def test_with_kappa_f_zero_a_neighbour_only_blurs(two_rooms, model, twin):
    """Its component is the uniform law, with its weight."""
    vague = changed(model, kappa_f=0.0)
    xy, heading = [(0.2, 0.77), (0.24, 0.77)], [0.3, 0.0]

    _, found = heading_density(vague, two_rooms, xy_m=xy, heading_rad=heading, speed_m_s=0.05)
    _, alone = heading_density(vague, two_rooms, xy_m=xy[:1], heading_rad=[0.3], speed_m_s=0.05)

    weight = 49.0 * twin.body_solid_angle(*xy, 0.0)
    assert found == pytest.approx((alone + weight / (2 * math.pi)) / (1 + weight))


def test_the_wall_may_have_a_concentration_of_its_own(two_rooms, model, twin):
    """kappa_w counts where fish follow walls and nowhere else."""
    own = changed(model, kappa_w=1.5)
    for xy in ([(0.07, 0.8)], [(0.2, 0.77)]):
        state = {"xy_m": xy, "heading_rad": [0.4], "speed_m_s": 0.05}
        _, found = heading_density(own, two_rooms, **state)
        _, expected = twin.density(0, xy, [0.4], 0.05, own, two_rooms)
        assert found == pytest.approx(expected, abs=2e-4 * expected.max())

    _, plain = heading_density(model, two_rooms, **state)
    assert plain == pytest.approx(found)


@pytest.mark.parametrize("fov_deg", [30.0, 90.0, 169.0, 180.0])
def test_the_field_of_view_is_the_twins(fov_deg, two_rooms, model, twin):
    """Neighbours ahead, aside, behind and right behind; with 180 degrees all are seen."""
    wide = dataclasses.replace(changed(model, alpha=2000.0), fov_rad=math.radians(fov_deg))
    xy = [(0.22, 0.77), (0.28, 0.77), (0.225, 0.83), (0.16, 0.78), (0.18, 0.77)]
    heading = [0.0, 0.4, 1.0, 2.0, 3.0]

    _, found = heading_density(wide, two_rooms, xy_m=xy, heading_rad=heading, speed_m_s=0.03)
    theta, expected = twin.density(0, xy, heading, 0.03, wide, two_rooms)

    assert found == pytest.approx(expected, abs=2e-4 * expected.max())
    behind = found[np.argmin(np.abs(theta - math.pi))]
    assert (behind > 0.5) == (fov_deg == 180.0)


def test_agents_at_one_place_do_not_see_each_other(two_rooms, model):
    """No direction can be told: the density is that of an agent alone, and a run goes on."""
    here = (0.2, 0.77)
    alone = heading_density(model, two_rooms, xy_m=[here], heading_rad=[1.0], speed_m_s=0.1)[1]

    found = heading_density(
        model, two_rooms, xy_m=[here] * 3, heading_rad=[1.0, 1.0, -2.0], speed_m_s=0.1
    )[1]

    assert found == pytest.approx(alone)


def test_a_head_at_anothers_tail_is_no_division_by_zero(two_rooms, model):
    """A tail, or a side of the body, exactly at the observer's head: finite numbers."""
    ahead = [(0.2, 0.77), (0.22, 0.77)]
    aside = [(0.2, 0.77), (0.2 + 0.02 / 3, 0.76)]
    for xy in (ahead, aside):
        _, density = heading_density(
            model, two_rooms, xy_m=xy, heading_rad=[0.0, 0.0], speed_m_s=0.1
        )
        assert np.isfinite(density).all()
        assert density.max() > 0


def test_an_agent_alone_has_only_the_base(two_rooms, model, twin):
    """In the centre: the von Mises law of its own heading."""
    theta, found = heading_density(
        model, two_rooms, xy_m=[(0.2, 0.77)], heading_rad=[0.5], speed_m_s=0.05
    )

    assert found == pytest.approx(twin.von_mises(theta, 0.5, 8.0), abs=1e-4)


def test_a_row_of_zeros_is_a_row_without_preference(two_rooms, model):
    """As genes: the same run as with a row of ones, bit by bit."""
    genes = np.stack([to_genes(model)] * 2)
    genes[0, 12:15], genes[1, 12:15] = 0.0, 1.0

    counts = simulate_counts(
        pack_genes(genes, model, two_rooms), two_rooms, n_agents=5, n_steps=400,
        seeds=np.array([2], np.uint64),
    )  # fmt: skip

    for rows in counts:
        assert (rows[0] == rows[1]).all()


@SAMPLERS
def test_who_may_not_stay_in_a_zone_and_cannot_leave_it_stays_where_it_is(
    sampler, two_rooms, model
):
    """No attraction to the centre from the centre: deep inside no heading is admissible."""
    torn = changed(model, gamma={"corridor": 1.0, "walls": 1.0, "centre": 0.0})

    drawn = draw_headings(
        torn, two_rooms, xy_m=[(0.226, 0.774)], heading_rad=[0.0], speed_m_s=0.1, n=5, seed=1,
        sampler=sampler,
    )  # fmt: skip

    assert np.isnan(drawn).all()


def test_only_ratios_within_a_row_of_gamma_matter(two_rooms, model):
    """Rows times 0.5 and times 1e-6: the same run, bit by bit."""
    models = [
        changed(model, gamma={"corridor": 0.5 * f, "walls": 1.0 * f, "centre": 0.25 * f})
        for f in (1.0, 0.5, 2.0**-20)
    ]

    counts = simulate_counts(
        pack(models, two_rooms), two_rooms, n_agents=5, n_steps=400, seeds=np.array([2], np.uint64)
    )

    for rows in counts:
        assert (rows[0] == rows[1]).all()
        assert (rows[0] == rows[2]).all()


def test_a_run_starts_anywhere_inside_with_any_heading(two_rooms, model):
    """Chi-square of 24,000 places over the zones' areas, and of headings: notices 2 %."""
    starts = [
        recorded(model, two_rooms, n_agents=300, n_steps=1, seed=seed, burn_in=0)
        for seed in range(80)
    ]
    xy = np.concatenate([start[0][0] for start in starts])
    heading = np.concatenate([start[1][0] for start in starts])

    corridor = shapely.area(two_rooms.zones[0].polygon)
    rest = shapely.difference(two_rooms.outline, two_rooms.zones[0].polygon)
    near = shapely.area(shapely.intersection(rest, two_rooms.outline.boundary.buffer(0.07, 256)))
    areas = np.array([corridor, near, shapely.area(rest) - near])
    seen = np.bincount(two_rooms.zone_of(xy), minlength=4)
    assert seen[0] == 0
    assert stats.chisquare(seen[1:], areas / areas.sum() * len(xy)).pvalue > 1e-4
    assert stats.kstest(heading, stats.uniform(-math.pi, 2 * math.pi).cdf).pvalue > 1e-4
    # Along a room as well, not only by zone.
    room = xy[(xy[:, 0] < 0.401) & (xy[:, 1] > 0.67), 0]
    assert stats.kstest(room, stats.uniform(0.051, 0.35).cdf).pvalue > 1e-4


@pytest.mark.parametrize(("dt_s", "steps"), [(0.2, 300), (1 / 3, 180), (6 / 28.07, 281), (7.0, 9)])
def test_the_first_minute_is_dropped(dt_s, steps):
    """At least 60 s, in whole steps."""
    assert burn_in_steps(dt_s) == steps


def test_a_run_is_the_end_of_the_one_with_its_first_minute(two_rooms, model):
    """simulate_tracks gives samples 300, 301, ... of a run that keeps its start."""
    xy, heading = simulate_tracks(model, two_rooms, n_agents=3, n_steps=20, seed=8)
    word = np.random.SeedSequence(8).generate_state(1, np.uint64)[0]
    whole = recorded(model, two_rooms, n_agents=3, n_steps=320, seed=word, burn_in=0)

    assert (xy == whole[0][300:]).all()
    assert (heading == whole[1][300:]).all()


def test_a_population_and_a_model_are_of_one_type_for_the_compiler(two_rooms, model):
    """Otherwise a start would compile everything twice: half a minute more."""
    one, many = pack([model], two_rooms), pack([model, model], two_rooms)
    genes = pack_genes(np.full((1, 18), 0.5), model, two_rooms)

    assert numba.typeof(one) == numba.typeof(many) == numba.typeof(genes)


@pytest.mark.parametrize(
    "genes",
    [np.full((2, 17), 0.5), np.full(18, 0.5), np.full((1, 18), 1.5), np.full((1, 18), -0.1)],
)
def test_genes_that_are_none_are_refused(genes, two_rooms, model):
    """Too few, no table, out of bounds."""
    with pytest.raises(InputError, match=r"18 genes in \[0, 1\]"):
        pack_genes(genes, model, two_rooms)


@pytest.mark.parametrize("gene", [0, 2, 17])
def test_a_gene_that_is_nan_is_refused_before_it_hangs(gene, two_rooms, model):
    """No draw of a law of NaN would ever be accepted."""
    genes = np.full((2, 18), 0.5)
    genes[1, gene] = np.nan

    with pytest.raises(InputError, match="18 genes"):
        pack_genes(genes, model, two_rooms)


def test_no_models_are_refused(two_rooms):
    """An empty population."""
    with pytest.raises(InputError, match="no model to pack"):
        pack([], two_rooms)


@pytest.mark.parametrize(
    "changes", [{"n_agents": 0}, {"n_steps": 0}, {"n_steps": -1}, {"seed": -1}]
)
def test_sizes_that_are_none_are_refused(changes, two_rooms, model):
    """No agents, no steps, a seed below zero."""
    with pytest.raises(InputError, match="needs agents, steps and a seed"):
        simulate_tracks(model, two_rooms, **{"n_agents": 2, "n_steps": 5, "seed": 1} | changes)


@pytest.mark.parametrize("changes", [{"sampler": "metropolis"}, {"sampler": "grid", "grid": 0}])
def test_a_sampler_that_is_none_is_refused(changes, two_rooms, model):
    """Another name, and a grid without angles, which must not turn into the exact sampler."""
    with pytest.raises(InputError, match="ampler"):
        simulate_tracks(model, two_rooms, n_agents=1, n_steps=2, seed=1, **changes)


@pytest.mark.parametrize(
    "state",
    [
        {"xy_m": [(0.2, 0.8)], "heading_rad": [0.0, 1.0]},
        {"xy_m": [(0.2, 0.8, 0.0)], "heading_rad": [0.0]},
        {"xy_m": [(0.2, 0.8)], "heading_rad": [0.0], "agent": 1},
        {"xy_m": [(0.2, 0.8)], "heading_rad": [0.0], "agent": -1},
        {"xy_m": [(0.2, 0.8)], "heading_rad": [math.nan]},
    ],
)
def test_a_state_that_is_none_is_refused(state, two_rooms, model):
    """Shapes that do not fit, an agent that is not there, an unknown heading."""
    with pytest.raises(InputError, match="One step"):
        heading_density(model, two_rooms, speed_m_s=0.1, **state)


def test_an_agent_on_the_wall_is_inside(two_rooms, model):
    """A tracked fish at x = 0.949 exactly has a density, along the wall."""
    theta, density = heading_density(
        model, two_rooms, xy_m=[(0.949, 0.2)], heading_rad=[1.0], speed_m_s=0.05
    )

    assert abs(theta[np.argmax(density)]) == pytest.approx(math.pi / 2, abs=0.02)

"""Each of the four hooks of an effect reaches the step, in both samplers, with its own numbers."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from numba import cfunc
from scipy import stats

from zfcal.errors import InputError
from zfcal.model import packing
from zfcal.model.effects.base import Effect, EffectParameter
from zfcal.model.kernels.hooks import COMPONENT, FACTOR, SIGHT, SPEED
from zfcal.model.kernels.state import HX, TIME, X
from zfcal.model.onestep import draw_headings, heading_density
from zfcal.model.simulate import pack, simulate_counts, simulate_tracks

SAMPLERS = pytest.mark.parametrize("sampler", ["exact", "grid"])

# Two fish in the centre of the upper room, too far from walls for a border of zones to matter.
ROOM = {"xy_m": [(0.20, 0.77), (0.26, 0.77)], "heading_rad": [0.0, 1.0]}


@cfunc(COMPONENT)
def compass(state, sight, n, i, parameters, out):
    """A component of a given direction, concentration and weight."""
    out[0], out[1], out[2] = math.cos(parameters[0]), math.sin(parameters[0]), parameters[1]
    return parameters[2]


@cfunc(FACTOR)
def never_left(state, sight, n, i, parameters, ux, uy, speed, landing):
    """No heading with a component to the left; the faster the step, the less."""
    return math.exp(-parameters[0] * speed) if ux > 0 else 0.0


@cfunc(FACTOR)
def shun_zone(state, sight, n, i, parameters, ux, uy, speed, landing):
    """A share of the density for headings that land in a zone."""
    return parameters[1] if landing == parameters[0] else 1.0


@cfunc(SPEED)
def slower(state, sight, n, i, parameters, chance):
    """Agents from a given one on swim at a share of their speed."""
    return parameters[1] if i >= parameters[0] else 1.0


@cfunc(SPEED)
def tired(state, sight, n, i, parameters, chance):
    """Nobody swims from a given time on."""
    return 0.0 if state[TIME * n + i] >= parameters[0] else 1.0


@cfunc(SIGHT)
def blind_to(state, sight, n, i, parameters, j):
    """An agent sees a share of a given other one."""
    return parameters[2] if i == parameters[0] and j == parameters[1] else 1.0


@cfunc(SIGHT)
def only_to_the_right(state, sight, n, i, parameters, j):
    """Others count only where they are farther along x and face along x."""
    return 1.0 if state[X * n + j] > state[X * n + i] and state[HX * n + j] > 0 else 0.0


def effect(name, defaults, **hooks):
    """Return an effect whose parameters p0, p1, ... have these defaults."""
    parameters = tuple(
        EffectParameter(name=f"p{k}", low=-100.0, high=1e4, default=value, says="")
        for k, value in enumerate(defaults)
    )
    return Effect(name=name, says="A test.", reference="none", parameters=parameters, **hooks)


EFFECTS = (
    effect("compass", (0.0, 5.0, 3.0), component=compass),
    effect("never-left", (0.0,), factor=never_left),
    effect("shun-zone", (2.0, 0.0), factor=shun_zone),
    effect("slower", (0.0, 0.5), speed=slower),
    effect("tired", (30.0,), speed=tired),
    effect("blind-to", (0.0, 1.0, 0.0), sight=blind_to),
    effect("rightward", (), sight=only_to_the_right),
    effect("whole", (0.25, 20.0, 7.0), component=compass, speed=slower),
)


@pytest.fixture(autouse=True)
def _known_effects(monkeypatch):
    """Make the effects of this file known by their names."""
    known = {one.name: one for one in EFFECTS}
    monkeypatch.setattr(packing, "find_effect", known.__getitem__)


@pytest.fixture
def with_effects(make_natural, two_rooms):
    """Return a function that gives a model with effects; its zones are changed as asked."""

    def make(effects, **changes):
        plain = make_natural(two_rooms)
        zones = tuple(dataclasses.replace(zone, **changes) for zone in plain.zones)
        return dataclasses.replace(plain, zones=zones, effects=effects)

    return make


def test_a_component_joins_the_mixture_with_its_weight(with_effects, two_rooms):
    """With a uniform base and nobody else: (1 / 2 pi + 3 vM(theta; 2, 5)) / 4, angle by angle."""
    model = with_effects({"compass": {"p0": 2.0}}, kappa_0=0.0)

    theta, found = heading_density(
        model, two_rooms, xy_m=[(0.2, 0.77)], heading_rad=[0.0], speed_m_s=0.0
    )

    expected = (1 / (2 * math.pi) + 3 * stats.vonmises(5.0, loc=2.0).pdf(theta)) / 4
    assert found == pytest.approx(expected, abs=1e-9)


@pytest.mark.slow
@SAMPLERS
def test_headings_are_drawn_from_the_component(sampler, with_effects, two_rooms):
    """Kolmogorov-Smirnov with 100,000 draws: notices 1 % of the weight."""
    model = with_effects({"compass": {"p0": -1.0, "p1": 40.0, "p2": 2.0}}, kappa_0=0.0)

    drawn = draw_headings(
        model, two_rooms, xy_m=[(0.2, 0.77)], heading_rad=[0.0], speed_m_s=0.0, n=100_000, seed=4,
        sampler=sampler, grid=7200,
    )  # fmt: skip

    law = stats.vonmises(40.0, loc=-1.0)

    def cumulative(theta):
        return (theta + math.pi) / (2 * math.pi) / 3 + 2 / 3 * (law.cdf(theta) - law.cdf(-math.pi))

    assert stats.kstest(drawn, cumulative).pvalue > 1e-4


def test_components_stand_beside_the_neighbours(with_effects, two_rooms, twin):
    """Two components and a neighbour: weights 3, 7 and alpha A beside the base's one."""
    alone, joined = with_effects({}), with_effects({"compass": {}, "whole": {}})
    angle = 49.0 * twin.body_solid_angle(*ROOM["xy_m"], 1.0)

    theta, before = heading_density(alone, two_rooms, speed_m_s=0.0, **ROOM)
    _, after = heading_density(joined, two_rooms, speed_m_s=0.0, **ROOM)

    added = 3 * stats.vonmises(5.0).pdf(theta) + 7 * stats.vonmises(20.0, loc=0.25).pdf(theta)
    expected = ((1 + angle) * before + added) / (1 + angle + 10)
    assert after == pytest.approx(expected, abs=1e-6)


@SAMPLERS
def test_a_factor_of_zero_forbids_headings(sampler, with_effects, two_rooms):
    """Never a heading to the left, whatever else pulls there."""
    drawn = draw_headings(
        with_effects({"never-left": {}}), two_rooms, xy_m=[(0.2, 0.77)], heading_rad=[3.0],
        speed_m_s=0.1, n=3000, seed=4, sampler=sampler,
    )  # fmt: skip

    assert np.cos(drawn).min() > 0


@pytest.mark.slow
@SAMPLERS
def test_a_factor_knows_the_landing_zone(sampler, with_effects, two_rooms):
    """A third of the density where a step ends at the walls: odds of landing there fall to it."""
    state = {"xy_m": [(0.125, 0.77)], "heading_rad": [math.pi / 2], "speed_m_s": 0.1}
    shares = []
    for effects in ({}, {"shun-zone": {"p1": 1 / 3}}):
        drawn = draw_headings(
            with_effects(effects), two_rooms, n=40_000, seed=4, sampler=sampler, grid=7200, **state
        )
        landing = np.array(state["xy_m"]) + 0.02 * np.column_stack([np.cos(drawn), np.sin(drawn)])
        shares.append((two_rooms.zone_of(landing) == 2).mean())

    odds = [share / (1 - share) for share in shares]
    # Five standard errors of the ratio of two odds.
    assert odds[1] / odds[0] == pytest.approx(1 / 3, rel=0.09)


def test_a_factor_knows_the_speed_of_the_step(with_effects, two_rooms):
    """exp(-10 v) scales all headings alike: the law stays; with v = 700 nothing is left of it."""
    plain, tilted = with_effects({}), with_effects({"never-left": {"p0": 10.0}})
    steep = with_effects({"never-left": {"p0": 10_000.0}})

    _, before = heading_density(plain, two_rooms, speed_m_s=0.1, **ROOM)
    theta, after = heading_density(tilted, two_rooms, speed_m_s=0.1, **ROOM)
    _, none = heading_density(steep, two_rooms, speed_m_s=0.1, **ROOM)

    right = np.cos(theta) > 0
    assert after[right] / after.sum() == pytest.approx(before[right] / before[right].sum())
    assert (none == 0).all()


@SAMPLERS
def test_a_speed_factor_slows_down_whom_it_means(sampler, with_effects, two_rooms):
    """Agents 1 and 2 at half speed, agent 0 at its own: means and largest steps."""
    model = with_effects({"slower": {"p0": 1.0}})

    xy, _ = simulate_tracks(model, two_rooms, n_agents=3, n_steps=1500, seed=3, sampler=sampler)

    speed = np.linalg.norm(np.diff(xy, axis=0), axis=-1) / model.dt_s
    assert speed[:, 1:].max() <= 0.1 + 1e-12
    assert speed[:, 0].max() > 0.17
    assert speed[:, 1:].mean() / speed[:, 0].mean() == pytest.approx(0.5, abs=0.08)


@SAMPLERS
def test_effects_know_the_time_since_the_first_sample(sampler, with_effects, two_rooms):
    """All stop at 30 s, counted from the first sample, not from the start of the burn-in."""
    model = with_effects({"tired": {}})

    xy, _ = simulate_tracks(model, two_rooms, n_agents=2, n_steps=200, seed=3, sampler=sampler)

    moved = np.linalg.norm(np.diff(xy, axis=0), axis=-1)
    assert (moved[:149] > 0).all()
    assert (moved[151:] == 0).all()


@SAMPLERS
def test_a_sight_factor_hides_a_neighbour_from_one_observer(sampler, with_effects, two_rooms):
    """Agent 0 sees half of agent 1; agent 1 sees agent 0 as before."""
    half = with_effects({"blind-to": {"p2": 0.5}})
    weaker = with_effects({})
    weaker = dataclasses.replace(
        weaker, zones=tuple(dataclasses.replace(z, alpha=z.alpha / 2) for z in weaker.zones)
    )
    state = {"xy_m": ROOM["xy_m"], "heading_rad": [0.0, 3.0], "speed_m_s": 0.05}

    for model, agent in ((weaker, 0), (with_effects({}), 1)):
        _, expected = heading_density(model, two_rooms, agent=agent, **state)
        theta, found = heading_density(half, two_rooms, agent=agent, **state)
        assert found == pytest.approx(expected)
        drawn = draw_headings(
            half, two_rooms, n=40_000, seed=4, sampler=sampler, agent=agent, **state
        )
        cumulative = np.concatenate([[0], np.cumsum((expected[1:] + expected[:-1]) / 2)])
        law = np.interp(drawn, theta, cumulative / cumulative[-1])
        assert stats.kstest(law, "uniform").pvalue > 1e-4


def test_a_sight_factor_reads_the_state_of_both(with_effects, two_rooms):
    """Of three others only the one farther along x that faces along x is left."""
    model = with_effects({"rightward": {}})
    here, right = (0.20, 0.77), (0.26, 0.80)
    xy = [here, right, (0.16, 0.82), (0.27, 0.74)]
    heading = [1.2, 0.5, 0.0, 2.5]

    _, found = heading_density(model, two_rooms, xy_m=xy, heading_rad=heading, speed_m_s=0.05)
    _, expected = heading_density(
        with_effects({}), two_rooms, xy_m=[here, right], heading_rad=[1.2, 0.5], speed_m_s=0.05
    )

    assert found == pytest.approx(expected)


def test_each_effect_gets_its_own_parameters(with_effects, two_rooms):
    """One of each kind together, none with its defaults: what each does alone, done at once."""
    settings = {
        "shun-zone": {"p0": 1.0, "p1": 0.0},
        "blind-to": {"p0": 1.0, "p1": 0.0},
        "slower": {"p0": 1.0, "p1": 0.25},
        "compass": {"p0": 0.5, "p1": 20.0, "p2": 0.5},
    }
    model = with_effects(settings, kappa_0=0.0)

    theta, found = heading_density(model, two_rooms, speed_m_s=0.0, agent=1, **ROOM)
    xy, _ = simulate_tracks(model, two_rooms, n_agents=2, n_steps=3000, seed=3)

    speed = np.linalg.norm(np.diff(xy, axis=0), axis=-1) / 0.2
    zone = two_rooms.zone_of(xy)
    assert speed[:, 0].max() > 0.17
    assert speed[:, 1].max() <= 0.05 + 1e-12
    # Nobody enters the corridor, and agent 1 sees nobody: the compass is all it has.
    assert not ((zone[1:] == 1) & (zone[:-1] != 1)).any()
    expected = (1 / (2 * math.pi) + stats.vonmises(20.0, loc=0.5).pdf(theta) / 2) / 1.5
    assert found == pytest.approx(expected, abs=1e-6)


def test_models_of_a_population_have_their_own_effects_parameters(with_effects, two_rooms):
    """Speed factors 1, 0.5 and 0: slowest bins hold what they should."""
    models = [with_effects({"slower": {"p1": factor}}) for factor in (1.0, 0.5, 0.0)]

    speed = simulate_counts(
        pack(models, two_rooms), two_rooms, n_agents=3, n_steps=800, seeds=np.array([5], np.uint64)
    ).speed.sum(axis=(1, 2))

    assert speed[0, 5:].sum() > 0
    assert speed[1, 5:].sum() == 0
    assert speed[1, 3:].sum() > 0
    assert speed[2, 1:].sum() == 0


def test_models_with_other_effects_do_not_mix(with_effects, two_rooms):
    """A population has one set of effects."""
    with pytest.raises(InputError, match="same effects"):
        pack([with_effects({}), with_effects({"tired": {}})], two_rooms)

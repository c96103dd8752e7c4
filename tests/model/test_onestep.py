"""One step: the density against a plain twin, the two samplers against each other."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from scipy import stats

from zfcal.errors import InputError
from zfcal.model.onestep import draw_headings, heading_density

SPEED_M_S = 0.09


def test_the_density_is_the_twins_state_by_state(hard_state, twin, two_rooms, model):
    """At every angle of the grid, in every hard state."""
    xy, heading = hard_state

    theta, found = heading_density(
        model, two_rooms, xy_m=xy, heading_rad=heading, speed_m_s=SPEED_M_S
    )
    plain_theta, plain = twin.density(0, xy, heading, SPEED_M_S, model, two_rooms)

    assert theta == pytest.approx(plain_theta)
    assert found == pytest.approx(plain, abs=2e-4 * plain.max())


@pytest.mark.slow
@pytest.mark.parametrize("sampler", ["exact", "grid"])
def test_draws_follow_the_twins_density(hard_state, sampler, twin, two_rooms, model):
    """Chi-square over 60 angles with 100,000 draws, at p > 1e-4.

    The grid has 7,200 angles here: with the default 360 it smears each cliff of
    the density (a wall, a border of zones) over a degree, which so many draws
    do notice; the exact sampler has no such error.

    Power: were one draw in fifty taken from the uniform law instead, the
    expected statistic would exceed the 99.99 % point in each of these states
    (computed below as the noncentral distribution's power, at least 99 %).
    """
    xy, heading = hard_state
    n = 100_000

    drawn = draw_headings(
        model, two_rooms, xy_m=xy, heading_rad=heading, speed_m_s=SPEED_M_S, n=n, seed=11,
        sampler=sampler, grid=7200,
    )  # fmt: skip
    edges, share = _cell_shares(twin, xy, heading, two_rooms, model)
    seen = np.histogram(drawn, bins=edges)[0]
    expected, seen = _pool(share * n, seen)

    statistic = ((seen - expected) ** 2 / expected).sum()
    freedom = len(expected) - 1
    assert stats.chi2.sf(statistic, freedom) > 1e-4
    wrong = 0.98 * expected + 0.02 * n / len(expected)
    shift = ((wrong - expected) ** 2 / expected).sum()
    assert stats.ncx2.sf(stats.chi2.isf(1e-4, freedom), freedom, shift) > 0.99


def _cell_shares(twin, xy, heading, arena, model):
    """Return 61 edges and the twin's probability of each cell, from 7,200 angles."""
    theta, density = twin.density(0, xy, heading, SPEED_M_S, model, arena, n=7200)
    steps = (density[1:] + density[:-1]) / 2 * np.diff(theta)
    share = steps.reshape(60, 120).sum(axis=1)
    return np.linspace(-math.pi, math.pi, 61), share / share.sum()


def _pool(expected, seen):
    """Put cells with fewer than ten expected draws into one."""
    rare = expected < 10
    if rare.any():
        expected = np.append(expected[~rare], expected[rare].sum())
        seen = np.append(seen[~rare], seen[rare].sum())
        if expected[-1] < 10:
            expected[-2] += expected[-1]
            seen[-2] += seen[-1]
            expected, seen = expected[:-1], seen[:-1]
    return expected, seen


def test_no_heading_lands_outside(hard_state, two_rooms, model):
    """Both samplers, at the largest speed of the histogram."""
    xy, heading = hard_state
    for sampler in ("exact", "grid"):
        drawn = draw_headings(
            model, two_rooms, xy_m=xy, heading_rad=heading, speed_m_s=0.2, n=5000, seed=1,
            sampler=sampler,
        )  # fmt: skip
        landing = np.asarray(xy[0]) + 0.04 * np.column_stack([np.cos(drawn), np.sin(drawn)])
        assert (two_rooms.zone_of(landing) > 0).all()


def test_a_fish_with_nowhere_to_go_has_no_heading(two_rooms, model):
    """A step of 3 m leaves the tank in every direction."""
    for sampler in ("exact", "grid"):
        drawn = draw_headings(
            model, two_rooms, xy_m=[(0.2, 0.8)], heading_rad=[0.0], speed_m_s=15.0, n=3, seed=1,
            sampler=sampler,
        )  # fmt: skip
        assert np.isnan(drawn).all()


def test_where_attraction_is_zero_nobody_goes(two_rooms, model):
    """From the centre, with no attraction to the walls zone: no draw lands there."""
    zones = tuple(
        dataclasses.replace(zone, gamma={"corridor": 1.0, "walls": 0.0, "centre": 1.0})
        for zone in model.zones
    )
    shy = dataclasses.replace(model, zones=zones)
    at = np.array([0.13, 0.80])

    drawn = draw_headings(
        shy, two_rooms, xy_m=[at], heading_rad=[math.pi], speed_m_s=0.1, n=4000, seed=2
    )

    landing = at + 0.02 * np.column_stack([np.cos(drawn), np.sin(drawn)])
    assert set(np.unique(two_rooms.zone_of(landing))) == {3}


def test_an_agent_outside_is_refused(two_rooms, model):
    """One clear error."""
    with pytest.raises(InputError, match="inside the arena"):
        heading_density(model, two_rooms, xy_m=[(0, 0)], heading_rad=[0.0], speed_m_s=0.1)

"""Headings under an envelope of sectors: the bound holds, and the law is that of rejection."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from scipy import stats

from zfcal.model.kernels.compiled import kernel
from zfcal.model.kernels.heading import PATIENCE
from zfcal.model.kernels.looking import look
from zfcal.model.kernels.mixture import gather
from zfcal.model.kernels.perception import make_sight
from zfcal.model.kernels.sectors import draw_in_sectors, open_sectors
from zfcal.model.kernels.state import (
    SECTORS,
    make_work,
)
from zfcal.model.onestep import _prepare, draw_headings

SPEED_M_S = 0.19
STAYS = 1e-3
BORDERS = {
    "along a wall, the centre just within reach": (
        [(0.086, 0.80), (0.086, 0.87), (0.08, 0.70)],
        [1.57, 1.57, 1.57],
    ),
    "leaving the walls behind": ([(0.136, 0.80), (0.20, 0.80), (0.25, 0.82)], [0.0, 0.0, 3.0]),
    "alone, leaving the walls behind": ([(0.134, 0.80)], [0.3]),
}


@pytest.fixture(params=BORDERS, ids=lambda name: name.replace(" ", "-"))
def border(request):
    """Return positions and headings where the zone that attracts is hardly ever hit."""
    return BORDERS[request.param]


@pytest.fixture(scope="module")
def restless(model):
    """Return a model that as good as never stays in its zone."""
    return dataclasses.replace(
        model,
        zones=tuple(
            dataclasses.replace(
                zone, gamma={name: STAYS if name == zone.name else 1.0 for name in zone.gamma}
            )
            for zone in model.zones
        ),
    )


def opened(model, arena, state):
    """Return all that a draw in sectors needs, for agent 0."""
    xy, heading = state
    state, packed, tank = _prepare(model, arena, xy, heading, 0)
    work, sight = make_work(state.shape[1], len(packed.components), 3600), make_sight(len(xy) ** 2)
    reach = SPEED_M_S * packed.dt_s
    found, total = _open(reach, state, packed, tank, sight, work)
    return found, total, reach, state, packed, tank, sight, work


@kernel
def _open(reach, state, packed, tank, sight, work):
    look(state, 0, packed, sight)
    count, _ = gather(0, state, 0, packed, sight, work)
    return open_sectors(0, reach, 1.0, state, 0, packed, tank, work, count)


@kernel
def _draw(n, seed, reach, found, total, state, packed, tank, work):
    random = np.array([seed, 2, 3, 4], dtype=np.uint64)
    theta, tried = np.empty(n), 0
    for k in range(n):
        tried += 1
        while not draw_in_sectors(0, reach, (found, total), state, 0, packed, tank, random, work):
            tried += 1
        theta[k] = math.atan2(work.moves[0, 1], work.moves[0, 0])
    return theta, tried


def truth(twin, state, model, arena, theta):
    """Return the mixture times the attraction, not scaled to one, by the slow formulas."""
    xy, heading = state
    zone = model.zones[int(arena.zone_of(np.asarray(xy[0]))) - 1]
    directions = np.column_stack([np.cos(theta), np.sin(theta)])
    landing = arena.zone_of(np.asarray(xy[0]) + SPEED_M_S * model.dt_s * directions)
    gain = np.array([0.0] + [zone.gamma[name] for name in arena.zone_names])[landing]
    parts = twin.mixture(0, xy, heading, model, arena)
    return sum(weight * twin.von_mises(theta, mu, kappa) for weight, mu, kappa in parts), gain


@pytest.mark.slow
@pytest.mark.parametrize("sharpness", [0.0, 1.0, 30.0])
def test_no_heading_of_a_sector_is_likelier_than_its_bound(
    hard_state, sharpness, twin, two_rooms, restless
):
    """At 200 headings of each sector, from round laws to sharp ones."""
    zones = tuple(
        dataclasses.replace(
            zone, kappa_0=sharpness * zone.kappa_0, kappa_f=sharpness * zone.kappa_f
        )
        for zone in restless.zones
    )
    model = dataclasses.replace(restless, zones=zones)
    work = opened(model, two_rooms, hard_state)[-1]

    theta = np.linspace(0.0, 2 * math.pi, 200 * SECTORS, endpoint=False)
    density, gain = truth(twin, hard_state, model, two_rooms, theta)

    found = (density * gain).reshape(SECTORS, 200).max(axis=1)
    assert (work.sectors[2] >= found).all()


@pytest.mark.slow
def test_draws_in_sectors_follow_the_law(border, twin, two_rooms, restless):
    """Chi-square over 60 angles with 80,000 draws, at p > 1e-4.

    Power: were one draw in fifty uniform over all admissible headings, it would be seen in
    99 of 100 runs (noncentral chi-square). At least one proposal of twelve is taken.
    """
    found, total, reach, state, packed, tank, _, work = opened(restless, two_rooms, border)
    n = 80_000

    theta, tried = _draw(n, 11, reach, found, total, state, packed, tank, work)

    seen, expected = shares(theta, twin, border, restless, two_rooms)
    statistic = ((seen - expected * n) ** 2 / (expected * n)).sum()
    limit = stats.chi2.isf(1e-4, len(seen) - 1)
    assert statistic < limit
    wrong = 0.98 * expected + 0.02 / len(expected)
    shift = n * ((wrong - expected) ** 2 / expected).sum()
    assert stats.ncx2.sf(limit, len(seen) - 1, shift) > 0.99
    assert tried <= 12 * n


def shares(theta, twin, state, model, arena):
    """Return draws and expected share of each of 60 angles with an expectation of 1e-3 or more."""
    fine = np.linspace(-math.pi, math.pi, 14401)
    density, gain = truth(twin, state, model, arena, fine)
    value = density * gain
    cells = (0.5 * (value[1:] + value[:-1])).reshape(60, 240).sum(axis=1)
    cells /= cells.sum()
    seen = np.histogram(theta, bins=np.linspace(-math.pi, math.pi, 61))[0]
    rare = cells < 1e-3
    both = [np.append(row[~rare], row[rare].sum()) for row in (seen, cells)]
    return [row[: -1 if both[1][-1] == 0 else None] for row in both]


def test_a_fish_that_is_rejected_goes_on_in_sectors_with_the_same_law(
    border, twin, two_rooms, restless
):
    """Chi-square of 80,000 whole draws, most of which end in sectors."""
    xy, heading = border
    fine = np.linspace(-math.pi, math.pi, 7201)
    density, gain = truth(twin, border, restless, two_rooms, fine)
    taken = np.trapezoid(density * gain, fine) / np.trapezoid(density, fine)
    assert (1.0 - taken) ** PATIENCE > 0.5
    n = 80_000

    theta = draw_headings(
        restless, two_rooms, xy_m=xy, heading_rad=heading, speed_m_s=SPEED_M_S, n=n, seed=7
    )

    seen, expected = shares(theta, twin, border, restless, two_rooms)
    statistic = ((seen - expected * n) ** 2 / (expected * n)).sum()
    assert statistic < stats.chi2.isf(1e-4, len(seen) - 1)

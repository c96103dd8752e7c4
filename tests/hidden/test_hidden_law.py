"""The second simulator's base law is the model's, state by state."""

import json
import math

import numpy as np
import pytest

from hidden import geometry
from hidden.law import heading_density, natural, shifted, world_of
from hidden.worlds import geojson_of, rectangle, two_rooms
from zfcal.artifacts.arenas import load_arena
from zfcal.model.onestep import heading_density as zfcal_density
from zfcal.parameters import Parameters, ZoneParameters

ZONES = {1: "corridor", 2: "walls", 3: "centre"}


def as_zfcal(base, zones):
    """Return the second simulator's parameters as zfcal's."""
    rows = tuple(
        ZoneParameters(
            name=ZONES[z],
            kappa_0=base.kappa_0[z],
            kappa_f=base.kappa_f[z],
            alpha=base.alpha[z],
            speed_frequency=tuple(base.speed[z]),
            gamma={ZONES[to]: base.gamma[z, to] for to in zones},
        )
        for z in zones
    )
    return Parameters(zones=rows, dt_s=0.2, fov_rad=base.fov_rad)


def states(tank, seed, n):
    """Yield positions, headings and a speed: agents anywhere inside, often close together."""
    rng, world = np.random.default_rng(seed), world_of(tank)
    low, high = tank.outline.min(axis=0), tank.outline.max(axis=0)

    def inside(around, spread):
        while True:
            point = rng.uniform(low, high) if around is None else rng.normal(around, spread)
            if geometry.zone_of(*point, world) > 0:
                return point

    for _ in range(n):
        first = inside(None, 0.0)
        xy = [first] + [inside(first, rng.choice([0.015, 0.05, 0.2])) for _ in range(4)]
        yield np.array(xy), rng.uniform(-math.pi, math.pi, 5), rng.uniform(0.01, 0.2)


@pytest.mark.slow
@pytest.mark.parametrize("make_tank", [two_rooms, rectangle])
@pytest.mark.parametrize("which", ["natural", "shifted"])
def test_the_base_law_is_the_model_in_every_state(make_tank, which, tmp_path):
    """In 120 states, by natural or shifted parameters, the densities agree up to their scale.

    They agree at every angle to a millionth; where a border of zones falls within a cell
    of either grid the sums differ by a share of that cell.
    """
    tank = make_tank()
    (tmp_path / "tank.geojson").write_text(json.dumps(geojson_of(tank)))
    arena = load_arena("tank.geojson", tmp_path)
    base = natural() if which == "natural" else shifted(np.random.default_rng(9000))
    parameters = as_zfcal(base, [1, 2, 3] if len(tank.corridor) else [2, 3])
    scales = []
    for xy, heading, speed in states(tank, 9000, 120):
        _, ours = heading_density(base, tank, xy_m=xy, heading_rad=heading, speed_m_s=speed)
        _, theirs = zfcal_density(parameters, arena, xy_m=xy, heading_rad=heading, speed_m_s=speed)
        # zfcal's odd angles are the middles of our cells.
        theirs = theirs[1:-1:2]
        both = (ours > 0) & (theirs > 0)
        ratio = ours[both] / theirs[both]
        assert np.array_equal(ours > 0, theirs > 0)
        np.testing.assert_allclose(ratio, np.median(ratio), rtol=1e-6)
        scales.append(np.median(ratio))
    assert np.abs(np.log(scales)).max() < 0.1
    assert np.median(np.abs(np.log(scales))) < 0.002

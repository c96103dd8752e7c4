"""The solid angle of a neighbour's body, and who is seen at all."""

from __future__ import annotations

import math

import numpy as np
import pytest

from zfcal.model.kernels.perception import make_sight, see

# Published with the model: neighbour's head straight ahead at d, for four headings.
pytestmark = pytest.mark.plain

VECTORS = {
    0.03: (0.173933, 0.168166, 0.095866, 0.072708),
    0.05: (0.052389, 0.048100, 0.037770, 0.030843),
    0.10: (0.011439, 0.009957, 0.009852, 0.008765),
    0.20: (0.002673, 0.002264, 0.002491, 0.002340),
    0.40: (0.000646, 0.000540, 0.000624, 0.000605),
}


def angles_of(dx, dy, heading, *, facing=0.0, fov=math.pi):
    """Return the solid angles of neighbours at offsets, for an observer that faces so."""
    dx, dy, heading = (np.atleast_1d(np.asarray(v, dtype=float)) for v in (dx, dy, heading))
    sight = make_sight(len(dx))
    sight.dx_m[:], sight.dy_m[:] = dx, dy
    sight.hx[:], sight.hy[:] = np.cos(heading), np.sin(heading)
    sight.ahead_m[:] = dx * math.cos(facing) + dy * math.sin(facing)
    see(sight, -2.0 if fov >= math.pi else math.cos(fov))
    return sight


@pytest.mark.parametrize("d", VECTORS)
def test_solid_angles_are_the_published_ones(d):
    """Heads at five distances, four headings, to the sixth decimal."""
    headings = np.radians([0, 45, 90, 180])

    found = angles_of(np.full(4, d), np.zeros(4), headings).angle_sr

    assert found == pytest.approx(VECTORS[d], abs=6e-7)


def test_solid_angles_agree_with_the_plain_formula_anywhere(twin):
    """Near and far, series and arc tangent: as the spherical triangles say."""
    rng = np.random.default_rng(5)
    reach = 10 ** rng.uniform(-2.6, -0.2, 400)
    bearing, heading = rng.uniform(-np.pi, np.pi, (2, 400))
    dx, dy = reach * np.cos(bearing), reach * np.sin(bearing)

    found = angles_of(dx, dy, heading).angle_sr
    plain = [
        twin.body_solid_angle((0, 0), (x, y), h) for x, y, h in zip(dx, dy, heading, strict=True)
    ]

    assert found == pytest.approx(plain, rel=1e-5)


def test_a_mirrored_neighbour_looks_as_large():
    """Reflection in the line of sight changes nothing."""
    left = angles_of([0.05, 0.11], [0.02, -0.03], [0.3, 2.0]).angle_sr
    right = angles_of([0.05, 0.11], [-0.02, 0.03], [-0.3, -2.0]).angle_sr

    assert left == pytest.approx(right, rel=1e-12)


def test_a_neighbour_behind_the_field_of_view_is_not_seen():
    """135 degrees to each side: 134 are seen, 136 are not."""
    bearings = np.radians([134, -134, 136, -136])

    sight = angles_of(
        0.1 * np.cos(bearings), 0.1 * np.sin(bearings), np.zeros(4), fov=math.radians(135)
    )

    assert (sight.angle_sr > 0).tolist() == [True, True, False, False]


def test_two_heads_at_one_place_do_not_see_each_other():
    """No direction can be told, so there is none."""
    assert angles_of([0.0], [0.0], [1.0]).angle_sr.tolist() == [0.0]


def test_a_neighbour_nearer_than_two_centimetres_is_swum_away_from():
    """The direction toward it turns round at 0.02 m."""
    sight = angles_of([0.019, 0.021], [0.0, 0.0], [0.0, 0.0])

    assert np.sign(sight.dx_m * sight.toward_per_m).tolist() == [-1.0, 1.0]

"""The shape of a fish."""

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from zfcal.virtual.images.bodies import FIN_SHARE, WIDTH_SHARE, Bodies, centroids, outlines_of

angles = st.floats(-3.1, 3.1)


def body(
    xy_m=(0.0, 0.0), heading_rad=0.0, length_m=0.04, bend_rad=0.0, wave_rad=0.0, phase_rad=0.0
):
    """Return one body; straight, along x, at the origin."""
    return Bodies(
        xy_m=np.array([xy_m], float),
        heading_rad=np.array([heading_rad]),
        length_m=np.array([length_m]),
        bend_rad=np.array([bend_rad]),
        wave_rad=np.array([wave_rad]),
        phase_rad=np.array([phase_rad]),
    )


def test_the_centroid_of_a_triangle_by_hand():
    """A third of the way up, whichever way round, wherever it lies."""
    triangle = np.array([[0.0, 0.0], [3.0, 0.0], [0.0, 3.0]])
    both = np.stack([triangle, triangle[::-1] + 1e3])
    np.testing.assert_allclose(centroids(both), [(1, 1), (1001, 1001)])


def test_a_straight_fish_has_its_length_and_width():
    """Four centimetres with the fin; symmetric about its heading, snout ahead."""
    outlines = outlines_of(body())
    silhouette, fin = outlines.silhouette_m[0], outlines.fin_m[0]
    everything = np.concatenate([silhouette, fin])
    assert np.ptp(everything[:, 0]) == pytest.approx(0.04, rel=1e-9)
    long_m = 0.04 * (1 - FIN_SHARE)
    assert np.ptp(silhouette[:, 0]) == pytest.approx(long_m, rel=1e-9)
    assert np.ptp(silhouette[:, 1]) == pytest.approx(long_m * WIDTH_SHARE, rel=0.02)
    np.testing.assert_allclose(outlines.left_m[0, :, 1], -outlines.right_m[0, :, 1], atol=1e-15)
    # The thick end is in front: it is nearer to the centroid.
    assert silhouette[:, 0].max() < -silhouette[:, 0].min()


@given(
    xy_m=st.tuples(st.floats(-1, 2), st.floats(-1, 2)),
    heading_rad=angles,
    bend_rad=st.floats(-1.1, 1.1),
    wave_rad=st.floats(0, 0.5),
    phase_rad=angles,
)
def test_the_silhouette_is_simple_and_centred(xy_m, heading_rad, bend_rad, wave_rad, phase_rad):
    """However it bends, its outline does not cross itself and its centroid is its position."""
    outlines = outlines_of(
        body(xy_m, heading_rad, 0.037, bend_rad=bend_rad, wave_rad=wave_rad, phase_rad=phase_rad)
    )
    polygon = shapely.Polygon(outlines.silhouette_m[0])
    assert polygon.is_valid
    found = polygon.centroid
    np.testing.assert_allclose((found.x, found.y), xy_m, atol=1e-9)


@given(heading_rad=angles, bend_rad=st.floats(-1, 1), phase_rad=angles)
def test_a_turned_fish_is_the_same_fish(heading_rad, bend_rad, phase_rad):
    """Turned with its heading, and mirrored with its bend."""
    given_ = {"bend_rad": bend_rad, "wave_rad": 0.3, "phase_rad": phase_rad}
    along_x = outlines_of(body(**given_)).silhouette_m[0]
    turned = outlines_of(body(heading_rad=heading_rad, **given_)).silhouette_m[0]
    c, s = np.cos(heading_rad), np.sin(heading_rad)
    np.testing.assert_allclose(turned, along_x @ np.array([[c, s], [-s, c]]), atol=1e-12)
    mirrored = outlines_of(body(bend_rad=-bend_rad, wave_rad=0.0)).silhouette_m[0]
    plain = outlines_of(body(bend_rad=bend_rad, wave_rad=0.0)).silhouette_m[0]
    np.testing.assert_allclose(mirrored, plain[::-1] * (1, -1), atol=1e-12)


def test_a_fish_that_turns_left_has_its_tail_on_the_left():
    """It curls along the circle that it swims: head and tail both left of the middle."""
    outlines = outlines_of(body(bend_rad=1.0))
    middle = (outlines.left_m[0] + outlines.right_m[0]) / 2
    trunk = middle[len(middle) // 2]
    assert middle[-1, 1] - trunk[1] > 0.002 - 0.02 * (middle[-1, 0] - trunk[0])
    ahead, behind = middle[0] - trunk, middle[-1] - trunk
    assert np.cross(np.append(behind, 0), np.append(ahead, 0))[2] != 0
    # Along the midline from tail to head the direction turns to the left.
    way = -np.diff(middle, axis=0)
    direction = np.unwrap(np.arctan2(way[:, 1], way[:, 0]))
    assert direction[0] > direction[-1]

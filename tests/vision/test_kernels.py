"""What is compiled gives what its formulas give: by hand, and as the plain code."""

import math

import cv2
import numpy as np
import pytest
from scipy.spatial.distance import cdist

from zfcal.vision import _kernels as k

RNG = np.random.default_rng(1)
PIXELS, WEIGHTS = RNG.uniform(0, 40, (60, 2)), RNG.uniform(0.1, 1, 60)
CASES = {
    "shades": (
        k.shades,
        (*(RNG.integers(0, high, (9, 7)).astype(np.uint8) for high in (2, 200, 200)), 3, 5),
    ),
    "moments": (k.moments, (PIXELS, WEIGHTS)),
    "nearest_squared": (k.nearest_squared, (PIXELS, PIXELS[:7] + 0.3)),
    "clusters": (k.clusters, (PIXELS, WEIGHTS, PIXELS[:3].copy(), 12)),
    "step_costs": (k.step_costs, (RNG.normal(size=(4, 3)), RNG.normal(size=(5, 4)), 0.8, 0.1)),
    "median_ratio": (
        k.median_ratio,
        (*(RNG.integers(0, 255, (40, 50)).astype(np.uint8) for _ in range(2)), 3, 5),
    ),
    "read_grid": (k.read_grid, (RNG.normal(size=(4, 5, 2)), RNG.uniform(-1, 5, (30, 2)))),
}


@pytest.mark.parametrize("name", CASES)
def test_compiled_is_plain(name):
    """The same from the compiled function and from the code that it was compiled from."""
    function, given = CASES[name]
    copies = [each.copy() if isinstance(each, np.ndarray) else each for each in given]

    compiled, plain = function(*given), getattr(function, "py_func", function)(*copies)

    if not isinstance(compiled, tuple):
        compiled, plain = (compiled,), (plain,)
    for one, other in zip(compiled, plain, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-12)


def test_shades_are_those_of_darker_pixels_in_the_mask():
    """Of four pixels one is masked, one is as bright as the tank, one brighter; one counts."""
    inside = np.array([[0, 1], [1, 1]], np.uint8)
    grey = np.array([[10, 100], [120, 25]], np.uint8)
    level = np.full((2, 2), 100, np.uint8)

    pixels, shares = k.shades(inside, grey, level, 30, 40)

    assert pixels.tolist() == [[31.0, 41.0]]
    assert shares.tolist() == [0.75]


def test_moments_are_those_of_opencv():
    """Area, centroid and second moments of a random image, and the axis of its covariance."""
    image = RNG.integers(0, 255, (20, 30)).astype(np.uint8)
    y, x = np.nonzero(image)
    told = cv2.moments(image)

    total, at_x, at_y, angle, (second, both, _) = k.moments(
        np.column_stack([x, y]).astype(float), image[y, x].astype(float)
    )

    assert total == told["m00"]
    assert (at_x, at_y) == pytest.approx((told["m10"] / total, told["m01"] / total))
    assert both * total == pytest.approx(told["mu20"] + told["mu02"])
    spread = np.array([[told["mu20"], told["mu11"]], [told["mu11"], told["mu02"]]]) / total
    axis = np.array([math.cos(angle), math.sin(angle)])
    assert second == pytest.approx(axis @ spread @ axis)
    assert second == pytest.approx(np.linalg.eigvalsh(spread)[-1])


def test_the_third_moment_points_to_the_thin_end():
    """Three pixels in a row, the one at the end light: by hand, and mirrored."""
    pixels = np.array([[0.0, 0.0], [1.0, 0.0], [5.0, 0.0]])
    weights = np.array([1.0, 1.0, 1.0])

    third = k.moments(pixels, weights)[4][2]
    mirrored = k.moments(pixels * [-1.0, 1.0], weights)[4][2]

    assert third == pytest.approx((-8 - 1 + 27) / 3)
    assert mirrored == pytest.approx(-third)


def test_distances_are_those_of_scipy():
    """To the nearest point, squared."""
    points = RNG.uniform(0, 40, (9, 2))

    found = k.nearest_squared(PIXELS, points)

    np.testing.assert_allclose(found, cdist(PIXELS, points).min(axis=1) ** 2)


def test_clusters_end_where_each_pixel_is_nearest_to_its_own_centre():
    """And each centre is the weighted middle of its pixels."""
    centres = PIXELS[:3].copy()

    whose = k.clusters(PIXELS, WEIGHTS, centres, 100)

    np.testing.assert_array_equal(whose, cdist(PIXELS, centres).argmin(axis=1))
    for cluster in range(3):
        own = whose == cluster
        middle = np.average(PIXELS[own], axis=0, weights=WEIGHTS[own])
        np.testing.assert_allclose(centres[cluster], middle)


def test_a_cluster_without_pixels_stays():
    """A centre far from all of them is left where it is."""
    centres = np.array([[20.0, 20.0], [1e3, 1e3]])

    whose = k.clusters(PIXELS, WEIGHTS, centres, 5)

    assert not whose.any()
    assert centres[1].tolist() == [1e3, 1e3]


def test_a_step_sideways_costs_more_than_one_ahead():
    """Ten ahead at a share of a half: 25; ten aside: 100; a turn by a right angle: its worth."""
    at = np.array([[0.0, 0.0, 0.0]])
    to = np.array([[10.0, 0.0, 0.0, 1.0], [0.0, 10.0, 0.0, 1.0], [0.0, 0.0, math.pi / 2, 0.0]])

    found = k.step_costs(at, to, 0.5, 3.0)

    assert found[0] == pytest.approx([25.0, 100.0, 3.0])


def test_a_clear_head_behind_costs_twice_a_right_angle():
    """An axis without a head may lie either way; one whose head is known may not."""
    at = np.array([[0.0, 0.0, 0.0]])
    to = np.array([[0.0, 0.0, math.pi, 0.0], [0.0, 0.0, math.pi, 1.0]])

    assert k.step_costs(at, to, 0.5, 3.0)[0] == pytest.approx([0.0, 6.0])


def test_costs_turn_with_the_scene():
    """All turned by an angle, they stay."""
    at, to = RNG.normal(size=(4, 3)), RNG.normal(size=(5, 4))
    turn = np.array([[math.cos(0.7), math.sin(0.7)], [-math.sin(0.7), math.cos(0.7)]])
    turned_at = np.column_stack([at[:, :2] @ turn, at[:, 2] + 0.7])
    turned_to = np.column_stack([to[:, :2] @ turn, to[:, 2] + 0.7, to[:, 3]])

    found, turned = (k.step_costs(*both, 0.8, 0.1) for both in ((at, to), (turned_at, turned_to)))

    np.testing.assert_allclose(found, turned)


def test_a_grid_is_read_between_its_points():
    """A plane is right everywhere, up to its last point; beyond it there is nothing."""
    column, row = np.meshgrid(np.arange(4.0), np.arange(5.0), indexing="ij")
    grid = np.stack([2 * column + row, column - 3 * row], axis=-1)
    at = np.array([[0.0, 0.0], [1.25, 3.5], [3.0, 4.0], [3.01, 1.0], [1.0, -0.01]])

    found = k.read_grid(grid, at)

    expected = np.column_stack([2 * at[:, 0] + at[:, 1], at[:, 0] - 3 * at[:, 1]])
    np.testing.assert_allclose(found[:3], expected[:3])
    assert np.isnan(found[3:]).all()


def test_chances_are_balanced():
    """Columns sum to one, rows to a thousandth, and nothing is below the least before that."""
    chance = RNG.uniform(0, 1, (5, 5))
    chance[2, 3] = 0.0

    k.balance(chance, 1e-6, 20)

    np.testing.assert_allclose(chance.sum(axis=0), 1.0)
    np.testing.assert_allclose(chance.sum(axis=1), 1.0, atol=1e-3)
    assert chance.min() > 0

"""What is compiled gives what its formulas give: by hand, and as the plain code."""

import math

import cv2
import numpy as np
import pytest
from scipy.spatial.distance import cdist
from scipy.stats import norm

from zfcal.cameras._kernels import median_ratio, read_grid
from zfcal.tracking import _beliefs as b
from zfcal.tracking import _kernels as k

RNG = np.random.default_rng(1)
PIXELS, WEIGHTS = RNG.uniform(0, 40, (60, 2)), RNG.uniform(0.1, 1, 60)
CASES = {
    "shades": (
        k.shades,
        (
            *(
                RNG.integers(0, high, size).astype(np.uint8)
                for high, size in ((2, (9, 7)), (200, (14, 12)), (200, (14, 12)))
            ),
            3,
            5,
        ),
    ),
    "outlasts_opening": (
        k.outlasts_opening,
        (*((RNG.uniform(0, 1, size) < 0.8).astype(np.uint8) for size in ((9, 9), (5, 4))), 2, 3),
    ),
    "moments": (k.moments, (PIXELS, WEIGHTS)),
    "weigh": (
        b.weigh,
        (
            RNG.uniform(0.1, 1, (3, 3)),
            np.array([0, 2]),
            *(RNG.uniform(0.1, 1, size) for size in ((2, 2), 3, (3, 2), 2, 2)),
            0.5,
            4.0,
        ),
    ),
    "learn": (
        b.learn,
        (
            np.eye(3),
            np.array([0, 2]),
            *(RNG.normal(size=size) for size in ((2, 2), 2)),
            np.array([3.0, 7.0, 9.0]),
            *(RNG.normal(size=size) for size in ((3, 2), 3)),
            np.ones(2),
            20.0,
            (0.8, 5.0, 8.0),
        ),
    ),
    "nearest_squared": (k.nearest_squared, (PIXELS, PIXELS[:7] + 0.3)),
    "clusters": (k.clusters, (PIXELS, WEIGHTS, PIXELS[:3].copy(), 12)),
    "step_costs": (k.step_costs, (RNG.normal(size=(4, 3)), RNG.normal(size=(5, 4)), 0.8, 0.1)),
    "median_ratio": (
        median_ratio,
        (*(RNG.integers(0, 255, (40, 50)).astype(np.uint8) for _ in range(2)), 3, 5),
    ),
    "read_grid": (read_grid, (RNG.normal(size=(4, 5, 2)), RNG.uniform(-1, 5, (30, 2)))),
}


@pytest.mark.parametrize("name", CASES)
def test_compiled_is_plain(name):
    """The same from the compiled function and from the code that it was compiled from."""
    function, given = CASES[name]
    copies = [each.copy() if isinstance(each, np.ndarray) else each for each in given]

    compiled, plain = function(*given), getattr(function, "py_func", function)(*copies)

    if not isinstance(compiled, tuple):
        compiled, plain = (compiled,), (plain,)
    for one, other in zip((*compiled, *given), (*plain, *copies), strict=True):
        if one is not None:
            np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-12)


def test_shades_are_those_of_darker_pixels_in_the_mask():
    """Of four pixels one lies beside the mask, one is as bright as the tank, one brighter."""
    inside = np.array([[0, 0], [0, 0], [0, 1], [1, 1]], np.uint8)
    grey, level = (np.full((44, 33), value, np.uint8) for value in (255, 100))
    grey[42:, 30:32] = [[10, 100], [120, 25]]

    pixels, shares = k.shades(inside, grey, level, 30, 40)

    # The pixel that is not in the mask lies beside it.
    assert pixels.tolist() == [[30.0, 42.0], [31.0, 43.0]]
    assert shares.tolist() == [0.9, 0.75]


def test_shades_reach_a_pixel_beside_the_mask_and_stay_in_the_image():
    """By OpenCV's dilation with a cross, for parts in the middle and in each corner."""
    grey, level = (RNG.integers(0, 200, (20, 30)).astype(np.uint8) for _ in range(2))
    cross = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (3, 3))
    for left, top in ((7, 5), (0, 0), (22, 12)):
        inside = (RNG.uniform(0, 1, (8, 8)) < 0.2).astype(np.uint8)
        part = np.s_[top : top + 8, left : left + 8]

        pixels, shares = k.shades(inside, grey, level, left, top)

        y, x = np.nonzero((cv2.dilate(inside, cross) > 0) & (grey[part] < level[part]))
        assert pixels.tolist() == [[a + left, b + top] for a, b in zip(x, y, strict=True)]
        tank = level[part][y, x].astype(float)
        assert shares.tolist() == ((tank - grey[part][y, x]) / tank).tolist()


def test_what_outlasts_an_opening_is_what_opencv_leaves():
    """A thousand random masks, thin and thick, also at the border of the image."""
    cross, found = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (3, 3)), []
    for share in np.repeat([0.2, 0.3, 0.4, 0.5], 250):
        mask = (RNG.uniform(0, 1, (9, 8)) < share).astype(np.uint8)
        inside = (RNG.uniform(0, 1, (9, 8)) < 0.3).astype(np.uint8)

        found.append(k.outlasts_opening(mask, inside, 0, 0))

        opened = cv2.morphologyEx(mask, cv2.MORPH_OPEN, cross)
        assert found[-1] == bool((opened & inside).any())
    assert 0.2 < np.mean(found) < 0.8


def test_a_part_of_a_mask_is_opened_with_what_is_around_it():
    """The middle of a cross that reaches out of the part by a pixel on each side."""
    mask = np.zeros((7, 7), np.uint8)
    mask[3, 2:5] = mask[2:5, 3] = 255
    part = np.ones((1, 1), np.uint8)

    assert k.outlasts_opening(mask, part, 3, 3)
    assert not k.outlasts_opening(mask, part, 2, 2)
    mask[3, 4] = 0
    assert not k.outlasts_opening(mask, part, 3, 3)


def test_a_look_speaks_by_the_laws_of_normal_numbers():
    """Two known identities, one measure apart by two spreads: log odds by scipy's densities."""
    chance, within, between = np.eye(2) / 2 + 0.25, np.array([0.01, 0.04]), np.array([0.09, 0.09])
    mean, n = np.array([[0.0, 1.0], [0.2, 1.0]]), np.array([8.0, 8.0])
    before = chance.copy()
    seen = np.array([[0.05, 1.1]])

    b.weigh(chance, np.array([0]), seen, n, mean, within, between, 1.0, 4.0)

    sights = n[:, None] / within
    at = (mean.mean(axis=0) / between + sights * mean) / (1 / between + sights)
    law = norm(at, np.sqrt(within + 1 / (1 / between + sights)))
    wanted = np.diff(law.logpdf(seen).sum(axis=1))[0]
    assert np.diff(np.log(chance[0] / before[0]))[0] == pytest.approx(wanted)
    np.testing.assert_array_equal(chance[1], before[1])


def test_one_look_tells_so_much_at_most_and_half_a_look_half_of_it():
    """However far away an animal looks, its odds fall by the most that is allowed."""
    for weight in (1.0, 0.5):
        chance, mean = np.full((2, 2), 0.5), np.array([[0.0, 0.0], [9.0, 9.0]])
        some = np.array([5.0, 5.0]), mean, np.full(2, 0.01), np.ones(2)

        b.weigh(chance, np.array([1]), np.zeros((1, 2)), *some, weight, 4.0)

        assert np.log(chance[1, 0] / chance[1, 1]) == pytest.approx(4.0 * weight)
        assert chance[0].tolist() == [0.5, 0.5]


def test_a_look_is_learnt_by_whom_it_is_surely():
    """The third sighting moves the mean by a third; who is not sure learns nothing."""
    n, mean, length = np.array([2.0, 2.0]), np.zeros((2, 2)), np.zeros(2)
    chance, within = np.array([[0.9, 0.1], [0.4, 0.6]]), np.ones(2)
    looks = [np.array([0, 1]), np.full((2, 2), 0.3), np.full(2, 3.0)]

    counted = b.learn(chance, *looks, n, mean, length, within, 50.0, (0.85, 9.0, 100.0))

    np.testing.assert_allclose(mean, [[0.1, 0.1], [0.0, 0.0]])
    assert (n.tolist(), length.tolist(), counted) == ([3.0, 2.0], [1.0, 0.0], 50.0)
    np.testing.assert_array_equal(within, 1.0)


def test_the_spread_is_learnt_from_those_long_known_and_an_outlier_counts_little():
    """From the tenth sighting on the square is added, nine times the spread at most."""
    n, mean = np.array([9.0]), np.zeros((1, 2))
    within, looks = np.array([2.0, 2.0]), [np.array([0]), np.array([[0.1, 5.0]]), np.zeros(1)]

    counted = b.learn(np.eye(1), *looks, n, mean, np.zeros(1), within, 50.0, (0.8, 9.0, 20.0))

    np.testing.assert_allclose(within, [2.0 + 0.01, 2.0 + 9 * 2.0 / 50.0])
    np.testing.assert_allclose(mean, [[0.01, 0.5]])
    assert counted == 51.0


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

    found = read_grid(grid, at)

    expected = np.column_stack([2 * at[:, 0] + at[:, 1], at[:, 0] - 3 * at[:, 1]])
    np.testing.assert_allclose(found[:3], expected[:3])
    assert np.isnan(found[3:]).all()


def test_chances_are_balanced():
    """Columns sum to one, rows to a thousandth, and nothing is below the least before that."""
    chance = RNG.uniform(0, 1, (5, 5))
    chance[2, 3] = 0.0

    b.balance(chance, 1e-6, 20)

    np.testing.assert_allclose(chance.sum(axis=0), 1.0)
    np.testing.assert_allclose(chance.sum(axis=1), 1.0, atol=1e-3)
    assert chance.min() > 0

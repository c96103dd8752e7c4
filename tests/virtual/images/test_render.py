"""Drawn overhead images: where bodies lie in them, and what else they show."""

import cv2
import numpy as np
import pytest

from zfcal.arena import make_arena
from zfcal.cameras.camera import Homography
from zfcal.cameras.rig import overhead_camera, side_m
from zfcal.virtual.images.bodies import Bodies, outlines_of
from zfcal.virtual.images.look import CLEAN, HARD, USUAL, look_of
from zfcal.virtual.images.render import OverheadPainter
from zfcal.virtual.images.swimming import Moment

SEED = 5

PLAIN = look_of(
    CLEAN, {"tail_grey": 52.0, "stripe_grey": 0.0, "fin_opacity": 0.0, "fish_length_sd_m": 0.0}
)
"""Bodies of one grey without a fin: the darkness of a pixel is how much of it is covered."""


def moment_of(xy_m, *, number=0, robots=0, speed_m_s=0.0, seed=1, bent=True):
    """Return a moment with bodies at positions, in random postures."""
    rng = np.random.default_rng(seed)
    xy_m = np.asarray(xy_m, float)
    n = len(xy_m)
    heading = rng.uniform(-np.pi, np.pi, n)
    bodies = Bodies(
        xy_m=xy_m,
        heading_rad=heading,
        length_m=rng.uniform(0.033, 0.041, n),
        bend_rad=rng.uniform(-1, 1, n) * bent,
        wave_rad=rng.uniform(0, 0.5, n) * bent,
        phase_rad=rng.uniform(0, 6, n),
    )
    return Moment(
        number=number,
        time_s=number / 15,
        is_robot=np.arange(n) >= n - robots,
        bodies=bodies,
        velocity_m_s=speed_m_s * np.stack([np.cos(heading), np.sin(heading)], axis=1),
    )


def darkness(painter, moment):
    """Return how much darker than the empty tank each pixel is."""
    return painter.empty.astype(float) - painter.paint(moment)


def centroid_m(camera, weights):
    """Return the centroid of pixels by weight, in metres."""
    rows, columns = np.nonzero(weights)
    weight = weights[rows, columns]
    middle = np.array([columns @ weight, rows @ weight]) / weight.sum()
    return camera.to_metres(middle)


@pytest.fixture(scope="module")
def square():
    """Return a square tank of a metre."""
    import shapely

    return make_arena(name="square", outline=shapely.box(0, 0, 1, 1))


@pytest.mark.parametrize("speed_m_s", [0.0, 0.6])
def test_the_centroid_of_a_silhouette_is_the_position(square, speed_m_s):
    """To a tenth of a millimetre (a twentieth of a pixel) or so, bent or fast, all over."""
    camera = overhead_camera(square)
    painter = OverheadPainter(square, camera, PLAIN, seed=SEED)
    places = np.random.default_rng(2).uniform(0.06, 0.94, (40, 2))
    errors_mm = []
    for number, place in enumerate(places):
        moment = moment_of([place], number=number, seed=number, speed_m_s=speed_m_s)
        found = centroid_m(camera, darkness(painter, moment))
        errors_mm.append(1e3 * np.hypot(*(found - place)))
    assert max(errors_mm) < 0.2
    assert np.median(errors_mm) < 0.06


def test_centroids_have_no_bias(square):
    """Errors of either sign: their mean is a hundredth of a pixel at most."""
    camera = overhead_camera(square)
    painter = OverheadPainter(square, camera, PLAIN, seed=SEED)
    places = np.random.default_rng(3).uniform(0.2, 0.8, (60, 2))
    found = [
        centroid_m(camera, darkness(painter, moment_of([place], seed=number)))
        for number, place in enumerate(places)
    ]
    off_px = camera.to_pixels(np.array(found)) - camera.to_pixels(places)
    assert np.abs(off_px.mean(axis=0)).max() < 0.008


def test_the_contour_of_a_usual_fish_lies_where_it_swims(square):
    """What a tracker sees of it: whole dark pixels, off by half a millimetre in the median."""
    camera = overhead_camera(square)
    painter = OverheadPainter(square, camera, look_of(CLEAN), seed=SEED)
    errors_mm = []
    for number, place in enumerate(np.random.default_rng(4).uniform(0.1, 0.9, (40, 2))):
        dark = darkness(painter, moment_of([place], seed=number))
        mask = (dark > 25).astype(np.uint8)
        contours, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        assert len(contours) == 1
        found = camera.to_metres(np.mean(np.argwhere(mask)[:, ::-1], axis=0))
        errors_mm.append(1e3 * np.hypot(*(found - place)))
    assert np.median(errors_mm) < 0.5
    assert max(errors_mm) < 2.0


def test_a_body_covers_its_area(square):
    """As many square metres of dark pixels as the outline encloses, to 2 %."""
    camera = overhead_camera(square)
    painter = OverheadPainter(square, camera, PLAIN, seed=SEED)
    moment = moment_of([(0.5, 0.5)])
    dark = darkness(painter, moment)
    ring = camera.to_pixels(outlines_of(moment.bodies).silhouette_m[0]).astype(np.float32)
    area_px = cv2.contourArea(ring)
    assert dark.sum() / (PLAIN.floor_grey - PLAIN.fish_grey) == pytest.approx(area_px, rel=0.02)


def test_a_lure_lies_at_its_position(square):
    """Darker than the fish, with the same convention."""
    camera = overhead_camera(square)
    painter = OverheadPainter(square, camera, look_of(CLEAN), seed=SEED)
    moment = moment_of([(0.3, 0.6)], robots=1, bent=False)
    fish = painter.paint(moment_of([(0.3, 0.6)], bent=False))
    assert painter.paint(moment).min() < fish.min() - 5
    found = centroid_m(camera, darkness(painter, moment))
    np.testing.assert_allclose(found, (0.3, 0.6), atol=1e-4)


def test_crossing_fish_become_one_blob(square):
    """Two fish at one place are one dark patch with less area than both; apart they are two."""
    painter = OverheadPainter(square, overhead_camera(square), PLAIN, seed=SEED)

    def blobs(places):
        mask = (darkness(painter, moment_of(places, seed=3)) > 60).astype(np.uint8)
        return cv2.connectedComponents(mask)[0] - 1, int(mask.sum())

    together, apart = blobs([(0.5, 0.5), (0.502, 0.5)]), blobs([(0.5, 0.5), (0.6, 0.5)])
    assert together[0] == 1
    assert apart[0] == 2
    assert together[1] < apart[1]


def test_the_same_moment_gives_the_same_image(square):
    """Whatever was drawn before, and by whichever painter; another seed gives another."""
    look = look_of(USUAL)
    camera = overhead_camera(square)
    painter = OverheadPainter(square, camera, look, seed=SEED)
    moment = moment_of([(0.2, 0.3), (0.25, 0.3)], number=7)
    painter.paint(moment_of([(0.9, 0.9)], number=6))
    first = painter.paint(moment)
    same, other = (OverheadPainter(square, camera, look, seed=seed) for seed in (SEED, 6))
    assert np.array_equal(first, same.paint(moment))
    assert not np.array_equal(first, other.paint(moment))


def test_noise_is_as_strong_as_asked_for(square):
    """Between two frames of an empty tank, to 3 %, and without a pattern that stays."""
    look = look_of(CLEAN, {"noise_grey": 4.0})
    painter = OverheadPainter(square, overhead_camera(square), look, seed=SEED)
    empty = [painter.paint(moment_of(np.empty((0, 2)), number=n)) for n in range(12)]
    off = np.array(empty, float) - painter.empty
    inside = off[:, 100:400, 100:400]
    assert inside.std() == pytest.approx(4.0, rel=0.03)
    assert np.abs(inside.mean()) < 0.05
    assert inside.mean(axis=0).std() < 4.0 / np.sqrt(12) * 1.5


def test_a_shadow_falls_where_the_light_sends_it(square):
    """On the side of the offset, fainter than the fish."""
    look = look_of(
        CLEAN, {"shadow_opacity": 0.2, "shadow_offset_m": (0.03, 0.0), "shadow_blur_m": 0.002}
    )
    camera = overhead_camera(square)
    dark = darkness(OverheadPainter(square, camera, look, seed=SEED), moment_of([(0.5, 0.5)]))
    x, y = np.rint(camera.to_pixels(np.array([0.53, 0.5]))).astype(int)
    assert 10 < dark[y, x] < 0.25 * look.floor_grey
    x, y = np.rint(camera.to_pixels(np.array([0.47, 0.5]))).astype(int)
    assert dark[y, x] == 0


def test_a_wall_mirrors_who_is_near(square):
    """In the wall and nowhere else; nobody in the middle is mirrored."""
    look = look_of(CLEAN, {"reflection": 0.8})
    camera = overhead_camera(square)
    painter = OverheadPainter(square, camera, look, seed=SEED)
    plain = OverheadPainter(square, camera, look_of(CLEAN), seed=SEED)
    near, far = moment_of([(0.975, 0.5)], seed=2), moment_of([(0.5, 0.5)])
    extra = plain.paint(near).astype(float) - painter.paint(near)
    assert extra.max() > 20
    xs = camera.to_metres(np.argwhere(extra > 3)[:, ::-1].astype(float))[:, 0]
    assert xs.min() > 0.995
    assert np.array_equal(plain.paint(far), painter.paint(far))


def test_light_is_uneven_and_flickers_as_asked_for(square):
    """The darkest corner by its share; the mean of frames by a hundredth."""
    look = look_of(CLEAN, {"uneven_light": 0.3, "flicker": 0.02})
    painter = OverheadPainter(square, overhead_camera(square), look, seed=SEED)
    water = painter.empty[60:440, 60:440].astype(float)
    # The water ends short of the corner.
    assert 0.7 < water.min() / water.max() < 0.83
    means = [
        painter.paint(moment_of(np.empty((0, 2)), number=n))[100:400, 100:400].mean()
        for n in range(80)
    ]
    assert np.std(means) / np.mean(means) == pytest.approx(0.02, rel=0.25)


@pytest.mark.parametrize("preset", [CLEAN, USUAL, HARD])
def test_whoever_leaves_the_image_is_cut_off(square, preset):
    """A body at the edge, or outside, breaks nothing."""
    camera = overhead_camera(square)
    painter = OverheadPainter(square, camera, look_of(preset), seed=SEED)
    places = camera.to_metres(np.array([[0.0, 0.0], [499.0, 250.0], [250.0, 530.0], [-40.0, 9.0]]))
    image = painter.paint(moment_of(places, robots=1))
    assert image.shape == (500, 500)
    assert image.dtype == np.uint8


def test_a_photograph_serves_as_the_empty_tank(square):
    """In the camera's size and grey, whatever it was."""
    camera = overhead_camera(square)
    photo = np.random.default_rng(1).integers(90, 200, (512, 640, 3)).astype(np.uint8)
    painter = OverheadPainter(square, camera, look_of(CLEAN), seed=SEED, photograph=photo)
    assert painter.empty.shape == (500, 500)
    image = painter.paint(moment_of([(0.5, 0.5)]))
    assert (image != painter.empty).mean() < 0.01


def test_any_projection_serves(square):
    """Such as the homography of a tank's four corners."""
    side = side_m(square)
    grid = Homography(
        size_px=(200, 200),
        matrix=((side / 200, 0, -0.06), (0, -side / 200, 1.06), (0, 0, 1)),
    )
    image = OverheadPainter(square, grid, look_of(CLEAN), seed=1).paint(moment_of([(0.5, 0.5)]))
    assert image.shape == (200, 200)
    assert image[90:110, 90:110].min() < 140

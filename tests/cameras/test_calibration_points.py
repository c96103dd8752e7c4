"""Cameras from points of one plane."""

from __future__ import annotations

import dataclasses
import math

import cv2
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from zfcal.cameras.bundle import Freedom, _Problem, fit_views
from zfcal.cameras.calibration_points import LADDERS, calibrate_points, calibrate_pose
from zfcal.cameras.camera import Camera
from zfcal.cameras.pairs import Pairs
from zfcal.cameras.poses import View, fit_pose
from zfcal.errors import InputError

BOTH = pytest.mark.parametrize("name", ["overhead", "below"])


@BOTH
@pytest.mark.parametrize("n", [2, 4])
def test_the_pose_of_a_known_lens_is_found_exactly(rig, name, n):
    """From four points as from sixteen: a micrometre all over the tank."""
    camera = rig.cameras[name]
    found = calibrate_pose(camera.lens, rig.pairs_of(camera, n))
    assert rig.true_errors_mm(found.camera, camera).max() < 1e-3
    np.testing.assert_allclose(found.camera.rotation_rad, camera.rotation_rad, atol=1e-6)
    np.testing.assert_allclose(found.camera.translation_m, camera.translation_m, atol=1e-6)


@BOTH
def test_noise_of_a_third_of_a_pixel_leaves_less_than_a_millimetre(rig, name):
    """Sixteen points, twelve draws: the error all over the tank, median and nearly largest."""
    camera = rig.cameras[name]
    errors = [
        rig.true_errors_mm(
            calibrate_pose(camera.lens, rig.pairs_of(camera, 4, noise_px=0.3, seed=seed)).camera,
            camera,
        )
        for seed in range(12)
    ]
    assert np.median(errors) < 0.7
    assert np.percentile(errors, 99) < 3.0


@BOTH
def test_points_left_out_tell_the_noise(rig, name):
    """With 0.3 px of noise each coordinate, a point left out is off by about that, in mm."""
    camera = rig.cameras[name]
    result = calibrate_pose(camera.lens, rig.pairs_of(camera, 6, noise_px=0.3)).result()
    assert 0.25 < result["error_px"]["rms"] < 0.6
    assert result["error_mm"]["rms"] < result["left_out_mm"]["rms"] < 3.5


@example(tilt=0.0, around=0.0, turn=1.2890625, away_m=0.75)  # the other pose ends in the plane
@given(
    tilt=st.floats(0.0, 0.6),
    around=st.floats(-math.pi, math.pi),
    turn=st.floats(-math.pi, math.pi),
    away_m=st.floats(0.7, 2.5),
)
@settings(max_examples=25)
def test_any_pose_is_found(rig, tilt, around, turn, away_m):
    """From above, however tipped and turned: the other pose that a plane has is told apart."""
    down = np.diag([1.0, -1.0, -1.0])
    tip = cv2.Rodrigues(tilt * np.array([math.cos(around), math.sin(around), 0.0]))[0]
    rotation = tip @ down @ cv2.Rodrigues(np.array([0, 0, turn]))[0]
    translation = np.array([0, 0, away_m]) - rotation @ np.array([0.5, 0.5, 0.0])
    camera = Camera.of(rig.overhead.lens, cv2.Rodrigues(rotation)[0], translation)
    m = rig.square(4)
    found = fit_pose(camera.lens, View(px=camera.to_pixels(m), m=m))
    np.testing.assert_allclose(found.to_pixels(m), camera.to_pixels(m), atol=1e-5)


@BOTH
def test_a_camera_of_which_nothing_is_known_is_fitted(rig, name):
    """25 points with 0.3 px of noise: a millimetre inside the points, whatever the lens is."""
    camera = rig.cameras[name]
    found = calibrate_points(rig.pairs_of(camera, 5, noise_px=0.3, seed=3))
    errors_mm = rig.true_errors_mm(found.camera, camera, low=0.05, high=0.95)
    assert np.median(errors_mm) < 1.0
    assert errors_mm.max() < 4.0
    assert found.result()["left_out_mm"]["median"] < 2.5


def test_few_points_get_a_simple_lens_and_a_sentence(rig):
    """Four: a homography; nine: no more numbers than leave four to judge by."""
    four = calibrate_points(rig.pairs_of(rig.overhead, 2, noise_px=0.3))
    assert four.method == "homography"
    assert any("support no lens" in note for note in four.notes)
    nine = calibrate_points(rig.pairs_of(rig.below, 3, noise_px=0.3))
    assert 18 - nine.n_parameters >= 4


@pytest.mark.slow
def test_a_plain_pinhole_needs_no_distortion(rig):
    """The simplest model within a standard error of the best is taken: mostly the true one."""
    plain = dataclasses.replace(rig.overhead, distortion=())
    methods = [
        calibrate_points(rig.pairs_of(plain, 4, noise_px=0.3, seed=seed), model="pinhole").method
        for seed in range(4)
    ]
    assert methods.count("pinhole, no distortion") >= 2


@pytest.mark.slow
def test_a_focal_length_that_cannot_be_known_is_said_to_be_so(rig):
    """A plane seen straight on: any focal length will do, and the positions are right."""
    straight = dataclasses.replace(
        rig.overhead, rotation_rad=(math.pi, 0, 0), distortion=(-0.2, 0, 0, 0, 0)
    )
    found = calibrate_points(rig.pairs_of(straight, 5, noise_px=0.2), model="pinhole")
    assert any("focal length is known to" in note for note in found.notes)
    assert np.median(rig.true_errors_mm(found.camera, straight)) < 0.7


def test_a_mistyped_point_is_named_and_robust_sets_it_aside(rig):
    """5 cm off: named; with robust the others no longer suffer."""
    pairs = rig.pairs_of(rig.below, 4, noise_px=0.3)
    pairs.m[5] += [0.05, 0.0]
    plain = calibrate_pose(rig.below.lens, pairs)
    robust = calibrate_pose(rig.below.lens, pairs, robust=True)
    for found in (plain, robust):
        (note,) = found.notes
        assert note.startswith("Point 6 lies")
    plain_mm, robust_mm = (
        np.median(rig.true_errors_mm(found.camera, rig.below)) for found in (plain, robust)
    )
    assert robust_mm < 1.0 < plain_mm


def test_the_derivatives_are_those_of_the_residuals(rig):
    """Against central differences, for every rung of both ladders."""
    for camera, ladder in ((rig.overhead, LADDERS["pinhole"]), (rig.below, LADDERS["fisheye"])):
        pairs = rig.pairs_of(camera, 3, noise_px=1.0)
        views = (View(px=pairs.px, m=pairs.m), View(px=pairs.px[:5], m=pairs.m[:5]))
        for free in (*ladder, dataclasses.replace(ladder[-1], square=False)):
            problem = _Problem(views=views, size_px=camera.size_px, free=free)
            at = problem.packed(camera.lens, [camera, camera])
            steps = 1e-6 * np.eye(len(at))
            slopes = [
                (problem.residuals(at + step) - problem.residuals(at - step)) / 2e-6
                for step in steps
            ]
            np.testing.assert_allclose(
                problem.jacobian(at), np.transpose(slopes), rtol=1e-4, atol=1e-3
            )


def test_several_views_tell_the_lens(rig):
    """Without noise: to a tenth of a pixel, which the priors leave; no view seen straight on."""
    m = rig.square(5) * 0.2
    views = []
    for number in range(6):
        turn = np.array([0.4 * math.sin(number), 0.4 * math.cos(number), 0.2 * number])
        rotation = cv2.Rodrigues(turn)[0]
        shift = np.array([0, 0, 0.3]) - rotation @ np.array([0.1, 0.1, 0])
        camera = Camera.of(rig.overhead.lens, turn, shift)
        views.append(View(px=camera.to_pixels(m), m=m))
    free = Freedom(
        name="all", model="pinhole", coefficients=(0, 1, 2, 3, 4), centre=True, square=False
    )
    found = fit_views(views, (500, 500), free)
    np.testing.assert_allclose(found.lens.matrix, rig.overhead.matrix, atol=0.1)
    pixels = np.array([[250.0, 250.0], [400.0, 100.0], [60.0, 450.0]])
    np.testing.assert_allclose(
        found.lens.to_rays(pixels), rig.overhead.lens.to_rays(pixels), atol=1e-4
    )


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda p: p.without(0).without(0).without(0), "needs 4 points or more, got 1"),
        (lambda p: dataclasses.replace(p, m=np.column_stack([p.m[:, 0]] * 2)), "lie on a line"),
        (lambda p: dataclasses.replace(p, m=p.m * 1000), "span 900 m"),
        (lambda p: dataclasses.replace(p, size_px=(640, 480)), "500 x 500 images, the points are"),
    ],
)
def test_points_that_determine_nothing_are_refused(rig, change, says):
    """Too few, on a line, in millimetres, of another camera."""
    with pytest.raises(InputError, match=says):
        calibrate_pose(rig.overhead.lens, change(rig.pairs_of(rig.overhead, 2)))


def test_the_lens_of_another_camera_is_noticed(rig):
    """A narrow lens has no rays toward the corners of a wide one's image."""
    narrow = dataclasses.replace(
        rig.below.lens,
        model="pinhole",
        distortion=(-0.8, 0.0, 0.0, 0.0),
        matrix=((400.0, 0, 320.0), (0, 400.0, 240.0), (0, 0, 1)),
    )
    m = rig.square(4)
    px = np.stack([20 + 600 * m[:, 0], 20 + 440 * m[:, 1]], axis=-1)
    with pytest.raises(InputError, match="no ray of this lens reaches pixel"):
        calibrate_pose(narrow, Pairs(px=px, m=m, size_px=(640, 480)))

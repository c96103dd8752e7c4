"""Boards: drawn, found in images of known cameras, and the lens that they tell."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from zfcal.cameras.boards import Board, _right_way_round, draw_board, find_board
from zfcal.cameras.calibration_boards import calibrate_lens, coverage
from zfcal.cameras.poses import View
from zfcal.errors import InputError

CHESS = Board(columns=9, rows=6, square_m=0.02)
CHARUCO = Board(columns=9, rows=6, square_m=0.02, charuco=True)
FAR_M = {"overhead": (0.25, 0.6), "below": (0.12, 0.3)}
BOTH = pytest.mark.parametrize("name", ["overhead", "below"])


def views_of(rig, name, n, *, noise_px=0.1, seed=1):
    """Return the corners of a board as a known camera sees them, without drawing it."""
    lens = rig.cameras[name].lens
    rng = np.random.default_rng(seed)
    m = CHESS.corners_m
    return [
        View(px=camera.to_pixels(m) + rng.normal(0, noise_px, m.shape), m=m)
        for camera in rig.held(lens, CHESS, n, far_m=FAR_M[name], seed=seed)
    ]


@BOTH
@pytest.mark.parametrize("board", [CHESS, CHARUCO])
def test_corners_are_found_to_a_fraction_of_a_pixel(rig, name, board):
    """In drawn images with noise and blur, through both lenses, each by its right place."""
    cameras = rig.held(rig.cameras[name].lens, board, 4, far_m=FAR_M[name], seed=3)
    found = [find_board(rig.board_image(board, camera), board) for camera in cameras]
    errors = [
        np.hypot(*(view.px - camera.to_pixels(view.m)).T)
        for view, camera in zip(found, cameras, strict=True)
        if view is not None
    ]
    assert len(errors) >= 3
    assert np.median(np.concatenate(errors)) < 0.2
    assert max(np.median(each) for each in errors) < 0.6


def test_a_board_turned_round_is_known_by_its_colours(rig):
    """Half a turn brings the corners onto each other, but not dark onto dark."""
    (camera,) = rig.held(rig.overhead.lens, CHESS, 1, far_m=(0.4, 0.5), seed=2)
    image = rig.board_image(CHESS, camera)
    upright, turned = find_board(image, CHESS), find_board(image[::-1, ::-1].copy(), CHESS)
    last = np.array(image.shape[::-1]) - 1
    np.testing.assert_allclose(turned.px, last - upright.px, atol=0.3)
    # OpenCV's newer finder sees to that itself, the older one does not.
    np.testing.assert_array_equal(_right_way_round(image, CHESS, upright.px[::-1]), upright.px)
    np.testing.assert_array_equal(_right_way_round(image, CHESS, upright.px), upright.px)


def test_a_board_that_is_not_there_is_not_found():
    """Grey, noise, and a board with other counts."""
    noise = np.random.default_rng(0).integers(0, 255, (240, 320)).astype(np.uint8)
    other = draw_board(Board(columns=5, rows=4, square_m=0.02), square_px=30)
    for image in (np.full((240, 320), 90, np.uint8), noise, other):
        assert find_board(image, CHESS) is None
        assert find_board(image, CHARUCO) is None


def test_a_charuco_board_may_be_seen_in_part():
    """The corners that are seen come with their own places."""
    face = draw_board(CHARUCO, square_px=40)
    part = find_board(np.ascontiguousarray(face[:, :300]), CHARUCO)
    assert 8 <= len(part.px) < 54
    np.testing.assert_allclose(part.px, (part.m / 0.02 + 2) * 40 - 0.5, atol=0.6)


def test_a_colour_image_will_do():
    """It is made grey."""
    face = cv2.cvtColor(draw_board(CHESS, square_px=30), cv2.COLOR_GRAY2BGR)
    found = find_board(face, CHESS)
    np.testing.assert_allclose(found.px, (found.m / 0.02 + 2) * 30 - 0.5, atol=0.2)


@BOTH
def test_the_lens_is_recovered(rig, name):
    """Twelve views with 0.1 px of noise: the focal length to three standard deviations or 0.5 %,
    rays inside the image to a thousandth.
    """
    lens = rig.cameras[name].lens
    found = calibrate_lens(views_of(rig, name, 12), lens.size_px, model=lens.model)
    focal_px, sd_px = found.lens.matrix[0][0], found.result["focal_sd_px"]
    assert abs(focal_px - lens.matrix[0][0]) < max(3.5 * sd_px, 0.005 * focal_px)
    width, height = lens.size_px
    pixels = np.array([[0.5 * width, 0.5 * height], [0.3 * width, 0.3 * height]])
    np.testing.assert_allclose(found.lens.to_rays(pixels), lens.to_rays(pixels), atol=2e-3)
    assert 0.08 < found.result["error_px"]["rms"] < 0.2
    assert found.result["error_mm"]["median"] < 0.2


def test_a_fish_eye_is_told_from_a_pinhole(rig):
    """By views left out."""
    found = calibrate_lens(views_of(rig, "below", 8), (640, 480))
    assert found.lens.model == "fisheye"


def test_a_bent_view_is_named(rig):
    """Its image is named, the others are not."""
    views = views_of(rig, "overhead", 9)
    bent = views[4].px + 1.5 * np.sin(np.arange(54))[:, None]
    views[4] = View(px=bent, m=views[4].m)
    names = [f"{number}.png" for number in range(9)]
    notes = calibrate_lens(views, (500, 500), model="pinhole", names=names).result["notes"]
    assert [note for note in notes if note.startswith("4.png")]
    assert not [note for note in notes if ".png" in note and not note.startswith("4.png")]


def test_few_views_in_the_middle_are_said_to_be_so(rig):
    """Three, covering little: two sentences of advice."""
    views = views_of(rig, "overhead", 3, seed=4)
    notes = calibrate_lens(views, (500, 500), model="pinhole").result["notes"]
    assert any("3 views are few" in note for note in notes)


def test_two_views_are_refused(rig):
    """They determine no lens."""
    with pytest.raises(InputError, match="needs 3 views of the board or more, got 2"):
        calibrate_lens(views_of(rig, "overhead", 2), (500, 500))


def test_coverage_by_hand():
    """One corner in one of 25 cells."""
    assert coverage(np.array([[10.0, 10.0], [12.0, 9.0]]), (500, 500)) == pytest.approx(1 / 25)

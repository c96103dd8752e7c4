"""From board images to the file of a lens, and of a camera where the board lies."""

from __future__ import annotations

import math

import cv2
import numpy as np
import pytest

from zfcal.artifacts.lineage import read_lineage
from zfcal.cameras.boards import Board, draw_board
from zfcal.cameras.calibration import seen_from
from zfcal.cameras.camera import PINHOLE, Camera
from zfcal.cameras.lens import Lens
from zfcal.errors import InputError
from zfcal.stages.camera.boards import BoardAt, BoardImages, make_from_boards
from zfcal.stages.camera.cameras import read_camera, read_lens, stated_side
from zfcal.stages.camera.making import CameraTask, Place
from zfcal.stages.events import LeftOut, Note, Result

BOARD = Board(columns=9, rows=6, square_m=0.02)
LENS = Lens(
    size_px=(500, 500),
    model=PINHOLE,
    matrix=((570.0, 0, 252.0), (0, 570.0, 247.0), (0, 0, 1)),
    distortion=(),
)
ABOVE = Camera.of(LENS, np.array([math.pi - 0.05, 0.03, 0.02]), np.array([-0.1, 0.1, 0.45]))
BELOW = Camera.of(LENS, np.array([0.05, -0.03, 0.1]), np.array([-0.1, -0.1, 0.45]))
SQUARE_PX = 40


def plane_of(camera):
    """Return the homography from the plane z = 0 to pixels."""
    rotation = cv2.Rodrigues(np.array(camera.rotation_rad))[0]
    columns = np.column_stack([rotation[:, 0], rotation[:, 1], camera.translation_m])
    return np.array(camera.matrix) @ columns


def picture(camera, onto=None):
    """Return the image of a board whose places a homography brings onto the camera's plane."""
    scale = BOARD.square_m / SQUARE_PX
    start = (0.5 / SQUARE_PX - 2) * BOARD.square_m
    board = np.array([[scale, 0, start], [0, scale, start], [0, 0, 1]])
    whole = plane_of(camera) @ (np.eye(3) if onto is None else onto) @ board
    face = draw_board(BOARD, square_px=SQUARE_PX)
    return cv2.warpPerspective(face, whole, camera.size_px, borderValue=120)


@pytest.fixture
def shots(tmp_path):
    """Write six images of a board held before the camera, and return their folder."""
    folder = tmp_path / "shots"
    folder.mkdir()
    middle = np.array([0.08, 0.05, 0.0])
    for number in range(6):
        turn = np.array([0.5 * math.sin(2 * number), 0.5 * math.cos(2 * number), 0.3 * number])
        away = np.array([0.05 * math.cos(number), 0.05 * math.sin(number), 0.35 + 0.02 * number])
        shift = away - cv2.Rodrigues(turn)[0] @ middle
        image = picture(Camera.of(LENS, turn, shift))
        cv2.imwrite(str(folder / f"{number}.png"), image)
    return folder


def made(path, given, **task):
    """Make a camera file, and return what was told."""
    told = []
    make_from_boards(Place(path=path), given, told.append, task=CameraTask(**task))
    return told


def test_a_folder_of_images_makes_a_lens(shots, tmp_path):
    """Its focal length to a percent, the images among its inputs; again: nothing to do."""
    path = tmp_path / "lens.toml"
    given = BoardImages(paths=(shots,), board=BOARD, model=PINHOLE)
    (result,) = [event.value for event in made(path, given) if isinstance(event, Result)]
    assert read_lens(path).matrix[0][0] == pytest.approx(570, rel=0.01)
    assert result["error_px"]["median"] < 0.2
    assert len(read_lineage(path).inputs) == 6
    before = path.stat().st_mtime_ns
    made(path, given)
    assert path.stat().st_mtime_ns == before


@pytest.mark.slow
@pytest.mark.parametrize(("camera", "face_down", "degrees"), [(ABOVE, False, 0), (BELOW, True, 35)])
def test_a_board_in_the_tank_gives_the_pose(shots, tmp_path, camera, face_down, degrees):
    """Face up for the camera above, on its face for the one below; places to a millimetre."""
    angle = math.radians(degrees)
    cos, sin = math.cos(angle), math.sin(angle)
    flip, y_m = (1.0, 0.0) if face_down else (-1.0, 0.12)
    onto = np.array([[cos, -sin * flip, 0.05], [sin, cos * flip, y_m], [0, 0, 1]])
    floor = tmp_path / "floor.png"
    cv2.imwrite(str(floor), picture(camera, onto))
    lies = BoardAt(image=floor, x_m=0.05, y_m=y_m, angle_rad=angle, face_down=face_down)
    path = tmp_path / "camera.toml"
    made(path, BoardImages(paths=(shots,), board=BOARD, model=PINHOLE, lies=lies))
    found = read_camera(path)
    places = np.array([[0.05, 0.1], [0.15, 0.05], [0.1, 0.15]])
    np.testing.assert_allclose(found.to_metres(camera.to_pixels(places)), places, atol=1e-3)
    assert seen_from(found) == ("below" if face_down else "above")
    assert stated_side(path) == ("below" if face_down else None)


def test_images_without_a_board_or_damaged_are_named_and_left_out(shots, tmp_path):
    """The others go on."""
    cv2.imwrite(str(shots / "empty.png"), np.full((500, 500), 120, np.uint8))
    (shots / "broken.png").write_bytes(b"\x89PNG\r\n")
    told = made(tmp_path / "lens.toml", BoardImages(paths=(shots,), board=BOARD, model=PINHOLE))
    assert any(isinstance(event, Note) and "empty.png" in event.text for event in told)
    assert any(isinstance(event, LeftOut) and "broken.png" in event.problem for event in told)
    assert (tmp_path / "lens.toml").exists()


def test_images_of_two_sizes_are_refused(shots, tmp_path):
    """Both are named."""
    cv2.imwrite(str(shots / "small.png"), np.full((240, 320), 120, np.uint8))
    with pytest.raises(InputError, match=r"differ in size: .*0\.png is 500 x 500 .*small\.png"):
        made(tmp_path / "lens.toml", BoardImages(paths=(shots,), board=BOARD))
    assert not (tmp_path / "lens.toml").exists()


@pytest.mark.slow
def test_a_floor_without_a_board_is_refused(shots, tmp_path):
    """The image is named."""
    floor = tmp_path / "floor.png"
    cv2.imwrite(str(floor), np.full((500, 500), 120, np.uint8))
    lies = BoardAt(image=floor, x_m=0, y_m=0, angle_rad=0)
    given = BoardImages(paths=(shots,), board=BOARD, model=PINHOLE, lies=lies)
    with pytest.raises(InputError, match=r"floor\.png: no 9x6 chessboard of 20 mm was found"):
        made(tmp_path / "camera.toml", given)

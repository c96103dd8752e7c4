"""Calibration boards: chessboards and ChArUco boards, drawn and found in images.

A ChArUco board's corners have numbers, so it may be seen in part, and it cannot be taken
for itself turned round. Of a chessboard all corners must be seen; which end is which its
colours tell when one side has an even number of corners and the other an odd one.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from zfcal.arrays import Floats
from zfcal.cameras.frames import Image
from zfcal.cameras.poses import View
from zfcal.errors import InputError

_LEAST_CORNERS = 8
"""Corners of a ChArUco board below which an image does not count."""

_MARKER_SHARE = 0.75
_DICTIONARY = "DICT_4X4_250"
_SMALLEST_SQUARE_M, _LARGEST_SQUARE_M = 0.001, 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class Board:
    """A board of squares.

    Parameters
    ----------
    columns, rows
        Inner corners along the board and across, as OpenCV counts: a chessboard of 10 by 7
        squares has 9 by 6.
    square_m
        Side of a square, in metres.
    charuco
        Whether the white squares hold markers (dictionary ``DICT_4X4_250``, as large as
        three quarters of a square).
    """

    columns: int
    rows: int
    square_m: float
    charuco: bool = False

    def __post_init__(self) -> None:
        if not (self.columns >= 3 and self.rows >= 3):
            raise InputError(
                f"A board needs 3 by 3 inner corners or more, got {self.columns} by {self.rows}.",
                hint="Count the corners where four squares meet: 10 by 7 squares have 9x6.",
            )
        if not _SMALLEST_SQUARE_M <= self.square_m <= _LARGEST_SQUARE_M:
            raise InputError(
                f"Squares of {self.square_m * 1000:g} mm are too small or too large for a board.",
                hint="Measure one side of a printed square, in millimetres.",
            )

    @property
    def name(self) -> str:
        """``9x6 chessboard of 25 mm``."""
        kind = "ChArUco board" if self.charuco else "chessboard"
        return f"{self.columns}x{self.rows} {kind} of {self.square_m * 1000:g} mm"

    @property
    def corners_m(self) -> Floats:
        """Inner corners on the board, row by row; shape (columns * rows, 2).

        Seen from its face, x runs along the columns and y, as in an image, down the rows.
        """
        across, down = np.meshgrid(np.arange(self.columns), np.arange(self.rows))
        return self.square_m * np.stack([across.ravel(), down.ravel()], axis=-1).astype(np.float64)


def draw_board(board: Board, *, square_px: int) -> Image:
    """Return a board with a white margin of one square; shape (height, width)."""
    across, down = board.columns + 1, board.rows + 1
    if board.charuco:
        size = (across * square_px, down * square_px)
        face = np.asarray(_charuco(board).generateImage(size, marginSize=0), np.uint8)
    else:
        light = np.add.outer(np.arange(down), np.arange(across)) % 2 == 1
        face = (255 * light).astype(np.uint8).repeat(square_px, axis=0).repeat(square_px, axis=1)
    return np.pad(face, square_px, constant_values=255)


def find_board(image: Image, board: Board) -> View | None:
    """Return the corners of a board in an image; None if it is not all there.

    Parameters
    ----------
    image
        Grey or colour.
    board
        What is looked for.
    """
    colours = image.ndim == 3
    grey = np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) if colours else image, np.uint8)
    return _find_charuco(grey, board) if board.charuco else _find_chessboard(grey, board)


def _find_chessboard(grey: Image, board: Board) -> View | None:
    pattern = (board.columns, board.rows)
    flags = cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_ACCURACY
    found, corners = cv2.findChessboardCornersSB(grey, pattern, flags=flags)
    if not found:
        found, corners = _find_adaptively(grey, pattern)
    if not found:
        return None
    px = np.asarray(corners, np.float64).reshape(-1, 2)
    return View(px=_right_way_round(grey, board, px), m=board.corners_m)


def _find_adaptively(grey: Image, pattern: tuple[int, int]) -> tuple[bool, Floats]:
    """Look again the older way, which bears more bending and less size."""
    flags = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE
    found, corners = cv2.findChessboardCorners(grey, pattern, flags=flags)
    if not found:
        return False, np.empty((0, 2))
    apart = np.diff(np.asarray(corners, np.float64).reshape(-1, 2)[: pattern[0]], axis=0)
    # A window of a third of a square never reaches the next corner.
    half = max(2, min(11, int(np.hypot(*apart.T).min() / 3)))
    until = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 60, 1e-4)
    fine = cv2.cornerSubPix(grey, corners, (half, half), (-1, -1), until)
    return True, np.asarray(fine, np.float64)


def _right_way_round(grey: Image, board: Board, px: Floats) -> Floats:
    """Return the corners such that the square before the first one is dark."""
    onto, _ = cv2.findHomography(board.corners_m, px)
    if onto is None:
        return px
    across, down = np.meshgrid(np.arange(board.columns + 1), np.arange(board.rows + 1))
    middles = board.square_m * (np.stack([across.ravel(), down.ravel()], axis=-1) - 0.5)
    places = cv2.perspectiveTransform(middles[:, None, :], onto).reshape(-1, 2)
    inside = ((places >= 0) & (places <= np.array(grey.shape[::-1]) - 1)).all(axis=1)
    columns, rows = np.round(places[inside]).astype(np.int64).T
    light = grey[rows, columns].astype(np.float64)
    dark = ((across + down).ravel() % 2 == 0)[inside]
    if not dark.any() or dark.all() or light[dark].mean() <= light[~dark].mean():
        return px
    return px[::-1]


def _find_charuco(grey: Image, board: Board) -> View | None:
    detector = cv2.aruco.CharucoDetector(_charuco(board))
    corners, numbers, _, _ = detector.detectBoard(grey)
    if numbers is None or len(numbers) < _LEAST_CORNERS:
        return None
    m = board.corners_m[np.ravel(numbers)]
    spread = np.linalg.svd(m - m.mean(axis=0), compute_uv=False)
    if not spread[1] > 0.05 * spread[0]:
        return None
    return View(px=np.asarray(corners, np.float64).reshape(-1, 2), m=m)


def _charuco(board: Board) -> cv2.aruco.CharucoBoard:
    return cv2.aruco.CharucoBoard(
        (board.columns + 1, board.rows + 1),
        board.square_m,
        _MARKER_SHARE * board.square_m,
        cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, _DICTIONARY)),
    )

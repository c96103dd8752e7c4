"""Blobs of a frame: what is darker than the empty tank and has corners.

The published way: foreground opened and closed, contours that hold a Shi-Tomasi corner are
animals, the corner end is the head. Which blob is whom, and blobs of several fish, are the
business of others. Pixels here have their origin in the centre of the top left pixel and y
down; angles turn from x towards y, as the eye sees them: clockwise.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from zfcal.arrays import Floats, Grey
from zfcal.tracking._kernels import outlasts_opening, shades
from zfcal.tracking.background import Background
from zfcal.tracking.blobs import FULL, Blob

_QUALITY = 0.01
_CORNERS_APART_PX = 5
_BLOCK_PX = 3
_HARRIS_K = 0.04
_MOST_CORNERS = 16

_KERNEL = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (3, 3))
_MARGIN_PX = 2
_NO_CORNERS = np.empty((0, 2))


@dataclass(frozen=True, slots=True, kw_only=True)
class Corners:
    """How corners are sought.

    Parameters
    ----------
    harris
        Harris' measure in place of Shi and Tomasi's.
    needed
        Whether a contour without a corner is dropped.
    """

    harris: bool = False
    needed: bool = True


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Contrast:
    """A frame compared with the empty tank.

    Parameters
    ----------
    grey : ndarray of uint8, shape (height, width)
        As bright as the background, its negative where fish are light.
    background
        The empty tank.
    mask : ndarray of uint8, shape (row, column)
        255 where it is not the tank, in a part of the image.
    corner
        Left and top of that part.
    inner : ndarray of uint8, shape (height, width), optional
        What is darker surely is animal.
    opened
        Whether, without ``inner``, what does not outlast opening is noise.
    """

    grey: Grey
    background: Background
    mask: Grey
    corner: tuple[int, int]
    inner: Grey | None = None
    opened: bool = True


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Limits:
    """Greys below which a pixel is animal.

    Parameters
    ----------
    outer : ndarray of uint8, shape (height, width)
        What is darker may be, if it hangs together with what surely is.
    inner : ndarray of uint8, shape (height, width), optional
        What is darker surely is; without, what is left of the foreground when it is opened.
    opened
        Whether it is opened; bodies less than three pixels wide would not outlast that.
    box
        Rows and columns that hold all of what may be, and two pixels more.
    """

    outer: Grey
    inner: Grey | None = None
    opened: bool = True
    box: tuple[slice, slice] = (slice(None), slice(None))


def compare(grey: Grey, background: Background, limits: Limits) -> Contrast:
    """Return what of an image is animal: opened and closed by a 3 x 3 ellipse.

    Bodies three pixels wide lose their tails when they are opened. So what is left of the
    opened foreground only tells which pieces count; their extent is that before.
    """
    mask = cv2.compare(grey[limits.box], limits.outer[limits.box], cv2.CMP_LT)
    return Contrast(
        grey=grey,
        background=background,
        mask=np.asarray(mask, np.uint8),
        corner=(limits.box[1].start or 0, limits.box[0].start or 0),
        inner=limits.inner,
        opened=limits.opened,
    )


def find_blobs(view: Contrast, *, min_blob_px: float, corners: Corners | None = None) -> list[Blob]:
    """Return the blobs of a frame, those with a corner where corners are asked for.

    Parameters
    ----------
    min_blob_px
        Smaller ones are dropped.
    corners
        How corners are sought; None for not at all.
    """
    closed = cv2.morphologyEx(view.mask, cv2.MORPH_CLOSE, _KERNEL)
    contours, _ = cv2.findContours(
        closed, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE, offset=view.corner
    )
    # OpenCV lists contours from the bottom of the image up; any fixed order would do.
    pieces = [_Piece(view, each) for each in contours if len(each) >= 4]
    whole = [piece for piece in pieces if piece.weigh(view) >= min_blob_px]
    if corners is None:
        return [piece.blob(_NO_CORNERS) for piece in whole]
    return _with_corners(view, whole, corners)


class _Piece:
    """What lies within a contour, cut out of the image."""

    __slots__ = (
        "box",
        "contour",
        "crop",
        "darkness",
        "inside",
        "left",
        "pixels",
        "shares",
        "top",
        "weights",
    )

    def __init__(self, view: Contrast, contour: cv2.typing.MatLike) -> None:
        x0, y0, width, height = self.box = cv2.boundingRect(contour)
        # A pixel wider: the edge of a body is a share of the pixels around its mask. And one
        # more: corners are sought by the slopes of greys.
        self.left, self.top = max(x0 - _MARGIN_PX, 0), max(y0 - _MARGIN_PX, 0)
        self.crop = np.s_[self.top : y0 + height + _MARGIN_PX, self.left : x0 + width + _MARGIN_PX]
        self.inside = np.zeros(view.grey[self.crop].shape, np.uint8)
        offset = (-self.left, -self.top)
        cv2.drawContours(self.inside, [contour], -1, 255, cv2.FILLED, offset=offset)
        self.contour = contour

    def weigh(self, view: Contrast) -> float:
        """Return how many pixels it covers, those along the edge in part.

        None where nothing of it is surely animal.
        """
        if not self._has_core(view):
            return 0.0
        level = view.background.level
        self.pixels, share = shades(self.inside, view.grey, level, self.left, self.top)
        if not len(share):
            return 0.0
        # Weighted by itself: the more of faint edge there is around a body, the same.
        self.darkness = float(share @ share / share.sum())
        self.shares, self.weights = share, np.minimum(share / (FULL * self.darkness), 1.0)
        return float(self.weights.sum())

    def _has_core(self, view: Contrast) -> bool:
        """Return whether something of it is surely not the tank; it is noise without."""
        if view.inner is None and not view.opened:
            return True
        if view.inner is None:
            left, top = view.corner
            return outlasts_opening(view.mask, self.inside, self.left - left, self.top - top)
        # Of three by three pixels: one of them alone is noise.
        mean = cv2.blur(view.grey[self.crop], (3, 3))
        dark = cv2.compare(mean, view.inner[self.crop], cv2.CMP_LT)
        return bool((np.asarray(dark, np.uint8) & self.inside).any())

    def corners(self, view: Contrast, how: Corners) -> tuple[Floats, Floats]:
        """Return corners, the strongest first, and their measures."""
        corners, quality = cv2.goodFeaturesToTrackWithQuality(
            np.ascontiguousarray(view.grey[self.crop]),
            _MOST_CORNERS,
            _QUALITY,
            _CORNERS_APART_PX,
            self.inside,
            blockSize=_BLOCK_PX,
            useHarrisDetector=how.harris,
            k=_HARRIS_K,
        )
        if corners is None or not len(corners):
            return _NO_CORNERS, np.empty(0)
        points = corners.reshape(-1, 2).astype(np.float64) + np.array((self.left, self.top))
        return points, np.asarray(quality, np.float64).ravel()

    def blob(self, corners: Floats) -> Blob:
        """Return it as it is told."""
        return Blob(
            pixels=self.pixels,
            weights=self.weights,
            shares=self.shares,
            darkness=self.darkness,
            contour=np.asarray(self.contour, np.int32).reshape(-1, 2),
            corners=corners,
            box=(self.box[0], self.box[1], self.box[2], self.box[3]),
        )


def _with_corners(view: Contrast, pieces: list[_Piece], how: Corners) -> list[Blob]:
    """Return the blobs with their corners; the best corner of all sets the threshold."""
    found = [piece.corners(view, how) for piece in pieces]
    best = max((quality[0] for _, quality in found if len(quality)), default=0.0)
    held = []
    for piece, (points, quality) in zip(pieces, found, strict=True):
        good = points[quality >= _QUALITY * best]
        if len(good) or not how.needed:
            held.append(piece.blob(good))
    return held

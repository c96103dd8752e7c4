"""Blobs of a frame: what is darker than the empty tank and has corners.

The published way: foreground opened and closed, contours that hold a Shi-Tomasi corner are
animals, the corner end is the head. Which blob is whom, and blobs of several fish, are the
business of others. Pixels here have their origin in the centre of the top left pixel and y
down; angles turn from x towards y, as the eye sees them: clockwise.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from zfcal.vision._kernels import moments, shades
from zfcal.vision.background import Background, Grey

Floats = NDArray[np.float64]

_QUALITY = 0.01
_CORNERS_APART_PX = 5
_BLOCK_PX = 3
_HARRIS_K = 0.04
_MOST_CORNERS = 16

_KERNEL = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (3, 3))
_MARGIN_PX = 2

_SKEW = 0.5
"""Skewness along the axis that settles which end is the head."""

_CORNER = 0.4
"""What the strongest corner, at the very end, is worth beside it."""

FULL = 1.15
"""A pixel that is so much darker than a body in the mean is all body."""


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
class Blob:
    """A piece of foreground.

    Parameters
    ----------
    pixels : ndarray, shape (pixel, 2)
        Its pixels, x and y.
    weights : ndarray, shape (pixel,)
        How much of each pixel is body, in (0, 1]: less along the edge.
    shares : ndarray, shape (pixel,)
        By how much each pixel is darker than the empty tank, as a share of that.
    darkness
        How much darker than the empty tank its body is, as a share of the tank's grey.
    contour : ndarray of int32, shape (point, 2)
    corners : ndarray, shape (corner, 2)
        The strongest first.
    box
        Left, top, width and height of the contour.
    """

    pixels: Floats
    weights: Floats
    shares: Floats
    darkness: float
    contour: NDArray[np.int32]
    corners: Floats
    box: tuple[int, int, int, int]

    @property
    def area_px(self) -> float:
        """Pixels that it covers, those along the edge in part."""
        return float(self.weights.sum())


@dataclass(frozen=True, slots=True, kw_only=True)
class Shape:
    """Where a body is, how long, and which way it lies.

    Parameters
    ----------
    x_px, y_px
        Centroid of the silhouette.
    axis_rad
        Direction of the long axis, towards the likelier head.
    head
        How much speaks for that end, in [0, 1].
    length_px, width_px
        Of the ellipse with the same second moments: four standard deviations.
    area_px
        Pixels covered.
    """

    x_px: float
    y_px: float
    axis_rad: float
    head: float
    length_px: float
    width_px: float
    area_px: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Contrast:
    """A frame compared with the empty tank.

    Parameters
    ----------
    grey : ndarray of uint8, shape (height, width)
        As bright as the background, its negative where fish are light.
    background
        The empty tank.
    foreground : ndarray of uint8, shape (height, width)
        255 where it is not the tank, closed.
    mask : ndarray of uint8, shape (height, width)
        The same before it was closed.
    inner : ndarray of uint8, shape (height, width), optional
        What is darker surely is animal.
    """

    grey: Grey
    background: Background
    foreground: Grey
    mask: Grey
    inner: Grey | None = None

    def core(self, crop: tuple[slice, slice]) -> Grey:
        """Return what is surely not the tank, in a part of the image; it is noise without any.

        Right for what hangs together and lies a pixel within that part.
        """
        if self.inner is None:
            return np.asarray(cv2.morphologyEx(self.mask[crop], cv2.MORPH_OPEN, _KERNEL), np.uint8)
        # Of three by three pixels: one of them alone is noise.
        mean = cv2.blur(self.grey[crop], (3, 3))
        return np.asarray(cv2.compare(mean, self.inner[crop], cv2.CMP_LT), np.uint8)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Limits:
    """Greys below which a pixel is animal.

    Parameters
    ----------
    outer : ndarray of uint8, shape (height, width)
        What is darker may be, if it hangs together with what surely is.
    inner : ndarray of uint8, shape (height, width), optional
        What is darker surely is; without, what is left of the foreground when it is opened.
    """

    outer: Grey
    inner: Grey | None = None


def compare(grey: Grey, background: Background, limits: Limits) -> Contrast:
    """Return what of an image is animal: opened and closed by a 3 x 3 ellipse.

    Bodies three pixels wide lose their tails when they are opened. So what is left of the
    opened foreground only tells which pieces count; their extent is that before.
    """
    mask = cv2.compare(grey, limits.outer, cv2.CMP_LT)
    closed = cv2.morphologyEx(mask, cv2.MORPH_CLOSE, _KERNEL)
    return Contrast(
        grey=grey,
        background=background,
        foreground=np.asarray(closed, np.uint8),
        mask=np.asarray(mask, np.uint8),
        inner=limits.inner,
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
    contours, _ = cv2.findContours(view.foreground, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    found = [_blob(view, np.asarray(each, np.int32)) for each in contours if len(each) >= 4]
    blobs = [blob for blob in found if blob is not None and blob.area_px >= min_blob_px]
    # OpenCV lists contours from the bottom of the image up; any fixed order would do.
    return blobs if corners is None else _with_corners(view, blobs, corners)


def _blob(view: Contrast, contour: NDArray[np.int32]) -> Blob | None:
    """Return what lies within a contour; None where nothing of it is surely animal."""
    x0, y0, width, height = (int(value) for value in cv2.boundingRect(contour))
    # A pixel wider: the edge of a body is a share of the pixels around its mask.
    left, top = max(x0 - 1, 0), max(y0 - 1, 0)
    crop = np.s_[top : y0 + height + 1, left : x0 + width + 1]
    inside = np.zeros(view.grey[crop].shape, np.uint8)
    cv2.drawContours(inside, [contour], -1, 1, cv2.FILLED, offset=(-left, -top))
    if not (view.core(crop) & inside).any():
        return None
    pixels, share = shades(
        np.asarray(cv2.dilate(inside, _KERNEL), np.uint8),
        view.grey[crop].copy(),
        view.background.level[crop].copy(),
        left,
        top,
    )
    if not len(share):
        return None
    # Weighted by itself: the more of faint edge there is around a body, the same.
    darkness = float(share @ share / share.sum())
    return Blob(
        pixels=pixels,
        weights=np.minimum(share / (FULL * darkness), 1.0),
        shares=share,
        darkness=darkness,
        contour=contour.reshape(-1, 2),
        corners=np.empty((0, 2)),
        box=(x0, y0, width, height),
    )


def _with_corners(view: Contrast, blobs: list[Blob], how: Corners) -> list[Blob]:
    """Return the blobs with their corners; the best corner of all sets the threshold."""
    found = [_corners_of(view, blob, how) for blob in blobs]
    best = max((quality[0] for _, quality in found if len(quality)), default=0.0)
    held = []
    for blob, (points, quality) in zip(blobs, found, strict=True):
        good = points[quality >= _QUALITY * best]
        if len(good) or not how.needed:
            held.append(replace(blob, corners=good))
    return held


def _corners_of(view: Contrast, blob: Blob, how: Corners) -> tuple[Floats, Floats]:
    """Return corners within a blob, the strongest first, and their measures."""
    x0, y0, width, height = blob.box
    left, top = max(x0 - _MARGIN_PX, 0), max(y0 - _MARGIN_PX, 0)
    crop = np.s_[top : y0 + height + _MARGIN_PX, left : x0 + width + _MARGIN_PX]
    inside = np.zeros(view.grey[crop].shape, np.uint8)
    cv2.drawContours(inside, [blob.contour], -1, 255, cv2.FILLED, offset=(-left, -top))
    corners, quality = cv2.goodFeaturesToTrackWithQuality(
        np.ascontiguousarray(view.grey[crop]),
        _MOST_CORNERS,
        _QUALITY,
        _CORNERS_APART_PX,
        inside,
        blockSize=_BLOCK_PX,
        useHarrisDetector=how.harris,
        k=_HARRIS_K,
    )
    if corners is None or not len(corners):
        return np.empty((0, 2)), np.empty(0)
    points = corners.reshape(-1, 2).astype(np.float64) + np.array([left, top])
    return points, np.asarray(quality, np.float64).ravel()


def shape_of(pixels: Floats, weights: Floats, corners: Floats | None = None) -> Shape:
    """Return where a body is and which way it lies.

    The head is at the end where the silhouette is thick: it tapers towards the tail, so the
    third moment along the axis points there. The end of the strongest corner, where corners
    are given, has a say as well; alone it is wrong in a seventh of all frames of zebrafish
    80 px long, the third moment in a twenty-fifth.

    Parameters
    ----------
    pixels : ndarray, shape (pixel, 2)
    weights : ndarray, shape (pixel,)
    corners : ndarray, shape (corner, 2), optional
        The strongest first.
    """
    total, x, y, angle, (second, both, third) = moments(pixels, weights)
    # A pixel is a twelfth of a square pixel wide by itself.
    long = float(second) + 1 / 12
    wide = max(float(both) + 1 / 6 - long, 1 / 12)
    lean = -float(third) / long**1.5 / _SKEW
    if corners is not None and len(corners):
        ahead = (corners[0, 0] - x) * math.cos(angle) + (corners[0, 1] - y) * math.sin(angle)
        lean += _CORNER * float(ahead) / (2 * math.sqrt(long))
    return Shape(
        x_px=x,
        y_px=y,
        axis_rad=angle if lean >= 0 else math.remainder(angle + math.pi, 2 * math.pi),
        head=min(abs(lean), 1.0),
        length_px=4 * math.sqrt(long),
        width_px=4 * math.sqrt(wide),
        area_px=total,
    )

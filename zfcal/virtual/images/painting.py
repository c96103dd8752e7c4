"""Painting polygons into images with sub-pixel edges, and the noise of a sensor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import cv2
import numpy as np
from scipy.ndimage import gaussian_filter

from zfcal.arrays import Floats, Floats32
from zfcal.cameras.frames import Image
from zfcal.virtual.images import _painting

FINE = 16
"""Fine pixels along the side of a pixel: an edge is right to a thirtieth of a pixel."""

_SHIFT = 6
"""Bits behind the point in OpenCV's coordinates."""

_PARTS = float(1 << _SHIFT)

_SHARPEST = 0.3
"""One and the cosine of the angle by which an outline turns at a corner, at least."""

_SPARE_PX = 64
_N_FIELDS = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class Fill:
    """A polygon in one colour.

    Parameters
    ----------
    corners_px : ndarray, shape (corner, 2)
    grey
        Its grey level.
    opacity
        From 0 to 1.
    inner
        Whether it lies within an earlier one: its edge need not be exact.
    """

    corners_px: Floats
    grey: float
    opacity: float = 1.0
    inner: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Patch:
    """A painted piece of an image.

    Parameters
    ----------
    corner_px
        Column and row of its top left pixel; may lie outside the image.
    cover : ndarray of float32, shape (height, width)
        How much of each pixel is covered, from 0 to 1.
    ink : ndarray of float32, shape (height, width)
        Grey level times cover.
    """

    corner_px: tuple[int, int]
    cover: Floats32
    ink: Floats32


def patch_of(fills: Sequence[Fill], *, blur_px: float = 0.0) -> Patch:
    """Paint polygons, the later over the earlier ones.

    Parameters
    ----------
    fills
        At least one.
    blur_px
        Standard deviation of a blur of the whole.

    Returns
    -------
    Patch
        Just large enough.
    """
    corners = np.concatenate([fill.corners_px for fill in fills])
    margin = 1 + int(np.ceil(3 * blur_px))
    low = np.floor(corners.min(axis=0)).astype(int) - margin
    corner_px = int(low[0]), int(low[1])
    wide, high = np.ceil(corners.max(axis=0)).astype(int) + margin + 1 - low
    fine = np.zeros((high * FINE, wide * FINE, 2), np.uint8)
    for fill in fills:
        # Moved inwards by half a fine pixel: OpenCV also fills those on a polygon's edge.
        sharpest = 0.0 if fill.inner else _SHARPEST
        outline = np.ascontiguousarray(fill.corners_px, np.float64)
        points = _painting.fine_points(outline, corner_px, FINE, _PARTS, sharpest)
        cv2.fillPoly(fine, [points], (255 * fill.opacity, fill.grey * fill.opacity), shift=_SHIFT)
    both = _painting.block_means(fine, FINE)
    if blur_px > 0:
        both = np.asarray(cv2.GaussianBlur(both, (0, 0), blur_px), np.float32)
    ink = np.ascontiguousarray(both[..., 1])
    return Patch(corner_px=corner_px, cover=both[..., 0] / 255.0, ink=ink)


def mean_patch(patches: Sequence[Patch]) -> Patch:
    """Return the mean of patches: what a shutter lets through while a body moves."""
    if len(patches) == 1:
        return patches[0]
    low = np.min([patch.corner_px for patch in patches], axis=0)
    high = np.max([np.add(p.corner_px, p.cover.shape[::-1]) for p in patches], axis=0)
    cover = np.zeros((high - low)[::-1], np.float32)
    ink = np.zeros_like(cover)
    for patch in patches:
        x, y = np.subtract(patch.corner_px, low)
        place = np.s_[y : y + patch.cover.shape[0], x : x + patch.cover.shape[1]]
        cover[place] += patch.cover / len(patches)
        ink[place] += patch.ink / len(patches)
    return Patch(corner_px=(int(low[0]), int(low[1])), cover=cover, ink=ink)


def lay_over(image: Image, patch: Patch) -> None:
    """Lay a patch over a grey image, in place; what lies outside the image is cut off."""
    _painting.lay_over(image, patch.cover, patch.ink, patch.corner_px)


def darken(image: Image, patch: Patch, opacity: float, only: Floats32 | None = None) -> None:
    """Take light from an image where a patch covers it, in place.

    Parameters
    ----------
    image
        Is changed; grey, or with channels that lose the same share.
    patch
        Its cover counts, its ink does not.
    opacity
        Share of the light that is taken.
    only : ndarray of float32, shape (height, width)
        Where and how much, from 0 to 1; everywhere if None.
    """
    channels = image if image.ndim == 3 else image[..., None]
    everywhere = np.empty((0, 0), np.float32) if only is None else only
    _painting.darken(channels, patch.cover, opacity, everywhere, patch.corner_px)


def smooth_field(rng: np.random.Generator, shape: tuple[int, ...], size_px: float) -> Floats32:
    """Return a smooth random field of mean 0 and standard deviation 1, whose edges meet."""
    field = gaussian_filter(rng.standard_normal(shape, np.float32), size_px, mode="wrap")
    return np.asarray((field - field.mean()) / field.std(), np.float32)


@final
class Noise:
    """A sensor's noise, cut at random places from a few fields that are drawn once.

    Parameters
    ----------
    shape
        Of the images.
    sd_grey
        Standard deviation in a pixel and frame.
    seed
        Of the fields.
    """

    def __init__(self, shape: tuple[int, ...], sd_grey: float, seed: int) -> None:
        rng = np.random.default_rng([seed, _N_FIELDS])
        wide = (shape[0] + _SPARE_PX, shape[1] + _SPARE_PX, *shape[2:])
        self._step = int(np.prod(shape[2:]))
        self._fields = [
            np.rint(sd_grey * rng.standard_normal(wide, np.float32))
            .astype(np.int16)
            .reshape(wide[0], -1)
            for _ in range(_N_FIELDS if sd_grey > 0 else 0)
        ]

    def add_to(self, image: Image, rng: np.random.Generator) -> Image:
        """Return the image with noise; the same generator gives the same noise."""
        if not self._fields:
            return image
        which, x, y = rng.integers(0, (_N_FIELDS, _SPARE_PX, _SPARE_PX))
        flat = _painting.add_field(
            image.reshape(len(image), -1), self._fields[which], y, self._step * x
        )
        return flat.reshape(image.shape)

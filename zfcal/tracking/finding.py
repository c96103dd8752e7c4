"""Where to look in a frame: the thresholds of each method, fitted to the animals seen so far."""

from __future__ import annotations

import cv2
import numpy as np

from zfcal.arrays import Bools, Grey
from zfcal.tracking.background import Background
from zfcal.tracking.blobs import Blob
from zfcal.tracking.detect import Contrast, Corners, Limits, compare, find_blobs
from zfcal.tracking.learning import Standing, pieces
from zfcal.tracking.seen import SILHOUETTE, TrackerOptions
from zfcal.tracking.usual import Body

_OUTER = 0.3
"""Share of an animal's darkness up to which a pixel may be shadow, or noise."""

_INNER = 0.55
"""Share from which nine pixels in the mean are surely animal."""

_FAINT = 0.55
"""Share of an animal's darkness below which a whole blob is shadow or reflection."""

_SOFT_PX = 0.7
"""Blur of `SILHOUETTE`: it halves the noise and widens a body by a tenth of a pixel."""


_AROUND_PX = 2
"""What is closed reaches a pixel farther, and has to be seen to end."""


class Finder:
    """Finds blobs by one of the methods.

    Parameters
    ----------
    options
        Of the tracker.
    background
        The empty tank, its negative where fish are light.
    region : ndarray of bool, shape (height, width), optional
        Where animals can be.
    min_blob_px
        Blobs of fewer pixels are dropped.
    opened
        Whether the foreground is opened, as is right for bodies three pixels wide.
    """

    def __init__(
        self,
        options: TrackerOptions,
        background: Background,
        region: Bools | None = None,
        *,
        min_blob_px: float,
        opened: bool = True,
    ) -> None:
        self._options = options
        self._min_blob_px = min_blob_px
        self._opened = opened
        self.background = background
        self._region = None if region is None else (region * np.uint8(255)).astype(np.uint8)
        self._darkness = 0.0
        self._box = _box_of(background.low.shape, region)
        self._limits = Limits(outer=self._within(background.low), opened=opened, box=self._box)
        self._lighter: Grey | None = None

    def find(self, grey: Grey, usual: Body) -> list[Blob]:
        """Return the blobs of an image that are dark enough for an animal.

        Parameters
        ----------
        grey
            As bright as the background, softened by `soften`.
        usual
            What an animal looks like.
        """
        if usual.darkness > 0 and abs(usual.darkness - self._darkness) > 0.01:
            self._fit(usual.darkness)
        blobs = find_blobs(
            self._compared(grey),
            min_blob_px=self._min_blob_px,
            corners=self._corners,
        )
        return [blob for blob in blobs if not blob.darkness < _FAINT * usual.darkness]

    def standing_out(self, grey: Grey) -> list[Standing]:
        """Return what stands out of an image to either side as far as an animal has to.

        Parameters
        ----------
        grey
            As for `find`.
        """
        level, outer = self.background.level, self._limits.outer
        if self._lighter is None:
            limit = cv2.add(level, cv2.subtract(level, outer))
            if self._region is not None:
                limit = cv2.bitwise_or(limit, cv2.bitwise_not(self._region))
            self._lighter = np.asarray(limit, np.uint8)
        masks = cv2.compare(grey, outer, cv2.CMP_LT), cv2.compare(grey, self._lighter, cv2.CMP_GT)
        found = [each for mask in masks for each in pieces(grey, level, np.asarray(mask, np.uint8))]
        return [each for each in found if each.area_px >= self._min_blob_px]

    @property
    def _corners(self) -> Corners | None:
        if self._options.method == SILHOUETTE:
            return None
        return Corners(harris=self._options.harris)

    def _compared(self, grey: Grey) -> Contrast:
        return compare(grey, self.background, self._limits)

    def _within(self, limit: Grey) -> Grey:
        """Return a limit below which there is nothing outside the region."""
        return limit if self._region is None else limit & self._region

    def _fit(self, darkness: float) -> None:
        level, low = self.background.level, self.background.low
        outer = np.minimum(low, (level * (1 - _OUTER * darkness)).astype(np.uint8))
        inner = None
        if self._options.method == SILHOUETTE:
            inner = (level * (1 - _INNER * darkness)).astype(np.uint8)
        self._limits = Limits(
            outer=self._within(outer), inner=inner, opened=self._opened, box=self._box
        )
        self._lighter = None
        self._darkness = darkness


def _box_of(shape: tuple[int, ...], region: Bools | None) -> tuple[slice, slice]:
    """Return rows and columns that hold a region, and what is closed at its border."""
    if region is None or not region.any():
        return slice(0, shape[0]), slice(0, shape[1])
    rows, columns = (np.asarray(region.any(axis=axis), bool) for axis in (1, 0))
    return _span(rows), _span(columns)


def _span(line: Bools) -> slice:
    some = np.flatnonzero(line)
    return slice(max(int(some[0]) - _AROUND_PX, 0), int(some[-1]) + 1 + _AROUND_PX)


def soften(grey: Grey, method: str) -> Grey:
    """Return an image as a method takes it: the published one as it is."""
    if method != SILHOUETTE:
        return grey
    return np.asarray(cv2.GaussianBlur(grey, (3, 3), _SOFT_PX), np.uint8)

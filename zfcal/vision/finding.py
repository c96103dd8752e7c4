"""Where to look in a frame: the thresholds of each method, fitted to the animals seen so far."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from zfcal.vision.background import Background, Grey
from zfcal.vision.detect import Blob, Contrast, Corners, Limits, compare, find_blobs
from zfcal.vision.seen import SILHOUETTE, TrackerOptions
from zfcal.vision.usual import Body

_OUTER = 0.3
"""Share of an animal's darkness up to which a pixel may be shadow, or noise."""

_INNER = 0.55
"""Share from which nine pixels in the mean are surely animal."""

_FAINT = 0.55
"""Share of an animal's darkness below which a whole blob is shadow or reflection."""

_SOFT_PX = 0.7
"""Blur of `SILHOUETTE`: it halves the noise and widens a body by a tenth of a pixel."""


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
    """

    def __init__(
        self,
        options: TrackerOptions,
        background: Background,
        region: NDArray[np.bool_] | None = None,
    ) -> None:
        self._options = options
        self.background = background
        self._region = None if region is None else (region * np.uint8(255)).astype(np.uint8)
        self._darkness = 0.0
        self._limits = Limits(outer=self._within(background.low))

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
            min_blob_px=self._options.min_blob_px,
            corners=self._corners,
        )
        return [blob for blob in blobs if not blob.darkness < _FAINT * usual.darkness]

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
        self._limits = Limits(outer=self._within(outer), inner=inner)
        self._darkness = darkness


def soften(grey: Grey, method: str) -> Grey:
    """Return an image as a method takes it: the published one as it is."""
    if method != SILHOUETTE:
        return grey
    return np.asarray(cv2.GaussianBlur(grey, (3, 3), _SOFT_PX), np.uint8)

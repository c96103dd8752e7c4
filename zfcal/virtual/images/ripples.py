"""Ripples on the water: two smooth patterns that drift across each other."""

from __future__ import annotations

from typing import final

import numpy as np

from zfcal.cameras.frames import Image
from zfcal.virtual.images._painting import add_fields
from zfcal.virtual.images.painting import smooth_field

_DRIFT_PX_S = ((23.0, 11.0), (-17.0, 19.0))
_RIPPLES = 31


@final
class Ripples:
    """Adds ripples to grey images.

    Parameters
    ----------
    shape
        Of the images.
    sd_grey
        Standard deviation of the grey levels.
    size_px
        Of a ripple.
    seed
        Of the patterns.
    """

    def __init__(self, shape: tuple[int, ...], sd_grey: float, size_px: float, seed: int) -> None:
        rng = np.random.default_rng([seed, _RIPPLES])
        self._shape = shape
        self._fields = []
        for _ in _DRIFT_PX_S if sd_grey > 0 else ():
            field = smooth_field(rng, shape, size_px / 2) * sd_grey / np.sqrt(2.0)
            # Twice the size: any cut of the image's size is whole.
            self._fields.append(np.tile(np.rint(field).astype(np.int16), (2, 2)))

    def add_to(self, image: Image, time_s: float) -> Image:
        """Return a copy of the image with the ripples of an instant."""
        if not self._fields:
            return image.copy()
        high, wide = self._shape
        places = [(int(dy * time_s) % high, int(dx * time_s) % wide) for dx, dy in _DRIFT_PX_S]
        one, other = self._fields
        return add_fields(image, one, other, np.array(places, np.int64))

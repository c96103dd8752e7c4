"""An image with its time: what every source of images gives and every tracker takes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from zfcal.errors import InputError

Image = NDArray[np.uint8]
"""Grey of shape (height, width), or blue, green, red of shape (height, width, 3)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Frame:
    """One image of one camera.

    Parameters
    ----------
    number
        Frames since the start of the trial by the camera's clock, ``time_s`` in frame
        periods: a gap in the recording is a gap in the numbers.
    time_s
        The camera's time stamp, in seconds since the start of the trial.
    image : ndarray of uint8, shape (height, width) or (height, width, 3)
        Grey, or blue, green, red. Row 0 is the top: y runs down.
    """

    number: int
    time_s: float
    image: Image

    def __post_init__(self) -> None:
        if self.image.dtype != np.uint8 or self.image.ndim not in {2, 3}:
            raise InputError(
                f"A frame must be 8-bit grey or colour, got {self.image.dtype} of shape "
                f"{self.image.shape}."
            )

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height."""
        return self.image.shape[1], self.image.shape[0]

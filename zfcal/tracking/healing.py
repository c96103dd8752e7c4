"""Takes out of the empty tank what was there while it was learnt, and has left.

A hand, a net, a fish that sat: each leaves a ghost that differs from all later frames. It has its
edge in the tank and none in the frame, by which `ghosts` tells it from an animal, however long
that rests. What came later and stays has its edge in the frame, and is not healed.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable

import cv2
import numpy as np

from zfcal.arrays import Bools, Grey
from zfcal.tracking.background import Background
from zfcal.tracking.ghosts import without_step

_LOOKS = 4
_TIMES = 3
"""Of the last looks, those in which a pixel has to belong to a ghost: an animal that passes
changes the border of its piece for a moment."""

_EDGE = np.ones((5, 5), np.uint8)
"""The border of a ghost is blurred over two pixels, which differ too little to belong to it."""

_KERNEL = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (3, 3))


class Healer:
    """Remembers the last looks at frames beside the tank.

    Parameters
    ----------
    region : ndarray of bool, shape (height, width), optional
        Where animals can be; the tank is healed there alone.
    """

    def __init__(self, region: Bools | None = None) -> None:
        self._region = region
        self._looks: deque[tuple[Grey, Grey]] = deque(maxlen=_LOOKS)

    def look(self, grey: Grey, tank: Background) -> Background:
        """Return the tank without what was a ghost in most of the last looks.

        Parameters
        ----------
        grey : ndarray of uint8, shape (height, width)
            A frame, as bright as the tank.
        tank
            As it is known; the very same is returned where nothing is healed.
        """
        self._looks.append((self._ghosts(grey, tank), grey.copy()))
        times = sum((mask for mask, _ in self._looks), np.zeros_like(grey))
        sure = np.asarray(times >= _TIMES)
        if not sure.any():
            return tank
        level = tank.level.copy()
        # The median of those looks alone: in the others it may be an animal.
        shown = np.stack([np.where(mask[sure], grey[sure], -1) for mask, grey in self._looks])
        shown.sort(axis=0)
        level[sure] = np.take_along_axis(
            shown, (len(shown) - 1 - times[sure] // 2)[None].astype(np.intp), axis=0
        )[0]
        for mask, _ in self._looks:
            mask[sure] = 0
        return tank.levelled(level, sure)

    def _ghosts(self, grey: Grey, tank: Background) -> Grey:
        """Return 1 where a frame differs from the tank and is the smoother of the two."""
        found = np.zeros(grey.shape, np.uint8)
        for limit, how in ((tank.low, cv2.CMP_LT), (tank.high, cv2.CMP_GT)):
            mask = np.asarray(cv2.compare(grey, limit, how), np.uint8)
            if self._region is not None:
                mask[~self._region] = 0
            # Tails are thin: what does not outlast opening tells which pieces are noise.
            core = np.asarray(cv2.morphologyEx(mask, cv2.MORPH_OPEN, _KERNEL), np.uint8)
            if core.any():
                found |= without_step(mask, grey, tank.level, core=core, where=self._region)
        return np.asarray(cv2.dilate(found, _EDGE), np.uint8)


def healed(tank: Background, frames: Iterable[Grey], region: Bools | None = None) -> Background:
    """Return a tank without what frames, in their order, show to have left it."""
    healer = Healer(region)
    for frame in frames:
        gain = tank.gain(frame)
        bright = np.asarray(cv2.convertScaleAbs(frame, alpha=1 / gain), np.uint8)
        tank = healer.look(bright, tank)
    return tank

"""How far what is found can be believed: by what is found where no animal can be.

Animals differ from the tank to one side: they are darker, say. What differs from it as much to the
other side is none of them, so it tells how often noise, light and ripples, or animals of which
the wrong side is looked at, make something as strong: the decoys of target-decoy estimates (Elias
and Gygi 2007, Nat. Methods 4:207-214). No truth is needed, and nothing is assumed of the noise.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

import numpy as np

from zfcal.tracking.learning import Standing

_LOOKS = 40
"""Frames that are remembered."""


class Doubts:
    """Keeps what stood out to both sides in the last frames that were looked at."""

    def __init__(self) -> None:
        self._looks: deque[list[Standing]] = deque(maxlen=_LOOKS)
        self._targets = self._decoys = np.empty(0)
        self._usual = 0.0

    def look(self, found: Sequence[Standing]) -> None:
        """Take what stands out in a frame in which animals are dark."""
        self._looks.append(list(found))
        masses = [(each.sign, each.mass) for frame in self._looks for each in frame]
        self._targets = np.sort([mass for sign, mass in masses if sign < 0])
        self._usual = float(np.median(self._targets)) if len(self._targets) else 0.0
        self._decoys = np.sort([mass for sign, mass in masses if sign > 0])

    def trust(self, mass: float) -> float:
        """Return the share of what is as strong or stronger that is animals, in [0, 1].

        What is stronger than half of what was found is as likely an animal as that half: of the
        strongest there are too few to tell.

        Parameters
        ----------
        mass
            Area times contrast, in pixels and greys.
        """
        if not self._looks:
            return 1.0
        mass = min(mass, self._usual)
        decoys = len(self._decoys) - int(np.searchsorted(self._decoys, mass))
        targets = len(self._targets) - int(np.searchsorted(self._targets, mass))
        return max(0.0, 1.0 - decoys / targets) if targets else 0.0

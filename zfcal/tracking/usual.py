"""What an animal looks like here: area, length and darkness, from those seen so far."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from zfcal.tracking.blobs import Blob, Shape, shape_of

_REMEMBERED = 400
_REFRESHED = 25
"""Sightings after which the measures are taken anew."""

_GUESSED_PX = 20.0

_FAINT = 0.5
"""A blob less than this share as dark as an animal is a shadow or a reflection."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Body:
    """A usual animal; NaN throughout before one was seen.

    Parameters
    ----------
    area_px
        Pixels covered.
    length_px
        Of the ellipse with the same second moments.
    darkness
        Share of the tank's grey by which it is darker.
    """

    area_px: float = math.nan
    length_px: float = math.nan
    darkness: float = math.nan


class Bodies:
    """Keeps what the last animals seen one by one looked like."""

    def __init__(self) -> None:
        self._seen: deque[tuple[float, float, float]] = deque(maxlen=_REMEMBERED)
        self._fresh = 0
        self.usual = Body()

    @property
    def length_px(self) -> float:
        """Length of a usual animal; a guess before one was seen."""
        return self.usual.length_px if self.usual.length_px > 0 else _GUESSED_PX

    def start(self, frames: Sequence[Sequence[Blob]], n_agents: int | None) -> None:
        """Take the usual body from the blobs of some frames.

        Where the number of animals is known, only frames with as many blobs count; otherwise
        all blobs do that are not much fainter or smaller than the others.
        """
        darkness = _usual_darkness(frames, n_agents)
        dark = [[b for b in blobs if b.darkness > _FAINT * darkness] for blobs in frames]
        whole = [blobs for blobs in dark if len(blobs) == n_agents] or dark
        kept = [blob for blobs in whole for blob in blobs]
        if not kept:
            return
        least = 0.3 * _usual_area(whole, n_agents)
        for blob in kept:
            if blob.area_px >= least:
                self.add(shape_of(blob.pixels, blob.weights), blob.darkness)
        self._refresh()

    def add(self, shape: Shape, darkness: float) -> None:
        """Remember an animal that is alone in its blob."""
        self._seen.append((shape.area_px, shape.length_px, darkness))
        self._fresh += 1
        if self._fresh >= _REFRESHED:
            self._refresh()

    def _refresh(self) -> None:
        area, length, darkness = np.median(np.array(self._seen), axis=0)
        self.usual = Body(area_px=float(area), length_px=float(length), darkness=float(darkness))
        self._fresh = 0


def _usual_area(frames: Sequence[Sequence[Blob]], n_agents: int | None) -> float:
    """Return what most of the blobs are as large as, or nearly.

    Of the largest of each frame, as many as there are animals, the middle one, and of two the
    smaller: a robot may be far larger than fish. Where the number is not known, shadows may be
    more than half of all, so that three quarters count.
    """
    areas = [sorted((blob.area_px for blob in blobs), reverse=True) for blobs in frames]
    share = 0.75 if n_agents is None else 0.5
    some = [area for frame in areas for area in frame[:n_agents]]
    return float(np.quantile(some, share, method="lower"))


def _usual_darkness(frames: Sequence[Sequence[Blob]], n_agents: int | None) -> float:
    """Return the median darkness of the blobs of each frame that weigh most.

    As many as there are animals; where that is not known, those that weigh at least a quarter
    of the heaviest. A lure, much darker than fish, is one of several.
    """
    darkness = []
    for blobs in frames:
        heavy = sorted(((b.area_px * b.darkness, b.darkness) for b in blobs), reverse=True)
        if n_agents is None:
            heavy = [each for each in heavy if each[0] > 0.25 * heavy[0][0]]
        darkness += [each[1] for each in heavy[:n_agents]]
    return float(np.median(darkness)) if darkness else math.nan

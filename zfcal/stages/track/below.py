"""The camera below during a run: the robot as it was seen nearest to each overhead image."""

from __future__ import annotations

import math
from collections import Counter
from typing import final

import numpy as np

from zfcal.arena import Arena
from zfcal.cameras.frames import Frame
from zfcal.stages.camera.rig import Feed
from zfcal.stages.camera.sources import Recorder
from zfcal.tracking.pairing import Nearest
from zfcal.tracking.region import region_of
from zfcal.tracking.robot import LedOptions, RobotFinder, RobotSeen


@final
class Below:
    """Looks for the robot's LEDs.

    Parameters
    ----------
    arena
        The robot is nowhere else.
    feed
        The camera.
    leds
        What they look like.
    recorder
        Keeps the images; None for none.

    Attributes
    ----------
    counts
        Frames by what was seen: ``no image``, ``no LED``, ``one LED``, ``two LEDs``.
    """

    def __init__(
        self, arena: Arena, feed: Feed, leds: LedOptions, recorder: Recorder | None
    ) -> None:
        self.feed = feed
        self.counts: Counter[str] = Counter()
        keep = None if recorder is None else recorder.keep
        self._images = Nearest(feed.source, feed.shots, keep=keep)
        mask = (region_of(arena, feed.projection) * np.uint8(255)).astype(np.uint8)
        self._finder = RobotFinder(leds, feed.projection, mask=mask)
        self._last: tuple[float, RobotSeen] | None = None

    def at(self, time_s: float) -> RobotSeen:
        """Return where the robot was at a time, which grows from call to call."""
        shot = self._images.at(time_s)
        if shot is None or (shot.image.shape[1], shot.image.shape[0]) != self.feed.size_px:
            self.counts["no image"] += 1
            return _lost(time_s)
        if self._last is None or self._last[0] != shot.time_s:
            frame = Frame(number=0, time_s=shot.time_s, image=shot.image)
            self._last = (shot.time_s, self._finder.step(frame))
        seen = self._last[1]
        self.counts[("no LED", "one LED", "two LEDs")[len(seen.leds_px)]] += 1
        return seen

    def close(self) -> None:
        """End the reading."""
        self._images.close()


def _lost(time_s: float) -> RobotSeen:
    return RobotSeen(time_s=time_s, x_m=math.nan, y_m=math.nan, heading_rad=math.nan, leds_px=())

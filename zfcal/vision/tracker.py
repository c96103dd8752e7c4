"""From frames to tracks of fish: background, blobs, divided, assigned to who was there before.

A tracker is fed frames one by one and knows no files; the same frames give the same tracks.
It is causal: what a frame shows is told before the next one is looked at, except that the
first frames, from which the background is learnt, are looked at twice (`follow`).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

import cv2
import numpy as np
from numpy.typing import NDArray

from zfcal.vision.background import (
    Background,
    BackgroundLearner,
    Grey,
    grey_of,
    shows_nothing,
)
from zfcal.vision.camera import Projection
from zfcal.vision.detect import Blob, Corners, Look, find_blobs, look_at, shape_of
from zfcal.vision.following import Trails
from zfcal.vision.frames import Frame
from zfcal.vision.seen import BadFrame, Reason, Seen, TrackerOptions
from zfcal.vision.splitting import by_clusters, count_in
from zfcal.vision.trail import Detection, Trail
from zfcal.vision.usual import Bodies

Floats = NDArray[np.float64]

_SHADOW = 0.4
"""Share of an animal's darkness up to which a pixel may be shadow."""

_HELD = 500
"""Frames that wait at most for a background; a camera that shows nothing fills no memory."""

_DOUBTED = 0.75
"""Share of their areas below which not all animals may be where they are thought to be."""

_MOST = 100
"""Animals that are more than known in a frame at most."""

_DARKEST, _LIGHTEST = 0.3, 3.0
"""Changes of brightness beyond which a frame is not compared with the background."""


class FishTracker:
    """Follows the animals of one camera.

    Parameters
    ----------
    options
        How.
    projection
        Where pixels lie in the tank.
    background
        The empty tank; learnt from the first frames where it is None.
    region : ndarray of bool, shape (height, width), optional
        Where animals can be: what lies elsewhere, a reflection in a wall, is not looked at.
    """

    def __init__(
        self,
        options: TrackerOptions,
        projection: Projection,
        *,
        background: Background | None = None,
        region: NDArray[np.bool_] | None = None,
    ) -> None:
        self.options = options
        self._projection = projection
        self._region = None if region is None else (region * np.uint8(255)).astype(np.uint8)
        self._learner = BackgroundLearner(options.learn_frames, options.learn_rate)
        self._background = background
        self._bodies = Bodies()
        self._limit: tuple[float, Grey] | None = None
        self._trails = Trails(self._bodies, coast_s=options.coast_s)
        self._bad: list[BadFrame] = []
        if background is not None and options.light:
            self._background = background.inverted()

    @property
    def background(self) -> Background | None:
        """The empty tank, its negative where fish are light; None while it is learnt."""
        return self._background

    @property
    def is_learning(self) -> bool:
        """Whether the background is still to be learnt."""
        return self._background is None

    def learn(self, frame: Frame) -> None:
        """Learn the background from a frame, without looking for animals in it."""
        if self._background is not None:
            return
        grey = grey_of(frame.image)
        if self._learner.samples and self._learner.samples[0].shape != grey.shape:
            return
        self._learner.add(grey)
        if self._learner.is_ready:
            self.stop_learning()

    def stop_learning(self) -> None:
        """Take the background as it was learnt so far, where any frame was of use."""
        if self._background is not None or not self._learner.count:
            return
        light = self.options.light
        learnt = self._learner.freeze(light=light)
        self._background = learnt.inverted() if light else learnt
        samples = self._learner.samples
        # The learner's frames are no longer needed: a second of them is as much as the rest.
        self._learner = BackgroundLearner(self.options.learn_frames, self.options.learn_rate)
        looks = [self._look(~s if light else s) for s in samples]
        self._bodies.start([self._blobs(look) for look in looks], self.options.n_agents)

    def take_bad_frames(self) -> list[BadFrame]:
        """Return the frames gone wrong since this was last asked, and forget them."""
        bad, self._bad = self._bad, []
        return bad

    def step(self, frame: Frame) -> list[Seen]:
        """Return the animals of a frame, ascending by id; none while the background is learnt."""
        if self._background is None:
            self._note(frame, "no background", "the background is still being learnt")
            self.learn(frame)
            return []
        grey = self._comparable(frame, self._background)
        if grey is None:
            self._trails.forget(frame.time_s)
            return []
        blobs = self._blobs(self._look(grey))
        if not self._bodies.usual.area_px > 0:
            self._bodies.start([blobs], self.options.n_agents)
            blobs = self._blobs(self._look(grey))
        detections = self._divided(blobs, frame.time_s)
        self._trails.match(detections, frame.time_s)
        seen = self._told()
        self._judge(frame, detections, seen)
        return seen

    def _note(self, frame: Frame, reason: Reason, says: str) -> None:
        self._bad.append(
            BadFrame(number=frame.number, time_s=frame.time_s, reason=reason, says=says)
        )

    def _comparable(self, frame: Frame, background: Background) -> Grey | None:
        """Return a frame's grey as bright as the background; None where it cannot be."""
        if frame.size_px != background.size_px:
            has, should = (f"{w} x {h}" for w, h in (frame.size_px, background.size_px))
            self._note(frame, "size", f"the image is {has} px, the background {should} px")
            return None
        grey = grey_of(frame.image)
        if shows_nothing(grey):
            self._note(frame, "black", "the image shows nothing")
            return None
        if self.options.light:
            grey = ~grey
        gain = background.gain(grey)
        if not _DARKEST < gain < _LIGHTEST:
            self._note(frame, "light", f"the image is {gain:.2g} times as bright as the background")
            return None
        if abs(gain - 1) < 0.004:
            return grey
        return np.asarray(cv2.convertScaleAbs(grey, alpha=1 / gain), np.uint8)

    def _look(self, grey: Grey) -> Look:
        assert self._background is not None  # noqa: S101 - callers have asked
        return look_at(grey, self._background, self._dark(self._background), self._region)

    def _dark(self, background: Background) -> Grey:
        """Return the grey below which a pixel is animal: tank and shadow are lighter."""
        darkness = self._bodies.usual.darkness
        if not darkness > 0:
            return background.low
        if self._limit is None or abs(self._limit[0] - darkness) > 0.02:
            limit = (background.level * (1 - _SHADOW * darkness)).astype(np.uint8)
            self._limit = darkness, np.minimum(background.low, limit)
        return self._limit[1]

    def _blobs(self, look: Look) -> list[Blob]:
        return find_blobs(
            look,
            min_blob_px=self.options.min_blob_px,
            corners=Corners(harris=self.options.harris),
        )

    def _divided(self, blobs: list[Blob], time_s: float) -> list[Detection]:
        """Return the animals in blobs: those expected in one, and those that its area tells."""
        thought = self._trails.thought_in(blobs, time_s)
        spare: float = _MOST
        if self.options.n_agents is not None:
            spare = self.options.n_agents - sum(max(len(trails), 1) for trails in thought)
        found: list[Detection] = []
        for blob, trails in zip(blobs, thought, strict=True):
            n = count_in(blob, area_px=self._area(trails), expected=max(len(trails), 1))
            more = min(max(n - max(len(trails), 1), 0), max(spare, 0))
            n = min(n, max(len(trails), 1) + int(more))
            spare -= more
            for trail in trails:
                trail.crowd(blob.area_px < _DOUBTED * len(trails) * self._area(trails))
            found += self._parts(blob, n, trails, time_s)
        return found

    def _area(self, trails: list[Trail]) -> float:
        """Return what an animal covers, in the mean of those expected in a blob."""
        usual = self._bodies.usual.area_px
        own = [trail.own_area_px(usual) for trail in trails]
        return float(np.mean(own)) if own else usual

    def _parts(self, blob: Blob, n: int, trails: list[Trail], time_s: float) -> Iterator[Detection]:
        if n == 1:
            shape = shape_of(blob.pixels, blob.weights, blob.corners)
            yield Detection(shape=shape, blob=blob, shared=1)
            return
        seeds = np.array([trail.predicted(time_s) for trail in trails]).reshape(-1, 2)
        for part in by_clusters(blob, n, seeds):
            shape = shape_of(blob.pixels[part], blob.weights[part])
            yield Detection(shape=shape, blob=blob, shared=n)

    def _told(self) -> list[Seen]:
        seen = self._trails.told(self.options.n_agents)
        if not seen:
            return []
        xy_px = np.array([trail.xy for trail in seen])
        ahead_px = xy_px + [(math.cos(t.heading_rad), math.sin(t.heading_rad)) for t in seen]
        xy_m = self._projection.to_metres(xy_px)
        ahead_m = self._projection.to_metres(ahead_px) - xy_m
        return [
            Seen(
                agent=trail.agent,
                x_m=float(xy_m[k, 0]),
                y_m=float(xy_m[k, 1]),
                heading_rad=math.atan2(ahead_m[k, 1], ahead_m[k, 0]),
                confidence=trail.confidence(self._bodies.usual),
                x_px=float(trail.xy[0]),
                y_px=float(trail.xy[1]),
                contour_px=trail.blob.contour,
                shared=trail.shared,
                area_px=trail.shape.area_px,
            )
            for k, trail in enumerate(seen)
            if np.isfinite(xy_m[k]).all()
        ]

    def _judge(self, frame: Frame, detections: list[Detection], seen: list[Seen]) -> None:
        """Note what is not as it should be in a frame that could be looked at."""
        n = self.options.n_agents
        if n is not None and len(detections) > n:
            self._note(frame, "too many", f"{len(detections)} blobs, {n} animals expected")
        if n is not None and len(seen) < n:
            self._note(frame, "too few", f"{len(seen)} animals seen, {n} expected")
        most = max((detection.shared for detection in detections), default=1)
        if most > 1:
            self._note(frame, "merged", f"{most} animals in one blob")


def follow(tracker: FishTracker, frames: Iterable[Frame]) -> Iterator[tuple[Frame, list[Seen]]]:
    """Yield every frame with its animals.

    Where the background is to be learnt, the first frames are held back until it is, and then
    looked at: none is lost, and those that follow come without delay.

    Parameters
    ----------
    tracker
        As it was made.
    frames
        Ascending in time.
    """
    held: list[Frame] = []
    for frame in frames:
        if tracker.is_learning:
            tracker.learn(frame)
            held.append(frame)
            if tracker.is_learning and len(held) < _HELD:
                continue
            yield from ((each, tracker.step(each)) for each in held)
            held = []
        else:
            yield frame, tracker.step(frame)
    tracker.stop_learning()
    yield from ((each, tracker.step(each)) for each in held)

"""From frames to tracks of fish: background, blobs, divided, assigned to who was there before.

A tracker is fed frames one by one and knows no files; the same frames give the same tracks.
It is causal: what a frame shows is told before the next one is looked at, except that the
first frames, from which the background is learnt, are looked at twice (`follow`).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence

import cv2
import numpy as np

from zfcal.arrays import Bools, Grey
from zfcal.cameras.camera import Projection
from zfcal.cameras.frames import Frame
from zfcal.cameras.plane import Plane
from zfcal.tracking.background import (
    DARK,
    LIGHT,
    Background,
    BackgroundLearner,
    as_dark,
    grey_of,
    shows_nothing,
    whole,
)
from zfcal.tracking.blobs import Blob
from zfcal.tracking.dividing import divide
from zfcal.tracking.doubting import Doubts
from zfcal.tracking.finding import Finder, soften
from zfcal.tracking.fitting import prepare
from zfcal.tracking.following import Trails
from zfcal.tracking.healing import Healer, healed
from zfcal.tracking.learning import Learnt, learn
from zfcal.tracking.seen import BadFrame, Exchange, Reason, Seen, TrackerOptions
from zfcal.tracking.trail import Detection
from zfcal.tracking.usual import Bodies

_HELD = 500
"""Frames that wait at most for a background; a camera that shows nothing fills no memory."""

_SAME = 0.004
"""A change of brightness by half a grey is none."""

_LOOK_EVERY = 15
"""Frames from one look at what stands out to either side to the next."""

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

    Attributes
    ----------
    learnt
        What the first frames tell of the animals; None before they were looked at.
    """

    def __init__(
        self,
        options: TrackerOptions,
        projection: Projection,
        *,
        background: Background | None = None,
        region: Bools | None = None,
    ) -> None:
        self.options = options
        self._plane = Plane(projection, projection.size_px)
        self._region = region
        self._is_loaded = background is not None
        self._steps = 0
        self._learner = self._new_learner()
        self._finder: Finder | None = None
        self._plain: Background | None = None
        self._doubts = Doubts()
        self._healer = Healer(region)
        self._compared = 0
        self.learnt: Learnt | None = None
        self._bodies = Bodies()
        self._trails = Trails(self._bodies, coast_s=options.coast_s, n_agents=options.n_agents)
        self._bad: list[BadFrame] = []
        prepare()
        if background is not None:
            self._take(background)

    @property
    def background(self) -> Background | None:
        """The empty tank, its negative where fish are light; None while it is learnt."""
        return None if self._finder is None else self._finder.background

    @property
    def is_learning(self) -> bool:
        """Whether the background is still to be learnt."""
        return self._finder is None

    def learn(self, frame: Frame) -> None:
        """Learn the background from a frame, without looking for animals in it."""
        if self._finder is not None:
            return
        grey = grey_of(frame.image)
        if not self._learner.fits(grey):
            return
        self._learner.add(soften(grey, self.options.method))
        if self._learner.is_ready:
            self.stop_learning()

    def stop_learning(self) -> None:
        """Take the background as it was learnt so far, where any frame was of use."""
        if self._finder is not None or not self._learner.count:
            return
        samples = self._learner.samples
        self._learn_from(samples, healed(self._learner.usual(), samples, self._region))
        background = healed(self._learner.freeze(self.polarity), samples, self._region)
        finder = self._take(background)
        samples = [as_dark(grey, background, self.polarity) for grey in samples]
        # The learner's frames are no longer needed: a second of them is as much as the rest.
        self._learner = self._new_learner()
        for _ in range(2):
            # Once for how dark animals are, and again with thresholds that fit.
            found = [finder.find(grey, self._bodies.usual) for grey in samples]
            self._bodies.start(found, self.options.n_agents)
        for grey in samples:
            self._doubts.look(finder.standing_out(grey))

    @property
    def polarity(self) -> str:
        """What animals are taken for: as was said, or learnt, or darker where neither is known."""
        told = self.options.polarity or (self.learnt and self.learnt.polarity)
        return told or DARK

    @property
    def min_blob_px(self) -> float:
        """The smallest blob: as was said, or learnt, or the usual one."""
        if self.options.min_blob_px is not None:
            return self.options.min_blob_px
        return (self.learnt or Learnt()).min_blob_px

    def _learn_from(self, frames: Sequence[Grey], tank: Background) -> None:
        n = self.options.n_agents
        self.learnt = learn(frames, tank, n_agents=n, region=self._region)

    def _learn_on_sight(self, grey: Grey) -> None:
        """Learn from a frame what animals are in a tank that was loaded, until one tells it."""
        is_told = self.learnt is not None and self.learnt.polarity is not None
        if self._plain is None or is_told or self._compared >= self.options.learn_frames:
            return
        if grey.shape == self._plain.level.shape and not shows_nothing(grey):
            self._compared += 1
            self._learn_from([soften(grey, self.options.method)], self._plain)
            self._take(self._plain)

    def _new_learner(self) -> BackgroundLearner:
        options = self.options
        return BackgroundLearner(options.learn_frames, options.learn_rate, region=self._region)

    def _take(self, background: Background) -> Finder:
        self._plain = background
        self._finder = Finder(
            self.options,
            background.as_dark(self.polarity),
            self._region,
            min_blob_px=self.min_blob_px,
            opened=not (self.learnt is not None and self.learnt.is_thin),
        )
        return self._finder

    def take_bad_frames(self) -> list[BadFrame]:
        """Return the frames gone wrong since this was last asked, and forget them."""
        bad, self._bad = self._bad, []
        return bad

    def take_exchanges(self) -> list[Exchange]:
        """Return which ids were exchanged late since this was last asked, and forget it."""
        return self._trails.take_exchanges()

    def step(self, frame: Frame) -> list[Seen]:
        """Return the animals of a frame, ascending by id; none while the background is learnt."""
        if self._finder is None or self._plain is None:
            self._note(frame, "no background", "the background is still being learnt")
            self.learn(frame)
            return []
        if self._is_loaded:
            self._learn_on_sight(whole(grey_of(frame.image)))
        bright = self._comparable(frame)
        if bright is None:
            self._trails.forget(frame.time_s)
            return []
        if self._steps % _LOOK_EVERY == _LOOK_EVERY // 2:
            self._heal(bright, self._plain)
        grey = bright
        if self.polarity != LIGHT:
            grey = as_dark(bright, self._plain, self.polarity)
        blobs = self._finder.find(grey, self._bodies.usual)
        if not self._bodies.usual.area_px > 0:
            self._bodies.start([blobs], self.options.n_agents)
            blobs = self._finder.find(grey, self._bodies.usual)
        detections = divide(
            blobs,
            self._trails.thought_in(blobs, frame.time_s),
            self._bodies.usual,
            n_agents=self.options.n_agents,
            time_s=frame.time_s,
        )
        self._trails.match(detections, frame.time_s)
        if self._steps % _LOOK_EVERY == 0:
            self._doubts.look(self._finder.standing_out(grey))
        self._steps += 1
        seen = self._told(frame.time_s)
        self._judge(frame, detections, seen)
        return seen

    def _note(self, frame: Frame, reason: Reason, says: str) -> None:
        self._bad.append(
            BadFrame(number=frame.number, time_s=frame.time_s, reason=reason, says=says)
        )

    def _comparable(self, frame: Frame) -> Grey | None:
        """Return a frame as bright as the background, its negative where animals are light."""
        background, finder = self._plain, self._finder
        if background is None or finder is None:
            return None
        if frame.size_px != background.size_px:
            has, should = (f"{w} x {h}" for w, h in (frame.size_px, background.size_px))
            self._note(frame, "size", f"the image is {has} px, the background {should} px")
            return None
        grey = whole(grey_of(frame.image))
        if shows_nothing(grey):
            self._note(frame, "black", "the image shows nothing")
            return None
        light = self.polarity == LIGHT
        if light:
            grey, background = ~grey, finder.background
        gain = background.gain(grey)
        if not _DARKEST < gain < _LIGHTEST:
            self._note(frame, "light", f"the image is {gain:.2g} times as bright as the background")
            return None
        if abs(gain - 1) >= _SAME:
            grey = np.asarray(cv2.convertScaleAbs(grey, alpha=1 / gain), np.uint8)
        return soften(grey, self.options.method)

    def _heal(self, bright: Grey, tank: Background) -> None:
        """Take out of the tank what a frame shows to have left it."""
        healed_tank = self._healer.look(~bright if self.polarity == LIGHT else bright, tank)
        if healed_tank is not tank:
            self._take(healed_tank)

    def _told(self, time_s: float) -> list[Seen]:
        seen = self._trails.told(time_s)
        if not seen:
            return []
        usual = self._bodies.usual
        px = [trail.xy for trail in seen]
        px += [(t.xy[0] + math.cos(t.heading_rad), t.xy[1] + math.sin(t.heading_rad)) for t in seen]
        metres = self._plane.to_metres(np.array(px)).tolist()
        return [
            Seen(
                agent=trail.agent,
                track=trail.key,
                x_m=x_m,
                y_m=y_m,
                heading_rad=math.atan2(ahead_m[1] - y_m, ahead_m[0] - x_m),
                confidence=trail.confidence(usual) * self._trust(trail.blob),
                x_px=trail.xy[0],
                y_px=trail.xy[1],
                contour_px=trail.blob.contour,
                shared=trail.shared,
                area_px=trail.shape.area_px,
            )
            for trail, (x_m, y_m), ahead_m in zip(
                seen, metres[: len(seen)], metres[len(seen) :], strict=True
            )
            if math.isfinite(x_m) and math.isfinite(y_m)
        ]

    def _trust(self, blob: Blob) -> float:
        """Return how far a blob can be believed to be more than noise."""
        if self._finder is None:
            return 1.0
        columns, rows = blob.pixels.astype(np.intp).T
        return self._doubts.trust(float(blob.shares @ self._finder.background.level[rows, columns]))

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
        forced = sum(detection.is_forced for detection in detections)
        if forced:
            self._note(frame, "forced", f"{forced} animals in blobs that are not as large")
        animals = sum(map(self._trails.is_animal, detections))
        if n is not None and animals > len(seen):
            self._note(frame, "unclaimed", f"{animals} blobs like animals, {len(seen)} are tracked")


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

"""One track: where it was, where it should be next, and which end is the head."""

from __future__ import annotations

import math
from dataclasses import dataclass

from zfcal.tracking.blobs import FULL, Blob, Shape
from zfcal.tracking.fitting import Build
from zfcal.tracking.usual import Body as Look

_TRUST = 0.7
"""Weight of the newest step in the velocity."""

_KEPT = 0.3
"""Share of its velocity that a fish keeps from one frame to the next: it turns often."""

_GLIDE_S = 0.2
"""An unseen fish is taken to stop after this long."""

_MEMORY = 0.6
"""What is left after a frame of what spoke for an end to be the head."""

_FADING = 0.8
"""What is left of a doubt after a frame."""

_KNOWN = 15
"""Frames after which a measure of one animal is its own."""

_YOUNG = 5
"""Frames for which a track is young."""

_MOVING = 0.05
"""Body lengths per frame from which motion tells the head."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Detection:
    """An animal as one frame shows it.

    Parameters
    ----------
    shape
        Where it is and how it lies.
    blob
        The foreground that it is part of.
    shared
        How many animals are in that.
    own_darkness
        Of its part of a blob that others share; NaN where it was not told apart.
    is_forced
        Whether the blob is not as large as those are together who are taken to be in it.
    """

    shape: Shape
    blob: Blob
    shared: int = 1
    own_darkness: float = math.nan
    is_forced: bool = False

    @property
    def darkness(self) -> float:
        """How dark it is; NaN where that cannot be told."""
        return self.blob.darkness if self.shared == 1 else self.own_darkness

    @property
    def mass(self) -> float:
        """Area times darkness: what tells a lure from a fish, and a large fish from a small one."""
        return self.shape.area_px * self.darkness


class Trail:
    """A track as it grows.

    Parameters
    ----------
    agent
        Its id.
    detection
        As first seen.
    time_s
        When.
    opening
        Whether that was in the first frame of all.
    """

    __slots__ = (
        "_alone",
        "_crowded",
        "_evidence",
        "agent",
        "area_px",
        "blob",
        "darkness",
        "doubt",
        "heading_rad",
        "hits",
        "is_clear",
        "is_told",
        "key",
        "length_px",
        "likeness",
        "mass",
        "missed",
        "opening",
        "own_mass",
        "shape",
        "shared",
        "time_s",
        "velocity",
        "xy",
    )

    def __init__(
        self, agent: int, detection: Detection, time_s: float, *, opening: bool = False
    ) -> None:
        shape = detection.shape
        self.agent = self.key = agent
        self.xy = (shape.x_px, shape.y_px)
        self.velocity = (0.0, 0.0)
        self.time_s = time_s
        self.shape = shape
        self.blob: Blob = detection.blob
        self.area_px = shape.area_px
        self.length_px = shape.length_px
        self.mass = shape.area_px * detection.blob.darkness
        self.heading_rad = shape.axis_rad
        self.own_mass = self.mass
        self.hits = 1
        self.is_clear = False
        self.darkness = detection.darkness
        self.likeness = 0.0
        self.is_told = False
        self.missed = 0
        self.shared = detection.shared
        self.opening = opening
        self.doubt = 0.0
        self._alone = 1 if detection.shared == 1 else 0
        self._crowded = 0
        self._evidence = shape.head

    def predicted(self, time_s: float) -> tuple[float, float]:
        """Return where the animal should be at a time, in pixels, x and y."""
        glide_s = min(time_s - self.time_s, _GLIDE_S)
        (x, y), (across, down) = self.xy, self.velocity
        return x + _KEPT * across * glide_s, y + _KEPT * down * glide_s

    def build(self, usual: Look) -> Build:
        """Return the body as it was when it was alone; the usual where it hardly was."""
        if self._alone < _KNOWN:
            length, area, darkness = usual.length_px, usual.area_px, usual.darkness
        else:
            length, area, darkness = self.length_px, self.area_px, self.mass / self.area_px
        return Build.of(sd_length_px=length, area_px=area, darkness=FULL * darkness)

    def wear(self, look: Look) -> None:
        """Take the look of the animal that the track is believed to be."""
        self._alone = max(self._alone, _KNOWN)
        self.area_px, self.length_px = look.area_px, look.length_px
        self.mass = look.area_px * look.darkness

    def own_area_px(self, usual_px: float) -> float:
        """Return what this animal covers; the usual where it was hardly seen alone."""
        return self.area_px if self._alone >= _KNOWN else usual_px

    def crowd(self, doubtful: bool) -> None:  # noqa: FBT001 - a condition
        """Count a frame in a blob that may be too small for all who are thought to be in it."""
        self._crowded = self._crowded + 1 if doubtful else 0

    @property
    def is_ghost(self) -> bool:
        """Whether it has been in too small a blob for too long to be an animal of its own."""
        return self._crowded > _KNOWN

    def update(self, detection: Detection, time_s: float, *, unsure: bool = False) -> None:
        """Add a sighting; unsure where it might be that of another animal."""
        shape = detection.shape
        moved = (shape.x_px - self.xy[0], shape.y_px - self.xy[1])
        lasted_s = max(time_s - self.time_s, 1e-3)
        step = (moved[0] / lasted_s, moved[1] / lasted_s)
        trust = _TRUST if detection.shared == 1 else _TRUST / 2
        if self.hits > 1:
            step = (
                trust * step[0] + (1 - trust) * self.velocity[0],
                trust * step[1] + (1 - trust) * self.velocity[1],
            )
        self.velocity = step
        self._turn(shape, moved, shared=detection.shared)
        self.is_clear = detection.shared == 1 and self.shared == 1
        self.xy, self.time_s = (shape.x_px, shape.y_px), time_s
        self.shape, self.blob = shape, detection.blob
        self.shared, self.darkness = detection.shared, detection.darkness
        self.hits += 1
        self.doubt = max(_FADING * self.doubt, 0.5 if unsure else 0.0)
        if detection.shared == 1:
            self._alone += 1
            weight = max(0.1, 1 / self._alone)
            self.area_px += weight * (shape.area_px - self.area_px)
            self.length_px += weight * (shape.length_px - self.length_px)
            self.mass += weight * (detection.mass - self.mass)
            self.own_mass = detection.mass

    def confidence(self, usual: Look) -> float:
        """Return how sure the last sighting is, in [0, 1]; below 0.5 it is a guess.

        Whole for an animal alone in its blob; less for one cut out of a crowd, for one of odd
        size or new, and after an assignment that might have been another.
        """
        sure = 1.0 if self.shared == 1 else 0.7
        if usual.area_px > 0:
            # A robot that is known to be large is as large as it should be.
            area_px = self.own_area_px(usual.area_px)
            odd = abs(math.log(max(self.shape.area_px, 1.0) / area_px))
            sure -= min(0.3 * max(odd - 0.3, 0.0), 0.4)
        if self.hits < _YOUNG:
            sure -= 0.1
        return max(sure - self.doubt, 0.1)

    def _turn(self, shape: Shape, moved: tuple[float, float], *, shared: int) -> None:
        """Follow the long axis by its nearer end, and change ends when enough speaks for it."""
        along = math.cos(shape.axis_rad - self.heading_rad)
        near = along >= 0
        heading = shape.axis_rad if near else math.remainder(shape.axis_rad + math.pi, math.tau)
        # A body that turned by nearly a right angle within a frame has no nearer end.
        evidence = _MEMORY * abs(along) * self._evidence
        if shared == 1:
            evidence += (1.0 if near else -1.0) * shape.head
        ahead = (moved[0] * math.cos(heading) + moved[1] * math.sin(heading)) / shape.length_px
        if abs(ahead) > _MOVING:
            evidence += math.copysign(min(2 * abs(ahead), 0.5), ahead)
        if evidence < 0:
            heading = math.remainder(heading + math.pi, math.tau)
        self._evidence = abs(evidence)
        self.heading_rad = heading

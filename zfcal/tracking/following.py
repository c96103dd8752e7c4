"""Who is who from frame to frame: tracks matched with detections, begun and ended."""

from __future__ import annotations

import itertools
import math

import numpy as np

from zfcal.arrays import Floats
from zfcal.tracking._kernels import nearest_squared, step_costs
from zfcal.tracking.assign import Match, assign
from zfcal.tracking.blobs import Blob
from zfcal.tracking.identity import Identities
from zfcal.tracking.seen import Exchange
from zfcal.tracking.trail import Detection, Trail
from zfcal.tracking.usual import Bodies, Body

_REACH = 0.6
_REACH_PER_S = 12.0
_FARTHEST = 4.0
"""Body lengths that an animal may be from where it is expected: at once, per second, at most."""

_NEAR = 0.35
"""Body lengths from a blob within which an animal is thought to be in it."""

_CERTAIN = 0.1
"""Squared body lengths by which another assignment must be worse for a track to be itself again."""

_HIDDEN = 5
"""Frames without a sighting after which an animal is no longer thought to be in a blob."""

_PROVEN = 3
"""Frames after which a new blob is an animal."""

_ALONG = 1.2
"""How much farther a body moves along itself than sideways."""

_HEADING = 0.015
"""Squared body lengths that a turn by a right angle is worth."""

_ALIKE, _SIZE = 0.15, 2.0
"""Another size or darkness by up to a seventh is none; a larger difference, in logarithms and
squared, is worth so many squared body lengths."""

_STAY = 0.3

_NEVER, _DOUBT = 1.0, 0.2
"""Squared body lengths by which an exchange is dearer: from which on there is none, and which
makes it less likely by e."""

_UNSEEN_PER_S = 0.75
"""Chance in a second that two in one blob change places, though nothing else speaks for it."""

_SMALL, _FAINT = 0.35, 0.6
"""Shares of the usual area and darkness below which a blob begins no track."""


class Trails:
    """The tracks of one camera.

    Parameters
    ----------
    bodies
        What an animal looks like; learns from every one that is alone in its blob.
    coast_s
        How long a track that is not seen keeps its id, in seconds.
    """

    def __init__(self, bodies: Bodies, *, coast_s: float, n_agents: int | None = None) -> None:
        self._bodies = bodies
        self._n_agents = n_agents
        self._identities = None if n_agents is None else Identities(n_agents)
        self._mixed: dict[tuple[int, int], float] = {}
        self._coast_s = coast_s
        self._trails: list[Trail] = []
        self._next_id = 0

    def thought_in(self, blobs: list[Blob], time_s: float) -> list[list[Trail]]:
        """Return which tracks should be in each blob: each in the one nearest to it."""
        thought: list[list[Trail]] = [[] for _ in blobs]
        near = _NEAR * self._bodies.length_px
        for trail in self._trails:
            if trail.hits < _PROVEN or trail.missed > _HIDDEN or trail.is_ghost:
                continue
            nearest = _nearest(blobs, trail.predicted(time_s), near)
            if nearest is not None:
                thought[nearest].append(trail)
        return thought

    def match(self, detections: list[Detection], time_s: float) -> None:
        """Give detections to tracks, begin tracks for the others, and end the lost ones."""
        cost = self._costs(detections, time_s)
        ages_s = [time_s - trail.time_s for trail in self._trails]
        gate = np.array([min(_REACH + _REACH_PER_S * age_s, _FARTHEST) for age_s in ages_s]) ** 2
        # Who was there a frame ago comes first: else a lost track takes turns with its successor.
        lost = [t.missed > 0 or t.hits < _PROVEN for t in self._trails]
        matches: list[Match] = []
        for late in (False, True):
            rows = [k for k, is_lost in enumerate(lost) if is_lost == late]
            if not rows:
                continue
            taken = {match.detection for match in matches}
            columns = [k for k in range(len(detections)) if k not in taken]
            matches += assign(cost, gate, rows, columns)
        self._mixed = self._crossings(matches, detections, cost, ages_s)
        self._take(matches, detections, time_s)
        self.forget(time_s)

    def _crossings(
        self, matches: list[Match], detections: list[Detection], cost: Floats, ages_s: list[float]
    ) -> dict[tuple[int, int], float]:
        """Return the chances that tracks, by their keys, have just changed places."""
        mixed = {}
        costs = cost.tolist()
        for one, other in itertools.combinations(matches, 2):
            a, b = detections[one.detection], detections[other.detection]
            dearer = (
                costs[one.track][other.detection]
                + costs[other.track][one.detection]
                - one.cost
                - other.cost
            )
            if dearer < _NEVER:
                chance = 1 / (1 + math.exp(dearer / _DOUBT))
                within = _UNSEEN_PER_S * ages_s[one.track] if a.blob is b.blob else 0.0
                keys = self._trails[one.track].key, self._trails[other.track].key
                mixed[keys] = min(chance + within, 0.5)
        return mixed

    def _costs(self, detections: list[Detection], time_s: float) -> Floats:
        """Return how far each detection is from where each track should be, and how unlike it.

        In body lengths, squared: as errors that are normal add up. Plain distances would let
        animals in a line change places for nothing.
        """
        if not self._trails or not detections:
            return np.empty((len(self._trails), len(detections)))
        unit = self._bodies.length_px
        at = np.array([(*t.predicted(time_s), t.heading_rad) for t in self._trails])
        shapes = [d.shape for d in detections]
        to = np.array([(s.x_px, s.y_px, s.axis_rad, s.head) for s in shapes])
        away = step_costs(at, to, 1 / _ALONG, _HEADING * unit**2) / unit**2
        mass = np.array([[t.mass] for t in self._trails])
        odd = np.abs(np.log(mass / np.array([d.mass for d in detections]))) - _ALIKE
        # Of those that were not told apart nobody knows how dark each is.
        away += _SIZE * np.where(odd > 0, odd, 0.0) ** 2
        return away

    def _take(self, matches: list[Match], detections: list[Detection], time_s: float) -> None:
        for match in matches:
            self._extend(match, detections[match.detection], time_s)
        found = {match.track for match in matches}
        for index, trail in enumerate(self._trails):
            trail.missed = 0 if index in found else trail.missed + 1
        opening = self._next_id == 0
        taken = {match.detection for match in matches}
        for index, detection in enumerate(detections):
            if index not in taken and self.is_animal(detection):
                self._trails.append(Trail(self._new_id(), detection, time_s, opening=opening))
                self._trails[-1].likeness = self._likeness(detection)

    def _extend(self, match: Match, detection: Detection, time_s: float) -> None:
        trail = self._trails[match.track]
        unsure = match.margin < _CERTAIN and (trail.missed > 0 or trail.shared > 1)
        if unsure and detection.shared == 1 and self._identities is None:
            # Who comes out of a crowd is not known: a new id says so.
            trail.agent = self._new_id()
        trail.update(detection, time_s, unsure=unsure)
        trail.likeness += 0.1 * (self._likeness(detection) - trail.likeness)
        if detection.shared == 1 and trail.hits > _PROVEN and trail.is_told:
            self._bodies.add(detection.shape, detection.blob.darkness)

    def _likeness(self, detection: Detection) -> float:
        """Return how like a usual animal's its area and darkness are, in [0, 1]."""
        usual = self._bodies.usual
        area = detection.shape.area_px / usual.area_px
        area = min(area, 1 / area)
        return area * min(detection.blob.darkness / usual.darkness, 1.0)

    def is_animal(self, detection: Detection) -> bool:
        """Return whether a detection is as large and as dark as an animal has to be."""
        usual = self._bodies.usual
        small = detection.shape.area_px < _SMALL * usual.area_px
        return not small and not detection.blob.darkness < _FAINT * usual.darkness

    def _new_id(self) -> int:
        self._next_id += 1
        return self._next_id - 1

    def forget(self, time_s: float) -> None:
        """End tracks that were not seen for long, and at once those that never were proven."""
        self._trails = [
            trail
            for trail in self._trails
            if time_s - trail.time_s <= self._coast_s
            and not (trail.missed and trail.hits < _PROVEN)
        ]

    def take_exchanges(self) -> list[Exchange]:
        """Return the exchanges of ids since this was last asked, and forget them."""
        return [] if self._identities is None else self._identities.take_exchanges()

    def told(self, time_s: float) -> list[Trail]:
        """Return the tracks seen just now, ascending by id; the likeliest if they are too many.

        A new track counts after three frames, or at once in the first frame of all.
        """
        n_agents = self._n_agents
        seen = [t for t in self._trails if not t.missed and (t.hits >= _PROVEN or t.opening)]
        if n_agents is not None and len(seen) > n_agents:
            # Those told a frame ago stay, unless others are clearly likelier.
            seen.sort(key=lambda t: (-t.likeness - _STAY * t.is_told, t.agent))
            seen = seen[:n_agents]
        for trail in self._trails:
            trail.is_told = trail in seen
        if self._identities is not None:
            names = self._identities.step(seen, self._mixed, time_s)
            self._mixed = {}
            for trail in seen:
                trail.agent = names[trail.key]
                look = self._identities.look(trail.agent)
                if look is not None and _fits(trail, look):
                    trail.wear(look)
        return sorted(seen, key=lambda trail: trail.agent)


def _fits(trail: Trail, look: Body) -> bool:
    """Return whether a track that looked so would be taken for what it was last seen as.

    The id of a hand that has left goes over to a fish; as large as the hand it would be lost.
    """
    odd = abs(math.log(look.area_px * look.darkness / trail.own_mass)) - _ALIKE
    return _SIZE * max(odd, 0.0) ** 2 < _REACH**2


def _nearest(blobs: list[Blob], at: tuple[float, float], near: float) -> int | None:
    """Return which blob is nearest to a point; None where all are farther than near."""
    found, least = None, near
    for number, blob in enumerate(blobs):
        x, y, width, height = blob.box
        left, top = at[0] - x, at[1] - y
        if -near <= left <= width + near and -near <= top <= height + near:
            away = math.sqrt(nearest_squared(np.array([at]), blob.pixels)[0])
            if away < least:
                found, least = number, away
    return found

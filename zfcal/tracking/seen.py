"""What a tracker is told and what it tells: options, sightings, frames gone wrong."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from zfcal.errors import InputError
from zfcal.tracking.background import LEARN_FRAMES, LEARN_RATE, POLARITIES

_SHI_TOMASI = "shi-tomasi"
SILHOUETTE = "silhouette"
METHODS = (_SHI_TOMASI, SILHOUETTE)

Reason = Literal[
    "no background",
    "black",
    "size",
    "light",
    "too many",
    "too few",
    "merged",
    "forced",
    "unclaimed",
]


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackerOptions:
    """How fish are tracked.

    Parameters
    ----------
    method
        One of `METHODS`.
    n_agents
        Fish and robots in the tank; None where that is not known.
    min_blob_px
        Blobs of fewer pixels are dropped; None to learn it from the first frames.
    harris
        Harris' corner measure in place of Shi and Tomasi's.
    polarity
        What fish are, compared with the tank: ``dark``, ``light``, or ``either`` for animals of
        both kinds; None to learn it from the first frames.
    learn_frames
        Frames from which the background is learnt.
    learn_rate
        Weight of a new frame while it is learnt.
    coast_s
        How long a track that is not seen keeps its id, in seconds.
    """

    method: str = _SHI_TOMASI
    n_agents: int | None = None
    min_blob_px: float | None = None
    harris: bool = False
    polarity: str | None = None
    learn_frames: int = LEARN_FRAMES
    learn_rate: float = LEARN_RATE
    coast_s: float = 1.0

    def __post_init__(self) -> None:
        if self.method not in METHODS:
            raise InputError(f"A method must be {' or '.join(METHODS)}, got {self.method!r}.")
        _require(
            self.n_agents is None or self.n_agents >= 1, "n_agents", "at least 1", self.n_agents
        )
        smallest = self.min_blob_px
        _require(smallest is None or 0 < smallest < math.inf, "min_blob_px", "positive", smallest)
        known = self.polarity is None or self.polarity in POLARITIES
        _require(known, "polarity", ", ".join(POLARITIES), self.polarity)
        _require(self.learn_frames >= 1, "learn_frames", "at least 1", self.learn_frames)
        _require(0 < self.learn_rate <= 1, "learn_rate", "in (0, 1]", self.learn_rate)
        _require(0 <= self.coast_s < math.inf, "coast_s", "0 or more seconds", self.coast_s)


def _require(holds: bool, name: str, what: str, value: object) -> None:  # noqa: FBT001 - a condition
    if not holds:
        raise InputError(f"A tracker's {name} must be {what}, got {value!r}.")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Seen:
    """An animal in a frame.

    Parameters
    ----------
    agent
        The animal's id where their number is known; else the track's, a new one when in doubt.
    track
        What was followed from frame to frame; an animal's id may go over to another.
    x_m, y_m
        Centroid of the silhouette, in metres.
    heading_rad
        Counter-clockwise from x; NaN where unknown.
    confidence
        In [0, 1]; below 0.5 the position is a guess.
    x_px, y_px
        The same centroid in the image.
    contour_px : ndarray of int32, shape (point, 2)
        Outline of the blob, which holds several animals where ``shared`` is above 1.
    shared
        How many animals the blob holds.
    area_px
        Pixels that this animal covers.
    """

    agent: int
    track: int
    x_m: float
    y_m: float
    heading_rad: float
    confidence: float
    x_px: float
    y_px: float
    contour_px: NDArray[np.int32]
    shared: int = 1
    area_px: float = math.nan


@dataclass(frozen=True, slots=True, kw_only=True)
class Exchange:
    """Two ids that went over to each other's animals, and since when they should have.

    Parameters
    ----------
    one, other
        The ids.
    since_s
        Time of the frame in which the animals had just crossed.
    """

    one: int
    other: int
    since_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class BadFrame:
    """A frame in which something was not as it should be.

    Parameters
    ----------
    number, time_s
        Of the frame.
    reason
        ``no background`` (none was learnt yet), ``black`` (the image shows nothing), ``size``
        (not the background's), ``light`` (far brighter or darker than the background),
        ``too many`` or ``too few`` blobs, ``merged`` (several animals in one blob), ``forced``
        (a blob that was taken for more or fewer animals than it is large for), ``unclaimed`` (a
        blob like an animal that belongs to none who is told).
    says
        What was found, in words.
    """

    number: int
    time_s: float
    reason: Reason
    says: str

"""The robot, by its two LEDs in the image of the camera below.

Both LEDs shine in one colour, so their axis tells the heading but for half a turn.
Which end is the front is told by motion: the robot drives forwards more than backwards.
Once told it is kept, since from one frame to the next the robot turns little. A robot that
stops and then drives back keeps its front for eight centimetres; one that seems to drive back
without having stopped has turned.
"""

from __future__ import annotations

import functools
import itertools
import math
from dataclasses import dataclass
from typing import final

import cv2
import numpy as np

from zfcal.arrays import Floats
from zfcal.cameras.camera import Projection
from zfcal.cameras.frames import Frame, Image
from zfcal.errors import InputError

NEAR_M = 0.05
"""The overhead blob nearest to the LEDs is the robot, if it is no farther than this."""

NEAR_S = 0.05
"""Two images of different cameras belong together if no more lies between them."""

_NATS_PER_M, _NATS = 2000.0, 4.0
"""What a way along the axis tells of where it drives to, by the half millimetre, and at most:
positions are right to a third of one."""

_BACK_NATS_PER_M = 30.0
"""What each metre driven backwards costs: the odds fall by e for every 33 mm."""

_BACK = 0.02
"""Chance of driving backwards, for a robot that was not seen before."""

_STILL_M, _REVERSES_STILL, _REVERSES = 0.0007, 0.05, 1e-6
"""Chances of another gear from one image to the next: of a robot that stood still between the two
before, and of one that was under way, which has to brake first."""

_TELL, _OVERRULE, _SUREST = 2.0, 0.5, 14.0
"""Log odds from which the front is told, from which it is told anew, and at most."""

_TURN_RAD = math.radians(25.0)
_ANY_TURN = 5e-3
"""Turns between two images: small ones, and now and then any: near a quarter it may be either."""

_LOST_S = 1.0
"""A robot that was lost for so long may have turned: its front is told anew."""

_MOST_BLOBS = 5
_KERNEL = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (3, 3))


@dataclass(frozen=True, slots=True, kw_only=True)
class LedOptions:
    """What the LEDs look like.

    Parameters
    ----------
    hue_deg
        Their hue, in degrees (0 red, 120 green, 240 blue); None for any colour.
    hue_width_deg
        How far from it a pixel's hue may be.
    least_saturation, least_value
        Of a pixel, 0 to 255.
    blur_px
        Side of the Gaussian kernel, odd.
    least_px
        Area of the smallest blob that may be an LED.
    apart_m
        Least and greatest distance between the two.
    """

    hue_deg: float | None = None
    hue_width_deg: float = 25.0
    least_saturation: int = 70
    least_value: int = 140
    blur_px: int = 3
    least_px: int = 3
    apart_m: tuple[float, float] = (0.005, 0.06)

    def __post_init__(self) -> None:
        if self.hue_deg is not None and not 0 <= self.hue_deg <= 360:
            raise InputError(f"A hue is an angle from 0 to 360 degrees, got {self.hue_deg!r}.")
        if self.blur_px < 1 or self.blur_px % 2 == 0:
            raise InputError(f"The kernel of a blur has an odd side, got {self.blur_px!r} px.")


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotSeen:
    """Where the robot was in one image of the camera below.

    Parameters
    ----------
    time_s
        Of the image.
    x_m, y_m
        Middle of the LEDs, in metres; NaN where none was seen.
    heading_rad
        Counter-clockwise from x; NaN with one LED, or where the front is not told yet.
    leds_px : tuple of (x, y)
        Two, one or none.
    """

    time_s: float
    x_m: float
    y_m: float
    heading_rad: float
    leds_px: tuple[tuple[float, float], ...]

    @property
    def is_lost(self) -> bool:
        """Whether no LED was seen."""
        return not self.leds_px


@final
class RobotFinder:
    """Finds the robot in one image after the other.

    Parameters
    ----------
    options
        What its LEDs look like.
    projection
        Of the camera below.
    mask : ndarray of uint8, shape (height, width), optional
        Where the robot can be; zero elsewhere.
    """

    def __init__(
        self, options: LedOptions, projection: Projection, *, mask: Image | None = None
    ) -> None:
        self._options = options
        self._projection = projection
        self._mask = mask
        self._front = Front()
        self._last_m: Floats | None = None

    def step(self, frame: Frame) -> RobotSeen:
        """Return where the robot is in the next image."""
        blobs_px = led_blobs(frame.image, self._options, mask=self._mask)
        blobs_m = self._projection.to_metres(blobs_px)
        known = np.isfinite(blobs_m).all(axis=1)
        blobs_px, blobs_m = blobs_px[known], blobs_m[known]
        chosen = self._choose(blobs_m)
        leds_m = blobs_m[chosen]
        middle = leds_m.mean(axis=0) if len(leds_m) else np.full(2, np.nan)
        heading = self._front.step(frame.time_s, middle, _axis(leds_m))
        if len(leds_m):
            self._last_m = middle
        return RobotSeen(
            time_s=frame.time_s,
            x_m=float(middle[0]),
            y_m=float(middle[1]),
            heading_rad=heading,
            leds_px=tuple((float(x), float(y)) for x, y in blobs_px[chosen]),
        )

    def _choose(self, blobs_m: Floats) -> list[int]:
        """Return the first pair, by size, as far apart as the LEDs are; else one blob."""
        low, high = self._options.apart_m
        pairs = [
            (one, other)
            for one, other in itertools.combinations(range(len(blobs_m)), 2)
            if low <= math.dist(blobs_m[one], blobs_m[other]) <= high
        ]
        if pairs:
            return list(min(pairs, key=lambda pair: (sum(pair), pair)))
        if not len(blobs_m):
            return []
        if self._last_m is None:
            return [0]
        return [int(np.argmin(np.linalg.norm(blobs_m - self._last_m, axis=1)))]


def led_blobs(image: Image, options: LedOptions, *, mask: Image | None = None) -> Floats:
    """Return the centres of blobs in the LEDs' colour, the largest first.

    Parameters
    ----------
    image
        Colour, or grey: then brightness alone counts.
    options
        What the LEDs look like.
    mask : ndarray of uint8, shape (height, width), optional
        Zero where nothing is looked for.

    Returns
    -------
    ndarray, shape (blob, 2)
        In pixels, five at most.
    """
    place = _lit(image, options, mask)
    if place is None:
        return np.empty((0, 2))
    bright = _in_colour(np.ascontiguousarray(image[place]), options)
    if mask is not None:
        bright = np.asarray(cv2.bitwise_and(bright, np.ascontiguousarray(mask[place])), np.uint8)
    # An LED that dazzles is a ring with a white middle. What opening would take away are
    # specks, and LEDs at the rim of a fish-eye, which are hardly larger: those go by area.
    closed = cv2.morphologyEx(bright, cv2.MORPH_CLOSE, _KERNEL)
    contours, _ = cv2.findContours(closed, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    found = [
        (area, *_centre(contour))
        for contour in contours
        if (area := max(cv2.contourArea(contour), float(len(contour)))) >= options.least_px
    ]
    found.sort(key=lambda blob: (-blob[0], blob[1], blob[2]))
    corner = (place[1].start, place[0].start)
    return np.array([blob[1:] for blob in found[:_MOST_BLOBS]], np.float64).reshape(-1, 2) + corner


def _lit(image: Image, options: LedOptions, mask: Image | None) -> tuple[slice, slice] | None:
    """Return rows and columns of what is bright at all, which is little; None if nothing is."""
    # A pixel cannot be brighter after the blur than the brightest under its kernel.
    peak = functools.reduce(cv2.max, cv2.split(image)) if image.ndim == 3 else image
    peak = cv2.inRange(peak, options.least_value, 255)
    if mask is not None:
        wide = cv2.dilate(mask, np.ones((options.blur_px, options.blur_px), np.uint8))
        peak = cv2.bitwise_and(peak, wide)
    left, top, width, height = cv2.boundingRect(peak)
    if not width:
        return None
    room = options.blur_px + 4
    return (
        slice(max(top - room, 0), top + height + room),
        slice(max(left - room, 0), left + width + room),
    )


def _centre(contour: cv2.typing.MatLike) -> tuple[float, float]:
    moments = cv2.moments(contour)
    if moments["m00"] > 0:
        return moments["m10"] / moments["m00"], moments["m01"] / moments["m00"]
    x, y = contour[:, 0].mean(axis=0)
    return float(x), float(y)


def _in_colour(image: Image, options: LedOptions) -> Image:
    blurred = cv2.GaussianBlur(image, (options.blur_px, options.blur_px), 0)
    if blurred.ndim == 2:
        return np.asarray(cv2.inRange(blurred, options.least_value, 255), np.uint8)
    hsv = cv2.cvtColor(blurred, cv2.COLOR_BGR2HSV)
    saturation, value = options.least_saturation, options.least_value
    if options.hue_deg is None:
        return np.asarray(cv2.inRange(hsv, (0, saturation, value), (180, 255, 255)), np.uint8)
    # OpenCV's hues are half degrees, and red lies on both sides of 0.
    middle, width = options.hue_deg / 2, options.hue_width_deg / 2
    parts = [
        cv2.inRange(hsv, (low, saturation, value), (high, 255, 255))
        for low, high in _hues(middle, width)
    ]
    return np.asarray(np.bitwise_or.reduce(parts), np.uint8)


def _hues(middle: float, width: float) -> list[tuple[float, float]]:
    return [
        (max(0.0, middle - width + turn), min(180.0, middle + width + turn))
        for turn in (-180, 0, 180)
        if middle + width + turn >= 0 and middle - width + turn <= 180
    ]


def _axis(leds_m: Floats) -> float:
    """Return the angle of the line through both LEDs, or NaN."""
    if len(leds_m) < 2:
        return math.nan
    x, y = leds_m[1] - leds_m[0]
    return math.atan2(y, x)


@final
class Front:
    """Tells which way along its axis the robot looks.

    A filter with four states: which end of the axis is the front, and whether the robot drives
    forwards or backwards. A turn mixes the ends, the less the smaller it is; a robot changes gear
    rarely, and hardly ever while it is under way. So one that seems to back off at full speed,
    after an image in which its axis has turned, has turned by more than a quarter.
    """

    def __init__(self) -> None:
        self._heading_rad = math.nan
        self._is_told = False
        self._time_s = -math.inf
        self._middle_m: Floats = np.full(2, np.nan)
        self._begin(math.nan)

    def step(self, time_s: float, middle_m: Floats, axis_rad: float) -> float:
        """Return the heading; NaN while it is not told.

        Parameters
        ----------
        time_s
            Of the image.
        middle_m : ndarray, shape (2,)
            Middle of the LEDs; NaN where none was seen.
        axis_rad
            Angle of their axis, either way; NaN where it is not known.
        """
        if not math.isfinite(axis_rad):
            return math.nan
        if not time_s - self._time_s <= _LOST_S:
            self._begin(axis_rad)
        else:
            turned_rad = self._turn(axis_rad)
            self._drive(middle_m - self._middle_m, self._heading_rad - turned_rad / 2)
        self._time_s, self._middle_m = time_s, middle_m
        return self._heading_rad if self._is_told else math.nan

    def _begin(self, axis_rad: float) -> None:
        self._heading_rad, self._is_told = _wrapped(axis_rad), False
        self._moved_m = math.inf
        # The end that the heading names is the front, or the other; forwards or backwards.
        self._chance: Floats = np.array([[1 - _BACK, _BACK], [1 - _BACK, _BACK]]) / 2

    def _turn(self, axis_rad: float) -> float:
        """Follow the axis by less than a quarter turn, and return by how much."""
        away = _wrapped(axis_rad - self._heading_rad)
        if abs(away) > math.pi / 2:
            away = _wrapped(away + math.pi)
        self._heading_rad = _wrapped(self._heading_rad + away)
        other = _likely_turn(math.pi - abs(away))
        mixed = other / (other + _likely_turn(abs(away)))
        self._chance = (1 - mixed) * self._chance + mixed * self._chance[::-1]
        return away

    def _drive(self, step_m: Floats, heading_rad: float) -> None:
        """Take what a way says, made with the heading half-way between two images."""
        along_m = float(step_m[0] * math.cos(heading_rad) + step_m[1] * math.sin(heading_rad))
        reverses = _REVERSES_STILL if self._moved_m < _STILL_M else _REVERSES
        chance = (1 - reverses) * self._chance + reverses * self._chance[:, ::-1]
        tells = math.exp(min(max(_NATS_PER_M * along_m, -_NATS), _NATS) / 2)
        chance = chance * np.array([[tells, 1 / tells], [1 / tells, tells]])
        chance[:, 1] *= math.exp(-_BACK_NATS_PER_M * abs(along_m))
        chance = np.maximum(chance / chance.sum(), math.exp(-_SUREST) / 2)
        self._moved_m = float(np.hypot(*step_m))
        odds = math.log(chance[0].sum() / chance[1].sum())
        if odds <= -(_OVERRULE if self._is_told else _TELL):
            self._heading_rad = _wrapped(self._heading_rad + math.pi)
            chance = chance[::-1]
        self._chance = chance
        self._is_told = self._is_told or abs(odds) >= _TELL


def _likely_turn(angle_rad: float) -> float:
    return math.exp(-angle_rad / _TURN_RAD) + _ANY_TURN


def _wrapped(angle_rad: float) -> float:
    return (angle_rad + math.pi) % (2 * math.pi) - math.pi


def nearest_blob(robot: RobotSeen, blobs_m: Floats, time_s: float) -> int | None:
    """Return which overhead blob is the robot; None if none is near enough.

    Parameters
    ----------
    robot
        As the camera below saw it.
    blobs_m : ndarray, shape (blob, 2)
        As the camera overhead saw everybody.
    time_s
        Of the overhead image.
    """
    # A microsecond over is rounding of time stamps.
    if robot.is_lost or not abs(robot.time_s - time_s) <= NEAR_S + 1e-6 or not len(blobs_m):
        return None
    away_m = np.hypot(blobs_m[:, 0] - robot.x_m, blobs_m[:, 1] - robot.y_m)
    nearest = int(np.argmin(away_m))
    return nearest if away_m[nearest] <= NEAR_M else None

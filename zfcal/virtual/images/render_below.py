"""Images of the camera below: the robots' LEDs through a fish-eye lens, on a dim ground.

The two LEDs of a robot have one colour and lie on its axis, half their distance before
and behind its position, on the plane on which that camera is calibrated.
"""

from __future__ import annotations

import math
from typing import final

import numpy as np

from zfcal.arena import Arena
from zfcal.arrays import Floats, Floats32
from zfcal.cameras.camera import Projection
from zfcal.cameras.frames import Image
from zfcal.virtual.images._painting import add_light
from zfcal.virtual.images.look import Look
from zfcal.virtual.images.painting import Fill, Noise, darken, patch_of
from zfcal.virtual.images.swimming import Moment
from zfcal.virtual.images.tank import below_tank

_BELOW = 22
"""Tells the random numbers of images from below from others of the same seed."""

_BRIGHTEST = 250.0
_REACH_PX = 30
_GLOW_PX = 7.0
_SOFT_PX = 0.7
_GHOST_SHARE = 1.06
"""The glass shows an LED again, farther from the middle of the image by this factor."""

_ROBOT_HALF_M = (0.021, 0.011)
_ROBOT_OPACITY = 0.55


@final
class BelowPainter:
    """Draws what the camera below sees.

    Parameters
    ----------
    arena
        The tank.
    camera
        The camera below.
    look
        How things look.
    seed
        Of everything that is random.
    """

    def __init__(self, arena: Arena, camera: Projection, look: Look, *, seed: int) -> None:
        self._camera, self._look, self._seed = camera, look, seed
        self._empty = below_tank(arena, camera, look, seed=seed)
        self._noise = Noise(self._empty.shape, look.below_noise_grey, seed)
        middle = (np.array(camera.size_px) - 1) / 2
        ends = camera.to_metres(middle + np.array([[0.0, 0.0], [1.0, 0.0]]))
        self._radius_px = look.led_radius_m / float(np.hypot(*(ends[1] - ends[0])))

    @property
    def empty(self) -> Image:
        """The view without robots and noise."""
        return self._empty.copy()

    def paint(self, moment: Moment) -> Image:
        """Draw a moment.

        Returns
        -------
        ndarray of uint8, shape (height, width, 3)
            Blue, green, red.
        """
        rng = np.random.default_rng([self._seed, _BELOW, moment.number])
        image = self._empty.copy()
        robots = np.flatnonzero(moment.is_robot)
        for number, body in enumerate(robots):
            xy_m, heading = moment.bodies.xy_m[body], float(moment.bodies.heading_rad[body])
            leds_m = led_places(xy_m, heading, self._look.led_distance_m)
            pixels = self._camera.to_pixels(np.concatenate([leds_m, _hull(xy_m, heading)]))
            if not np.isfinite(pixels).all():
                continue
            self._draw_hull(image, pixels[2:])
            colour = np.roll(self._look.led_colour_bgr, number).astype(np.float32)
            for place in pixels[:2]:
                self._light_up(image, place, colour)
        return self._noise.add_to(image, rng)

    def _draw_hull(self, image: Image, corners_px: Floats) -> None:
        patch = patch_of([Fill(corners_px=corners_px, grey=0.0)], blur_px=_SOFT_PX)
        darken(image, patch, _ROBOT_OPACITY)

    def _light_up(self, image: Image, place_px: Floats, colour: Floats32) -> None:
        """Add an LED: a disc with soft edge, its glow, and its reflection in the glass."""
        look = self._look
        _add_light(image, place_px, self._radius_px, look.led_halo, colour)
        if look.led_reflection > 0:
            middle = (np.array(self._camera.size_px) - 1) / 2
            ghost = middle + _GHOST_SHARE * (place_px - middle) + (3.0, -5.0)
            _add_light(image, ghost, self._radius_px, 0.0, look.led_reflection * colour)


def led_places(xy_m: Floats, heading_rad: float, distance_m: float) -> Floats:
    """Return where the LEDs of a robot are: the front one, then the rear one.

    Parameters
    ----------
    xy_m : ndarray, shape (2,)
        The robot's position: half-way between them.
    heading_rad
        Its heading.
    distance_m
        Between them.

    Returns
    -------
    ndarray, shape (2, 2)
    """
    ahead = distance_m / 2 * np.array([np.cos(heading_rad), np.sin(heading_rad)])
    return np.stack([xy_m + ahead, xy_m - ahead])


def _hull(xy_m: Floats, heading_rad: float) -> Floats:
    """Return the corners of a robot, in metres."""
    long, wide = _ROBOT_HALF_M
    corners = np.array([(long, wide), (-long, wide), (-long, -wide), (long, -wide)])
    cosine, sine = np.cos(heading_rad), np.sin(heading_rad)
    return xy_m + corners @ np.array([[cosine, sine], [-sine, cosine]])


def _add_light(
    image: Image, place_px: Floats, radius_px: float, glow: float, colour: Floats32
) -> None:
    x, y = np.rint(place_px).astype(int)
    reach = _reach_px(radius_px, glow)
    x0, y0 = max(x - reach, 0), max(y - reach, 0)
    x1, y1 = min(x + reach + 1, image.shape[1]), min(y + reach + 1, image.shape[0])
    if x0 >= x1 or y0 >= y1:
        return
    across = np.arange(x0, x1, dtype=np.float32) - np.float32(place_px[0])
    down = np.arange(y0, y1, dtype=np.float32) - np.float32(place_px[1])
    away = np.hypot(across[None], down[:, None])
    disc = 1 / (1 + np.exp(np.clip((away - radius_px) / (_SOFT_PX / 2), -30.0, 30.0)))
    light = disc + glow * np.exp(-((away / _GLOW_PX) ** 2) / 2)
    light *= 1 - _fading(away)
    add_light(image, np.asarray(_BRIGHTEST * light, np.float32), colour, (int(x0), int(y0)))


def _reach_px(radius_px: float, glow: float) -> int:
    """Return how far from its middle a light changes an image: by half a grey level or more."""
    disc = radius_px + _SOFT_PX / 2 * math.log(2 * _BRIGHTEST)
    halo = _GLOW_PX * math.sqrt(2 * math.log(max(2 * _BRIGHTEST * glow, 1.0)))
    # A pixel more: the middle lies between pixels, and where both end they add up.
    return min(math.ceil(max(disc, halo)) + 2, _REACH_PX)


def _fading(away: Floats32) -> Floats32:
    """Return 0 near a light and 1 at the edge of what is drawn of it."""
    return np.clip(away / np.float32(_REACH_PX) * 2 - 1, 0, 1)

"""The empty tank in its two cameras: what stays from image to image.

From above the floor, the arena's walls and the tank around them; from below a dim
support with the reflections of lamps. Photographs may be given instead.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import shapely
from numpy.typing import NDArray

from zfcal.arena import Arena
from zfcal.arrays import Floats32
from zfcal.cameras.camera import Projection
from zfcal.cameras.frames import Image
from zfcal.cameras.rig import WALL_M
from zfcal.virtual.images.look import Look
from zfcal.virtual.images.painting import smooth_field

_FINE = 4
_SHIFT = 6
_CORNER_M = 0.01
"""Straight lines are bent by a lens: they get a corner so often."""

_STRAIGHT = 0.97
"""Cosine of the angle between two walls above which there is no seam between them."""

_ABOVE, _BELOW = 11, 12
"""Tell the random numbers of the two backgrounds from others of the same seed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Tank:
    """An empty tank from above.

    Parameters
    ----------
    image : ndarray of uint8, shape (height, width)
    wall : ndarray of float32, shape (height, width)
        1 where an image of something may appear in a wall, 0 elsewhere.
    """

    image: Image
    wall: Floats32


def overhead_tank(arena: Arena, camera: Projection, look: Look, *, seed: int) -> Tank:
    """Draw an arena's empty tank as the overhead camera sees it.

    Parameters
    ----------
    arena
        Its walls.
    camera
        The overhead camera.
    look
        Light and grey levels.
    seed
        Of the floor's pattern.
    """
    rng = np.random.default_rng([seed, _ABOVE])
    wall = shapely.buffer(arena.outline, 0.9 * WALL_M, join_style="mitre")
    lower = shapely.buffer(arena.outline, 0.35 * WALL_M, join_style="mitre")
    tank = shapely.box(*_square(arena))
    canvas = _Canvas(camera, ground=0.8 * look.wall_grey)
    canvas.fill(tank, look.outside_grey)
    canvas.draw(tank.boundary, 0.85 * look.outside_grey, width_m=0.008)
    canvas.fill(wall, look.wall_grey)
    canvas.fill(lower, look.wall_grey - 12.0)
    canvas.draw(_mitres(arena), 0.8 * look.wall_grey, width_m=0.0015)
    canvas.fill(arena.outline, look.floor_grey)
    canvas.draw(arena.outline.boundary, 0.78 * look.floor_grey, width_m=0.002)
    water = _Canvas(camera, ground=0.0)
    water.fill(arena.outline, 255.0)
    inside = water.image() / np.float32(255.0)
    light = canvas.image() + look.mottle_grey * smooth_field(rng, inside.shape, 12.0)
    light += look.glare_grey * inside * _glare(rng, inside.shape)
    _speckle(light, arena, camera, look, rng)
    light *= _lamp(inside.shape, look.uneven_light)
    if look.defocus_px > 0:
        light = np.asarray(cv2.GaussianBlur(light, (0, 0), look.defocus_px), np.float32)
    return Tank(image=_grey(light), wall=1 - inside)


def below_tank(arena: Arena, camera: Projection, look: Look, *, seed: int) -> Image:
    """Draw what the camera below sees without robots: dim, with the lamps in the glass.

    Parameters
    ----------
    arena
        The tank; from below its edge is seen, and no wall.
    camera
        The camera below.
    look
        Light and grey levels.
    seed
        Of the pattern.

    Returns
    -------
    ndarray of uint8, shape (height, width, 3)
        Blue, green, red.
    """
    rng = np.random.default_rng([seed, _BELOW])
    shape = camera.size_px[1], camera.size_px[0]
    edge = shapely.box(*_square(arena)).boundary
    canvas = _Canvas(camera, ground=look.below_grey)
    canvas.draw(edge, 0.55 * look.below_grey, width_m=0.02)
    canvas.draw(edge, 1.25 * look.below_grey, width_m=0.004)
    light = np.asarray(cv2.GaussianBlur(canvas.image(), (0, 0), 0.8), np.float32)
    light += look.mottle_grey * smooth_field(rng, shape, 15.0)
    light += 2.0 * look.glare_grey * _glare(rng, shape)
    light *= _lamp(shape, 0.3 + 0.5 * look.uneven_light)
    # Daylight through white plastic has a cast.
    return _grey(light[..., None] * np.array([1.04, 1.0, 0.93], np.float32))


def photographed(image: Image, camera: Projection) -> Image:
    """Return a photograph of an empty tank as a grey background in a camera's size."""
    grey = image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
    return np.asarray(cv2.resize(grey, camera.size_px, interpolation=cv2.INTER_AREA), np.uint8)


class _Canvas:
    """A grey image that is painted in metres, finer than it is shown."""

    def __init__(self, camera: Projection, *, ground: float) -> None:
        self._camera = camera
        wide, high = camera.size_px
        self._fine = np.full((high * _FINE, wide * _FINE), round(ground), np.uint8)

    def fill(self, area: shapely.Geometry, grey: float) -> None:
        """Fill polygons; their holes stay as they are."""
        rings = [
            self._points(ring)
            for part in shapely.get_parts(area)
            if not part.is_empty
            for ring in (part.exterior, *part.interiors)
        ]
        if rings:
            cv2.fillPoly(self._fine, rings, _level(grey), shift=_SHIFT)

    def draw(self, lines: shapely.Geometry, grey: float, *, width_m: float) -> None:
        """Draw lines as wide as they are in the tank."""
        self.fill(shapely.buffer(lines, width_m / 2, cap_style="flat"), grey)

    def image(self) -> Floats32:
        """Return the image in the camera's size."""
        small = cv2.resize(self._fine, self._camera.size_px, interpolation=cv2.INTER_AREA)
        return np.asarray(small, np.float32)

    def _points(self, ring: shapely.LinearRing) -> NDArray[np.int32]:
        corners = np.asarray(shapely.segmentize(ring, _CORNER_M).coords, np.float64)[:, :2]
        fine = (self._camera.to_pixels(corners) + 0.5) * _FINE - 0.5
        return np.round(fine * (1 << _SHIFT)).astype(np.int32)


def _square(arena: Arena) -> tuple[float, float, float, float]:
    x0, y0, x1, y1 = arena.outline.bounds
    x, y, half = (x0 + x1) / 2, (y0 + y1) / 2, arena.extent_m / 2 + WALL_M
    return x - half, y - half, x + half, y + half


def _mitres(arena: Arena) -> shapely.MultiLineString:
    """Return the seams of the walls: from each sharp corner outwards, half-way between them."""
    seams = []
    outline = shapely.orient_polygons(arena.outline)
    for ring in (outline.exterior, *outline.interiors):
        corners = np.asarray(ring.coords, np.float64)[:-1, :2]
        ahead = np.roll(corners, -1, axis=0) - corners
        ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
        behind = np.roll(ahead, 1, axis=0)
        cosine = (behind * ahead).sum(axis=1)
        # With the water on the left, outwards is to the right of both walls.
        right = np.stack([(behind + ahead)[:, 1], -(behind + ahead)[:, 0]], axis=1)
        ends = corners + 0.9 * WALL_M * right / np.maximum(1 + cosine, 0.2)[:, None]
        sharp = cosine < _STRAIGHT
        seams += list(zip(corners[sharp], ends[sharp], strict=True))
    return shapely.MultiLineString(seams)


def _glare(rng: np.random.Generator, shape: tuple[int, ...]) -> Floats32:
    """Return the reflections of three lamps, from 0 to 1: long, soft, at random places."""
    y, x = np.mgrid[: shape[0], : shape[1]].astype(np.float32)
    total = np.zeros(shape, np.float32)
    for _ in range(3):
        at = rng.uniform(0.15, 0.85, 2) * (shape[1], shape[0])
        angle = rng.uniform(0, np.pi)
        u = (x - at[0]) * np.cos(angle) + (y - at[1]) * np.sin(angle)
        v = (y - at[1]) * np.cos(angle) - (x - at[0]) * np.sin(angle)
        total += np.exp(-((u / 60.0) ** 2) - (v / 14.0) ** 2)
    return np.minimum(total, 1.0).astype(np.float32)


def _lamp(shape: tuple[int, ...], uneven: float) -> Floats32:
    """Return the light: 1 a little off the middle, and less towards the corners."""
    y, x = np.mgrid[: shape[0], : shape[1]].astype(np.float32)
    distance = np.hypot(x / shape[1] - 0.46, y / shape[0] - 0.42)
    return np.asarray(1.0 - uneven * (distance / distance.max()) ** 2, np.float32)


def _speckle(
    light: Floats32, arena: Arena, camera: Projection, look: Look, rng: np.random.Generator
) -> None:
    """Strew dark specks of a millimetre or two over the floor, in place."""
    x0, y0, x1, y1 = arena.outline.bounds
    n = rng.poisson(look.specks * (x1 - x0) * (y1 - y0))
    places = rng.uniform((x0, y0), (x1, y1), (n, 2))
    dark = rng.uniform(0.55, 0.9, n)
    columns, rows = np.rint(camera.to_pixels(places)).astype(int).T
    high, wide = light.shape
    seen = shapely.contains_xy(arena.outline, *places.T)
    seen &= (columns >= 0) & (columns < wide) & (rows >= 0) & (rows < high)
    light[rows[seen], columns[seen]] *= dark[seen].astype(np.float32)


def _grey(light: Floats32) -> Image:
    return np.rint(np.clip(light, 0, 255)).astype(np.uint8)


def _level(grey: float) -> float:
    return float(min(max(grey, 0.0), 255.0))

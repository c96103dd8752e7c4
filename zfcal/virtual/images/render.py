"""Images of a tank from positions: what the two cameras would have seen.

A painter draws each moment by itself: the same moment and seed give the same image,
whatever was drawn before. Cameras, files and time are the business of others.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import final

import cv2
import numpy as np

from zfcal.arena import Arena
from zfcal.arrays import Floats
from zfcal.cameras.camera import Projection
from zfcal.cameras.frames import Image
from zfcal.virtual.images.bodies import Outlines, outlines_of
from zfcal.virtual.images.look import Look
from zfcal.virtual.images.painting import Fill, Noise, Patch, darken, lay_over, mean_patch, patch_of
from zfcal.virtual.images.ripples import Ripples
from zfcal.virtual.images.swimming import Moment
from zfcal.virtual.images.tank import overhead_tank, photographed

_OVERHEAD = 21
"""Tells the random numbers of overhead images from others of the same seed."""

_SECTIONS = ((1, 9), (8, 16), (15, 21))
"""Stations of head, trunk and tail; the ends are left out, so that all lie within the body."""

_BACK_SHARE = 0.55
"""Of the body's width: the back, between the flanks."""

_STEP_PX = 0.7
"""A body that moves farther while the shutter is open is drawn several times."""

_MOST_STEPS = 5
_ASIDE_RAD = 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class _Seen:
    """A body in pixels."""

    left_px: Floats
    right_px: Floats
    fin_px: Floats
    moved_px: Floats
    shadow_px: Floats
    is_robot: bool
    contrast: float


@final
class OverheadPainter:
    """Draws what the overhead camera sees.

    Parameters
    ----------
    arena
        The tank.
    camera
        The overhead camera.
    look
        How things look.
    seed
        Of everything that is random.
    photograph
        Of the empty tank, instead of a drawn one.
    """

    def __init__(
        self,
        arena: Arena,
        camera: Projection,
        look: Look,
        *,
        seed: int,
        photograph: Image | None = None,
    ) -> None:
        self._camera, self._look, self._seed = camera, look, seed
        self._walls = _Walls(arena)
        tank = overhead_tank(arena, camera, look, seed=seed)
        self._wall = tank.wall
        self._empty = tank.image if photograph is None else photographed(photograph, camera)
        self._noise = Noise(self._empty.shape, look.noise_grey, seed)
        scale = _px_per_m(arena, camera)
        self._ripples = Ripples(self._empty.shape, look.ripple_grey, look.ripple_m * scale, seed)
        self._shadow_blur_px = look.shadow_blur_m * scale

    @property
    def empty(self) -> Image:
        """The tank without anybody, noise and ripples."""
        return self._empty.copy()

    def paint(self, moment: Moment) -> Image:
        """Draw a moment.

        Returns
        -------
        ndarray of uint8, shape (height, width)
        """
        look = self._look
        rng = np.random.default_rng([self._seed, _OVERHEAD, moment.number])
        image = self._ripples.add_to(self._empty, moment.time_s)
        if look.flicker > 0:
            light = 1.0 + look.flicker * rng.standard_normal()
            image = np.asarray(cv2.convertScaleAbs(image, alpha=light), np.uint8)
        if len(moment.bodies):
            self._draw_bodies(image, moment)
        return self._noise.add_to(image, rng)

    def _draw_bodies(self, image: Image, moment: Moment) -> None:
        look = self._look
        outlines = outlines_of(moment.bodies)
        seen = self._seen(outlines, moment)
        patches = [self._patch(body) for body in seen]
        if look.shadow_opacity > 0:
            for body, patch in zip(seen, patches, strict=True):
                darken(image, self._shadow(patch, body.shadow_px), look.shadow_opacity)
        if look.reflection > 0:
            self._draw_reflections(image, outlines, moment)
        # The robots first: fish swim over them.
        for _, patch in sorted(
            zip(seen, patches, strict=True), key=lambda pair: not pair[0].is_robot
        ):
            lay_over(image, patch)

    def _seen(self, outlines: Outlines, moment: Moment) -> list[_Seen]:
        """Return the bodies in pixels; one that the lens cannot see is left out."""
        look, xy_m = self._look, moment.bodies.xy_m[:, None]
        moved_m = moment.velocity_m_s[:, None] * look.exposure_s / 2
        parts = [
            outlines.left_m,
            outlines.right_m,
            outlines.fin_m,
            np.concatenate(
                [xy_m - moved_m, xy_m + moved_m, xy_m, xy_m + look.shadow_offset_m], axis=1
            ),
        ]
        # One call for all: it costs more than the points.
        pixels = self._camera.to_pixels(np.concatenate(parts, axis=1))
        contrasts = moment.bodies.contrast
        if contrasts is None:
            contrasts = np.ones(len(moment.bodies))
        edges = np.cumsum([part.shape[1] for part in parts])[:-1]
        return [
            _Seen(
                left_px=left,
                right_px=right,
                fin_px=fin,
                moved_px=rest[1] - rest[0],
                shadow_px=rest[3] - rest[2],
                is_robot=bool(is_robot),
                contrast=float(contrast),
            )
            for is_robot, contrast, *(left, right, fin, rest) in zip(
                moment.is_robot, contrasts, *np.split(pixels, edges, axis=1), strict=True
            )
            if np.isfinite(left).all() and np.isfinite(right).all() and np.isfinite(fin).all()
        ]

    def _patch(self, body: _Seen) -> Patch:
        n = 1 + int(np.hypot(*body.moved_px) / _STEP_PX)
        fills = _fills(body, self._look)
        return _blurred(fills, body.moved_px, min(n, _MOST_STEPS), self._look.defocus_px)

    def _shadow(self, patch: Patch, offset_px: Floats) -> Patch:
        blur_px = self._shadow_blur_px
        edge = int(np.ceil(2.5 * blur_px))
        cover = cv2.copyMakeBorder(patch.cover, edge, edge, edge, edge, cv2.BORDER_CONSTANT)
        soft = cv2.GaussianBlur(cover, (0, 0), blur_px) if blur_px > 0 else cover
        x, y = np.rint(offset_px).astype(int) - edge
        at = patch.corner_px[0] + int(x), patch.corner_px[1] + int(y)
        return Patch(corner_px=at, cover=np.asarray(soft, np.float32), ink=patch.ink)

    def _draw_reflections(self, image: Image, outlines: Outlines, moment: Moment) -> None:
        look = self._look
        for body, xy_m in enumerate(moment.bodies.xy_m):
            for origin, normal, distance_m in self._walls.near(xy_m, look.reflection_reach_m):
                ring = outlines.silhouette_m[body]
                mirrored = ring - 2 * ((ring - origin) @ normal)[:, None] * normal
                corners_px = self._camera.to_pixels(mirrored)
                if not np.isfinite(corners_px).all():
                    continue
                fill = Fill(corners_px=corners_px, grey=0.0)
                patch = patch_of([fill], blur_px=1.0 + look.defocus_px)
                near = 1.0 - distance_m / look.reflection_reach_m
                darken(image, patch, look.reflection * near, self._wall)


def _fills(body: _Seen, look: Look) -> list[Fill]:
    """Return the polygons of a body: a fish with its fin, or a lure without."""
    left, right = body.left_px, body.right_px
    ring = np.concatenate([left, right[::-1]])
    if body.is_robot:
        return [Fill(corners_px=ring, grey=look.lure_grey)]
    head, tail = (
        min(max(look.floor_grey - body.contrast * (look.floor_grey - grey), 0.0), 255.0)
        for grey in (look.fish_grey, look.tail_grey)
    )
    shades = np.linspace(head, tail, len(_SECTIONS))
    flank = (head + tail) / 2 + look.stripe_grey
    middle = (left + right) / 2
    fills = []
    if look.fin_opacity > 0:
        fills.append(Fill(corners_px=body.fin_px, grey=tail, opacity=look.fin_opacity))
    fills.append(Fill(corners_px=ring, grey=min(flank, 255.0)))
    sides = (middle + _BACK_SHARE * (left - middle), middle + _BACK_SHARE * (right - middle))
    for (start, end), shade in zip(_SECTIONS, shades, strict=True):
        back = np.concatenate([sides[0][start:end], sides[1][start:end][::-1]])
        fills.append(Fill(corners_px=back, grey=shade, inner=True))
    return fills


def _blurred(fills: list[Fill], moved_px: Floats, n: int, defocus_px: float) -> Patch:
    """Return the mean of a body's patches along its way, around the middle of the exposure."""
    if n == 1:
        return patch_of(fills, blur_px=defocus_px)
    shares = (np.arange(n) + 0.5) / n - 0.5
    return mean_patch(
        [
            patch_of(
                [
                    dataclasses.replace(fill, corners_px=fill.corners_px + share * moved_px)
                    for fill in fills
                ],
                blur_px=defocus_px,
            )
            for share in shares
        ]
    )


@final
class _Walls:
    """The walls of an arena, as mirrors."""

    def __init__(self, arena: Arena) -> None:
        self._start, end = arena.segments_m[:, :2], arena.segments_m[:, 2:]
        along = end - self._start
        self._length_m = np.hypot(along[:, 0], along[:, 1])
        self._unit = along / self._length_m[:, None]
        self._normal = np.stack([-self._unit[:, 1], self._unit[:, 0]], axis=1)

    def near(self, xy_m: Floats, reach_m: float) -> list[tuple[Floats, Floats, float]]:
        """Return a point, the normal and the distance of at most two walls within reach."""
        to = xy_m - self._start
        distance_m = np.abs((to * self._normal).sum(axis=1))
        if not (distance_m < reach_m).any():
            return []
        foot = (to * self._unit).sum(axis=1)
        beside = (foot >= 0) & (foot <= self._length_m) & (distance_m < reach_m)
        found: list[tuple[Floats, Floats, float]] = []
        for wall in np.flatnonzero(beside)[np.argsort(distance_m[beside])]:
            normal = self._normal[wall]
            turned = [abs(normal @ other) < np.cos(_ASIDE_RAD) for _, other, _ in found]
            if all(turned):
                found.append((self._start[wall], normal, float(distance_m[wall])))
            if len(found) == 2:
                break
        return found


def _px_per_m(arena: Arena, camera: Projection) -> float:
    """Return the scale in the middle of the arena."""
    x0, y0, x1, y1 = arena.outline.bounds
    middle = np.array([(x0 + x1) / 2, (y0 + y1) / 2])
    ends = camera.to_pixels(middle + np.array([[-0.01, 0.0], [0.01, 0.0]]))
    return float(np.hypot(*(ends[1] - ends[0])) / 0.02)

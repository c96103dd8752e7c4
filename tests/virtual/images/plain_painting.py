"""Painting written plainly, as it was before it was compiled: twins of what draws images.

Each takes what its compiled twin takes and gives the same bits.
"""

import cv2
import numpy as np

from zfcal.virtual.images.painting import FINE, Patch

SHIFT = 6
SHARPEST = 0.3
BRIGHTEST, REACH_PX, GLOW_PX, SOFT_PX = 250.0, 30, 7.0, 0.7


def inset(corners):
    """Return a polygon moved inwards by half a pixel, along the mitres of its corners."""
    along = np.concatenate([corners[1:], corners[:1]]) - corners
    area = float(corners[:, 0] @ along[:, 1] - corners[:, 1] @ along[:, 0])
    length = np.hypot(along[:, 0], along[:, 1])
    after = along / np.maximum(length, 1e-9)[:, None]
    before = np.concatenate([after[-1:], after[:-1]])
    mitre = 0.5 * np.sign(area) / np.maximum(1 + (after * before).sum(axis=1), SHARPEST)
    inwards = (after + before) * mitre[:, None]
    return np.stack([corners[:, 0] - inwards[:, 1], corners[:, 1] + inwards[:, 0]], axis=1)


def fine_points(corners_px, low, *, inner):
    """Return the corners of a polygon in 64ths of fine pixels."""
    corners = (corners_px - np.array(low) + 0.5) * FINE - 0.5
    corners = corners if inner else inset(corners)
    return np.round(corners * (1 << SHIFT)).astype(np.int32)


def block_means(fine):
    """Return the rounded means of blocks."""
    high, wide = fine.shape[0] // FINE, fine.shape[1] // FINE
    return cv2.resize(fine, (wide, high), interpolation=cv2.INTER_AREA).astype(np.float32)


def patch_of(fills, *, blur_px=0.0):
    """Paint polygons, the later over the earlier ones."""
    corners = np.concatenate([fill.corners_px for fill in fills])
    margin = 1 + int(np.ceil(3 * blur_px))
    low = np.floor(corners.min(axis=0)).astype(int) - margin
    wide, high = np.ceil(corners.max(axis=0)).astype(int) + margin + 1 - low
    fine = np.zeros((high * FINE, wide * FINE, 2), np.uint8)
    for fill in fills:
        points = fine_points(fill.corners_px, low, inner=fill.inner)
        cv2.fillPoly(fine, [points], (255 * fill.opacity, fill.grey * fill.opacity), shift=SHIFT)
    both = block_means(fine)
    if blur_px > 0:
        both = cv2.GaussianBlur(both, (0, 0), blur_px)
    return Patch(corner_px=(int(low[0]), int(low[1])), cover=both[..., 0] / 255.0, ink=both[..., 1])


def inside(image, patch):
    """Return what of an image a patch covers, and what of the patch that is."""
    x, y = patch.corner_px
    high, wide = patch.cover.shape
    x0, y0 = max(x, 0), max(y, 0)
    x1, y1 = min(x + wide, image.shape[1]), min(y + high, image.shape[0])
    if x0 >= x1 or y0 >= y1:
        return np.s_[:0, :0], np.s_[:0, :0]
    return np.s_[y0:y1, x0:x1], np.s_[y0 - y : y1 - y, x0 - x : x1 - x]


def lay_over(image, patch):
    """Lay a patch over a grey image, in place."""
    here, there = inside(image, patch)
    under = image[here] * (1.0 - patch.cover[there])
    image[here] = np.rint(np.clip(under + patch.ink[there], 0, 255)).astype(np.uint8)


def darken(image, patch, opacity, only=None):
    """Take light from an image where a patch covers it, in place."""
    here, there = inside(image, patch)
    taken = opacity * patch.cover[there]
    if only is not None:
        taken = taken * only[here]
    taken = taken if image.ndim == 2 else taken[..., None]
    image[here] = np.rint(image[here] * (1.0 - taken)).astype(np.uint8)


def add_field(image, field, top, left):
    """Return an image with a part of a field added."""
    high, wide = image.shape
    return cv2.add(image, field[top : top + high, left : left + wide], dtype=cv2.CV_8U)


def add_fields(image, one, other, places):
    """Return an image with parts of two fields added together."""
    high, wide = image.shape
    cuts = [
        field[y : y + high, x : x + wide]
        for field, (y, x) in zip((one, other), places, strict=True)
    ]
    return cv2.add(image, cuts[0] + cuts[1], dtype=cv2.CV_8U)


def add_light(image, place_px, radius_px, glow, colour):
    """Add an LED's light to an image as far as it was ever drawn, in place."""
    x, y = np.rint(place_px).astype(int)
    x0, y0 = max(x - REACH_PX, 0), max(y - REACH_PX, 0)
    x1, y1 = min(x + REACH_PX + 1, image.shape[1]), min(y + REACH_PX + 1, image.shape[0])
    if x0 >= x1 or y0 >= y1:
        return
    across = np.arange(x0, x1, dtype=np.float32) - np.float32(place_px[0])
    down = np.arange(y0, y1, dtype=np.float32) - np.float32(place_px[1])
    away = np.hypot(across[None], down[:, None])
    disc = 1 / (1 + np.exp(np.clip((away - radius_px) / (SOFT_PX / 2), -30.0, 30.0)))
    light = disc + glow * np.exp(-((away / GLOW_PX) ** 2) / 2)
    light *= 1 - np.clip(away / np.float32(REACH_PX) * 2 - 1, 0, 1)
    total = image[y0:y1, x0:x1] + BRIGHTEST * light[..., None] * colour
    image[y0:y1, x0:x1] = np.rint(np.minimum(total, 255.0)).astype(np.uint8)


def near_walls(arena, xy_m, reach_m):
    """Return a point, the normal and the distance of at most two walls within reach."""
    start, end = arena.segments_m[:, :2], arena.segments_m[:, 2:]
    along = end - start
    length_m = np.hypot(along[:, 0], along[:, 1])
    unit = along / length_m[:, None]
    foot = ((xy_m - start) * unit).sum(axis=1)
    normal = np.stack([-unit[:, 1], unit[:, 0]], axis=1)
    distance_m = np.abs(((xy_m - start) * normal).sum(axis=1))
    beside = (foot >= 0) & (foot <= length_m) & (distance_m < reach_m)
    found = []
    for wall in np.flatnonzero(beside)[np.argsort(distance_m[beside])]:
        if all(abs(normal[wall] @ other) < np.cos(0.5) for _, other, _ in found):
            found.append((start[wall], normal[wall], float(distance_m[wall])))
    return found[:2]

"""What is compiled of painting: noise, edges between pixels, bodies over the tank, lights.

Formulas on arrays alone; what they are for is told by who calls them. Arrays are contiguous,
and numbers single where those of images are, so that a pixel comes out as NumPy would have it.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Floats, Floats32, Grey, Ints
from zfcal.cameras._kernels import kernel

Field = NDArray[np.int16]
Points = NDArray[np.int32]


@kernel
def add_field(image: Grey, field: Field, top: int, left: int) -> Grey:
    """Return an image with the part of a field that begins at a place added, from 0 to 255.

    Parameters
    ----------
    image : ndarray of uint8, shape (row, column)
        Several channels lie side by side.
    field : ndarray of int16, larger
    top, left
        Where the part begins.
    """
    high, wide = image.shape
    found = np.empty_like(image)
    for y in range(high):
        here, there, out = image[y], field[top + y, left : left + wide], found[y]
        for x in range(wide):
            # Single numbers hold all sums exactly, and eight or sixteen are added at a time.
            value = np.float32(here[x]) + np.float32(there[x])
            out[x] = np.uint8(min(max(value, np.float32(0.0)), np.float32(255.0)))
    return found


@kernel
def add_fields(image: Grey, one: Field, other: Field, places: Ints) -> Grey:
    """Return an image with parts of two fields added together, from 0 to 255.

    Parameters
    ----------
    image : ndarray of uint8, shape (row, column)
    one, other : ndarray of int16, larger
    places : ndarray of int64, shape (2, 2)
        Row and column where the part of each begins.
    """
    high, wide = image.shape
    found = np.empty_like(image)
    for y in range(high):
        here, out = image[y], found[y]
        first = one[places[0, 0] + y, places[0, 1] : places[0, 1] + wide]
        second = other[places[1, 0] + y, places[1, 1] : places[1, 1] + wide]
        for x in range(wide):
            value = np.float32(here[x]) + (np.float32(first[x]) + np.float32(second[x]))
            out[x] = np.uint8(min(max(value, np.float32(0.0)), np.float32(255.0)))
    return found


@kernel
def _inset(corners: Floats, sharpest: float) -> Floats:
    """Return a polygon moved inwards by half a pixel.

    Both edges of a corner move by the half: the corner moves along the mitre, but not far.
    """
    n = len(corners)
    along = np.empty((n, 2))
    area = 0.0
    for k in range(n):
        for axis in range(2):
            along[k, axis] = corners[(k + 1) % n, axis] - corners[k, axis]
        area += corners[k, 0] * along[k, 1] - corners[k, 1] * along[k, 0]
    for k in range(n):
        length = max(math.hypot(along[k, 0], along[k, 1]), 1e-9)
        along[k, 0], along[k, 1] = along[k, 0] / length, along[k, 1] / length
    found = np.empty((n, 2))
    for k in range(n):
        turn = along[k, 0] * along[k - 1, 0] + along[k, 1] * along[k - 1, 1]
        mitre = 0.5 * np.sign(area) / max(1 + turn, sharpest)
        found[k, 0] = corners[k, 0] - (along[k, 1] + along[k - 1, 1]) * mitre
        found[k, 1] = corners[k, 1] + (along[k, 0] + along[k - 1, 0]) * mitre
    return found


@kernel
def fine_points(
    corners_px: Floats, low: tuple[int, int], side: int, scale: float, sharpest: float
) -> Points:
    """Return the corners of a polygon in fine pixels, as whole parts of them.

    Parameters
    ----------
    corners_px : ndarray, shape (corner, 2)
    low
        Column and row of the pixel in whose corner the fine ones begin.
    side
        Fine pixels along the side of a pixel.
    scale
        Parts of a fine pixel.
    sharpest
        The polygon is moved inwards by half a fine pixel: one and the cosine of the angle by
        which it turns at a corner, at least. 0: it is not moved.

    Returns
    -------
    ndarray of int32, shape (corner, 2)
    """
    corners = np.empty(corners_px.shape)
    for k in range(len(corners)):
        for axis in range(2):
            # A pixel's centre has whole coordinates, so its left edge lies at -1/2.
            corners[k, axis] = (corners_px[k, axis] - low[axis] + 0.5) * side - 0.5
    if sharpest > 0:
        corners = _inset(corners, sharpest)
    found = np.empty(corners.shape, np.int32)
    for k in range(len(corners)):
        for axis in range(2):
            found[k, axis] = np.int32(np.rint(corners[k, axis] * scale))
    return found


@kernel
def block_means(fine: Grey, side: int) -> Floats32:
    """Return the rounded means of square blocks of an image with two channels.

    Parameters
    ----------
    fine : ndarray of uint8, shape (row, column, 2)
    side
        Of a block: at most 16, so that sums of columns have room.

    Returns
    -------
    ndarray of float32, shape (row / side, column / side, 2)
        Whole numbers; halves are rounded to even ones.
    """
    high, wide = fine.shape[0] // side, fine.shape[1] // side
    flat = fine.reshape(fine.shape[0], -1)
    found = np.empty((high, wide, 2), np.float32)
    columns = np.empty(flat.shape[1], np.uint16)
    for i in range(high):
        columns[:] = 0
        for row in range(side):
            line = flat[i * side + row]
            for x in range(columns.size):
                columns[x] += line[x]
        for j in range(wide):
            for channel in range(2):
                total = 0
                for x in range(side):
                    total += columns[2 * (j * side + x) + channel]
                found[i, j, channel] = np.rint(total / (side * side))
    return found


@kernel
def lay_over(image: Grey, cover: Floats32, ink: Floats32, corner: tuple[int, int]) -> None:
    """Lay a patch over a grey image, in place; what lies outside the image is cut off.

    Parameters
    ----------
    image : ndarray of uint8, shape (height, width)
    cover, ink : ndarray of float32, shape (row, column)
    corner
        Column and row where in the image the patch begins.
    """
    left, top = corner
    one, most = np.float32(1.0), np.float32(255.0)
    for row in range(max(0, -top), min(len(cover), len(image) - top)):
        for column in range(max(0, -left), min(cover.shape[1], image.shape[1] - left)):
            y, x = row + top, column + left
            seen = np.float32(image[y, x]) * (one - cover[row, column]) + ink[row, column]
            image[y, x] = np.uint8(np.rint(min(max(seen, np.float32(0.0)), most)))


@kernel
def darken(
    image: Grey, cover: Floats32, opacity: float, only: Floats32, corner: tuple[int, int]
) -> None:
    """Take light from an image where a patch covers it, in place.

    Parameters
    ----------
    image : ndarray of uint8, shape (height, width, channel)
    cover : ndarray of float32, shape (row, column)
    opacity
        Share of the light that is taken.
    only : ndarray of float32, shape (height, width)
        Where and how much; everywhere if it is empty.
    corner
        Column and row where in the image the patch begins.
    """
    left, top = corner
    one, share = np.float32(1.0), np.float32(opacity)
    for row in range(max(0, -top), min(len(cover), len(image) - top)):
        for column in range(max(0, -left), min(cover.shape[1], image.shape[1] - left)):
            y, x = row + top, column + left
            taken = share * cover[row, column]
            if only.size:
                taken = taken * only[y, x]
            for channel in range(image.shape[2]):
                seen = np.float32(image[y, x, channel]) * (one - taken)
                image[y, x, channel] = np.uint8(np.rint(seen))


@kernel
def add_light(image: Grey, light: Floats32, colour: Floats32, corner: tuple[int, int]) -> None:
    """Add coloured light to an image, in place.

    Parameters
    ----------
    image : ndarray of uint8, shape (height, width, channel)
    light : ndarray of float32, shape (row, column)
        All of it within the image.
    colour : ndarray of float32, shape (channel,)
    corner
        Column and row where in the image the light begins.
    """
    left, top = corner
    most = np.float32(255.0)
    for row in range(light.shape[0]):
        for column in range(light.shape[1]):
            y, x = row + top, column + left
            for channel in range(image.shape[2]):
                seen = np.float32(image[y, x, channel]) + light[row, column] * colour[channel]
                image[y, x, channel] = np.uint8(np.rint(min(seen, most)))


def prepare() -> None:
    """Compile all, so that no frame has to wait for it."""
    image, field = np.zeros((1, 1), np.uint8), np.zeros((1, 1), np.int16)
    add_field(image, field, 0, 0)
    add_fields(image, field, field, np.zeros((2, 2), np.int64))
    fine_points(np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]), (0, 0), 1, 1.0, 0.3)
    block_means(np.zeros((1, 1, 2), np.uint8), 1)
    cover = np.zeros((1, 1), np.float32)
    lay_over(image, cover, cover, (0, 0))
    darken(image[..., None], cover, 0.5, cover, (0, 0))
    add_light(image[..., None], cover, np.ones(1, np.float32), (0, 0))

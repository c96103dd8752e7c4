"""Which of two images has an edge where they differ: what is there, or its ghost.

The empty tank is even, or its edges run on: where something was taken for tank that has left, or
for an animal that sits, the wrong image has a step all along the border of that piece, and the
right one has none. So nothing is asked of its size, its shade, or for how long it was there. What
is made of it, a tank or a count, is the business of others.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Bools, Floats32, Grey

_SURROUNDINGS_PX = 3
_SQUARE = np.ones((3, 3), np.uint8)
_WIDE = np.ones((2 * _SURROUNDINGS_PX - 1,) * 2, np.uint8)
_ACROSS = (2 * _SURROUNDINGS_PX + 1,) * 2


class Piece(NamedTuple):
    """What hangs together in a mask, cut out of the image.

    Parameters
    ----------
    crop
        Rows and columns of the image that hold it and its surroundings.
    inside, around : ndarray of bool, shape (row, column)
        Its pixels in that part, and those two to three pixels beside it.
    number
        Its label.
    """

    crop: tuple[slice, slice]
    inside: Bools
    around: Bools
    number: int

    def within(self, where: Bools) -> Piece:
        """Return it with those surroundings alone that lie somewhere."""
        return self._replace(around=self.around & where[self.crop])


def pieces_of(labels: NDArray[np.int32], boxes: NDArray[np.int32], asked: Bools) -> Iterator[Piece]:
    """Yield the pieces of a labelled mask that are asked for and have surroundings.

    Parameters
    ----------
    labels : ndarray, shape (height, width)
        0 where nothing is.
    boxes : ndarray, shape (label, 5)
        Left, top, width, height and area of each label.
    asked : ndarray of bool, shape (label,)
        Label 0, where nothing is, is none.
    """
    for number in (np.flatnonzero(asked[1:]) + 1).tolist():
        x, y, width, height = boxes[number, :4].tolist()
        top, left = max(y - _SURROUNDINGS_PX, 0), max(x - _SURROUNDINGS_PX, 0)
        crop = np.s_[top : y + height + _SURROUNDINGS_PX, left : x + width + _SURROUNDINGS_PX]
        inside = labels[crop] == number
        near = cv2.dilate(inside.astype(np.uint8), _SQUARE) > 0
        wide = cv2.dilate(inside.astype(np.uint8), _WIDE) > 0
        around = wide & ~near & (labels[crop] == 0)
        if around.any():
            yield Piece(crop, inside, around, number)


def step_across(image: Grey, piece: Piece) -> float:
    """Return by how many greys an image steps at the border of a piece, without its sign.

    Each place along the border is compared with what is beside it: a slope of light, or a wall
    that runs through the piece, is no step.
    """
    here, there = (
        _mean_near(image[piece.crop].astype(np.float32), mask)
        for mask in (piece.inside, piece.around)
    )
    steps = (here - there)[piece.inside]
    steps = steps[np.isfinite(steps)]
    return abs(float(steps.mean())) if len(steps) else 0.0


def _mean_near(image: Floats32, mask: Bools) -> Floats32:
    """Return the mean of the pixels of a mask about each pixel; NaN where there are none."""
    weight = mask.astype(np.float32)
    plain = cv2.BORDER_CONSTANT
    total = cv2.boxFilter(image * weight, -1, _ACROSS, normalize=False, borderType=plain)
    count = cv2.boxFilter(weight, -1, _ACROSS, normalize=False, borderType=plain)
    return np.asarray(np.where(count > 0.5, total / np.maximum(count, 1), np.nan), np.float32)


def without_step(
    mask: Grey, right: Grey, wrong: Grey, *, core: Grey | None = None, where: Bools | None = None
) -> Bools:
    """Return the pieces of a mask at whose border one image steps less than another.

    Parameters
    ----------
    mask : ndarray of uint8, shape (height, width)
        Where the images differ.
    right, wrong : ndarray of uint8, shape (height, width)
        What is asked for is where ``right`` is the smoother.
    core : ndarray of uint8, shape (height, width), optional
        Pieces that hold none of it are noise.
    where : ndarray of bool, shape (height, width), optional
        Other pixels are not compared.

    Returns
    -------
    ndarray of bool, shape (height, width)
    """
    n, labels, boxes, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    asked = np.full(n, core is None)
    if core is not None:
        asked[labels[core > 0]] = True
    found = np.zeros(mask.shape, bool)
    for piece in pieces_of(np.asarray(labels, np.int32), np.asarray(boxes, np.int32), asked):
        seen = piece if where is None else piece.within(where)
        if step_across(right, seen) < step_across(wrong, seen):
            found[piece.crop] |= piece.inside
    return found

"""From which side a camera sees the tank: from above as a map shows it, from below mirrored.

Four corners or point pairs in a wrong order make a calibration that fits them all the same, and
tracks that are mirror images. The sign of the plane's homography tells, since pixels count y
down and metres y up: a camera overhead does not mirror the arena, one below always does.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from zfcal.arrays import Floats
from zfcal.cameras.camera import Projection
from zfcal.errors import InputError

ABOVE, BELOW = "above", "below"
_UNKNOWN = "unknown"

_NAMES = ("lower left", "lower right", "upper right", "upper left")


def seen_from(camera: Projection, near_px: ArrayLike | None = None) -> str:
    """Return ``above`` or ``below``: whether the arena's y runs up in the image or is mirrored.

    Parameters
    ----------
    camera
        Where pixels lie.
    near_px : array_like, shape (2,), optional
        Where it is judged; the middle of the image by default.

    Returns
    -------
    str
        ``unknown`` where that pixel shows no part of the plane.
    """
    middle = np.array(camera.size_px) / 2 if near_px is None else np.asarray(near_px, np.float64)
    here, right, down = camera.to_metres(middle + np.array([[0, 0], [1, 0], [0, 1]]))
    (a, b), (c, d) = right - here, down - here
    turn = a * d - b * c
    if np.isnan(turn):
        return _UNKNOWN
    return ABOVE if turn < 0 else BELOW


def check_side(
    camera: Projection, expected: str, *, what: str, hint: str, near_px: ArrayLike | None = None
) -> None:
    """Refuse a calibration that mirrors the arena and should not, or does not and should.

    Parameters
    ----------
    camera
        Where pixels lie.
    expected
        ``above`` or ``below``.
    what
        What it was made from, such as a file, for the message.
    hint
        What to do.
    near_px : array_like, shape (2,), optional
        A pixel that shows the arena, for a camera whose middle does not.

    Raises
    ------
    InputError
        It is the wrong way round.
    """
    found = seen_from(camera)
    if found == _UNKNOWN and near_px is not None:
        found = seen_from(camera, near_px)
    if found not in {expected, _UNKNOWN}:
        how = "mirrored" if found == BELOW else "not mirrored"
        raise InputError(
            f"{what}: the arena is seen from {found} ({how}), expected from {expected}.", hint=hint
        )


def check_corners(camera: Projection, corners_px: ArrayLike, expected: str) -> None:
    """Refuse four corners of the arena that run the wrong way round.

    Parameters
    ----------
    camera
        The homography that they make.
    corners_px : array_like, shape (4, 2)
        As they were given.
    expected
        ``above`` or ``below``.

    Raises
    ------
    InputError
        They do; the hint holds the same numbers in the right order.
    """
    corners = np.asarray(corners_px, np.float64)
    other = BELOW if expected == ABOVE else ABOVE
    where = "up through the floor" if other == BELOW else "down on the tank"
    check_side(
        camera,
        expected,
        what=f"Corners {as_typed(corners)}",
        near_px=corners.mean(axis=0),
        hint=f"{', '.join(_NAMES)} {_view(expected)}: '{as_typed(in_order(corners, expected))}'. "
        f"Or does this camera look {where}? Then say --seen-from {other}.",
    )


def _view(expected: str) -> str:
    if expected == ABOVE:
        return "are, if the image shows the arena upright"
    return "of the arena are, as a camera below shows them, if the first is right"


def in_order(corners_px: ArrayLike, expected: str) -> Floats:
    """Return corners that run the wrong way round in the order in which they run the right way.

    From above the first is the one at the lower left of the image, as in one that shows the arena
    upright. From below there is no such custom: the first corner stays.

    Parameters
    ----------
    corners_px : array_like, shape (4, 2)
        In order round the arena, y down.
    expected
        ``above`` or ``below``.

    Returns
    -------
    ndarray, shape (4, 2)
    """
    corners = np.asarray(corners_px, np.float64)
    if expected == BELOW:
        return corners[[0, 3, 2, 1]]
    turned = corners[::-1]
    upright = np.array([[-1, 1], [1, 1], [1, -1], [-1, -1]], np.float64)
    away = turned - turned.mean(axis=0)
    best = max(range(4), key=lambda k: float((np.roll(away, k, axis=0) * upright).sum()))
    return np.roll(turned, best, axis=0)


def as_typed(corners_px: Floats) -> str:
    """Return corners as a person types them: ``52,448 447,450 449,51 50,53``."""
    return " ".join(",".join(f"{value:.10g}" for value in corner) for corner in corners_px.tolist())

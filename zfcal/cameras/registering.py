"""A camera corrected by an alignment, so that it sees what the other camera sees.

A turn and a shift in the plane always serve. Where the lens is known, a new pose may serve
better: LEDs shine below the plane on which overhead sees the lure, hence the picture is
smaller and leans. Which of the two it is, the halves of the recording tell of each other.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from zfcal.arrays import Floats
from zfcal.cameras.alignment import Alignment, time_blocks
from zfcal.cameras.camera import Camera, Homography
from zfcal.cameras.pairs import Pairs
from zfcal.cameras.poses import View, fit_pose
from zfcal.errors import InputError

_MOST_PAIRS = 600
_GAIN = 0.95
"""A pose must foretell the other half better than this times the turn and shift."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Registered:
    """A corrected camera.

    Parameters
    ----------
    camera
        It.
    method
        ``turn and shift`` or ``pose``.
    pairs
        Where it saw the robot, and where overhead did.
    held_out_m : ndarray, shape (k, 2)
        Errors of each half of the recording by a correction from the other; NaN where there
        is no other half.
    """

    camera: Camera | Homography
    method: str
    pairs: Pairs
    held_out_m: Floats


def register(camera: Camera | Homography, alignment: Alignment) -> Registered:
    """Correct the camera below.

    Parameters
    ----------
    camera
        As it was calibrated.
    alignment
        Of its positions with those overhead.
    """
    few = np.linspace(0, len(alignment.time_s) - 1, min(_MOST_PAIRS, len(alignment.time_s)))
    chosen = np.unique(few.astype(np.int64))
    px = camera.to_pixels(alignment.below_m[chosen])
    pairs = Pairs(px=px, m=alignment.blobs_m[chosen], size_px=camera.size_px)
    moved = move(camera, alignment.angle_rad, np.array(alignment.shift_m))
    by_shift = alignment.held_out_m[chosen]
    if isinstance(camera, Homography):
        return Registered(camera=moved, method=_SHIFT, pairs=pairs, held_out_m=by_shift)
    by_pose = _held_out(camera, pairs, time_blocks(alignment.time_s[chosen]))
    if not _size(by_pose) < _GAIN * _size(by_shift):
        return Registered(camera=moved, method=_SHIFT, pairs=pairs, held_out_m=by_shift)
    posed = fit_pose(camera.lens, View(px=pairs.px, m=pairs.m), robust=True)
    return Registered(camera=posed, method="pose", pairs=pairs, held_out_m=by_pose)


_SHIFT = "turn and shift"


def move(camera: Camera | Homography, angle_rad: float, shift_m: Floats) -> Camera | Homography:
    """Return a camera whose positions are turned about the origin, then shifted.

    Parameters
    ----------
    camera
        The camera.
    angle_rad
        Counter-clockwise.
    shift_m : ndarray, shape (2,)
        In metres.
    """
    cos, sin = np.cos(angle_rad), np.sin(angle_rad)
    turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    if isinstance(camera, Homography):
        onto = turn.copy()
        onto[:2, 2] = shift_m
        matrix = onto @ np.array(camera.matrix, np.float64)
        rows = tuple(tuple(map(float, row)) for row in matrix)
        return Homography(size_px=camera.size_px, matrix=rows)
    rotation, _ = cv2.Rodrigues(np.array(camera.rotation_rad, np.float64))
    turned = np.asarray(rotation, np.float64) @ turn.T
    translation = np.array(camera.translation_m) - turned @ np.array([*shift_m, 0.0])
    return Camera.of(camera.lens, np.asarray(cv2.Rodrigues(turned)[0]), translation)


def _held_out(camera: Camera, pairs: Pairs, even: np.ndarray) -> Floats:
    errors = np.full(pairs.m.shape, np.nan)
    for half in (even, ~even):
        try:
            some = Pairs(px=pairs.px[half], m=pairs.m[half], size_px=pairs.size_px)
            some.check_spread(8, what="A pose")
            posed = fit_pose(camera.lens, View(px=some.px, m=some.m), robust=True)
        except InputError:
            continue
        errors[~half] = posed.to_metres(pairs.px[~half]) - pairs.m[~half]
    return errors


def _size(errors_m: Floats) -> float:
    """Return the median length; infinite where there is none."""
    lengths = np.hypot(*errors_m.T)
    return float(np.median(lengths)) if len(lengths) and np.isfinite(lengths).all() else np.inf

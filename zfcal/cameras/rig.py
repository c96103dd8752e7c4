"""The two cameras of the rig, as they stand over and under an arena when nobody has measured them.

For images that are drawn: their cameras are known exactly. Cameras that stand in a
room are calibrated instead.
"""

from __future__ import annotations

import cv2
import numpy as np

from zfcal.arena import Arena
from zfcal.arrays import Floats
from zfcal.cameras.camera import FISHEYE, PINHOLE, Camera

OVERHEAD_PX = (500, 500)
BELOW_PX = (640, 480)

WALL_M = 0.05
"""What is seen of a wall beside the water: it leans outwards."""

_MARGIN = 1.02
_ABOVE_TILT_RAD = (0.008, -0.005, 0.004)
_BELOW_TILT_RAD = (-0.012, 0.009, 0.020)
# A lens of the kind that is sold for inspection: a barrel of two pixels in the corners.
_RATIONAL = (-0.031, 0.012, 0.0004, -0.0003, 0.001, 0.004, 0.002, 0.0003)
_KANNALA_BRANDT = (-0.012, 0.004, -0.002, 0.0005)


def side_m(arena: Arena) -> float:
    """Return the side of the square that a camera over an arena shows, in metres."""
    return (arena.extent_m + 2 * WALL_M) * _MARGIN


def overhead_camera(arena: Arena, size_px: tuple[int, int] = OVERHEAD_PX) -> Camera:
    """Return a camera over the middle of an arena, which fills its image.

    Parameters
    ----------
    arena
        What it looks at.
    size_px
        Width and height of its images.

    Returns
    -------
    Camera
        A pinhole with a slight rational distortion, hung up a little askew.
    """
    side = side_m(arena)
    height_m = 1.25 * side
    focal_px = min(size_px) * height_m / side
    return _placed(
        arena,
        model=PINHOLE,
        size_px=size_px,
        focal_px=focal_px,
        distortion=_RATIONAL,
        # Looks down: the image's y runs against the arena's.
        turn=_rotation(_ABOVE_TILT_RAD) @ np.diag([1.0, -1.0, -1.0]),
        height_m=height_m,
    )


def below_camera(arena: Arena, size_px: tuple[int, int] = BELOW_PX) -> Camera:
    """Return a fish-eye camera under the middle of an arena, which looks up.

    Parameters
    ----------
    arena
        What it looks at; it sees all of it.
    size_px
        Width and height of its images.

    Returns
    -------
    Camera
        ``cv2.fisheye``'s model; its image is the mirror image of the overhead one.
    """
    depth_m = 0.55 * side_m(arena)
    # The middle of the arena's edge is seen at atan(0.5 / 0.55) = 0.74 rad.
    focal_px = 0.46 * min(size_px) / 0.74
    return _placed(
        arena,
        model=FISHEYE,
        size_px=size_px,
        focal_px=focal_px,
        distortion=_KANNALA_BRANDT,
        turn=_rotation(_BELOW_TILT_RAD),
        height_m=-depth_m,
    )


def _placed(  # noqa: PLR0913 - one keyword for each thing that a camera is made of
    arena: Arena,
    *,
    model: str,
    size_px: tuple[int, int],
    focal_px: float,
    distortion: tuple[float, ...],
    turn: Floats,
    height_m: float,
) -> Camera:
    x0, y0, x1, y1 = arena.outline.bounds
    place_m = np.array([(x0 + x1) / 2, (y0 + y1) / 2, height_m])
    vector, _ = cv2.Rodrigues(turn)
    rotation = [float(value) for value in vector.ravel()]
    shift = [float(value) for value in -turn @ place_m]
    return Camera(
        size_px=size_px,
        model=model,
        matrix=(
            (focal_px, 0.0, (size_px[0] - 1) / 2),
            (0.0, focal_px, (size_px[1] - 1) / 2),
            (0.0, 0.0, 1.0),
        ),
        distortion=distortion,
        rotation_rad=(rotation[0], rotation[1], rotation[2]),
        translation_m=(shift[0], shift[1], shift[2]),
    )


def _rotation(vector_rad: tuple[float, float, float]) -> Floats:
    matrix, _ = cv2.Rodrigues(np.array(vector_rad))
    return np.asarray(matrix, np.float64)

"""What a calibrated camera knows: where a pixel lies in the tank, and back.

Pixels have their origin in the centre of the top left pixel and y down; metres are
those of the arena, y up, on the plane in which the agents swim. Files, board images
and fits are the business of others.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from zfcal.errors import InputError

Floats = NDArray[np.float64]

PINHOLE = "pinhole"
FISHEYE = "fisheye"
_N_COEFFICIENTS = {PINHOLE: (0, 4, 5, 8, 12, 14), FISHEYE: (4,)}


class Projection(Protocol):
    """Anything that knows where pixels lie: a camera, or a homography."""

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height of its images."""
        ...

    def to_metres(self, points_px: Floats) -> Floats:
        """Return where pixels lie on the plane; shape (..., 2) in and out, NaN stays NaN."""
        ...

    def to_pixels(self, points_m: Floats) -> Floats:
        """Return the pixels of points on the plane; shape (..., 2) in and out."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Camera:
    """A camera with lens and pose, over the plane z = 0 of the arena.

    Parameters
    ----------
    size_px
        Width and height of its images.
    model
        ``pinhole`` (OpenCV's rational model) or ``fisheye`` (``cv2.fisheye``,
        Kannala and Brandt 2006).
    matrix : tuple of 3 rows of 3
        Focal lengths and principal point, in pixels.
    distortion
        Coefficients in OpenCV's order: 0, 4, 5, 8, 12 or 14 of a pinhole, 4 of a fish-eye.
    rotation_rad
        Rotation vector (Rodrigues) from the arena's axes to the camera's.
    translation_m
        The arena's origin in the camera's axes.
    """

    size_px: tuple[int, int]
    model: str
    matrix: tuple[tuple[float, ...], ...]
    distortion: tuple[float, ...]
    rotation_rad: tuple[float, float, float]
    translation_m: tuple[float, float, float]

    def __post_init__(self) -> None:
        if self.model not in _N_COEFFICIENTS:
            raise InputError(f"A camera's model must be pinhole or fisheye, got {self.model!r}.")
        allowed = _N_COEFFICIENTS[self.model]
        if len(self.distortion) not in allowed:
            raise InputError(
                f"A {self.model} camera has {' or '.join(map(str, allowed))} distortion "
                f"coefficients, got {len(self.distortion)}."
            )

    def to_pixels(self, points_m: Floats) -> Floats:
        """Return the pixels of points on the plane z = 0.

        Parameters
        ----------
        points_m : ndarray, shape (..., 2)
            In metres; NaN stays NaN.

        Returns
        -------
        ndarray, shape (..., 2)
        """
        flat = np.asarray(points_m, np.float64).reshape(-1, 2)
        world = np.column_stack([flat, np.zeros(len(flat))])[:, None, :]
        project = cv2.fisheye.projectPoints if self.model == FISHEYE else cv2.projectPoints
        pixels, _ = project(
            world,
            np.array(self.rotation_rad, np.float64),
            np.array(self.translation_m, np.float64),
            np.array(self.matrix, np.float64),
            np.array(self.distortion, np.float64),
        )
        return np.asarray(pixels, np.float64).reshape(np.shape(points_m))

    def to_metres(self, points_px: Floats) -> Floats:
        """Return where the rays of pixels meet the plane z = 0.

        Parameters
        ----------
        points_px : ndarray, shape (..., 2)
            In pixels; NaN stays NaN.

        Returns
        -------
        ndarray, shape (..., 2)
            In metres; NaN where the ray does not meet the plane.
        """
        flat = np.asarray(points_px, np.float64).reshape(-1, 1, 2)
        undistort = cv2.fisheye.undistortPoints if self.model == FISHEYE else cv2.undistortPoints
        known = np.isfinite(flat).all(axis=(1, 2))
        rays = np.full((len(flat), 2), np.nan)
        if known.any():
            normal = undistort(
                flat[known],
                np.array(self.matrix, np.float64),
                np.array(self.distortion, np.float64),
            )
            rays[known] = normal.reshape(-1, 2)
        rotation, _ = cv2.Rodrigues(np.array(self.rotation_rad, np.float64))
        # On z = 0 the camera maps (x, y, 1) by these three columns: a homography.
        plane = np.column_stack([rotation[:, 0], rotation[:, 1], self.translation_m])
        back = np.column_stack([rays, np.ones(len(rays))]) @ np.linalg.inv(plane).T
        return (back[:, :2] / back[:, 2:]).reshape(np.shape(points_px))


@dataclass(frozen=True, slots=True, kw_only=True)
class Homography:
    """A camera without lens distortion, known by four or more points of the plane.

    Parameters
    ----------
    size_px
        Width and height of its images.
    matrix : tuple of 3 rows of 3
        From pixels to metres, in homogeneous coordinates.
    """

    size_px: tuple[int, int]
    matrix: tuple[tuple[float, ...], ...]

    def to_metres(self, points_px: Floats) -> Floats:
        """Return where pixels lie on the plane; shape (..., 2) in and out."""
        return _mapped(points_px, np.array(self.matrix, np.float64))

    def to_pixels(self, points_m: Floats) -> Floats:
        """Return the pixels of points on the plane; shape (..., 2) in and out."""
        return _mapped(points_m, np.linalg.inv(np.array(self.matrix, np.float64)))


def _mapped(points: Floats, matrix: Floats) -> Floats:
    flat = np.asarray(points, np.float64).reshape(-1, 2)
    mapped = np.column_stack([flat, np.ones(len(flat))]) @ matrix.T
    return (mapped[:, :2] / mapped[:, 2:]).reshape(np.shape(points))

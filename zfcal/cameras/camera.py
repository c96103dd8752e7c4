"""What a calibrated camera knows: where a pixel lies in the tank, and back.

Pixels have their origin in the centre of the top left pixel and y down; metres are
those of the arena, y up, on the plane in which the agents swim. Files, board images
and fits are the business of others; what the lens does stands in `lens`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Protocol

import cv2
import numpy as np

from zfcal.arrays import Floats
from zfcal.cameras.lens import FISHEYE, PINHOLE, Lens, Matrix, check_size, shown_size, square_matrix
from zfcal.errors import InputError

__all__ = ["FISHEYE", "PINHOLE", "Camera", "Homography", "Projection", "check_fits"]

Distortion = tuple[float, ...]

_NEAREST_M = 1e-4
"""A camera nearer to the plane than that stands in it, and sees it as a line."""


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
    matrix: Matrix
    distortion: tuple[float, ...]
    rotation_rad: tuple[float, float, float]
    translation_m: tuple[float, float, float]

    def __post_init__(self) -> None:
        _ = self.lens
        for name in ("rotation_rad", "translation_m"):
            value = getattr(self, name)
            if len(value) != 3 or not np.isfinite(value).all():
                raise InputError(f"A camera's {name} must be three finite numbers, got {value}.")
        distance_m = abs(float(np.linalg.det(self._plane())))
        if not distance_m >= _NEAREST_M:
            raise InputError(
                f"The camera stands {distance_m * 1000:.2g} mm from the plane that it looks at.",
                hint="translation_m is the arena's origin in the camera's axes, in metres.",
            )

    @property
    def lens(self) -> Lens:
        """The lens, without the pose."""
        return _lens(self.size_px, self.model, self.matrix, self.distortion)

    @classmethod
    def of(cls, lens: Lens, rotation_rad: Floats, translation_m: Floats) -> Camera:
        """Return the camera with that lens and that pose.

        Parameters
        ----------
        lens
            The lens.
        rotation_rad : array_like, shape (3,) or (3, 1)
            Rotation vector from the arena's axes to the camera's.
        translation_m : array_like, shape (3,) or (3, 1)
            The arena's origin in the camera's axes.
        """
        first, second, third = np.ravel(rotation_rad).tolist()
        x, y, z = np.ravel(translation_m).tolist()
        return cls(
            size_px=lens.size_px,
            model=lens.model,
            matrix=lens.matrix,
            distortion=lens.distortion,
            rotation_rad=(first, second, third),
            translation_m=(x, y, z),
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
            NaN for a point behind the camera, or beyond what its lens can see. A pixel may
            lie outside the image.
        """
        rays, depth = _seen(points_m, self._plane())
        rays[~(depth > 0)] = np.nan
        return self.lens.to_pixels(rays).reshape(np.shape(points_m))

    def to_metres(self, points_px: Floats) -> Floats:
        """Return where the rays of pixels meet the plane z = 0.

        Parameters
        ----------
        points_px : ndarray, shape (..., 2)
            In pixels; NaN stays NaN.

        Returns
        -------
        ndarray, shape (..., 2)
            In metres; NaN where no ray reaches the pixel, or it does not meet the plane
            before the camera.
        """
        rays = self.lens.to_rays(points_px)
        # On the plane the camera maps (x, y, 1) by three columns: a homography, whose inverse
        # leaves one over the depth as the third coordinate.
        points_m, inverse_depth = _seen(rays, _from_plane(self.rotation_rad, self.translation_m))
        points_m[~(inverse_depth > 0)] = np.nan
        return points_m.reshape(np.shape(points_px))

    def scaled(self, size_px: tuple[int, int]) -> Camera:
        """Return the camera for images of another size and the same picture.

        Raises
        ------
        InputError
            The sides differ in ratio.
        """
        lens = self.lens.scaled(size_px)
        return replace(self, size_px=lens.size_px, matrix=lens.matrix)

    def _plane(self) -> Floats:
        return _to_plane(self.rotation_rad, self.translation_m)


_Triple = tuple[float, float, float]
_N_KEPT = 32
"""Cameras whose constants are kept: an image asks for them several times."""


@lru_cache(maxsize=_N_KEPT)
def _lens(size_px: tuple[int, int], model: str, matrix: Matrix, distortion: Distortion) -> Lens:
    return Lens(size_px=size_px, model=model, matrix=matrix, distortion=distortion)


@lru_cache(maxsize=_N_KEPT)
def _to_plane(rotation_rad: _Triple, translation_m: _Triple) -> Floats:
    """Return how a camera maps (x, y, 1) of the plane, not to be written to."""
    rotation, _ = cv2.Rodrigues(np.array(rotation_rad, np.float64))
    return _constant(np.column_stack([rotation[:, 0], rotation[:, 1], translation_m]))


@lru_cache(maxsize=_N_KEPT)
def _from_plane(rotation_rad: _Triple, translation_m: _Triple) -> Floats:
    """Return the inverse of that map."""
    return _constant(_inverse(_to_plane(rotation_rad, translation_m)))


def _constant(matrix: Floats) -> Floats:
    matrix.flags.writeable = False
    return matrix


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
    matrix: Matrix

    def __post_init__(self) -> None:
        check_size(self.size_px)
        matrix = square_matrix(self.matrix, "A homography's matrix")
        scale = np.abs(matrix).max(axis=0).prod()
        if not abs(np.linalg.det(matrix)) > 1e-12 * scale:
            raise InputError(
                "The homography maps the image to a line.",
                hint="Are its points in metres and pixels, not three of them on a line?",
            )

    def to_metres(self, points_px: Floats) -> Floats:
        """Return where pixels lie on the plane; NaN at and beyond its horizon.

        Parameters
        ----------
        points_px : ndarray, shape (..., 2)
            In pixels; NaN stays NaN.

        Returns
        -------
        ndarray, shape (..., 2)
        """
        points_m, depth = _seen(points_px, self._oriented())
        points_m[~(depth > 0)] = np.nan
        return points_m.reshape(np.shape(points_px))

    def to_pixels(self, points_m: Floats) -> Floats:
        """Return the pixels of points on the plane; NaN behind the camera.

        Parameters
        ----------
        points_m : ndarray, shape (..., 2)
            In metres; NaN stays NaN.

        Returns
        -------
        ndarray, shape (..., 2)
            A pixel may lie outside the image.
        """
        points_px, depth = _seen(points_m, _inverse(self._oriented()))
        points_px[~(depth > 0)] = np.nan
        return points_px.reshape(np.shape(points_m))

    def _oriented(self) -> Floats:
        """Return the matrix with the sign that makes the image's middle lie before the camera."""
        matrix = np.array(self.matrix, np.float64)
        middle = matrix[2] @ [(self.size_px[0] - 1) / 2, (self.size_px[1] - 1) / 2, 1]
        return matrix if middle >= 0 else -matrix


def check_fits(projection: Projection, size_px: tuple[int, int], *, camera: str) -> None:
    """Refuse a calibration that was made for images of another size.

    Parameters
    ----------
    projection
        The calibration.
    size_px
        Width and height of the images at hand.
    camera
        What the calibration is called in the message, such as its file.

    Raises
    ------
    InputError
        The sizes differ.
    """
    if tuple(projection.size_px) != tuple(size_px):
        raise InputError(
            f"{camera}: is a calibration for {shown_size(projection.size_px)} images, these are "
            f"{shown_size(size_px)}.",
            hint="It is of another camera, or the camera's resolution was changed: take the file "
            "of this camera, or calibrate again.",
        )


def _seen(points: Floats, matrix: Floats) -> tuple[Floats, Floats]:
    """Return points mapped by a homography, shape (n, 2), and what they were divided by."""
    flat = np.asarray(points, np.float64).reshape(-1, 2)
    mapped = np.column_stack([flat, np.ones(len(flat))]) @ matrix.T
    with np.errstate(divide="ignore", invalid="ignore"):
        return mapped[:, :2] / mapped[:, 2:], mapped[:, 2]


def _inverse(matrix: Floats) -> Floats:
    return np.asarray(np.linalg.inv(matrix), np.float64)

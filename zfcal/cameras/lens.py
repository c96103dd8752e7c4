"""What a lens does: from pixels to rays and back, wherever the camera stands.

A ray is the point ``(x, y)`` where it meets the plane one unit before the camera. The
forward direction is OpenCV's; the way back is exact here, since ``cv2.undistortPoints``
stops after five steps of a fixed-point iteration that need not converge.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np

from zfcal.arrays import Bools, Floats
from zfcal.errors import InputError

Matrix = tuple[tuple[float, ...], ...]

PINHOLE = "pinhole"
FISHEYE = "fisheye"
_N_COEFFICIENTS = {PINHOLE: (0, 4, 5, 8, 12, 14), FISHEYE: (4,)}

_WIDEST_RAD = {PINHOLE: math.radians(85), FISHEYE: math.radians(89.5)}
"""Rays farther from the axis have no pixel: the plane of a tank is not seen along it."""

_N_ANGLES = 1024
_STEP = 1e-7
_RIGHT, _UP = np.array([_STEP, 0.0]), np.array([0.0, _STEP])
_N_STEPS = 12
_BEYOND = 1.5
"""A search that goes so far beyond the widest ray will not come back."""
_SLACK = 1.05
"""Decentring moves a pixel by less than this from where the radial part alone puts it."""
_EXACT_PX = 1e-7
_AT_ONCE = 4096
"""OpenCV's projection gives all derivatives as well: of a whole image that would be a gigabyte."""

_AT_REST = (np.zeros(3), np.zeros(3))


@dataclass(frozen=True, slots=True, kw_only=True)
class Lens:
    """A lens and its sensor, without a place.

    Parameters
    ----------
    size_px
        Width and height of the images.
    model
        ``pinhole`` (OpenCV's rational model) or ``fisheye`` (``cv2.fisheye``,
        Kannala and Brandt 2006).
    matrix : tuple of 3 rows of 3
        Focal lengths and principal point, in pixels.
    distortion
        Coefficients in OpenCV's order: 0, 4, 5, 8, 12 or 14 of a pinhole, 4 of a fish-eye.
    """

    size_px: tuple[int, int]
    model: str
    matrix: Matrix
    distortion: tuple[float, ...]

    def __post_init__(self) -> None:
        check_size(self.size_px)
        if self.model not in _N_COEFFICIENTS:
            raise InputError(f"A camera's model must be pinhole or fisheye, got {self.model!r}.")
        allowed = _N_COEFFICIENTS[self.model]
        if len(self.distortion) not in allowed:
            raise InputError(
                f"A {self.model} camera has {' or '.join(map(str, allowed))} distortion "
                f"coefficients, got {len(self.distortion)}."
            )
        if not np.isfinite(self.distortion).all():
            raise InputError(f"Distortion coefficients must be finite, got {self.distortion}.")
        matrix = square_matrix(self.matrix, "A camera's matrix")
        if not (matrix[0, 0] > 0 and matrix[1, 1] > 0):
            raise InputError(
                f"Focal lengths must be positive, got {matrix[0, 0]:g} and {matrix[1, 1]:g} px."
            )
        if not np.array_equal(matrix[[1, 2, 2, 2], [0, 0, 1, 2]], [0, 0, 0, 1]):
            raise InputError("A camera's matrix must be ((fx, 0, cx), (0, fy, cy), (0, 0, 1)).")

    @property
    def widest_ray(self) -> float:
        """Length of the longest ray that has a pixel of its own: beyond it the image folds."""
        return float(_branch(self.model, self.distortion)[0][-1])

    def to_pixels(self, rays: Floats) -> Floats:
        """Return the pixels of rays.

        Parameters
        ----------
        rays : ndarray, shape (..., 2)
            NaN stays NaN.

        Returns
        -------
        ndarray, shape (..., 2)
            NaN for a ray so far from the axis that the model folds back there.
        """
        flat = np.asarray(rays, np.float64).reshape(-1, 2)
        pixels = np.full(flat.shape, np.nan)
        known = np.hypot(*flat.T) <= self.widest_ray
        if known.any():
            pixels[known] = self._project(flat[known])
        return pixels.reshape(np.shape(rays))

    def to_rays(self, points_px: Floats) -> Floats:
        """Return the rays of pixels.

        Parameters
        ----------
        points_px : ndarray, shape (..., 2)
            In pixels; NaN stays NaN.

        Returns
        -------
        ndarray, shape (..., 2)
            With `to_pixels` they give the pixels again within 1e-7 px; NaN for a pixel that
            no ray reaches.
        """
        flat = np.asarray(points_px, np.float64).reshape(-1, 2)
        rays = np.full(flat.shape, np.nan)
        known = np.isfinite(flat).all(axis=1)
        if known.any():
            rays[known] = self._solve(flat[known])
        return rays.reshape(np.shape(points_px))

    def scaled(self, size_px: tuple[int, int]) -> Lens:
        """Return the lens for images of another size and the same picture.

        Raises
        ------
        InputError
            The sides differ in ratio: these are images of another part of the sensor.
        """
        across, down = (new / old for new, old in zip(size_px, self.size_px, strict=True))
        if not math.isclose(across, down, rel_tol=0.005):
            raise InputError(
                f"A calibration for {shown_size(self.size_px)} images cannot be scaled to "
                f"{shown_size(size_px)}: the ratio of the sides differs.",
                hint="Calibrate with images of the size that is recorded.",
            )
        old = np.array(self.matrix, np.float64)
        # Pixels have their origin in the middle of the first one, half a pixel inside.
        first = [across * old[0, 0], across * old[0, 1], across * (old[0, 2] + 0.5) - 0.5]
        second = [0.0, down * old[1, 1], down * (old[1, 2] + 0.5) - 0.5]
        matrix = (tuple(map(float, first)), tuple(map(float, second)), (0.0, 0.0, 1.0))
        return Lens(size_px=size_px, model=self.model, matrix=matrix, distortion=self.distortion)

    def _project(self, rays: Floats) -> Floats:
        """Return the pixels of finite rays, folded or not."""
        if not len(rays):
            # OpenCV's fish-eye has no answer to no question.
            return np.empty((0, 2))
        if len(rays) > _AT_ONCE:
            parts = range(0, len(rays), _AT_ONCE)
            return np.concatenate([self._project(rays[i : i + _AT_ONCE]) for i in parts])
        world = np.column_stack([rays, np.ones(len(rays))])[:, None, :]
        project = cv2.fisheye.projectPoints if self.model == FISHEYE else cv2.projectPoints
        pixels, _ = project(
            world,
            *_AT_REST,
            np.array(self.matrix, np.float64),
            np.array(self.distortion, np.float64),
        )
        return np.asarray(pixels, np.float64).reshape(-1, 2)

    def _solve(self, wanted: Floats) -> Floats:
        """Invert `_project` by Newton's method, from where the lens alone would be radial."""
        rays, reached = self._radial_start(wanted)
        open_ = np.flatnonzero(reached)
        for _ in range(_N_STEPS):
            here = rays[open_]
            images = self._project(np.concatenate([here, here + _RIGHT, here + _UP]))
            image, right, up = images.reshape(3, -1, 2)
            error = wanted[open_] - image
            far = np.abs(error).max(axis=1) >= _EXACT_PX
            if not far.any():
                break
            step = _newton_step((right - image)[far], (up - image)[far], error[far])
            open_ = open_[far]
            rays[open_] += step
            open_ = open_[np.hypot(*rays[open_].T) < _BEYOND * self.widest_ray]
            if not len(open_):
                break
        rays[self._misses(rays, wanted)] = np.nan
        return rays

    def _misses(self, rays: Floats, wanted: Floats) -> Bools:
        inside = np.hypot(*rays.T) <= self.widest_ray
        off = np.abs(self._project(np.where(inside[:, None], rays, 0.0)) - wanted).max(axis=1)
        return ~(inside & (off < 10 * _EXACT_PX))

    def _radial_start(self, wanted: Floats) -> tuple[Floats, Bools]:
        (fx, skew, cx), (_, fy, cy), _ = self.matrix
        down = (wanted[:, 1] - cy) / fy
        across = (wanted[:, 0] - cx - skew * down) / fx
        length = np.hypot(across, down)
        rays, seen = _branch(self.model, self.distortion)
        start = np.interp(length, seen, rays)
        factor = np.divide(start, length, out=np.ones_like(length), where=length > 0)
        return np.column_stack([across * factor, down * factor]), length <= _SLACK * seen[-1]


def check_size(size_px: tuple[int, int]) -> None:
    """Refuse images without area.

    Raises
    ------
    InputError
        A side is not a positive whole number.
    """
    if len(size_px) != 2 or not all(side == int(side) and side > 0 for side in size_px):
        raise InputError(f"A camera's size must be width and height in pixels, got {size_px}.")


def shown_size(size_px: tuple[int, int]) -> str:
    """Return ``640 x 480``."""
    return f"{size_px[0]} x {size_px[1]}"


def square_matrix(rows: Matrix, what: str) -> Floats:
    """Return three rows of three as an array.

    Raises
    ------
    InputError
        They are of another shape, or not finite.
    """
    try:
        matrix = np.array(rows, np.float64)
    except ValueError:
        matrix = np.empty(0)
    if matrix.shape != (3, 3) or not np.isfinite(matrix).all():
        raise InputError(f"{what} must have three rows of three finite numbers, got {rows}.")
    return matrix


@lru_cache(maxsize=64)
def _branch(model: str, distortion: tuple[float, ...]) -> tuple[Floats, Floats]:
    """Return lengths of rays and of their images (by focal length), up to where these turn."""
    angle = np.linspace(0.0, _WIDEST_RAD[model], _N_ANGLES)
    rays = np.tan(angle)
    if model == FISHEYE:
        powers = angle[:, None] ** np.array([3, 5, 7, 9])
        seen = angle + powers @ np.array(distortion)
    else:
        k = np.zeros(8)
        k[: min(len(distortion), 8)] = distortion[:8]
        above = 1 + rays**2 * (k[0] + rays**2 * (k[1] + rays**2 * k[4]))
        below = 1 + rays**2 * (k[5] + rays**2 * (k[6] + rays**2 * k[7]))
        seen = np.where(below > 0, rays * above / np.where(below > 0, below, 1.0), -1.0)
    turns = np.flatnonzero(~(np.diff(seen) > 0))
    end = int(turns[0]) + 1 if len(turns) else _N_ANGLES
    return rays[:end], seen[:end]


def _newton_step(right: Floats, up: Floats, error: Floats) -> Floats:
    """Solve two equations for each point: how far to go along x and y."""
    determinant = right[:, 0] * up[:, 1] - up[:, 0] * right[:, 1]
    with np.errstate(divide="ignore", invalid="ignore"):
        factor = _STEP / determinant
        along_x = (up[:, 1] * error[:, 0] - up[:, 0] * error[:, 1]) * factor
        along_y = (right[:, 0] * error[:, 1] - right[:, 1] * error[:, 0]) * factor
    return np.column_stack([along_x, along_y])

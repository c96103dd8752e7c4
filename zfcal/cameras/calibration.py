"""What every calibration ends in: errors in millimetres; and the plainest one, a homography.

How a camera is fitted stands in `calibration_points` (pairs on the tank's plane) and
`calibration_boards` (images of a board).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeAlias

import cv2
import numpy as np
from numpy.typing import ArrayLike

from zfcal.arrays import Floats
from zfcal.cameras.camera import Camera, Homography
from zfcal.cameras.handedness import seen_from
from zfcal.cameras.pairs import Pairs
from zfcal.errors import InputError

_OUTLIER_SD = 6.0
"""Robust standard deviations, beyond which a point does not belong to the others."""

_OUTLIER_M = 0.002
_MM = 1000.0

Fit: TypeAlias = Callable[["Pairs"], Camera | Homography]


@dataclass(frozen=True, slots=True, kw_only=True)
class Calibration:
    """A camera that was fitted, and how well.

    Parameters
    ----------
    camera
        What was found.
    pairs
        The points of the plane that it was made from.
    method
        How, in a few words.
    n_parameters
        How many numbers were fitted to the points.
    left_out_m : ndarray, shape (n, 2)
        Where each point would lie by a fit to all others, less where it lies; NaN where that
        cannot be done.
    notes
        What a person should know.
    details
        Further numbers for the file.
    """

    camera: Camera | Homography
    pairs: Pairs
    method: str
    n_parameters: int
    left_out_m: Floats
    notes: tuple[str, ...] = ()
    details: dict[str, Any]

    @property
    def residual_m(self) -> Floats:
        """Where each pixel lies by the fit, less where its point lies; shape (n, 2)."""
        return self.camera.to_metres(self.pairs.px) - self.pairs.m

    @property
    def residual_px(self) -> Floats:
        """Where the fit sees each point, less its pixel; shape (n, 2)."""
        return self.camera.to_pixels(self.pairs.m) - self.pairs.px

    @property
    def has_spare_points(self) -> bool:
        """Whether there are more numbers measured than fitted."""
        return 2 * len(self.pairs) > self.n_parameters

    def result(self) -> dict[str, Any]:
        """Return how it went, for a camera file and for JSON.

        Errors of an exact fit are zero and tell nothing, so they are left out.
        """
        found: dict[str, Any] = {
            "method": self.method,
            "n_points": len(self.pairs),
            "n_parameters": self.n_parameters,
            "seen_from": seen_from(self.camera),
        }
        if self.has_spare_points:
            found["error_mm"] = summary(self.residual_m * _MM)
            found["error_px"] = summary(self.residual_px)
        if np.isfinite(self.left_out_m).any():
            found["left_out_mm"] = summary(self.left_out_m * _MM)
        return {**found, **self.details, "notes": list(self.notes)}


def summary(errors: Floats) -> dict[str, float]:
    """Return median, root mean square, 95th percentile and largest length of errors.

    Parameters
    ----------
    errors : ndarray, shape (n, 2)
        Rows with NaN are left out.
    """
    lengths = np.hypot(*errors.T)
    lengths = lengths[np.isfinite(lengths)]
    if not len(lengths):
        return {}
    return {
        "median": float(np.median(lengths)),
        "rms": float(np.sqrt(np.mean(lengths**2))),
        "p95": float(np.percentile(lengths, 95)),
        "max": float(lengths.max()),
    }


def left_out(pairs: Pairs, fit: Fit) -> Floats:
    """Return where each point would lie by a fit to all others, less where it lies.

    Parameters
    ----------
    pairs
        The points.
    fit
        Makes a camera of pairs. Points that it cannot do without stay NaN.

    Returns
    -------
    ndarray, shape (n, 2)
        In metres.
    """
    errors = np.full((len(pairs), 2), np.nan)
    for number in range(len(pairs)):
        try:
            camera = fit(pairs.without(number))
        except InputError:
            continue
        errors[number] = camera.to_metres(pairs.px[number]) - pairs.m[number]
    return errors


def outlier_notes(errors_m: Floats) -> tuple[str, ...]:
    """Return a sentence for each point that does not belong to the others.

    Parameters
    ----------
    errors_m : ndarray, shape (n, 2)
        Of each point by a fit to the others, or by one that hardly heeds outliers.
    """
    lengths = np.hypot(*errors_m.T)
    usual = float(np.nanmedian(lengths)) if np.isfinite(lengths).any() else np.nan
    # The median length of a normal error in two dimensions is 1.177 standard deviations.
    limit = max(_OUTLIER_SD * usual / 1.177, _OUTLIER_M)
    return tuple(
        f"Point {number + 1} lies {lengths[number] * _MM:.1f} mm from where the others put it "
        f"(half of them are within {usual * _MM:.1f} mm): check its line."
        for number in np.flatnonzero(lengths > limit)
    )


def calibrate_homography(pairs: Pairs) -> Calibration:
    """Fit a homography: a camera whose lens does not bend lines.

    Parameters
    ----------
    pairs
        Four points or more, no three of four on a line.

    Raises
    ------
    InputError
        The points do not determine it.
    """
    camera = fit_homography(pairs)
    errors_m = left_out(pairs, fit_homography)
    notes = outlier_notes(errors_m)
    if len(pairs) == 4:
        notes += ("Four points determine a homography exactly: its error is not known.",)
    return Calibration(
        camera=camera,
        pairs=pairs,
        method="homography",
        n_parameters=8,
        left_out_m=errors_m,
        notes=notes,
        details={},
    )


def fit_homography(pairs: Pairs) -> Homography:
    """Return the homography with the least error in pixels.

    Raises
    ------
    InputError
        The points do not determine it.
    """
    pairs.check_spread(4, what="A homography")
    found, _ = cv2.findHomography(pairs.m, pairs.px, method=0)
    if found is None or not np.isfinite(found).all():
        raise InputError(
            "The points do not determine a homography.",
            hint="Take points no three of which lie on a line, such as the four corners.",
        )
    inverse = np.linalg.inv(found)
    rows = tuple(tuple(float(value) for value in row) for row in inverse / inverse[2, 2])
    return Homography(size_px=pairs.size_px, matrix=rows)


def _corners_of(bounds_m: tuple[float, float, float, float]) -> Floats:
    """Return the corners of a rectangle from the lower left one, counter-clockwise.

    Parameters
    ----------
    bounds_m
        ``(x0, y0, x1, y1)``, as of an arena's outline.

    Returns
    -------
    ndarray, shape (4, 2)
        In metres.
    """
    x0, y0, x1, y1 = bounds_m
    return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]], np.float64)


def homography_from_corners(
    corners_px: ArrayLike, bounds_m: tuple[float, float, float, float], size_px: tuple[int, int]
) -> Homography:
    """Return the homography by which four pixels are the corners of the arena.

    Parameters
    ----------
    corners_px : array_like, shape (4, 2)
        The corners' pixels: lower left, lower right, upper right, upper left as the arena
        has them (y up), however the camera is turned.
    bounds_m
        ``(x0, y0, x1, y1)`` of the arena.
    size_px
        Width and height of the image.

    Raises
    ------
    InputError
        They are not four, three lie on a line, or one lies outside the image.
    """
    return fit_homography(_corner_pairs(corners_px, bounds_m, size_px))


def calibrate_corners(
    corners_px: ArrayLike, bounds_m: tuple[float, float, float, float], size_px: tuple[int, int]
) -> Calibration:
    """Return `homography_from_corners` with what is known of its errors: nothing."""
    return calibrate_homography(_corner_pairs(corners_px, bounds_m, size_px))


def _corner_pairs(
    corners_px: ArrayLike, bounds_m: tuple[float, float, float, float], size_px: tuple[int, int]
) -> Pairs:
    corners = np.asarray(corners_px, np.float64)
    if corners.shape != (4, 2):
        raise InputError(f"Four corners X,Y are needed, got an array of shape {corners.shape}.")
    pairs = Pairs(px=corners, m=_corners_of(bounds_m), size_px=size_px)
    pairs.check_spread(4, what="A homography")
    _check_convex(corners)
    return pairs


def _check_convex(corners: Floats) -> None:
    if not cv2.isContourConvex(corners.astype(np.float32)):
        raise InputError(
            "The four corners cross over: they are not in order round the arena.",
            hint="Give lower left, lower right, upper right, upper left, as the arena has them.",
        )

"""Points of the tank's plane and of an image, in pairs, and whether they determine a plane."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from zfcal.arrays import Floats
from zfcal.cameras.lens import check_size, shown_size
from zfcal.errors import InputError

_SMALLEST_M = 0.01
_LARGEST_M = 20.0
"""Points nearer together or farther apart are not in metres, or of no tank."""

_ON_A_LINE = 1e-3
"""Points whose spread across is less than this share of that along lie on a line."""

_SINGULAR = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True)
class Pairs:
    """Points of the tank's plane: where each lies, and where an image shows it.

    Parameters
    ----------
    px : ndarray, shape (n, 2)
        In pixels.
    m : ndarray, shape (n, 2)
        In metres.
    size_px
        Width and height of the image.
    """

    px: Floats
    m: Floats
    size_px: tuple[int, int]

    def __post_init__(self) -> None:
        check_size(self.size_px)
        for name in ("px", "m"):
            values = getattr(self, name)
            if values.ndim != 2 or values.shape[1] != 2:
                raise InputError(f"Points must have shape (n, 2), got {values.shape}.")
            for number in np.flatnonzero(~np.isfinite(values).all(axis=1)):
                raise InputError(
                    f"Point {number + 1} is not finite: {name} = {_shown(values[number])}.",
                    hint="Leave a point out that is not known.",
                )
        if len(self.px) != len(self.m):
            raise InputError(f"There are {len(self.px)} points in pixels, {len(self.m)} in metres.")
        self._check_inside()
        self._check_metres()

    def __len__(self) -> int:
        return len(self.px)

    def without(self, number: int) -> Pairs:
        """Return all pairs but one."""
        kept = np.arange(len(self)) != number
        return Pairs(px=self.px[kept], m=self.m[kept], size_px=self.size_px)

    def check_spread(self, at_least: int, *, what: str) -> None:
        """Refuse too few points, and points on a line.

        Parameters
        ----------
        at_least
            How many are needed.
        what
            What needs them, for the message.

        Raises
        ------
        InputError
            They do not determine a plane.
        """
        if len(self) < at_least:
            raise InputError(
                f"{what} needs {at_least} points or more, got {len(self)}.",
                hint="Spread them over the whole tank; 12 to 20 let the error be judged too.",
            )
        for values, where in ((self.m, "metres"), (self.px, "pixels")):
            spread = np.linalg.svd(values - values.mean(axis=0), compute_uv=False)
            if not spread[1] > _ON_A_LINE * spread[0]:
                raise InputError(
                    f"The {len(self)} points lie on a line (in {where}).",
                    hint="A plane needs points to both sides of any line: take all four corners.",
                )
        if not _determined(self):
            raise InputError(
                "The points do not determine the plane: all but one lie on a line.",
                hint="Take points no three of which lie on a line, such as the four corners.",
            )

    def _check_inside(self) -> None:
        width, height = self.size_px
        low, high = np.array([-0.5, -0.5]), np.array([width - 0.5, height - 0.5])
        outside = (self.px < low - 0.5) | (self.px > high + 0.5)
        for number in np.flatnonzero(outside.any(axis=1)):
            raise InputError(
                f"Point {number + 1} lies outside the image: {_shown(self.px[number])} px in "
                f"{shown_size(self.size_px)}.",
                hint="Were the points taken in an image of another size, or of another camera?",
            )

    def _check_metres(self) -> None:
        if len(self) < 2:
            return
        extent_m = float(np.ptp(self.m, axis=0).max())
        if not _SMALLEST_M <= extent_m <= _LARGEST_M:
            raise InputError(
                f"The points span {extent_m:g} m, expected {_SMALLEST_M:g} to {_LARGEST_M:g} m.",
                hint="Are they in centimetres or millimetres? Give metres.",
            )


def _determined(pairs: Pairs) -> bool:
    """Return whether the points determine a homography, by the rank of its equations."""
    if len(pairs) == 4 and any(_has_line(points) for points in (pairs.m, pairs.px)):
        return False
    (x, y), (u, v) = _normal(pairs.m).T, _normal(pairs.px).T
    none, one = np.zeros_like(x), np.ones_like(x)
    first = np.column_stack([x, y, one, none, none, none, -u * x, -u * y, -u])
    second = np.column_stack([none, none, none, x, y, one, -v * x, -v * y, -v])
    values = np.linalg.svd(np.vstack([first, second]), compute_uv=False)
    return bool(values[7] > _SINGULAR * values[0])


def _has_line(points: Floats) -> bool:
    """Return whether three of four points lie on a line."""
    for left_out in range(4):
        three = np.delete(points, left_out, axis=0)
        spread = np.linalg.svd(three - three.mean(axis=0), compute_uv=False)
        if not spread[1] > _ON_A_LINE * spread[0]:
            return True
    return False


def _normal(points: Floats) -> Floats:
    centred = points - points.mean(axis=0)
    return centred / max(float(np.hypot(*centred.T).mean()), 1e-12)


def _shown(point: Floats) -> str:
    return ", ".join(f"{value:g}" for value in point)

"""Pixels to metres for a few points a frame, many times: read off a grid made once.

Undoing a lens is a search. Straight lines between points four pixels apart are right to a
thousandth of a millimetre for the lens above a tank; where the grid does not reach, or is not
right to a hundredth, the camera itself is asked.
"""

from __future__ import annotations

from typing import final

import numpy as np

from zfcal.arrays import Floats
from zfcal.cameras._kernels import read_grid
from zfcal.cameras.camera import Projection

_STEP_PX = 4

_RIGHT_M = 1e-5
"""A grid that is farther off somewhere, as for a fish-eye at its rim, is not used."""

_SOME = 7


@final
class Plane:
    """Where the pixels of a camera lie in the tank.

    Parameters
    ----------
    projection
        Of the camera.
    size_px
        Width and height of its images.
    """

    def __init__(self, projection: Projection, size_px: tuple[int, int]) -> None:
        self._projection = projection
        self._shape = tuple(side // _STEP_PX + 2 for side in size_px)
        x, y = np.meshgrid(*(_STEP_PX * np.arange(n) for n in self._shape), indexing="ij")
        points = np.column_stack([x.ravel(), y.ravel()]).astype(np.float64)
        grid = projection.to_metres(points).reshape(*self._shape, 2)
        self._grid = np.ascontiguousarray(grid, np.float64)
        self._is_right = self._checked(points[::_SOME] + _STEP_PX / 2)

    def _checked(self, xy_px: Floats) -> bool:
        exact, read = self._projection.to_metres(xy_px), self._read(xy_px)
        away = np.abs(exact - read)[np.isfinite(exact) & np.isfinite(read)]
        return bool(away.size and away.max() <= _RIGHT_M)

    def to_metres(self, xy_px: Floats) -> Floats:
        """Return where pixels lie, in metres, shape (point, 2); NaN for those that see no floor."""
        if not self._is_right:
            return self._projection.to_metres(xy_px)
        found = self._read(xy_px)
        off = ~np.isfinite(found).all(axis=1)
        if off.any():
            found[off] = self._projection.to_metres(xy_px[off])
        return found

    def _read(self, xy_px: Floats) -> Floats:
        """Return what the grid tells; NaN beyond it."""
        return read_grid(self._grid, xy_px / _STEP_PX)

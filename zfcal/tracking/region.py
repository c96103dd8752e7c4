"""Where in an image animals can be: over the arena, and a little beyond its walls."""

from __future__ import annotations

import numpy as np
import shapely

from zfcal.arena import Arena
from zfcal.arrays import Bools
from zfcal.cameras.camera import Projection

_BEYOND_M = 0.005
"""A body that touches a wall seems to reach into it; its reflection lies farther out."""


def region_of(arena: Arena, projection: Projection, *, beyond_m: float = _BEYOND_M) -> Bools:
    """Return the pixels that show the arena.

    Parameters
    ----------
    arena
        Its outline counts.
    projection
        Of the camera.
    beyond_m
        What is seen of its walls counts as far.

    Returns
    -------
    ndarray of bool, shape (height, width)
    """
    width, height = projection.size_px
    x, y = np.meshgrid(np.arange(width, dtype=float), np.arange(height, dtype=float))
    at_m = projection.to_metres(np.stack([x, y], axis=-1))
    wide = shapely.buffer(arena.outline, beyond_m)
    shapely.prepare(wide)
    return np.asarray(shapely.contains_xy(wide, at_m[..., 0], at_m[..., 1]), bool)

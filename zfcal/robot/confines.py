"""Where the robot may be: the arena less its radius."""

from __future__ import annotations

from typing import final

import shapely

from zfcal.errors import InputError

_INSIDE_M = 1e-6


@final
class Confines:
    """The places that a robot's centre may take, worked out once.

    Parameters
    ----------
    outline
        The water's edge in metres; holes are walls.
    radius_m
        How far from the wall the centre stays.

    Raises
    ------
    InputError
        Nothing is left of the arena.
    """

    def __init__(self, outline: shapely.Polygon, radius_m: float) -> None:
        if not 0 <= radius_m < float("inf"):
            raise InputError(f"A robot's radius is a length in metres, got {radius_m!r}.")
        self.inner = shapely.buffer(outline, -radius_m, join_style="mitre")
        # The nearest point of the edge itself can round to just outside.
        self._onto = shapely.buffer(self.inner, -_INSIDE_M, join_style="mitre")
        if self._onto.is_empty:
            raise InputError(
                f"A robot of radius {radius_m * 1000:.0f} mm fits nowhere into the arena.",
                hint="Lengths are in metres; see the arena with: zfcal inspect FILE",
            )
        shapely.prepare(self.inner)

    def clamp(self, x_m: float, y_m: float) -> tuple[float, float, bool]:
        """Return the place itself or the nearest one that is allowed, and whether it was moved."""
        point = shapely.Point(x_m, y_m)
        if shapely.covers(self.inner, point):
            return x_m, y_m, False
        nearest = shapely.shortest_line(self._onto, point).coords[0]
        return float(nearest[0]), float(nearest[1]), True

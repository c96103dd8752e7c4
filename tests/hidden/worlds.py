"""The tanks of the hidden trials, as plain numbers.

A tank is an outline, a corridor (or none) and the width of the strip along the
walls. Zones are 0 outside, 1 corridor, 2 walls, 3 centre.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

WALL_ZONE_M = 0.07

_OUTLINE = (
    (0.051, 0.949),
    (0.401, 0.949),
    (0.401, 0.670),
    (0.670, 0.401),
    (0.949, 0.401),
    (0.949, 0.051),
    (0.599, 0.051),
    (0.599, 0.330),
    (0.330, 0.599),
    (0.051, 0.599),
)
_CORRIDOR = ((0.401, 0.670), (0.670, 0.401), (0.599, 0.330), (0.330, 0.599))


@dataclass(frozen=True, slots=True, kw_only=True)
class Tank:
    """A tank.

    Parameters
    ----------
    name
    outline : ndarray, shape (corner, 2)
        Metres, not closed.
    corridor : ndarray, shape (corner, 2)
        Likewise; no rows where there is none.
    liked : ndarray, shape (place, 2)
        Places that fish may like: a trial takes one.
    mouths : ndarray, shape (room, 2)
        The middle of each room's door to the corridor.
    speaker : ndarray, shape (2,)
        Where a sound comes from.
    """

    name: str
    outline: Floats
    corridor: Floats
    liked: Floats
    mouths: Floats
    speaker: Floats


def two_rooms() -> Tank:
    """Return two square rooms joined by a diagonal corridor."""
    return Tank(
        name="two-rooms",
        outline=np.array(_OUTLINE),
        corridor=np.array(_CORRIDOR),
        liked=np.array([(0.10, 0.90), (0.90, 0.10), (0.12, 0.66), (0.66, 0.12)]),
        mouths=np.array([(0.3655, 0.6345), (0.6345, 0.3655)]),
        speaker=np.array([0.051, 0.949]),
    )


def rectangle(width_m: float = 0.8, height_m: float = 0.55) -> Tank:
    """Return an open rectangular tank: walls and centre, no corridor."""
    w, h = width_m, height_m
    return Tank(
        name="rectangle",
        outline=np.array([(0.0, 0.0), (w, 0.0), (w, h), (0.0, h)]),
        corridor=np.zeros((0, 2)),
        liked=np.array([(0.08, 0.08), (w - 0.08, h - 0.08)]),
        mouths=np.zeros((0, 2)),
        speaker=np.array([0.0, h]),
    )


def tank_of(name: str) -> Tank:
    """Return a tank by its name."""
    return {"two-rooms": two_rooms, "rectangle": rectangle}[name]()


def geojson_of(tank: Tank) -> dict:
    """Return the tank as a file that zfcal reads as an arena."""

    def polygon(corners, **properties):
        ring = [[float(x), float(y)] for x, y in [*corners, corners[0]]]
        shape = {"type": "Polygon", "coordinates": [ring]}
        return {"type": "Feature", "properties": properties, "geometry": shape}

    features = [polygon(tank.outline, role="outline")]
    if len(tank.corridor):
        zone = {"role": "zone", "zone": "corridor", "follows_walls": True}
        features.append(polygon(tank.corridor, **zone))
    bins = {"D": [0.0, 0.22], "W": [0.0, 0.18], "V": [0.0, 0.2]}
    return {
        "type": "FeatureCollection",
        "name": tank.name,
        "wall_zone_m": WALL_ZONE_M,
        "wall_tolerance_m": 0.01,
        "bins": bins,
        "features": features,
    }

"""Which zones the fastest step of a fish leads to from which."""

from __future__ import annotations

import numpy as np
import shapely
from numpy.typing import NDArray

from zfcal.arena import Arena, Zone


def within_reach(arena: Arena, dt_s: float) -> NDArray[np.bool_]:
    """Return which zones a step can lead to.

    Parameters
    ----------
    arena
        Its range of speeds says how fast a fish is.
    dt_s
        Duration of a step.

    Returns
    -------
    ndarray of bool, shape (zone, zone)
        From and to. Walls between two zones are not looked at: it is the distance that counts.
    """
    areas = [_area(zone, arena) for zone in arena.zones]
    distance = [[shapely.distance(one, other) for other in areas] for one in areas]
    return np.asarray(np.array(distance) <= arena.bins.speed_m_s[1] * dt_s)


def _area(zone: Zone, arena: Arena) -> shapely.Geometry:
    if zone.polygon is not None:
        return arena.outline.intersection(zone.polygon)
    named = [other.polygon for other in arena.zones if other.polygon is not None]
    rest = arena.outline.difference(shapely.union_all(named))
    inner = arena.outline.buffer(-arena.wall_zone_m)
    return rest.difference(inner) if zone.near_wall else rest.intersection(inner)

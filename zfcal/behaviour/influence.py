"""What a robot makes the fish of a window do, as the rows of its table.

From points to the arrays of `following` and `departures`, and from their measures to rows.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from zfcal.arrays import Floats, Indices, Ints
from zfcal.behaviour.ceilings import fish_places, places_of_fish
from zfcal.behaviour.departures import FOLLOWED, LED, Rooms, measure_departures
from zfcal.behaviour.following import Paths, measure_following, shifts_of
from zfcal.behaviour.located import Located
from zfcal.behaviour.measured import Measured
from zfcal.behaviour.rows import Table
from zfcal.tracks import FISH, ROBOT

FOLLOWING_COLUMNS = (
    "window_end_s",
    "measure",
    "lag_s",
    "value",
    "low",
    "high",
    "ceiling",
    "floor",
    "n",
)
_LOST = -1


def measure_influence(points: Located) -> list[Measured]:
    """Measure how far the fish of a window follow its robots.

    Parameters
    ----------
    points
        All agents of the window. Ids of an animal that was lost are pieced together as for the
        ceilings; no step and no way from room to room leads from one to another.

    Returns
    -------
    list of Measured
        As of `measure_following`, then of `measure_departures`; where the tank has not two
        rooms those of the latter are not defined, and their ``n`` is None.
    """
    robot, fish = points.of_kind(ROBOT), points.of_kind(FISH)
    first = int(points.k[0]) if len(points) else 0
    n_frames = int(points.k[-1]) - first + 1 if len(points) else 0
    shape = (first, n_frames)
    (robots_m, robots), (fish_m, group) = (_columns(one, *shape) for one in (robot, fish))
    places = places_of_fish((group != _LOST).sum(axis=0)) if group.size else _NOBODY
    made = measure_following(
        _paths(robots_m, robots), _paths(fish_m, group), dt_s=points.dt_s, places=places
    )
    if len(points.arena.rooms) < 2:
        return [
            *made,
            *(Measured(measure=name, value=math.nan, n=None) for name in (LED, FOLLOWED)),
        ]
    rooms_of = points.arena.room_of
    return [
        *made,
        *measure_departures(
            Rooms(room=rooms_of(robots_m), who=robots),
            Rooms(room=rooms_of(fish_m), who=group),
            dt_s=points.dt_s,
            shifts=shifts_of(n_frames, points.dt_s),
            places=places,
        ),
    ]


_NOBODY: Indices = np.zeros(0, dtype=np.intp)


def influence_to_rows(made: Sequence[Measured], *, window_end_s: int) -> Table:
    """Return measures as rows.

    Parameters
    ----------
    made
        Of one window.
    window_end_s
        Where it ends, in seconds since the start of the trial.

    Returns
    -------
    dict of list
        The `FOLLOWING_COLUMNS`; None where a number is not defined.
    """
    table: dict[str, list[Any]] = {
        name: [_or_none(getattr(one, name)) for one in made] for name in FOLLOWING_COLUMNS[1:]
    }
    return {"window_end_s": [window_end_s] * len(made), **table}


def _or_none(value: Any) -> Any:
    return None if isinstance(value, float) and math.isnan(value) else value


def _columns(points: Located, first: int, n_frames: int) -> tuple[Floats, Ints]:
    """Return positions and ids of some agents, a column for each animal."""
    place = fish_places(points)
    n_places = int(place.max(initial=-1)) + 1
    xy_m = np.full((n_frames, n_places, 2), np.nan)
    who = np.full((n_frames, n_places), _LOST, dtype=np.int64)
    xy_m[points.k - first, place] = points.xy_m
    who[points.k - first, place] = points.agent
    return xy_m, who


def _paths(xy_m: Floats, who: Ints) -> Paths:
    unbroken = np.zeros(who.shape, dtype=np.bool_)
    unbroken[:-1] = who[1:] == who[:-1]
    return Paths.of(xy_m, unbroken)

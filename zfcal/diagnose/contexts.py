"""Sorting a scene's steps by the state in which they began: the contexts of the omnibus test."""

from __future__ import annotations

import numpy as np

from zfcal.arrays import Floats, Ints
from zfcal.diagnose.surroundings import Surroundings, signed_angle
from zfcal.model.scene import Moves, Scene

NOWHERE = -1
_MINUTE_S = 60.0
_SECTORS = 8
_PLACES = 4
N_FIELDS = _PLACES**2
_NEAR_M = (0.02, 0.04, 0.06, 0.08, 0.12, 0.20, 0.40)
_LAST_TURN_RAD = (-2.0, -1.0, -0.4, 0.0, 0.4, 1.0, 2.0)


def contexts(scene: Scene, steps: Moves, about: Surroundings) -> dict[str, Ints]:
    """Return the bin of each step in each context, -1 where it has none, shape (step,).

    Parameters
    ----------
    steps
        Turns or moves of the scene.
    about
        What their agents had about them.
    """
    minute = ((about.time_s - about.time_s.min(initial=np.inf)) // _MINUTE_S).astype(np.int64)
    with_one = about.near >= 0
    last = signed_angle(about.heading, about.past)
    turned = (about.past**2).sum(axis=1) > 0
    ahead = _sector(signed_angle(about.toward_near, about.heading))
    return {
        "zone": steps.zone,
        "minute": minute,
        "minute by the wall": np.where(about.follows, minute, NOWHERE),
        "agent": np.unique(steps.track, return_inverse=True)[1].astype(np.int64),
        "company": np.minimum(about.company, 5).astype(np.int64),
        "wall distance": _fifths(about.wall_m),
        "bearing of the wall": _sector(signed_angle(about.from_wall, about.heading)),
        "last turn": np.where(turned, np.digitize(last, _LAST_TURN_RAD), NOWHERE),
        "last speed": _fifths(about.speed_m_s),
        "nearest neighbour's distance": np.where(
            with_one, np.digitize(about.near_m, _NEAR_M), NOWHERE
        ),
        "nearest neighbour's bearing": np.where(with_one, ahead, NOWHERE),
        "neighbours' heading": np.where(
            (about.company_heading**2).sum(axis=1) > 0,
            _sector(signed_angle(about.company_heading, about.heading)),
            NOWHERE,
        ),
        "neighbours' speed": np.where(about.company > 0, _fifths(about.pace_m_s), NOWHERE),
        "compass": _sector(np.arctan2(about.heading[:, 1], about.heading[:, 0])),
        "place": field_of(scene, about.x_m, about.y_m),
    }


def _sector(angle_rad: Floats) -> Ints:
    """Return which eighth of the circle an angle is in, the first about 0."""
    return np.mod(np.rint(angle_rad * _SECTORS / (2 * np.pi)), _SECTORS).astype(np.int64)


def _fifths(values: Floats) -> Ints:
    """Return which fifth of all values each is in."""
    known = values[np.isfinite(values)]
    if not known.size:
        return np.full(len(values), NOWHERE)
    bins = np.digitize(values, np.quantile(known, (0.2, 0.4, 0.6, 0.8)))
    return np.where(np.isfinite(values), bins, NOWHERE).astype(np.int64)


def field_of(scene: Scene, x_m: Floats, y_m: Floats) -> Ints:
    """Return the field of a 4 by 4 grid over the tank."""
    x0, y0, x1, y1 = scene.arena.outline.bounds
    column = np.clip((x_m - x0) / (x1 - x0) * _PLACES, 0, _PLACES - 1).astype(np.int64)
    row = np.clip((y_m - y0) / (y1 - y0) * _PLACES, 0, _PLACES - 1).astype(np.int64)
    return row * _PLACES + column


def speed_context(speed_m_s: Floats) -> Ints:
    """Return the fifth of the step's own speed: for its heading, which is drawn after it."""
    return _fifths(speed_m_s)

"""What the fish of some steps have about them, and directions and weights of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from zfcal.arrays import Floats

AWAY_M = 9.0
"""In place of the distance to one who is not there."""

LAGS = (1, 2, 3, 4, 5, 8)
"""Steps by which a response may be late."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Seen:
    """What the fish of some steps have about them; directions are unit vectors.

    Parameters
    ----------
    attention : ndarray, shape (step, other)
        alpha times the solid angle at which each other agent is seen; 0 for who is not seen.
    toward, soon_toward, half_toward : ndarray, shape (step, other, 2)
        Where the base law draws to, away from who is too near: now, where the other was a tenth of
        a step before, and half a step. Zeros for who is not there.
    late_toward, older_toward : ndarray, shape (step, other, 2)
        The same of whom the fish would have seen, had all others been where they were a step
        before, and two.
    late_attention, older_attention : ndarray, shape (step, other)
        Likewise.
    ago_toward, then_toward : ndarray, shape (lag, step, other, 2)
        Where the other was `LAGS` steps before, seen or not: from where the fish is, and from where
        it was itself.
    bearing : ndarray, shape (step, other, 2)
        To the other.
    distance_m, off_axis_rad, speed_m_s : ndarray, shape (step, other)
        Of the other: `AWAY_M` where it is not there; how far aside of the own heading; its speed.
    heading : ndarray, shape (step, other, 2)
        Of the other.
    here, in_sight, is_robot : ndarray of bool, shape (step, other)
    other : ndarray of int, shape (step, other)
        Track of the other; -1 for who is not there.
    own_heading, along_wall, way_out, xy_m : ndarray, shape (step, 2)
        ``way_out``: to the nearest way out of a room; zeros elsewhere.
    x_axis : ndarray, shape (step, 2)
        That of the tank. Where positions are drawn anew all directions are turned, so that the
        heading taken stays the measured one.
    follows_walls : ndarray of bool, shape (step,)
        Whether the zone does.
    zone, track : ndarray of int, shape (step,)
    own_speed_m_s : ndarray, shape (step,)
        Of the step itself, which is given.
    last_turn_rad : ndarray, shape (step,)
        To the left; 0 where it is not known.
    ago_heading : ndarray, shape (lag, step, 2)
        Own headings `LAGS` steps before; zeros where it is not known.
    recent_turn_rad : ndarray, shape (step,)
        Mean of the last turns, the later the more it counts; wide ones count as 1.2.
    time : ndarray, shape (step,)
        Share of the recording that has passed.
    left_s : ndarray, shape (step,)
        Since another one that is still away left the room.
    each_left_s : ndarray, shape (step, other)
        Since each other one left it, though it may have come back; infinite for who did not.
    """

    attention: Floats
    toward: Floats
    soon_toward: Floats
    half_toward: Floats
    late_toward: Floats
    older_toward: Floats
    late_attention: Floats
    older_attention: Floats
    ago_toward: Floats
    then_toward: Floats
    bearing: Floats
    distance_m: Floats
    off_axis_rad: Floats
    speed_m_s: Floats
    heading: Floats
    here: NDArray[np.bool_]
    in_sight: NDArray[np.bool_]
    is_robot: NDArray[np.bool_]
    other: NDArray[np.int32]
    own_heading: Floats
    along_wall: Floats
    way_out: Floats
    xy_m: Floats
    x_axis: Floats
    follows_walls: NDArray[np.bool_]
    zone: NDArray[np.int64]
    track: NDArray[np.int32]
    own_speed_m_s: Floats
    last_turn_rad: Floats
    ago_heading: Floats
    recent_turn_rad: Floats
    time: Floats
    left_s: Floats
    each_left_s: Floats

    @property
    def nearest(self) -> Floats:
        """One for the nearest other one, else 0, shape (step, other, 1)."""
        if not self.here.size:
            return np.zeros((*self.here.shape, 1))
        chosen = np.zeros(self.here.shape)
        chosen[np.arange(len(chosen)), self.distance_m.argmin(axis=1)] = 1.0
        return (chosen * self.here)[..., None]

    def by_distance(self, knots_m: Sequence[float]) -> Floats:
        """Return hat functions of the distances, 0 for who is not there."""
        return hats(self.distance_m, knots_m) * self.here[..., None]


def hats(values: ArrayLike, knots: Sequence[float]) -> Floats:
    """Return the hat functions between knots, which add up to one.

    Parameters
    ----------
    values : array_like
        Beyond the first and last knot they count as there.
    knots
        Ascending.

    Returns
    -------
    ndarray, shape (..., knot)
    """
    at = np.asarray(knots, dtype=np.float64)
    x = np.clip(np.asarray(values, dtype=np.float64), at[0], at[-1])
    below = np.clip(np.searchsorted(at, x, side="right") - 1, 0, len(at) - 2)
    share = (x - at[below]) / (at[below + 1] - at[below])
    made = np.zeros((*x.shape, len(at)))
    np.put_along_axis(made, below[..., None], (1 - share)[..., None], -1)
    np.put_along_axis(made, below[..., None] + 1, share[..., None], -1)
    return made


def of_tank(seen: Seen, ways: Floats) -> Floats:
    """Return directions of the tank, shape (step or 1, way, 2), as they are seen."""
    x, y = ways[..., 0], ways[..., 1]
    c, s = seen.x_axis[:, :1], seen.x_axis[:, 1:]
    return np.stack([c * x - s * y, s * x + c * y], axis=-1)


def aside_of(seen: Seen, toward: Floats, *, along_walls: bool = False) -> Floats:
    """Return the sines of the angles from the own heading to unit vectors.

    Shape (step, vector), of vectors of shape (step, vector, 2). None along walls, if not asked for:
    there the base law forgets the heading.
    """
    own = seen.own_heading[:, None]
    sine = own[..., 0] * toward[..., 1] - own[..., 1] * toward[..., 0]
    return sine if along_walls else np.where(seen.follows_walls[:, None], 0.0, sine)


def left_of(ways: Floats) -> Floats:
    """Return unit vectors turned to the left by a right angle, shape (..., 2)."""
    return np.stack([-ways[..., 1], ways[..., 0]], axis=-1)


def turned_by(ways: Floats, angle_rad: ArrayLike) -> Floats:
    """Return unit vectors turned to the left by an angle, shape (..., 2)."""
    c, s = np.cos(angle_rad)[..., None], np.sin(angle_rad)[..., None]
    return np.asarray(c * ways + s * left_of(ways))


def only(weights: Floats) -> Floats:
    """Return weights of a source that is the only one: an axis for it is put in."""
    return weights[:, None]

"""Weights that the features of several effects share."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import shapely
from numpy.typing import NDArray

from zfcal.arrays import Floats
from zfcal.model.directions import in_tank, lengths
from zfcal.model.effects.circumstances import each_fish, each_under
from zfcal.model.features import MOST_SHARPER, Along, Component, Seen, Tilt, Turned, Weights
from zfcal.model.kernels.hats import hats, hats_where

_LEAST = -0.98
"""The lowest strength of what a mixture has already: two hundredths of it are left."""

_AGREEMENTS = (0.5, 0.7, 0.85, 1.0)
"""Lengths of the mean of headings from which several count as agreeing, up to all alike."""

_NEARED_M = (0.05, 0.15)
"""Between those that are near already, and those that may be neared."""

IN_VIEW_M, SHARP = (0.1, 0.25, 9.0), 8.0
"""Distances within which those in view draw headings sharply, and how concentrated these are about
them: to be drawn to the fastest is held against to be drawn to each."""

_PER_M_S = 10.0
"""A step at 0.1 m/s counts as one."""


def aside_of(seen: Seen, toward: Floats, *, along_walls: bool = False) -> Floats:
    """Return the sines of the angles from the own heading to unit vectors.

    Shape (step, vector), of vectors of shape (step, vector, 2). None along walls, if not asked for:
    there the base law forgets the heading.
    """
    own = seen.own_heading[:, None]
    sine = own[..., 0] * toward[..., 1] - own[..., 1] * toward[..., 0]
    return sine if along_walls else np.where(seen.follows_walls[:, None], 0.0, sine)


def who(seen: Seen) -> Floats:
    """Return one for each fish but one, shape (step, fish): what that one has, all have."""
    return seen.once(each_fish)[:, :-1]


def turning_as_a_whole(
    by: Callable[[Seen], Floats],
    *,
    label: str = "turning as a whole",
    low: float | None = None,
    along: Along | None = None,
) -> tuple[Turned, Turned]:
    """Return turns of all directions: everywhere, and where fish follow no wall.

    Parameters
    ----------
    by
        Which way the fish of each step turn, along walls too.
    label
        Of both.
    low, along
        Of a `Turned`.
    """

    def off_walls(seen: Seen) -> Floats:
        return np.asarray((by(seen).T * ~seen.follows_walls).T)

    everywhere = Turned(label=label, by=by, neighbours=True, low=low, along=along)
    return everywhere, replace(everywhere, label=f"{label}, off the walls", by=off_walls)


def both_senses(seen: Seen) -> Floats:
    """Return the two ways along a wall, shape (step, sense, 2)."""
    return np.stack([seen.along_wall, -seen.along_wall], axis=1)


def to_one_sense(seen: Seen, share: Floats | float = 1.0) -> Floats:
    """Return half of the way along walls, taken from the second sense, shape (step, sense, 1).

    Parameters
    ----------
    share : float or ndarray, shape (step,)
        How much of it.
    """
    half = 0.5 * seen.follows_walls * share
    return np.stack([half, -half], axis=1)[..., None]


def own_heading_by(seen: Seen, weights: Floats) -> Floats:
    """Return the own heading, by what weights but the first have beside their mean of all steps.

    Parameters
    ----------
    weights : ndarray, shape (step, weight)

    Returns
    -------
    ndarray, shape (step, weight - 1, 2)
        Vectors of a tilt.
    """
    return np.asarray((weights - weights.mean(axis=0))[:, 1:, None] * seen.own_heading[:, None])


def own_ways(seen: Seen) -> Floats:
    """Return where the base law draws without others: ahead, or both ways along a wall.

    Shape (step, way, 2); see `own_shares`.
    """
    along = seen.follows_walls[:, None, None]
    ahead = np.stack([seen.own_heading, np.zeros_like(seen.own_heading)], axis=1)
    return np.where(along, both_senses(seen), ahead)


def own_shares(seen: Seen) -> Floats:
    """Return the share of each of these ways, shape (step, way, 1)."""
    half = np.where(seen.follows_walls, 0.5, 0.0)
    return np.stack([1.0 - half, half], axis=1)[..., None]


def halfway(seen: Seen, toward: Floats) -> Floats:
    """Return unit vectors half-way between the own heading and others, shape (step, vector, 2).

    Parameters
    ----------
    toward : ndarray, shape (step, vector, 2)
        Unit vectors; zeros stay zeros.
    """
    between = seen.own_heading[:, None] + toward
    length = np.linalg.norm(between, axis=-1, keepdims=True)
    known = (length > 0) & (toward != 0).any(axis=-1, keepdims=True)
    return np.asarray(np.divide(between, length, out=np.zeros_like(between), where=known))


def mean_heading(seen: Seen, reach_m: float, *, in_sight: bool = False) -> Floats:
    """Return the unit vector of the mean heading of those within reach, shape (step, 1, 2).

    Of those in sight alone, if asked for.
    """
    total, _ = _total_heading(seen, reach_m, in_sight=in_sight)
    return _unit(total)[:, None]


def _total_heading(seen: Seen, reach_m: float, *, in_sight: bool) -> tuple[Floats, Floats]:
    """Return the sum of the headings of some, shape (step, 2), and how many there are, (step,)."""
    counts = seen.here & (seen.distance_m < reach_m) & (seen.in_sight | (not in_sight))
    weights = counts.astype(np.float64)
    return np.einsum("sjd,sj->sd", seen.heading, weights), weights.sum(axis=1)


def _unit(total: Floats) -> Floats:
    return np.asarray(total / np.maximum(lengths(total), 1e-9)[:, None])


def agreed_heading(seen: Seen, reach_m: float) -> Floats:
    """Return that vector of two or more in sight, by how far they agree, shape (step, 3, 2).

    By the length of their mean: what several hold to in common is followed more than their mean is.
    """
    total, n = _total_heading(seen, reach_m, in_sight=True)
    by = hats(lengths(total) / np.maximum(n, 1.0), _AGREEMENTS)[:, 1:] * (n > 1)[:, None]
    return np.asarray(by[..., None] * _unit(total)[:, None])


def summed(weights: Floats, ways: Floats) -> Floats:
    """Return sums of directions of others, shape (step, weight, 2).

    Parameters
    ----------
    weights : ndarray, shape (step, other, weight)
    ways : ndarray, shape (step, other, 2)
    """
    return np.asarray(np.einsum("sjb,sjd->sbd", weights, ways))


def seen_and_nearest(seen: Seen) -> Floats:
    """Return weights for each that is seen, and for the nearest, shape (step, other, 2)."""
    return np.concatenate([(seen.in_sight & seen.here)[..., None], seen.nearest], axis=2)


def only(weights: Floats) -> Floats:
    """Return weights of a source that is the only one: an axis for it is put in."""
    return weights[:, None]


def attended(weights: Weights) -> Weights:
    """Return weights of what is seen of the others, with a factor."""
    return lambda seen: seen.attention[..., None] * weights(seen)


def factor_on_attention(
    weights: Weights,
    label: str = "attention",
    high: float | None = None,
    along: Along | None = None,
) -> Component:
    """Return a factor on what fish attend to of the others: 1 + strength times weight, never none.

    Parameters
    ----------
    weights
        Shape (step, other, weight).
    label
        Of the feature.
    high
        Upper bound of the strengths: 0 where attention can but be lost.
    along
        Of the feature.
    """
    return Component(
        label=label, toward="toward", weights=attended(weights), low=_LEAST, high=high, along=along
    )


LEANING_OUT = each_under(
    Tilt(label="leaning to the way out", vectors=lambda seen: seen.way_out[:, None])
)
"""What fish may do by circumstances and is no direction, no place and no answer to others."""


def every_step(seen: Seen) -> Floats:
    """Return one for each step, shape (step, 1)."""
    return np.ones((len(seen.zone), 1))


def evenly(seen: Seen) -> Floats:
    """Return one for everybody, shape (step, other, 1)."""
    return np.ones((*seen.attention.shape, 1))


def precision_of_attention(
    weights: Weights, label: str, *, low: float = -MOST_SHARPER, high: float = MOST_SHARPER
) -> Component:
    """Return how much more concentrated headings are about what fish attend to, in tenths.

    Parameters
    ----------
    weights
        Shape (step, other, weight).
    label
        Of the feature.
    low, high
        Bounds of the strengths.
    """
    by = attended(weights)
    return Component(
        label=label, toward="toward", weights=by, instead=by, kappa="sharper", low=low, high=high
    )


ATTENTION = each_under(factor_on_attention(evenly))
LESS_ATTENTION = each_under(factor_on_attention(evenly, high=0.0))
"""What fish may attend to by circumstances, whoever it is: in any measure, and less alone."""


def rooms_of(
    seen: Seen, rooms: Sequence[shapely.Geometry]
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return which room a fish is in, (step, room), and each other, (step, other, room)."""
    bearing = in_tank(seen.x_axis, seen.bearing)
    x, y = np.moveaxis(seen.xy_m[:, None] + seen.distance_m[..., None] * bearing, -1, 0)
    mine = np.stack([shapely.contains_xy(room, seen.xy_m) for room in rooms], axis=-1)
    return mine, np.stack([shapely.contains_xy(room, x, y) for room in rooms], axis=-1)


def middle_of(seen: Seen, counts: NDArray[np.bool_]) -> tuple[Floats, Floats]:
    """Return the unit vector to the middle of some others, and how far it is.

    Parameters
    ----------
    counts : ndarray of bool, shape (step, other)
        Who is among them.
    """
    distance = np.where(seen.here & counts, seen.distance_m, 0.0)
    total = np.einsum("sjd,sj->sd", seen.bearing, distance)
    mean = total / np.maximum((seen.here & counts).sum(axis=1), 1)[:, None]
    far = lengths(mean)
    return mean / np.maximum(far, 1e-9)[:, None], far


def middle_by(seen: Seen, knots_m: tuple[float, ...]) -> tuple[Floats, Floats]:
    """Return the unit vector to the middle of all others, and hat functions of its distance."""
    toward, far = middle_of(seen, np.ones_like(seen.here))
    return toward, hats(far, knots_m)


def _nearing_middle(seen: Seen) -> Floats:
    toward, weights = middle_by(seen, _NEARED_M)
    return _by_reach(seen, weights[..., None] * toward[:, None])


def _nearing_each(seen: Seen) -> Floats:
    return _by_reach(seen, summed(hats_where(seen.here, seen.distance_m, _NEARED_M), seen.bearing))


def _nearing_nearest(seen: Seen) -> Floats:
    near = hats_where(seen.here, seen.distance_m, _NEARED_M) * seen.nearest
    return _by_reach(seen, summed(near, seen.bearing))


def _by_reach(seen: Seen, vectors: Floats) -> Floats:
    """Return vectors by how long the step is: so much nearer does it end, if it goes that way."""
    return np.asarray(_PER_M_S * seen.own_speed_m_s[:, None, None] * vectors)


NEARING: dict[str, Weights] = {
    "the middle": _nearing_middle,
    "each": _nearing_each,
    "the nearest": _nearing_nearest,
}
"""Of whom a step may end nearer to: vectors of a tilt, shape (step, weight, 2)."""

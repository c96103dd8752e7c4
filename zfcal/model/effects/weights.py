"""Weights that the features of several effects share."""

from __future__ import annotations

import numpy as np

from zfcal.arrays import Floats
from zfcal.model.features import Along, Component, Seen, Weights

_LEAST = -0.98
"""The lowest strength of what a mixture has already: two hundredths of it are left."""


def aside_of(seen: Seen, toward: Floats, *, along_walls: bool = False) -> Floats:
    """Return the sines of the angles from the own heading to unit vectors.

    Shape (step, vector), of vectors of shape (step, vector, 2). None along walls, if not asked for:
    there the base law forgets the heading.
    """
    own = seen.own_heading[:, None]
    sine = own[..., 0] * toward[..., 1] - own[..., 1] * toward[..., 0]
    return sine if along_walls else np.where(seen.follows_walls[:, None], 0.0, sine)


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


def evenly(seen: Seen) -> Floats:
    """Return one for everybody, shape (step, other, 1)."""
    return np.ones((*seen.attention.shape, 1))

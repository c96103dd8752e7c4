"""Features in place of forms: what an effect's name means for a heading, whatever its form.

Nobody knows the form in which fish have an effect: a stimulus may be one more component of the
mixture or a preference that all headings have, near or far, by what is seen or by who is next. So
a name is a set of features here. Each has weights by hat functions of a distance, a bearing, a
speed or the time, each weight with a strength of its own. A few strengths of some features
together come near to any form that the name may have.

The files of effects say which features theirs are. How they are fitted stands in
`zfcal.diagnose.features`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from zfcal.arrays import Floats
from zfcal.model.seen import Seen

_LEAST = -0.98
"""The lowest strength of what a mixture has already: two hundredths of it are left."""


Weights: TypeAlias = Callable[[Seen], Floats]
"""Of a `Seen`: shape (step, source, weight); of a tilt or a landing (step, weight)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Along:
    """What the first weights of a feature go by: hat functions of one number.

    Parameters
    ----------
    cue
        That number, with its unit.
    knots
        One for each of these weights, ascending.
    none_at
        A knot before them at which there is nothing to fit; None without one.
    besides
        What the weights after those of the knots are for.
    """

    cue: str
    knots: tuple[float, ...]
    none_at: float | None = None
    besides: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Component:
    """Headings drawn about the directions of some sources: one more component of the mixture.

    Parameters
    ----------
    label
        Tells it from other features of the effect.
    toward
        Unit vectors to the sources, shape (step, source, 2); or which field of `Seen` they are, so
        that what several features need is integrated once.
    weights
        Shape (step, source, weight): a strength is fitted for each weight.
    kappa
        Concentration about a source; ``own`` or ``neighbours``: as the base law has it there.
    instead
        Weights of what it takes the place of, of the directions to where the others are now: True
        for all of the attention to them.
    low, high
        Bounds of the strengths.
    along
        What its weights go by, where that is one number: they are a curve then.
    over
        What it has to gain more than, where that is no case of the effect: what all fish do alike,
        of a feature of how they differ.
    """

    label: str
    toward: Weights | Literal["toward", "bearing", "heading"]
    weights: Weights
    kappa: float | Literal["own", "neighbours"] = "neighbours"
    instead: Weights | bool = False
    low: float = 0.0
    high: float | None = None
    along: Along | None = None
    over: Component | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Tilt:
    """A preference of all headings: a factor exp(strength cos(heading - direction)) on the density.

    Parameters
    ----------
    label
        Tells it from other features of the effect.
    vectors
        Direction times weight, shape (step, weight, 2).
    low
        Lower bound of the strengths, where the opposite is no form of the effect.
    along
        What its weights go by, where that is one number: they are a curve then.
    over
        As of a `Component`.
    """

    label: str
    vectors: Weights
    low: float | None = None
    along: Along | None = None
    over: Tilt | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Turned:
    """Directions of the law turned to the left by a small angle.

    Parameters
    ----------
    label
        Tells it from other features of the effect.
    by
        The angle at a strength of one, shape (step,) or (step, weight).
    neighbours
        Whether those to neighbours turn as well.
    low
        Lower bound of the strengths, where the opposite is no form of the effect.
    along
        What its weights go by, where that is one number: they are a curve then.
    over
        As of a `Component`.
    """

    label: str
    by: Callable[[Seen], Floats]
    neighbours: bool
    low: float | None = None
    along: Along | None = None
    over: Turned | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sharper:
    """The base's own headings more concentrated, or less, in some steps.

    Parameters
    ----------
    label
        Tells it from other features of the effect.
    by
        Shape (step, weight): about a tenth of the concentration at a strength of one.
    along
        What its weights go by, where that is one number: they are a curve then.
    """

    label: str
    by: Weights
    along: Along | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Leaving:
    """A factor on steps that end in another zone: between the rooms, or away from the walls.

    Parameters
    ----------
    label
        Tells it from other features of the effect.
    weights
        Shape (step, weight): the log of the factor at a strength of one.
    into
        ``between`` the rooms; or into the ``open``,
        the last other zone that does not follow walls. Steps that begin between the rooms do not
        count.
    along
        What its weights go by, where that is one number: they are a curve then.
    """

    label: str
    weights: Weights
    into: Literal["between", "open"] = "between"
    along: Along | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OneOf:
    """Features of which only the most promising ones are fitted, such as places.

    Parameters
    ----------
    kind
        What they are called together.
    features
        Of one sort.
    near
        Features near to one of them, itself among them, of which the most promising is fitted: so
        that many are looked at where a few say that something is there.
    """

    kind: str
    features: Sequence[Component | Tilt | Turned]
    near: Callable[[int], Sequence[Component | Tilt | Turned]] | None = None

    @property
    def n_tried(self) -> int:
        """Of so many features the best is taken."""
        n = len(self.features)
        return n if self.near is None else sum(len(self.near(k)) for k in range(n))


Mixed: TypeAlias = Component | Turned | Sharper
"""What adds to the mixture: it is fitted with the base's parameters."""

Single: TypeAlias = Mixed | Tilt | Leaving
Feature: TypeAlias = Single | OneOf


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

"""The sorts of features, and what one has besides: weights, and what these go by."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Floats
from zfcal.model.features.seen import Seen

MOST_SHARPER = 3.0
"""Tenths by which features change a concentration at most."""


Weights: TypeAlias = Callable[[Seen], Floats]
"""Of a `Seen`: shape (step, source, weight) of a component, (step, weight, 2) of a tilt, and
(step, weight) of what has no source."""


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
        Concentration about a source; ``own`` or ``neighbours``: as the base law has it there;
        ``sharper``: a tenth more than about neighbours.
    instead
        Weights of what it takes the place of, of the directions to where the others are now, which
        have the base law's concentration if it is sharper: True for all of the attention to them.
    low, high
        Bounds of the strengths.
    along
        What its weights go by, where that is one number: they are a curve then.
    over
        What it has to gain more than, where that is no case of the effect: what all fish do alike,
        of a feature of how they differ.
    counts_whole
        Whether both count together once it gains more than ``over`` beyond chance: no other name
        needs both.
    """

    label: str
    toward: (
        Weights
        | Literal["toward", "bearing", "heading", "soon_toward", "soon_ago_toward", "half_toward"]
    )
    weights: Weights
    kappa: float | Literal["own", "neighbours", "sharper"] = "neighbours"
    instead: Weights | bool = False
    low: float = 0.0
    high: float | None = None
    along: Along | None = None
    over: Component | None = None
    counts_whole: bool = False


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Tilt:
    """A preference of all headings: a factor exp(strength cos(heading - direction)) on the density.

    Parameters
    ----------
    label
        Tells it from other features of the effect.
    vectors
        Direction times weight, shape (step, weight, 2).
    axial
        Whether the factor is exp(strength cos 2(heading - axis)): both ways of an axis alike.
        Vectors then have twice the angle of the axis.
    low
        Lower bound of the strengths, where the opposite is no form of the effect.
    along
        What its weights go by, where that is one number: they are a curve then.
    over, counts_whole
        As of a `Component`.
    """

    label: str
    vectors: Weights
    axial: bool = False
    low: float | None = None
    along: Along | None = None
    over: Tilt | None = None
    counts_whole: bool = False


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
    over, counts_whole
        As of a `Component`.
    """

    label: str
    by: Callable[[Seen], Floats]
    neighbours: bool
    low: float | None = None
    along: Along | None = None
    over: Turned | None = None
    counts_whole: bool = False


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
        ``between`` the rooms; or into the ``open``, the last other zone that does not follow
        walls. Steps that begin between the rooms do not count. ``again``: between the rooms, of
        those that begin there.
    along
        What its weights go by, where that is one number: they are a curve then.
    over
        As of a `Component`.
    """

    label: str
    weights: Weights
    into: Literal["between", "open", "again"] = "between"
    along: Along | None = None
    over: Leaving | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Landing:
    """A preference for steps that end near something: a factor on where headings land.

    Parameters
    ----------
    label
        Tells it from other features of the effect.
    away_m
        How far some positions are from it, shape (row, heading): of what the fish of all steps have
        about them, the rows of the steps that are asked for, and positions (row, heading, 2).
    knots_m
        Distances of its hat functions; at the last one there is none.
    along
        What its weights go by.
    over
        As of a `Component`; it need not be a part of this one.
    forms
        Shapes of the effect in a model that say the same, such as the place that it is about.
    """

    label: str
    away_m: Callable[[Seen, NDArray[np.intp], Floats], Floats]
    knots_m: tuple[float, ...]
    along: Along | None = None
    over: Landing | None = None
    forms: tuple[Mapping[str, float], ...] = ()


Choosable: TypeAlias = Component | Tilt | Turned | Leaving | Landing
"""Features of which a first look may say how promising they are."""


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
    features: Sequence[Choosable]
    near: Callable[[int], Sequence[Choosable]] | None = None

    @property
    def n_tried(self) -> int:
        """Of so many features the best is taken."""
        n = len(self.features)
        return n if self.near is None else sum(len(self.near(k)) for k in range(n))


Mixed: TypeAlias = Component | Turned | Sharper
"""What adds to the mixture: it is fitted with the base's parameters."""

Single: TypeAlias = Mixed | Tilt | Leaving | Landing
Feature: TypeAlias = Single | OneOf

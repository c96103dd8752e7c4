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

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Floats

AWAY_M = 9.0
"""In place of the distance to one who is not there."""

MOST_SHARPER = 3.0
"""Tenths by which features change a concentration at most."""

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
    soon_attention, half_attention, late_attention, older_attention : ndarray, shape (step, other)
        Likewise, had all others been where they were a tenth of a step before, half a step, one and
        two.
    ago_toward, then_toward : ndarray, shape (lag, step, other, 2)
        Where the other was `LAGS` steps before, seen or not: from where the fish is, and from where
        it was itself.
    bearing : ndarray, shape (step, other, 2)
        To the other.
    distance_m, off_axis_rad, speed_m_s, lately_m_s : ndarray, shape (step, other)
        Of the other: `AWAY_M` where it is not there; how far aside of the own heading; its last
        speed, and the mean over two seconds.
    heading, course : ndarray, shape (step, other, 2)
        Of the other: the direction of its last step, and its mean velocity over two seconds in m/s;
        zeros where that is not known.
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
    in_open : ndarray, shape (step, other)
        Share of the last five seconds that the other was off the walls.
    stayed_s : ndarray, shape (step,)
        Since the fish came into its room, or between the rooms, or into the recording.
    """

    attention: Floats
    toward: Floats
    soon_toward: Floats
    half_toward: Floats
    late_toward: Floats
    older_toward: Floats
    soon_attention: Floats
    half_attention: Floats
    late_attention: Floats
    older_attention: Floats
    ago_toward: Floats
    then_toward: Floats
    bearing: Floats
    distance_m: Floats
    off_axis_rad: Floats
    speed_m_s: Floats
    lately_m_s: Floats
    heading: Floats
    course: Floats
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
    in_open: Floats
    stayed_s: Floats
    _made: dict[Callable[[Seen], Floats], Floats] = field(
        default_factory=dict, init=False, repr=False
    )

    def once(self, make: Callable[[Seen], Floats]) -> Floats:
        """Return what a function makes of what is seen, worked out once: not to be written to."""
        if make not in self._made:
            self._made[make] = make(self)
        return self._made[make]

    @property
    def nearest(self) -> Floats:
        """One for the nearest other one, else 0, shape (step, other, 1)."""
        return self.chosen(-self.distance_m, self.here)

    @property
    def foremost(self) -> Floats:
        """One for the other one that is most straight ahead, of those before the fish."""
        return self.chosen(-self.off_axis_rad, self.here & (self.off_axis_rad < math.pi / 2))

    def chosen(self, values: Floats, among: NDArray[np.bool_]) -> Floats:
        """Return one for the other one of the highest value, else 0, shape (step, other, 1).

        Parameters
        ----------
        values, among : ndarray, shape (step, other)
            Of those among whom it is chosen.
        """
        if not among.size:
            return np.zeros((*among.shape, 1))
        best = np.where(among, values, -np.inf).argmax(axis=1)
        is_best = best[:, None] == np.arange(among.shape[1])
        return np.asarray((is_best & among)[..., None], dtype=np.float64)


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
    toward: Weights | Literal["toward", "bearing", "heading", "soon_toward", "half_toward"]
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
    """

    label: str
    away_m: Callable[[Seen, NDArray[np.intp], Floats], Floats]
    knots_m: tuple[float, ...]
    along: Along | None = None
    over: Landing | None = None


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

"""What an effect is: the shape that each file of this folder fills in.

An effect adds to a step, by compiled C functions, any of:

``component``
    a von Mises component of the heading mixture, with its weight beside the
    base's weight of one;
``factor``
    a factor in [0, 1] on the density of a heading and its landing zone;
``speed``
    a factor on the drawn speed;
``sight``
    a factor on the solid angle at which a neighbour is seen;
``rotation``
    an angle by which the directions of the base's law are turned to the left.

``lag``
    the name of a parameter in seconds: others are seen where they were then.

Each gets the agents' state as numbers in rows of n, one row for each name in
`zfcal.model.kernels.state` (``state[X * n + i]``), the solid angles that agent
i sees as ``sight[i * n + j]``, and its parameters in their order. An agent
that is not there has zone 0; nobody sees it.

One parameter is the strength: at its null the effect does nothing. The others are
shapes. Whether a recording shows an effect is asked near the null, at a few shapes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from zfcal.arena import Arena
from zfcal.arrays import Floats
from zfcal.errors import InputError
from zfcal.model.features import Feature
from zfcal.model.kernels.curves import CUES, KNOTS, MORE, check_curve, has_curve
from zfcal.model.paces import Pace, PaceFeature

MAX_PARAMETERS = 8

NEIGHBOURS = 8
"""Of so many neighbours each may have a component of its own."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EffectParameter:
    """One number of an effect.

    Parameters
    ----------
    name
        As in the model file.
    low, high
        Bounds within which it is calibrated.
    default
        Used where the model file is silent.
    says
        What it means, with its unit.
    """

    name: str
    low: float
    high: float
    default: float
    says: str


Shapes = tuple[dict[str, float], ...]


def curve_of(low: float, high: float) -> tuple[EffectParameter, ...]:
    """Return the parameters that any effect may have besides: by what its strength goes.

    Parameters
    ----------
    low, high
        Bounds of its strength, which is that at the middle one of three knots.
    """
    cues = ", ".join(f"{number} {says}" for number, (says, _) in enumerate(CUES))
    own = [
        ("by", 0.0, len(CUES) - 1.0, f"What the strength goes by: {cues}."),
        *((name, -1e9, 1e9, "Of the cue, ascending.") for name in KNOTS),
        ("more_1", low - high, high - low, "Strength beyond its own at and below the first knot."),
        ("more_3", low - high, high - low, "Strength beyond its own at and above the last knot."),
    ]
    return tuple(
        EffectParameter(name=name, low=least, high=most, default=0.0, says=says)
        for name, least, most, says in own
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Company:
    """Whom and what a recording holds; it decides which effects can be asked for.

    Parameters
    ----------
    n_fish, n_robots
        Agents that were seen for more than a moment.
    has_rooms
        Whether the arena has rooms, with a zone between them.
    follows_walls
        Whether a zone of the arena follows walls.
    """

    n_fish: int
    n_robots: int
    has_rooms: bool
    follows_walls: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Control:
    """A question whose answer is no in every tank: an effect, asked of states that tell it nothing.

    Parameters
    ----------
    name
        As findings tell of it.
    states
        From an agents' states, shape (sample, row, agent), the seconds between samples and
        random numbers: the states that the effect is asked of instead.
    """

    name: str
    states: Callable[[Floats, float, np.random.Generator], Floats]


@dataclass(frozen=True, slots=True, kw_only=True)
class Likeness:
    """Another effect that an effect looks like, whatever form that one has.

    Parameters
    ----------
    name
        Of the other one.
    share
        From positions where fish were, shape (step, xy) in metres, and the parameters: how
        like the other one it is there, from 0 to 1.
    """

    name: str
    share: Callable[[Floats, Mapping[str, float]], float]


def _always(_company: Company) -> str | None:
    return None


def _as_it_is(_arena: Arena) -> Shapes:
    return ({},)


def _no_further(_arena: Arena) -> Shapes:
    return ()


def _none_idle(_values: Mapping[str, float]) -> tuple[str, ...]:
    return ()


def _no_features(_arena: Arena) -> tuple[Feature, ...]:
    return ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Effect:
    """Something that fish do and that the base model lacks.

    Parameters
    ----------
    name
        As in the model file and in the findings.
    says
        One sentence for a biologist.
    reference
        Where it was described.
    parameters
        At most eight.
    strength
        Name of the parameter that is zero where the effect is absent.
    probe
        A strength so small that the effect is proportional to it.
    component, factor, speed, sight, rotation, whole_rotation
        Compiled functions (`numba.cfunc`), None for what it does not touch. A rotation is of the
        base's directions; a whole one of those to neighbours and of components as well.
    harmonics
        The log of its factor is a trigonometric polynomial of the heading, of this degree,
        plus a number of the landing zone; None where it is not, or where there is no factor.
        So few headings are asked instead of all.
    not_harmonic
        Name of a shape, empty for most: where it is not zero, the log is no such polynomial.
    by_landing
        Whether that number differs between zones.
    each
        Name of a shape, empty for most: where it is not zero, the component's function is called
        for each of the nearest neighbours in sight, `NEIGHBOURS` of them, rather than once. Which
        one it is, from one on, is the last of `MAX_PARAMETERS` numbers.
    lag
        Name of a parameter in seconds by which agents respond late; the strength is the
        share of what they see that is late, and ``felt_m`` and ``whole`` say of whom and
        what.
    shapes
        Of an arena: values of the other parameters at which the effect is asked for.
    further_shapes
        Of an arena: shapes in which features may find it (`zfcal.model.features`), and at which it
        is not asked for otherwise.
    lacks
        Of a recording: what it lacks for this effect to show, None if nothing.
    opposite
        The sentence where the strength is negative; empty where it cannot be.
    identity_s
        Tracks need to be this long under one id for the effect to show.
    rests
        Name of a parameter in seconds, empty for most: the mean time for which its speed
        function stops agents by chance. The strength is how often, per second, and what shows
        is how long they stay.
    by_trait
        Whether individuals differ in it, by their trait in the state: what shows is how their
        scores scatter.
    by_place
        Of an effect on speed: whether it goes by where in the tank a fish is. It is asked for over
        the whole tank then; others are asked for within fields of the tank, each by itself.
    per_hour
        Whether the strength is a change with the hour: of that a recording twice as long tells
        eight times as much.
    shown_against
        What pictures show its statistic against: the ``time``, the ``speed`` of the step before,
        the last ``turn``, the distance to the ``wall`` or to the nearest ``neighbour``.
    generic
        Whether it is of the generic family, which names no mechanism.
    other_forms
        Names of effects of the generic family that say the same in another form: the same cue
        and the same response.
    looks_like
        Another effect that fish with this one may seem to have.
    control
        A negative control that belongs to it.
    features
        Of an arena: what its name means for headings, whatever its form; none for an effect on
        speed.
    paces
        What its name means for speeds, whatever its form.
    paces_given
        Of an effect on headings that depends on the speed of the step: what speeds show of it,
        given the heading. The joint law may be that of fish that have the turn first; then their
        speeds answer to all that turns them. These name nothing: they say what is left of a name.
    fixed
        Names of shapes that are no smooth matter, such as a range: a fit leaves them.
    idle
        Of parameters: names of those that do nothing in that form, such as a concentration where
        all headings lean. A fit leaves them as well.
    needs
        By kind of function: it does nothing, and is not called, where all of these
        parameters are zero.
    """

    name: str
    says: str
    reference: str
    parameters: tuple[EffectParameter, ...]
    strength: str = "strength"
    probe: float = 0.01
    component: Any = None
    factor: Any = None
    speed: Any = None
    sight: Any = None
    rotation: Any = None
    whole_rotation: Any = None
    harmonics: int | None = None
    not_harmonic: str = ""
    by_landing: bool = False
    each: str = ""
    lag: str | None = None
    shapes: Callable[[Arena], Shapes] = _as_it_is
    further_shapes: Callable[[Arena], Shapes] = _no_further
    lacks: Callable[[Company], str | None] = _always
    opposite: str = ""
    identity_s: float = 0.0
    rests: str = ""
    by_trait: bool = False
    by_place: bool = False
    per_hour: bool = False
    shown_against: Literal["time", "speed", "turn", "wall", "neighbour"] = "neighbour"
    generic: bool = False
    other_forms: tuple[str, ...] = ()
    looks_like: Likeness | None = None
    control: Control | None = None
    features: Callable[[Arena], tuple[Feature, ...]] = _no_features
    paces: tuple[PaceFeature, ...] = ()
    paces_given: tuple[Pace, ...] = ()
    fixed: tuple[str, ...] = ()
    idle: Callable[[Mapping[str, float]], tuple[str, ...]] = _none_idle
    needs: Mapping[str, tuple[str, ...]] = field(default_factory=dict, hash=False)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters, in their order."""
        return tuple(parameter.name for parameter in self.parameters)

    @property
    def curve(self) -> tuple[EffectParameter, ...]:
        """Parameters that it may have besides: see `curve_of`.

        A delay is the same for all that is seen, and how often fish rest goes by the zone alone.
        """
        own = next((each for each in self.parameters if each.name == self.strength), None)
        none = own is None or self.lag is not None or self.rests
        return () if own is None or none else curve_of(own.low, own.high)

    def parameter(self, name: str) -> EffectParameter:
        """Return the parameter of a name, one of its curve as well."""
        (found,) = (each for each in (*self.parameters, *self.curve) if each.name == name)
        return found

    @property
    def on_speed(self) -> bool:
        """Whether it changes the speed; otherwise it changes the heading."""
        return self.speed is not None

    @property
    def on_headings(self) -> bool:
        """Whether single headings show how strong it is."""
        return not self.on_speed and self.has_steps

    @property
    def multiplies(self) -> bool:
        """Whether it multiplies drawn speeds, rather than to stop agents."""
        return self.on_speed and not self.rests

    @property
    def has_steps(self) -> bool:
        """Whether its statistic is one of single steps; individuals have one each."""
        return not self.by_trait

    @property
    def in_any_steps(self) -> bool:
        """Whether any of the steps ask for it: rests last, and individuals show in all steps."""
        return self.has_steps and not self.rests

    @property
    def may_be_placebo(self) -> bool:
        """Whether it can be added to a model as any other one, though it is not there."""
        return self.in_any_steps and self.lag is None

    def free(self, shape: Mapping[str, float]) -> tuple[str, ...]:
        """Return the parameters that a fit moves in a form: those that are smooth and not idle."""
        idle = self.idle(self.spelt_out(shape))
        curve = MORE if has_curve(shape) else ()
        return tuple(name for name in (*self.names, *curve) if name not in {*self.fixed, *idle})

    def degree(self, given: Mapping[str, float]) -> int | None:
        """Return the degree of the polynomial that the log of its factor is, None if it is none."""
        return None if self.spelt_out(given).get(self.not_harmonic) else self.harmonics

    def calls(self, kind: str, given: Mapping[str, float]) -> bool:
        """Return whether a function of a kind has anything to do at these parameters."""
        if getattr(self, kind) is None:
            return False
        needs, values = self.needs.get(kind, ()), self.spelt_out(given)
        by_curve = has_curve(given) and self.strength in needs
        return not needs or by_curve or any(values[name] != 0.0 for name in needs)

    def spelt_out(self, given: Mapping[str, float]) -> dict[str, float]:
        """Return all parameters by their names, those of the curve where it has one."""
        values = dict(zip(self.names, self.values(given), strict=True))
        if has_curve(given):
            values |= {each.name: given.get(each.name, each.default) for each in self.curve}
        return values

    def values(self, given: Mapping[str, float]) -> tuple[float, ...]:
        """Return the parameters in their order, with defaults for those not given.

        Raises
        ------
        InputError
            A name that the effect does not have, or a value out of bounds.
        """
        curve = self.curve if given.keys() - set(self.names) else ()
        known = {parameter.name: parameter for parameter in (*self.parameters, *curve)}
        for name, value in given.items():
            if name not in known:
                raise InputError(
                    f"Effect {self.name!r} has no parameter {name!r}; it has {list(known)}."
                )
            low, high = known[name].low, known[name].high
            if not (low <= value <= high and math.isfinite(value)):
                raise InputError(
                    f"Effect {self.name!r}: {name} must be in [{low:g}, {high:g}], got {value!r}."
                )
        check_curve(self.name, given)
        return tuple(given.get(each.name, each.default) for each in self.parameters)

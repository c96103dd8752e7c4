"""Which effects are asked for on a recording, and at which shapes."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from zfcal.arena import Arena
from zfcal.model.effects import Effect, all_effects, find_effect
from zfcal.model.effects.base import Company
from zfcal.model.effects.circumstances import curve_under
from zfcal.model.features import LAGS, OneOf
from zfcal.model.kernels.curves import BY_BEARING, BY_DISTANCE, BY_NEAREST, BY_ZONE, KNOTS
from zfcal.model.kernels.rooms import find_rooms
from zfcal.model.kernels.state import KIND, TIME
from zfcal.model.scene import Scene
from zfcal.parameters import Parameters

_FAINT = 0.25


@dataclass(frozen=True, slots=True, kw_only=True)
class Candidate:
    """An effect at one shape.

    Parameters
    ----------
    effect
        What is asked for.
    shape
        All of its parameters but the strength.
    side
        Of a component that is about another heading below a strength of zero: 1 or -1, the sign at
        which it is asked for. Else 0.
    """

    effect: Effect
    shape: dict[str, float]
    side: int = 0

    @property
    def name(self) -> str:
        """Name of the effect."""
        return self.effect.name

    def values(self, strength: float) -> dict[str, float]:
        """Return all parameters at a strength."""
        return {**self.shape, self.effect.strength: strength}

    @property
    def signed(self) -> bool:
        """Whether its strength may be negative."""
        (own,) = (p for p in self.effect.parameters if p.name == self.effect.strength)
        return own.low < 0.0

    @property
    def notable(self) -> float:
        """A strength that one would want to notice."""
        (own,) = (p for p in self.effect.parameters if p.name == self.effect.strength)
        return own.default

    @property
    def asked_at(self) -> float:
        """The strength at which a component is asked for."""
        return -self.notable if self.side < 0 else self.notable

    @property
    def has_sides(self) -> bool:
        """Whether it has a component, which is about another heading below zero."""
        return self.signed and self.effect.calls("component", self.values(self.notable))

    @property
    def faint(self) -> float:
        """A quarter of the notable strength; a recording that would not show it is too short."""
        return _FAINT * self.notable

    @property
    def is_slow(self) -> bool:
        """Whether it is a change with the hour."""
        return self.effect.per_hour

    @property
    def rest_s(self) -> float:
        """Mean time for which it stops fish, in seconds; 0 where it stops none."""
        return self.shape[self.effect.rests] if self.effect.rests else 0.0


def not_forms_of(candidates: Iterable[Candidate], known: Collection[str]) -> tuple[Candidate, ...]:
    """Return the candidates that are neither known nor another form of what is known.

    Parameters
    ----------
    candidates
        Beyond the list.
    known
        Names of effects, listed or not.
    """
    said = {form for name in known for form in (name, *find_effect(name).other_forms)}
    return tuple(each for each in candidates if each.name not in said)


def company_of(scene: Scene) -> Company:
    """Return whom and what a recording holds."""
    return Company(
        n_fish=scene.n_fish,
        n_robots=scene.n_robots,
        has_rooms=find_rooms(scene.arena)[0] > 0,
        follows_walls=any(zone.follows_walls for zone in scene.arena.zones),
    )


def candidate_of(name: str, values: Mapping[str, float]) -> Candidate:
    """Return an effect at the shape that its parameters have, defaults where they have none.

    A component is asked for on the side of its strength.
    """
    made = _at(find_effect(name), values)
    is_below = values.get(made.effect.strength, 0.0) < 0 and made.has_sides
    return replace(made, side=-1) if is_below else made


def both_sides(candidate: Candidate) -> tuple[Candidate, ...]:
    """Return an effect on both sides of zero, where it has a component that tells them apart."""
    if not candidate.has_sides:
        return (candidate,)
    return replace(candidate, side=1), replace(candidate, side=-1)


_LATE_STEPS = (0.5, 1.0, 1.5, 2.0)
_NEAR_STEPS = (0.3, 0.5, 1.0, 2.0, 3.0)
"""Steps of a recording by which a response may be late, beside those delays that a file names."""

_FELT_M = (0.1, 0.14, 0.2)
"""Distances within which it may be at once."""


def _at(effect: Effect, values: Mapping[str, float]) -> Candidate:
    own = effect.spelt_out(values)
    shape = {key: value for key, value in own.items() if key != effect.strength}
    return Candidate(effect=effect, shape=shape)


def candidates_of(
    effects: tuple[Effect, ...], arena: Arena, *, without: tuple[str, ...] = ()
) -> tuple[Candidate, ...]:
    """Return every effect at each of its shapes.

    Parameters
    ----------
    effects
        To be asked for.
    arena
        Decides about shapes such as places.
    without
        Names that the model has already.
    """
    made = []
    for effect in effects:
        if effect.name in without:
            continue
        made += [_at(effect, shape) for shape in effect.shapes(arena)]
    return tuple(made)


def further_forms(
    effect: Effect, scene: Scene, also: Sequence[Mapping[str, float]] = ()
) -> tuple[Candidate, ...]:
    """Return an effect at the shapes in which features alone may find it.

    One that responds late may do so by half a step of the recording, by one, and so on, and to what
    was seen then from where the fish was itself. One that is about a certain agent is asked of fish
    that are the same from beginning to end.

    Parameters
    ----------
    effect
        The effect.
    scene
        Of the recording.
    also
        Shapes that its best feature says.
    """
    sure = _lasting_fish(scene)
    shapes = [
        shape
        for shape in (*effect.further_shapes(scene.arena), *also)
        if "who" not in shape or shape["who"] in sure
    ]
    if effect.lag is not None:
        (longest_s,) = (each.high for each in effect.parameters if each.name == effect.lag)
        shapes += [
            {effect.lag: steps * scene.dt_s, "felt_m": 0.0, "whole": whole}
            for whole in (1.0, 0.0)
            for steps in _LATE_STEPS
            if steps * scene.dt_s <= longest_s
        ]
        shapes += [
            {effect.lag: steps * scene.dt_s, "felt_m": felt_m, "whole": 0.0}
            for felt_m in _FELT_M
            for steps in _LATE_STEPS[:2]
            if steps * scene.dt_s <= longest_s
        ]
        shapes += [
            {effect.lag: steps * scene.dt_s, "felt_m": 0.0, "whole": 0.0, "near": 1.0}
            for steps in _NEAR_STEPS
            if steps * scene.dt_s <= longest_s
        ]
        shapes += [
            {effect.lag: lag * scene.dt_s, "felt_m": 0.0, "whole": whole, "then": 1.0}
            for whole in (1.0, 0.0)
            for lag in LAGS
            if lag * scene.dt_s <= longest_s
        ]
    return tuple(_at(effect, shape) for shape in shapes)


def curved(candidate: Candidate, label: str, scene: Scene) -> Candidate | None:
    """Return an effect whose strength goes by what a feature does; None where that is no cue.

    Parameters
    ----------
    candidate
        At a shape.
    label
        Of the feature.
    scene
        Of the recording.
    """
    if not candidate.effect.curve:
        return None
    time_s = scene.states[:, TIME]
    along = next(
        (
            each.along
            for feature in candidate.effect.features(scene.arena)
            for each in (feature.features if isinstance(feature, OneOf) else (feature,))
            if each.label == label
        ),
        None,
    )
    by = curve_under(label, along, float(time_s.min()), float(time_s.max()))
    if by is None or (by["by"] == BY_ZONE and len(scene.arena.zones) != len(KNOTS)):
        return None
    if candidate.effect.sight is None:
        # Such an effect is not asked of each other one by itself: see `parameters_at`.
        if by["by"] == BY_BEARING:
            return None
        by["by"] = float(BY_NEAREST) if by["by"] == BY_DISTANCE else by["by"]
    return replace(candidate, shape=candidate.shape | by)


def _lasting_fish(scene: Scene) -> list[int]:
    """Return the columns of fish that hold one track each; none where a robot stands among them.

    A simulation and a robot's drive have fish first.
    """
    is_robot = scene.states[0, KIND] > 0
    if (np.diff(is_robot.astype(int)) < 0).any():
        return []
    return [
        column
        for column in np.flatnonzero(~is_robot).tolist()
        if len(np.unique(scene.tracks[scene.tracks[:, column] >= 0, column])) == 1
    ]


def askable(scene: Scene, model: Parameters) -> tuple[tuple[Effect, ...], dict[str, str]]:
    """Return the listed effects that a recording can show, and what it lacks for others.

    Parameters
    ----------
    scene
        Of the recording.
    model
        Effects that it has are left out.

    Returns
    -------
    effects : tuple of Effect
    lacks : dict
        By name of an effect, such as ``a robot``.
    """
    company = company_of(scene)
    longest_s = _longest_track_s(scene)
    found, lacks = [], {}
    for effect in all_effects():
        if effect.name in model.effects:
            continue
        missing = effect.lacks(company)
        if missing is None and longest_s < effect.identity_s:
            missing = f"tracks of {effect.identity_s:g} s under one id"
        if missing is None:
            found.append(effect)
        else:
            lacks[effect.name] = missing
    return tuple(found), lacks


def in_model(model: Parameters) -> tuple[Candidate, ...]:
    """Return the effects that a model has, at their shapes."""
    return tuple(candidate_of(name, values) for name, values in model.effects.items())


def _longest_track_s(scene: Scene) -> float:
    counts = np.bincount(np.maximum(scene.tracks.ravel() + 1, 0))[1:]
    return float(counts.max(initial=0) * scene.dt_s)

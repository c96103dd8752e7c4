"""Circumstances: under which fish may have an effect in another measure, whatever the effect is.

Fish may follow walls more when they are alone, respond late in the open, or lean to a light each
as much as it likes. A feature is asked for under circumstances by weights that are its own times
those of a circumstance, which are never negative and add up to one: so what it is everywhere alike
is among them.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import replace
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from zfcal.arrays import Floats
from zfcal.model.features import (
    AWAY_M,
    Along,
    Component,
    Leaving,
    OneOf,
    Seen,
    Tilt,
    Turned,
    Weights,
)
from zfcal.model.kernels.curves import (
    BY_BEARING,
    BY_DISTANCE,
    BY_NEAREST,
    BY_NUMBER,
    BY_SPEED,
    BY_TIME,
    BY_TURN,
    BY_ZONE,
    KNOTS,
    MORE,
    NOTHING,
    cue_named,
)
from zfcal.model.kernels.hats import hats
from zfcal.model.kernels.products import products, vector_products
from zfcal.model.paces import Pace, Swum

Core = TypeVar("Core", Component, Tilt, Turned, Leaving)

_BY = ", by "

MOST_TRACKS = 12
"""Of so many fish each is held apart; short pieces of tracks count as one more."""

_TIMES = (0.0, 0.5, 1.0)
_SPEEDS_M_S = (0.03, 0.07, 0.14)
_STAYS_S = (0.0, 5.0, 20.0)
_NEAR_M = (0.03, 0.1, 0.25)
_FRONT_M = (0.15, 0.3)
_NUMBERS = (0.0, 1.0, 3.0)
_TURNS_RAD = (0.0, 0.5, 1.5)
_BEARINGS_RAD = (0.0, 1.2, 2.3)
_SCORES = (-1.0, 0.0, 1.0)


def each_fish(seen: Seen) -> Floats:
    """Return one for each fish whose step it is, shape (step, fish).

    The longest track is the last one; with it are all beyond the next `MOST_TRACKS` - 1.
    """
    return each_of(seen.track)


def each_of(track: NDArray[np.int32]) -> Floats:
    """Return one for each track, shape (step, track), of tracks of shape (step,)."""
    tracks, n_steps = np.unique(track, return_counts=True)
    longest = np.sort(tracks[np.argsort(-n_steps, kind="stable")][1:MOST_TRACKS])
    rest = ~np.isin(track, longest)
    return np.column_stack([track[:, None] == longest, rest]).astype(np.float64)


def _zones(seen: Seen) -> Floats:
    return (seen.zone[:, None] == np.unique(seen.zone)).astype(np.float64)


def _either(is_so: ArrayLike) -> Floats:
    """Return one where something is so, and one where it is not, (step, other, 2)."""
    so = np.asarray(is_so, dtype=np.float64)
    return np.stack([so, 1.0 - so], axis=-1)


def _alike(seen: Seen, of_step: Floats) -> Floats:
    """Return circumstances of a step for each other one, shape (step, other, circumstance)."""
    return np.repeat(of_step[:, None], seen.here.shape[1], axis=1)


def _nearest_m(seen: Seen) -> Floats:
    return np.where(seen.here, seen.distance_m, AWAY_M).min(axis=1, initial=AWAY_M)


CIRCUMSTANCES: dict[str, Weights] = {
    "who": each_fish,
    "the zone": _zones,
    "the time": lambda seen: hats(seen.time, _TIMES),
    "the speed": lambda seen: hats(seen.own_speed_m_s, _SPEEDS_M_S),
    "the last turn": lambda seen: hats(np.abs(seen.last_turn_rad), _TURNS_RAD),
    "the stay": lambda seen: hats(seen.stayed_s, _STAYS_S),
    "the nearest": lambda seen: hats(_nearest_m(seen), _NEAR_M),
    "how many are seen": lambda seen: hats(seen.in_sight.sum(axis=1), _NUMBERS),
}
"""Of steps, by name: shape (step, circumstance)."""

OF_EACH: dict[str, Weights] = {
    "distance": lambda seen: hats(seen.distance_m, _NEAR_M),
    "bearing": lambda seen: hats(seen.off_axis_rad, _BEARINGS_RAD),
    "whether it is the nearest": lambda seen: _either(seen.nearest[..., 0]),
    "whether it is a robot": lambda seen: _either(seen.is_robot),
    "who is in front": lambda seen: _alike(seen, hats(seen.in_front_m, _FRONT_M)),
}
"""Of others, by name: shape (step, other, circumstance)."""


CURVES: dict[str, tuple[int, tuple[float, float, float]]] = {
    "the speed": (BY_SPEED, _SPEEDS_M_S),
    "the last turn": (BY_TURN, _TURNS_RAD),
    "the nearest": (BY_NEAREST, _NEAR_M),
    "how many are seen": (BY_NUMBER, _NUMBERS),
    "the zone": (BY_ZONE, (1.0, 2.0, 3.0)),
    "the time": (BY_TIME, _TIMES),
    "distance": (BY_DISTANCE, _NEAR_M),
    "bearing": (BY_BEARING, _BEARINGS_RAD),
    "the last speed": (BY_SPEED, _SPEEDS_M_S),
    "how many are near": (BY_NEAREST, _NEAR_M),
}
"""What the strength of a form goes by under circumstances of a name, and the knots of its curve.

Those of the time are shares of a recording.
"""

_SHARE_OF_TIME = "share of the recording that has passed"

_BY_CUE = {
    **{cue_named(by): by for by in (BY_NEAREST, BY_DISTANCE, BY_BEARING)},
    _SHARE_OF_TIME: BY_TIME,
}
"""What a strength goes by where a feature's own weights go by a cue."""

PACED: dict[str, Callable[[Swum], Floats]] = {
    "who": lambda swum: each_of(swum.track),
    "the time": lambda swum: hats(swum.time, _TIMES),
    "the last speed": lambda swum: hats(swum.last, _SCORES),
    "how many are near": lambda swum: hats(
        (swum.here & (swum.distance_m < _NEAR_M[1])).sum(axis=1), _NUMBERS
    ),
}
"""Of steps whose speeds are asked for, by name: shape (step, circumstance)."""


def by_circumstances(
    core: Core,
    *,
    alone: Mapping[str, Core] | None = None,
    without: Collection[str] = (),
    among: Collection[str] | None = None,
    of_each: bool = False,
) -> OneOf:
    """Return a feature under each sort of circumstances, of which the most promising are fitted.

    Parameters
    ----------
    core
        Of few weights: each is fitted for each circumstance.
    alone
        What may depend on circumstances as well, and is no case of the effect: attention as a
        whole, of a feature of attention by distance. What is found has to gain more than that.
        By circumstance, as `each_under` has it, so that it is fitted once for all that share it.
    without
        Names of circumstances that the feature goes by itself, or that make another effect of it.
    among
        Names of those that are asked for; None for all.
    of_each
        Whether the others that it has weights for have circumstances of their own.
    """
    known = {**CIRCUMSTANCES, **(OF_EACH if of_each else {})}
    return OneOf(
        kind=f"{core.label}, by circumstances",
        features=tuple(
            _under(core, name, of, None if alone is None else alone[name])
            for name, of in known.items()
            if name not in without and (among is None or name in among)
        ),
    )


def curve_under(
    label: str, along: Along | None, begin_s: float, end_s: float
) -> dict[str, float] | None:
    """Return the curve of a form by what a feature goes by, or by its circumstances.

    Parameters
    ----------
    label
        Of the feature.
    along
        What its first weights go by; None where that is nothing.
    begin_s, end_s
        Of the recording, in seconds of the trial.

    Returns
    -------
    dict or None
        Parameters of `zfcal.model.kernels.curves`; None where there is no such curve.
    """
    by, knots = CURVES.get(label.rpartition(_BY)[2], (NOTHING, _TIMES))
    if by == NOTHING and along is not None and len(along.knots) >= len(KNOTS):
        by = _BY_CUE.get(along.cue, NOTHING)
        knots = along.knots[0], along.knots[len(along.knots) // 2], along.knots[-1]
    if by == NOTHING:
        return None
    if by == BY_TIME:
        first, middle, last = (begin_s + share * (end_s - begin_s) for share in knots)
        knots = first, middle, last
    return {"by": float(by), **dict(zip(KNOTS, knots, strict=True)), **dict.fromkeys(MORE, 0.0)}


def along_under(label: str, n_strengths: int) -> Along | None:
    """Return what the strengths of a feature under circumstances go by; None where that is no cue.

    Parameters
    ----------
    label
        Of the feature.
    n_strengths
        Its own ones: a feature of one weight has as many as there are knots.
    """
    by, knots = CURVES.get(label.rpartition(_BY)[2], (NOTHING, _TIMES))
    if by in {NOTHING, BY_ZONE} or n_strengths != len(knots):
        return None
    cue = _SHARE_OF_TIME if by == BY_TIME else cue_named(by)
    return Along(cue=cue, knots=knots)


def each_under(core: Core) -> dict[str, Core]:
    """Return a feature under each sort of circumstances, by their names.

    Parameters
    ----------
    core
        As of `by_circumstances`. Only of a component do others have circumstances of their own.
    """
    known = {**CIRCUMSTANCES, **(OF_EACH if isinstance(core, Component) else {})}
    return {name: _under(core, name, of, None) for name, of in known.items()}


def _under(core: Core, name: str, of: Weights, over: Core | None) -> Core:
    label = f"{core.label}{_BY}{name}"
    own = _times(core, of)
    if isinstance(core, Component) and callable(core.instead):
        same = core.instead is core.weights
        core = replace(core, instead=own if same else _times(core, of, core.instead))
    if over is None:
        return _with(core, own, label)
    common = _weights_of(over)

    def both(seen: Seen) -> Floats:
        return np.concatenate([own(seen), common(seen)], axis=_axis(core))

    return replace(_with(core, both, label), over=over)


def _axis(core: Core) -> int:
    """Return which axis of a feature's weights is that of its strengths."""
    return 2 if isinstance(core, Component) else 1


def _times(core: Core, of: Weights, weights: Weights | None = None) -> Weights:
    """Return the weights of a feature, or others of its kind, each for each circumstance."""
    of_core = weights or _weights_of(core)

    def times(seen: Seen) -> Floats:
        own, by = of_core(seen), seen.once(of)
        if isinstance(core, Component):
            return products(own, by if by.ndim == own.ndim else by[:, None])
        if isinstance(core, Tilt):
            return vector_products(own, by)
        return products(own.reshape(len(by), 1, -1), by[:, None])[:, 0]

    return times


def _weights_of(core: Core) -> Weights:
    if isinstance(core, Component | Leaving):
        return core.weights
    return core.vectors if isinstance(core, Tilt) else core.by


def _with(core: Core, weights: Weights, label: str) -> Core:
    """Return a feature of other weights, which are no curve."""
    if isinstance(core, Tilt):
        return replace(core, label=label, vectors=weights, along=None)
    if isinstance(core, Turned):
        return replace(core, label=label, by=weights, along=None)
    return replace(core, label=label, weights=weights, along=None)


def paces_by(core: Pace, *names: str) -> tuple[Pace, ...]:
    """Return a feature of speeds under circumstances, by their names."""
    return tuple(
        replace(core, label=f"{core.label}{_BY}{name}", weights=_paced(core, PACED[name]))
        for name in names
    )


def _paced(core: Pace, of: Callable[[Swum], Floats]) -> Callable[[Swum], Floats]:
    def made(swum: Swum) -> Floats:
        own, by = core.weights(swum), of(swum)
        return np.asarray((own[..., None] * by[:, None]).reshape(len(own), -1))

    return made

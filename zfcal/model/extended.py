"""The maximum of the likelihood of a model, with effects or without, from a scene.

The density of a heading is that of `zfcal.model.fitted`; what the model's effects make of it comes
from the very functions that a simulation calls. Base parameters have exact gradients; an effect's
parameters have differences. The maximum is climbed by the method of Berndt, Hall, Hall
and Hausman (1974, Annals of Economic and Social Measurement 3: 653-665): the
information is the sum of the outer products of the steps' scores.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from zfcal.arena import Arena
from zfcal.arrays import Floats
from zfcal.model.effects import find_effect
from zfcal.model.fitted import (
    SCALES,
    Fitted,
    Free,
    ZoneTurns,
    zone_log_p,
    zone_scores,
    zone_turns,
)
from zfcal.model.scene import Scene
from zfcal.model.views import View, view_of
from zfcal.parameters import Parameters, ZoneParameters


@dataclass(frozen=True, slots=True, kw_only=True)
class Bounds:
    """Within which kappa of the base, kappa of the neighbours and alpha are looked for.

    Parameters
    ----------
    low, high
        In units of `SCALES`.
    """

    low: tuple[float, float, float] = (1e-3, 1e-3, 0.0)
    high: tuple[float, float, float]


GENES = Bounds(high=(1.0, 1.0, 1.0))
"""What a genome can hold: an estimate that joins a search has to be one of its individuals."""

WIDE = Bounds(high=(4.0, 4.0, 10.0))
"""What a model is doubted within. A parameter that is held at a bound has a slope there, which
reads as an effect: the scores of suspects have what the base could explain projected off, and that
holds at a maximum alone."""

LOG_GAMMA_SPAN = 7.0
"""An attraction below e^-7 of the largest one is not told from zero."""

LAPSE = (1e-6, 0.2)
"""Least and largest share of headings drawn from anywhere."""

_FIRST_LAPSE = 0.005
_DIFFERENCE = 1e-4
"""Of a parameter's range, and at most so much in its unit: places may be 100 m away."""
_SHRINK = 0.2
_AXES = {"x_m": 0, "y_m": 1}
_MOST_ROUNDS = 25
_ENOUGH_NATS = 0.02
_RIDGE = 1e-9


def start_of(parameters: Parameters, bounds: Bounds = WIDE) -> tuple[Floats, ...]:
    """Return where a fit starts, per zone: a model's own parameters, and one lapse in 200."""
    made = []
    for zone in parameters.zones:
        base = zone.kappa_0 if zone.kappa_w is None else zone.kappa_w
        own = np.array([base, zone.kappa_f, zone.alpha]) / SCALES
        own = np.clip(own, bounds.low, bounds.high)
        gamma = np.array([zone.gamma[name] for name in parameters.zone_names])
        log_gamma = np.log(np.maximum(gamma / gamma.max(), math.exp(-LOG_GAMMA_SPAN)))
        made.append(
            np.concatenate([np.maximum(own, [0.02, 0.02, 0.02]), log_gamma, [_FIRST_LAPSE]])
        )
    return tuple(made)


def maximise(
    scene: Scene,
    parameters: Parameters,
    *,
    free: Free = (),
    start: Sequence[Floats] | None = None,
    bounds: Bounds = WIDE,
    rounds: int = _MOST_ROUNDS,
    n_workers: int = 1,
) -> Fitted:
    """Return a model with its parameters at their maximum likelihood.

    Parameters
    ----------
    scene
        Where everybody was.
    parameters
        The model to start from, and its effects; what is not free of these stays.
    free
        Parameters of effects to be fitted along with the base's.
    start
        Per zone, as `zone_scores` takes it; None for the model's own.
    bounds
        Within which the base's parameters are looked for.
    rounds
        At most so many steps uphill.
    n_workers
        Threads; the numbers do not depend on them.
    """
    seen = view_of(scene, without_effects(parameters), n_workers=n_workers)
    climb = _Climb(
        scene=scene, given=parameters, free=free, seen=seen, within=bounds, n_workers=n_workers
    )
    x = [values.copy() for values in (start_of(parameters, bounds) if start is None else start)]
    here = climb.at(parameters, x)
    psi = None
    for _ in range(rounds):
        psi = climb.differences(here)
        there = climb.step(here, psi)
        if there is None:
            break
        gain, here, psi = there.nats - here.nats, there, None
        if gain < _ENOUGH_NATS:
            break
    return climb.finish(here, climb.differences(here) if psi is None else psi)


def log_p_at(scene: Scene, model: Parameters, start: Sequence[Floats]) -> Floats:
    """Return the log density of each turn under a model; NaN in zones with few turns.

    Parameters
    ----------
    model
        With its effects.
    start
        Per zone, as `zone_scores` takes it.
    """
    seen = view_of(scene, without_effects(model))
    return _Climb(scene=scene, given=model, free=(), seen=seen).log_p(model, start)


def nats_at(
    scene: Scene, models: Sequence[Parameters], start: Sequence[Floats]
) -> tuple[float, ...]:
    """Return the log likelihood of all turns under models that differ in their effects.

    Parameters
    ----------
    models
        With their effects; one at least.
    start
        Per zone, as `zone_scores` takes it.
    """
    seen = view_of(scene, without_effects(models[0]))
    climb = _Climb(scene=scene, given=models[0], free=(), seen=seen)
    return tuple(float(np.nansum(climb.log_p(model, start))) for model in models)


def without_effects(parameters: Parameters) -> Parameters:
    """Return the model's base."""
    return dataclasses.replace(parameters, effects={})


def with_effect(parameters: Parameters, name: str, values: Mapping[str, float]) -> Parameters:
    """Return a model with an effect added, or its parameters changed."""
    changed = {**parameters.effects.get(name, {}), **values}
    return dataclasses.replace(parameters, effects={**parameters.effects, name: changed})


@dataclass(frozen=True, kw_only=True, eq=False)
class _Climb:
    """Steps uphill on the likelihood of a scene."""

    scene: Scene
    given: Parameters
    free: Free
    seen: View
    within: Bounds = WIDE
    n_workers: int = 1

    def bounds(self, name: str, key: str) -> tuple[float, float]:
        """Return the range of an effect's parameter, and of what the model came with."""
        low, high = bounds_of(name, key, self.scene.arena)
        value = self.given.effects[name][key]
        return min(low, value), max(high, value)

    @cached_property
    def turns(self) -> tuple[ZoneTurns, ...]:
        return zone_turns(self.scene)

    def at(self, parameters: Parameters, x: Sequence[Floats]) -> Fitted:
        """Return everything at a point; the effects' scores are left out."""
        view = view_of(self.scene, parameters, self.seen, n_workers=self.n_workers)
        n = len(self.scene.turns)
        log_p, weight = np.full(n, np.nan), np.ones(n)

        def of_zone(own: Floats, turns: ZoneTurns) -> Floats:
            if not turns.enough:
                return np.zeros((len(turns.rows), own.size))
            log_p[turns.rows], slope, weight[turns.rows] = zone_scores(
                own, turns, view, n_workers=self.n_workers
            )
            return slope

        scores = list(map(of_zone, x, self.turns))
        return Fitted(
            parameters=parameters,
            x=tuple(x),
            turns=self.turns,
            view=view,
            log_p=log_p,
            weight=weight,
            scores=tuple(scores),
            effect_scores=np.zeros((n, 0)),
            free=self.free,
        )

    def log_p(self, parameters: Parameters, x: Sequence[Floats], n_workers: int = 1) -> Floats:
        """Return the log density of each turn at a point; NaN in zones that are not fitted."""
        view = view_of(self.scene, parameters, self.seen, n_workers=n_workers)
        found = np.full(len(self.scene.turns), np.nan)
        for own, turns in zip(x, self.turns, strict=True):
            if turns.enough:
                found[turns.rows] = zone_log_p(own, turns, view, n_workers=n_workers)
        return found

    def differences(self, here: Fitted) -> Floats:
        """Return the scores of the effects' parameters, in units of their ranges."""

        def column(name: str, key: str) -> Floats:
            low, high = self.bounds(name, key)
            value = here.parameters.effects[name][key]
            by = _DIFFERENCE * min(high - low, 1.0)
            by = by if value + by <= high else -by
            moved = with_effect(here.parameters, name, {key: value + by})
            there = self.log_p(moved, here.x, self.n_workers)
            return np.asarray(np.nan_to_num(there - here.log_p) / by * (high - low))

        columns = [column(*pair) for pair in self.free]
        return np.array(columns).reshape(len(columns), len(here.log_p)).T

    def step(self, here: Fitted, psi: Floats) -> Fitted | None:
        """Return a better point, None if none is found."""
        pushed = self._pushed(here.parameters, psi)
        blocks, by_psi, promise = _directions(here, psi, pushed, self.within)
        length = 1.0
        while length * promise > _ENOUGH_NATS:
            x = [
                _shifted(own, length * by, turns, self.within) if turns.enough else own
                for own, by, turns in zip(here.x, blocks, self.turns, strict=True)
            ]
            there = self.at(self._moved(here.parameters, length * by_psi), x)
            if _is_better(there, here):
                return there
            length /= 3
        return None

    def _pushed(self, parameters: Parameters, psi: Floats) -> NDArray[np.bool_]:
        """Return which of the effects' parameters are at a bound, and uphill is beyond it."""
        slope = psi.sum(axis=0)
        pushed = np.zeros(len(self.free), dtype=bool)
        for p, (name, key) in enumerate(self.free):
            low, high = self.bounds(name, key)
            value = parameters.effects[name][key]
            pushed[p] = (value <= low and slope[p] < 0) or (value >= high and slope[p] > 0)
        return pushed

    def _moved(self, parameters: Parameters, by: Floats) -> Parameters:
        for (name, key), change in zip(self.free, by, strict=True):
            low, high = self.bounds(name, key)
            here = parameters.effects[name][key]
            value = here + change * (high - low)
            if low == 0.0 and key not in _AXES:
                # At zero a mixture's slope says nothing: it is approached step by step.
                value = max(value, _SHRINK * here)
            parameters = with_effect(parameters, name, {key: float(np.clip(value, low, high))})
        return parameters

    def finish(self, here: Fitted, psi: Floats) -> Fitted:
        """Return a point as the maximum."""
        information = _information(here, psi)
        k = len(self.free)
        whole: Floats = np.asarray(linalg.pinvh(information)) if k else np.zeros((0, 0))
        ranges = np.array([np.ptp(self.bounds(*pair)) for pair in self.free])
        covariance = whole[-k:, -k:] * np.outer(ranges, ranges) if k else whole
        zones = [
            _zone_of(own, zone, here.parameters.zone_names) if turns.enough else zone
            for own, zone, turns in zip(here.x, here.parameters.zones, self.turns, strict=True)
        ]
        return dataclasses.replace(
            here,
            parameters=dataclasses.replace(here.parameters, zones=tuple(zones)),
            effect_scores=psi,
            covariance=covariance,
        )


def bounds_of(name: str, key: str, arena: Arena | None = None) -> tuple[float, float]:
    """Return the range within which an effect's parameter is fitted.

    In an arena a place is looked for within the box round the tank: from one metres away fish would
    be drawn the same way wherever they are, which is no place but a direction.
    """
    found = find_effect(name).parameter(key)
    if arena is None or key not in _AXES:
        return found.low, found.high
    ends = arena.outline.bounds[_AXES[key] :: 2]
    return max(found.low, ends[0]), min(found.high, ends[1])


def limits_of(x: Floats, turns: ZoneTurns, bounds: Bounds) -> tuple[Floats, Floats]:
    """Return within which a zone's parameters are looked for; a gamma that is told has no top."""
    least = np.where(turns.reachable, -LOG_GAMMA_SPAN, 0.0)
    low = np.concatenate([bounds.low, least, [LAPSE[0]]])
    high = np.concatenate([bounds.high, np.full(x.size - 4, np.inf), [LAPSE[1]]])
    high[3:-1][~turns.reachable] = 0.0
    return low, high


def _shifted(x: Floats, by: Floats, turns: ZoneTurns, bounds: Bounds) -> Floats:
    """Return a zone's parameters moved within their limits, the largest log gamma zero.

    At a kappa or an alpha of zero the slope says nothing: as effects they come near it by steps.
    """
    moved = x + by
    moved[:3] = np.maximum(moved[:3], _SHRINK * x[:3])
    # A common factor of all gammas is no matter: it goes before the limits, not after.
    moved[3:-1] -= moved[3:-1][turns.reachable].max()
    return np.clip(moved, *limits_of(x, turns, bounds))


def _is_better(there: Fitted, here: Fitted) -> bool:
    """Return whether a point is higher, and so by the densities of the same turns."""
    same = np.array_equal(there.used, here.used)
    return same and math.isfinite(there.nats) and there.nats > here.nats


def _information(here: Fitted, psi: Floats) -> Floats:
    """Return the sum of outer products of the scores: zones one after the other, then psi."""
    sizes = [scores.shape[1] for scores in here.scores]
    k = psi.shape[1]
    whole = np.zeros((sum(sizes) + k, sum(sizes) + k))
    at = 0
    for scores, turns in zip(here.scores, here.turns, strict=True):
        here_at = slice(at, at + scores.shape[1])
        whole[here_at, here_at] = scores.T @ scores
        cross = scores.T @ psi[turns.rows]
        whole[here_at, whole.shape[0] - k :] = cross
        whole[whole.shape[0] - k :, here_at] = cross.T
        at += scores.shape[1]
    whole[at:, at:] = psi.T @ psi
    return whole


def _directions(
    here: Fitted, psi: Floats, psi_pushed: NDArray[np.bool_], bounds: Bounds
) -> tuple[list[Floats], Floats, float]:
    """Return the way uphill, per zone and for the effects' parameters, and the nats it promises."""
    information = _information(here, psi)
    slope = np.concatenate([*(scores.sum(axis=0) for scores in here.scores), psi.sum(axis=0)])
    open_ = np.diag(information) > 1e-12
    at = 0
    for x, turns in zip(here.x, here.turns, strict=True):
        low, high = limits_of(x, turns, bounds)
        pushed = ((x <= low) & (slope[at : at + x.size] < 0)) | (
            (x >= high) & (slope[at : at + x.size] > 0)
        )
        open_[at : at + x.size] &= ~pushed
        at += x.size
    open_[at:] &= ~psi_pushed
    by = np.zeros_like(slope)
    inner = information[np.ix_(open_, open_)]
    ridge = _RIDGE * np.diag(inner).mean() if inner.size else 0.0
    by[open_] = linalg.solve(inner + ridge * np.eye(len(inner)), slope[open_], assume_a="pos")
    parts = np.split(by, np.cumsum([x.size for x in here.x]))
    return parts[:-1], parts[-1], 0.5 * float(slope @ by)


def _zone_of(x: Floats, zone: ZoneParameters, names: tuple[str, ...]) -> ZoneParameters:
    own = x[:3] * SCALES
    gamma = np.exp(np.minimum(x[3:-1] - x[3:-1].max(), 0.0))
    return dataclasses.replace(
        zone,
        kappa_0=float(own[0]),
        kappa_f=float(own[1]),
        kappa_w=None,
        alpha=float(own[2]),
        gamma=dict(zip(names, map(float, gamma), strict=True)),
    )

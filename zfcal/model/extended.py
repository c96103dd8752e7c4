"""Likelihood of a model with effects, and its maximum, from a scene.

The density of a heading is that of `zfcal.model.likelihood`, with the components,
factors and changes of perception of the model's effects in it, which come from the very
functions that a simulation calls. Base parameters have exact gradients; an effect's
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
from scipy.special import i0e, i1e

from zfcal.model.effects import find_effect
from zfcal.model.kernels.extended import (
    BASE,
    BASE_SLOPE,
    COLUMNS,
    EXTRA,
    SOCIAL,
    SOCIAL_SLOPE,
    cell_table,
    extended_sums,
    harmonic_tilt,
)
from zfcal.model.kernels.perception import REPULSION_M
from zfcal.model.kernels.scene import (
    PART,
    ask_components,
    ask_factors,
    ask_harmonics,
    ask_rotations,
    attend,
    head_late,
    perceive,
)
from zfcal.model.kernels.world import Packed
from zfcal.model.packing import pack
from zfcal.model.scene import Scene
from zfcal.model.steps import ANGLES
from zfcal.parameters import Parameters, ZoneParameters

Floats = NDArray[np.float64]
Rows = NDArray[np.intp]
Free = tuple[tuple[str, str], ...]
"""Parameters of effects that are fitted: name of the effect, name of the parameter."""

SCALES = np.array([30.0, 30.0, 50.0])
"""Units of kappa of the base, kappa of the neighbours, and alpha in a fit."""

_LOW, _HIGH = np.array([1e-3, 1e-3, 0.0]), np.array([4.0, 4.0, 10.0])
_LOG_GAMMA_SPAN = 7.0
_LAPSE = (1e-6, 0.2)
_UNIFORM = 1 / (2 * math.pi)
MIN_STEPS = 30
_DIFFERENCE = 1e-4
_SHRINK = 0.2
_MOST_ROUNDS = 25
_ENOUGH_NATS = 0.02
_RIDGE = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class View:
    """What the steps' agents saw, and what the effects ask, as the kernels want it.

    Parameters
    ----------
    toward, angle_sr : ndarray, shape (step, column, 2) and (step, column)
        Unit vectors to neighbours and solid angles, with the effects on sight. Where a
        share of them is late, a second set of columns holds that share.
    spin : ndarray, shape (step, 2)
        Cosine and sine of the angle by which base directions are turned; empty where no
        effect turns them.
    seen_sr : ndarray, shape (step, agent)
        Solid angles as effects are given them.
    parts : ndarray, shape (step, component, 4)
        Components of effects: weight, unit vector, kappa.
    tilt, tilt_taken : ndarray, shape (step, cell) and (step,)
        Product of factors; empty where the model has none.
    """

    toward: Floats
    angle_sr: Floats
    parts: Floats
    tilt: Floats
    tilt_taken: Floats
    seen_sr: Floats
    spin: Floats
    late: dict[int, tuple[Floats, Floats]] = dataclasses.field(default_factory=dict)
    """What was perceived so many steps late, so that a fit looks but once."""


def view_of(scene: Scene, parameters: Parameters, seen: View | None = None) -> View:
    """Return what a model says of a scene's turns, but for the base's parameters.

    Parameters
    ----------
    parameters
        Its field of view and its effects count.
    seen
        A view of the model without effects, if there is one: sight is taken from it.
    """
    packed = pack([parameters], scene.arena)
    share, all_late = packed.lates[0, 0], sees_late(packed)
    known = {} if seen is None else seen.late
    toward, angle = _perceived(scene, packed, known, all_late)
    own = angle
    if packed.lags[0] > 0 and share > 0.0 and not all_late:
        late_toward, late_angle = late_sight(scene, packed, known)
        toward = np.concatenate([toward, late_toward], axis=1)
        angle = np.concatenate([(1 - share) * angle, share * late_angle], axis=1)
    parts = components_of(scene, packed, own)
    degree = harmonics_of(parameters)
    if degree is None:
        tilt, tilt_taken = factors_of(scene, packed, own)
    else:
        tilt, tilt_taken = smooth_factors_of(scene, packed, own, degree)
    return View(
        toward=toward,
        angle_sr=angle,
        parts=parts,
        tilt=tilt,
        tilt_taken=tilt_taken,
        seen_sr=own,
        spin=spin_of(scene, packed, own),
        late=known,
    )


def spin_of(scene: Scene, packed: Packed, angle_sr: Floats) -> Floats:
    """Return cosine and sine of the angle that effects turn base directions by; or nothing."""
    turns = scene.turns
    spin = np.zeros((len(turns) if len(packed.rotations) else 0, 2))
    if len(packed.rotations):
        ask_rotations(scene.states, turns.at, turns.who, packed, angle_sr, spin)
    return spin


def sees_late(packed: Packed) -> int:
    """Return by how many steps all that agents of a model see is late."""
    share, _, whole = packed.lates[0]
    return int(packed.lags[0]) if share >= 1.0 and whole > 0.0 else 0


def late_sight(
    scene: Scene, packed: Packed, known: dict[int, tuple[Floats, Floats]]
) -> tuple[Floats, Floats]:
    """Return unit vectors and solid angles of neighbours as a model sees them that is late."""
    lag, (_, felt_m, whole) = int(packed.lags[0]), packed.lates[0]
    if whole > 0.0:
        return _perceived(scene, packed, known, lag)
    toward, angle = _perceived(scene, packed, known, 0)
    turns, made = scene.turns, np.empty_like(toward)
    near_m = max(float(felt_m), REPULSION_M)
    head_late(scene.states, turns.at, turns.who, lag, near_m, toward, made)
    return made, angle


def _perceived(
    scene: Scene, packed: Packed, known: dict[int, tuple[Floats, Floats]], late: int
) -> tuple[Floats, Floats]:
    """Return what is seen so many steps late, with a model's effects on sight."""
    if late not in known:
        turns = scene.turns
        cos_fov = float(packed.cos_fov[0])
        known[late] = perceive(scene.states, turns.at, turns.who, late, cos_fov)
    toward, angle = known[late]
    return toward, attended(scene, packed, angle)


def attended(scene: Scene, packed: Packed, angle_sr: Floats) -> Floats:
    """Return solid angles as a model's effects on sight change them.

    Parameters
    ----------
    angle_sr : ndarray, shape (step, column)
        One set of columns of the scene, or several side by side.
    """
    if not len(packed.sights):
        return angle_sr
    turns, n = scene.turns, scene.states.shape[2]
    sets = []
    for first in range(0, angle_sr.shape[1], n):
        own = np.ascontiguousarray(angle_sr[:, first : first + n])
        sets.append(np.empty_like(own))
        attend(scene.states, turns.at, turns.who, packed, own, sets[-1])
    return np.concatenate(sets, axis=1)


def components_of(scene: Scene, packed: Packed, angle_sr: Floats) -> Floats:
    """Return the effects' components for each turn, shape (step, component, 4)."""
    turns = scene.turns
    parts = np.zeros((len(turns), len(packed.components), PART))
    if len(packed.components):
        ask_components(scene.states, turns.at, turns.who, packed, angle_sr, parts)
    return parts


def factors_of(
    scene: Scene, packed: Packed, angle_sr: Floats, probability: Floats | None = None
) -> tuple[Floats, Floats]:
    """Return the effects' factors on each cell and at the heading taken; empty without.

    Parameters
    ----------
    probability : ndarray, shape (turn, cell)
        Where it is given, cells that hardly any heading takes have a factor of one.
    """
    turns = scene.turns
    if not len(packed.factors):
        return np.zeros((0, ANGLES)), np.zeros(0)
    tilt, taken = np.empty((len(turns), ANGLES)), np.empty(len(turns))
    ask_factors(
        scene.states, turns.at, turns.who, packed, angle_sr, turns.taken, turns.speed_m_s,
        turns.landing, turns.share, np.zeros((0, ANGLES)) if probability is None else probability,
        tilt, taken,
    )  # fmt: skip
    return tilt, taken


def harmonics_of(parameters: Parameters) -> int | None:
    """Return the degree of the polynomial that a model's factors are; None where one is none."""
    effects = [find_effect(name) for name in parameters.effects]
    degrees = [effect.harmonics for effect in effects if effect.factor is not None]
    known = [degree for degree in degrees if degree is not None]
    return max(known, default=0) if len(known) == len(degrees) else None


def harmonics(
    scene: Scene, packed: Packed, angle_sr: Floats, degree: int
) -> tuple[Floats, Floats, Floats]:
    """Return the log of the effects' factors as a polynomial, and at the heading taken.

    Returns
    -------
    waves, zones, log_taken
        As `zfcal.model.kernels.scene.ask_harmonics` has them.
    """
    turns, n = scene.turns, len(scene.turns)
    waves, log_taken = np.empty((n, 1 + 2 * degree)), np.empty(n)
    zones = np.empty((n, turns.share.shape[2]))
    ask_harmonics(
        scene.states, turns.at, turns.who, packed, angle_sr, turns.taken, turns.speed_m_s,
        turns.landing, waves, zones, log_taken,
    )  # fmt: skip
    return waves, zones, log_taken


def smooth_factors_of(
    scene: Scene, packed: Packed, angle_sr: Floats, degree: int
) -> tuple[Floats, Floats]:
    """Return what `factors_of` does, of factors that are polynomials in their log."""
    if not len(packed.factors):
        return np.zeros((0, ANGLES)), np.zeros(0)
    waves, zones, log_taken = harmonics(scene, packed, angle_sr, degree)
    tilt = np.empty((len(scene.turns), ANGLES))
    harmonic_tilt(waves, zones, scene.turns.share, tilt)
    return tilt, np.exp(log_taken)


@dataclass(frozen=True, kw_only=True, eq=False)
class ZoneTurns:
    """The turns that start in one zone.

    Parameters
    ----------
    rows : ndarray of int, shape (step,)
        Their places among the scene's turns.
    base : ndarray, shape (step, mode, 2)
        Modes of the base law.
    taken, share, landing
        As in `zfcal.model.scene.Turns`.
    """

    rows: Rows
    base: Floats
    taken: Floats
    share: NDArray[np.uint8]
    landing: NDArray[np.int64]

    def base_of(self, view: View) -> Floats:
        """Return the modes of the base law as a view's effects turn them."""
        if not len(view.spin):
            return self.base
        c, s = view.spin[self.rows, 0, None], view.spin[self.rows, 1, None]
        x, y = self.base[..., 0], self.base[..., 1]
        return np.stack([c * x - s * y, s * x + c * y], axis=-1)

    @property
    def enough(self) -> bool:
        """Whether there are enough of them to fit anything to."""
        return len(self.rows) >= MIN_STEPS

    @cached_property
    def reachable(self) -> NDArray[np.bool_]:
        """Zones in which a heading lands, shape (zone,)."""
        return np.asarray(self.share.any(axis=(0, 1)))


def zone_turns(scene: Scene) -> tuple[ZoneTurns, ...]:
    """Return the turns of each zone of the arena, in its order."""
    made = []
    for number, zone in enumerate(scene.arena.zones, start=1):
        rows = np.flatnonzero(scene.turns.zone == number)
        chosen = scene.turns.take(rows)
        along = chosen.along_wall if zone.follows_walls else chosen.heading
        modes = [along, -along] if zone.follows_walls else [along]
        made.append(
            ZoneTurns(
                rows=rows,
                base=np.ascontiguousarray(np.stack(modes, axis=1)),
                taken=chosen.taken,
                share=chosen.share,
                landing=chosen.landing,
            )
        )
    return tuple(made)


def constants(kappas: Floats) -> tuple[float, float]:
    """Return one over ``2 pi I0(kappa) exp(-kappa)`` of both laws."""
    first, second = (float(1 / (2 * math.pi * i0e(kappa))) for kappa in kappas)
    return first, second


def zone_scores(x: Floats, turns: ZoneTurns, view: View) -> tuple[Floats, Floats, Floats]:
    """Return log densities of a zone's turns and their scores.

    Parameters
    ----------
    x : ndarray, shape (4 + zone,)
        kappa of the base, kappa of the neighbours and alpha in units of `SCALES`, log
        gamma of each zone, and the lapse.
    view
        Of all turns of the scene.

    Returns
    -------
    log_p : ndarray, shape (step,)
        Per radian, the lapse included.
    scores : ndarray, shape (step, 4 + zone)
        Their derivatives by ``x``.
    weight : ndarray, shape (step,)
        Probability that a turn was no lapse.
    """
    own = x[:3] * SCALES
    n, n_zones = len(turns.rows), turns.share.shape[2]
    at_taken, over = np.empty((n, COLUMNS)), np.empty((n, n_zones, COLUMNS))
    tilt = view.tilt[turns.rows] if len(view.tilt) else view.tilt
    extended_sums(
        turns.base_of(view), view.toward[turns.rows], view.angle_sr[turns.rows], turns.taken,
        turns.share, view.parts[turns.rows], tilt, (own[0], own[1]), constants(own[:2]),
        at_taken, over,
    )  # fmt: skip
    for column, slope, value in ((BASE, BASE_SLOPE, own[0]), (SOCIAL, SOCIAL_SLOPE, own[1])):
        mean_cosine = i1e(value) / i0e(value)
        at_taken[:, slope] -= mean_cosine * at_taken[:, column]
        over[..., slope] -= mean_cosine * over[..., column]
    gamma = np.exp(x[3:-1])
    here = at_taken[:, BASE] + own[2] * at_taken[:, SOCIAL] + at_taken[:, EXTRA]
    by_zone = gamma * (over[..., BASE] + own[2] * over[..., SOCIAL] + over[..., EXTRA])
    whole = by_zone.sum(axis=1)
    landing = turns.landing - 1
    log_p = np.log(here) + x[3:-1][landing] - np.log(whole)
    if len(view.tilt):
        log_p += np.log(np.maximum(view.tilt_taken[turns.rows], 1e-300))
    scores = np.empty((n, x.size))
    for p, (slope, times) in enumerate(((BASE_SLOPE, 1.0), (SOCIAL_SLOPE, own[2]), (SOCIAL, 1.0))):
        change = at_taken[:, slope] / here - over[..., slope] @ gamma / whole
        scores[:, p] = times * change * SCALES[p]
    scores[:, 3:-1] = -by_zone / whole[:, None]
    scores[np.arange(n), 3 + landing] += 1.0
    return _with_lapse(log_p, scores, float(x[-1]))


def _with_lapse(log_p: Floats, scores: Floats, lapse: float) -> tuple[Floats, Floats, Floats]:
    density = np.exp(log_p)
    mixed = (1 - lapse) * density + lapse * _UNIFORM
    weight = (1 - lapse) * density / mixed
    scores[:, :-1] *= weight[:, None]
    scores[:, -1] = (_UNIFORM - density) / mixed
    return np.log(mixed), scores, weight


@dataclass(frozen=True, kw_only=True, eq=False)
class Fitted:
    """A model at its maximum likelihood on the turns of a scene.

    Parameters
    ----------
    parameters
        With its effects.
    x : tuple of ndarray
        Per zone, as `zone_scores` takes it; a zone with few turns is left as it was.
    turns
        Per zone.
    view
        What the model says of all turns.
    log_p : ndarray, shape (turn,)
        Log density per radian of each heading taken; NaN in zones that were not fitted.
    weight : ndarray, shape (turn,)
        Probability that it was no lapse.
    scores : tuple of ndarray, shape (turn of the zone, parameter)
        Derivatives by the zone's own parameters.
    effect_scores : ndarray, shape (turn, free)
        Derivatives by the effects' parameters that were fitted.
    free
        Which these are.
    covariance : ndarray, shape (free, free)
        Of the effects' parameters, the base's fitted along.
    """

    parameters: Parameters
    x: tuple[Floats, ...]
    turns: tuple[ZoneTurns, ...]
    view: View
    log_p: Floats
    weight: Floats
    scores: tuple[Floats, ...]
    effect_scores: Floats
    free: Free = ()
    covariance: Floats = dataclasses.field(default_factory=lambda: np.zeros((0, 0)))

    @property
    def nats(self) -> float:
        """Log likelihood of all turns that were used."""
        return float(np.nansum(self.log_p))

    @cached_property
    def used(self) -> NDArray[np.bool_]:
        """Turns in zones that were fitted, shape (turn,)."""
        return ~np.isnan(self.log_p)

    def tables(self) -> tuple[Floats, Floats, Floats]:
        """Return the mixture and the probability of each cell, and the mixture at the heading.

        Returns
        -------
        mixture, probability : ndarray, shape (turn, cell)
        mixture_taken : ndarray, shape (turn,)
        """
        n = len(self.log_p)
        mixture, probability = np.zeros((n, ANGLES)), np.zeros((n, ANGLES))
        taken = np.ones(n)
        view = self.view
        for x, turns in zip(self.x, self.turns, strict=True):
            rows, own = turns.rows, x[:3] * SCALES
            if not len(rows):
                continue
            size = (len(rows), ANGLES)
            some, share = np.empty(size), np.empty(size)
            tilt = view.tilt[rows] if len(view.tilt) else view.tilt
            here = np.empty(len(rows))
            cell_table(
                turns.base_of(view), view.toward[rows], view.angle_sr[rows], turns.taken,
                turns.share, view.parts[rows], tilt, (own[0], own[1]), constants(own[:2]), own[2],
                np.exp(x[3:-1]), some, share, here,
            )  # fmt: skip
            mixture[rows], probability[rows], taken[rows] = some, share, here
        return mixture, probability, taken


def start_of(parameters: Parameters) -> tuple[Floats, ...]:
    """Return where a fit starts, per zone: a model's own parameters, and one lapse in 200."""
    made = []
    for zone in parameters.zones:
        base = zone.kappa_0 if zone.kappa_w is None else zone.kappa_w
        own = np.clip(np.array([base, zone.kappa_f, zone.alpha]) / SCALES, _LOW, _HIGH)
        gamma = np.array([zone.gamma[name] for name in parameters.zone_names])
        log_gamma = np.log(np.maximum(gamma / gamma.max(), math.exp(-_LOG_GAMMA_SPAN)))
        made.append(np.concatenate([np.maximum(own, [0.02, 0.02, 0.02]), log_gamma, [0.005]]))
    return tuple(made)


def maximise(
    scene: Scene,
    parameters: Parameters,
    *,
    free: Free = (),
    start: Sequence[Floats] | None = None,
    rounds: int = _MOST_ROUNDS,
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
    rounds
        At most so many steps uphill.
    """
    climb = _Climb(scene=scene, free=free, seen=view_of(scene, without_effects(parameters)))
    x = [values.copy() for values in (start_of(parameters) if start is None else start)]
    here = climb.at(parameters, x)
    for _ in range(rounds):
        there = climb.step(here)
        if there is None:
            break
        gain, here = there.nats - here.nats, there
        if gain < _ENOUGH_NATS:
            break
    return climb.finish(here)


def nats_at(scene: Scene, parameters: Parameters, start: Sequence[Floats]) -> float:
    """Return the log likelihood of all turns at a point.

    Parameters
    ----------
    parameters
        The model, with its effects.
    start
        Per zone, as `zone_scores` takes it.
    """
    climb = _Climb(scene=scene, free=(), seen=view_of(scene, without_effects(parameters)))
    return climb.at(parameters, start).nats


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
    free: Free
    seen: View

    @cached_property
    def turns(self) -> tuple[ZoneTurns, ...]:
        return zone_turns(self.scene)

    def at(self, parameters: Parameters, x: Sequence[Floats]) -> Fitted:
        """Return everything at a point; the effects' scores are left out."""
        view = view_of(self.scene, parameters, self.seen)
        n = len(self.scene.turns)
        log_p, weight = np.full(n, np.nan), np.ones(n)
        scores = []
        for own, turns in zip(x, self.turns, strict=True):
            if not turns.enough:
                scores.append(np.zeros((len(turns.rows), own.size)))
                continue
            some, slope, sure = zone_scores(own, turns, view)
            log_p[turns.rows], weight[turns.rows] = some, sure
            scores.append(slope)
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

    def differences(self, here: Fitted) -> Floats:
        """Return the scores of the effects' parameters, in units of their ranges."""
        columns = np.zeros((len(here.log_p), len(self.free)))
        for p, (name, key) in enumerate(self.free):
            low, high = bounds_of(name, key)
            value = here.parameters.effects[name][key]
            by = _DIFFERENCE * (high - low)
            by = by if value + by <= high else -by
            moved = with_effect(here.parameters, name, {key: value + by})
            there = self.at(moved, here.x)
            columns[:, p] = np.nan_to_num(there.log_p - here.log_p) / by * (high - low)
        return columns

    def step(self, here: Fitted) -> Fitted | None:
        """Return a better point, None if none is found."""
        psi = self.differences(here)
        blocks, by_psi = _directions(here, psi)
        length = 1.0
        for _ in range(8):
            x = [
                _shifted(own, length * by, turns) if turns.enough else own
                for own, by, turns in zip(here.x, blocks, self.turns, strict=True)
            ]
            there = self.at(self._moved(here.parameters, length * by_psi), x)
            if _is_better(there, here):
                return there
            length /= 3
        return None

    def _moved(self, parameters: Parameters, by: Floats) -> Parameters:
        for (name, key), change in zip(self.free, by, strict=True):
            low, high = bounds_of(name, key)
            here = parameters.effects[name][key]
            value = here + change * (high - low)
            if low == 0.0:
                # At zero a mixture's slope says nothing: it is approached step by step.
                value = max(value, _SHRINK * here)
            parameters = with_effect(parameters, name, {key: float(np.clip(value, low, high))})
        return parameters

    def finish(self, here: Fitted) -> Fitted:
        psi = self.differences(here)
        information = _information(here, psi)
        k = len(self.free)
        whole: Floats = np.asarray(linalg.pinvh(information)) if k else np.zeros((0, 0))
        ranges = np.array([np.ptp(bounds_of(*pair)) for pair in self.free])
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


def bounds_of(name: str, key: str) -> tuple[float, float]:
    """Return the range of an effect's parameter."""
    (found,) = (each for each in find_effect(name).parameters if each.name == key)
    return found.low, found.high


def _limits(x: Floats, turns: ZoneTurns) -> tuple[Floats, Floats]:
    low = np.concatenate([_LOW, np.where(turns.reachable, -_LOG_GAMMA_SPAN, 0.0), [_LAPSE[0]]])
    high = np.concatenate([_HIGH, np.full(x.size - 4, np.inf), [_LAPSE[1]]])
    high[3:-1][~turns.reachable] = 0.0
    return low, high


def _shifted(x: Floats, by: Floats, turns: ZoneTurns) -> Floats:
    """Return a zone's parameters moved within their limits, the largest log gamma zero."""
    moved = x + by
    # A common factor of all gammas is no matter: it goes before the limits, not after.
    moved[3:-1] -= moved[3:-1][turns.reachable].max()
    return np.clip(moved, *_limits(x, turns))


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


def _directions(here: Fitted, psi: Floats) -> tuple[list[Floats], Floats]:
    """Return the way uphill, per zone and for the effects' parameters."""
    information = _information(here, psi)
    slope = np.concatenate([*(scores.sum(axis=0) for scores in here.scores), psi.sum(axis=0)])
    open_ = np.diag(information) > 1e-12
    at = 0
    for x, turns in zip(here.x, here.turns, strict=True):
        low, high = _limits(x, turns)
        pushed = ((x <= low) & (slope[at : at + x.size] < 0)) | (
            (x >= high) & (slope[at : at + x.size] > 0)
        )
        open_[at : at + x.size] &= ~pushed
        at += x.size
    by = np.zeros_like(slope)
    inner = information[np.ix_(open_, open_)]
    ridge = _RIDGE * np.diag(inner).mean() if inner.size else 0.0
    by[open_] = linalg.solve(inner + ridge * np.eye(len(inner)), slope[open_], assume_a="pos")
    parts = np.split(by, np.cumsum([x.size for x in here.x]))
    return parts[:-1], parts[-1]


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

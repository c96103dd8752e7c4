"""What effects add on minutes that their fit has not seen, step by step.

A model is fitted on some minutes of a recording and judged on others. Beside what it
gains there stands what it would gain if the fish drew from it on those very minutes: the
expected log density ratio, given where everybody was. The floor of the likelihood is that
of the model with the effects against itself, under the same luck as was measured; the luck
itself, which no model can foresee, weighs more than most effects.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import rel_entr

from zfcal.arrays import Floats, Ints
from zfcal.diagnose.candidates import candidate_of
from zfcal.diagnose.fields import is_within_fields
from zfcal.diagnose.freezes import rested_steps
from zfcal.diagnose.naming import refit
from zfcal.diagnose.rests import ChainFit, runs_of
from zfcal.diagnose.screening import Screen
from zfcal.diagnose.speeds import chain_of, log_density
from zfcal.model.effects import find_effect
from zfcal.model.extended import maximise
from zfcal.model.fitted import Fitted
from zfcal.model.kernels.landing import ANGLES
from zfcal.model.scene import Scene, thin
from zfcal.parameters import Parameters, ZoneParameters

Effects = Mapping[str, Mapping[str, float]]
"""Effects by name, each with its parameters."""

_TINY = 1e-300
_DRAWS = 8
MIN_SPEEDS = 30
"""With fewer own speeds a zone keeps those of the model."""


def scene_of(scene: Scene, block: Ints, chosen: NDArray[np.bool_]) -> Scene:
    """Return the steps that lie within chosen blocks, with both of their displacements.

    Parameters
    ----------
    scene
        Of the whole recording.
    block : ndarray of int, shape (sample,)
        Which block each sample is in.
    chosen : ndarray of bool, shape (block,)

    Returns
    -------
    Scene
        The same states, so that what the fish remember is there; no step that crosses
        an edge.
    """

    def within(at: Ints) -> NDArray[np.bool_]:
        before, after = block[np.maximum(at - 1, 0)], block[np.minimum(at + 1, len(block) - 1)]
        return np.asarray(chosen[block[at]] & (before == block[at]) & (after == block[at]))

    return thin(scene, within(scene.turns.at), within(scene.moves.at))


def fit_base(scene: Scene, model: Parameters) -> Screen:
    """Return a model at its maximum likelihood; the effects that it has stay as they are."""
    return Screen(scene=scene, fitted=maximise(scene, model))


def fit_effects(screen: Screen, effects: Effects) -> Screen:
    """Return the model with effects added one after the other, each at its maximum likelihood.

    Parameters
    ----------
    screen
        The model without them.
    effects
        In the order of adding, with the parameters to start from.
    """
    for name, values in effects.items():
        candidate = candidate_of(name, values)
        strength = values.get(candidate.effect.strength, candidate.notable)
        asked = screen.ask(candidate)
        start = replace(asked, strength=abs(strength), z=math.copysign(1.0, strength))
        screen = refit(screen, start).screen
    return screen


def own_speeds(screen: Screen, template: Parameters, limits_m_s: tuple[float, float]) -> Parameters:
    """Return a model that draws its speeds from those measured, less what its effects do.

    Rule: the frequencies of a model are those of the draws, before any effect multiplies
    them or stops an agent. So what an effect on speed explains is not in them a second time.

    Parameters
    ----------
    screen
        The model with its effects, on the steps that its speeds are taken from.
    template
        Gives all else; a zone with fewer than 30 steps keeps its speeds.
    limits_m_s
        Range of the frequencies' bins.
    """
    moves, parameters = screen.scene.moves, screen.fitted.parameters
    now, before = screen.still
    resting = [name for name in parameters.effects if find_effect(name).rests]
    rows = ~before if resting else np.ones(len(moves), dtype=bool)
    zones = []
    for number, zone in enumerate(template.zones, start=1):
        here = rows & (moves.zone == number)
        counts = _histogram(screen.own_speeds[here], limits_m_s, len(zone.speed_frequency))
        for name in resting:
            # Of those that swam so many have stopped: they drew no speed.
            rate_per_s = parameters.effects[name][find_effect(name).strength]
            rests = 1 - math.exp(-rate_per_s * screen.scene.dt_s)
            counts[0] -= min(rests * here.sum(), float((now & here).sum()), counts[0])
        zones.append(_with_speeds(zone, counts) if here.sum() >= MIN_SPEEDS else zone)
    return replace(template, zones=tuple(zones))


def _histogram(speed: Floats, limits: tuple[float, float], n_bins: int) -> Floats:
    low, high = limits
    place = ((speed - low) / (high - low) * n_bins).astype(np.int64)
    return np.bincount(np.clip(place, 0, n_bins - 1), minlength=n_bins).astype(np.float64)


def _with_speeds(zone: ZoneParameters, counts: Floats) -> ZoneParameters:
    frequency = counts / counts.sum() if counts.sum() > 0 else np.array(zone.speed_frequency)
    return replace(zone, speed_frequency=tuple(map(float, frequency)))


def evaluate(screen: Screen, scene: Scene) -> Screen:
    """Return a fitted model on other steps of the same recording, nothing fitted anew."""
    fitted = screen.fitted
    there = replace(scene, states=screen.scene.states)
    return Screen(scene=there, fitted=maximise(there, fitted.parameters, start=fitted.x, rounds=0))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Steps:
    """A number for each step of a scene, turns or moves.

    Parameters
    ----------
    at : ndarray of int, shape (step,)
        The sample in which it begins.
    values : ndarray, shape (step,)
    """

    at: Ints
    values: Floats

    def by_block(self, block: Ints, n_blocks: int) -> tuple[Floats, Floats]:
        """Return sums over the steps of each block, and how many they are."""
        own = block[self.at]
        sums = np.bincount(own, weights=self.values, minlength=n_blocks)
        return sums.astype(np.float64), np.bincount(own, minlength=n_blocks).astype(np.float64)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Gains:
    """Log likelihood that a model adds to another, measured and expected.

    Parameters
    ----------
    base
        Log density of the other model.
    gain
        What the model adds.
    expected
        What it would add if the fish drew from it, given where everybody was.
    """

    base: Steps
    gain: Steps
    expected: Steps


def heading_gains(model: Screen, base: Screen) -> Gains:
    """Return what a model adds to the log density of headings, in nats per step.

    Parameters
    ----------
    model, base
        Evaluated on the same steps.
    """
    at = base.scene.turns.at
    used = base.fitted.used & model.fitted.used
    log_p = np.where(used, base.fitted.log_p, 0.0)
    gain = np.where(used, model.fitted.log_p - base.fitted.log_p, 0.0)
    ours, theirs = (_cells(each.fitted) for each in (model, base))
    ratio = np.log(np.maximum(ours, _TINY)) - np.log(np.maximum(theirs, _TINY))
    expected = np.where(used, (ours * ratio).sum(axis=1), 0.0)
    return Gains(
        base=Steps(at=at, values=log_p),
        gain=Steps(at=at, values=gain),
        expected=Steps(at=at, values=expected),
    )


def _cells(fitted: Fitted) -> Floats:
    """Return the probability of each cell of headings with the lapse, shape (turn, cell)."""
    _, probability, _ = fitted.tables()
    for x, turns in zip(fitted.x, fitted.turns, strict=True):
        probability[turns.rows] *= 1 - x[-1]
        probability[turns.rows] += x[-1] / ANGLES
    return probability


def speed_gains(
    model: Screen, base: Screen, trained: Screen, *, random: np.random.Generator
) -> Gains | None:
    """Return what a model adds to the log density of speeds; None where both are alike there.

    Parameters
    ----------
    model, base
        Evaluated on the same steps.
    trained
        The model on the steps that it was fitted on: gives the chances of stopping.
    random
        Draws the speeds that the model would have.
    """
    names = [n for n in model.fitted.parameters.effects if n not in base.fitted.parameters.effects]
    effects = [find_effect(name) for name in names]
    if not any(effect.on_speed for effect in effects):
        return None
    moves = base.scene.moves
    parts = []
    field = _field(base, [name for name in names if find_effect(name).on_speed])
    if any(effect.multiplies for effect in effects):
        parts.append(_factor_gains(model, base, field, random))
    if any(effect.rests for effect in effects):
        parts.append(_stop_gains(model, trained))
    before = base.model_factor
    return Gains(
        base=Steps(
            at=moves.at, values=log_density(moves.speed_m_s, before, moves.zone, field=field)
        ),
        gain=Steps(at=moves.at, values=sum((gain for gain, _ in parts), np.zeros(len(moves)))),
        expected=Steps(at=moves.at, values=sum((e for _, e in parts), np.zeros(len(moves)))),
    )


def _field(base: Screen, names: Sequence[str]) -> Ints | None:
    """Return the field of each move; none where an effect is a place that fields hold apart."""
    within = all(is_within_fields(candidate_of(name, {})) for name in names)
    return base.fields if within else None


def _factor_gains(
    model: Screen, base: Screen, field: Ints | None, random: np.random.Generator
) -> tuple[Floats, Floats]:
    """Return gains of factors on speed, and what draws of the model itself would gain."""
    moves = base.scene.moves
    ours, theirs = model.model_factor, base.model_factor

    def gain(speed: Floats) -> Floats:
        own = log_density(speed, ours, moves.zone, field=field)
        return own - log_density(speed, theirs, moves.zone, field=field)

    expected, alike = np.zeros(len(moves)), moves.zone if field is None else field
    for _ in range(_DRAWS):
        drawn = np.empty(len(moves))
        for number in np.unique(alike):
            rows = np.flatnonzero(alike == number)
            drawn[rows] = random.permutation(model.own_speeds[rows])
        expected += gain(drawn * ours) / _DRAWS
    return gain(moves.speed_m_s), expected


def _stop_gains(model: Screen, trained: Screen) -> tuple[Floats, Floats]:
    """Return gains of a chain of swimming and resting over rests by zone alone."""
    runs = runs_of(model)
    found = _chain(trained)
    ours, theirs = runs.still_chance(found.chain), runs.still_chance(found.alike)
    gain = runs.log_chance(found.chain) - runs.log_chance(found.alike)
    return gain, rel_entr(ours, theirs) + rel_entr(1 - ours, 1 - theirs)


def _chain(trained: Screen) -> ChainFit:
    """Return the chain of the steps that a model was fitted on."""
    effects = trained.fitted.parameters.effects
    (name,) = (name for name in effects if find_effect(name).rests)
    return chain_of(runs_of(trained), candidate_of(name, effects[name]), trained.scene.dt_s)


def effect_steps(screen: Screen, trained: Screen, name: str, values: Mapping[str, float]) -> Steps:
    """Return an effect's own statistic in a model, step by step.

    Parameters
    ----------
    screen
        The model with or without the effect.
    trained
        On the steps that it was fitted on.
    name, values
        The effect, and the shape at which it is asked for.

    Returns
    -------
    Steps
        Efficient scores: their sum over the root of the sum of their squares is standard
        normal where the model is right.
    """
    candidate = candidate_of(name, values)
    effect = candidate.effect
    if effect.rests and name in screen.fitted.parameters.effects:
        # As where the model lacks it, with the chance of a still step that the chain gives.
        rested, (now, _) = screen.still_for(rested_steps(candidate)), screen.still
        chance = runs_of(screen).still_chance(_chain(trained).chain)
        return Steps(at=screen.scene.moves.at, values=np.where(rested, now - chance, 0.0))
    scored = screen.ask(candidate)
    at = screen.scene.moves.at if effect.on_speed else screen.scene.turns.at
    return Steps(at=at, values=scored.steps)

"""Whether what was found holds on steps that it was not fitted to.

Blocks of 60 s alternate between two halves. Both models are fitted to one half and
judged on the other, and the other way round. Beside individuals that differ an effect is there in
more than one of them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Floats
from zfcal.diagnose.findings import Note
from zfcal.diagnose.scores import Score, by_track
from zfcal.diagnose.screening import Screen
from zfcal.diagnose.selection import Step
from zfcal.diagnose.speeds import held_out_gain
from zfcal.diagnose.steadiness import judged_by
from zfcal.model.effects import find_effect
from zfcal.model.extended import log_p_at, maximise
from zfcal.model.fitted import MIN_STEPS, Fitted
from zfcal.model.scene import Moves, Scene, thin

BLOCK_S = 60.0
_ROUNDS = 2
"""Uphill from the fit to all steps: further ones change a half by less than what it errs."""

_SURE = 2.0
_LEAST_VARIANCE = 1e-12

_OF_OTHERS = 2.0
"""Standard errors that are left of an effect without the fish that asks for it most."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Confirmed:
    """What an effect gains on steps that were held out.

    Parameters
    ----------
    gain_nats_per_step, gain_se
        Mean over all steps of the log density with it less that without it, and the
        standard error of that mean.
    holds
        Whether the gain is more than two standard errors, and beside individuals that differ not
        that of one fish.
    """

    gain_nats_per_step: float
    gain_se: float
    holds: bool


def half_of(scene: Scene, steps: Moves, which: int) -> NDArray[np.bool_]:
    """Return the steps in every other block of 60 s, shape (step,)."""
    block = np.floor(scene.time_s(steps) / min(BLOCK_S, scene.duration_s / 4)).astype(np.int64)
    return np.asarray(block % 2 == which)


def halves(scene: Scene) -> tuple[Scene, Scene]:
    """Return the same states with the steps of each half."""
    first, second = (
        thin(scene, half_of(scene, scene.turns, which), half_of(scene, scene.moves, which))
        for which in (0, 1)
    )
    return first, second


def confirm(
    screen: Screen, steps: Sequence[Step], *, n_workers: int
) -> tuple[tuple[Confirmed, ...], Note]:
    """Return what each effect gains on held-out steps, and how far the halves differ.

    Parameters
    ----------
    screen
        The model without any of the effects.
    steps
        The effects, and the model without each of them.
    n_workers
        Fits at the same time; the numbers do not depend on it.

    Returns
    -------
    confirmed : tuple of Confirmed
    note
        Largest difference between the fits of the two halves, in standard errors.
    """
    models = {id(screen): screen}
    for step in steps:
        if not step.choice.best.candidate.effect.on_speed:
            models |= {id(each): each for each in (step.before, step.choice.best.screen)}
    asked = [(key, which) for key in models for which in (0, 1)]
    with ThreadPoolExecutor(max(1, n_workers)) as pool:
        made = list(pool.map(lambda each: _half(models[each[0]], each[1]), asked))
        halves_of = {key: (made[2 * n], made[2 * n + 1]) for n, key in enumerate(models)}
        confirmed = pool.map(lambda step: _confirmed(step, halves_of), steps)
        return tuple(confirmed), _note(screen, halves_of[id(screen)])


def _confirmed(step: Step, halves_of: Mapping[int, tuple[_Half, _Half]]) -> Confirmed:
    best = step.choice.best
    if best.candidate.effect.on_speed:
        told = _of_speeds(step)
    else:
        before, after = halves_of[id(step.before)], halves_of[id(best.screen)]
        told = _summary(_held_out(step.before.scene, after) - _held_out(step.before.scene, before))
    score, scene = step.best.score, step.before.scene
    shared = not _tells_apart(step.before.fitted) or is_shared(score, scene)
    return replace(told, holds=told.holds and shared)


def holds(step: Step, *, n_workers: int) -> bool:
    """Return whether an effect that would be added holds on held-out steps, beside what is there.

    Parameters
    ----------
    step
        The effect, and the model without it.
    n_workers
        Fits at the same time; the answer does not depend on it.
    """
    (told,), _ = confirm(step.before, [step], n_workers=n_workers)
    return told.holds


def _tells_apart(fitted: Fitted) -> bool:
    """Return whether individuals differ in a model."""
    return any(find_effect(name).by_trait for name in fitted.parameters.effects)


def is_shared(score: Score, scene: Scene) -> bool:
    """Return whether others than the fish that asks for an effect most ask for it as well.

    Where individuals differ in another way than the model says, what is left over is that of
    the fish that differs most. It looks like an effect on all, and is none.

    Parameters
    ----------
    score
        Of the effect in the model without it. Individuals and rests are as they are.
    scene
        Whose steps the score is of.
    """
    if not score.candidate.effect.in_any_steps:
        return True
    track = judged_by(score, scene).track
    sums, information = by_track(track, score.steps)
    total = float(sums.sum())
    others = information.sum() - information
    left = np.sign(total) * (total - sums) / np.sqrt(np.maximum(others, 1e-300))
    return bool(left.min(initial=np.inf) > _OF_OTHERS)


def _of_speeds(step: Step) -> Confirmed:
    best, scene = step.best.score, step.before.scene
    gain = np.empty(len(scene.moves))
    for which in (0, 1):
        own = half_of(scene, scene.moves, which)
        gain[own] = held_out_gain(step.before, best.candidate, best.strength, ~own)[own]
    return _summary(gain)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Half:
    """A model that was learnt on one half, and the log densities of the other half's turns."""

    learnt: Fitted
    log_p: Floats


def _half(screen: Screen, which: int) -> _Half:
    fitted, parts = screen.fitted, halves(screen.scene)
    learnt = maximise(
        parts[which], fitted.parameters, free=fitted.free, start=fitted.x, rounds=_ROUNDS
    )
    log_p = log_p_at(parts[1 - which], learnt.parameters, learnt.x)
    return _Half(learnt=learnt, log_p=log_p)


def _held_out(scene: Scene, learnt: tuple[_Half, _Half]) -> Floats:
    """Return log densities of all turns, each under the fit to the other half."""
    log_p = np.full(len(scene.turns), np.nan)
    for which in (0, 1):
        log_p[half_of(scene, scene.turns, 1 - which)] = learnt[which].log_p
    return log_p


def _summary(gain: Floats) -> Confirmed:
    gain = gain[~np.isnan(gain)]
    n = max(len(gain), 1)
    mean, error = float(gain.sum() / n), float(gain.std() / np.sqrt(n))
    return Confirmed(gain_nats_per_step=mean, gain_se=error, holds=mean > _SURE * error)


def _note(screen: Screen, learnt: tuple[_Half, _Half]) -> Note:
    """Return how far the fits of the two halves differ, in standard errors."""
    differences = []
    fits = [half.learnt for half in learnt]
    for zone, turns in enumerate(screen.fitted.turns):
        if len(turns.rows) < 4 * MIN_STEPS:
            continue
        by = fits[0].x[zone][:3] - fits[1].x[zone][:3]
        variance = np.sum([_variance(fit.scores[zone]) for fit in fits], axis=0)
        # Of what no step tells, such as neighbours of a fish alone, there is no error.
        told = variance > _LEAST_VARIANCE
        differences += list(np.abs(by[told]) / np.sqrt(variance[told]))
    largest = max(map(float, differences), default=0.0)
    return Note(
        name="halves",
        says="Largest difference between the fits of the two halves, in standard errors.",
        values={"largest": largest},
    )


def _variance(scores: Floats) -> Floats:
    information = scores.T @ scores
    return np.asarray(np.diag(np.linalg.pinv(information, hermitian=True))[:3])

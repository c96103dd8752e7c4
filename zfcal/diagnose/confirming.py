"""Whether what was found holds on steps that it was not fitted to, and all the time.

Blocks of 60 s alternate between two halves. Both models are fitted to one half and
judged on the other, and the other way round. A listed effect is there all the time: one
whose strength differs between minutes, or seconds, by more than its mean is another one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from zfcal.diagnose.findings import Note
from zfcal.diagnose.scores import Score
from zfcal.diagnose.screening import Screen
from zfcal.diagnose.selection import Step
from zfcal.diagnose.speeds import held_out_gain
from zfcal.model.effects.generic import PREFIX
from zfcal.model.extended import maximise
from zfcal.model.fitted import MIN_STEPS, Fitted
from zfcal.model.scene import Moves, Scene, thin

Floats = NDArray[np.float64]

BLOCK_S = 60.0
_ROUNDS = 6
_SURE = 2.0
_LEAST_VARIANCE = 1e-12

_WAVERS_S = (60.0, 10.0)
_WAVERS = 3e-3
"""Chance at which the scores of blocks of so many seconds are no longer of one strength."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Confirmed:
    """What an effect gains on steps that were held out.

    Parameters
    ----------
    gain_nats_per_step, gain_se
        Mean over all steps of the log density with it less that without it, and the
        standard error of that mean.
    holds
        Whether the gain is more than two standard errors.
    steady
        Whether the effect is there all the time.
    """

    gain_nats_per_step: float
    gain_se: float
    holds: bool
    steady: bool = True


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


def confirm(step: Step) -> Confirmed:
    """Return what an effect gains on held-out steps.

    Parameters
    ----------
    step
        The effect, and the model without it.
    """
    told = _gained(step)
    return replace(told, steady=is_steady(step.best.score, step.before.scene))


def _gained(step: Step) -> Confirmed:
    best = step.choice.best
    if best.candidate.effect.on_speed:
        return _of_speeds(step)
    before = _held_out(step.before.scene, step.before.fitted)
    after = _held_out(best.screen.scene, best.screen.fitted)
    return _summary(after - before)


def _of_speeds(step: Step) -> Confirmed:
    best, scene = step.best.score, step.before.scene
    gain = np.empty(len(scene.moves))
    for which in (0, 1):
        own = half_of(scene, scene.moves, which)
        gain[own] = held_out_gain(step.before, best.candidate, best.strength, ~own)[own]
    return _summary(gain)


def is_steady(score: Score, scene: Scene) -> bool:
    """Return whether the strength of an effect differs between blocks by less than its mean.

    The spread of the strength is that of DerSimonian and Laird (1986, Controlled Clinical
    Trials 7: 177-188). Individuals and rests differ between blocks by nature, and effects
    beyond the list may have their times.

    Parameters
    ----------
    score
        Of the effect in the model without it.
    scene
        Whose steps the score is of.
    """
    effect = score.candidate.effect
    if effect.individual or effect.stops or effect.name.startswith(PREFIX):
        return True
    times_s = scene.time_s(scene.moves if effect.on_speed else scene.turns)
    return all(_one_strength(score.steps, times_s // block_s) for block_s in _WAVERS_S)


def _one_strength(steps: Floats, block: Floats) -> bool:
    """Return whether blocks may have one strength, or spread by less than its mean."""
    _, place = np.unique(block, return_inverse=True)
    sums, information = np.bincount(place, weights=steps), np.bincount(place, weights=steps**2)
    sums, information = sums[information > 0], information[information > 0]
    if len(sums) < 2:
        return True
    total = float(information.sum())
    mean = float(sums.sum()) / total
    q, df = float(((sums - mean * information) ** 2 / information).sum()), len(sums) - 1
    spread2 = (q - df) / (total - float((information**2).sum()) / total)
    return bool(spread2 <= mean**2 or stats.chi2.sf(q, df) > _WAVERS)


def _held_out(scene: Scene, fitted: Fitted) -> Floats:
    """Return log densities of all turns, each under the fit to the other half."""
    parts = halves(scene)
    log_p = np.full(len(scene.turns), np.nan)
    for which, (own, other) in enumerate((parts, parts[::-1])):
        learnt = maximise(
            other, fitted.parameters, free=fitted.free, start=fitted.x, rounds=_ROUNDS
        )
        judged = maximise(own, learnt.parameters, start=learnt.x, rounds=0)
        log_p[half_of(scene, scene.turns, which)] = judged.log_p
    return log_p


def _summary(gain: Floats) -> Confirmed:
    gain = gain[~np.isnan(gain)]
    n = max(len(gain), 1)
    mean, error = float(gain.sum() / n), float(gain.std() / np.sqrt(n))
    return Confirmed(gain_nats_per_step=mean, gain_se=error, holds=mean > _SURE * error)


def halves_note(screen: Screen) -> Note:
    """Return how far the fits of the two halves differ, in standard errors."""
    fitted = screen.fitted
    differences = []
    fits = [
        maximise(part, fitted.parameters, free=fitted.free, start=fitted.x, rounds=_ROUNDS)
        for part in halves(screen.scene)
    ]
    for zone, turns in enumerate(fitted.turns):
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

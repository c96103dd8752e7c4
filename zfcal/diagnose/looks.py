"""What looks by features have in common: what they found, and how it goes into the model."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, stdtrit

from zfcal.arrays import Floats
from zfcal.diagnose.candidates import Candidate, further_forms
from zfcal.diagnose.case import QUICK_REPLICATES, Case
from zfcal.diagnose.confirming import MINUTES_S, PHASES, WAVERS, Confirmed, confirm
from zfcal.diagnose.features.gains import Gain
from zfcal.diagnose.features.naming import Told
from zfcal.diagnose.naming import SURE, Choice, Refit, by_sample, refit
from zfcal.diagnose.null import run_null
from zfcal.diagnose.pulses import pulses
from zfcal.diagnose.scores import Score
from zfcal.diagnose.screening import Screen, ask_all
from zfcal.diagnose.selection import LEVEL, Best, Step
from zfcal.model.effects import Effect, find_effect
from zfcal.model.scene import Scene

BY_ITSELF = 4.0
"""Standard errors by which features of a name must lead those of all others where no form of ours
bears it out and something is left."""

_FORMS = 6
"""Forms of an effect, the clearest ones, that are put into the model to see which gains most."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Found:
    """Effects that are missing, in the order of adding, and what each gains on held-out steps.

    ``nats`` is what the clearest of them gains by features, whatever its form. ``without_noise``
    where one explains what noise of positions had seemed to. ``suspicious`` where nothing is named
    though features gain more than chance: no form of ours bears out what they say.
    """

    steps: tuple[Step, ...]
    confirmed: tuple[Confirmed, ...]
    nats: float = 0.0
    without_noise: bool = False
    suspicious: bool = False


def level_of(number: int) -> float:
    """Return the false-alarm level of a look: the first ones, at speeds and at headings, share one.

    Each further look has half of what the one before had. So the level is that of a name where
    nothing is missing, and of all further names together where something is.

    Parameters
    ----------
    number
        How many looks at the same there were before.
    """
    return float(LEVEL / 2 ** (number + 1))


def on_headings(step: Step) -> bool:
    """Return whether an effect that was named acts on headings."""
    return not step.choice.best.candidate.effect.on_speed


def with_further(found: Found, n: int, further: Found) -> Found:
    """Return the first ``n`` effects that were found, and further ones."""
    return Found(
        steps=(*found.steps[:n], *further.steps),
        confirmed=(*found.confirmed[:n], *further.confirmed),
        nats=max(found.nats, further.nats),
        without_noise=found.without_noise or further.without_noise,
    )


def with_again(case: Case, found: Found, later: Iterable[tuple[Step, Confirmed]]) -> Found:
    """Return what was found with effects that had been named after what has changed.

    Parameters
    ----------
    case
        The question.
    found
        What is there now.
    later
        Effects and what held-out steps said of them; each is put into the model anew.
    """
    for step, confirmed in later:
        name, there = step.choice.best.name, {each.choice.best.name for each in found.steps}
        if name in there:
            continue
        screen = found.steps[-1].choice.best.screen
        made, score = in_the_model(case, screen, name)
        again = dataclasses.replace(
            step,
            choice=dataclasses.replace(step.choice, best=made),
            best=dataclasses.replace(step.best, score=score),
            before=screen,
        )
        found = with_further(found, len(found.steps), Found(steps=(again,), confirmed=(confirmed,)))
    return found


def stays(there: Refit, told: Told, scene: Scene, at: NDArray[np.int64]) -> bool:
    """Return whether what was named is kept beside what features say.

    A listed effect is kept where it gains as much as features of another name do, within the error
    of the difference; one beyond the list where it gains more, and does not say what that name
    says in another form.

    Parameters
    ----------
    there
        What was named: another name, that can be told from it.
    told
        What features name.
    scene, at
        The recording, and the sample in which each step of the features begins.
    """
    name = told.gain.name
    if there.is_generic and there.name in find_effect(name).other_forms:
        return False
    by = by_sample(scene, at, told.gain.log_p) - there.gain
    error = float(by.std()) * float(np.sqrt(len(by)))
    ahead = float(told.gain.nats - there.nats)
    return ahead < -SURE * error if there.is_generic else ahead < SURE * error


def not_yet_there(case: Case, beside: Sequence[Effect]) -> list[Effect]:
    """Return the listed effects that are looked for beside some that are there, by name."""
    known = {effect.name for effect in beside}
    return [find_effect(name) for name in sorted({each.name for each in case.listed} - known)]


def without_idle_ties(told: Told, stands: Callable[[Effect, Effect], bool]) -> Told:
    """Return a name without those ties that have nothing to say beside it.

    Parameters
    ----------
    told
        A name and its ties.
    stands
        Whether features of one effect gain more than chance beside those of another.
    """
    kept, own = [], find_effect(told.gain.name)
    for tie in told.ties:
        other = find_effect(tie.name)
        if stands(other, own) or not stands(own, other):
            kept.append(tie)
    return dataclasses.replace(told, ties=tuple(kept))


def replicate_nats(
    case: Case, clear: Sequence[Gain], gains: Callable[[Screen, list[Effect]], Iterable[Gain]]
) -> list[float]:
    """Return what features may gain on one more replicate of the model, at most: see `bound`.

    Parameters
    ----------
    case
        The question, whose model makes the replicates.
    clear
        Of the features.
    gains
        Of a replicate and the effects of these features: what features gain there.
    """
    keys = [gain.key for gain in clear]
    effects = [find_effect(name) for name in sorted({name for name, _ in keys})]

    def ask(_number: int, other: Screen) -> list[float]:
        most: dict[tuple[str, str], float] = {}
        for gain in gains(other, effects):
            most[gain.key] = max(most.get(gain.key, 0.0), float(gain.log_p.sum()))
        return [most.get(key, 0.0) for key in keys]

    n_workers = case.question.n_workers
    return list(bound(np.array(run_null(case.chain, ask, QUICK_REPLICATES, n_workers=n_workers))))


def held_out(
    case: Case, screen: Screen, told: Told, made: tuple[Refit, Score]
) -> tuple[Step, Confirmed]:
    """Return a name as an effect that was added to a model, and what it gains on held-out steps.

    Parameters
    ----------
    case
        The question.
    screen
        The model without it.
    told
        The name and its ties.
    made
        The effect in the model, and its score there.
    """
    best, score = made
    ties = tuple(in_the_model(case, screen, gain.name)[0] for gain in told.ties)
    step = Step(
        choice=Choice(best=best, ties=ties, considered=(best, *ties)),
        best=Best(score=score, z=score.clearness, p=told.p, information=score.information),
        before=screen,
    )
    (confirmed,), _ = confirm(screen, [step], n_workers=case.question.n_workers)
    return step, dataclasses.replace(confirmed, holds=True, steady=True)


def gains_by_itself(form: Refit) -> bool:
    """Return whether the form that goes into the model gains more than chance by itself.

    What is no effect of the list answers to features of several names a little, and to none of
    their forms. On held-out steps a form is not asked: that would halve the power.
    """
    return bool(chdtrc(form.n_free, 2 * max(float(form.gain.sum()), 0.0)) < LEVEL)


def in_all_minutes(apart: Floats, at: NDArray[np.int64], scene: Scene) -> bool:
    """Return whether something of mean zero in all has mean zero in each minute.

    Parameters
    ----------
    apart : ndarray, shape (step,)
        What an effect gains at each step, less what it would gain if it were there all the time.
    at : ndarray of int64, shape (step,)
        Sample in which each step begins.
    scene
        Of the recording.
    """
    minute = (scene.k[at] * scene.dt_s // MINUTES_S).astype(np.int64)
    return _alike(apart, minute - minute.min(initial=0))


def in_all_phases(apart: Floats, at: NDArray[np.int64], scene: Scene) -> bool:
    """Return whether it has mean zero over the phases of its period, if it has one.

    Parameters
    ----------
    apart, at, scene
        As of `in_all_minutes`.
    """
    series = np.bincount(at, apart, len(scene.k)).astype(np.float64)
    found = pulses(series[None], scene.dt_s)
    if not found.tail <= WAVERS:
        return True
    phase = (at * scene.dt_s / found.period_s % 1 * PHASES).astype(np.int64)
    return _alike(apart, phase)


def _alike(apart: Floats, part: NDArray[np.int64]) -> bool:
    """Return whether steps have mean zero in all parts of a recording, by a chi-square."""
    sums, squares = np.bincount(part, apart), np.bincount(part, apart**2)
    told = squares > 0
    ratio = float((sums[told] ** 2 / squares[told]).sum())
    return bool(chdtrc(int(told.sum()), ratio) > WAVERS)


def bound(rows: Floats) -> Floats:
    """Return what one more row, shape (row, feature), exceeds anywhere in 2 % of cases.

    By Student's t for each feature, and Bonferroni's inequality for all of them.
    """
    n, n_features = rows.shape
    times = stdtrit(n - 1, 1 - LEVEL / n_features) * np.sqrt(1 + 1 / n)
    return np.maximum(rows.mean(axis=0) + times * rows.std(axis=0, ddof=1), 0.0)


def in_the_model(case: Case, screen: Screen, name: str) -> tuple[Refit, Score]:
    """Return an effect in the model in that form which gains most, and its score there."""
    own = [each for each in (*case.listed, *case.generic) if each.name == name]
    own += further_forms(find_effect(name), case.scene)
    scores = ask_all(screen, own, case.question.n_workers)
    forms: dict[tuple[float, ...], Score] = {}
    for score in sorted(scores, key=lambda each: -each.clearness):
        forms.setdefault(form_of(score.candidate), score)
    tried = list(forms.values())[:_FORMS]
    made = [refit(screen, score, n_workers=case.question.n_workers) for score in tried]
    k = int(np.argmax([each.worth for each in made]))
    return made[k], tried[k]


def form_of(candidate: Candidate) -> tuple[float, ...]:
    """Return the shapes of a candidate that a fit leaves as they are."""
    return tuple(candidate.shape[key] for key in candidate.effect.fixed if key in candidate.shape)

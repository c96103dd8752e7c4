"""A second look at headings, by features: names what no form of the listed effects shows.

The efficient scores ask for effects in the forms that they have here. Fish may have them in
others, so each name's features are asked as well. They name what was not named, and take the place
of what was where they gain more than it does in its own form, by more than the error of the
difference. The name goes into the model in that form of ours which gains most.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from zfcal.arrays import Floats
from zfcal.diagnose.candidates import Candidate, further_forms, in_model
from zfcal.diagnose.case import QUICK_REPLICATES, Case, has_noise, noise_of
from zfcal.diagnose.confirming import MINUTES_S, PHASES, WAVERS, Confirmed, confirm
from zfcal.diagnose.features.gains import Gain, gains_of
from zfcal.diagnose.features.law import Law
from zfcal.diagnose.features.naming import Told, tell
from zfcal.diagnose.heldout import heading_gains
from zfcal.diagnose.naming import SURE, Choice, Refit, by_sample, refit
from zfcal.diagnose.null import run_null
from zfcal.diagnose.pulses import pulses
from zfcal.diagnose.scores import Score
from zfcal.diagnose.screening import Screen, ask_all
from zfcal.diagnose.selection import LEVEL, Best, Step
from zfcal.model.effects import find_effect

_BY_ITSELF = 4.0
"""Standard errors by which features of a name must lead those of all others where no form of ours
bears it out: such as a response that is late by less than a step."""

_FORMS = 6
"""Forms of an effect, the clearest ones, that are put into the model to see which gains most."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SecondLook:
    """An effect that features name.

    Parameters
    ----------
    step
        As one that was selected.
    confirmed
        What it gains on held-out steps.
    n_before
        So many of the effects named without features stay before it; it takes the place of those
        that were added after them.
    """

    step: Step
    confirmed: Confirmed
    n_before: int


def second_look(case: Case, kept: Sequence[Step]) -> SecondLook | None:
    """Return the effect on headings that features name; None where nothing is to be changed.

    Features are not asked where the model came with effects on headings: what these leave over,
    where the fish have another form of them, would be named. Nor where nobody knows by how much
    positions err: what noise makes of a law would be named.

    Parameters
    ----------
    case
        The question, its scene and what is asked for.
    kept
        What was named without features. Of effects on headings the first is held against them:
        one beyond the list is kept where it gains more than features do, a listed one where it
        gains as much.
    """
    given = in_model(case.screen.fitted.parameters)
    if case.question.noise_m is None or any(not each.effect.on_speed for each in given):
        return None
    on_headings = [not step.choice.best.candidate.effect.on_speed for step in kept]
    n = on_headings.index(True) if any(on_headings) else len(kept)
    screen = kept[n - 1].choice.best.screen if n else case.screen
    found = _named(case, screen, kept[n] if n < len(kept) else None)
    return None if found is None else SecondLook(step=found[0], confirmed=found[1], n_before=n)


def _named(case: Case, screen: Screen, there: Step | None) -> tuple[Step, Confirmed] | None:
    """Return what features name in a model, and what it gains on held-out steps."""
    law = _law(case, screen)
    listed = {each.name for each in case.listed} - set(screen.fitted.parameters.effects)
    effects = [find_effect(name) for name in sorted(listed)]
    gains = gains_of(law, effects, n_workers=case.question.n_workers)
    noise = (lambda clear: _noise_nats(case, clear)) if has_noise(case.question) else None
    told = tell(gains, noise)
    if told is None or (there is not None and _stays(there.choice.best, told, law)):
        return None
    found, score = _in_the_model(case, screen, told.gain.name)
    ties = tuple(_in_the_model(case, screen, gain.name)[0] for gain in told.ties)
    step = Step(
        choice=Choice(best=found, ties=ties, considered=(found, *ties)),
        best=Best(score=score, z=score.clearness, p=told.p, information=score.information),
        before=screen,
    )
    (confirmed,), _ = confirm(screen, [step], n_workers=case.question.n_workers)
    is_borne_out = _gains(found) and _is_steady(confirmed, found.screen, screen)
    if not (is_borne_out or told.lead > _BY_ITSELF):
        return None
    return step, dataclasses.replace(confirmed, holds=True, steady=True)


def _gains(form: Refit) -> bool:
    """Return whether the form that goes into the model gains more than chance by itself.

    What is no effect of the list answers to features of several names a little, and to none of
    their forms. On held-out steps a form is not asked: that would halve the power.
    """
    return bool(chdtrc(form.n_free, 2 * max(float(form.gain.sum()), 0.0)) < LEVEL)


def _is_steady(confirmed: Confirmed, model: Screen, base: Screen) -> bool:
    """Return whether an effect is there in all minutes, and not in pulses at regular times.

    Its scores say so, or what it gains at each step less what it would gain if the fish drew from
    the model all the time: that has mean zero in each minute, and no period. Neither is normal
    where few moments ask for an effect: scores where they are far apart, gains where they are rare.
    """
    gains, scene = heading_gains(model, base), base.scene
    at, apart = gains.gain.at, gains.gain.values - gains.expected.values
    minute = (scene.time_s(scene.turns) // MINUTES_S).astype(np.int64)
    if not (confirmed.in_all_minutes or _alike(apart, minute - minute.min())):
        return False
    series = np.bincount(at, apart, len(scene.k)).astype(np.float64)
    found = pulses(series[None], scene.dt_s)
    if not confirmed.pulsed or not found.tail <= WAVERS:
        return True
    phase = (at * scene.dt_s / found.period_s % 1 * PHASES).astype(np.int64)
    return _alike(apart, phase)


def _alike(apart: Floats, part: NDArray[np.int64]) -> bool:
    """Return whether steps have mean zero in all parts of a recording, by a chi-square."""
    sums, squares = np.bincount(part, apart), np.bincount(part, apart**2)
    told = squares > 0
    ratio = float((sums[told] ** 2 / squares[told]).sum())
    return bool(chdtrc(int(told.sum()), ratio) > WAVERS)


def _law(case: Case, screen: Screen) -> Law:
    noise_m = noise_of(case.question) if has_noise(case.question) else 0.0
    return Law(scene=screen.scene, fitted=screen.fitted, noise_m=noise_m, seed=case.question.seed)


def _stays(there: Refit, told: Told, law: Law) -> bool:
    """Return whether what was named is kept beside what features say."""
    if there.name in {told.gain.name, *(gain.name for gain in told.ties)}:
        return True
    by = by_sample(law.scene, law.turns.at, told.gain.log_p) - there.gain
    error = float(by.std()) * float(np.sqrt(len(by)))
    ahead = float(told.gain.nats - there.nats)
    return ahead < -SURE * error if there.is_generic else ahead < SURE * error


def _noise_nats(case: Case, clear: Sequence[Gain]) -> list[float]:
    """Return what features gain on replicates of the model: their mean and two deviations more."""
    keys = [gain.key for gain in clear]
    effects = [find_effect(name) for name in sorted({name for name, _ in keys})]

    def ask(_number: int, other: Screen) -> list[float]:
        found = gains_of(_law(case, other), effects, kinds=set(keys))
        most: dict[tuple[str, str], float] = {}
        for gain in found:
            most[gain.key] = max(most.get(gain.key, 0.0), float(gain.log_p.sum()))
        return [most.get(key, 0.0) for key in keys]

    n_workers = case.question.n_workers
    rows = np.array(run_null(case.chain, ask, QUICK_REPLICATES, n_workers=n_workers))
    return list(np.maximum(rows.mean(axis=0) + 2.0 * rows.std(axis=0, ddof=1), 0.0))


def _in_the_model(case: Case, screen: Screen, name: str) -> tuple[Refit, Score]:
    """Return an effect in the model in that form which gains most, and its score there."""
    own = [each for each in case.listed if each.name == name]
    own += further_forms(find_effect(name), case.scene.arena)
    scores = ask_all(screen, own, case.question.n_workers)
    forms: dict[tuple[float, ...], Score] = {}
    for score in sorted(scores, key=lambda each: -abs(each.z)):
        forms.setdefault(_form(score.candidate), score)
    tried = list(forms.values())[:_FORMS]
    made = [refit(screen, score, n_workers=case.question.n_workers) for score in tried]
    k = int(np.argmax([each.worth for each in made]))
    return made[k], tried[k]


def _form(candidate: Candidate) -> tuple[float, ...]:
    """Return the shapes of a candidate that a fit leaves as they are."""
    return tuple(candidate.shape[key] for key in candidate.effect.fixed if key in candidate.shape)

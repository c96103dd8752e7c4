"""What looks by features have in common: what they found, and how it goes into the model."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cache
from typing import NamedTuple, TypeAlias

import numpy as np

from zfcal.arrays import Floats
from zfcal.diagnose.candidates import Candidate, both_sides, curved, further_forms
from zfcal.diagnose.case import QUICK_REPLICATES, Case
from zfcal.diagnose.features.false_gains import NO_NOISE, ByNoise, by_noise
from zfcal.diagnose.features.gains import Gain
from zfcal.diagnose.features.naming import Hidden, Noise, Told, lead_over, tell
from zfcal.diagnose.naming import SURE, Choice, Refit, by_sample, refit
from zfcal.diagnose.null import run_null
from zfcal.diagnose.scores import Score
from zfcal.diagnose.screening import Screen, ask_all
from zfcal.diagnose.selection import IN_REACH, LEAST_SHARE, LEVEL, Best, Step
from zfcal.diagnose.sides import feigned
from zfcal.diagnose.steadiness import Of
from zfcal.model.effects import Effect, find_effect
from zfcal.model.extended import maximise
from zfcal.model.kernels.curves import MORE, strengths_at_knots

BY_ITSELF = 4.0
"""Standard errors by which features of a name must lead those of all others where no form of ours
bears it out and something is left."""

_FORMS = 6
"""Forms of an effect, the clearest ones, that are put into the model to see which gains most; those
alone that are within reach of the clearest, if that one is clear at all."""


_FIRST_REPLICATES = 2
"""Replicates that are asked first: the others where these leave gains in doubt."""

_NO_DOUBT = 1e-9
"""Chance of a gain that no further replicate would put in doubt."""

_SMALL_SHARE = 0.05
"""Share of a gain up to which what noise makes of it need not be known better."""

_LARGE_SHARE = 0.25
"""Share of a gain that noise might make where the first replicates happen to gain little."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Found:
    """Effects that are missing, in the order of adding.

    ``nats`` is what the clearest of them on headings gains by features, whatever its form.
    ``without_noise`` where one explains what noise of positions had seemed to. ``suspicious`` where
    nothing is named though features gain what chance hardly gives: no form of ours bears out what
    they say.
    ``hidden`` are names that gain no more than noise of positions may make.
    """

    steps: tuple[Step, ...] = ()
    nats: float = 0.0
    without_noise: bool = False
    suspicious: bool = False
    hidden: tuple[Hidden, ...] = ()

    def screen(self, base: Screen) -> Screen:
        """Return the model with all of them; ``base`` is the one that was given."""
        return self.steps[-1].choice.best.screen if self.steps else base

    def and_further(self, further: Found) -> Found:
        """Return these and further ones; what is named in the end is not hidden."""
        steps = (*self.steps, *further.steps)
        named = {step.choice.best.name for step in steps}
        hidden = {each.name: each for each in (*self.hidden, *further.hidden)}
        return Found(
            steps=steps,
            nats=max(self.nats, further.nats),
            without_noise=self.without_noise or further.without_noise,
            suspicious=(self.suspicious or further.suspicious) and not steps,
            hidden=tuple(each for name, each in hidden.items() if name not in named),
        )


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


def clearest_first(steps: Sequence[Step]) -> list[int]:
    """Return the order in which effects are told: those of the law with the clearest one first.

    Within each law they stay in the order of adding, since each was asked beside those before it.
    """
    laws = [
        [n for n, step in enumerate(steps) if on_headings(step) is own] for own in (True, False)
    ]
    laws.sort(key=lambda law: -max((steps[n].choice.best.nats for n in law), default=0.0))
    return [n for law in laws for n in law]


def is_other_form(guess: Step | None, told: Told) -> bool:
    """Return whether what is beyond the list says in another form what features name."""
    said = (told, told.cause) if told.cause else (told,)
    names = [gain.name for each in said for gain in (each.gain, *each.ties)]
    forms = {form for name in names for form in find_effect(name).other_forms}
    return guess is not None and guess.choice.best.name in forms


def outdoes(guess: Step, log_p: Floats, nats: float, of: Of) -> bool:
    """Return whether an effect gains more than some features, by more than the error of it.

    Parameters
    ----------
    guess
        The effect.
    log_p : ndarray, shape (step,)
        Log density that the features add to each step.
    nats
        What they gain.
    of
        The recording, and the sample in which each step of the features begins.
    """
    by = by_sample(*of, log_p) - guess.choice.best.gain
    error = float(by.std()) * float(np.sqrt(len(by)))
    return float(guess.choice.best.nats - nats) > SURE * error


def not_yet_there(case: Case, beside: Sequence[Effect]) -> list[Effect]:
    """Return the listed effects that are looked for beside some that are there, by name."""
    known = {effect.name for effect in beside}
    return [find_effect(name) for name in sorted({each.name for each in case.listed} - known)]


class Beside(NamedTuple):
    """What the best feature of a name gains beside another one, and whether by more than chance."""

    nats: float
    stands: bool


Ask: TypeAlias = Callable[[Sequence[Effect], Effect], Sequence[Beside]]
"""Tells what features of each of some effects gain beside those of another."""


def beside_of(
    effects: Sequence[Effect], gains: Sequence[Gain], noise: Noise | None
) -> list[Beside]:
    """Return what each of some effects gains, of the gains of all of them beside another one."""
    made = []
    for effect in effects:
        own = [gain for gain in gains if gain.name == effect.name]
        nats = max((gain.nats for gain in own), default=0.0)
        made.append(Beside(nats=nats, stands=tell(own, noise) is not None))
    return made


def explained(told: Told, ask: Ask) -> Told:
    """Return a name with what explains it, and without ties that say nothing beside it.

    The best feature of a name is not all that it has: what fish do in the open and along walls are
    two features of one name, and the best of another may gain more than either. So where the
    features of a name, all together, leave next to nothing of the one that gains most, and that one
    leaves something of them, it is that name.

    Parameters
    ----------
    told
        The name that gains most, its ties, and others.
    ask
        Of all that may matter at the same time, beside the name that gains most; that one is asked
        beside each that is left.
    """
    own, least = find_effect(told.gain.name), LEAST_SHARE * told.gain.nats
    clear = [each for each in told.others if each.gain.nats > least]
    names = sorted({each.gain.name for each in clear} | {tie.name for tie in told.ties})
    left = dict(zip(names, ask([find_effect(name) for name in names], own), strict=True))

    @cache
    def own_beside(name: str) -> Beside:
        return ask([own], find_effect(name))[0]

    def explains(name: str) -> bool:
        if not left[name].stands:
            return False
        own_left = own_beside(name)
        return not own_left.stands and own_left.nats < least

    kept = [tie for tie in told.ties if left[tie.name].stands or not own_beside(tie.name).stands]
    cause = next((each for each in clear if explains(each.gain.name)), None)
    if cause is not None:
        cause = replace(cause, ties=_ties_of(cause, told.others, ask))
    return replace(told, ties=tuple(kept), cause=cause)


def _ties_of(cause: Told, others: Sequence[Told], ask: Ask) -> tuple[Gain, ...]:
    """Return which of some names tie with what explains the best one."""
    own = find_effect(cause.gain.name)
    near = [
        each.gain
        for each in others
        if each is not cause and lead_over(cause.gain, each.gain) <= SURE
    ]
    asked = [find_effect(gain.name) for gain in near]
    return tuple(
        gain
        for gain, effect, left in zip(near, asked, ask(asked, own), strict=True)
        if left.stands or not ask([own], effect)[0].stands
    )


def noise_of_features(
    case: Case, clear: Sequence[Gain], gains: Callable[[Screen, list[Effect]], Iterable[Gain]]
) -> list[ByNoise]:
    """Return what noise makes features gain, by replicates of the model.

    By two of them where that is enough: noise makes as much as each gain often, or each is sure.

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

    n_strengths, n_tried = [gain.n_strengths for gain in clear], [gain.n_tried for gain in clear]
    rows: list[list[float]] = []
    for numbers in (range(_FIRST_REPLICATES), range(_FIRST_REPLICATES, QUICK_REPLICATES)):
        rows += run_null(case.chain, ask, numbers, n_workers=case.question.n_workers)
        found = by_noise(np.array(rows), n_strengths, n_tried)
        held = [replace(gain, noise=own) for gain, own in zip(clear, found, strict=True)]
        if all(map(_may_be_noise, held)) or all(map(_is_no_noise, held)):
            break
    return found


def _may_be_noise(gain: Gain) -> bool:
    """Return whether noise makes as much often enough."""
    return gain.p > LEVEL


def _is_no_noise(gain: Gain) -> bool:
    """Return whether a gain is sure, and what noise makes of it matters little for its order.

    Noise that comes and goes may make much though two replicates gain little. So the chance is that
    beside a good share of the gain itself.
    """
    raw = float(gain.log_p.sum())
    by_two = math.sqrt(1 + 1 / _FIRST_REPLICATES)
    most = replace(gain, noise=ByNoise(mean_nats=_LARGE_SHARE * raw, stretch=by_two))
    return gain.noise.more(gain.n_strengths) <= _SMALL_SHARE * raw and most.p <= _NO_DOUBT


def as_step(case: Case, screen: Screen, told: Told) -> Step | None:
    """Return a name as an effect that is added to a model, in that form which gains most.

    None where no form of ours goes that way: a strength of 0 is no effect. A place that is a
    direction as well is put aside. A tie that the effect leads by enough, each in its form, is
    none.

    Parameters
    ----------
    case
        The question.
    screen
        The model without it.
    told
        The name and its ties.
    """
    made = {
        gain.name: in_the_model(case, screen, gain) for gain in (told.gain, *told.ties)
    }  # fmt: skip
    aside = {each.name for each in feigned([form for form, _ in made.values()], screen)}
    left = [pair for name, pair in made.items() if name not in aside]
    if not left:
        return None
    (best, score), *others = left
    own = best.candidate.effect.parameter(best.candidate.effect.strength)
    if not any(strengths_at_knots(best.values, own.name, (own.low, own.high))):
        return None
    ties = tuple(tie for tie, _ in others if not best.over(tie) > SURE)
    return Step(
        choice=Choice(best=best, ties=ties),
        best=Best(score=score, z=score.clearness, p=told.p, information=score.information),
        before=screen,
    )


def gains_by_itself(form: Refit, noise: ByNoise = NO_NOISE) -> bool:
    """Return whether the form that goes into the model gains more than chance by itself.

    What is no effect of the list answers to features of several names a little, and to none of
    their forms. On held-out steps a form is not asked: that would halve the power.

    Parameters
    ----------
    form
        In the model.
    noise
        What noise of positions alone makes it gain.
    """
    return noise.chance(float(form.gain.sum()), form.n_free) < LEVEL


def noise_of_form(case: Case, form: Refit) -> ByNoise:
    """Return what noise makes a form gain, by replicates of the model.

    A form is fitted by the law of the measured positions, which is not that of what was measured
    where these err: a response that is a little late gains a hundred nats from half a millimetre.

    Parameters
    ----------
    case
        The question, whose model makes the replicates.
    form
        As it would go into the model.
    """

    def ask(_number: int, other: Screen) -> list[float]:
        # A replicate's base was fitted a few rounds from the recording's: what is left of the way
        # would count as the form's.
        own = other.fitted
        fitted = maximise(other.scene, own.parameters, free=own.free, start=own.x)
        settled = Screen(scene=other.scene, fitted=fitted)
        return [float(refit(settled, settled.ask(form.candidate)).gain.sum())]

    n_workers = case.question.n_workers
    rows = run_null(case.chain, ask, range(QUICK_REPLICATES), n_workers=n_workers)
    return by_noise(np.array(rows), [form.n_free])[0]


def in_the_model(case: Case, screen: Screen, gain: Gain) -> tuple[Refit, Score]:
    """Return an effect in the model in that form which gains most, and its score there.

    Where its features gain more under circumstances than any form does, the best one is tried with
    a strength that goes by these as well.
    """
    own = [each for each in (*case.listed, *case.generic) if each.name == gain.name]
    own += further_forms(find_effect(gain.name), case.scene, gain.forms)
    asked = [side for each in own for side in both_sides(each)]
    scores = ask_all(screen, asked, case.question.n_workers)
    forms: dict[tuple[float, ...], Score] = {}
    for score in sorted(scores, key=lambda each: -each.clearness):
        forms.setdefault(form_of(score.candidate), score)
    tried = list(forms.values())[:_FORMS]
    if tried[0].clearness > SURE:
        least = IN_REACH * tried[0].clearness
        tried = [each for each in tried if each.clearness >= least]
    # Side by side: each by itself leaves workers idle between its steps.
    n_workers = case.question.n_workers
    with ThreadPoolExecutor(n_workers) as pool:
        each = max(1, n_workers // len(tried))
        made = list(pool.map(lambda score: refit(screen, score, n_workers=each), tried))
    k = int(np.argmax([each.worth for each in made]))
    by = curved(tried[k].candidate, gain.label, case.scene)
    # A curve that is worth it gains more than half a log of the samples for each parameter.
    least = 0.5 * len(MORE) * math.log(len(made[k].gain))
    if by is not None and gain.nats - made[k].nats > least:
        bent = replace(tried[k], candidate=by)
        other = refit(screen, bent, n_workers=n_workers)
        if other.worth > made[k].worth:
            return other, bent
    return made[k], tried[k]


def form_of(candidate: Candidate) -> tuple[float, ...]:
    """Return the shapes of a candidate that a fit leaves as they are."""
    return tuple(candidate.shape[key] for key in candidate.effect.fixed if key in candidate.shape)

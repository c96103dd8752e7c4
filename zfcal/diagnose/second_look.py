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
from functools import cached_property

from zfcal.arrays import Floats
from zfcal.diagnose.candidates import in_model
from zfcal.diagnose.case import Case, can_suspect, has_noise, noise_of
from zfcal.diagnose.confirming import Confirmed
from zfcal.diagnose.features.asking import fits_beside, gains_of
from zfcal.diagnose.features.curves import curve_of
from zfcal.diagnose.features.gains import Gain
from zfcal.diagnose.features.law import Law
from zfcal.diagnose.features.naming import Noise, Told, tell, without_names
from zfcal.diagnose.findings import FeatureCurve
from zfcal.diagnose.heldout import heading_gains
from zfcal.diagnose.looks import (
    BY_ITSELF,
    Found,
    form_of,
    gains_by_itself,
    held_out,
    in_all_minutes,
    in_all_phases,
    in_the_model,
    level_of,
    not_yet_there,
    on_headings,
    replicate_nats,
    stays,
    with_again,
    with_further,
    without_idle_ties,
)
from zfcal.diagnose.naming import SURE, Choice
from zfcal.diagnose.screening import Screen
from zfcal.diagnose.selection import (
    GENERIC_SHARE,
    LEAST_SHARE,
    MOST_EFFECTS,
    Step,
)
from zfcal.diagnose.sides import feigned
from zfcal.diagnose.speed_look import speed_look
from zfcal.model.effects import Effect, find_effect


def look_again(case: Case, before: Found) -> Found | None:
    """Return what is missing once features of speeds were asked, and then those of headings.

    Parameters
    ----------
    case, before
        As of `second_look`.
    """
    paced = speed_look(case, before)
    return second_look(case, paced or before) or paced


def second_look(case: Case, before: Found) -> Found | None:
    """Return what is missing once features were asked; None where nothing is to be changed.

    Where nothing was named, and features gain more than chance though no form of ours bears them
    out, what is found is nothing that has a name: see `Found.suspicious`.

    Parameters
    ----------
    case
        The question, its scene and what is asked for.
    before
        What was named without features. Of effects on headings the first is held against them:
        one beyond the list is kept where it gains more than features do, a listed one where it
        gains as much. Where it is not kept, what was added after it goes as well; effects on speed
        are then added anew.
    """
    given = [each.effect for each in in_model(case.screen.fitted.parameters)]
    known = [effect for effect in given if not effect.on_speed]
    n = next((k for k, step in enumerate(before.steps) if on_headings(step)), len(before.steps))
    there = before.steps[n] if n < len(before.steps) else None
    screen = before.steps[n - 1].choice.best.screen if n else case.screen
    has_later = any(on_headings(step) for step in before.steps[n + 1 :])
    looks = _Looks(case=case, screen=screen, beside=tuple(known), has_later=has_later)
    first = _named(looks, there=there)
    if first is not None and first.suspicious:
        if not before.steps and can_suspect(case.question):
            return first
        first = None
    found = before if first is None else with_further(before, n, first)
    if first is not None:
        later = zip(before.steps[n:], before.confirmed[n:], strict=False)
        on_speeds = [pair for pair in later if not on_headings(pair[0])]
        found = with_again(case, found, on_speeds)
    while True:
        named = [step for step in found.steps if on_headings(step)]
        if not named or len(named) >= MOST_EFFECTS:
            break
        looks = _Looks(
            case=case,
            screen=found.steps[-1].choice.best.screen,
            beside=(*known, *(step.choice.best.candidate.effect for step in named)),
            without_noise=found.without_noise,
            number=len(named),
        )
        most = max(found.nats, *(step.choice.best.nats for step in named))
        # One beyond the list has no features: its own form is a guess.
        is_guess = any(step.choice.best.is_generic for step in named)
        share = GENERIC_SHARE if is_guess else LEAST_SHARE
        further = _named(looks, least=share * most)
        if further is None or further.suspicious:
            break
        found = with_further(found, len(found.steps), further)
    return None if found is before else found


def _named(looks: _Looks, *, there: Step | None = None, least: float = 0.0) -> Found | None:
    """Return what features name in a model, and what it gains on held-out steps.

    Parameters
    ----------
    looks
        At the model.
    there
        What is held against features.
    least
        Nats that it has to gain.
    """
    case, screen, told = looks.case, looks.screen, looks.tell()
    if told is None or told.gain.nats < least:
        return None
    law = looks.laws[0]
    if there is not None:
        was = there.choice.best
        if was.name in {told.gain.name, *(tie.name for tie in told.ties)}:
            return _in_better_form(looks, there, told)
        if stays(was, told, law.scene, law.turns.at):
            return None
    found, score = in_the_model(case, screen, told.gain.name)
    nothing = Found(steps=(), confirmed=(), nats=told.gain.nats, suspicious=True)
    step, confirmed = held_out(case, screen, told, (found, score))
    aside = {each.name for each in feigned([found, *step.choice.ties], screen)}
    if aside:
        told = without_names(told, aside)
        found, score = in_the_model(case, screen, told.gain.name)
        step, confirmed = held_out(case, screen, told, (found, score))
    if found.values[found.candidate.effect.strength] == 0.0:
        # No form of ours goes that way: it is another effect, which the list does not have.
        return nothing
    is_borne_out = gains_by_itself(found) and _is_steady(confirmed, found.screen, screen)
    if not (is_borne_out or told.lead > BY_ITSELF or looks.explains(told)):
        return nothing
    return Found(
        steps=(step,),
        confirmed=(confirmed,),
        nats=told.gain.nats,
        without_noise=told.gain.without_noise,
    )


def _in_better_form(looks: _Looks, there: Step, told: Told) -> Found | None:
    """Return what was named, and what features name or cannot tell from it, in the form it has.

    None where it has that form already. What it leads by enough in this form is no tie any more.
    """
    if looks.has_later:
        return None
    case, screen, was = looks.case, looks.screen, there.choice.best
    made = in_the_model(case, screen, was.name)
    is_new = form_of(made[0].candidate) != form_of(was.candidate)
    if not (is_new and made[0].worth > was.worth):
        return None
    names = [told.gain, *told.ties]
    own = next(gain for gain in names if gain.name == was.name)
    ties = tuple(gain for gain in names if gain is not own)
    step, confirmed = held_out(case, screen, dataclasses.replace(told, gain=own, ties=ties), made)
    left = tuple(tie for tie in step.choice.ties if not made[0].over(tie) > SURE)
    choice = Choice(best=made[0], ties=left, considered=step.choice.considered)
    return Found(
        steps=(dataclasses.replace(step, choice=choice),),
        confirmed=(confirmed,),
        nats=own.nats,
        without_noise=own.without_noise,
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class _Looks:
    """What features say of a model.

    Parameters
    ----------
    case
        The question.
    screen
        The model.
    beside
        Effects on headings that are there: whatever form they have, what they explain is not
        named.
    without_noise
        Whether what seemed to be noise is explained.
    has_later
        Whether more on headings was named after what is held against features: that was
        confirmed beside the form that it has.
    number
        How many looks there were before.
    """

    case: Case
    screen: Screen
    beside: tuple[Effect, ...]
    without_noise: bool = False
    has_later: bool = False
    number: int = 0

    @cached_property
    def laws(self) -> tuple[Law, ...]:
        """The law of noisy positions; that of exact ones as well where noise is only likely.

        What a late response does to headings is likelier with noise than without, so noise is
        fitted with each effect: it may be none.
        """
        is_noisy = has_noise(self.case.question) and not self.without_noise
        noise_m = noise_of(self.case.question) if is_noisy else 0.0
        levels = (noise_m, 0.0) if noise_m and self.case.noise_is_likely else (noise_m,)
        return tuple(_law(self.case, self.screen, level) for level in levels)

    def gains(self, effects: Sequence[Effect], beside: Sequence[Effect]) -> list[Gain]:
        """Return what features of effects gain."""
        n_workers = self.case.question.n_workers
        noisy, *exact = self.laws
        if not exact:
            return gains_of(noisy, effects, beside=beside, n_workers=n_workers)
        nulls = [self._null(noisy, beside), fits_beside(exact[0], beside).null_log_p]
        if nulls[1].sum() > nulls[0].sum():  # What is there explains what noise had seemed to.
            return gains_of(exact[0], effects, beside=beside, n_workers=n_workers)
        found = gains_of(noisy, effects, beside=beside, n_workers=n_workers)
        found += gains_of(exact[0], effects, beside=beside, beyond=nulls[0], n_workers=n_workers)
        return found

    @staticmethod
    def _null(noisy: Law, beside: Sequence[Effect]) -> Floats:
        """Return log densities by the law of noisy positions, as of many draws (Richardson)."""
        half = dataclasses.replace(noisy, n_draws=noisy.n_draws // 2)
        all_, some = (fits_beside(law, beside).null_log_p for law in (noisy, half))
        return 2 * all_ - some

    def tell(self) -> Told | None:
        """Return which name it is; None where chance may have made all gains."""
        gains = self.gains(self._asked, self.beside)
        told = tell(gains, self._noise(self.beside), level=level_of(self.number))
        return None if told is None else without_idle_ties(told, self._stands)

    def explains(self, told: Told) -> bool:
        """Return whether, with a name's features there, no other name gains more than chance.

        What is no effect of the list answers to features of several names.
        """
        others = [effect for effect in self._asked if effect.name != told.gain.name]
        beside = (*self.beside, find_effect(told.gain.name))
        return tell(self.gains(others, beside), self._noise(beside)) is None

    @cached_property
    def _asked(self) -> list[Effect]:
        """Effects that are looked for."""
        return not_yet_there(self.case, self.beside)

    def _stands(self, effect: Effect, beside: Effect) -> bool:
        """Return whether features of an effect gain more than chance beside those of another."""
        both = (*self.beside, beside)
        return tell(self.gains([effect], both), self._noise(both)) is not None

    def _noise(self, beside: tuple[Effect, ...]) -> Noise | None:
        """Return what tells how much of a gain beside some effects noise of positions makes."""
        if not self.laws[0].noise_m > 0:
            return None
        return lambda clear: _noise_nats(self.case, clear, beside)


def curves_of(
    case: Case, steps: Sequence[Step], *, without_noise: bool
) -> list[FeatureCurve | None]:
    """Return what features say of each effect that was named; None for those without features.

    Parameters
    ----------
    case
        The question.
    steps
        What was named.
    without_noise
        Whether what seemed to be noise is explained by it.
    """
    is_noisy = has_noise(case.question) and not without_noise
    noise_m = noise_of(case.question) if is_noisy else 0.0
    given = [each.effect for each in in_model(case.screen.fitted.parameters)]
    known = [effect for effect in given if not effect.on_speed]
    made: list[FeatureCurve | None] = []
    for step in steps:
        best = step.choice.best
        effect = best.candidate.effect
        if not on_headings(step) or not effect.features(case.question.arena):
            made.append(None)
            continue
        law = _law(case, step.before, noise_m)
        made.append(curve_of(law, effect, best.screen, nats=best.nats, beside=known))
        known.append(effect)
    return made


def _is_steady(confirmed: Confirmed, model: Screen, base: Screen) -> bool:
    """Return whether an effect is there in all minutes, and not in pulses at regular times.

    Its scores say so, or what it gains at each step less what it would gain if the fish drew from
    the model all the time: that has mean zero in each minute, and no period. Neither is normal
    where few moments ask for an effect: scores where they are far apart, gains where they are rare.
    """
    gains, scene = heading_gains(model, base), base.scene
    at, apart = gains.gain.at, gains.gain.values - gains.expected.values
    if not (confirmed.in_all_minutes or in_all_minutes(apart, at, scene)):
        return False
    return not confirmed.pulsed or in_all_phases(apart, at, scene)


def _law(case: Case, screen: Screen, noise_m: float) -> Law:
    return Law(scene=screen.scene, fitted=screen.fitted, noise_m=noise_m, seed=case.question.seed)


def _noise_nats(case: Case, clear: Sequence[Gain], beside: Sequence[Effect] = ()) -> list[float]:
    """Return what features may gain on one more replicate of the model: a bound by Student's t.

    Of all features that are asked one exceeds its bound by chance in 2 % of cases (Bonferroni).
    The model is that without the effects that were found; their features are fitted as well.
    """
    keys = {gain.key for gain in clear}

    def gains(other: Screen, effects: list[Effect]) -> list[Gain]:
        law = _law(case, other, noise_of(case.question))
        return gains_of(law, effects, kinds=keys, beside=beside)

    return replicate_nats(case, clear, gains)

"""A look at headings, by features: which listed effects their law lacks.

Each name's features are asked, whatever form fish have the effect in. The name that is told goes
into the model in that form of ours which gains most, and all others are asked again beside it. An
effect beyond the list is added first where it gains clearly more than features of any listed one.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial

from zfcal.arrays import Floats
from zfcal.diagnose.adding import further
from zfcal.diagnose.beyond import Unfeatured
from zfcal.diagnose.candidates import in_model
from zfcal.diagnose.case import Case, can_suspect, has_noise, noise_of
from zfcal.diagnose.features.asking import fits_beside, gains_of
from zfcal.diagnose.features.curves import curve_of
from zfcal.diagnose.features.false_gains import NO_NOISE, ByNoise
from zfcal.diagnose.features.gains import Gain, Idle, idle_of
from zfcal.diagnose.features.law import Law
from zfcal.diagnose.features.naming import Answer, Noise, Told, answer, tell
from zfcal.diagnose.findings import FeatureCurve
from zfcal.diagnose.heldout import heading_gains
from zfcal.diagnose.looks import (
    BY_ITSELF,
    Beside,
    Found,
    as_step,
    beside_of,
    explained,
    gains_by_itself,
    is_other_form,
    level_of,
    noise_of_features,
    noise_of_form,
    not_yet_there,
    on_headings,
    outdoes,
)
from zfcal.diagnose.naming import SURE
from zfcal.diagnose.screening import Screen
from zfcal.diagnose.selection import MOST_EFFECTS, Step
from zfcal.diagnose.steadiness import MINUTES_S, Course, Of, has_pulses, is_steady
from zfcal.model.effects import Effect, find_effect

_KEPT = 2
"""Laws of exact positions that are kept: each holds hundreds of megabytes of half an hour."""


def heading_look(case: Case, before: Found, unfeatured: Unfeatured) -> Found:
    """Return what is missing once headings were asked for what their law lacks.

    Where nothing is named though features gain what chance hardly gives, what is found is nothing
    that has a name: see `Found.suspicious`.

    Parameters
    ----------
    case
        The question, its scene and what is asked for.
    before
        What is missing of the law of speeds.
    unfeatured
        What has no features.
    """
    given = [each.effect for each in in_model(case.screen.fitted.parameters)]
    known = [effect for effect in given if not effect.on_speed]
    found, idle = before, frozenset[Idle]()
    while True:
        named = [step.choice.best for step in found.steps[len(before.steps) :]]
        if len(named) >= MOST_EFFECTS:
            return found
        there = [step.choice.best.candidate.effect for step in found.steps if on_headings(step)]
        looks = _Looks(
            case=case,
            screen=found.screen(case.screen),
            beside=(*known, *there),
            without_noise=found.without_noise,
            number=len(named),
            idle=idle,
        )
        added = further(looks, unfeatured, named, found.nats)
        found = found.and_further(added)
        if not added.steps:
            return found
        idle = idle if named else looks.promising_nothing


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
    number
        How many looks there were before.
    idle
        Features that promised nothing in the first one. They count as tried, and are not looked at
        again: what an effect adds to a model hardly ever makes them promise something.
    """

    case: Case
    screen: Screen
    beside: tuple[Effect, ...]
    without_noise: bool = False
    number: int = 0
    idle: frozenset[Idle] = frozenset()

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

    def gains(
        self, effects: Sequence[Effect], beside: Sequence[Effect], idle: frozenset[Idle]
    ) -> list[Gain]:
        """Return what features of effects gain, but for those that are known to promise nothing."""
        ask = partial(
            gains_of, effects=effects, beside=beside, idle=idle,
            n_workers=self.case.question.n_workers,
        )  # fmt: skip
        noisy, *exact = self.laws
        if not exact:
            return ask(noisy)
        nulls = [self._null(noisy, beside), fits_beside(exact[0], beside).null_log_p]
        if nulls[1].sum() > nulls[0].sum():  # What is there explains what noise had seemed to.
            return ask(exact[0])
        return ask(noisy) + ask(exact[0], beyond=nulls[0])

    @staticmethod
    def _null(noisy: Law, beside: Sequence[Effect]) -> Floats:
        """Return log densities by the law of noisy positions, as of many draws (Richardson)."""
        half = dataclasses.replace(noisy, n_draws=noisy.n_draws // 2)
        all_, some = (fits_beside(law, beside).null_log_p for law in (noisy, half))
        return 2 * all_ - some

    @property
    def on_speed(self) -> bool:
        """It is at headings."""
        return False

    @property
    def has_features(self) -> bool:
        """Headings have a law in any recording."""
        return True

    @property
    def may_doubt(self) -> bool:
        """Whether what no form bears out is something: of noisy positions ranks are uneven."""
        return can_suspect(self.case.question)

    @property
    def of(self) -> Of:
        """The recording, and the sample in which each step begins."""
        law = self.laws[0]
        return law.scene, law.turns.at

    def borne_out(self, told: Told, guess: Step | None) -> Step | None:
        """Return what features name as an effect in the model; None where nothing bears it out.

        Its form does, or an effect beyond the list that says the same in another form. Of two names
        that tie both are there where each gains more than chance beside the other: then the second
        may be borne out where the first is not yet.
        """
        step = as_step(self.case, self.screen, told)
        if step is None:
            return None
        if self._has_form(step, told, guess):
            return step
        if told.lead > BY_ITSELF or self.explains(told):
            return step
        first = find_effect(told.gain.name)
        for tie in told.ties:
            other, alone = find_effect(tie.name), dataclasses.replace(told, gain=tie, ties=())
            if self._stands(other, first) and self._stands(first, other):
                step = as_step(self.case, self.screen, alone)
                if step is not None and self._has_form(step, alone, guess):
                    return step
        return None

    def _has_form(self, step: Step, told: Told, guess: Step | None) -> bool:
        """Return whether a form bears a name out, and it is there all the time."""
        form = step.choice.best
        is_noisy = self.laws[0].noise_m > 0 and not told.gain.without_noise
        noise = noise_of_form(self.case, form) if is_noisy else NO_NOISE
        has_form = gains_by_itself(form, noise) or is_other_form(guess, told)
        return has_form and _is_steady(step)

    def not_left_over(self, guess: Step | None) -> Step | None:
        """Return an effect beyond the list, unless what is there leaves it over.

        What is there may have another form than in the model: its features, either way, then gain
        as much as the effect does.
        """
        if guess is None or not self.beside:
            return guess
        law = self.laws[0]
        fits = fits_beside(law, self.beside)
        left = fits.null_log_p - fits_beside(law, ()).null_log_p
        nats = float(left.sum()) - fits.n_beside
        return guess if outdoes(guess, left, nats, self.of) else None

    def ask(self) -> Answer:
        """Return which name it is, and which ones noise hides."""
        return self._said[0]

    def explained(self, told: Told) -> Told:
        """Return a name with what explains it, and without ties that say nothing beside it."""
        return explained(told, self._beside)

    @cached_property
    def _said(self) -> tuple[Answer, frozenset[Idle]]:
        gains = self.gains(self._asked, self.beside, self.idle)
        noise = self._noise(self.beside)
        return answer(gains, noise, level=level_of(self.number)), idle_of(gains)

    @property
    def promising_nothing(self) -> frozenset[Idle]:
        """Features that were not worth a fit."""
        return self._said[1]

    def explains(self, told: Told) -> bool:
        """Return whether, with a name's features there, no other name gains more than chance.

        What is no effect of the list answers to features of several names. So the name leads all
        others besides, by more than the error of the difference.
        """
        if not told.lead > SURE:
            return False
        others = [effect for effect in self._asked if effect.name != told.gain.name]
        beside = (*self.beside, find_effect(told.gain.name))
        return tell(self.gains(others, beside, self.idle), self._noise(beside)) is None

    @cached_property
    def _asked(self) -> list[Effect]:
        """Effects that are looked for."""
        return not_yet_there(self.case, self.beside)

    def _stands(self, effect: Effect, other: Effect) -> bool:
        return self._beside([effect], other)[0].stands

    def _beside(self, effects: Sequence[Effect], other: Effect) -> list[Beside]:
        """Return what features of each of some effects gain beside those of another."""
        both = (*self.beside, other)
        gains = self.gains(effects, both, self.idle) if effects else []
        return beside_of(effects, gains, self._noise(both))

    def _noise(self, beside: tuple[Effect, ...]) -> Noise | None:
        """Return what tells how much of a gain beside some effects noise of positions makes."""
        if not self.laws[0].noise_m > 0:
            return None
        return lambda clear: _noise_of(self.case, clear, beside)


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


def _is_steady(step: Step) -> bool:
    """Return whether an effect is there in all minutes, and not in pulses at regular times.

    Its scores say so, or what it gains at each step beside what it would gain if the fish drew from
    the model all the time. Neither is normal where few moments ask for an effect: scores where they
    are far apart, gains where they are rare.
    """
    score, base = step.best.score, step.before
    gains, scene = heading_gains(step.choice.best.screen, base), base.scene
    expected = gains.expected.values
    own = Course(apart=gains.gain.values - expected, expected=expected, of=(scene, gains.gain.at))
    in_time = is_steady(score, scene, MINUTES_S) or own.in_all_minutes
    return in_time and (not has_pulses(score, scene) or own.in_all_phases)


def _law(case: Case, screen: Screen, noise_m: float) -> Law:
    """Return the law of a model; of exact positions the same one again for who asks again.

    So many are kept that the curve of one effect finds the law that named it. That of noisy ones
    has many draws, which would fill the memory.
    """
    if noise_m > 0:
        return _new_law(case, screen, noise_m)
    if screen not in case.laws:
        if len(case.laws) >= _KEPT:
            case.laws.pop(next(iter(case.laws)))
        case.laws[screen] = _new_law(case, screen, noise_m)
    return case.laws[screen]


def _new_law(case: Case, screen: Screen, noise_m: float) -> Law:
    return Law(scene=screen.scene, fitted=screen.fitted, noise_m=noise_m, seed=case.question.seed)


def _noise_of(case: Case, clear: Sequence[Gain], beside: Sequence[Effect]) -> list[ByNoise]:
    """Return what noise makes features gain: see `noise_of_features`.

    The model is that without the effects that were found; their features are fitted as well.
    """
    keys = {gain.key for gain in clear}

    def gains(other: Screen, effects: list[Effect]) -> list[Gain]:
        law = _new_law(case, other, noise_of(case.question))
        return gains_of(law, effects, kinds=keys, beside=beside)

    return noise_of_features(case, clear, gains)

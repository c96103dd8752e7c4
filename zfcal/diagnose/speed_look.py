"""A look at speeds, by features: which listed effects their law lacks.

As the look at headings: each name's features are asked what the law of speeds lacks. What features
name is there in all minutes, and not in pulses.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cached_property

from zfcal.diagnose.adding import further
from zfcal.diagnose.beyond import Unfeatured
from zfcal.diagnose.candidates import in_model
from zfcal.diagnose.case import Case, has_noise
from zfcal.diagnose.features.false_gains import ByNoise
from zfcal.diagnose.features.gains import Gain
from zfcal.diagnose.features.naming import Answer, Noise, Told, answer, tell
from zfcal.diagnose.features.paces import Paces, pace_gains
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
    not_yet_there,
    outdoes,
)
from zfcal.diagnose.naming import SURE
from zfcal.diagnose.screening import Screen
from zfcal.diagnose.selection import MOST_EFFECTS, Step
from zfcal.diagnose.steadiness import Of
from zfcal.model.effects import Effect, find_effect


def speed_look(case: Case, unfeatured: Unfeatured, without: Collection[str] = ()) -> Found:
    """Return what is missing once speeds were asked for what their law lacks.

    Parameters
    ----------
    case
        The question, its scene and what is asked for.
    unfeatured
        What has no features.
    without
        Names that are not asked, since something else explains them; then nothing beyond the list
        is asked either.
    """
    given = tuple(each.effect for each in in_model(case.screen.fitted.parameters))
    found = Found()
    while len(found.steps) < MOST_EFFECTS:
        there = [step.choice.best for step in found.steps]
        looks = _Looks(
            case=case,
            screen=found.screen(case.screen),
            beside=(*given, *(each.candidate.effect for each in there)),
            without=tuple(without),
            number=len(there),
        )
        added = further(looks, unfeatured, there)
        found = found.and_further(dataclasses.replace(added, nats=0.0))
        if not added.steps:
            break
    return found


def gone_given(found: Found, screen: Screen, given: Sequence[Effect]) -> list[str]:
    """Return the names of a look that speeds show no more once the turn is given.

    The law draws the speed first, and the turn from it and from what is near. So given the turn a
    speed depends on what is near in a law that has no such effect: what is shown then is no reason
    to name anything. But where fish have the turn first, what their speeds show of others is gone.

    Parameters
    ----------
    found
        By a look at speeds.
    screen
        The model that was given.
    given
        Effects by which headings depend on the speed.
    """
    gone, there = [], [each.effect for each in in_model(screen.fitted.parameters)]
    for step in found.steps:
        effect = step.choice.best.candidate.effect
        beside, model = tuple(there), step.before
        paces = [Paces(screen=model, beside=beside, given=own) for own in ((), tuple(given))]
        alone, with_turn = (tell(pace_gains(each, [effect])) for each in paces)
        if alone is not None and with_turn is None:
            gone.append(effect.name)
        there.append(effect)
    return gone


@dataclass(frozen=True, kw_only=True, eq=False)
class _Looks:
    """What features say of a model's speeds.

    Parameters
    ----------
    case
        The question.
    screen
        The model.
    beside
        Effects that are there: whatever form they have, what they explain is not named.
    number
        How many looks there were before.
    without
        Names that are not asked.
    """

    case: Case
    screen: Screen
    beside: tuple[Effect, ...]
    number: int = 0
    without: tuple[str, ...] = ()

    @cached_property
    def paces(self) -> Paces:
        """Fits of features."""
        return Paces(screen=self.screen, beside=self.beside)

    @property
    def on_speed(self) -> bool:
        """It is at speeds."""
        return True

    @property
    def has_features(self) -> bool:
        """Whether speeds of this recording have a law."""
        return self.paces.has_law

    @property
    def may_doubt(self) -> bool:
        """What noise makes of speeds was taken off."""
        return True

    @property
    def of(self) -> Of:
        """The recording, and the sample in which each move begins."""
        return self.paces.scene, self.paces.turns.at

    def borne_out(self, told: Told, guess: Step | None) -> Step | None:
        """Return what features name as an effect in the model; None where nothing bears it out.

        Its form does, or an effect beyond the list that says the same in another form; and it is
        there all the time.
        """
        course = self.paces.course(told.gain)
        if not (course.in_all_minutes and course.in_all_phases):
            return None
        step = as_step(self.case, self.screen, told)
        if step is None or gains_by_itself(step.choice.best) or is_other_form(guess, told):
            return step
        return step if told.lead > BY_ITSELF or self._explains(told) else None

    def not_left_over(self, guess: Step | None) -> Step | None:
        """Return an effect beyond the list, unless features of what is there gain as much.

        None where some names are not asked: what explains these is not held against it.
        """
        if self.without:
            return None
        if guess is None or not self.beside or not self.paces.has_law:
            return guess
        left, n = self.paces.gained_beside
        return guess if outdoes(guess, left, float(left.sum()) - n, self.of) else None

    def ask(self) -> Answer:
        """Return which name it is, and which ones noise hides."""
        n_workers = self.case.question.n_workers
        gains = pace_gains(self.paces, self._asked(self.beside), n_workers=n_workers)
        return answer(gains, self._noise(self.beside), level=level_of(self.number))

    def explained(self, told: Told) -> Told:
        """Return a name with what explains it, and without ties that say nothing beside it."""
        return explained(told, self._beside)

    def _explains(self, told: Told) -> bool:
        """Return whether a name leads, and no other one gains more than chance beside it."""
        if not told.lead > SURE:
            return False
        own = find_effect(told.gain.name)
        gains = pace_gains(self.paces.and_beside(own), self._asked((*self.beside, own)))
        return tell(gains, self._noise((*self.beside, own))) is None

    def _asked(self, beside: Sequence[Effect]) -> list[Effect]:
        return [each for each in not_yet_there(self.case, beside) if each.name not in self.without]

    def _beside(self, effects: Sequence[Effect], other: Effect) -> list[Beside]:
        """Return what features of each of some effects gain beside those of another."""
        gains = pace_gains(self.paces.and_beside(other), effects) if effects else []
        return beside_of(effects, gains, self._noise((*self.beside, other)))

    def _noise(self, beside: tuple[Effect, ...]) -> Noise | None:
        """Return what tells how much of a gain beside some effects noise of positions makes."""
        if not has_noise(self.case.question):
            return None

        def noise(clear: Sequence[Gain]) -> list[ByNoise]:
            def gains(other: Screen, effects: list[Effect]) -> list[Gain]:
                return pace_gains(Paces(screen=other, beside=beside), effects)

            return noise_of_features(self.case, clear, gains)

        return noise

"""A look at speeds, by features: names what no form of the listed effects shows.

As the second look at headings: each name's features are asked what the law of speeds lacks. What
was named before stays, unless it is beyond the list and features of a listed name gain as much. An
effect on speed that features name is there in all minutes, and not in pulses.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from zfcal.diagnose.candidates import in_model
from zfcal.diagnose.case import Case, has_noise
from zfcal.diagnose.features.gains import Gain
from zfcal.diagnose.features.naming import Told, tell
from zfcal.diagnose.features.paces import Paces, pace_gains
from zfcal.diagnose.looks import (
    BY_ITSELF,
    Found,
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
from zfcal.diagnose.screening import Screen
from zfcal.diagnose.selection import LEAST_SHARE, MOST_EFFECTS, Step
from zfcal.model.effects import Effect


def speed_look(case: Case, before: Found) -> Found | None:
    """Return what is missing once features of speeds were asked; None where nothing changes.

    Parameters
    ----------
    case
        The question, its scene and what is asked for.
    before
        What was named without features.
    """
    found = before
    n = next((k for k, each in enumerate(before.steps) if _is_doubted(each)), None)
    if n is not None:
        base = before.steps[n - 1].choice.best.screen if n else case.screen
        earlier = [each.choice.best.candidate.effect for each in before.steps[:n]]
        looks = _Looks(case=case, screen=base, beside=(*_given(case), *earlier))
        first = _named(looks, there=before.steps[n])
        if first is not None:
            found = with_further(before, n, first)
            later = zip(before.steps[n + 1 :], before.confirmed[n + 1 :], strict=True)
            found = with_again(case, found, later)
    while True:
        named = [each.choice.best for each in found.steps if not on_headings(each)]
        if len(named) >= MOST_EFFECTS:
            break
        there = [each.choice.best.candidate.effect for each in found.steps]
        screen = found.steps[-1].choice.best.screen if found.steps else case.screen
        least = LEAST_SHARE * max((best.nats for best in named), default=0.0)
        looks = _Looks(case=case, screen=screen, beside=(*_given(case), *there), number=len(named))
        further = _named(looks, least=least)
        if further is None:
            break
        found = with_further(found, len(found.steps), further)
    return None if found is before else found


def _is_doubted(step: Step) -> bool:
    """Return whether it is an effect on speed beyond the list: a listed one stays."""
    return not on_headings(step) and step.choice.best.is_generic


def _given(case: Case) -> tuple[Effect, ...]:
    """Return the effects that the model came with."""
    return tuple(each.effect for each in in_model(case.screen.fitted.parameters))


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
    """

    case: Case
    screen: Screen
    beside: tuple[Effect, ...]
    number: int = 0

    @cached_property
    def paces(self) -> Paces:
        """Fits of features."""
        return Paces(screen=self.screen, beside=self.beside)

    def tell(self) -> Told | None:
        """Return which name it is; None where chance may have made all gains."""
        noise = self._noise_nats if has_noise(self.case.question) else None
        gains = pace_gains(self.paces, not_yet_there(self.case, self.beside))
        told = tell(gains, noise, level=level_of(self.number))
        return None if told is None else without_idle_ties(told, self._stands)

    def _stands(self, effect: Effect, beside: Effect) -> bool:
        return tell(pace_gains(self.paces.and_beside(beside), [effect])) is not None

    def _noise_nats(self, clear: Sequence[Gain]) -> list[float]:
        """Return what features may gain on one more replicate of the model, at most."""

        def gains(other: Screen, effects: list[Effect]) -> list[Gain]:
            return pace_gains(Paces(screen=other, beside=self.beside), effects)

        return replicate_nats(self.case, clear, gains)


def _named(looks: _Looks, *, there: Step | None = None, least: float = 0.0) -> Found | None:
    """Return what features name in a model, and what it gains on held-out steps.

    Parameters
    ----------
    looks
        At the model.
    there
        What was named there, beyond the list: see `stays`.
    least
        Nats that it has to gain.
    """
    case, screen, told = looks.case, looks.screen, looks.tell()
    if told is None or told.gain.nats < least:
        return None
    paces = looks.paces
    if there is not None and stays(there.choice.best, told, paces.scene, paces.turns.at):
        return None
    apart, at = paces.apart(told.gain), paces.turns.at
    if not (in_all_minutes(apart, at, paces.scene) and in_all_phases(apart, at, paces.scene)):
        return None
    found, score = in_the_model(case, screen, told.gain.name)
    if not (gains_by_itself(found) or told.lead > BY_ITSELF):
        return None
    step, confirmed = held_out(case, screen, told, (found, score))
    return Found(steps=(step,), confirmed=(confirmed,), nats=told.gain.nats)

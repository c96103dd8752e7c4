"""What has no features: fish that rest, effects whose files name none, and those beyond the list.

They are asked by their scores, put into the model, and held against held-out minutes. One beyond
the list names no mechanism: features of listed effects have to explain clearly less than it does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from zfcal.arena import Arena
from zfcal.arrays import Floats
from zfcal.diagnose.candidates import Candidate, not_forms_of
from zfcal.diagnose.case import QUICK_REPLICATES, Case, has_noise
from zfcal.diagnose.confirming import holds
from zfcal.diagnose.naming import SURE, Choice, Refit, refit
from zfcal.diagnose.null import from_replicates, run_null, theory
from zfcal.diagnose.screening import Screen, ask_all
from zfcal.diagnose.selection import IN_REACH, LEAST_NATS, LEVEL, Asked, Best, Step, best_of
from zfcal.diagnose.steadiness import MINUTES_S, has_pulses, is_steady
from zfcal.model.effects import Effect

_RIVALS = 3
"""Effects that are put into the model, the clearest ones."""

_CLEAR_Z = 6.0
"""An effect beyond the list is named on clearer evidence than a listed one."""

_REPLICATES = 8


def is_featured(effect: Effect, arena: Arena) -> bool:
    """Return whether features say what an effect means, for headings or for speeds."""
    return bool(effect.features(arena) or effect.paces)


@dataclass(frozen=True, kw_only=True, eq=False)
class Unfeatured:
    """What scores ask for that has no features.

    Parameters
    ----------
    case
        The question.
    listed
        The family of all listed effects.
    screened
        These in the model that was given, the clearest first.
    suspicious
        Whether something is to be explained even if no listed effect stands out.
    """

    case: Case
    listed: Asked
    screened: tuple[Best, ...]
    suspicious: bool

    @property
    def stands_out(self) -> bool:
        """Whether a listed effect does, by its score."""
        return any(best.p < LEVEL for best in self.screened)

    def listed_one(
        self, screen: Screen, *, on_speed: bool, least: float = 0.0, has_features: bool = True
    ) -> Step | None:
        """Return the listed effect without features that a model lacks; None where none stands out.

        It is there in all minutes, and not in pulses. Its p-value is that of all listed effects,
        with features or without.

        Parameters
        ----------
        screen
            The model.
        on_speed
            Whether it is one on speeds, and not on headings.
        least
            Nats that it has to gain.
        has_features
            Whether features could be asked at all: where not, all effects are without.
        """
        there, asked = screen.fitted.parameters.effects, self.screened
        plain = [
            each
            for each in self.case.listed
            if each.effect.on_speed == on_speed
            and not (has_features and is_featured(each.effect, self.case.scene.arena))
        ]
        if there != self.case.screen.fitted.parameters.effects:
            left = [each for each in plain if each.name not in there]
            asked = tuple(best_of(self.listed, ask_all(screen, left, self.case.question.n_workers)))
        names = {each.name for each in plain}
        stand = [best for best in asked if best.score.candidate.name in names and best.p < LEVEL]
        lasting = [
            best
            for best in stand
            if is_steady(best.score, screen.scene, MINUTES_S)
            and not has_pulses(best.score, screen.scene)
        ]
        return self._added(screen, lasting, least)

    def beyond(self, screen: Screen, *, on_speed: bool, least: float = 0.0) -> Step | None:
        """Return the effect beyond the list that explains most; None where none is clear.

        Parameters
        ----------
        screen
            The model.
        on_speed
            Whether it is one on speeds, and not on headings.
        least
            Nats that it has to gain.
        """
        if not (self.stands_out or self.suspicious):
            return None
        own = screen.fitted.parameters.effects
        others = not_forms_of(self.case.generic, own)
        asked = [each for each in others if each.effect.on_speed == on_speed]
        clear = [best for best in self._ranked(screen, asked) if abs(best.z) > _CLEAR_Z]
        return self._added(screen, clear, least)

    def _ranked(self, screen: Screen, asked: Sequence[Candidate]) -> list[Best]:
        """Return effects as they are asked for, those that are clear held against replicates."""
        case, question = self.case, self.case.question
        alone = Asked(candidates=case.generic, held=(), null=theory(0))
        found = best_of(alone, ask_all(screen, asked, question.n_workers))
        found = [best for best in found if abs(best.z) > _CLEAR_Z][: 2 * _RIVALS]
        if not found or (question.quick and not has_noise(question)):
            return found
        held = tuple(best.score.candidate for best in found)

        def ask(_number: int, other: Screen) -> Floats:
            return np.array([other.ask(each).z for each in held])

        n = QUICK_REPLICATES if question.quick else _REPLICATES
        rows = run_null(case.chain, ask, range(n), n_workers=question.n_workers)
        family = Asked(candidates=case.generic, held=held, null=from_replicates(np.array(rows)))
        return best_of(family, [best.score for best in found])

    def _added(self, screen: Screen, ranked: Sequence[Best], least: float) -> Step | None:
        """Return the effect that gains most of those that may, if it holds."""
        if not ranked:
            return None
        n_workers = self.case.question.n_workers
        near = [best for best in ranked if abs(best.z) >= IN_REACH * abs(ranked[0].z)][:_RIVALS]
        made = [refit(screen, best.score, n_workers=n_workers) for best in near]
        for k in np.argsort([-each.worth for each in made]):
            step = Step(choice=Choice(best=made[k]), best=near[k], before=screen)
            gains = made[k].nats > max(LEAST_NATS, least)
            if gains and holds(step, n_workers=n_workers):
                return replace(step, choice=_choice(made[k], made))
        return None


def _choice(best: Refit, made: Sequence[Refit]) -> Choice:
    """Return an effect with those that cannot be told from it; one beyond the list is a guess."""
    if best.is_generic:
        return Choice(best=best)
    ties = [each for each in made if each is not best and not best.over(each) > SURE]
    return Choice(best=best, ties=tuple(ties))

"""Forward selection: the effects that a model lacks, one after the other.

A suspect is a listed effect whose efficient score, standardised by the null through the
measurement, is too large for the whole family (Sidak 1967, Journal of the American
Statistical Association 62: 626-633). The best one is put into the model, and all are
asked again, until nothing is left.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

import numpy as np

from zfcal.arrays import Floats
from zfcal.diagnose.candidates import Candidate
from zfcal.diagnose.chances import least_of
from zfcal.diagnose.foreseen import Known, unforeseen
from zfcal.diagnose.heats import Heat, Sampled, ahead, hopeful, run_heats, unbeaten
from zfcal.diagnose.leftover import outlasts
from zfcal.diagnose.naming import Choice, Refit, choose, refit
from zfcal.diagnose.null import UNLIKE, Null
from zfcal.diagnose.scores import Score
from zfcal.diagnose.screening import Screen, ask_all
from zfcal.diagnose.sides import directions, feigned, with_direction
from zfcal.diagnose.together import together

Told = Callable[[str, int, int], None]

LEVEL = 0.02
"""Chance of a false alarm over the whole family."""

MOST_EFFECTS = 4
_SUSPECTS = 6
RIVALS = 3
_LEAST_NATS = 6.0
LEAST_SHARE = 0.15
"""A further effect must gain this share of the first one's nats: an effect whose true form
is a little different from its mechanism leaves something over that others answer to."""

GENERIC_SHARE = 0.5
"""The same where one of the two is beyond the list. It names no mechanism: as the further one it
answers to nearly all that a strong effect of another form leaves over, and as the first one its
own form is a guess. Of headings and speeds one leaves nothing over in the other."""

_IN_REACH = 0.5
"""Share of the clearest one's standard errors below which a suspect is not put into the model:
it would have to gain four times what its score promises."""

_LEAST_Z = 3.0
"""Standard errors below which none is taken for missing, however few are asked for."""

_STANDS = 3.0
_RIVAL_AHEAD = 3.0
_RIVAL_TIMES = 1.25
RIVAL_Z = 6.0
"""An effect beyond the list is named on clearer evidence than a listed one."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Asked:
    """A family of candidates and its null.

    Parameters
    ----------
    candidates
        Each effect at each shape.
    held
        Those of which the null is known: effects at the shape that the recording asks for.
    null
        Of their z, in their order; the theory for all others.
    """

    candidates: tuple[Candidate, ...]
    held: tuple[Candidate, ...]
    null: Null

    def standardised(self, scores: Sequence[Score]) -> Floats:
        """Return z less its centre over its spread; zero on the side that cannot be."""
        own = [self.centre_of(score.candidate) for score in scores]
        centre, spread = np.array(own).reshape(-1, 2).T
        raw = np.array([score.z for score in scores])
        z = (raw - centre) / spread
        # What noise does to another shape of the effect is not known: it may be nothing.
        exact = np.array([score.candidate in self.held for score in scores], dtype=bool)
        z = np.where(exact | (np.abs(z) < np.abs(raw)), z, raw)
        one_sided = np.array([not score.candidate.signed for score in scores], dtype=bool)
        return np.where(one_sided & (z < 0), 0.0, z)

    def family_p(self, z: Floats) -> Floats:
        """Return p-values over the whole family, however many of it were asked for."""
        return least_of(self.null.p(z), len(self.candidates))

    def centre_of(self, candidate: Candidate) -> tuple[float, float]:
        """Return centre and spread of a candidate's z, the effect's at another shape if need be.

        The spread holds that replicates are the recording's measurement in parts only.
        """
        names = [each.name for each in self.held]
        if candidate.name not in names:
            return 0.0, 1.0
        at = names.index(candidate.name)
        centre = float(self.null.centre[at])
        return centre, math.hypot(float(self.null.spread[at]), UNLIKE * centre)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Best:
    """An effect at the shape that a recording asks for most.

    Parameters
    ----------
    score
        At that shape.
    z, p
        Standardised, and over the family.
    information
        Of the strength, at the shape of which the recording tells most.
    """

    score: Score
    z: float
    p: float
    information: float


def best_of(asked: Asked, scores: Sequence[Score]) -> list[Best]:
    """Return each effect at its best shape, the clearest first."""
    z = asked.standardised(scores)
    p = asked.family_p(z)
    told: dict[str, float] = {}
    for score in scores:
        name = score.candidate.name
        told[name] = max(told.get(name, 0.0), score.information)
    found: dict[str, Best] = {}
    for score, own, chance in zip(scores, z, p, strict=True):
        name = score.candidate.name
        if name not in found or abs(own) > abs(found[name].z):
            found[name] = Best(score=score, z=float(own), p=float(chance), information=told[name])
    return sorted(found.values(), key=lambda best: -abs(best.z))


def _in_reach(ranked: Sequence[Best]) -> list[Best]:
    """Return the suspects that could turn out to be the clearest one, of a ranked list."""
    return [best for best in ranked if abs(best.z) >= _IN_REACH * abs(ranked[0].z)]


def least_z(nats: float) -> float:
    """Return the standard errors that an effect has at least which gains so many nats.

    A strong effect gains more than half the square of its score, as a rule not four times it.
    """
    return _IN_REACH * math.sqrt(2 * nats)


def _least(done: Sequence[Step]) -> float:
    """Return what a further effect must gain, in nats."""
    return max([_LEAST_NATS, *(LEAST_SHARE * step.choice.best.nats for step in done[:1])])


def _least_beside(first: Refit | None, further: Refit) -> float:
    """Return what a further effect must gain where one of the two is beyond the list."""
    if first is None:
        return 0.0
    pair = (first.candidate.effect, further.candidate.effect)
    guessed = first.is_generic and pair[0].on_speed == pair[1].on_speed
    return GENERIC_SHARE * first.nats if guessed or further.is_generic else 0.0


def _is_clearer(rival: Refit, listed: Refit) -> bool:
    """Return whether an effect beyond the list explains so much more than a listed one."""
    return rival.over(listed) > _RIVAL_AHEAD and rival.nats > _RIVAL_TIMES * listed.nats


def _is_guessed(listed: Refit, guesses: Sequence[Refit]) -> bool:
    """Return whether one beyond the list explains more than what would be named.

    Where it gains too little to be named itself it is what an effect before it leaves over, and
    so is a listed one that explains less of the same.
    """
    return not listed.is_generic and any(_is_clearer(each, listed) for each in guesses)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Step:
    """One effect that was added.

    Parameters
    ----------
    choice
        What was chosen, and among what.
    best
        As it was screened.
    before
        The model without it.
    """

    choice: Choice
    best: Best
    before: Screen


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Selection:
    """The effects, in the order of adding.

    Parameters
    ----------
    steps
        One for each effect.
    screened
        All effects as they were asked for in the model that was given.
    final
        The model with all of them.
    left_over
        Whether an effect stands out that another form of one in the given model would explain.
    """

    steps: tuple[Step, ...]
    screened: tuple[Best, ...]
    final: Screen
    left_over: bool = False


@dataclass(frozen=True, kw_only=True, eq=False)
class Selector:
    """Adds effects until nothing is left.

    Parameters
    ----------
    listed
        The family of candidates.
    rivals
        Effects beyond the list that a model is asked for, the clearest first, without other
        forms of the effects named, and without those less clear than so many standard errors;
        they cost time, and are asked where there is something to explain.
    suspicious
        Whether something is to be explained even if no listed effect answers.
    n_workers
        Threads.
    given
        Effects that the model came with: what they leave over is none.
    told
        Hears how far it is.
    """

    listed: Asked
    rivals: Callable[[Sampled, set[str], float], list[Best]]
    suspicious: bool
    n_workers: int
    given: tuple[Candidate, ...] = ()
    told: Told = field(default=lambda _stage, _done, _all: None)

    def select(self, screen: Screen, scores: Sequence[Score]) -> Selection:
        """Return the effects that a model lacks.

        Parameters
        ----------
        screen
            Of the model.
        scores
            Of the listed candidates in it.
        """
        steps: list[Step] = []
        known = [Known(score=score, asked=True) for score in scores]
        first = tuple(best_of(self.listed, scores))
        ranked = self._others(screen, first)
        left_over = len(ranked) < len(first)
        for number in range(MOST_EFFECTS):
            sampled = Sampled(whole=screen)
            if number:
                known = self._asked_again(sampled, steps, known)
                asked = [each.score for each in known if each.asked]
                ranked = self._others(screen, best_of(self.listed, asked))
            step, aside = self._step(sampled, ranked, steps)
            if step is None:
                left_over = left_over or (aside and not number)
                break
            steps.append(step)
            screen = step.choice.best.screen
            self.told("adding effects", number + 1, MOST_EFFECTS)
        return Selection(steps=tuple(steps), screened=first, final=screen, left_over=left_over)

    def _others(self, screen: Screen, ranked: Sequence[Best]) -> list[Best]:
        """Return effects without those that the given model's ones leave over."""
        return [
            best for best in ranked if best.p >= LEVEL or outlasts(best.score, screen, self.given)
        ]

    def _asked_again(
        self, sampled: Sampled, done: Sequence[Step], known: Sequence[Known]
    ) -> list[Known]:
        """Return the listed effects that a model lacks; those asked for that are worth it.

        Parameters
        ----------
        sampled
            The model.
        done
            What was added, last of all what it had not when it was asked before.
        known
            What was known then.
        """
        added, needed = done[-1].best.score, least_z(_least(done))
        open_ = [each for each in known if each.score.candidate.name != added.candidate.name]
        told = [each.beside(added) for each in open_]
        scores = [each.score for each in told]
        z = np.maximum(np.abs(self.listed.standardised(scores)), [s.clearness for s in scores])
        open_again = (z > max(needed, _LEAST_Z) - unforeseen(added)) & [not e.asked for e in told]
        hope = [scores[n].candidate for n in np.flatnonzero(open_again)]
        hope = hopeful(sampled, hope, needed, self.n_workers)
        fresh = {id(s.candidate): s for s in ask_all(sampled.whole, hope, self.n_workers)}
        return [
            Known(score=fresh[id(each.score.candidate)], asked=True)
            if id(each.score.candidate) in fresh
            else each
            for each in told
        ]

    def _step(
        self, sampled: Sampled, ranked: Sequence[Best], done: Sequence[Step]
    ) -> tuple[Step | None, bool]:
        """Return what is added, and whether something that gains enough was put aside."""
        taken = {step.choice.best.name for step in done}
        suspects = _in_reach([best for best in ranked if best.p < LEVEL])[:_SUSPECTS]
        first = done[0].choice.best if done else None
        least = _least(done)
        heats, rivals = self._entered(sampled, suspects, taken, least)
        others = run_heats(sampled, [best.score for best in rivals], self.n_workers)
        listed = with_direction(unbeaten(heats), heats)
        made = self._refits(sampled.whole, [*listed, *ahead(others, heats)])
        worth = [each for each in made if each.nats > max(least, _least_beside(first, each))]
        aside = [each for each in feigned(made, sampled.whole) if each in worth]
        if aside:
            worth += directions(made, worth)
        choice = self._choose(worth, aside)
        guesses = [each for each in made if each.is_generic and each not in worth]
        if choice is None or _is_guessed(choice.best, guesses):
            return None, bool(aside)
        by_name = {best.score.candidate.name: best for best in (*suspects, *rivals)}
        step = Step(choice=choice, best=by_name[choice.best.name], before=sampled.whole)
        return step, bool(aside)

    def _entered(
        self, sampled: Sampled, suspects: Sequence[Best], taken: set[str], least: float
    ) -> tuple[list[Heat], list[Best]]:
        """Return the heats of suspects, and the effects beyond the list that are worth one."""
        scores = [best.score for best in suspects]
        known = {*taken, *(score.candidate.name for score in scores)}
        if taken:
            ran = run_heats(sampled, scores, self.n_workers)
            heats = with_direction([heat for heat in ran if heat.gains(least)], ran)
            return heats, self._rivals(sampled, known, suspects) if heats else []
        worth = bool(suspects) or self.suspicious
        return together(
            lambda: run_heats(sampled, scores, self.n_workers),
            lambda: self._rivals(sampled, known, suspects) if worth else [],
            n_workers=self.n_workers,
        )

    def _rivals(self, sampled: Sampled, known: set[str], suspects: Sequence[Best]) -> list[Best]:
        """Return the clearest effects beyond the list that are no other form of known ones."""
        least = max([RIVAL_Z, *(_IN_REACH * abs(best.z) for best in suspects)])
        found = self._others(sampled.whole, self.rivals(sampled, known, least))
        return _in_reach([best for best in found if abs(best.z) > least])[:RIVALS]

    def _refits(self, screen: Screen, heats: Sequence[Heat]) -> list[Refit]:
        n_workers = max(1, self.n_workers)

        def made(heat: Heat) -> Refit:
            return refit(screen, heat.score, heat.first, n_workers=n_workers)

        with ThreadPoolExecutor(n_workers) as pool:
            return list(pool.map(made, heats))

    def _choose(self, worth: Sequence[Refit], aside: Sequence[Refit]) -> Choice | None:
        """Return which it is of those that are worth it; those aside only must be beaten."""
        generic = [each for each in worth if each.is_generic]
        listed = [each for each in worth if not each.is_generic and each not in aside]
        choice = choose(listed, self._stands) if listed else None
        beaten = aside if choice is None else (choice.best, *aside)
        for rival in sorted(generic, key=lambda each: -each.worth):
            if all(_is_clearer(rival, each) for each in beaten):
                considered = () if choice is None else choice.considered
                return Choice(best=rival, ties=(), considered=considered)
        return choice

    def _stands(self, candidate: Candidate, beside: Refit) -> bool:
        """Return whether a candidate is still asked for when another is in the model."""
        centre, spread = self.listed.centre_of(candidate)
        z = (beside.screen.ask(candidate).z - centre) / spread
        return (abs(z) if candidate.signed else z) > _STANDS

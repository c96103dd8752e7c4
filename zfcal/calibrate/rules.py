"""Which model is handed to the robot: rules are judged by what followed their earlier models.

A model that fits a window best fits what happened in it by chance as well, and the most likely
model is none where the law is wrong. Which of these faults is the larger one differs between
recordings, and no window that a model was fitted to can tell. So each rule has a record: what its
models scored on the first window that they had not seen, see ``judging``. One rule is in charge
until another one is surely better. The first is `MEMORY`: where the law is right nothing else is as
steady, and where it is wrong another rule takes over in time.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.special import stdtrit

from zfcal.arrays import Floats
from zfcal.behaviour.statistics import Statistics

SCORE, LIKELIHOOD, COMPROMISE, MEMORY, NEAREST, KEEP = RULES = (
    "score",
    "likelihood",
    "compromise",
    "memory",
    "nearest",
    "keep",
)
"""The best of the window by its score; its likelihood estimate; half way between these two; the
estimate over all minutes so far, older ones counting less; of all models made so far, the nearest
to the window; the model in use."""

SAYS = {
    SCORE: "the window's best by its score",
    LIKELIHOOD: "the window's likelihood estimate",
    COMPROMISE: "half way between the window's best and its estimate",
    MEMORY: "the estimate over all minutes so far",
    NEAREST: "of all models made so far, the one nearest to the window",
    KEEP: "the model in use",
}

START, LONG_RUNS = "start", "long runs"
"""How models are judged: see `zfcal.calibrate.judging`."""

_MOST = {START: 1.5, LONG_RUNS: 1.0}
"""What no score of a kind exceeds."""

MADE = (SCORE, LIKELIHOOD, COMPROMISE, MEMORY)
"""Rules that make a model of their own in each round."""

HALF_LIFE_S = 900.0
"""Age at which a step counts half for `MEMORY`."""

WINDOW_S = 120
"""Length of a window: a model is judged on the first one that begins when it was made, or later."""

FIRST_ROUNDS = 2
"""In these no model has been followed by a window yet."""

LEVEL = 0.8
"""How sure the largest of all leads has to be before another rule takes over: where no rule is
better than the one in charge, chance makes one of them lead as far in one round of five."""

_MOST_MODELS = 60
"""Models that are kept for `NEAREST`, the newest."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Candidate:
    """A model that a rule would have handed on.

    Parameters
    ----------
    rule
        One of `RULES`.
    made_at_s
        End of the window at which the rule chose it.
    of_s
        End of the window that it was made of.
    genes : ndarray, shape (gene,)
    long_run
        What it does with the speeds of the window at which it was chosen, as it would be handed
        on then; all agents counted.
    """

    rule: str
    made_at_s: int
    of_s: int
    genes: Floats
    long_run: Statistics


@dataclass(frozen=True, slots=True, kw_only=True)
class Forward:
    """What a rule's model scored on a window after it was made.

    Parameters
    ----------
    window_end_s
        Of the window that it was judged on.
    rule
        One of `RULES`.
    made_at_s
        End of the window at which the rule chose the model.
    S
        The score; NaN where no feature can be counted.
    low, high
        95 % of what windows of one model differ by; NaN where S or that is unknown.
    n
        Positions of fish in the window.
    """

    window_end_s: int
    rule: str
    made_at_s: int
    S: float
    low: float
    high: float
    n: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Followed:
    """What models score on a window that followed them.

    Parameters
    ----------
    scores
        Of each; NaN where nothing can be counted.
    noise
        Standard deviation of a score between windows of one model.
    by
        `START`: by windows from where all were; `LONG_RUNS`: by S against long runs. What one says
        is not comparable with what the other says.
    lead_noise
        Standard deviation between windows of what one model scores above another, where either of
        them is true; NaN where that is not known.
    """

    scores: tuple[float, ...]
    noise: float
    by: str
    lead_noise: float = math.nan


@dataclass(frozen=True, slots=True, kw_only=True)
class Lead:
    """By how much a rule's models have scored better than those of another one.

    Parameters
    ----------
    mean, error
        Of the differences, window by window, and its standard error.
    n
        Windows.
    n_apart
        So many windows that share no sample would say as much.
    """

    mean: float
    error: float
    n: int
    n_apart: float

    def is_sure(self, n_rules: int) -> bool:
        """Return whether chance alone seldom leads as far.

        Parameters
        ----------
        n_rules
            Rules of which this one is the best (Bonferroni).
        """
        level = 1 - (1 - LEVEL) / n_rules
        return self.n > 0 and bool(self.mean > stdtrit(self.n_apart, level) * self.error)


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """The rule that publishes, and why.

    Parameters
    ----------
    rule
        One of `RULES`.
    because
        In words.
    lead
        The largest over the rule that was in charge; None where nothing was compared.
    in_charge
        The rule that publishes from now on, until another one is surely better.
    """

    rule: str
    because: str
    lead: Lead | None = None
    in_charge: str = MEMORY


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Record:
    """All that has been judged so far, and the models that wait to be.

    Parameters
    ----------
    rows
        Forward scores, in the order in which windows ended.
    models
        Of the rules, the oldest first.
    n_rounds
        Rounds so far.
    in_use
        The model that was handed on last; None before the first round.
    in_charge
        The rule that publishes, `MEMORY` before rules were judged.
    by
        How all of its rows were judged; empty where there are none.
    lead_noises
        Of each window that was judged, how much what one model scores above another varies.
    """

    rows: tuple[Forward, ...] = ()
    models: tuple[Candidate, ...] = ()
    n_rounds: int = 0
    in_use: Candidate | None = None
    in_charge: str = MEMORY
    by: str = ""
    lead_noises: tuple[float, ...] = ()

    @property
    def lead_noise(self) -> float:
        """Standard deviation between windows of what one model scores above another.

        NaN as long as no window has told.
        """
        known = np.array([noise for noise in self.lead_noises if not math.isnan(noise)])
        return math.sqrt(np.square(known).mean()) if len(known) else math.nan

    def due(self, end_s: int) -> tuple[Candidate, ...]:
        """Return the models that a window is the first to follow, the newest that are.

        Parameters
        ----------
        end_s
            Where the window ends.
        """
        due = [m for m in self.models if m.made_at_s <= end_s - WINDOW_S]
        newest = max((m.made_at_s for m in due), default=0)
        known = {row.made_at_s for row in self.rows}
        return tuple(m for m in due if m.made_at_s == newest and newest not in known)

    def judged(self, found: Followed, *, end_s: int, n: int) -> Record:
        """Return the record with what the models that are due have scored on a window.

        Scores of two kinds are never in one record. Those from a start stay, and a window without
        one judges nothing; those by long runs give way to the first from a start.

        Parameters
        ----------
        found
            Of the models of `due`, in their order.
        end_s
            Where the window ends.
        n
            Positions of fish in it.
        """
        models = self.due(end_s)
        if not models or (self.by == START and found.by != START):
            return self
        half = 1.96 * found.noise
        rows = tuple(
            Forward(
                window_end_s=end_s,
                rule=model.rule,
                made_at_s=model.made_at_s,
                S=score,
                low=float(np.maximum(0.0, score - half)),
                high=float(np.minimum(_MOST[found.by], score + half)),
                n=n,
            )
            for model, score in zip(models, found.scores, strict=True)
        )
        goes_on = found.by == self.by
        return replace(
            self,
            rows=(self.rows if goes_on else ()) + rows,
            lead_noises=(*(self.lead_noises if goes_on else ()), found.lead_noise),
            by=found.by,
        )

    @property
    def own(self) -> tuple[Candidate, ...]:
        """The models that rules have made of windows, the oldest first."""
        return tuple(model for model in self.models if model.rule in MADE)

    def with_models(self, models: Iterable[Candidate]) -> Record:
        """Return the record with models of a round; those that nobody needs are dropped."""
        whole = (*self.models, *models)
        newest = max((m.made_at_s for m in whole), default=0)
        waits = [m.made_at_s > newest - 2 * WINDOW_S for m in whole]
        own = np.array([m.rule in MADE for m in whole])
        behind = np.cumsum(own[::-1])[::-1]
        kept = [
            m
            for m, w, o, n in zip(whole, waits, own, behind, strict=True)
            if w or (o and n <= _MOST_MODELS)
        ]
        return replace(self, models=tuple(kept))

    def means(self) -> dict[str, float]:
        """Return each rule's mean forward score; rules that have none are left out."""
        found = {rule: [row.S for row in self.rows if row.rule == rule] for rule in RULES}
        return {
            rule: float(np.nanmean(values))
            for rule, values in found.items()
            if not all(map(math.isnan, values))
        }

    def lead(self, rule: str, over: str, noise: float) -> Lead:
        """Return a rule's lead over another one, on the windows that both were judged on.

        The spread of a few differences says little, so the noise of a window is taken for one more.
        """
        by = {
            name: {row.window_end_s: row.S for row in self.rows if row.rule == name}
            for name in (rule, over)
        }
        found = {end: by[rule][end] - by[over][end] for end in by[rule] if end in by[over]}
        ends = sorted(end for end, value in found.items() if not math.isnan(value))
        if not ends:
            return Lead(mean=math.nan, error=math.nan, n=0, n_apart=0.0)
        apart, n_apart = np.array([found[end] for end in ends]), _n_apart(ends)
        variance = (((apart - apart.mean()) ** 2).sum() + noise**2) / len(ends)
        error = math.sqrt(variance / n_apart)
        return Lead(mean=float(apart.mean()), error=error, n=len(ends), n_apart=n_apart)

    def choose(self, made: Collection[str], noise: float) -> Choice:
        """Return the rule that publishes.

        Parameters
        ----------
        made
            Rules that have a model to publish.
        noise
            Standard deviation of S between windows of one model; counts where that of leads is
            not known.
        """
        noise = noise if math.isnan(self.lead_noise) else self.lead_noise
        if self.n_rounds < FIRST_ROUNDS:
            first = LIKELIHOOD if LIKELIHOOD in made else SCORE
            return Choice(
                rule=first, because="no window has followed a model yet", in_charge=self.in_charge
            )
        old = self.in_charge
        if old not in {*made, KEEP} and all(row.rule != old for row in self.rows):
            # Such as without tracks, from which alone estimates are made.
            old = NEAREST
        # Rules may lack a model in some minutes: each is held against the one in charge on the
        # minutes that both have.
        rules = [rule for rule in RULES if rule != old and (rule in made or rule == KEEP)]
        leads = {rule: self.lead(rule, old, noise) for rule in rules}
        leads = {rule: lead for rule, lead in leads.items() if lead.n}
        best = max(leads, key=lambda rule: leads[rule].mean, default=None)
        lead = None if best is None else leads[best]
        if best is not None and lead is not None and lead.is_sure(len(leads)):
            because = f"its models have been better than those of {old}"
            return Choice(rule=best, because=because, lead=lead, in_charge=best)
        if old not in {*made, KEEP}:
            because = f"{old} has no model of this window"
            return Choice(rule=KEEP, because=because, lead=lead, in_charge=old)
        return Choice(rule=old, because=_stays(best, lead), lead=lead, in_charge=old)


def _stays(best: str | None, lead: Lead | None) -> str:
    """Return why the rule in charge publishes."""
    if lead is None or not lead.mean > 0:
        return "no rule has been better"
    return f"the lead of {best} may be chance"


def _n_apart(ends_s: Sequence[int]) -> float:
    """Return how many windows that share no sample windows are worth: by the time that they cover.

    Parameters
    ----------
    ends_s
        Where they end, sorted.
    """
    covered = WINDOW_S + sum(min(WINDOW_S, later - end) for end, later in pairwise(ends_s))
    return covered / WINDOW_S


def half_way(one: Floats, other: Floats) -> Floats:
    """Return the genome in the middle of two, whose gamma rows have been scaled."""
    return np.asarray((one + other) / 2)

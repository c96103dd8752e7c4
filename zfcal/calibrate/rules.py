"""Which model is handed to the robot: rules are judged by what followed their earlier models.

A model that fits a window best fits what happened in it by chance as well, and the most likely
model is none where the law is wrong. Which of these faults is the larger one differs between
recordings, and no window that a model was fitted to can tell. So each rule has a record: what its
models scored on the first window that they had not seen.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import stdtrit

from zfcal.arrays import Floats
from zfcal.behaviour.scores import compare
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
estimate over all minutes so far, older ones counting less; of all models that were made so far, the
one that is nearest to the window; the model in use."""

SAYS = {
    SCORE: "the window's best by its score",
    LIKELIHOOD: "the window's likelihood estimate",
    COMPROMISE: "half way between the window's best and its estimate",
    MEMORY: "the estimate over all minutes so far",
    NEAREST: "of all models made so far, the one nearest to the window",
    KEEP: "the model in use",
}

MADE = (SCORE, LIKELIHOOD, COMPROMISE, MEMORY)
"""Rules that make a model of their own in each round."""

HALF_LIFE_S = 900.0
"""Age at which a step counts half for `MEMORY`."""

WINDOW_S = 120
"""Length of a window: a model is judged on the first one that begins when it was made, or later."""

FIRST_ROUNDS = 2
"""In these no model has been followed by a window yet."""

LEVEL = 0.8
"""How sure a lead has to be before the model in use changes. Of one comparison of independent
windows one in five leads of this size would be chance; of the best of several rules, more."""

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
class Lead:
    """By how much a rule's models have scored better than those of another one.

    Parameters
    ----------
    mean, error
        Of the differences, window by window, and its standard error.
    n
        Windows.
    """

    mean: float
    error: float
    n: int

    @property
    def is_sure(self) -> bool:
        """Whether chance alone seldom leads as far."""
        return self.n > 0 and bool(self.mean > stdtrit(self.n, LEVEL) * self.error)


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
        Over the model in use; None where nothing was compared.
    """

    rule: str
    because: str
    lead: Lead | None = None


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
    """

    rows: tuple[Forward, ...] = ()
    models: tuple[Candidate, ...] = ()
    n_rounds: int = 0
    in_use: Candidate | None = None

    def judged(self, control: Statistics, end_s: int, noise: float) -> Record:
        """Return the record with the models that a window is the first to follow.

        Parameters
        ----------
        control
            The window's statistics.
        end_s
            Where it ends.
        noise
            Standard deviation of S between windows of one model.
        """
        due = [m for m in self.models if m.made_at_s <= end_s - WINDOW_S]
        newest = max((m.made_at_s for m in due), default=0)
        known = {row.made_at_s for row in self.rows}
        new = [m for m in due if m.made_at_s == newest and newest not in known]
        rows = tuple(_row(model, control, end_s, noise) for model in new)
        return replace(self, rows=self.rows + rows)

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

    def nearest(self, control: Statistics) -> Candidate | None:
        """Return the model made so far that is nearest to a window; None without any."""
        own = [model for model in self.models if model.rule in MADE]
        scores = [np.nan_to_num(compare(m.long_run, control).S, nan=-1.0) for m in own]
        return own[int(np.argmax(scores))] if own else None

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
        both = [end for end in by[rule] if end in by[over]]
        apart = np.array([by[rule][end] - by[over][end] for end in both])
        apart = apart[~np.isnan(apart)]
        n = len(apart)
        if not n:
            return Lead(mean=math.nan, error=math.nan, n=0)
        variance = (((apart - apart.mean()) ** 2).sum() + noise**2) / n
        return Lead(mean=float(apart.mean()), error=float(math.sqrt(variance / n)), n=n)

    def choose(self, made: Collection[str], noise: float) -> Choice:
        """Return the rule that publishes.

        Parameters
        ----------
        made
            Rules that have a model to publish.
        noise
            Standard deviation of S between windows of one model.
        """
        first = LIKELIHOOD if LIKELIHOOD in made else SCORE
        # Rules may lack a model in some minutes: each is held against `KEEP` on the minutes it has.
        found = {rule: self.lead(rule, KEEP, noise) for rule in RULES if rule in made}
        leads = {rule: lead for rule, lead in found.items() if lead.n}
        if self.n_rounds < FIRST_ROUNDS or not leads:
            return Choice(rule=first, because="no window has followed a model yet")
        leader = max(leads, key=lambda rule: leads[rule].mean)
        lead = leads[leader]
        if not lead.mean > 0:
            return Choice(rule=KEEP, because="no rule has done better than to keep it", lead=lead)
        if not lead.is_sure:
            return Choice(rule=KEEP, because=f"the lead of {leader} may be chance", lead=lead)
        return Choice(rule=leader, because="its models have been the better ones", lead=lead)


def _row(model: Candidate, control: Statistics, end_s: int, noise: float) -> Forward:
    score = compare(model.long_run, control).S
    half = 1.96 * noise
    return Forward(
        window_end_s=end_s,
        rule=model.rule,
        made_at_s=model.made_at_s,
        S=score,
        low=float(np.maximum(0.0, score - half)),
        high=float(np.minimum(1.0, score + half)),
        n=int(control.occupation.sum()),
    )


def half_way(one: Floats, other: Floats) -> Floats:
    """Return the genome in the middle of two, whose gamma rows have been scaled."""
    return np.asarray((one + other) / 2)

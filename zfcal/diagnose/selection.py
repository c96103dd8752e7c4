"""What stands out of a family of effects, and what is added to a model.

An effect stands out where its efficient score, standardised by the null through the measurement,
is too large for the whole family (Sidak 1967, Journal of the American Statistical Association 62:
626-633).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from zfcal.arrays import Floats
from zfcal.diagnose.candidates import Candidate
from zfcal.diagnose.chances import least_of
from zfcal.diagnose.naming import Choice
from zfcal.diagnose.null import UNLIKE, Null
from zfcal.diagnose.scores import Score
from zfcal.diagnose.screening import Screen

LEVEL = 0.02
"""Chance of a false alarm over the whole family."""

UNNAMED_LEVEL = 0.001
"""Chance of what has no name: of the omnibus test, and of features that nothing bears out. It helps
nobody to a mechanism, so it is said where it is sure."""

MOST_EFFECTS = 4

IN_REACH = 0.5
"""Share of the clearest one's standard errors below which another effect, or form of one, is not
put into the model: it would have to gain four times what its score promises."""

LEAST_NATS = 6.0
LEAST_SHARE = 0.15
"""A further effect must gain this share of the first one's nats: an effect whose true form
is a little different from its mechanism leaves something over that others answer to."""

GENERIC_SHARE = 0.5
"""The same where one of the two is beyond the list. It names no mechanism: as the further one it
answers to nearly all that a strong effect of another form leaves over, and as the first one its
own form is a guess. Of headings and speeds one leaves nothing over in the other."""


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

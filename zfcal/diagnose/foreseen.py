"""What becomes of scores once another effect is in the model, before they are asked again."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from zfcal.diagnose.candidates import Candidate
from zfcal.diagnose.scores import Score

_ERRS = 2.0
"""Standard errors by which what is foreseen may fall short at the least."""

_ERRS_SHARE = 0.1
"""Of the standard errors of what is in the model by now."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Known:
    """What is known of an effect that a model lacks.

    Parameters
    ----------
    score
        Of it.
    asked
        Whether the score is of this very model, and not foreseen.
    """

    score: Score
    asked: bool

    def beside(self, added: Score) -> Known:
        """Return what is known of it with another effect in the model."""
        if is_untouched(self.score, added.candidate):
            return self
        return Known(score=foreseen(self.score, added), asked=False)


def is_untouched(score: Score, added: Candidate) -> bool:
    """Return whether a score stays as it is with an effect in the model.

    Headings are judged given the speed, and speeds given where everybody was: an effect on one of
    them says nothing of the other, unless individuals differ.
    """
    pair = (score.candidate.effect, added.effect)
    return pair[0].on_speed != pair[1].on_speed and all(each.has_steps for each in pair)


def foreseen(score: Score, added: Score) -> Score:
    """Return what an effect's score is going to be with another effect in the model.

    To first order what the other explains is the part of the score that its own score explains
    (Rao 1948, as `zfcal.diagnose.screening`). Of individuals and rests nothing is foreseen: they
    are infinitely clear, until they are asked again.

    Parameters
    ----------
    score
        Of the effect, in the model without the other.
    added
        Of the other, in the same model or in one with fewer effects.
    """
    effects = (score.candidate.effect, added.candidate.effect)
    known = float(added.steps @ added.steps)
    told = math.isfinite(score.z) and len(score.steps) == len(added.steps) and known > 0.0
    if not (told and all(each.in_any_steps for each in effects)):
        return replace(score, z=math.inf)
    left = score.steps - (score.steps @ added.steps / known) * added.steps
    squares = float(left @ left)
    z = float(left.sum()) / math.sqrt(squares) if squares > 0.0 else 0.0
    return replace(score, z=z, steps=left)


def unforeseen(added: Score) -> float:
    """Return by how many standard errors an effect may be clearer than foreseen.

    Parameters
    ----------
    added
        The other effect's score; the clearer it is the less holds the first order.
    """
    return max(_ERRS, _ERRS_SHARE * added.clearness)

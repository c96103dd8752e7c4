"""How a score stands to its ceiling, in words: at most level with it, never a multiple of it.

What lies above the range of the ceiling fits chance and is no achievement.
"""

from __future__ import annotations

import math

from zfcal.report.views import Mark

PERFECT = "of what a perfect model would score"
FITS_CHANCE = "above the range of a perfect model: it fits chance (overfitting)"
ABOVE = "above the range of a perfect model, by chance"


def is_above(mark: Mark) -> bool:
    """Return whether a score is higher than what chance gives a perfect match."""
    return mark.value > mark.high


def share_of(mark: Mark) -> str:
    """Return the share of the ceiling that a score reaches, as text.

    Parameters
    ----------
    mark
        The score with its ceiling, which is a mean: half of all perfect matches score more.

    Returns
    -------
    str
        A percentage below the ceiling, ``100 %`` at it and above; ``above`` where the score is
        above the range of the ceiling, and ``no ceiling`` without one.
    """
    share = mark.against_ceiling
    if math.isnan(share):
        return "no ceiling"
    return "above" if is_above(mark) else f"{100 * min(share, 1.0):.0f} %"


def figure_of(mark: Mark, what: str = PERFECT, above: str = FITS_CHANCE) -> tuple[str, str]:
    """Return the number that stands out and its name.

    Parameters
    ----------
    mark
        The score with its ceiling.
    what
        What a percentage is the share of.
    above
        What is said where the score is above the range of the ceiling: the score itself
        stands out then, and no percentage.
    """
    return (f"{mark.value:.2f}", above) if is_above(mark) else (share_of(mark), what)


def sentence_of(mark: Mark) -> str:
    """Return how a score stands to its ceiling and its range, as a sentence."""
    if is_above(mark):
        return "That is above the range of a perfect model."
    if mark.against_ceiling > 1:
        return "That is no less than a perfect model scores: S cannot distinguish the two."
    return f"It reaches {share_of(mark)} of its ceiling."

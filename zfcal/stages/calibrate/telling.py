"""What a round tells those who look on: what was published, by which rule, and what it is worth."""

from __future__ import annotations

import math

from zfcal.artifacts.lineage import JSON
from zfcal.behaviour.ceilings import Ceiling
from zfcal.behaviour.scores import Scores
from zfcal.calibrate.rounds import RoundResult
from zfcal.calibrate.rules import SAYS
from zfcal.stages.events import Note


def fits_chance(result: RoundResult) -> bool:
    """Return whether a model scores more than windows of its own do.

    One that was made of the window then fits what happened there by chance as well.
    """
    _, _, high = result.ceiling.overall
    return bool(result.scores.overall > high)


def standing(result: RoundResult) -> dict[str, float]:
    """Return the mean forward score of each rule, best first; empty where none are judged."""
    means = {} if result.handed is None else result.handed.record.means()
    return dict(sorted(means.items(), key=lambda pair: -pair[1]))


def published_fields(result: RoundResult) -> dict[str, JSON]:
    """Return what the results of a round say of the model that it publishes."""
    return {
        "rule": result.rule,
        "above_ceiling": fits_chance(result),
        "forward": dict[str, JSON](standing(result)) or None,
    }


def published_note(result: RoundResult, end_s: int) -> Note:
    """Return one line for those who look on.

    Parameters
    ----------
    result
        Of the round.
    end_s
        End of its window.
    """
    parts = [f"Window to {end_s} s: publishes {_what(result, end_s)}.", _worth(result, end_s)]
    if means := standing(result):
        listed = ", ".join(f"{rule} {mean:.3f}" for rule, mean in means.items())
        parts.append(f"Forward scores so far: {listed}.")
    return Note(text=" ".join(parts))


def stretch_note(name: str, scores: Scores, ceiling: Ceiling) -> Note:
    """Return what a model is worth on a stretch of a trial, on one line.

    Parameters
    ----------
    name
        Of the stretch.
    scores, ceiling
        What the model scores there, and what it reaches against itself.
    """
    mean, low, high = ceiling.overall
    score = "S" if scores.named is None else "the score"
    band = f"{_three(low)} to {_three(high)}"
    text = f"{name}: {score} {_three(scores.overall)}, ceiling {_three(mean)} ({band})."
    return Note(text=text)


def _what(result: RoundResult, end_s: int) -> str:
    what = SAYS[result.rule]
    if result.handed is None:
        return what
    in_use = result.handed.record.in_use
    if in_use is not None and not _is_of(result, end_s):
        what = f"{what}, of the window to {in_use.of_s} s"
    return f"{what} (rule {result.rule}: {result.handed.choice.because})"


def _is_of(result: RoundResult, end_s: int) -> bool:
    """Return whether a model was made of the round's own window."""
    in_use = None if result.handed is None else result.handed.record.in_use
    return in_use is None or in_use.of_s == end_s


def _worth(result: RoundResult, end_s: int) -> str:
    mean, low, high = result.ceiling.overall
    name = "S" if result.scores.named is None else "The score"
    score = f"{name} {_three(result.scores.overall)}"
    band = f"{_three(low)} to {_three(high)}"
    if fits_chance(result):
        said = f"{score} is above the band of its ceiling, {_three(mean)} ({band})"
        return f"{said}: it fits chance." if _is_of(result, end_s) else f"{said}."
    return f"{score}, ceiling {_three(mean)} ({band})."


def _three(value: float) -> str:
    return "unknown" if math.isnan(value) else f"{value:.3f}"

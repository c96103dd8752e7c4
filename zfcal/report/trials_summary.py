"""What several trials say together, in plain words."""

from __future__ import annotations

import math
from collections.abc import Sequence

from zfcal.report.contents import Gap, Statement
from zfcal.report.numbers import mean_and_sd
from zfcal.report.standing import ABOVE, FITS_CHANCE, PERFECT, figure_of
from zfcal.report.summary import OVERFITTING, gaps
from zfcal.report.views import MODEL, PUBLISHED_S, Mark, TrialView


def gaps_of_trials(views: Sequence[TrialView]) -> list[Gap]:
    """Return what is missing in each of several trials, named."""
    return [
        Gap(what=f"{view.name}: {gap.what}", command=gap.command)
        for view in views
        for gap in gaps(view)
    ]


def statements_of_trials(views: Sequence[TrialView]) -> list[Statement]:
    """Return what there is to say about several trials together."""
    made = (_models(views), _robots(views))
    return [statement for statement in made if statement is not None]


def _models(views: Sequence[TrialView]) -> Statement | None:
    """Compare the settled part of the trials with their ceilings and with the published mean."""
    settled_s, published = PUBLISHED_S[-1]
    marks = [view.course(MODEL, "S").since(settled_s).mean() for view in views]
    known = [mark for mark in marks if not math.isnan(mark.value)]
    if not known:
        return None
    value, ceiling = (_spread([getattr(m, part) for m in known]) for part in ("value", "ceiling"))
    # Models that were made of other windows than they are scored on cannot overfit these.
    own = [2 * len(view.made_elsewhere) <= len(view.rounds) for view in views]
    above = sum(mark.value > mark.high and may for mark, may in zip(marks, own, strict=True))
    beside = f" The published mean over 10 trials is {published:.3f}, on the authors' own data."
    more = f" In {above} of them it lies above the range of a perfect model: {OVERFITTING}."
    return Statement(
        question="Do the models behave like the fish?",
        answer=f"In {len(known)} of {len(views)} trials, from {settled_s / 60:g} min on, the "
        f"calibrated model scores S = {value}; a perfect model would score {ceiling}."
        + (beside if any(view.published for view in views) else "")
        + (more if above else ""),
        figure=_figure(known, PERFECT, FITS_CHANCE if above else ABOVE),
    )


def _robots(views: Sequence[TrialView]) -> Statement | None:
    marks = [view.integration.robot["S"] for view in views if "S" in view.integration.robot]
    known = [mark for mark in marks if not math.isnan(mark.against_ceiling)]
    if not known:
        return None
    value, ceiling = (_spread([getattr(m, part) for m in known]) for part in ("value", "ceiling"))
    within = sum(mark.value >= mark.low for mark in known)
    return Statement(
        question="Do the robots move like fish?",
        answer=f"In {len(known)} trials with a robot it scores S = {value} against the fish, each "
        f"trial pooled; a fish in its place scores {ceiling}. In {within} of them the robot is "
        "within what fish differ from each other.",
        figure=_figure(
            known,
            "of what a fish in its place scores",
            "above the range of a fish in its place",
        ),
    )


def _figure(marks: Sequence[Mark], what: str, above: str) -> tuple[str, str]:
    """Return the number that stands out of those that have a ceiling, from their means."""
    with_ceiling = [mark for mark in marks if not math.isnan(mark.against_ceiling)]
    if not with_ceiling:
        return "", ""
    value, low, high, ceiling = (
        mean_and_sd([getattr(mark, part) for mark in with_ceiling])[0]
        for part in ("value", "low", "high", "ceiling")
    )
    return figure_of(Mark(value=value, low=low, high=high, ceiling=ceiling), what, above)


def _spread(values: Sequence[float]) -> str:
    """Return mean and sample standard deviation as text."""
    mean, sd = mean_and_sd(values)
    if math.isnan(mean):
        return "unknown"
    return f"{mean:.2f}" if math.isnan(sd) else f"{mean:.2f} ± {sd:.2f}"

"""What several trials say together, in plain words."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from zfcal.report.contents import Gap, Statement
from zfcal.report.numbers import mean_and_sd
from zfcal.report.summary import OVERFITTING, gaps
from zfcal.report.views import MODEL, PUBLISHED_S, TrialView


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
    share = [mark.against_ceiling for mark in known if not math.isnan(mark.against_ceiling)]
    above = sum(mark.value > mark.high and may for mark, may in zip(marks, own, strict=True))
    more = f" In {above} of them it lies above the range of a perfect model: {OVERFITTING}."
    return Statement(
        question="Do the models behave like the fish?",
        answer=f"In {len(known)} of {len(views)} trials, from {settled_s / 60:g} min on, the "
        f"calibrated model scores S = {value}; a perfect model would score {ceiling}. The "
        f"published mean over 10 trials is {published:.3f}, on the authors' own data."
        + (more if above else ""),
        figure=(f"{100 * float(np.mean(share)):.0f} %", "of what a perfect model would score")
        if share
        else ("", ""),
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
        figure=(
            f"{100 * float(np.mean([mark.against_ceiling for mark in known])):.0f} %",
            "of what a fish in its place scores",
        ),
    )


def _spread(values: Sequence[float]) -> str:
    """Return mean and sample standard deviation as text."""
    mean, sd = mean_and_sd(values)
    if math.isnan(mean):
        return "unknown"
    return f"{mean:.2f}" if math.isnan(sd) else f"{mean:.2f} ± {sd:.2f}"

"""What the figures say, in plain words for whoever keeps the fish.

Every sentence with a number that a model reaches names the ceiling beside it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from zfcal.behaviour.features.registry import SCORED, named
from zfcal.behaviour.histograms import frequencies
from zfcal.behaviour.statistics import Statistics
from zfcal.report.contents import Gap, Statement
from zfcal.report.distance_words import distance_statement
from zfcal.report.figures.parameters import outside_of
from zfcal.report.figures.statistics import histogram_mean
from zfcal.report.followed_words import followed_gap, followed_statement
from zfcal.report.integration import NOT_COMPARED
from zfcal.report.standing import (
    ABOVE,
    FITS_CHANCE,
    figure_of,
    is_above,
    sentence_of,
    share_of,
)
from zfcal.report.tracking_words import tracking_statement
from zfcal.report.views import FEATURE_NAMES, MODEL, ROBOT, SOCIAL, Course, Mark, TrialView

_NEAR = 0.97
"""Nearer to the ceiling than this, a part of the robot's score is not named."""

_NOTICED = 0.5
"""A shortfall of less than this share of the way from the ceiling to its interval's low end
is within what chance does to a perfect model."""

_NOTHING = 0.005
"""A score that is printed as 0.00 or below it."""

_FEW = 4
_LIKER = "above the range of a fish in its place"

OVERFITTING = "the model fits what happened there by chance as well (overfitting)"
"""What it means to score more than a perfect model does."""


def statements(view: TrialView) -> list[Statement]:
    """Return what there is to say about a trial, the most important first."""
    made = (
        _model(view),
        _named(view),
        _worst(view),
        distance_statement(view),
        _robot(view),
        followed_statement(view),
        tracking_statement(view),
        _halves(view),
        _parameters(view),
    )
    return [statement for statement in made if statement is not None]


def gaps(view: TrialView) -> list[Gap]:
    """Return what is missing in a trial, and which command makes it."""
    following = followed_gap(view)
    return [*_gaps(view), *([following] if following else [])]


def _gaps(view: TrialView) -> Iterator[Gap]:
    name = view.name
    if not view.tracked_s:
        yield Gap(
            what="There are no tracks.", command=f"zfcal import TRACKS.csv {name} --format csv"
        )
        return
    if not view.statistics:
        yield Gap(
            what=f"There are no statistics yet ({view.tracked_s:.0f} s of tracks; a window needs "
            "120 s).",
            command=f"zfcal analyse {name}",
        )
    elif view.calibrated is None:
        yield Gap(
            what="No model has been calibrated yet: nothing to compare the fish with.",
            command=f"zfcal calibrate {name}",
        )
    elif view.course(MODEL, "S").last is None:
        yield Gap(what="The model's scores are missing.", command=f"zfcal calibrate {name} --force")
    if _n_windows(view) == 1:
        yield Gap(what="There is a single window: scores over time need more of them.")
    for reason in view.integration.missing:
        if reason != NOT_COMPARED:
            yield Gap(what=reason)
        elif view.scoring == "legacy":
            what = f"{reason} The authors' scoring has no such comparison, the paper's has."
            yield Gap(what=what, command=f"zfcal analyse {name} --scoring paper")
        elif view.statistics:
            yield Gap(what=reason, command=f"zfcal analyse {name} --force")


def _n_windows(view: TrialView) -> int:
    counts = [
        int((~np.isnan(view.course(compared, "S").value)).sum())
        for compared in (MODEL, SOCIAL, ROBOT)
    ]
    return max(counts)


def _model(view: TrialView) -> Statement | None:
    course = view.course(MODEL, "S")
    if course.last is None:
        return None
    known = ~np.isnan(course.value)
    mean, last, n = course.mean(), course.mark(course.last), int(known.sum())
    above, elsewhere, within = _against_band(course, view.made_elsewhere)
    reaches = sentence_of(mean)
    parts = [
        f"Over {_windows(n)} the calibrated model scores S = {mean.value:.2f}; a perfect model "
        f"would score {mean.ceiling:.2f}, since windows of two minutes are too short for two of "
        f"them to be alike. {reaches}"
        if n > 1
        else f"In the only window the calibrated model scores S = {mean.value:.2f}; a perfect "
        f"model would score {mean.ceiling:.2f} (95 % of its windows between {mean.low:.2f} and "
        f"{mean.high:.2f}). {reaches}"
    ]
    if n > 1:
        parts.append(
            f"In the last window S = {last.value:.2f}, its ceiling {last.ceiling:.2f} "
            f"({last.low:.2f} to {last.high:.2f})."
        )
    if n > 1 and not np.isnan(course.low[known]).all():
        parts.append(
            f"In {within} of {_windows(n)} S lies where 95 % of a perfect model's own windows "
            "lie: there the score alone gives no reason to doubt the model."
        )
    elif within:
        parts.append("The score alone gives no reason to doubt the model.")
    if above:
        parts.append(f"In {above} of {_windows(n)} S lies above it: {OVERFITTING}.")
    if elsewhere:
        parts.append(
            f"In {elsewhere} of {_windows(n)} S of a model that was made of another window lies "
            "above it, which is no overfitting: such windows happen to be typical ones."
        )
    parts.extend(_hidden(view))
    return Statement(
        question="Does the model behave like these fish?",
        answer=" ".join(parts),
        figure=figure_of(mean, above=FITS_CHANCE if above >= elsewhere else ABOVE),
    )


def _against_band(course: Course, elsewhere: frozenset[int]) -> tuple[int, int, int]:
    """Return in how many windows a score is above the ceiling's range, and in how many within.

    Above are first those of models that were made of the window, then the others.
    """
    known = ~(np.isnan(course.value) | np.isnan(course.low))
    value, low, high = course.value[known], course.low[known], course.high[known]
    above = value > np.where(np.isnan(high), np.inf, high)
    other = np.isin(course.end_s[known], sorted(elsewhere))
    within = ~above & (value >= low)
    return int((above & ~other).sum()), int((above & other).sum()), int(within.sum())


def _named(view: TrialView) -> Statement | None:
    """Say what was calibrated on, where it is not S, and how far that came."""
    last = view.calibrated
    if last is None or last.score is None:
        return None
    mark = last.score
    return Statement(
        question="What was the model calibrated on?",
        answer=f"On the score of {', '.join(last.score_of)}, which is not S and not to be "
        f"compared with it. In the last window it is {mark.value:.2f}; a perfect model would score "
        f"{mark.ceiling:.2f} (95 % of its windows between {mark.low:.2f} and {mark.high:.2f}). "
        + (f"It lies above these: {OVERFITTING}. " if is_above(mark) else "")
        + "S above is of D, W, O and T alone, and was not optimised.",
        figure=figure_of(mark),
    )


def _hidden(view: TrialView) -> Iterator[str]:
    """Name the features below their own interval in most windows: the mean S can hide them."""
    for feature in SCORED:
        words = named(feature).phrase
        course = view.course(MODEL, feature)
        known = ~(np.isnan(course.value) | np.isnan(course.low))
        below = int((course.value[known] < course.low[known]).sum())
        if 2 * below > known.sum():
            yield (
                f"Yet {words} lie below their own such range in {below} of "
                f"{_windows(int(known.sum()))}: S hides it."
            )


def worst_features(view: TrialView) -> list[tuple[str, str | None, Mark]]:
    """Return in what the model differs from the fish, the worst first.

    Sorted by the distance to the ceiling, in widths of the ceiling's interval.

    Returns
    -------
    list of (feature, zone, mark)
        D, W and T zone by zone, O over all; means over the windows. Scores
        without a ceiling are left out, and those that a perfect model may miss altogether.
    """
    keys: list[tuple[str, str | None]] = [
        (feature, zone) for feature in "DWT" for zone in view.arena.zone_names
    ]
    found = [(f, z, view.course(MODEL, f, z).mean()) for f, z in [*keys, ("O", None)]]
    known = [row for row in found if not math.isnan(_shortfall(row[2]))]
    return sorted(known, key=lambda row: _shortfall(row[2]), reverse=True)


def _worst(view: TrialView) -> Statement | None:
    ranked = worst_features(view)
    if not ranked:
        return None
    feature, zone, mark = ranked[0]
    what = named(feature).phrase
    where = f" in the zone {zone}" if zone else ""
    if _shortfall(mark) < _NOTICED:
        reached = (
            "lie above the range of their ceiling, by chance"
            if is_above(mark)
            else f"still reach {share_of(mark)} of their ceiling"
        )
        answer = f"Nothing stands out: the least alike are {what}{where}, and they {reached}."
    else:
        answer = (
            f"Most of all {what}{where}: {mark.value:.2f} where a perfect model would "
            f"score {mark.ceiling:.2f}. {_direction(view, feature, zone)}"
        ).rstrip()
    return Statement(
        question="What differs most between model and fish?",
        answer=answer,
        figure=(FEATURE_NAMES[feature], f"in the zone {zone}" if zone else "over all zones"),
    )


def _direction(view: TrialView, feature: str, zone: str | None) -> str:
    """Say which way the last window's model and fish differ."""
    pair = _last_pair(view)
    if pair is None:
        return ""
    fish, model = pair
    if feature == "O":
        return _occupation_direction(fish, model)
    index = fish.zone_names.index(str(zone))
    if feature == "T":
        stay = [float(frequencies(s.transition)[index, index]) for s in (fish, model)]
        return _said("a fish was still there one step later {} of the time, the model's {}",
                     [f"{100 * share:.1f} %" for share in stay], stay)  # fmt: skip
    edges = named(feature).edges_in(view.arena)
    means = [histogram_mean(s.of(feature)[index], edges) for s in (fish, model)]
    what = "two fish there were {} apart" if feature == "D" else "fish there kept {} from the wall"
    return _said(what + " on average, the model's {}",
                 [f"{100 * mean:.1f} cm" for mean in means], means)  # fmt: skip


def _last_pair(view: TrialView) -> tuple[Statistics, Statistics] | None:
    if view.calibrated is None or view.model_statistics is None:
        return None
    fish = view.statistics.get((view.calibrated.second, "control"))
    return None if fish is None else (fish, view.model_statistics)


def _said(text: str, shown: Sequence[str], values: Sequence[float]) -> str:
    if any(math.isnan(value) for value in values):
        return "In the last window there are too few observations to say which way."
    return "In the last window " + text.format(*shown) + "."


def _occupation_direction(fish: Statistics, model: Statistics) -> str:
    shares = np.array([frequencies(fish.occupation), frequencies(model.occupation)])
    if np.isnan(shares).any():
        return ""
    index = int(np.argmax(np.abs(shares[0] - shares[1])))
    return _said(
        f"fish spent {{}} of their time in the zone {fish.zone_names[index]}, the model's {{}}",
        [f"{100 * share:.0f} %" for share in shares[:, index]],
        shares[:, index].tolist(),
    )


def _robot(view: TrialView) -> Statement | None:
    found = view.integration
    if not found.robot:
        return None
    mark = found.robot["S"]
    answer = (
        f"Pooled from {found.start_s / 60:g} to {found.end_s / 60:g} min the robot scores "
        f"S = {mark.value:.2f} against the fish. "
    )
    if math.isnan(mark.ceiling):
        return Statement(
            question="Does the robot move like a fish?",
            answer=answer + " ".join(found.missing),
            figure=(f"{mark.value:.2f}", "robot against fish; no ceiling"),
        )
    answer += (
        f"A fish put in the robot's place scores {mark.ceiling:.2f} on average "
        f"({mark.low:.2f} to {mark.high:.2f}, {mark.n} fish): "
    )
    answer += (
        "the robot is within what fish differ from each other."
        if mark.value >= mark.low
        else "the robot stands out more than fish do from each other."
    )
    least = min(
        (f for f in SCORED if f in found.robot and found.robot[f].against_ceiling > 0),
        key=lambda f: found.robot[f].against_ceiling,
        default=None,
    )
    if least is not None and found.robot[least].against_ceiling < _NEAR:
        part = found.robot[least]
        answer += (
            f" Least fish-like are {named(least).phrase}: {part.value:.2f} of {part.ceiling:.2f}."
        )
    return Statement(
        question="Does the robot move like a fish?",
        answer=answer,
        figure=figure_of(mark, "of what a fish in its place scores", _LIKER),
    )


def _halves(view: TrialView) -> Statement | None:
    halves = view.integration.halves
    if "S" not in halves:
        return None
    parts = ", ".join(f"{name} {halves[name]:.2f}" for name in "DWOT" if name in halves)
    return Statement(
        question="How alike are the fish to themselves?",
        answer=f"Every other minute of the recording against the minutes between: S = "
        f"{halves['S']:.2f} ({parts}). No model is in this number: a model that is pooled over "
        "as long a time has no reason to come nearer to these fish than they do themselves.",
        figure=(f"{halves['S']:.2f}", "S between two halves of the recording"),
    )


def _parameters(view: TrialView) -> Statement | None:
    last = view.calibrated
    if last is None or not last.intervals:
        return None
    n, unknown = len(last.intervals), sorted(last.unidentified)
    known = n - len(unknown)
    few = [name for name in last.intervals if name not in last.unidentified]
    answer = f"The last window pins down {known} of {n} parameters"
    if known and known <= _FEW:
        answer += f" ({', '.join(few)})"
    elif unknown and len(unknown) <= _FEW:
        answer += f" (not {', '.join(unknown)})"
    answer += ", by its likelihood." if last.intervals_by == "likelihood" else "."
    if unknown:
        answer += " Of the others many values fit as well: do not read a meaning into them."
    outside = sorted(outside_of(last))
    if outside:
        named_ = f" ({', '.join(outside)})" if len(outside) <= _FEW else ""
        answer += f" The published values of {len(outside)}{named_} lie outside their intervals."
    return Statement(
        question="Which parameters do the data pin down?",
        answer=answer,
        figure=(f"{known} of {n}", "parameters identified"),
    )


def _windows(n: int) -> str:
    return "1 window" if n == 1 else f"{n} windows"


def _shortfall(mark: Mark) -> float:
    """Return how far below its ceiling a score lies, in widths of the ceiling's interval.

    A zone that is seldom visited has a wide interval: there a low score means little. NaN
    where a perfect model may score next to nothing: there it means nothing.
    """
    width = mark.ceiling - mark.low
    says = width > 0 and mark.low >= _NOTHING
    return (mark.ceiling - mark.value) / width if says else float("nan")

"""The tables of the page: scores, parameters, trials, and where each file comes from."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from zfcal.artifacts.lineage import to_json
from zfcal.report.driven import driven_rows
from zfcal.report.figures.parameters import outside_of, values_of
from zfcal.report.standing import share_of
from zfcal.report.tracking_words import known_of
from zfcal.report.views import FEATURE_NAMES, MODEL, ROBOT, SOCIAL, Course, Mark, TrialView

_COMPARED = {
    MODEL: "model",
    SOCIAL: "fish with robot",
    ROBOT: "robot",
}
NONE = "–"
"""Stands for a number that is not there."""

_LONGEST_OPTIONS = 160
_SCORE_HEADS = ("mean", "last window", "ceiling", "of ceiling", "ceiling's 95 %")


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """A table of the page.

    Parameters
    ----------
    name
        Its anchor.
    title
        Its heading.
    heads
        Of the columns.
    rows
        Cells as text.
    numbers, wide
        Columns that stand to the right; columns that may break lines.
    folded
        What to press to see it; always open if empty.
    note
        How to read it.
    links
        Addresses to which the first cells of the rows lead; none without.
    """

    name: str
    title: str
    heads: Sequence[str]
    rows: Sequence[Sequence[str]]
    numbers: Sequence[int] = ()
    wide: Sequence[int] = ()
    folded: str = ""
    note: str = ""
    links: Sequence[str] = ()


def tables(view: TrialView) -> list[Table]:
    """Return the tables of one trial, those without a row left out."""
    made = (
        _scores(view),
        _scores_by_zone(view),
        _windows(view),
        _published(view),
        _rules(view),
        _parameters(view),
        _driven(view),
        lineage_table([view]),
    )
    return [table for table in made if table.rows]


def trials_table(views: Sequence[TrialView], links: Sequence[str] = ()) -> Table:
    """Return a row per trial: how it was tracked, its score, its ceiling and its robot.

    Parameters
    ----------
    views
        The trials.
    links
        Where the page of each is; none without.
    """
    rows = []
    for view in views:
        mean, robot = view.course(MODEL, "S").mean(), view.integration.robot.get("S")
        n = int((view.course(MODEL, "S").value >= 0).sum())
        halves = view.integration.halves.get("S", math.nan)
        rows.append(
            [
                view.name,
                f"{view.tracked_s / 60:.1f}",
                known_of(view) or NONE,
                str(n),
                *_cells(mean),
                *(_cells(robot) if robot is not None else (NONE,) * 3),
                number(halves),
            ]
        )
    heads = ("trial", "min", "fish known", "windows", "model S", "ceiling", "of ceiling",
             "robot S", "fish in its place", "of that", "S of two halves")  # fmt: skip
    return Table(
        name="trials",
        title="Trials",
        heads=heads,
        rows=rows,
        numbers=range(1, len(heads)),
        links=links,
        note="S of the model is the mean over the windows, S of the robot that of all windows "
        "together. Fish known: the share of the fish's positions that was tracked."
        + (" The name of a trial leads to its own page." if links else ""),
    )


def lineage_table(views: Sequence[TrialView]) -> Table:
    """Return a row per artifact that the report was made from, with its origin."""
    several = len(views) > 1
    rows = [
        [
            f"{view.name}/{source.path}" if several else source.path,
            source.lineage.command,
            source.lineage.version,
            NONE if source.lineage.seed is None else str(source.lineage.seed),
            str(source.n_inputs),
            source.sha256[:12],
            _short(to_json(dict(source.lineage.options))),
        ]
        for view in views
        for source in view.sources
    ]
    return Table(
        name="lineage",
        title="Where the files come from",
        heads=("file", "made by zfcal", "version", "seed", "inputs", "SHA-256", "options"),
        rows=rows,
        numbers=(3, 4),
        wide=(6,),
        folded="1 file" if len(rows) == 1 else f"{len(rows)} files",
        note="zfcal inspect FILE shows all of a file's origin.",
    )


def _scores(view: TrialView) -> Table:
    rows = [
        [_COMPARED[compared], feature, *_score_cells(view.course(compared, feature))]
        for compared in _COMPARED
        for feature in FEATURE_NAMES
        if view.course(compared, feature).last is not None
    ]
    return Table(
        name="numbers",
        title="Numbers",
        heads=("against the fish", "of", *_SCORE_HEADS),
        rows=rows,
        numbers=range(2, 7),
        note="Similarities between 0 and 1: D distances between fish, W distances to the wall, "
        "O time in each zone, T moves between zones, S all together. Ceiling and interval are "
        "those of the last window. 100 % is the ceiling; above is a score above the interval, "
        "which fits chance.",
    )


def _scores_by_zone(view: TrialView) -> Table:
    rows = [
        [_COMPARED[compared], feature, zone, *_score_cells(view.course(compared, feature, zone))]
        for compared in _COMPARED
        for feature in "DWT"
        for zone in view.arena.zone_names
        if view.course(compared, feature, zone).last is not None
    ]
    return Table(
        name="numbers-by-zone",
        title="Numbers by zone",
        heads=("against the fish", "of", "zone", *_SCORE_HEADS),
        rows=rows,
        numbers=range(3, 8),
        folded=f"{len(rows)} scores",
    )


def _score_cells(course: Course) -> list[str]:
    last = course.mark(course.last or 0)
    interval = NONE if math.isnan(last.low) else f"{last.low:.3f} to {last.high:.3f}"
    return [number(course.mean().value), *_cells(last), interval]


def _windows(view: TrialView) -> Table:
    shown = [key for key in _COMPARED if view.course(key, "S").last is not None]
    ends = sorted({int(end) for key in shown for end in view.course(key, "S").end_s})
    rows = []
    for end in ends:
        cells = []
        for key in shown:
            course = view.course(key, "S")
            at = [i for i, each in enumerate(course.end_s) if each == end]
            cells += list(_cells(course.mark(at[0]))[:2]) if at else [NONE, NONE]
        rows.append([str(end), *cells])
    heads = ["end (s)"]
    for key in shown:
        heads += [f"S, {_COMPARED[key]}", "ceiling"]
    return Table(
        name="windows",
        title="S of each window",
        heads=heads,
        rows=rows,
        numbers=range(len(heads)),
        folded="1 window" if len(rows) == 1 else f"{len(rows)} windows",
    )


def _parameters(view: TrialView) -> Table:
    last = view.calibrated
    rows = []
    by_likelihood = last is not None and last.intervals_by == "likelihood"
    if last is not None:
        outside = outside_of(last)
        for name, value in values_of(last).items():
            low, high = last.intervals.get(name, (math.nan, math.nan))
            interval = NONE if math.isnan(low) else f"{low:.3g} to {high:.3g}"
            interval += " (value outside)" if name in outside else ""
            known = "no" if name in last.unidentified else "yes" if last.intervals else NONE
            rows.append([name, f"{value:.3g}", interval, known])
    return Table(
        name="parameter-values",
        title="Parameters of the last round",
        heads=(
            "parameter",
            "value",
            "95 % interval" if by_likelihood else "values that fit as well",
            "identified",
        ),
        rows=rows,
        numbers=(1,),
        folded=f"{len(rows)} parameters",
        note="The interval is that of the window's likelihood, whichever model was published; the "
        "value is the published one. A parameter is identified where the interval is short."
        if by_likelihood
        else "The interval spans 95 % of the genomes of the round that agree with the window as "
        "well as the champion does.",
    )


def _published(view: TrialView) -> Table:
    """Return a row per round whose file says by which rule its model was published."""
    rows = [
        [
            str(each.second),
            each.published.rule,
            NONE if each.published.of_s is None else str(each.published.of_s),
            each.published.because,
        ]
        for each in view.rounds
        if each.published is not None
    ]
    return Table(
        name="published",
        title="Published models",
        heads=("end (s)", "rule", "made of the window to (s)", "because"),
        rows=rows,
        numbers=(0, 2),
        wide=(3,),
        folded="1 model" if len(rows) == 1 else f"{len(rows)} models",
        note="Which model the robot was given at the end of each window, and by which rule.",
    )


def _driven(view: TrialView) -> Table:
    heads = ["from (s)"]
    for latency in ("frame to state", "tick to byte"):
        heads += [f"{latency}, median (ms)", "95 %", "most"]
    return Table(
        name="drive",
        title="How quick the robot was driven",
        heads=[*heads, "steps missed", "ticks left out"],
        rows=list(driven_rows(view.driven)),
        numbers=range(9),
        note="From the writing of a frame to the driver's own state, and from the moment a tick "
        "was due to the return of the write of its last byte; not to what the radio sent. Aims: "
        "20 ms (95 %) each, and no step missed.",
    )


def _rules(view: TrialView) -> Table:
    rules = dict.fromkeys(each.rule for each in view.rule_scores)
    rows = []
    for rule in rules:
        scores = [each.score.value for each in view.rule_scores if each.rule == rule]
        mean, sd = mean_and_sd(scores)
        n = sum(not math.isnan(score) for score in scores)
        uses = sum(r.published is not None and r.published.rule == rule for r in view.rounds)
        rows.append([rule, str(n), number(mean), number(sd), str(uses)])
    return Table(
        name="rules-by-score",
        title="Forward score of each rule",
        heads=("rule", "windows", "mean", "standard deviation", "has published"),
        rows=rows,
        numbers=(1, 2, 3, 4),
        note="On the first window after a model was made, or would have been. It is not S.",
    )


def number(value: float) -> str:
    """Return a score as text."""
    return NONE if math.isnan(value) else f"{value:.3f}"


def mean_and_sd(values: Sequence[float]) -> tuple[float, float]:
    """Return the mean of what is known, and the standard deviation of the sample; NaN without."""
    known = [value for value in values if not math.isnan(value)]
    sd = float(np.std(known, ddof=1)) if len(known) > 1 else math.nan
    return (float(np.mean(known)) if known else math.nan), sd


def _cells(mark: Mark) -> tuple[str, str, str]:
    share = NONE if math.isnan(mark.against_ceiling) else share_of(mark)
    return number(mark.value), number(mark.ceiling), share


def _short(text: str) -> str:
    return text if len(text) <= _LONGEST_OPTIONS else text[: _LONGEST_OPTIONS - 3] + "..."

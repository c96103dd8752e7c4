"""Several trials interval by interval: the published figure in numbers."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields

import numpy as np

from zfcal.report.numbers import NONE, Table, mean_and_sd, number
from zfcal.report.views import FEATURE_NAMES, MODEL, PUBLISHED_S, ROBOT, SOCIAL, TrialView

_TITLES = {
    MODEL: "Model against fish, interval by interval",
    ROBOT: "Robot against fish, interval by interval",
    SOCIAL: "Fish with robot against the fish alone, interval by interval",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Interval:
    """One score of several trials at the end of one window; NaN where there is none.

    Parameters
    ----------
    compared, feature
        What is compared, and by what.
    end_s
        Second at which the windows end.
    n
        How many trials have it.
    mean, sd
        Over the trials; the standard deviation is that of a sample, NaN of a single trial.
    ceiling_mean, ceiling_sd
        The same of what a perfect match would score.
    published
        Mean of the 10 published trials, on the authors' own data; NaN unless one of the
        trials asks for it.
    """

    compared: str
    feature: str
    end_s: int
    n: int
    mean: float
    sd: float
    ceiling_mean: float
    ceiling_sd: float
    published: float


def intervals_of(views: Sequence[TrialView]) -> list[Interval]:
    """Return all intervals, sorted by what is compared, by feature and by time.

    Parameters
    ----------
    views
        The trials; where they differ in length, late intervals are of fewer.
    """
    return [
        each
        for compared in _TITLES
        for feature in FEATURE_NAMES
        for each in _course_of(views, compared, feature)
    ]


def _course_of(views: Sequence[TrialView], compared: str, feature: str) -> Iterator[Interval]:
    courses = [view.course(compared, feature) for view in views]
    asked = any(view.published for view in views)
    for end in sorted({int(end) for course in courses for end in course.end_s}):
        marks = [
            course.mark(int(i))
            for course in courses
            for i in np.flatnonzero((course.end_s == end) & ~np.isnan(course.value))
        ]
        if not marks:
            continue
        mean, sd = mean_and_sd([mark.value for mark in marks])
        ceiling_mean, ceiling_sd = mean_and_sd([mark.ceiling for mark in marks])
        is_published = (compared, feature) == (MODEL, "S") and asked
        yield Interval(
            compared=compared,
            feature=feature,
            end_s=end,
            n=len(marks),
            mean=mean,
            sd=sd,
            ceiling_mean=ceiling_mean,
            ceiling_sd=ceiling_sd,
            published=published_s(end) if is_published else math.nan,
        )


def published_s(end_s: int) -> float:
    """Return the published S of the window that ends then; NaN where none was given.

    >>> published_s(300), published_s(1800)
    (0.827, 0.85)
    """
    settled_s, settled = PUBLISHED_S[-1]
    return settled if end_s >= settled_s else dict(PUBLISHED_S).get(end_s, math.nan)


def intervals_csv(views: Sequence[TrialView]) -> str:
    """Return the intervals as CSV, a row each; what is not there is empty."""
    out = io.StringIO()
    names = [field.name for field in fields(Interval)]
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(names)
    for each in intervals_of(views):
        writer.writerow([_plain(getattr(each, name)) for name in names])
    return out.getvalue()


def interval_tables(views: Sequence[TrialView]) -> list[Table]:
    """Return a table per comparison, a row per interval; those without a row left out."""
    found = intervals_of(views)
    published = any(view.published for view in views)
    made = [
        _table(compared, [i for i in found if i.compared == compared], published=published)
        for compared in _TITLES
    ]
    return [table for table in made if table.rows]


def _table(compared: str, found: Sequence[Interval], *, published: bool) -> Table:
    at = {(each.end_s, each.feature): each for each in found}
    ends = sorted({each.end_s for each in found})
    rows = [[str(end), *_row([at.get((end, name)) for name in FEATURE_NAMES])] for end in ends]
    heads = ["end (s)", "trials", *FEATURE_NAMES, "ceiling of S"]
    if compared == MODEL and published:
        heads.append("published S")
        for row, end in zip(rows, ends, strict=True):
            row.append(number(published_s(end)))
    return Table(
        name=f"intervals-{compared}",
        title=_TITLES[compared],
        heads=heads,
        rows=rows,
        numbers=range(len(heads)),
        folded="1 interval" if len(rows) == 1 else f"{len(rows)} intervals",
        note="Mean ± standard deviation over the trials. With the ceilings of all features they "
        "stand in intervals.csv.",
    )


def _row(found: Sequence[Interval | None]) -> list[str]:
    """Return the number of trials, each feature, and the ceiling of the last one, S."""
    n = max(each.n for each in found if each is not None)
    last = found[-1]
    cells = [NONE if each is None else _spread(each.mean, each.sd) for each in found]
    return [str(n), *cells, NONE if last is None else _spread(last.ceiling_mean, last.ceiling_sd)]


def _spread(mean: float, sd: float) -> str:
    return number(mean) if math.isnan(sd) else f"{mean:.3f} ± {sd:.3f}"


def _plain(value: float | str) -> str:
    if isinstance(value, float):
        return "" if math.isnan(value) else f"{value:.6g}"
    return str(value)

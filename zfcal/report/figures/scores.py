"""The published figure: similarity scores over the windows of a trial, or of several.

For one trial the score of each window with its ceiling; over several trials the
mean, and the standard deviation as a grey band, as Cazenille et al. show it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from zfcal.arrays import Floats, Ints
from zfcal.report.figures import theme
from zfcal.report.figures.panels import Entry, Panel, Picture
from zfcal.report.views import (
    FEATURE_NAMES,
    MODEL,
    NO_COURSE,
    PUBLISHED_S,
    ROBOT,
    SOCIAL,
    Course,
    CourseKey,
    TrialView,
)

_COLOURS = MappingProxyType({MODEL: theme.MODEL, SOCIAL: theme.GROUP, ROBOT: theme.ROBOT})
_NAMES = MappingProxyType(
    {
        MODEL: "calibrated model against the fish",
        SOCIAL: "fish with robot against the fish alone",
        ROBOT: "robot against the fish",
    }
)
_CEILINGS = MappingProxyType(
    {
        MODEL: "ceiling: a perfect model",
        SOCIAL: "ceiling",
        ROBOT: "ceiling: a fish in the robot's place",
    }
)
_BANDS = MappingProxyType(
    {
        MODEL: "95 % of a perfect model's windows",
        SOCIAL: "95 % of the ceiling's",
        ROBOT: "95 % of the fish in its place",
    }
)
_S_PER_MIN = 60.0
_HALF_WIDTH_MIN = 0.5
_MAX_MARKERS = 40


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Line:
    """What is drawn of one score: over several trials the mean and its spread.

    Parameters
    ----------
    end_s : ndarray, shape (window,)
    value, low, high, ceiling : ndarray, shape (window,)
        NaN where there is none; ``low`` and ``high`` bound the band.
    n_trials : ndarray of int, shape (window,)
        How many trials have a value for the window.
    """

    end_s: Ints
    value: Floats
    low: Floats
    high: Floats
    ceiling: Floats
    n_trials: Ints


def scores_picture(
    views: Sequence[TrialView], compared: Sequence[str], *, name: str, title: str, short: str
) -> Picture | None:
    """Return the figure of some comparisons, a panel per feature; None without any score.

    Parameters
    ----------
    views
        One trial or several.
    compared
        What to draw, such as ``model-vs-control``.
    name, title, short
        Of the picture.
    """
    shown = [key for key in compared if any(_has(view, key) for view in views)]
    if not shown:
        return None
    lines: dict[CourseKey, Line] = {
        (key, feature, None): pool([view.course(key, feature) for view in views])
        for key in shown
        for feature in FEATURE_NAMES
    }
    bottom = _bottom(list(lines.values()))
    panels = [
        Panel(
            title=text,
            alt=_describe(text, {key: lines[key, feature, None] for key in shown}),
            draw=partial(_draw, lines=_of_feature(lines, feature), feature=feature, bottom=bottom),
        )
        for feature, text in FEATURE_NAMES.items()
    ]
    several = len(views) > 1
    return Picture(
        name=name,
        short=short,
        title=title + (f", {len(views)} trials" if several else ""),
        panels=panels,
        key=_key(lines, shown, several=several),
        note=_note(shown, several=several),
    )


def pool(courses: Sequence[Course]) -> Line:
    """Return one trial's course as it is, or the mean and sd over several trials.

    Parameters
    ----------
    courses
        Of the same score, one per trial. Windows are matched by their end.

    Returns
    -------
    Line
        With several trials ``low`` and ``high`` are the mean less and plus one
        sample standard deviation (n - 1), NaN where a single trial has a value.
    """
    if len(courses) == 1:
        (only,) = courses
        return Line(
            end_s=only.end_s,
            value=only.value,
            low=only.low,
            high=only.high,
            ceiling=only.ceiling,
            n_trials=(~np.isnan(only.value)).astype(np.int64),
        )
    end_s = np.unique(np.concatenate([course.end_s for course in courses] or [NO_COURSE.end_s]))
    value, ceiling = (_spread(courses, end_s, part) for part in ("value", "ceiling"))
    mean, n_trials = _mean(value)
    squares, _ = _mean((value - mean) ** 2)
    sd = np.sqrt(squares * n_trials / np.where(n_trials > 1, n_trials - 1, np.nan))
    return Line(
        end_s=end_s,
        value=mean,
        low=mean - sd,
        high=mean + sd,
        ceiling=_mean(ceiling)[0],
        n_trials=n_trials,
    )


def _spread(courses: Sequence[Course], end_s: Ints, part: str) -> Floats:
    """Return one column of all courses on common windows, shape (trial, window)."""
    table = np.full((len(courses), len(end_s)), np.nan)
    for row, course in zip(table, courses, strict=True):
        row[np.searchsorted(end_s, course.end_s)] = getattr(course, part)
    return table


def _mean(table: Floats) -> tuple[Floats, Ints]:
    known = ~np.isnan(table)
    n = known.sum(axis=0)
    total = np.where(known, table, 0.0).sum(axis=0)
    return np.where(n > 0, total / np.where(n > 0, n, 1), np.nan), n.astype(np.int64)


def _has(view: TrialView, compared: str) -> bool:
    return any(view.course(compared, feature).last is not None for feature in FEATURE_NAMES)


def _of_feature(lines: dict[CourseKey, Line], feature: str) -> dict[str, Line]:
    return {compared: line for (compared, of, _), line in lines.items() if of == feature}


def _bottom(lines: Sequence[Line]) -> float:
    """Return where the score axis begins: the same for all panels, one half or less."""
    parts = [getattr(line, part) for line in lines for part in ("value", "low", "ceiling")]
    values = np.concatenate(parts)
    least = float(np.nanmin(values)) if not np.isnan(values).all() else 0.5
    return max(0.0, min(0.5, math.floor((least - 0.04) * 10) / 10))


def _draw(axes: Axes, *, lines: dict[str, Line], feature: str, bottom: float) -> None:
    for compared, line in lines.items():
        _draw_line(axes, line, _COLOURS[compared], own_band=len(lines) > 1)
    ends_s = np.concatenate([line.end_s[~np.isnan(line.value)] for line in lines.values()])
    if not ends_s.size:
        axes.text(0.5, 0.5, "no count on either side", ha="center", transform=axes.transAxes)
    if feature == "S" and MODEL in lines:
        _draw_published(axes, ends_s)
    last_min = float(ends_s.max(initial=0.0)) / _S_PER_MIN
    first_min = float(ends_s.min(initial=120.0)) / _S_PER_MIN
    axes.set(xlabel="end of the window (min)", ylabel="similarity", ylim=(bottom, 1.02))
    axes.set_xlim(min(2.0, first_min) - 0.7, max(last_min, first_min + 1) + 0.7)
    axes.xaxis.set_major_locator(MaxNLocator(7, integer=True))


def _draw_line(axes: Axes, line: Line, colour: str, *, own_band: bool) -> None:
    minute = line.end_s / _S_PER_MIN
    x, low, high, ceiling = minute, line.low, line.high, line.ceiling
    if len(minute) == 1:
        # A band and a line need some width to be seen.
        x = np.array([minute[0] - _HALF_WIDTH_MIN, minute[0] + _HALF_WIDTH_MIN])
        low, high, ceiling = (np.repeat(part, 2) for part in (low, high, ceiling))
    band = colour if own_band else theme.BAND
    axes.fill_between(x, low, np.minimum(high, 1.0), color=band, alpha=0.3, lw=0)
    axes.plot(x, ceiling, color=band, ls="--", lw=1.4)
    marker = theme.MARKER_OF[colour] if len(minute) <= _MAX_MARKERS else ""
    axes.plot(minute, line.value, color=colour, marker=marker)


def _draw_published(axes: Axes, ends_s: Ints) -> None:
    last_s = max(int(ends_s.max(initial=0)), PUBLISHED_S[-1][0])
    seconds, values = zip(*PUBLISHED_S, strict=True)
    minutes = [second / _S_PER_MIN for second in seconds]
    axes.plot([minutes[-1], last_s / _S_PER_MIN], [values[-1]] * 2, color=theme.INK, ls=":")
    axes.plot(
        minutes, values, color=theme.INK, ls="none", marker="D", mfc=theme.GROUND, ms=5, zorder=5
    )


def _key(lines: dict[CourseKey, Line], shown: Sequence[str], *, several: bool) -> tuple[Entry, ...]:
    mean = "mean over trials: " if several else ""
    entries = [
        Entry(
            label=mean + _NAMES[key],
            colour=_COLOURS[key],
            mark="line",
            marker=theme.MARKER_OF[_COLOURS[key]],
        )
        for key in shown
    ]
    single = len(shown) == 1
    if any(not np.isnan(line.low).all() for line in lines.values()):
        text = "one standard deviation" if several else _BANDS[shown[-1]]
        colour = theme.BAND if single else _COLOURS[shown[-1]]
        entries.append(Entry(label=text, colour=colour, mark="band"))
    if any(not np.isnan(line.ceiling).all() for line in lines.values()):
        text = ("mean " if several else "") + _CEILINGS[shown[-1]]
        colour = theme.BAND if single else _COLOURS[shown[-1]]
        entries.append(Entry(label=text, colour=colour, mark="dash"))
    if MODEL in shown:
        entries.append(
            Entry(label="published S (10 trials)", colour=theme.INK, mark="reference", marker="D")
        )
    return tuple(entries)


def _note(shown: Sequence[str], *, several: bool) -> str:
    parts = ["1 means the same behaviour, 0 nothing in common."]
    if MODEL in shown:
        parts.append(
            "The ceiling is what a perfect model would score on windows of 120 s, which are too "
            "short for two of them to be alike; the published values are the authors' own, "
            "computed on their data."
        )
    if ROBOT in shown:
        parts.append(
            "The robot is judged over all the time from 5 min up to the end of the window. When "
            "the group with the robot is compared with the fish alone, the fish stand on both "
            "sides, so that this line hardly sees the robot: look at the robot's own."
        )
    if several:
        parts.append("Where trials differ in length, late windows are of fewer trials.")
    return " ".join(parts)


def _describe(text: str, lines: dict[str, Line]) -> str:
    said = []
    for compared, line in lines.items():
        known = ~np.isnan(line.value)
        if known.any():
            values = line.value[known]
            said.append(
                f"{_NAMES[compared]}: {known.sum()} windows, first {values[0]:.2f}, last "
                f"{values[-1]:.2f}, mean {values.mean():.2f}"
            )
    return f"{text} over time. " + ("; ".join(said) or "No value") + "."

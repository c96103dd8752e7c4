"""Similarity scores over the windows of a trial, or of several, with their ceilings.

Grey is the ceiling and its range in every panel; the spread over trials has the colour of
the score. Scores have the whole axis from 0 to 1, so that what looks large is large.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

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
        MODEL: "ceiling: mean of a perfect model",
        SOCIAL: "ceiling",
        ROBOT: "ceiling: mean of a fish in the robot's place",
    }
)
_RANGES = MappingProxyType(
    {
        MODEL: "95 % of a perfect model's windows",
        SOCIAL: "95 % of the ceiling's",
        ROBOT: "95 % of the fish in its place",
    }
)
_S_PER_MIN = 60.0
_HALF_WIDTH_MIN = 0.5
_MAX_MARKERS = 40


@dataclass(frozen=True, slots=True, kw_only=True)
class _Shown:
    """What a figure is of: a comparison, of one trial or several, beside published scores."""

    compared: str
    several: bool
    published: bool


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Line:
    """What is drawn of one score: over several trials the mean and its spread.

    Parameters
    ----------
    end_s : ndarray, shape (window,)
    value, low, high, ceiling : ndarray, shape (window,)
        NaN where there is none; ``low`` and ``high`` bound the range of the ceiling.
    sd : ndarray, shape (window,)
        Standard deviation of the value over the trials; NaN of a single one.
    n_trials : ndarray of int, shape (window,)
        How many trials have a value for the window.
    """

    end_s: Ints
    value: Floats
    low: Floats
    high: Floats
    ceiling: Floats
    sd: Floats
    n_trials: Ints


def scores_picture(
    views: Sequence[TrialView], compared: str, *, name: str, title: str, short: str
) -> Picture | None:
    """Return the figure of a comparison, a panel per feature; None without any score.

    Parameters
    ----------
    views
        One trial or several. Published scores are drawn where one of them says so.
    compared
        What to draw, such as ``model-vs-control``.
    name, title, short
        Of the picture.
    """
    if not any(_has(view, compared) for view in views):
        return None
    lines = {
        feature: pool([view.course(compared, feature) for view in views])
        for feature in FEATURE_NAMES
    }
    shown = _Shown(
        compared=compared,
        several=len(views) > 1,
        published=compared == MODEL and any(view.published for view in views),
    )
    panels = [
        Panel(
            title=text,
            alt=_describe(text, compared, lines[feature]),
            draw=partial(
                _draw,
                line=lines[feature],
                colour=_COLOURS[compared],
                published=shown.published and feature == "S",
            ),
        )
        for feature, text in FEATURE_NAMES.items()
    ]
    return Picture(
        name=name,
        short=short,
        title=title + (f", {len(views)} trials" if shown.several else ""),
        panels=panels,
        key=_key(list(lines.values()), shown),
        note=_note(shown),
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
        With several trials all are means, and ``sd`` is the sample standard deviation
        (n - 1), NaN where a single trial has a value.
    """
    if len(courses) == 1:
        (only,) = courses
        return Line(
            end_s=only.end_s,
            value=only.value,
            low=only.low,
            high=only.high,
            ceiling=only.ceiling,
            sd=np.full(len(only.value), np.nan),
            n_trials=(~np.isnan(only.value)).astype(np.int64),
        )
    end_s = np.unique(np.concatenate([course.end_s for course in courses] or [NO_COURSE.end_s]))
    value, low, high, ceiling = (
        _spread(courses, end_s, part) for part in ("value", "low", "high", "ceiling")
    )
    mean, n_trials = _mean(value)
    squares, _ = _mean((value - mean) ** 2)
    return Line(
        end_s=end_s,
        value=mean,
        low=_mean(low)[0],
        high=_mean(high)[0],
        ceiling=_mean(ceiling)[0],
        sd=np.sqrt(squares * n_trials / np.where(n_trials > 1, n_trials - 1, np.nan)),
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


def _draw(axes: Axes, *, line: Line, colour: str, published: bool) -> None:
    known = ~np.isnan(line.value)
    ends_s = line.end_s[known]
    if not ends_s.size:
        axes.text(0.5, 0.5, "no count on either side", ha="center", transform=axes.transAxes)
    _draw_ceiling(axes, line)
    _draw_line(axes, line, colour)
    if published:
        _draw_published(axes, ends_s)
    last_min = float(ends_s.max(initial=0.0)) / _S_PER_MIN
    first_min = float(ends_s.min(initial=120.0)) / _S_PER_MIN
    axes.set(xlabel="end of the window (min)", ylabel="similarity", ylim=(0.0, 1.02))
    axes.set_yticks(np.linspace(0.0, 1.0, 6))
    axes.set_xlim(min(2.0, first_min) - 0.7, max(last_min, first_min + 1) + 0.7)
    axes.xaxis.set_major_locator(MaxNLocator(7, integer=True))


def _draw_ceiling(axes: Axes, line: Line) -> None:
    x, (low, high, ceiling) = _wide(line, line.low, line.high, line.ceiling)
    axes.fill_between(x, low, np.minimum(high, 1.0), color=theme.BAND, alpha=0.3, lw=0)
    axes.plot(x, ceiling, color=theme.BAND, ls="--", lw=1.4)


def _draw_line(axes: Axes, line: Line, colour: str) -> None:
    x, (low, high) = _wide(line, line.value - line.sd, line.value + line.sd)
    axes.fill_between(x, np.maximum(low, 0.0), np.minimum(high, 1.0), color=colour, alpha=0.3, lw=0)
    minute = line.end_s / _S_PER_MIN
    marker = theme.MARKER_OF[colour] if len(minute) <= _MAX_MARKERS else ""
    axes.plot(minute, line.value, color=colour, marker=marker)
    above = _is_above(line)
    axes.plot(
        minute[above],
        line.value[above],
        color=colour,
        ls="none",
        marker=theme.MARKER_OF[colour],
        mfc=theme.GROUND,
        zorder=3,
    )


def _is_above(line: Line) -> NDArray[np.bool_]:
    """Return which windows score more than the range of their ceiling, shape (window,)."""
    return np.nan_to_num(line.value, nan=-1.0) > np.nan_to_num(line.high, nan=np.inf)


def _wide(line: Line, *parts: Floats) -> tuple[Floats, tuple[Floats, ...]]:
    """Return minutes and what is drawn there; a single window gets some width to be seen."""
    minute = line.end_s / _S_PER_MIN
    if len(minute) != 1:
        return minute, parts
    x = np.array([minute[0] - _HALF_WIDTH_MIN, minute[0] + _HALF_WIDTH_MIN])
    return x, tuple(np.repeat(part, 2) for part in parts)


def _draw_published(axes: Axes, ends_s: Ints) -> None:
    last_s = max(int(ends_s.max(initial=0)), PUBLISHED_S[-1][0])
    seconds, values = zip(*PUBLISHED_S, strict=True)
    minutes = [second / _S_PER_MIN for second in seconds]
    axes.plot([minutes[-1], last_s / _S_PER_MIN], [values[-1]] * 2, color=theme.INK, ls=":")
    axes.plot(minutes, values, color=theme.INK, ls="none", marker="D", mfc=theme.GROUND, zorder=5)


def _key(lines: Sequence[Line], shown: _Shown) -> tuple[Entry, ...]:
    colour = _COLOURS[shown.compared]
    marker = theme.MARKER_OF[colour]
    mean = "mean over trials: " if shown.several else ""
    entries = [
        Entry(label=mean + _NAMES[shown.compared], colour=colour, mark="line", marker=marker)
    ]
    if any(not np.isnan(line.sd).all() for line in lines):
        entries.append(Entry(label="± standard deviation over trials", colour=colour, mark="band"))
    if any(not np.isnan(line.ceiling).all() for line in lines):
        entries.append(Entry(label=_CEILINGS[shown.compared], colour=theme.BAND, mark="dash"))
    if any(not np.isnan(line.low).all() for line in lines):
        entries.append(Entry(label=_RANGES[shown.compared], colour=theme.BAND, mark="band"))
    if any(_is_above(line).any() for line in lines):
        label = "above that range" + (": fits chance" if shown.compared == MODEL else "")
        entries.append(Entry(label=label, colour=colour, mark="hollow", marker=marker))
    if shown.published:
        entries.append(
            Entry(label="published S (10 trials)", colour=theme.INK, mark="reference", marker="D")
        )
    return tuple(entries)


def _note(shown: _Shown) -> str:
    parts = ["1 means the same behaviour, 0 nothing in common."]
    if shown.compared == MODEL:
        parts.append(
            "The ceiling is what a perfect model would score on windows of 120 s, which are too "
            "short for two of them to be alike: half of its windows score less and half more. "
            "What lies above its range is no better model, it fits chance."
        )
    if shown.published:
        parts.append(
            "The published values are the authors' own, computed on their data: other fish, and "
            "another ceiling."
        )
    if shown.compared in {ROBOT, SOCIAL}:
        parts.append("The robot is judged over all the time from 5 min up to the window's end.")
    if shown.compared == SOCIAL:
        parts.append(
            "The fish stand on both sides here, so that this score hardly sees the robot: look at "
            "the robot's own."
        )
    if shown.several:
        parts.append("Where trials differ in length, late windows are of fewer trials.")
    return " ".join(parts)


def _describe(text: str, compared: str, line: Line) -> str:
    known = ~np.isnan(line.value)
    if not known.any():
        return f"{text} over time. No value."
    values, ceilings = line.value[known], line.ceiling[known]
    said = (
        f"{text} over time. {_NAMES[compared]}: {known.sum()} windows, first {values[0]:.2f}, "
        f"last {values[-1]:.2f}, mean {values.mean():.2f}"
    )
    if not np.isnan(ceilings).any():
        low, high = line.low[known].mean(), line.high[known].mean()
        said += f"; mean ceiling {ceilings.mean():.2f}, its range {low:.2f} to {high:.2f}"
    return said + "."

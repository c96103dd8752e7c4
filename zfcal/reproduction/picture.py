"""The published figure: similarity over the windows, ours drawn with the published values."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from zfcal.arrays import Floats
from zfcal.report.figures import theme
from zfcal.report.figures.panels import Entry, Panel, Picture
from zfcal.report.numbers import mean_and_sd
from zfcal.reproduction.document import Way
from zfcal.reproduction.reference import Reference

_PANELS = (
    ("D", "D: distances between fish"),
    ("W", "W: distances to the wall"),
    ("O", "O: zones"),
    ("T", "T: changes of zone"),
    ("S", "S: all four"),
)
_COLOURS = (theme.MODEL, theme.FISH, theme.ROBOT, theme.GROUP)
_STYLES = ("-", "--", "-.", ":")
_S_PER_MIN = 60.0


def reproduction_picture(ways: Sequence[Way], reference: Reference) -> Picture:
    """Return five panels: means over trials, the first way with its standard deviation.

    Parameters
    ----------
    ways
        Up to four.
    reference
        Its values are drawn as hollow diamonds.
    """
    key = [
        Entry(
            label=f"{way.name}: mean over {len(way.courses)} trials",
            colour=colour,
            mark="line",
            marker=theme.MARKER_OF[colour],
        )
        for way, colour in zip(ways, _COLOURS, strict=False)
    ]
    key += [
        Entry(label="its standard deviation over trials", colour=_COLOURS[0], mark="band"),
        Entry(
            label=f"published mean ({reference.n_trials} trials)",
            colour=theme.INK,
            mark="reference",
            marker="D",
        ),
    ]
    return Picture(
        name="reproduction",
        title="Model against fish: the published figure, and ours",
        panels=[
            Panel(
                title=title,
                alt=_describe(title, feature, ways, reference),
                draw=partial(_draw, ways=ways, reference=reference, feature=feature),
            )
            for feature, title in _PANELS
        ],
        key=key,
        note="1 means the same behaviour. Published values are of the authors' own trials.",
    )


def _draw(axes: Axes, *, ways: Sequence[Way], reference: Reference, feature: str) -> None:
    least = 0.5
    for way, colour, style in zip(ways, _COLOURS, _STYLES, strict=False):
        ends, mean, sd = _course(way, feature)
        minutes = ends / _S_PER_MIN
        if way is ways[0]:
            low, high = mean - sd, np.minimum(mean + sd, 1.0)
            axes.fill_between(minutes, low, high, color=colour, alpha=0.2, lw=0)
            least = min(least, *np.nan_to_num(low, nan=1.0), 1.0)
        marker = theme.MARKER_OF[colour]
        axes.plot(minutes, mean, color=colour, ls=style, marker=marker, ms=3)
        least = min(least, *np.nan_to_num(mean, nan=1.0), 1.0)
    ends_s = sorted({end for way in ways for end in way.ends_s})
    values = ((end / _S_PER_MIN, reference.published(feature, end)) for end in ends_s)
    known = [(minute, value) for minute, value in values if not math.isnan(value)]
    if known:
        x, y = zip(*known, strict=True)
        axes.plot(x, y, color=theme.INK, ls="none", marker="D", mfc=theme.GROUND, ms=5, zorder=5)
        least = min(least, *y)
    bottom = max(0.0, math.floor((least - 0.02) * 10) / 10)
    axes.set(xlabel="end of the window (min)", ylabel="similarity", ylim=(bottom, 1.02))
    axes.xaxis.set_major_locator(MaxNLocator(7, integer=True))


def _course(way: Way, feature: str) -> tuple[Floats, Floats, Floats]:
    rows = [(end, way.values(feature, end)) for end in way.ends_s]
    rows = [(end, values) for end, values in rows if values]
    mean, sd = np.array([mean_and_sd(values) for _, values in rows]).reshape(-1, 2).T
    return np.array([end for end, _ in rows], dtype=np.float64), mean, sd


def _describe(title: str, feature: str, ways: Sequence[Way], reference: Reference) -> str:
    said = []
    for way in ways:
        _, mean, _ = _course(way, feature)
        if len(mean):
            said.append(f"{way.name}: first {mean[0]:.2f}, last {mean[-1]:.2f}")
    values = [reference.published(feature, end) for end in ways[0].ends_s]
    values = [value for value in values if not math.isnan(value)]
    if values:
        said.append(f"published: from {values[0]:.2f} to {values[-1]:.2f}")
    return f"{title} over time. " + "; ".join(said) + "."

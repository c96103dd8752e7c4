"""The picture of a comparison: differences with their intervals, and every trial as a dot.

All rows share one axis, in standard deviations between trials: zero is the mean of B, and a
trial lies where its value lies on the scale on which the two means are g apart.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from zfcal.report.comparison.table import p_text
from zfcal.report.figures import theme
from zfcal.report.figures.panels import Entry, Panel, Picture

_ROW_IN = 0.34
_WIDTH_IN = 8.4
_LEAST_REACH = 3.0
_MOST_REACH = 12.0
"""Beyond this a point is drawn at the edge: one huge difference must not hide the others."""

_UP = 0.23
"""How far the dots of A lie above the line of a row, and those of B below."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Row:
    """A row of the picture, on the axis of g."""

    label: str
    a: Sequence[float]
    b: Sequence[float]
    g: float
    low: float
    high: float
    p_family: float | None
    is_found: bool


def comparison_picture(document: Mapping[str, Any]) -> Picture | None:
    """Return the picture of a comparison; None where no statistic has an effect size.

    Parameters
    ----------
    document
        From `compare_document`.
    """
    alpha = document["test"]["alpha"]
    rows = [_row(each, alpha) for each in document["statistics"] if each["g"] is not None]
    if not rows:
        return None
    n_a, n_b = len(document["sets"]["A"]), len(document["sets"]["B"])
    tested = document["test"]["tested"]
    panel = Panel(
        title="A less B, in standard deviations between trials",
        alt=_describe(rows),
        draw=partial(_draw, rows=rows[::-1]),
        size_in=(_WIDTH_IN, 0.9 + _ROW_IN * len(rows)),
    )
    return Picture(
        name="compare",
        title=f"{n_a} trials (A) against {n_b} (B)",
        panels=(panel,),
        columns=1,
        key=(
            Entry(label="a trial of A", colour=theme.FISH, mark="points", marker="o"),
            Entry(label="a trial of B", colour=theme.MODEL, mark="points", marker="^"),
            *(_KEY if tested else (_UNTESTED,)),
        ),
    )


_KEY = (
    Entry(label="g, 95 %: p of all up to 0.05", colour=theme.INK, mark="line", marker="D"),
    Entry(label="g, 95 %: above, or not tested", colour=theme.INK, mark="hollow", marker="D"),
)
_UNTESTED = Entry(label="g, 95 %: nothing was tested", colour=theme.INK, mark="hollow", marker="D")


def _row(row: Mapping[str, Any], alpha: float) -> _Row:
    a, b = row["A"], row["B"]
    # The scale on which the means are g apart; without a difference that of B's and A's spread.
    scale = row["g"] / row["difference"] if row["difference"] else _inverse_spread(a, b)
    low, high = row["g_interval"]
    p_family = row["p_family"]
    return _Row(
        label=row["label"] + (f" ({row['unit']})" if row["unit"] else ""),
        a=[(value - b["mean"]) * scale for value in a["values"] if value is not None],
        b=[(value - b["mean"]) * scale for value in b["values"] if value is not None],
        g=row["g"],
        low=low,
        high=high,
        p_family=p_family,
        is_found=p_family is not None and p_family <= alpha,
    )


def _inverse_spread(a: Mapping[str, Any], b: Mapping[str, Any]) -> float:
    return 1 / math.sqrt((a["sd"] ** 2 + b["sd"] ** 2) / 2)


def _reach(rows: Sequence[_Row]) -> tuple[float, float]:
    """Return the ends of the axis: all points and intervals, unless they lie very far out."""
    points = np.array([x for row in rows for x in (*row.a, *row.b, row.low, row.high)])
    low, high = float(points.min()), float(points.max())
    return (
        -min(max(-low, _LEAST_REACH), _MOST_REACH) - 0.4,
        min(max(high, _LEAST_REACH), _MOST_REACH) + 0.4,
    )


def _draw(axes: Axes, *, rows: Sequence[_Row]) -> None:
    ends = _reach(rows)
    axes.axvline(0, color=theme.MUTED, lw=0.8)
    for at, row in enumerate(rows):
        axes.plot(np.clip([row.low, row.high], *ends), [at, at], color=theme.INK, lw=1.6, zorder=2)
        for values, offset, colour in ((row.a, _UP, theme.FISH), (row.b, -_UP, theme.MODEL)):
            _draw_dots(axes, values, at + offset, colour, ends)
        _draw_effect(axes, row, at, ends)
        if row.p_family is not None:
            _beside(axes, at, p_text(row.p_family))
    if any(row.p_family is not None for row in rows):
        _beside(axes, len(rows) - 0.35, "p of all")
    axes.set_yticks(range(len(rows)), [row.label for row in rows])
    axes.set(ylim=(-0.6, len(rows) - 0.4), xlim=ends, xlabel="g (mean of B is 0)")
    axes.grid(visible=False, axis="y")


def _draw_effect(axes: Axes, row: _Row, at: int, ends: tuple[float, float]) -> None:
    """Draw g where it lies; beyond the axis it stands as a number."""
    if ends[0] <= row.g <= ends[1]:
        inside = theme.INK if row.is_found else theme.GROUND
        axes.plot([row.g], [at], color=theme.INK, marker="D", mfc=inside, ms=6, zorder=4)
        return
    is_right = row.g > 0
    place, side = (ends[1] - 0.4, "right") if is_right else (ends[0] + 0.4, "left")
    weight = "bold" if row.is_found else "normal"
    text = f"g = {row.g:.0f}"
    axes.text(place, at, text, ha=side, va="center", fontsize=8, fontweight=weight)


def _beside(axes: Axes, at: float, text: str) -> None:
    axes.text(1.02, at, text, transform=axes.get_yaxis_transform(), va="center", fontsize=8)


def _draw_dots(
    axes: Axes, values: Sequence[float], height: float, colour: str, ends: tuple[float, float]
) -> None:
    """Draw trials as dots; those beyond the axis as arrows at its end."""
    marker = theme.MARKER_OF[colour]
    inside = [x for x in values if ends[0] <= x <= ends[1]]
    style: dict[str, Any] = {"ls": "none", "color": colour, "alpha": 0.75, "zorder": 3}
    axes.plot(inside, [height] * len(inside), marker=marker, ms=4, **style)
    for end, arrow, is_out in (
        (ends[0], "<", lambda x: x < ends[0]),
        (ends[1], ">", lambda x: x > ends[1]),
    ):
        if any(map(is_out, values)):
            axes.plot([end], [height], marker=arrow, ms=6, clip_on=False, **style)


def _describe(rows: Sequence[_Row]) -> str:
    largest = max(rows, key=lambda row: abs(row.g))
    found = [row.label for row in rows if row.is_found]
    said = f"Found with all in view: {', '.join(found)}." if found else "None is found."
    return (
        f"Hedges' g of {len(rows)} statistics. The largest is {largest.label} with "
        f"g = {largest.g:.1f} ({largest.low:.1f} to {largest.high:.1f}). {said}"
    )

"""Pictures over all of a diagnosis: the candidates, and how far the gap is closed."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import PercentFormatter

from zfcal.diagnose.findings import Gap, Screened
from zfcal.report.figures import theme
from zfcal.report.figures.panels import PANEL_IN, Entry, Panel, Picture

_ROW_IN = 0.24
_RIGHT = 2.0
"""A right model's z is smaller than this nineteen times of twenty."""

_MISSING = Entry(label="missing", colour=theme.MODEL, mark="points", marker="D")
_NOT_MISSING = Entry(label="not missing", colour=theme.MUTED, mark="points", marker="o")
_TOO_SHORT = Entry(label="too short to say", colour=theme.MUTED, mark="hollow", marker="o")

MEASURES = {
    "nats_per_step": "likelihood",
    "S_over_ceiling": "score S",
    "D": "distances",
    "W": "to the wall",
    "O": "zones",
    "T": "transitions",
    "effect": "the effect itself",
}
"""What the measures of a gap are called in a figure."""


def screened_picture(screened: Sequence[Screened], found: Collection[str]) -> Picture | None:
    """Return z of every candidate that could be asked for; None without one.

    Parameters
    ----------
    screened
        Every candidate.
    found
        Names of the effects that are missing.
    """
    asked = [each for each in screened if not math.isnan(each.z)]
    if not asked:
        return None
    ordered = sorted(asked, key=lambda each: abs(each.z))
    best = ordered[-1]
    panel = Panel(
        title="How strongly each effect stands out",
        alt=f"z of {len(asked)} candidates; the largest in size is {best.name} with {best.z:.1f}.",
        draw=partial(_draw_screened, screened=[(each, _mark(each, found)) for each in ordered]),
        size_in=(max(PANEL_IN[0], 4.6), 0.9 + _ROW_IN * len(ordered)),
    )
    return Picture(
        name="screened",
        title="Candidates",
        panels=(panel,),
        columns=1,
        key=(
            _MISSING,
            _NOT_MISSING,
            *([_TOO_SHORT] if any(_mark(each, found) is _TOO_SHORT for each in asked) else []),
            Entry(label="within chance", colour=theme.BAND, mark="band"),
        ),
        note="z is the effect's score over its standard error, in the model without any of the "
        "missing effects. An effect that is not there can still stand out beside one that is, "
        "until that one is added.",
    )


def _mark(each: Screened, found: Collection[str]) -> Entry:
    if each.name in found:
        return _MISSING
    return _NOT_MISSING if each.minutes_needed is None else _TOO_SHORT


def _draw_screened(axes: Axes, *, screened: Sequence[tuple[Screened, Entry]]) -> None:
    axes.axvspan(-_RIGHT, _RIGHT, color=theme.BAND, alpha=0.3, lw=0)
    axes.axvline(0, color=theme.MUTED, lw=0.8)
    for row, (each, entry) in enumerate(screened):
        inside = theme.GROUND if entry.mark == "hollow" else entry.colour
        axes.plot([0, each.z], [row, row], color=entry.colour, lw=1.2)
        axes.plot(
            [each.z], [row], color=entry.colour, marker=entry.marker, mfc=inside, ms=6, zorder=3
        )
    axes.set_yticks(range(len(screened)), [each.name for each, _ in screened])
    axes.set(xlabel="z", ylim=(-0.7, len(screened) - 0.3))
    widest = max(3.0, *(abs(each.z) for each, _ in screened))
    axes.set_xlim(-1.1 * widest, 1.1 * widest)
    axes.grid(visible=False, axis="y")


def gap_picture(gap: Sequence[Gap]) -> Picture | None:
    """Return the share of the gap closed by measure; None before the effects were added."""
    shown = [each for each in gap if not math.isnan(each.closed)]
    if not shown:
        return None
    said = ", ".join(f"{MEASURES[each.measure]} {100 * each.closed:.0f} %" for each in shown)
    panel = Panel(
        title="Share of the gap that is closed",
        alt=f"On held-out minutes the effects close of the gap: {said}.",
        draw=partial(_draw_gap, gap=shown[::-1]),
        size_in=(max(PANEL_IN[0], 4.6), 1.0 + 0.34 * len(shown)),
    )
    return Picture(
        name="gap",
        title="Before and after",
        short="Gap",
        panels=(panel,),
        columns=1,
        key=(
            Entry(label="with the effects, 95 %", colour=theme.GROUP, mark="line", marker="D"),
            Entry(label="placebo", colour=theme.MUTED, mark="hollow", marker="o"),
        ),
        note="0 % is the model without the effects, 100 % the model with them against itself. "
        "Fish that show an effect more clearly than our form of it does lie beyond that, and so "
        "may chance. The placebo is a wrong effect in their place. "
        "Likelihood and the effect itself are of the three models as fitted; the other rows are "
        "of the same three after they were calibrated.",
    )


def _draw_gap(axes: Axes, *, gap: Sequence[Gap]) -> None:
    for at in (0.0, 1.0):
        axes.axvline(at, color=theme.MUTED, lw=0.8)
    for row, each in enumerate(gap):
        low, high = each.interval
        if not math.isnan(low):
            ends = np.clip([low, high], -1.0, 2.0)
            axes.plot(ends, [row, row], color=theme.GROUP, lw=2)
        axes.plot([np.clip(each.closed, -1, 2)], [row], color=theme.GROUP, marker="D", ms=7)
        if not math.isnan(each.placebo):
            axes.plot(
                [np.clip(each.placebo, -1, 2)],
                [row],
                color=theme.MUTED,
                marker="o",
                ms=7,
                mfc=theme.GROUND,
                zorder=4,
            )
    axes.set_yticks(range(len(gap)), [MEASURES[each.measure] for each in gap])
    axes.set(ylim=(-0.6, len(gap) - 0.4), xlabel="share closed")
    low, high = axes.get_xlim()
    axes.set_xlim(min(low, -0.1), max(high, 1.1))
    axes.xaxis.set_major_formatter(PercentFormatter(1.0, decimals=0))
    axes.grid(visible=False, axis="y")

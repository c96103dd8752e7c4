"""One histogram as a panel: bars for the fish, lines for others, and what lies beyond set apart."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from zfcal.arrays import Floats, Ints
from zfcal.behaviour.features.statistic import Statistic
from zfcal.behaviour.histograms import frequencies
from zfcal.report.figures import theme
from zfcal.report.views import FEW

FISH_CASE = "fish"
MODEL_CASE = "model"
ROBOT_CASE = "robot"
COLOURS = MappingProxyType(
    {FISH_CASE: theme.FISH, MODEL_CASE: theme.MODEL, ROBOT_CASE: theme.ROBOT}
)
_GAP = 0.6
"""How far a bin that holds all beyond stands apart, in its own widths."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Histogram:
    """What one panel of bins shows.

    Parameters
    ----------
    counts
        Counts of each bin, for each case.
    edges
        Edges of the bins.
    axis
        Label of the x axis.
    statistic
        What is counted; says how two cases are compared.
    """

    counts: Mapping[str, Ints]
    edges: Floats
    axis: str
    statistic: Statistic


def centres_of(edges: Floats) -> Floats:
    """Return the middles of bins, shape (bin,)."""
    return (edges[1:] + edges[:-1]) / 2


def draw_as_told(axes: Axes, *, shown: Histogram) -> None:
    """Leave it to the statistic, and say how alike the cases are."""
    if shown.statistic.draw is not None:
        shown.statistic.draw(axes, shown.counts)
    axes.set(xlabel=shown.axis)
    write_remark(axes, shown.counts, shown.statistic)


def draw_histogram(axes: Axes, *, shown: Histogram) -> None:
    """Draw bars for the fish and lines for the others, what lies beyond the bins set apart."""
    places = _places(shown, theme.letters_across(axes))
    width, apart = places.width, places.apart
    top = 0.0
    for case, counts in shown.counts.items():
        share = frequencies(counts)
        if np.isnan(share).all():
            continue
        top = max(top, float(share.max()))
        if case == FISH_CASE:
            bars = axes.bar(
                places.centres, share, width=0.92 * width, color=COLOURS[case], alpha=0.45, lw=0
            )
            if apart:
                bars[-1].set(hatch="////", edgecolor=theme.GROUND)
        else:
            style = "-" if case == MODEL_CASE else ":"
            marker = theme.MARKER_OF[COLOURS[case]]
            # What lies beyond is no neighbour of the last bin: no line leads there.
            for part in (slice(0, -1), slice(-1, None)) if apart else (slice(None),):
                axes.plot(
                    places.centres[part], share[part], color=COLOURS[case], ls=style, marker=marker
                )
    axes.set(xlabel=shown.axis, ylabel="share", xlim=places.limits)
    leave_room(axes, top, 1.0, remarks_of(shown.counts, shown.statistic))
    axes.set_xticks(places.ticks, places.labels)
    if apart:
        axes.axvline(
            places.limits[1] - width * (1 + _GAP / 2),
            ymax=_share_of_bars(axes, len(remarks_of(shown.counts, shown.statistic))),
            color=theme.MUTED,
            lw=0.8,
            ls=":",
        )
    write_remark(axes, shown.counts, shown.statistic)


def leave_room(axes: Axes, top: float, most: float, lines: Sequence[str]) -> None:
    """Let an axis of shares end above the bars, with no number that a share cannot have."""
    end = top / _share_of_bars(axes, len(lines)) or most
    ticks = np.asarray(MaxNLocator(5).tick_values(0.0, end))
    axes.set_yticks(ticks[(ticks >= 0) & (ticks <= min(end, most))])
    axes.set_ylim(0.0, end)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Places:
    """Where bins are drawn along an axis.

    Parameters
    ----------
    centres, width, limits
        Of the bars, and the ends of the axis.
    ticks, labels
        Edges of bins, and the bin that stands apart.
    apart
        Whether the last bin holds all that lies beyond, and stands apart.
    """

    centres: Floats
    width: float
    limits: tuple[float, float]
    ticks: Floats
    labels: list[str]
    apart: bool


def _places(shown: Histogram, letters: int) -> _Places:
    """Return where bins are drawn on an axis with room for so many letters below it."""
    widths = np.diff(shown.edges)
    is_even = bool(np.allclose(widths, widths[0]))
    # Bins of unequal width are drawn side by side: to scale the small ones could not be seen.
    edges = shown.edges if is_even else np.arange(len(shown.edges), dtype=np.float64)
    width = float(edges[1] - edges[0])
    centres, end, apart = centres_of(edges), float(edges[-1]), not shown.statistic.bounded
    if apart:
        centres[-1] += _GAP * width
        end += _GAP * width
    ticks, labels = _ticks(shown.edges, edges, most=max(1, min(4, letters // 7)))
    if apart:
        beyond = f"≥ {shown.edges[-2]:.3g}"
        per_letter = (end - float(edges[0])) / letters
        room = [(len(label) + len(beyond) + 2) / 2 * per_letter for label in labels]
        kept = (ticks < edges[-2]) & (ticks < centres[-1] - room)
        ticks = np.append(ticks[kept], centres[-1])
        labels = [*(label for label, keep in zip(labels, kept, strict=True) if keep), beyond]
    return _Places(
        centres=centres,
        width=width,
        limits=(float(edges[0]), end),
        ticks=ticks,
        labels=labels,
        apart=apart,
    )


def _ticks(edges: Floats, at: Floats, *, most: int) -> tuple[Floats, list[str]]:
    """Return round numbers on an even axis, at most so many steps; every other edge on another."""
    if not np.allclose(edges, at):
        return at[::2], [f"{edge:.2g}" for edge in edges[::2]]
    ticks = np.asarray(MaxNLocator(most).tick_values(float(edges[0]), float(edges[-1])))
    ticks = ticks[(ticks >= edges[0] - 1e-12) & (ticks <= edges[-1] + 1e-12)]
    return ticks, [f"{round(float(tick), 9):g}" for tick in ticks]


def _share_of_bars(axes: Axes, n_lines: int) -> float:
    """Return which share of a panel's height bars take below some lines and their own numbers."""
    height_pt = 72 * theme.height_in_of(axes)
    return max(1.0 - (n_lines + 1) * 1.3 * theme.small_pt() / height_pt, 0.4)


def write_remark(axes: Axes, counts: Mapping[str, Ints], statistic: Statistic) -> None:
    """Write how alike fish and model are and of how many observations, or who was never seen."""
    is_few = 0 < counts[FISH_CASE].sum() < FEW
    axes.text(
        0.99,
        0.98,
        "\n".join(remarks_of(counts, statistic)),
        ha="right",
        va="top",
        fontsize=theme.small_pt(),
        transform=axes.transAxes,
        color=theme.WARN if is_few else theme.MUTED,
    )


def remarks_of(counts: Mapping[str, Ints], statistic: Statistic) -> list[str]:
    """Return the lines that stand above the bars."""
    empty = [case for case, values in counts.items() if not values.sum()]
    if len(empty) == len(counts):
        return ["none seen"]
    lines = ["none seen: " + ", ".join(empty)] if empty else []
    if MODEL_CASE in counts and not {FISH_CASE, MODEL_CASE} & set(empty):
        alike = float(statistic.compare(counts[FISH_CASE], counts[MODEL_CASE]))
        lines.append(f"similarity {alike:.2f}")
    n = int(counts[FISH_CASE].sum())
    if n:
        lines.append(f"few: n = {n}" if n < FEW else f"n = {n}")
    return lines

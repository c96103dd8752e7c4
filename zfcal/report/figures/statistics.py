"""What the animals did beside what the calibrated model does, statistic by statistic."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import PowerNorm
from matplotlib.ticker import MaxNLocator

from zfcal.arena import Arena
from zfcal.arrays import Floats, Ints
from zfcal.behaviour.features.registry import statistics
from zfcal.behaviour.features.statistic import Statistic
from zfcal.behaviour.histograms import frequencies
from zfcal.behaviour.statistics import Statistics
from zfcal.report.figures import theme
from zfcal.report.figures.panels import PANEL_IN, Entry, Mark, Panel, Picture

_FISH_CASE = "fish"
_MODEL_CASE = "model"
_ROBOT_CASE = "robot"
_COLOURS = MappingProxyType(
    {_FISH_CASE: theme.FISH, _MODEL_CASE: theme.MODEL, _ROBOT_CASE: theme.ROBOT}
)
_MANY_ZONES = 5
FEW = 100
"""A histogram of fewer observations, ten for each bin, is hardly more than chance."""

_ROOM = 0.72
"""Share of a panel's height that bars take; the words above them have the rest."""

_GAP = 0.6
"""How far a bin that holds all beyond stands apart, in its own widths."""

_READING = (
    "Each bar is the share of all n observations of the fish in its zone. A last bin that holds "
    "all that lies beyond, however far, stands apart and has a ≥. In the transition tables a row "
    "tells where an animal is one step later."
)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Histogram:
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


def statistics_picture(cases: Mapping[str, Statistics], arena: Arena, *, title: str) -> Picture:
    """Return the picture of all statistics that are drawn, the cases over each other.

    Parameters
    ----------
    cases
        ``fish`` and, where there are any, ``model`` and ``robot``.
    arena
        Gives the zones and the ranges of the bins.
    title
        Of which window the statistics are.
    """
    shown = [statistic for statistic in statistics().values() if statistic.drawn]
    return Picture(
        name="statistics",
        title=title,
        short="Statistics",
        panels=[panel for statistic in shown for panel in _panels(statistic, cases, arena)],
        key=tuple(_entry(case) for case in cases),
        columns=len(arena.zone_names) if 1 < len(arena.zone_names) < _MANY_ZONES else 3,
        note=_note(cases),
    )


def _panels(statistic: Statistic, cases: Mapping[str, Statistics], arena: Arena) -> Iterator[Panel]:
    """Yield the panels of one statistic."""
    # What another version has counted in other bins is not laid over these.
    counts = {
        case: stats.of(statistic.name)
        for case, stats in cases.items()
        if statistic.name in stats.names
        and stats.of(statistic.name).shape == statistic.shape(arena)
    }
    if _FISH_CASE not in counts:
        return
    if statistic.form == "zones":
        yield _occupation(statistic, counts, arena.zone_names)
    elif statistic.form == "table":
        for case, table in counts.items():
            yield _transitions(statistic, case, table, zones=arena.zone_names)
    else:
        yield from _histograms(statistic, counts, arena)


def _histograms(statistic: Statistic, counts: Mapping[str, Ints], arena: Arena) -> Iterator[Panel]:
    colours = theme.zone_colours(arena.zone_names)
    edges = statistic.edges_in(arena)
    unit = f" ({statistic.unit})" if statistic.unit else ""
    for row, zone in enumerate(arena.zone_names if statistic.per_zone else (None,)):
        shown = _Histogram(
            counts={case: table[row] for case, table in counts.items()},
            edges=edges,
            axis=f"{statistic.axis}{unit}",
            statistic=statistic,
        )
        if zone is None:
            yield _histogram(statistic.title, shown, theme.INK)
        else:
            yield _histogram(f"{statistic.title}, {zone}", shown, colours[zone])


def _note(cases: Mapping[str, Statistics]) -> str:
    parts = [_READING]
    if _MODEL_CASE in cases:
        parts.append(
            "The number in a panel is the similarity of fish and model there, 1 for equal."
        )
    if _ROBOT_CASE in cases:
        parts.append("For the robot, distances between two fish are those of robot and fish.")
    return " ".join(parts)


def _entry(case: str) -> Entry:
    labels = {
        _FISH_CASE: "fish, as observed",
        _MODEL_CASE: "calibrated model, long simulation",
        _ROBOT_CASE: "robot, as observed",
    }
    if case == _FISH_CASE:
        return Entry(label=labels[case], colour=_COLOURS[case], mark="bar")
    mark: Mark = "line" if case == _MODEL_CASE else "dot"
    marker = theme.MARKER_OF[_COLOURS[case]]
    return Entry(label=labels[case], colour=_COLOURS[case], mark=mark, marker=marker)


def _histogram(title: str, shown: _Histogram, colour: str) -> Panel:
    unit = shown.statistic.unit
    means = "; ".join(
        f"{case} mean {mean:.3f} {unit}".rstrip()
        for case, counts in shown.counts.items()
        if not np.isnan(mean := histogram_mean(counts, shown.edges))
    )
    said = f"{means or 'no observation'}; {_said_of_fish(shown)}"
    draw = partial(_draw_histogram, shown=shown)
    if shown.statistic.draw is not None:
        draw = partial(_draw_as_told, shown=shown)
    return Panel(
        title=title,
        alt=f"Histogram, {title.lower()}: {said}.",
        draw=draw,
        colour=colour,
    )


def _said_of_fish(shown: _Histogram) -> str:
    """Return of how many observations the fish's bars are, and how many lie beyond."""
    fish = shown.counts[_FISH_CASE]
    n = int(fish.sum())
    beyond = "" if shown.statistic.bounded or not n else f", {fish[-1] / n:.0%} in the last bin"
    return f"{n} observations of fish{beyond}"


def histogram_mean(counts: Ints, edges: Floats) -> float:
    """Return the mean that a histogram tells, from the centres of its bins.

    Parameters
    ----------
    counts : ndarray, shape (bin,)
    edges : ndarray, shape (bin + 1,)
        What lies beyond the last counts as in the last bin.

    Returns
    -------
    float
        In the unit of the edges; NaN without a count.
    """
    total = counts.sum()
    return float(counts @ _centres(edges) / total) if total else float("nan")


def _centres(edges: Floats) -> Floats:
    return (edges[1:] + edges[:-1]) / 2


def _draw_as_told(axes: Axes, *, shown: _Histogram) -> None:
    """Leave it to the statistic, and say how alike the cases are."""
    if shown.statistic.draw is not None:
        shown.statistic.draw(axes, shown.counts)
    axes.set(xlabel=shown.axis)
    _remark(axes, shown.counts, shown.statistic)


def _draw_histogram(axes: Axes, *, shown: _Histogram) -> None:
    places = _places(shown)
    width, apart = places.width, places.apart
    top = 0.0
    for case, counts in shown.counts.items():
        share = frequencies(counts)
        if np.isnan(share).all():
            continue
        top = max(top, float(share.max()))
        if case == _FISH_CASE:
            bars = axes.bar(
                places.centres, share, width=0.92 * width, color=_COLOURS[case], alpha=0.45, lw=0
            )
            if apart:
                bars[-1].set(hatch="////", edgecolor=theme.GROUND)
        else:
            style = "-" if case == _MODEL_CASE else ":"
            marker = theme.MARKER_OF[_COLOURS[case]]
            # What lies beyond is no neighbour of the last bin: no line leads there.
            for part in (slice(0, -1), slice(-1, None)) if apart else (slice(None),):
                axes.plot(
                    places.centres[part], share[part], color=_COLOURS[case], ls=style, marker=marker
                )
    axes.set(xlabel=shown.axis, ylabel="share", xlim=places.limits)
    _leave_room(axes, top, 1.0)
    axes.set_xticks(places.ticks, places.labels)
    if apart:
        axes.axvline(
            places.limits[1] - width * (1 + _GAP / 2), ymax=_ROOM, color=theme.MUTED, lw=0.8, ls=":"
        )
    _remark(axes, shown.counts, shown.statistic)


def _leave_room(axes: Axes, top: float, most: float) -> None:
    """Let an axis of shares end above the bars, with no number that a share cannot have."""
    end = top / _ROOM or most
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


def _places(shown: _Histogram) -> _Places:
    widths = np.diff(shown.edges)
    is_even = bool(np.allclose(widths, widths[0]))
    # Bins of unequal width are drawn side by side: to scale the small ones could not be seen.
    edges = shown.edges if is_even else np.arange(len(shown.edges), dtype=np.float64)
    width = float(edges[1] - edges[0])
    centres, end, apart = _centres(edges), float(edges[-1]), not shown.statistic.bounded
    if apart:
        centres[-1] += _GAP * width
        end += _GAP * width
    ticks, labels = _ticks(shown.edges, edges, is_even=is_even)
    if apart:
        kept = ticks < edges[-2] - 0.5 * width
        ticks = np.append(ticks[kept], centres[-1])
        labels = [label for label, keep in zip(labels, kept, strict=True) if keep]
        labels.append(f"≥ {shown.edges[-2]:.3g}")
    return _Places(
        centres=centres,
        width=width,
        limits=(float(edges[0]), end),
        ticks=ticks,
        labels=labels,
        apart=apart,
    )


def _ticks(edges: Floats, at: Floats, *, is_even: bool) -> tuple[Floats, list[str]]:
    """Return round numbers on an even axis, and every other edge on another."""
    if not is_even:
        return at[::2], [f"{edge:.2g}" for edge in edges[::2]]
    ticks = np.asarray(MaxNLocator(4).tick_values(float(edges[0]), float(edges[-1])))
    ticks = ticks[(ticks >= edges[0] - 1e-12) & (ticks <= edges[-1] + 1e-12)]
    return ticks, [f"{round(float(tick), 9):g}" for tick in ticks]


def _remark(axes: Axes, counts: Mapping[str, Ints], statistic: Statistic) -> None:
    """Write how alike fish and model are and of how many observations, or who was never seen."""
    empty = [case for case, values in counts.items() if not values.sum()]
    n, lines = int(counts[_FISH_CASE].sum()), []
    if len(empty) == len(counts):
        lines = ["none seen"]
    else:
        if empty:
            lines.append("none seen: " + ", ".join(empty))
        if _MODEL_CASE in counts and not {_FISH_CASE, _MODEL_CASE} & set(empty):
            alike = float(statistic.compare(counts[_FISH_CASE], counts[_MODEL_CASE]))
            lines.append(f"similarity {alike:.2f}")
        if n:
            lines.append(f"few: n = {n}" if n < FEW else f"n = {n}")
    colour = theme.WARN if 0 < n < FEW else theme.MUTED
    axes.text(
        0.98, 0.97, "\n".join(lines), ha="right", va="top", transform=axes.transAxes, color=colour
    )


def _occupation(statistic: Statistic, counts: Mapping[str, Ints], zones: Sequence[str]) -> Panel:
    shares = {case: frequencies(values) for case, values in counts.items()}
    said = "; ".join(
        f"{case} " + ", ".join(f"{zone} {s:.0%}" for zone, s in zip(zones, share, strict=True))
        for case, share in shares.items()
        if not np.isnan(share).any()
    )
    return Panel(
        title=statistic.title,
        alt=f"Bars of the {statistic.title[0].lower()}{statistic.title[1:]}: "
        f"{said or 'no observation'}.",
        draw=partial(_draw_occupation, statistic=statistic, counts=counts, zones=zones),
    )


def _draw_occupation(
    axes: Axes,
    *,
    statistic: Statistic,
    counts: Mapping[str, Ints],
    zones: Sequence[str],
) -> None:
    at = np.arange(len(zones))
    width = 0.8 / len(counts)
    hatches = {_ROBOT_CASE: "....", _MODEL_CASE: "////"}
    top = 0.0
    for index, (case, values) in enumerate(counts.items()):
        share = 100 * np.nan_to_num(frequencies(values))
        top = max(top, float(share.max()))
        x = at + (index - (len(counts) - 1) / 2) * width
        bars = axes.bar(x, share, width=0.92 * width, color=_COLOURS[case], alpha=0.45, lw=0)
        if case in hatches:
            for bar in bars:
                bar.set(hatch=hatches[case], edgecolor=theme.GROUND, alpha=0.6)
        for left, value in zip(x, share, strict=True):
            axes.annotate(
                f"{value:.0f}", (left, value), xytext=(0, 2), textcoords="offset points",
                ha="center", fontsize=8,
            )  # fmt: skip
    theme.name_ticks(axes, at, zones)
    colours = theme.zone_colours(zones)
    for label, zone in zip(axes.get_xticklabels(), zones, strict=True):
        label.set(color=colours[zone], fontweight="bold")
    axes.set(ylabel="% of the time")
    _leave_room(axes, top, 100.0)
    axes.grid(visible=False, axis="x")
    _remark(axes, counts, statistic)


def _transitions(statistic: Statistic, case: str, counts: Ints, *, zones: Sequence[str]) -> Panel:
    share = frequencies(counts)
    stays = ", ".join(
        f"{zone} {share[z, z]:.0%}" for z, zone in enumerate(zones) if not np.isnan(share[z, z])
    )
    return Panel(
        title=f"{statistic.title}, {case}",
        alt=f"Table of transitions of the {case} between zones; stays: {stays or 'none seen'}.",
        draw=partial(_draw_transitions, share=share, zones=zones),
        size_in=(PANEL_IN[0], max(PANEL_IN[1], 0.5 * len(zones) + 1.1)),
        colour=_COLOURS[case],
    )


def _draw_transitions(axes: Axes, *, share: Floats, zones: Sequence[str]) -> None:
    # Stays are near one and moves near zero: a square root makes both visible.
    axes.pcolormesh(share, cmap="Blues", norm=PowerNorm(0.5, 0.0, 1.0), rasterized=False)
    for row, column in np.ndindex(share.shape):
        value = share[row, column]
        known = not np.isnan(value)
        axes.text(
            column + 0.5,
            row + 0.5,
            f"{value:.3f}" if known and value else ("0" if known else "none"),
            ha="center",
            va="center",
            color="#fbfcfd" if known and value > 0.3 else "#101418" if known else theme.MUTED,
        )
    at = np.arange(len(zones)) + 0.5
    theme.name_ticks(axes, at, zones)
    axes.set_yticks(at, [theme.wrapped(zone) for zone in zones])
    axes.invert_yaxis()
    axes.grid(visible=False)
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)
    axes.set(xlabel="to", ylabel="from")

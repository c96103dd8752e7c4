"""What the animals did beside what the calibrated model does, statistic by statistic."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import PowerNorm

from zfcal.arena import Arena
from zfcal.arrays import Floats, Ints
from zfcal.behaviour.features.registry import statistics
from zfcal.behaviour.features.statistic import Statistic
from zfcal.behaviour.histograms import frequencies
from zfcal.behaviour.statistics import Statistics
from zfcal.report.figures import theme
from zfcal.report.figures.histograms import (
    COLOURS,
    FISH_CASE,
    MODEL_CASE,
    ROBOT_CASE,
    Histogram,
    centres_of,
    draw_as_told,
    draw_histogram,
    leave_room,
    remarks_of,
    write_remark,
)
from zfcal.report.figures.panels import PANEL_IN, Entry, Mark, Panel, Picture

_MANY_ZONES = 5
_READING = (
    "Each bar is the share of all n observations of the fish in its zone. A last bin that holds "
    "all that lies beyond, however far, stands apart and has a ≥. In the transition tables a row "
    "shows where an animal is one step later."
)


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
    if FISH_CASE not in counts:
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
        shown = Histogram(
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
    if MODEL_CASE in cases:
        parts.append(
            "The number in a panel is the similarity of fish and model there, 1 for equal."
        )
    if ROBOT_CASE in cases:
        parts.append("For the robot, distances between two fish are those of robot and fish.")
    return " ".join(parts)


def _entry(case: str) -> Entry:
    labels = {
        FISH_CASE: "fish, as observed",
        MODEL_CASE: "calibrated model, long simulation",
        ROBOT_CASE: "robot, as observed",
    }
    if case == FISH_CASE:
        return Entry(label=labels[case], colour=COLOURS[case], mark="bar")
    mark: Mark = "line" if case == MODEL_CASE else "dot"
    marker = theme.MARKER_OF[COLOURS[case]]
    return Entry(label=labels[case], colour=COLOURS[case], mark=mark, marker=marker)


def _histogram(title: str, shown: Histogram, colour: str) -> Panel:
    unit = shown.statistic.unit
    means = "; ".join(
        f"{case} mean {mean:.3f} {unit}".rstrip()
        for case, counts in shown.counts.items()
        if not np.isnan(mean := histogram_mean(counts, shown.edges))
    )
    said = f"{means or 'no observation'}; {_said_of_fish(shown)}"
    draw = partial(draw_histogram, shown=shown)
    if shown.statistic.draw is not None:
        draw = partial(draw_as_told, shown=shown)
    return Panel(
        title=title,
        alt=f"Histogram, {title.lower()}: {said}.",
        draw=draw,
        colour=colour,
    )


def _said_of_fish(shown: Histogram) -> str:
    """Return of how many observations the fish's bars are, and how many lie beyond."""
    fish = shown.counts[FISH_CASE]
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
    return float(counts @ centres_of(edges) / total) if total else float("nan")


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
    hatches = {ROBOT_CASE: "....", MODEL_CASE: "////"}
    top = 0.0
    for index, (case, values) in enumerate(counts.items()):
        share = 100 * np.nan_to_num(frequencies(values))
        top = max(top, float(share.max()))
        x = at + (index - (len(counts) - 1) / 2) * width
        bars = axes.bar(x, share, width=0.92 * width, color=COLOURS[case], alpha=0.45, lw=0)
        if case in hatches:
            for bar in bars:
                bar.set(hatch=hatches[case], edgecolor=theme.GROUND, alpha=0.6)
        for left, value in zip(x, share, strict=True):
            axes.annotate(
                f"{value:.0f}", (left, value), xytext=(0, 2), textcoords="offset points",
                ha="center", fontsize=theme.small_pt(),
            )  # fmt: skip
    theme.name_ticks(axes, at, zones)
    colours = theme.zone_colours(zones)
    for label, zone in zip(axes.get_xticklabels(), zones, strict=True):
        label.set(color=colours[zone], fontweight="bold")
    axes.set(ylabel="% of the time")
    leave_room(axes, top, 100.0, remarks_of(counts, statistic))
    axes.grid(visible=False, axis="x")
    write_remark(axes, counts, statistic)


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
        colour=COLOURS[case],
    )


def _draw_transitions(axes: Axes, *, share: Floats, zones: Sequence[str]) -> None:
    # Stays are near one and moves near zero: a square root makes both visible.
    axes.pcolormesh(share, cmap="Blues", norm=PowerNorm(0.5, 0.0, 1.0), rasterized=False)
    digits = 3 if theme.letters_across(axes) > 7 * len(zones) else 2
    for row, column in np.ndindex(share.shape):
        value = share[row, column]
        known = not np.isnan(value)
        axes.text(
            column + 0.5,
            row + 0.5,
            f"{value:.{digits}f}" if known and value else ("0" if known else "none"),
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

"""Pictures of one finding: where in the tank, when, in whom, and by distance, speed or time."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Callable
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from zfcal.arena import Arena
from zfcal.arrays import Floats
from zfcal.diagnose.findings import FeatureCurve
from zfcal.diagnose.pictured import Parts, Pictured
from zfcal.report.figures import theme
from zfcal.report.figures.arena import arena_size_in, paint_walls
from zfcal.report.figures.panels import PANEL_IN, Entry, Panel, Picture

_WIDTH_IN = 3.2
_BAR_IN = 0.65
_FEWEST_STEPS = 10
"""A square in which fewer steps began is left empty: its mean is chance."""

_DEEPEST = 0.98
"""The squares above this quantile share the deepest colour."""

WITHOUT, WITH = theme.MODEL, theme.GROUP


def finding_picture(
    name: str,
    number: int,
    pictured: Pictured,
    arena: Arena,
    by_features: FeatureCurve | None = None,
) -> Picture:
    """Return the picture of one finding.

    Parameters
    ----------
    name
        The effect's.
    number
        Its place among the findings, from 1.
    pictured
        What to show.
    arena
        The tank.
    by_features
        What its features say, if it has any.
    """
    width_in, height_in = arena_size_in(arena, _WIDTH_IN)
    place = Panel(
        title="Where",
        alt=_describe_place(name, pictured),
        draw=partial(_draw_place, pictured=pictured, arena=arena),
        size_in=(width_in + _BAR_IN, height_in),
    )
    made = [
        place,
        _parts_panel("When", pictured.minutes, _draw_minutes, "minute"),
        _curve_panel(pictured),
        _parts_panel("In whom", pictured.agents, _draw_agents, "track"),
        _feature_panel(by_features),
    ]
    return Picture(
        name=f"{number}-{slug(name)}",
        title=f"{number}. {name}",
        short=name,
        panels=[panel for panel in made if panel is not None],
        columns=2,
        key=(
            Entry(label="model without the effect", colour=WITHOUT, mark="dash", marker="^"),
            Entry(label="model with it", colour=WITH, mark="line", marker="D"),
            Entry(label="95 % of a right model", colour=theme.BAND, mark="band"),
            *_feature_entries(by_features),
        ),
        note="In all panels the score shows how much more of the effect the fish show than the "
        "model expects: zero where the model is right, in standard deviations of a single step. "
        "The map is of the model without the effect." + _note_on_feature(by_features),
    )


def slug(name: str) -> str:
    """Return a name that can be part of a file's.

    >>> slug("generic:heading:wall")
    'generic-heading-wall'
    """
    return re.sub(r"[^a-zA-Z0-9]+", "-", name).strip("-").lower()


def shown_places(pictured: Pictured) -> Floats:
    """Return the map's scores, NaN in squares with too few steps, shape (row, column)."""
    return np.where(pictured.place_n >= _FEWEST_STEPS, pictured.place, np.nan)


def _describe_place(name: str, pictured: Pictured) -> str:
    scores = shown_places(pictured)
    if np.isnan(scores).all():
        return f"Map of the tank: too few steps to show where {name} is missing."
    row, column = np.unravel_index(int(np.nanargmax(np.abs(scores))), scores.shape)
    x_m, y_m = (
        pictured.origin_m[axis] + (index + 0.5) * pictured.cell_m
        for axis, index in ((0, column), (1, row))
    )
    return (
        f"Map of the tank: the score of {name} is largest in size, {scores[row, column]:.2f}, "
        f"at x = {x_m:.2f} m, y = {y_m:.2f} m."
    )


def _draw_place(axes: Axes, *, pictured: Pictured, arena: Arena) -> None:
    axes.grid(visible=False)
    paint_walls(axes, arena)
    scores = shown_places(pictured)
    rows, columns = scores.shape
    (x0, y0), cell_m = pictured.origin_m, pictured.cell_m
    known = np.abs(scores[~np.isnan(scores)])
    limit = float(np.quantile(known, _DEEPEST)) if known.size else 1.0
    image = axes.imshow(
        np.ma.masked_invalid(scores),
        extent=(x0, x0 + columns * cell_m, y0, y0 + rows * cell_m),
        origin="lower",
        cmap="RdBu_r",
        vmin=-max(limit, 1e-3),
        vmax=max(limit, 1e-3),
        interpolation="nearest",
        zorder=1,
    )
    image.set_clip_path(axes.patches[0])
    # Inside the axes' own room: a bar beside them would be squeezed out where scales are equal.
    place = axes.inset_axes((1.02, 0.2, 0.035, 0.6))
    bar = axes.figure.colorbar(image, cax=place, extend="both", ticks=MaxNLocator(4))
    bar.set_label("score (0 = as expected)")
    bar.outline.set_visible(False)


def _parts_panel(title: str, parts: Parts, draw: Callable[..., None], unit: str) -> Panel | None:
    known = parts.n > 0
    if not known.any():
        return None
    said = []
    for name, scores in (("without", parts.before), ("with", parts.after)):
        outside = int((np.abs(scores[known]) > parts.half_width[known]).sum())
        said.append(f"{outside} {name} the effect")
    return Panel(
        title=title,
        alt=f"Score by {unit}, {int(known.sum())} in all; outside a right model's 95 %: "
        f"{' and '.join(said)}.",
        draw=partial(draw, parts=parts),
    )


def _draw_minutes(axes: Axes, *, parts: Parts) -> None:
    minute = parts.label + 0.5
    half = parts.half_width
    axes.fill_between(minute, -half, half, color=theme.BAND, alpha=0.3, lw=0, step="mid")
    axes.axhline(0, color=theme.MUTED, lw=0.8)
    axes.plot(minute, parts.before, color=WITHOUT, ls="--", marker="^", zorder=3)
    axes.plot(minute, parts.after, color=WITH, marker="D", zorder=3)
    axes.set(xlabel="minute of the trial", ylabel="score")
    axes.xaxis.set_major_locator(MaxNLocator(6, integer=True))


def _draw_agents(axes: Axes, *, parts: Parts) -> None:
    at = np.arange(len(parts.label))
    half = parts.half_width
    axes.use_sticky_edges = False
    axes.bar(at, 2 * half, bottom=-half, width=0.7, color=theme.BAND, alpha=0.3, lw=0)
    axes.axhline(0, color=theme.MUTED, lw=0.8)
    axes.plot(at, parts.before, color=WITHOUT, ls="none", marker="^", ms=6, zorder=3)
    axes.plot(at, parts.after, color=WITH, ls="none", marker="D", ms=5, zorder=3)
    axes.set(xlabel="track", ylabel="score", xlim=(-0.6, len(at) - 0.4))
    theme.name_ticks(axes, at, [str(label) for label in parts.label])


def _curve_panel(pictured: Pictured) -> Panel | None:
    curve = pictured.curve
    known = ~np.isnan(curve.observed)
    if not known.any():
        return None
    left = [curve.observed - expected for expected in (curve.before, curve.after)]
    sizes = [float(np.sqrt(np.nanmean(scores[known] ** 2))) for scores in left]
    return Panel(
        title=f"By {_without_unit(curve.cue_name)}",
        alt=f"Score by {curve.cue_name}, of the model without the effect {sizes[0]:.3g} and with "
        f"it {sizes[1]:.3g} in size (root mean square).",
        draw=partial(_draw_curve, pictured=pictured, left=left),
        size_in=PANEL_IN,
    )


def _draw_curve(axes: Axes, *, pictured: Pictured, left: list[Floats]) -> None:
    """Draw what each model leaves unexplained, as the other panels do; bins are equally full."""
    cue = pictured.curve.cue
    n = pictured.minutes.n.sum() / len(cue)
    half = np.full(len(cue), 1.96 / np.sqrt(max(n, 1.0)))
    axes.fill_between(cue, -half, half, color=theme.BAND, alpha=0.3, lw=0)
    axes.axhline(0, color=theme.MUTED, lw=0.8)
    axes.plot(cue, left[0], color=WITHOUT, ls="--", marker="^", zorder=3)
    axes.plot(cue, left[1], color=WITH, marker="D", zorder=3)
    axes.set(xlabel=_lines(pictured.curve.cue_name, 42), ylabel="score")
    axes.xaxis.set_major_locator(MaxNLocator(6))


def _feature_panel(found: FeatureCurve | None) -> Panel | None:
    if found is None or not len(found.at):
        return None
    largest = int(np.nanargmax(np.abs(found.strength)))
    return Panel(
        title=f"How strong, by {_without_unit(found.cue)}",
        alt=f"Strength of the feature {found.label!r} by {found.cue}, as the fish show it with its "
        f"95 % interval, and as the model with the effect does: largest, "
        f"{found.strength[largest]:.3g}, at {found.at[largest]:.3g}.",
        draw=partial(_draw_feature, found=found),
        size_in=PANEL_IN,
    )


def _note_on_feature(found: FeatureCurve | None) -> str:
    if found is None or not len(found.at):
        return ""
    return (
        f" How strong: the feature {found.label!r}, which gains {found.nats:.0f} nats, fitted to "
        "the headings of the fish and to headings drawn from the model with the effect, whose "
        f"form gains {found.form_nats:.0f}."
        + "".join(
            f" Besides, {name}: {value:.3g} ({low:.3g} to {high:.3g})."
            for name, (value, low, high) in found.besides.items()
        )
    )


def _feature_entries(found: FeatureCurve | None) -> tuple[Entry, ...]:
    if found is None or not len(found.at):
        return ()
    return (Entry(label="fish, 95 % interval", colour=theme.FISH, mark="line", marker="o"),)


def _draw_feature(axes: Axes, *, found: FeatureCurve) -> None:
    reach = np.stack([found.strength - found.low, found.high - found.strength])
    axes.axhline(0, color=theme.MUTED, lw=0.8)
    axes.errorbar(
        found.at, found.strength, np.nan_to_num(np.maximum(reach, 0.0)), color=theme.FISH,
        marker="o", capsize=3, zorder=3,
    )  # fmt: skip
    axes.plot(found.at, found.form, color=WITH, marker="D", zorder=4)
    axes.set(xlabel=_lines(found.cue, 42), ylabel=_lines(found.strength_name, 30))
    axes.xaxis.set_major_locator(MaxNLocator(6))


def _without_unit(name: str) -> str:
    return re.sub(r" \([^()]*\)$", "", name)


def _lines(text: str, width: int) -> str:
    """Return a label on lines that a panel has room for."""
    return "\n".join(textwrap.wrap(text, width, break_long_words=False))

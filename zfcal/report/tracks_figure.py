"""Where the animals swam: paths over the tank, and a map of how often they were where."""

from __future__ import annotations

from functools import partial

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import PowerNorm
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from zfcal.arena import Arena
from zfcal.behaviour.located import Located
from zfcal.report import theme
from zfcal.report.arena_figure import arena_size_in, paint_walls, paint_zones
from zfcal.report.panels import Entry, Panel, Picture
from zfcal.tracks import FISH, KINDS, ROBOT
from zfcal.units import WINDOW_S

Floats = NDArray[np.float64]

_WIDTH_IN = 3.4
_BAR_IN = 0.6
"""Room for the bar that tells what the colours of a map mean."""

_CELLS = 60
"""Squares of the density map along the longer side of the tank."""

_SLIVER = 0.3
"""A square counts as having at least this share of its area in the tank."""

_BRIGHTEST = 0.995
"""The squares above this quantile share the brightest colour."""


def tracks_picture(located: Located) -> Picture | None:
    """Return paths of the last window and maps of the whole recording; None without a point.

    Parameters
    ----------
    located
        All agents of a trial on the model's clock.
    """
    if not len(located):
        return None
    arena = located.arena
    width_in, height_in = arena_size_in(arena, _WIDTH_IN)
    end_s = float(located.k[-1] + 1) * located.dt_s
    start_s = max(float(located.k[0]) * located.dt_s, end_s - WINDOW_S)
    last = located.between(start_s, end_s)
    kinds = [kind for kind in (FISH, ROBOT) if (located.kind == kind).any()]
    paths = Panel(
        title=f"Paths, {start_s:.0f} to {end_s:.0f} s",
        alt=f"Paths of {_count(last)} over the plan of the arena {arena.name}.",
        draw=partial(_draw_paths, located=last),
        size_in=(width_in, height_in),
    )
    maps = [
        Panel(
            title=f"{KINDS[kind].capitalize()}, all {end_s:.0f} s",
            alt=_describe_map(located.of_kind(kind), KINDS[kind]),
            draw=partial(_draw_density, located=located.of_kind(kind)),
            size_in=(width_in + _BAR_IN, height_in),
        )
        for kind in kinds
    ]
    colours = {FISH: theme.FISH, ROBOT: theme.ROBOT}
    return Picture(
        name="tracks",
        title="Tracks",
        panels=(paths, *maps),
        key=tuple(
            Entry(label=f"{KINDS[kind]}, path", colour=colours[kind], mark="line") for kind in kinds
        ),
        note="Paths break where an animal was not seen. The maps tell how many times as long an "
        "animal was in a place as if it were everywhere alike.",
    )


def _count(located: Located) -> str:
    ids = {KINDS[kind]: len(np.unique(located.agent[located.kind == kind])) for kind in (0, 1)}
    return " and ".join(f"{n} {kind} tracks" for kind, n in ids.items() if n) or "nobody"


def _describe_map(located: Located, who: str) -> str:
    names = located.arena.zone_names
    share = np.bincount(located.zone, minlength=len(names) + 1) / len(located)
    said = ", ".join(f"{name} {s:.0%}" for name, s in zip(names, share[1:], strict=True))
    return f"Map of where the {who} spent the time: {said}."


def _draw_paths(axes: Axes, *, located: Located) -> None:
    axes.grid(visible=False)
    paint_walls(axes, located.arena)
    paint_zones(axes, located.arena, alpha=0.13)
    for kind, colour, width in ((FISH, theme.FISH, 0.7), (ROBOT, theme.ROBOT, 1.3)):
        pieces = path_pieces(located.of_kind(kind))
        lines = LineCollection(pieces, colors=colour, linewidths=width, alpha=0.75, zorder=3)
        axes.add_collection(lines, autolim=False)


def path_pieces(located: Located) -> list[Floats]:
    """Return the unbroken pieces of all paths.

    Parameters
    ----------
    located
        Agents on the model's clock.

    Returns
    -------
    list of ndarray, shape (point, 2)
        Positions in metres, at least two each; a piece ends where an agent is
        missing for a sample.
    """
    order = np.argsort(located.agent, kind="stable")
    agent, k, xy_m = located.agent[order], located.k[order], located.xy_m[order]
    breaks = np.flatnonzero((np.diff(agent) != 0) | (np.diff(k) != 1)) + 1
    return [piece for piece in np.split(xy_m, breaks) if len(piece) > 1]


def _draw_density(axes: Axes, *, located: Located) -> None:
    axes.grid(visible=False)
    paint_walls(axes, located.arena)
    share, extent = density(located)
    area_m2 = _area_inside_m2(located.arena, extent, share.shape)
    # A square that the wall cuts to a sliver would stand out for a single visit.
    floor_m2 = _SLIVER * float(area_m2.max())
    times = share * located.arena.outline.area / np.maximum(area_m2, floor_m2)
    times = np.ma.masked_array(times, area_m2 <= 0)
    brightest = float(np.quantile(times.compressed(), _BRIGHTEST))
    # A square root: else the corner where a fish rests is all that is seen.
    image = axes.imshow(
        times,
        extent=extent,
        origin="lower",
        cmap="viridis",
        norm=PowerNorm(0.5, 0.0, max(brightest, 1.0)),
        interpolation="nearest",
        zorder=1,
    )
    image.set_clip_path(axes.patches[0])
    # Inside the axes' own room: a bar beside them would be squeezed out where scales are equal.
    place = axes.inset_axes((1.02, 0.2, 0.035, 0.6))
    bar = axes.figure.colorbar(image, cax=place, extend="max", ticks=MaxNLocator(4))
    bar.set_label("1 = evenly spread")
    bar.outline.set_visible(False)


def density(located: Located) -> tuple[Floats, tuple[float, float, float, float]]:
    """Return the share of time in each square of a grid over the tank.

    Parameters
    ----------
    located
        At least one point.

    Returns
    -------
    share : ndarray, shape (row, column)
        Rows go up (y), columns right (x); sums to one over the points inside.
    extent : tuple of float
        ``x0, x1, y0, y1`` of the grid in metres.
    """
    x0, y0, x1, y1 = located.arena.outline.bounds
    cell_m = located.arena.extent_m / _CELLS
    columns, rows = (max(1, int(np.ceil(length / cell_m - 1e-9))) for length in (x1 - x0, y1 - y0))
    extent = (x0, x0 + columns * cell_m, y0, y0 + rows * cell_m)
    seen_m = located.xy_m[located.zone > 0]
    counts, _, _ = np.histogram2d(
        seen_m[:, 1], seen_m[:, 0], bins=(rows, columns), range=(extent[2:], extent[:2])
    )
    return counts / max(counts.sum(), 1.0), extent


def _area_inside_m2(
    arena: Arena, extent: tuple[float, float, float, float], shape: tuple[int, ...]
) -> Floats:
    """Return how much of each square lies in the tank, in square metres."""
    x, dx = np.linspace(*extent[:2], shape[1], endpoint=False, retstep=True)
    y, dy = np.linspace(*extent[2:], shape[0], endpoint=False, retstep=True)
    x_m, y_m = np.meshgrid(x, y)
    squares = shapely.box(x_m, y_m, x_m + dx, y_m + dy)
    return np.asarray(shapely.area(shapely.intersection(arena.outline, squares)))

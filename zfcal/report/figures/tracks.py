"""Where the animals swam: paths over the tank, and a map of how often they were where."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import PowerNorm
from matplotlib.ticker import MaxNLocator

from zfcal.arena import Arena
from zfcal.arrays import Floats
from zfcal.behaviour.located import Located
from zfcal.report.figures import theme
from zfcal.report.figures.arena import arena_size_in, paint_walls, paint_zones
from zfcal.report.figures.panels import Entry, Panel, Picture
from zfcal.report.seen import Seen, Visits, grid_of
from zfcal.tracks import FISH, KINDS, ROBOT
from zfcal.units import WINDOW_S

WIDTH_IN = 3.4
BAR_IN = 0.6
"""Room for the bar that tells what the colours of a map mean."""

_SLIVER = 0.3
"""A square counts as having at least this share of its area in the tank."""

_BRIGHTEST = 0.995
"""The squares above this quantile share the brightest colour."""


def tracks_picture(seen: Seen) -> Picture | None:
    """Return paths of the last window and maps of the whole recording; None without a point.

    Parameters
    ----------
    seen
        All agents of a trial.
    """
    if not seen.n_points:
        return None
    arena = seen.arena
    width_in, height_in = arena_size_in(arena, WIDTH_IN)
    start_s = max(float(seen.first_k) * seen.dt_s, seen.end_s - WINDOW_S)
    paths = Panel(
        title=f"Paths, {start_s:.0f} to {seen.end_s:.0f} s",
        alt=f"Paths of {_count(seen.last)} over the plan of the arena {arena.name}.",
        draw=partial(_draw_paths, located=seen.last),
        size_in=(width_in, height_in),
    )
    area_m2 = area_inside_m2(arena)
    maps = [
        Panel(
            title=f"{KINDS[kind].capitalize()}, all {seen.end_s:.0f} s",
            alt=describe_map(visits, arena.zone_names, KINDS[kind]),
            draw=partial(_draw_density, arena=arena, visits=visits, area_m2=area_m2),
            size_in=(width_in + BAR_IN, height_in),
        )
        for kind, visits in seen.visits.items()
    ]
    colours = {FISH: theme.FISH, ROBOT: theme.ROBOT}
    return Picture(
        name="tracks",
        title="Tracks",
        panels=(paths, *maps),
        key=tuple(
            Entry(label=f"{KINDS[kind]}, path", colour=colours[kind], mark="line")
            for kind in seen.visits
        ),
        note="Paths break where an animal was not seen. The maps show how many times as long an "
        "animal was in a place as if it were everywhere alike.",
    )


def _count(located: Located) -> str:
    ids = {KINDS[kind]: len(np.unique(located.agent[located.kind == kind])) for kind in (0, 1)}
    return " and ".join(f"{n} {kind} tracks" for kind, n in ids.items() if n) or "nobody"


def describe_map(visits: Visits, names: tuple[str, ...], who: str) -> str:
    """Return what a map shows, for those who cannot see it: the share of time in each zone."""
    share = visits.zones / visits.zones.sum()
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


def _draw_density(axes: Axes, *, arena: Arena, visits: Visits, area_m2: Floats) -> None:
    times = times_as_even(visits, arena, area_m2)
    draw_map(axes, arena, times, brightest_of(times))


def times_as_even(visits: Visits, arena: Arena, area_m2: Floats) -> np.ma.MaskedArray[Any, Any]:
    """Return how many times as long animals were in each square as if spread evenly.

    Parameters
    ----------
    visits
        How often they were where.
    arena
        The tank.
    area_m2 : ndarray, shape (row, column)
        From `area_inside_m2`; squares outside are masked.
    """
    # A square that the wall cuts to a sliver would stand out for a single visit.
    floor_m2 = _SLIVER * float(area_m2.max())
    times = density(visits) * arena.outline.area / np.maximum(area_m2, floor_m2)
    return np.ma.masked_array(times, area_m2 <= 0)


def brightest_of(times: np.ma.MaskedArray[Any, Any]) -> float:
    """Return where the colours of a map end, at least at evenly spread."""
    return max(float(np.quantile(times.compressed(), _BRIGHTEST)), 1.0)


def draw_map(
    axes: Axes, arena: Arena, times: np.ma.MaskedArray[Any, Any], brightest: float
) -> None:
    """Draw a map of where animals were, with the bar that tells what its colours mean."""
    axes.grid(visible=False)
    paint_walls(axes, arena)
    _, extent = grid_of(arena)
    # A square root: else the corner where a fish rests is all that is seen.
    image = axes.imshow(
        times,
        extent=extent,
        origin="lower",
        cmap="viridis",
        norm=PowerNorm(0.5, 0.0, brightest),
        interpolation="nearest",
        zorder=1,
    )
    image.set_clip_path(axes.patches[0])
    # Inside the axes' own room: a bar beside them would be squeezed out where scales are equal.
    place = axes.inset_axes((1.02, 0.2, 0.035, 0.6))
    bar = axes.figure.colorbar(image, cax=place, extend="max", ticks=MaxNLocator(4))
    bar.set_label("1 = evenly spread")
    bar.outline.set_visible(False)


def density(visits: Visits) -> Floats:
    """Return the share of time in each square, shape (row, column); the shares sum to one."""
    return visits.cells / max(visits.cells.sum(), 1.0)


def area_inside_m2(arena: Arena) -> Floats:
    """Return how much of each square of the grid lies in the tank, in square metres."""
    shape, extent = grid_of(arena)
    x, dx = np.linspace(*extent[:2], shape[1], endpoint=False, retstep=True)
    y, dy = np.linspace(*extent[2:], shape[0], endpoint=False, retstep=True)
    x_m, y_m = np.meshgrid(x, y)
    squares = shapely.box(x_m, y_m, x_m + dx, y_m + dy)
    return np.asarray(shapely.area(shapely.intersection(arena.outline, squares)))

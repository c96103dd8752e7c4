"""Who swam where, and under which id when: what a person looks at after tracking."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection

from zfcal.arena import Arena
from zfcal.arrays import Floats, Ints
from zfcal.report.figures import theme
from zfcal.report.figures.arena import arena_size_in, paint_walls
from zfcal.tracks import GUESS, KINDS, ROBOT, Tracks

_WIDTH_IN = 4.6
_TIMES_IN = 3.4
_MOST_NAMED = 25
_FISH = ("#0072b2", "#56b4e9", "#009e73", "#e6a817", "#cc79a7", "#7d2a35")


def draw_trajectories(arena: Arena, tracks: Tracks, path: Path) -> None:
    """Write a PNG with the paths over the plan of the tank, and the ids over time.

    Parameters
    ----------
    arena
        The tank.
    tracks
        All rows; a path is broken where an agent is missing in a frame.
    path
        Where the PNG goes.
    """
    width_in, height_in = arena_size_in(arena, _WIDTH_IN)
    with theme.style():
        figure = theme.new_figure(width_in + _TIMES_IN, height_in)
        plan, times = figure.subplots(1, 2, width_ratios=(width_in, _TIMES_IN))
        _draw_plan(plan, arena, tracks)
        _draw_times(times, tracks)
        theme.save_png(figure, path)


def _draw_plan(axes: Axes, arena: Arena, tracks: Tracks) -> None:
    axes.grid(visible=False)
    paint_walls(axes, arena)
    for agent in np.unique(tracks.agent):
        own = tracks.take(tracks.agent == agent)
        pieces = [np.column_stack([own.x_m, own.y_m])[part] for part in unbroken(own.frame)]
        colour = _colour(own)
        axes.add_collection(LineCollection(pieces, colors=colour, linewidths=0.7, zorder=2))
        unsure = own.confidence < GUESS
        axes.plot(own.x_m[unsure], own.y_m[unsure], ".", color=colour, markersize=2, zorder=3)
    first_s, end_s = _stretch(tracks)
    axes.set_title(f"Paths, {first_s:.0f} to {end_s:.0f} s; dots are guesses")


def _draw_times(axes: Axes, tracks: Tracks) -> None:
    """Draw a bar for each id while it is seen."""
    agents = np.unique(tracks.agent)
    for row, agent in enumerate(agents):
        own = tracks.take(tracks.agent == agent)
        bars = [_bar(own.time_s[part], row) for part in unbroken(own.frame)]
        axes.add_collection(
            LineCollection(bars, colors=_colour(own), linewidths=3, capstyle="butt")
        )
    axes.set_xlim(*_stretch(tracks))
    axes.set_ylim(max(len(agents), 1) - 0.5, -0.5)
    if len(agents) <= _MOST_NAMED:
        axes.set_yticks(range(len(agents)), [_name(tracks, agent) for agent in agents])
    else:
        axes.set_yticks([])
    axes.set_xlabel("time (s)")
    axes.set_title(f"{len(agents)} ids")


def _bar(time_s: Floats, row: int) -> Floats:
    return np.array([(time_s[0], row), (time_s[-1], row)])


def unbroken(frame: Ints) -> Iterator[slice]:
    """Yield the runs of frames without a gap.

    >>> list(unbroken(np.array([3, 4, 7, 8, 9])))
    [slice(0, 2, None), slice(2, 5, None)]
    """
    if not len(frame):
        return
    edges = [0, *(np.flatnonzero(np.diff(frame) != 1) + 1).tolist(), len(frame)]
    yield from (slice(a, b) for a, b in itertools.pairwise(edges))


def _stretch(tracks: Tracks) -> tuple[float, float]:
    if not len(tracks):
        return 0.0, 1.0
    first_s, end_s = float(tracks.time_s[0]), float(tracks.time_s[-1])
    return first_s, max(end_s, first_s + 1e-3)


def _colour(own: Tracks) -> str:
    return theme.ROBOT if own.kind[0] == ROBOT else _FISH[int(own.agent[0]) % len(_FISH)]


def _name(tracks: Tracks, agent: int) -> str:
    kind = int(tracks.kind[np.argmax(tracks.agent == agent)])
    return f"{KINDS[kind]} {agent}"

"""Draw what the model makes of a moment: docs/pictures/model.png.

A fish in a square tank, in the centre and at a wall, alone and beside two others, and the density
of the direction of its next step.

    .venv/bin/python benchmarks/calibration/model_picture.py
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Wedge

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from benchmarks.shared.measuring import DOCS
from zfcal.arena import Arena
from zfcal.arrays import Floats
from zfcal.artifacts.arenas import load_arena
from zfcal.model.onestep import heading_density
from zfcal.parameters import Parameters, natural

DT_S, SPEED_M_S = 0.2, 0.08
FOV_RAD = np.radians(135.0)
OTHERS_M = np.array([[0.07, 0.05], [0.09, -0.09]])
"""The two others, as the fish sees them, in metres."""

PLACES = {"in the centre": ((0.0, 0.0), 0.4), "near a wall": ((0.0, 0.02), 0.0)}
"""Shift from the middle of the tank, or of the wall below, and heading in radians."""

BLUE, ORANGE, GREY = "#0072b2", "#d55e00", "#8a8f98"


def poses(arena: Arena, name: str) -> tuple[Floats, Floats]:
    """Return positions, shape (3, 2), and headings of the fish and of the two others."""
    x0, y0, x1, y1 = arena.outline.bounds
    shift, heading = PLACES[name]
    foot = (y0 + y1) / 2 if name == "in the centre" else y0
    own = np.array([(x0 + x1) / 2, foot]) + shift
    others = OTHERS_M if name == "in the centre" else np.abs(OTHERS_M)
    return np.vstack([own, own + others]), np.array([heading, 1.0, -0.5])


def density(parameters: Parameters, arena: Arena, name: str, n: int) -> tuple[Floats, Floats]:
    """Return angles, and the density of the first fish's heading among the first n, both (361,)."""
    xy_m, heading_rad = poses(arena, name)
    return heading_density(
        parameters, arena, xy_m=xy_m[:n], heading_rad=heading_rad[:n], speed_m_s=SPEED_M_S
    )


def draw(parameters: Parameters, arena: Arena) -> Figure:
    """Return the picture: for each place a map, and the density of the next direction."""
    figure = Figure(figsize=(8.6, 5.6), layout="constrained")
    for row, name in enumerate(PLACES):
        _map(figure.add_subplot(2, 2, 2 * row + 1), arena, name)
        axes = figure.add_subplot(2, 2, 2 * row + 2)
        for n, label, colour in ((1, "alone", GREY), (3, "beside the two", ORANGE)):
            theta, share = density(parameters, arena, name, n)
            axes.plot(np.degrees(theta), share, color=colour, label=label, lw=2)
        axes.set(xlim=(-180, 180), ylim=(0, None), xticks=[-180, -90, 0, 90, 180])
        axes.set(xlabel="direction of the next step (degrees)", ylabel="density (per radian)")
        axes.legend(frameon=False, fontsize=8, loc="upper right")
    return figure


def _map(axes: Axes, arena: Arena, name: str) -> None:
    xy, heading = poses(arena, name)
    axes.plot(*np.array(arena.outline.exterior.xy), color="black", lw=2)
    degrees = np.degrees([heading[0] - FOV_RAD, heading[0] + FOV_RAD])
    axes.add_patch(Wedge(tuple(xy[0]), 0.06, *degrees, color=GREY, alpha=0.25, lw=0))
    for k, colour in enumerate((ORANGE, BLUE, BLUE)):
        ahead = np.array([np.cos(heading[k]), np.sin(heading[k])])
        axes.annotate(
            "", xy[k] + 0.02 * ahead, xy[k] - 0.02 * ahead,
            arrowprops={"arrowstyle": "-|>", "color": colour, "lw": 2.5},
        )  # fmt: skip
    below = 0.16 if name == "in the centre" else 0.04
    axes.set_xlim(xy[0, 0] - 0.2, xy[0, 0] + 0.2)
    axes.set_ylim(xy[0, 1] - below, xy[0, 1] + 0.32 - below)
    axes.set_aspect("equal")
    axes.set(title=name, xlabel="x (m)", ylabel="y (m)")


def main() -> None:
    """Draw it with the parameters of natural fish."""
    arena = load_arena("open-square", Path())
    zones = tuple((zone.name, zone.follows_walls) for zone in arena.zones)
    figure = draw(natural(zones, dt_s=DT_S), arena)
    figure.suptitle("A fish (orange), what it sees, and where it goes next")
    figure.savefig(DOCS / "pictures" / "model.png", dpi=110)


if __name__ == "__main__":
    main()

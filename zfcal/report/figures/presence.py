"""Where the fish were beside where the calibrated model is, in colours of one scale."""

from __future__ import annotations

from functools import partial

import numpy as np
from matplotlib.axes import Axes

from zfcal.arena import Arena
from zfcal.arrays import Floats
from zfcal.report.figures import theme
from zfcal.report.figures.arena import arena_size_in
from zfcal.report.figures.panels import Entry, Panel, Picture
from zfcal.report.figures.tracks import (
    BAR_IN,
    WIDTH_IN,
    area_inside_m2,
    brightest_of,
    describe_map,
    draw_map,
    times_as_even,
)
from zfcal.report.seen import Visits


def presence_picture(
    fish: Visits | None, model: Visits | None, arena: Arena, *, end_s: float
) -> Picture | None:
    """Return maps of fish and model side by side, and their shares of time in each zone.

    Parameters
    ----------
    fish
        Where the fish of the whole recording were.
    model
        Where those of a long simulation were.
    arena
        The tank.
    end_s
        Seconds of the recording.

    Returns
    -------
    Picture or None
        None without one of them.
    """
    if fish is None or model is None or not fish.zones[1:].sum() or not model.zones[1:].sum():
        return None
    width_in, height_in = arena_size_in(arena, WIDTH_IN)
    area_m2 = area_inside_m2(arena)
    maps = {
        f"Fish, all {end_s:.0f} s": (fish, "fish"),
        "Model, long simulation": (model, "simulated fish of the calibrated model"),
    }
    times = [times_as_even(visits, arena, area_m2) for visits, _ in maps.values()]
    brightest = max(map(brightest_of, times))
    panels = [
        Panel(
            title=title,
            alt=describe_map(visits, arena.zone_names, who),
            draw=partial(draw_map, arena=arena, times=own, brightest=brightest),
            size_in=(width_in + BAR_IN, height_in),
        )
        for (title, (visits, who)), own in zip(maps.items(), times, strict=True)
    ]
    shares = np.array([_shares(fish), _shares(model)])
    return Picture(
        name="presence",
        title="Where fish and model are",
        short="Presence",
        panels=[*panels, _share_panel(shares, arena, height_in)],
        key=(
            Entry(label="fish, as observed", colour=theme.FISH, mark="bar"),
            Entry(label="calibrated model, long simulation", colour=theme.MODEL, mark="steps"),
        ),
        note="Both maps have one scale: how many times as long an animal was in a place as if it "
        "were everywhere alike. The model is that of the last window, simulated for 2 h; the fish "
        "are those of the whole recording, which is shorter: what the map of the fish shows beyond "
        "the other may be chance, since fish stay in a place for minutes.",
    )


def _shares(visits: Visits) -> Floats:
    """Return the share of time in each zone, shape (zone,)."""
    zones = visits.zones[1:].astype(np.float64)
    return np.asarray(zones / zones.sum())


def _share_panel(shares: Floats, arena: Arena, height_in: float) -> Panel:
    names = arena.zone_names
    said = "; ".join(
        f"{name} {fish:.0%} of the fish's and {model:.0%} of the model's"
        for name, fish, model in zip(names, *shares, strict=True)
    )
    return Panel(
        title="Time in each zone",
        alt=f"Share of time in each zone: {said}.",
        draw=partial(_draw_shares, shares=shares, arena=arena),
        size_in=(WIDTH_IN, height_in),
    )


def _draw_shares(axes: Axes, *, shares: Floats, arena: Arena) -> None:
    at, names = np.arange(len(arena.zones)), arena.zone_names
    for index, (colour, row, hatch) in enumerate(
        ((theme.FISH, shares[0], ""), (theme.MODEL, shares[1], "////"))
    ):
        x = at + (index - 0.5) * 0.4
        bars = axes.bar(x, 100 * row, width=0.36, color=colour, alpha=0.5, lw=0)
        for bar in bars:
            bar.set(hatch=hatch, edgecolor=theme.GROUND)
        for left, value in zip(x, 100 * row, strict=True):
            axes.annotate(
                f"{value:.0f}", (left, value), xytext=(0, 2), textcoords="offset points",
                ha="center", fontsize=theme.small_pt(),
            )  # fmt: skip
    theme.name_ticks(axes, at, names)
    colours = theme.zone_colours(names)
    for label, name in zip(axes.get_xticklabels(), names, strict=True):
        label.set(color=colours[name], fontweight="bold")
    axes.set(ylabel="% of the time", ylim=(0, min(112.0, 115 * float(shares.max()))))
    axes.set_yticks([tick for tick in axes.get_yticks() if tick <= 100])
    axes.grid(visible=False, axis="x")

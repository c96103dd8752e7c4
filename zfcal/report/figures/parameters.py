"""The calibrated parameters round by round, with their intervals.

A hollow mark says that the window of that round does not pin the parameter down.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from zfcal.parameters import ALPHA_MAX, KAPPA_0_MAX, KAPPA_F_MAX, gene_names, gene_scales, to_genes
from zfcal.report.figures import theme
from zfcal.report.figures.panels import Entry, Mark, Panel, Picture
from zfcal.report.views import Round

_OWN = (
    ("kappa_0", "kappa_0: keeps its direction", KAPPA_0_MAX),
    ("kappa_f", "kappa_f: aims at neighbours", KAPPA_F_MAX),
    ("alpha", "alpha: weight of neighbours", ALPHA_MAX),
)


_ROUNDING = 1e-6
"""Of values that went through a file."""

_EITHER = "95 % interval, by likelihood or score"
_INTERVAL = {
    frozenset({"likelihood"}): "95 % interval of the window's likelihood",
    frozenset({"score"}): "95 % of the genomes that fit as well",
}


def parameters_picture(rounds: Sequence[Round]) -> Picture | None:
    """Return the picture of all calibrated parameters; None before the first calibration.

    Parameters
    ----------
    rounds
        Of one trial; the starting model (second 0) is no calibration.
    """
    calibrated = [r for r in rounds if r.second > 0]
    if not calibrated:
        return None
    zones = calibrated[-1].parameters.zone_names
    calibrated = [r for r in calibrated if r.parameters.zone_names == zones]
    own = [
        _panel(title, [f"{zone}.{key}" for zone in zones], zones, calibrated, top)
        for key, title, top in _OWN
    ]
    gamma = [
        _panel(
            f"gamma: attraction from {zone}",
            [f"{zone}.gamma.{to}" for to in zones],
            zones,
            calibrated,
            1.0,
        )
        for zone in zones
    ]
    return Picture(
        name="parameters",
        title="Calibrated parameters",
        short="Parameters",
        panels=(*own, *gamma),
        key=_key(zones, calibrated),
        note="One colour per zone: in the upper row the zone where the animal is, in the gamma "
        "panels the zone that attracts it. Only ratios within a gamma panel matter; its largest "
        "value is 1. Marks are what was published, which need not lie in the window's interval.",
    )


def values_of(round_: Round) -> dict[str, float]:
    """Return the calibrated parameters of a model by gene name, gamma rows scaled to 1."""
    zones = round_.parameters.zone_names
    values = to_genes(round_.parameters) * gene_scales(len(zones))
    named = dict(zip(gene_names(zones), values.tolist(), strict=True))
    for zone in zones:
        row = [f"{zone}.gamma.{to}" for to in zones]
        top = max(named[name] for name in row)
        if top > 0:
            named |= {name: named[name] / top for name in row}
    return named


def outside_of(round_: Round) -> list[str]:
    """Return the parameters whose published value lies outside the interval of the likelihood."""
    if round_.intervals_by != "likelihood":
        return []
    values = values_of(round_)
    return [
        name
        for name, (low, high) in round_.intervals.items()
        if name in values and not low - _ROUNDING <= values[name] <= high + _ROUNDING
    ]


def _key(zones: Sequence[str], rounds: Sequence[Round]) -> tuple[Entry, ...]:
    colours, markers = theme.zone_colours(zones), theme.zone_markers(zones)
    mark: Mark = "line" if len(rounds) > 1 else "points"
    entries = [
        Entry(label=zone, colour=colours[zone], mark=mark, marker=markers[zone]) for zone in zones
    ]
    if any(r.unidentified for r in rounds):
        text = "hollow: not identified in that window"
        entries.append(Entry(label=text, colour=theme.MUTED, mark="hollow", marker="o"))
    if any(r.intervals for r in rounds):
        text = _INTERVAL.get(frozenset(r.intervals_by for r in rounds if r.intervals), _EITHER)
        text += ", where identified" if len(rounds) > 1 else ""
        entries.append(Entry(label=text, colour=theme.MUTED, mark="band"))
    return tuple(entries)


def _panel(
    title: str, names: Sequence[str], zones: Sequence[str], rounds: Sequence[Round], top: float
) -> Panel:
    last = values_of(rounds[-1])
    said = ", ".join(f"{zone} {last[name]:.3g}" for zone, name in zip(zones, names, strict=True))
    draw = _draw_single if len(rounds) == 1 else _draw_course
    return Panel(
        title=title,
        alt=f"{title} over {len(rounds)} rounds; last: {said}.",
        draw=partial(draw, names=names, zones=zones, rounds=rounds, top=top),
    )


def _draw_single(
    axes: Axes, *, names: Sequence[str], zones: Sequence[str], rounds: Sequence[Round], top: float
) -> None:
    (only,) = rounds
    colours, markers = theme.zone_colours(zones), theme.zone_markers(zones)
    values = values_of(only)
    for index, (name, zone) in enumerate(zip(names, zones, strict=True)):
        low, high = only.intervals.get(name, (np.nan, np.nan))
        axes.plot([index, index], [low, high], color=colours[zone], lw=6, alpha=0.3)
        face = theme.GROUND if name in only.unidentified else colours[zone]
        axes.plot(
            index, values[name], marker=markers[zone], ms=7, color=colours[zone], mfc=face, zorder=3
        )
    theme.name_ticks(axes, np.arange(len(zones)), zones)
    axes.set(xlim=(-0.6, len(zones) - 0.4), ylim=(-0.04 * top, 1.06 * top))
    axes.grid(visible=False, axis="x")


def _draw_course(
    axes: Axes, *, names: Sequence[str], zones: Sequence[str], rounds: Sequence[Round], top: float
) -> None:
    colours, markers = theme.zone_colours(zones), theme.zone_markers(zones)
    minute = np.array([r.second for r in rounds]) / 60.0
    table = [values_of(r) for r in rounds]
    for index, (name, zone) in enumerate(zip(names, zones, strict=True)):
        # Beside each other, so that intervals of the same window do not cover.
        x = minute + 0.09 * (index - (len(zones) - 1) / 2)
        value = np.array([row[name] for row in table])
        bounds = [r.intervals.get(name, (np.nan, np.nan)) for r in rounds]
        low, high = np.array(bounds).T
        known = np.array([name not in r.unidentified for r in rounds])
        # The others span most of the axis: drawn, they would hide these.
        axes.vlines(x[known], low[known], high[known], color=colours[zone], lw=4, alpha=0.35)
        axes.plot(x, value, color=colours[zone], lw=1, alpha=0.5)
        for chosen, face in ((known, colours[zone]), (~known, theme.GROUND)):
            axes.plot(
                x[chosen],
                value[chosen],
                ls="none",
                marker=markers[zone],
                color=colours[zone],
                mfc=face,
                zorder=3,
            )
    axes.set(xlabel="end of the window (min)", ylim=(-0.04 * top, 1.06 * top))
    axes.xaxis.set_major_locator(MaxNLocator(7, integer=True))

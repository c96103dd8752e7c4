"""Whether fish follow the robot: directions lag by lag, and who leaves a room first."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from zfcal.arrays import Floats
from zfcal.report.figures import theme
from zfcal.report.figures.panels import Entry, Panel, Picture
from zfcal.report.followed import FOLLOWED, LED, Followed, Level

_SIZE_IN = (5.6, 2.8)
_ROOMS_IN = (3.75, 2.8)
_CHANCE = theme.INK


def followed_picture(found: Followed | None) -> Picture | None:
    """Return the picture of a trial; None where the robot was never near a fish.

    Parameters
    ----------
    found
        Over the windows; None where it was not measured.
    """
    if found is None or all(np.isnan(level.value) for level in found.lags.values()):
        return None
    panels = [_lag_panel(found)]
    if found.has_rooms and found.measures[LED].n:
        panels.append(_room_panel(found))
    return Picture(
        name="following",
        title="Fish after the robot",
        short="Following",
        panels=panels,
        key=_key(list(found.lags.values())),
        note="1 means that fish swim where the robot swam, 0 that they do not care, -1 the "
        "opposite. To the right of 0 the robot is first, to the left the fish are: who leads is "
        "higher on the right. Chance is the robot's own track set against another time of the "
        "fish.",
    )


def _key(levels: Sequence[Level]) -> tuple[Entry, ...]:
    entries = (
        ("value", Entry(label="robot", colour=theme.ROBOT, mark="line", marker="s")),
        ("low", Entry(label="95 % of its mean", colour=theme.ROBOT, mark="band")),
        ("ceiling", Entry(label="ceiling: a fish in its place", colour=theme.BAND, mark="dash")),
        ("ceiling", Entry(label="95 % of the fish in its place", colour=theme.BAND, mark="band")),
        ("floor", Entry(label="floor: 95 % of chance", colour=_CHANCE, mark="dot")),
    )
    return tuple(entry for name, entry in entries if not np.isnan(_column(levels, name)).all())


def _column(levels: Sequence[Level], name: str) -> Floats:
    return np.array([getattr(level, name) for level in levels], dtype=np.float64)


def _lag_panel(found: Followed) -> Panel:
    lag_s, levels = np.array(list(found.lags)), list(found.lags.values())
    value = _column(levels, "value")
    best = int(np.nanargmax(value))
    top = levels[best]

    def draw(axes: Axes) -> None:
        for prefix, colour in (("ceiling_", theme.BAND), ("", theme.ROBOT)):
            low, high = (_column(levels, prefix + end) for end in ("low", "high"))
            axes.fill_between(lag_s, low, high, color=colour, alpha=0.3, lw=0)
        axes.plot(lag_s, _column(levels, "ceiling"), color=theme.BAND, ls="--", lw=1.4)
        axes.plot(lag_s, _column(levels, "floor"), color=_CHANCE, ls=":", lw=1.4)
        axes.plot(lag_s, value, color=theme.ROBOT, marker="s", ms=3.5)
        axes.axvline(0, color=theme.MUTED, lw=0.8)
        axes.set(xlabel="lag of the fish behind the robot (s)", ylabel="correlation of directions")

    return Panel(
        title="Directions at a lag",
        alt=f"Correlation of the fish's directions with the robot's at lags from {lag_s[0]:g} to "
        f"{lag_s[-1]:g} s: highest at {lag_s[best]:+.1f} s with {top.value:.2f}, where a fish in "
        f"its place has {_said(top.ceiling)} and chance {_said(top.floor)}.",
        draw=draw,
        size_in=_SIZE_IN,
    )


def _room_panel(found: Followed) -> Panel:
    names = ("led by it", "its own, followed")
    levels = [found.measures[LED], found.measures[FOLLOWED]]

    def draw(axes: Axes) -> None:
        at = np.arange(len(names))
        ceiling = _column(levels, "ceiling")
        low, high = _column(levels, "ceiling_low"), _column(levels, "ceiling_high")
        axes.bar(at, high - low, bottom=low, width=0.6, color=theme.BAND, alpha=0.3)
        axes.hlines(ceiling, at - 0.3, at + 0.3, color=theme.BAND, ls="--", lw=1.4)
        axes.hlines(_column(levels, "floor"), at - 0.3, at + 0.3, color=_CHANCE, ls=":", lw=1.4)
        axes.plot(at, _column(levels, "value"), color=theme.ROBOT, marker="s", ls="none", ms=6)
        axes.set_xticks(at, names)
        axes.set(ylabel="share", ylim=(-0.03, 1.03), xlim=(-0.6, len(names) - 0.4))

    led, own = levels
    return Panel(
        title="Departures from a room",
        alt=f"The robot led a share of {_said(led.value)} of the group's departures, a fish in its "
        f"place {_said(led.ceiling)}; of its own {_said(own.value)} were followed, of a fish's "
        f"{_said(own.ceiling)}.",
        draw=draw,
        size_in=_ROOMS_IN,
    )


def _said(number: float) -> str:
    return "no value" if np.isnan(number) else f"{number:.2f}"

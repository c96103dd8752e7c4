"""V: speeds, in the zone where a step starts. Models draw their speeds from it."""

from __future__ import annotations

from collections.abc import Iterator

from zfcal.behaviour.features.statistic import Observed, Points, Statistic, lengths
from zfcal.behaviour.histograms import bin_edges


def observe(points: Points) -> Iterator[Observed]:
    """Yield the speed of each step, in metres per second."""
    start, end = points.moves
    xy_m, dt_s = points.located.xy_m, points.located.dt_s
    yield Observed(at=start, value=lengths(xy_m[end] - xy_m[start]) / dt_s)


STATISTICS = (
    Statistic(
        name="V",
        label="Speeds",
        phrase="the speeds",
        observe=observe,
        edges=lambda arena: bin_edges(arena.bins.speed_m_s),
        unit="m/s",
        title="Speed",
        axis="speed",
        source="Cazenille et al., data analysis",
        drawn=False,
    ),
)

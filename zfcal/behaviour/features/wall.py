"""W: distances to the nearest wall."""

from __future__ import annotations

from collections.abc import Iterator

from zfcal.behaviour.features.statistic import Observed, Points, Statistic
from zfcal.behaviour.histograms import bin_edges


def observe(points: Points) -> Iterator[Observed]:
    """Yield the distance of each agent to the nearest wall, at each sample, in metres."""
    yield Observed(at=points.own, value=points.located.wall_distance_m[points.own])


STATISTICS = (
    Statistic(
        name="W",
        label="Distances to nearest wall",
        phrase="the distances to the wall",
        observe=observe,
        edges=lambda arena: bin_edges(arena.bins.wall_distance_m),
        unit="m",
        title="To the wall",
        axis="distance to the wall",
        source="Cazenille et al., data analysis",
    ),
)

"""D: distances between agents that are in one zone."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from zfcal.behaviour.features.statistic import Observed, Points, Statistic, lengths
from zfcal.behaviour.histograms import bin_edges


def observe(points: Points) -> Iterator[Observed]:
    """Yield the distance of each pair that is in one zone at one sample, in metres."""
    zone, xy_m = points.located.zone, points.located.xy_m
    for first, second in points.pairs():
        same = np.flatnonzero(zone[first] == zone[second])
        a, b = first[same], second[same]
        yield Observed(at=a, value=lengths(xy_m[b] - xy_m[a]), also=b)


STATISTICS = (
    Statistic(
        name="D",
        label="Inter-individual distances",
        phrase="the distances between fish",
        observe=observe,
        edges=lambda arena: bin_edges(arena.bins.distance_m),
        unit="m",
        title="Between two fish",
        axis="distance",
        source="Cazenille et al., data analysis",
    ),
)

"""T: into which zone a step leads, stays included."""

from __future__ import annotations

from collections.abc import Iterator

from zfcal.behaviour.features.statistic import Observed, Points, Statistic


def observe(points: Points) -> Iterator[Observed]:
    """Yield each step: in the zone where it starts, the zone where it ends."""
    start, end = points.moves
    yield Observed(at=start, value=points.located.zone[end].astype("int64"))


STATISTICS = (
    Statistic(
        name="T",
        label="Zone transitions",
        phrase="the moves between zones",
        observe=observe,
        form="table",
        title="Transitions in one step",
        source="Cazenille et al., data analysis",
    ),
)

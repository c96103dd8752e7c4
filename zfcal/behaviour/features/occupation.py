"""O: in which zones the agents are."""

from __future__ import annotations

from collections.abc import Iterator

from zfcal.behaviour.features.statistic import Observed, Points, Statistic


def observe(points: Points) -> Iterator[Observed]:
    """Yield each agent at each sample."""
    yield Observed(at=points.own, value=points.located.zone[points.own].astype("int64"))


STATISTICS = (
    Statistic(
        name="O",
        label="Zone occupation",
        phrase="the times in each zone",
        observe=observe,
        form="zones",
        title="Share of time in each zone",
        source="Cazenille et al., data analysis",
    ),
)

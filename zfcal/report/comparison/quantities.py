"""Which numbers of a trial are compared: their names, units and order.

What fish do comes from the registry of statistics; a statistic of another package is compared
without a line here. Scores follow: the model against the fish, and the robot against the fish.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

from zfcal.behaviour.features.registry import statistics
from zfcal.behaviour.features.statistic import Statistic
from zfcal.report.views import FEATURE_NAMES

Group = Literal["fish", "model", "robot"]

PER_SECOND = "per_s"
SHARE = "share"


@dataclass(frozen=True, slots=True, kw_only=True)
class Quantity:
    """One number of a trial.

    Parameters
    ----------
    name
        Its name, which ends with its unit.
    label
        What a table calls it.
    unit
        Its unit; empty for a pure number.
    group
        Whose it is.
    """

    name: str
    label: str
    unit: str
    group: Group


def quantities(zone_names: Sequence[str]) -> list[Quantity]:
    """Return all that is compared, in the order of the table.

    Parameters
    ----------
    zone_names
        The zones of the arenas.
    """
    fish = [each for known in statistics().values() for each in quantities_of(known, zone_names)]
    return [*fish, *_scores()]


def quantities_of(statistic: Statistic, zone_names: Sequence[str]) -> list[Quantity]:
    """Return what is compared of one statistic: its mean, or its share of each zone.

    Parameters
    ----------
    statistic
        ``bins`` give the mean of the values, a ``table`` how often agents change their zone,
        ``zones`` the share of each.
    zone_names
        The zones.
    """
    if statistic.form == "zones":
        return [
            Quantity(
                name=f"{statistic.name}_{SHARE}_{zone}",
                label=f"{statistic.label}: {zone}",
                unit="",
                group="fish",
            )
            for zone in zone_names
        ]
    if statistic.form == "table":
        name = f"{statistic.name}_{PER_SECOND}"
        return [Quantity(name=name, label=statistic.label, unit="1/s", group="fish")]
    ending = f"_{statistic.unit.replace('/', '_')}" if statistic.unit else ""
    return [
        Quantity(
            name=f"{statistic.name}{ending}",
            label=statistic.label,
            unit=statistic.unit,
            group="fish",
        )
    ]


def model_name(feature: str) -> str:
    """Return what the model's score of a feature, over its ceiling, is called."""
    return f"{feature}_model_over_ceiling"


def robot_name(feature: str) -> str:
    """Return what the robot's score of a feature, over its ceiling, is called."""
    return f"{feature}_robot_over_ceiling"


ROBOT_S = "S_robot"
"""S of the robot itself: there is one where too few fish leave it without a ceiling."""


def _scores() -> Iterator[Quantity]:
    for feature in FEATURE_NAMES:
        label = f"Model against fish: {feature} / ceiling"
        yield Quantity(name=model_name(feature), label=label, unit="", group="model")
    for feature in FEATURE_NAMES:
        label = f"Robot against fish: {feature} / ceiling"
        yield Quantity(name=robot_name(feature), label=label, unit="", group="robot")
    yield Quantity(name=ROBOT_S, label="Robot against fish: S", unit="", group="robot")

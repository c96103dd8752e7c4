"""What D can say of a window: of how many pairs it is, and how many it cannot tell apart.

A score of D is a mean over zones. A zone with a handful of pairs weighs as much as the others,
and pairs that are farther apart than its bins reach are all alike to it.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from zfcal.arrays import Ints
from zfcal.behaviour.features.registry import named
from zfcal.behaviour.histograms import frequencies
from zfcal.behaviour.statistics import Statistics
from zfcal.report.contents import Statement
from zfcal.report.views import FEW, TrialView

_MOSTLY = 0.5
"""From this share in one bin on, a histogram hardly tells anything apart."""

_WHOLE_TANK = "separation"


def distance_statement(view: TrialView) -> Statement | None:
    """Return where D says little, in the last window; None where it says enough or is not there.

    Parameters
    ----------
    view
        The trial.
    """
    if not view.statistics:
        return None
    end_s = max(end for end, _ in view.statistics)
    fish = view.statistics.get((end_s, "control"))
    if fish is None:
        return None
    few, beyond = list(_few(fish)), list(_beyond(fish))
    if not few and not beyond:
        return None
    scarce = [f"{zone} ({n})" for zone, n in few]
    far = [f"{100 * share:.0f} % of the pairs in {zone}" for zone, share in beyond]
    edge_m = float(named("D").edges_in(view.arena)[-2])
    parts = []
    if few:
        parts.append(
            f"In the last window there are few pairs in {_listed(scarce)}: a histogram of so few "
            "is hardly more than chance, and D is a mean over the zones in which such a zone "
            "weighs as much as any other."
        )
    if beyond:
        parts.append(
            f"Farther apart than {edge_m:.3g} m, where the last bin of D begins, are "
            f"{_listed(far)}: D and S cannot distinguish these."
        )
    parts.append(_advice(view, fish) if beyond else "")
    return Statement(
        question="How much do distances between fish say here?",
        answer=" ".join(parts).strip(),
        figure=_figure(few, beyond),
    )


def _advice(view: TrialView, fish: Statistics) -> str:
    if _WHOLE_TANK in fish.names:
        return "Bins over the whole tank are among the statistics below (separation)."
    return (
        f"Bins over the whole tank: zfcal analyse {view.name} --features separation. A score with "
        "these in the place of D is not S."
    )


def _few(fish: Statistics) -> Iterator[tuple[str, int]]:
    """Yield the zones in which there are pairs, but few, and how many."""
    for zone, counts in _by_zone(fish):
        if 0 < counts.sum() < FEW:
            yield zone, int(counts.sum())


def _beyond(fish: Statistics) -> Iterator[tuple[str, float]]:
    """Yield the zones of which most pairs are in the last bin, and which share."""
    for zone, counts in _by_zone(fish):
        share = float(np.nan_to_num(frequencies(counts)[-1]))
        if share >= _MOSTLY and counts.sum() >= FEW:
            yield zone, share


def _by_zone(fish: Statistics) -> Iterator[tuple[str, Ints]]:
    yield from zip(fish.zone_names, fish.of("D"), strict=True)


def _figure(few: list[tuple[str, int]], beyond: list[tuple[str, float]]) -> tuple[str, str]:
    if beyond:
        zone, share = max(beyond, key=lambda row: row[1])
        return f"{100 * share:.0f} %", f"of the pairs in {zone} are in one bin of D"
    zone, n = min(few, key=lambda row: row[1])
    return str(n), f"pairs in {zone}"


def _listed(parts: list[str]) -> str:
    return parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} and {parts[-1]}"

"""How much of the animals was seen, in plain words: all that follows is of what was seen."""

from __future__ import annotations

import numpy as np

from zfcal.report.contents import Statement
from zfcal.report.seen import Seen
from zfcal.report.views import TrialView
from zfcal.tracks import FISH, ROBOT

_MUCH_IS_MISSING = 0.9
_TOO_MANY = 1.005
_NAMEABLE = 0.0005
"""A share that is printed as 0.0 % or less."""


def tracking_statement(view: TrialView) -> Statement | None:
    """Return which share of the positions is known; None without tracks.

    Parameters
    ----------
    view
        The trial.
    """
    seen, trial = view.seen, view.trial
    if seen is None or not seen.n_points or not trial.n_fish:
        return None
    share = _share(seen, FISH, trial.n_fish)
    length_s = (seen.last_k - seen.first_k + 1) * seen.dt_s
    parts = [
        f"Over {length_s:.0f} s, from the first sample to the last, {_percent(share)} of the "
        f"positions of {trial.n_fish} fish are known"
        + (
            f", and {_percent(_share(seen, ROBOT, trial.n_robots))} of the robot's."
            if trial.n_robots == 1
            else "."
        )
    ]
    outside = _outside(seen)
    if outside > _NAMEABLE:
        parts.append(f"Of these {100 * outside:.1f} % lie outside the tank and count nowhere.")
    if share > _TOO_MANY:
        parts.append(
            "That is more than there are fish: some is tracked twice, or is no fish, or their "
            "number in trial.toml is wrong."
        )
    elif share < _MUCH_IS_MISSING:
        parts.append(
            "What is missing is seldom missing by chance: trackers lose animals that touch, so "
            "that near distances may be too rare in all that follows."
        )
    return Statement(
        question="How well were the animals tracked?",
        answer=" ".join(parts),
        figure=(_percent(share), "of the fish's positions are known"),
        warns=share > _TOO_MANY,
    )


def known_of(view: TrialView) -> str:
    """Return the share of the positions of fish that is known, as text; empty without tracks."""
    seen, trial = view.seen, view.trial
    if seen is None or not seen.n_points or not trial.n_fish:
        return ""
    return _percent(_share(seen, FISH, trial.n_fish))


def _share(seen: Seen, kind: int, n_agents: int) -> float:
    """Return how many of the positions that there could be are known."""
    points = int(seen.visits[kind].zones.sum()) if kind in seen.visits else 0
    return points / (n_agents * (seen.last_k - seen.first_k + 1))


def _outside(seen: Seen) -> float:
    """Return the share of all points that is in no zone."""
    zones = np.sum([visits.zones for visits in seen.visits.values()], axis=0)
    return float(zones[0] / zones.sum())


def _percent(share: float) -> str:
    # What is not all is never printed as all.
    if share == 1:
        return "100 %"
    return f"{min(100 * share, 99.9) if share < 1 else 100 * share:.1f} %"

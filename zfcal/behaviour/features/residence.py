"""Residence: how long an animal stays in a zone before it is in another.

The paper names it as what similarity scores should take into account next
(Cazenille et al., discussion: "residence time in a zone").

A stay is a run of samples of one track id in one zone; it counts once, with the time from its
first sample to one step after its last. Three rules:

* Samples that are missing for up to a second do not end a stay, if the animal is in the same
  zone before and after. A longer loss does.
* Time is cut into windows of 120 s, from the first sample on. Tracks of any length, such as
  a model's long run, are so comparable with a window's; what remains after the last whole
  window is left out.
* A stay that is cut, by the end of a window or by a loss, counts with the time that was seen.
  To leave it out would drop the animals that never leave. As estimates of the time in a zone
  the longest stays are too short; as a comparison both sides are cut alike.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from zfcal.behaviour.features.statistic import Observed, Points, Statistic
from zfcal.units import WINDOW_S

_MAX_GAP_S = 1.0
"""Longer than this an animal must not be lost within a stay."""

_EDGES_S = (0.0, *(WINDOW_S / 2**halvings for halvings in range(8, -1, -1)))
"""Each bin is twice as long as the one before, and the last ends with the window."""


def observe(points: Points) -> Iterator[Observed]:
    """Yield each stay, at its first sample, in seconds."""
    located, order = points.located, np.argsort(points.located.agent[points.own], kind="stable")
    own = points.own[order]
    if not len(own):
        return
    agent, zone, k = located.agent[own], located.zone[own], located.k[own]
    window = np.floor((k - located.k[0]) * located.dt_s / WINDOW_S + 1e-9)
    n_whole = int((k.max() - located.k[0] + 1) * located.dt_s / WINDOW_S + 1e-9)
    most = int(_MAX_GAP_S / located.dt_s + 1e-9) + 1
    goes_on = (np.diff(k) <= most) & (agent[1:] == agent[:-1])
    goes_on &= (zone[1:] == zone[:-1]) & (window[1:] == window[:-1])
    first = np.flatnonzero(np.concatenate([[True], ~goes_on]))
    last = np.append(first[1:], len(own)) - 1
    # A time on an edge belongs to the bin above, whatever the step's rounding.
    kept = window[first] < max(n_whole, 1)
    first, last = first[kept], last[kept]
    yield Observed(at=own[first], value=np.round((k[last] - k[first] + 1) * located.dt_s, 9))


STATISTICS = (
    Statistic(
        name="residence",
        label="Residence times",
        phrase="the times of stay in a zone",
        observe=observe,
        edges=lambda _: np.array(_EDGES_S),
        # Time is cut into windows of that length.
        bounded=True,
        unit="s",
        title="Time of a stay",
        axis="time of a stay",
        source="Cazenille et al., discussion",
    ),
)

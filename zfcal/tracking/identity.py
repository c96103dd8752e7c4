"""Who is who where the number of animals is known: what was believed, after each crossing.

A track is followed from frame to frame; who it is is a belief. It is a matrix of chances,
track by identity, whose rows and columns each sum to one. A crossing mixes the rows of those
who may have changed places; what a track looks like, for as long as it is alone in its blob,
speaks for identities that look the same (identity mass flow: Shin, Guibas & Zhao 2003). So
ids are kept: a track that begins takes the identity of one that ended. It is causal: a change
of places that looks tell of later is mended from then on. When it should have been is told as
well, for those who have kept what was told before.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import final

import numpy as np
from scipy.optimize import linear_sum_assignment

from zfcal.arrays import Bools, Floats, Indices
from zfcal.tracking._beliefs import balance, learn, weigh
from zfcal.tracking.seen import Exchange
from zfcal.tracking.trail import Trail
from zfcal.tracking.usual import Body

_WITHIN = (0.06, 0.035)
"""Spread of one fish's log area and log darkness over time, at first; learnt with the film."""

_BETWEEN = (0.085, 0.055)
"""Spread from fish to fish of one age and tank, on the published film of eight zebrafish."""

_WIDE = (0.5, 0.5)
"""What is believed of one that was not seen yet: it may be a lure."""

_ALIKE_S = 0.4
"""For so long one look at an animal tells nothing new: it bends, it crosses a reflection."""

_FAITH = 200.0
"""Sightings that the spread at first is worth."""

_OUTLIER = 4.0
"""Log odds that one look tells at most: two fish in a blob taken for one are no large fish."""

_KNOWN = 15
"""Sightings from which a look is an animal's own."""

_MEMORY = 3000.0
"""Sightings that are remembered."""

_SURE = 0.85
"""Chance from which a sighting is learnt from."""

_MEND = 4.5
"""Log odds from which ids are exchanged."""

_LIKELY, _POSSIBLE = 0.3, 0.05
"""Chances from which two are taken to have changed places just then."""

_ITSELF = 0.999
"""Chance from which nobody has changed places in any encounter so far."""

_ENCOUNTER_S = 1.5
"""For so long two are near each other: the likely moment counts more than the last one."""

_TIE = 1e-6
"""Log odds that are none."""

_LEAST = 1e-6
_ROUNDS = 4

_REACH_PX_PER_S = 150.0
"""How soon a lost animal may be anywhere else, in the choice among several."""


@final
class Identities:
    """Names the tracks of one camera, as many as there are animals.

    Parameters
    ----------
    n_agents
        How many.
    """

    def __init__(self, n_agents: int) -> None:
        self._keys: list[int | None] = [None] * n_agents
        self._chance: Floats = np.eye(n_agents)
        self._name = np.arange(n_agents)
        self._every = np.arange(n_agents)
        self._last: list[tuple[tuple[float, float], float] | None] = [None] * n_agents
        self._n = np.zeros(n_agents)
        self._mean = np.zeros((n_agents, 2))
        self._length = np.zeros(n_agents)
        self._within = np.array(_WITHIN) ** 2 * _FAITH
        self._looks = _FAITH
        self._time_s = -math.inf
        self._crossed_s = {
            chance: np.full((n_agents, n_agents), -math.inf) for chance in (_LIKELY, _POSSIBLE)
        }
        self._exchanges: list[Exchange] = []

    def step(
        self, trails: Sequence[Trail], mixed: dict[tuple[int, int], float], time_s: float
    ) -> dict[int, int]:
        """Return the id of each track.

        Parameters
        ----------
        trails
            Those that are told, as many as there are animals at most.
        mixed
            For pairs of tracks, by their keys, the chance that they have just changed places.
        time_s
            Of the frame.
        """
        rows = self._rows(trails, time_s)
        for (one, other), chance in mixed.items():
            if one in rows and other in rows:
                self._mix(rows[one], rows[other], chance, time_s)
        self._settle()
        dt_s = min(max(time_s - self._time_s, 0.0), _ALIKE_S)
        self._time_s = time_s
        seen = [(rows[t.key], t) for t in trails if t.is_clear]
        if seen:
            self._look(np.array([row for row, _ in seen]), [t for _, t in seen], dt_s / _ALIKE_S)
        self._rename()
        return {trail.key: int(self._name[rows[trail.key]]) for trail in trails}

    def _rows(self, trails: Sequence[Trail], time_s: float) -> dict[int, int]:
        """Return the row of each track; new ones take those of tracks that are not told."""
        held = {key: row for row, key in enumerate(self._keys) if key is not None}
        rows = {trail.key: held[trail.key] for trail in trails if trail.key in held}
        new = [trail for trail in trails if trail.key not in held]
        free = [row for row in range(len(self._keys)) if row not in set(rows.values())]
        if new:
            cost = np.array([[self._far(row, trail, time_s) for row in free] for trail in new])
            for k, column in zip(*linear_sum_assignment(cost), strict=True):
                row = free[column]
                # Others might have been taken as well.
                for other, far in zip(free, cost[k], strict=True):
                    if other != row and self._last[row] and self._last[other]:
                        chance = 1 / (1 + math.exp(min(far - cost[k, column], 50.0)))
                        self._mix(row, other, chance, time_s)
                self._keys[row] = new[k].key
                rows[new[k].key] = row
        for trail in trails:
            self._last[rows[trail.key]] = (trail.xy, time_s)
        return rows

    def _far(self, row: int, trail: Trail, time_s: float) -> float:
        """Return how unlikely it is that a new track goes on a lost one, as minus log odds."""
        last = self._last[row]
        if last is None:
            return 20.0 + 1e-3 * row
        (x, y), at_s = last
        reach = 10.0 + _REACH_PX_PER_S * (time_s - at_s)
        return float(np.hypot(trail.xy[0] - x, trail.xy[1] - y)) / reach

    def _mix(self, one: int, other: int, chance: float, time_s: float) -> None:
        for least, crossed_s in self._crossed_s.items():
            if chance >= least:
                crossed_s[one, other] = crossed_s[other, one] = time_s
        a, b = self._chance[one].copy(), self._chance[other].copy()
        self._chance[one] = (1 - chance) * a + chance * b
        self._chance[other] = (1 - chance) * b + chance * a

    def _settle(self) -> None:
        """Take away doubts between those of whom nothing is known yet: their names are free.

        Two that share a blob from the first frame on would else never be sure enough to be learnt.
        """
        new = self._n < _KNOWN
        if np.count_nonzero(new) < 2:
            return
        for row in np.flatnonzero(new[self._name]):
            total = self._chance[row, new].sum()
            self._chance[row, new] = 0.0
            self._chance[row, self._name[row]] = total

    def _look(self, rows: Indices, trails: list[Trail], weight: float) -> None:
        """Let what tracks look like speak, and learn what they look like."""
        seen = np.log(np.array([(t.shape.area_px, t.blob.darkness) for t in trails]))
        # Nobody knows beforehand whether one is a lure.
        between = np.array(_BETWEEN if (self._n > 0).all() else _WIDE) ** 2
        within = self._within / self._looks
        weigh(self._chance, rows, seen, self._n, self._mean, within, between, weight, _OUTLIER)
        balance(self._chance, _LEAST, _ROUNDS)
        # Who is surely himself again has not changed places.
        itself = self._chance[self._every, self._name] > _ITSELF
        if itself.any():
            self._forget(itself)
        lengths = np.log(np.array([t.shape.length_px for t in trails]))
        some = self._n, self._mean, self._length, self._within
        self._looks = learn(
            self._chance, rows, seen, lengths, *some, self._looks, (_SURE, _FAITH, _MEMORY)
        )

    def look(self, agent: int) -> Body | None:
        """Return what an animal looks like; None where it was hardly seen alone."""
        if self._n[agent] < _KNOWN:
            return None
        area, darkness = np.exp(self._mean[agent])
        return Body(
            area_px=float(area),
            length_px=math.exp(self._length[agent]),
            darkness=float(darkness),
        )

    def _rename(self) -> None:
        """Exchange ids where others are clearly likelier."""
        likely = np.log(np.maximum(self._chance, _LEAST))
        now = likely[self._every, self._name]
        # Of two between whom nothing tells each stays himself, not what rounding says.
        likely[self._every, self._name] = now + _TIE
        names = linear_sum_assignment(-likely)[1]
        gain = likely[self._every, names].sum() - now.sum()
        if gain > _MEND:
            self._exchanges += self._exchanged(self._name, names)
            # Before now these rows had other names.
            self._forget(self._name != names)
            self._name = names

    def _forget(self, rows: Bools) -> None:
        """Let former encounters of some rows explain no exchange to come."""
        for crossed_s in self._crossed_s.values():
            crossed_s[rows] = -math.inf
            crossed_s[:, rows] = -math.inf

    def _exchanged(self, before: Indices, after: Indices) -> list[Exchange]:
        """Return which rows changed places when, the first one first; none where nobody knows."""
        likely_s, possible_s = self._crossed_s[_LIKELY], self._crossed_s[_POSSIBLE]
        since_s = np.where(likely_s > possible_s - _ENCOUNTER_S, likely_s, possible_s)
        now, found = after.copy(), []
        while (wrong := np.flatnonzero(now != before)).size:
            # Taken back from the last one on; each puts one row right at least.
            pairs = [
                (since_s[a, b], a, b)
                for a, b in itertools.combinations(wrong, 2)
                if now[a] == before[b] or now[b] == before[a]
            ]
            at_s, a, b = max(pairs)
            if math.isinf(at_s):
                return []
            found.append(Exchange(one=int(now[a]), other=int(now[b]), since_s=float(at_s)))
            now[a], now[b] = now[b], now[a]
        return found[::-1]

    def take_exchanges(self) -> list[Exchange]:
        """Return the exchanges of ids since this was last asked, and forget them.

        In this order they put right what was told before: each from its time to now.
        """
        found, self._exchanges = self._exchanges, []
        return found

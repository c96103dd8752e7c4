"""What went wrong while fish were tracked, counted as it happens: drops, crowds, changes of id."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

from zfcal.vision.seen import BadFrame, Seen

GUESS = 0.5
"""Confidence below which a position is a guess."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Quality:
    """Counts over some frames.

    Parameters
    ----------
    frames
        How many.
    rows
        Sightings of animals.
    drops
        Animals that were there and not seen, summed over frames; 0 where it is not known how
        many there are.
    exact
        Frames with exactly as many animals as there are.
    merged
        Sightings in a blob of several animals.
    guesses
        Sightings with a confidence below one half.
    swaps
        Suspected changes of identity: ids that began after the first frame with animals.
    bad
        Frames by what was wrong with them.
    """

    frames: int
    rows: int
    drops: int
    exact: int
    merged: int
    guesses: int
    swaps: int
    bad: dict[str, int]


class Tally:
    """Counts frame by frame.

    Parameters
    ----------
    n_agents
        Fish and robots in the tank; None where that is not known.
    """

    def __init__(self, n_agents: int | None) -> None:
        self._n = n_agents
        self._count: Counter[str] = Counter()
        self._bad: Counter[str] = Counter()
        self._last_id: int | None = None

    def add(self, seen: list[Seen], bad: Iterable[BadFrame] = ()) -> None:
        """Count a frame and what was wrong with it."""
        self._count["frames"] += 1
        self._count["rows"] += len(seen)
        self._count["merged"] += sum(each.shared > 1 for each in seen)
        self._count["guesses"] += sum(each.confidence < GUESS for each in seen)
        if self._n is not None:
            self._count["drops"] += max(self._n - len(seen), 0)
            self._count["exact"] += len(seen) == self._n
        self._bad.update(each.reason for each in bad)
        if seen:
            newest = max(each.agent for each in seen)
            if self._last_id is not None:
                # Ids are given in turn, each once.
                self._count["swaps"] += sum(each.agent > self._last_id for each in seen)
            self._last_id = newest if self._last_id is None else max(newest, self._last_id)

    def result(self) -> Quality:
        """Return the counts so far."""
        names = ("frames", "rows", "drops", "exact", "merged", "guesses", "swaps")
        return Quality(**{name: self._count[name] for name in names}, bad=dict(self._bad))

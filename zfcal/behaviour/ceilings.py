"""What a perfect match would score: from comparisons of like with like.

Those that the data alone give are made here; those that need simulations of a
model are made in ``calibrate``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from zfcal.arena import Arena
from zfcal.arrays import Indices, Ints
from zfcal.behaviour.located import Located, SamplesOrLocated, locate
from zfcal.behaviour.scores import NAN, Scores, compare, score_keys
from zfcal.behaviour.statistics import check_zones, measure, measure_role
from zfcal.errors import InputError
from zfcal.tracks import FISH
from zfcal.units import SEGMENT_S

_MIN_SHARE = 0.5
"""A place seen for less than this share of the longest one is no fish's."""

_MIN_FISH = 3
"""With two fish, the one that is left has no pair to compare with."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Ceiling:
    """What a perfect match would score, from many comparisons of like with like.

    Parameters
    ----------
    zone_names
        The arena's zones, in its order.
    mean, low, high
        Mean and 2.5 and 97.5 % quantiles of each score, in the order of
        `score_keys`; NaN where no comparison has that score.
    n_windows
        How many comparisons.
    named
        Mean, low and high of the score of statistics that were named; None where S counts.
    """

    zone_names: tuple[str, ...]
    mean: tuple[float, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]
    n_windows: int
    named: tuple[float, float, float] | None = None

    @property
    def overall(self) -> tuple[float, float, float]:
        """Mean, low and high of what decides: S, or the score of what was named."""
        return self.of("S") if self.named is None else self.named

    def of(self, feature: str, zone: str | None = None) -> tuple[float, float, float]:
        """Return mean, low and high of one score.

        Parameters
        ----------
        feature
            ``D``, ``W``, ``O``, ``T`` or ``S``.
        zone
            A zone's name; None for the mean over zones.

        Raises
        ------
        InputError
            There is no such score.
        """
        keys = score_keys(self.zone_names)
        if (feature, zone) not in keys:
            raise InputError(f"There is no score {feature!r} of zone {zone!r}, only {keys}.")
        at = keys.index((feature, zone))
        return self.mean[at], self.low[at], self.high[at]


def summarise(scores: list[Scores]) -> Ceiling:
    """Return mean and interval of many comparisons of like with like.

    Parameters
    ----------
    scores
        At least one, all in one arena. NaN is left out, score by score.

    Returns
    -------
    Ceiling

    Raises
    ------
    InputError
        There is none, or their zones differ.
    """
    if not scores:
        raise InputError("A ceiling needs at least one comparison, got none.")
    for other in scores[1:]:
        check_zones(scores[0].zone_names, other.zone_names)
    columns = [
        [value for value in column if value == value]  # noqa: PLR0124 - NaN is not itself
        for column in zip(*(one.values for one in scores), strict=True)
    ]
    low, high = (
        tuple(float(np.quantile(column, q)) if column else NAN for column in columns)
        for q in (0.025, 0.975)
    )
    named = [s.named.value for s in scores if s.named and s.named.value == s.named.value]
    return Ceiling(
        zone_names=scores[0].zone_names,
        mean=tuple(float(np.mean(column)) if column else NAN for column in columns),
        low=low,
        high=high,
        n_windows=len(scores),
        named=_interval(named) if scores[0].named else None,
    )


def _interval(values: list[float]) -> tuple[float, float, float]:
    """Return mean and 2.5 and 97.5 % quantiles; NaN of nothing."""
    if not values:
        return NAN, NAN, NAN
    low, high = np.quantile(values, [0.025, 0.975])
    return float(np.mean(values)), float(low), float(high)


def robot_ceiling(samples: SamplesOrLocated, arena: Arena) -> list[Scores]:
    """Put each fish in the robot's place: what a robot that is a fish would score.

    Fish f's own W, O and T and its distances to the others stand against those
    of the other fish among themselves. Robots are left out.

    Parameters
    ----------
    samples
        A window, best pooled over the whole trial.
    arena
        Gives zones, walls and the ranges of the bins.

    Returns
    -------
    list of Scores
        One per fish; empty with fewer than three. A fish that the tracker lost
        and found again under new ids is pieced together from ids that do not
        overlap, and one seen less than half as long as the longest is left out.
    """
    fish = locate(samples, arena).of_kind(FISH)
    place = fish_places(fish)
    group = measure(fish, arena)
    scores = []
    for f in places_of_fish(np.bincount(place, minlength=1)):
        alone = measure_role(fish, place == f)
        scores.append(compare(alone, group - alone))
    return scores


def places_of_fish(seen: Ints | Indices) -> Indices:
    """Return the places that were taken long enough to be a fish's; none if fewer than three.

    Parameters
    ----------
    seen : ndarray of int, shape (place,)
        Points of each place, at least one place.
    """
    places = np.flatnonzero(seen >= _MIN_SHARE * seen.max())
    return places if len(places) >= _MIN_FISH else places[:0]


def fish_places(located: Located) -> Indices:
    """Piece track ids together into as few fish as there must have been.

    Parameters
    ----------
    located
        The fish of a window.

    Returns
    -------
    ndarray of int, shape (point,)
        A number per fish, from 0; see `piece_together`.
    """
    agents, first, column = np.unique(located.agent, return_index=True, return_inverse=True)
    last = np.zeros(len(agents), dtype=np.int64)
    last[column] = located.k  # ascending: the last one stays
    return piece_together(located.k[first], last)[column]


def piece_together(first: Ints, last: Ints) -> Indices:
    """Piece track ids together into as few fish as there must have been.

    Parameters
    ----------
    first, last : ndarray of int64, shape (id,)
        First and last sample of each id, in ascending order of the ids.

    Returns
    -------
    ndarray of int, shape (id,)
        A number per fish, from 0. An id goes, in order of its first sample, to
        the fish that was lost last before it; so no fish has two ids at once.
        Which of several lost fish came back nobody knows: pieces can be mixed
        up, which draws the fish together a little.
    """
    place = np.zeros(len(first), dtype=np.intp)
    free_after: list[int] = []
    for a in np.argsort(first, kind="stable"):
        free = [(end, p) for p, end in enumerate(free_after) if end < first[a]]
        if free:
            place[a] = max(free)[1]
            free_after[place[a]] = int(last[a])
        else:
            place[a] = len(free_after)
            free_after.append(int(last[a]))
    return place


def halves_ceiling(
    samples: SamplesOrLocated, arena: Arena, *, block_s: float = SEGMENT_S
) -> Scores | None:
    """Score one half of a recording against the other: a ceiling without a model.

    Parameters
    ----------
    samples
        The agents to measure, such as the fish of a whole trial.
    arena
        Gives zones, walls and the ranges of the bins.
    block_s
        The halves are alternate blocks of this length, counted from the first
        sample, so that both see the same slow change of behaviour.

    Returns
    -------
    Scores or None
        None where one of the halves is empty. No step across a cut counts.
    """
    if not block_s > 0:
        raise InputError(f"block_s must be a positive time in seconds, got {block_s!r}.")
    located = locate(samples, arena)
    if not len(located):
        return None
    odd = block_numbers(located, int(located.k[0]), block_s) % 2 == 1
    if not odd.any():
        return None
    return compare(measure(located.take(~odd), arena), measure(located.take(odd), arena))


def block_numbers(located: Located, start_k: int, block_s: float) -> Ints:
    """Return in which block of time each point lies, counted from a sample, shape (point,)."""
    since_s = (located.k - start_k) * located.dt_s
    return np.floor(since_s / block_s + 1e-9).astype(np.int64)

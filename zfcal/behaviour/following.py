r"""Whether fish follow one of the tank: who turns first, and who later.

The directions of two agents are compared at a lag, as Nagy et al. 2010 (Nature 464:890) do for
pigeons. What is measured of a robot is measured of each fish in its place as well, and of the
robot's track set against another time of the fish, which is what chance gives.

Arrays alone: from the points of a window to rows of its table is in `influence`, who leaves a
room first in `departures`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from zfcal.arrays import Bools, Floats, Indices, Ints
from zfcal.behaviour.measured import Measured, floor_of, measured
from zfcal.errors import InputError

RANGE_M = 0.15
"""Within it two agents are of one group: five bodies of 3 cm."""

LAG_MAX_S = 2.0
"""The longest lag at which directions are compared."""

MIN_STEP_M = 0.002
"""A shorter step has no direction beyond the noise of tracking."""

N_SHIFTS = 19
"""Tracks set against another time. Of 20 values alike the first is the highest in 5 % of cases."""

SHIFT_MIN_S = 10.0
"""Behaviour so long ago does not bear on what a fish does now."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Correlations:
    """How alike the directions of leaders and of those around them are, lag by lag.

    Parameters
    ----------
    lag_s : ndarray, shape (lag,)
        Ascending, from minus to plus the longest lag. At a positive one the leader comes first.
    value : ndarray, shape (leader, lag)
        Mean cosine of the angle between the directions; NaN where there is no pair.
    n : ndarray of int64, shape (leader, lag)
        Pairs of directions.
    """

    lag_s: Floats
    value: Floats
    n: Ints

    def of_leaders(self, chosen: Indices | slice) -> Correlations:
        """Return the chosen leaders."""
        return Correlations(lag_s=self.lag_s, value=self.value[chosen], n=self.n[chosen])

    @property
    def following(self) -> Floats:
        """Mean over the positive lags: how far the others repeat what a leader did, (leader,)."""
        return _mean(self.value[:, self.lag_s > 0])

    @property
    def lead(self) -> Floats:
        """`following` less the same at the negative lags, (leader,): above 0 the leader leads."""
        return self.following - _mean(self.value[:, self.lag_s < 0])

    @property
    def peak(self) -> Floats:
        """The highest value of any lag, (leader,)."""
        return _highest(self.value)

    @property
    def delay_s(self) -> Floats:
        """The lag of the highest value, (leader,): Nagy's directional correlation delay."""
        at = np.where(np.isnan(self.value), -np.inf, self.value).argmax(axis=1)
        return np.where(np.isnan(self.peak), np.nan, self.lag_s[at])


def directions(xy_m: Floats, unbroken: Bools | None = None) -> Floats:
    """Return the direction of the step that starts at each frame.

    Parameters
    ----------
    xy_m : ndarray, shape (frame, agent, 2)
        Positions in metres; NaN is lost.
    unbroken : ndarray of bool, shape (frame, agent)
        Whether an agent is under one id at a frame and the next; None for everywhere.

    Returns
    -------
    ndarray, shape (frame, agent, 2)
        Vectors of length one. NaN at the last frame, where either end is lost, and where the
        step is shorter than 2 mm.
    """
    step_m = np.full_like(xy_m, np.nan)
    step_m[:-1] = np.diff(xy_m, axis=0)
    length_m = np.hypot(step_m[..., 0], step_m[..., 1])
    known = length_m >= MIN_STEP_M
    if unbroken is not None:
        known &= unbroken
    return np.where(known[..., None], step_m / np.where(known, length_m, 1.0)[..., None], np.nan)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Paths:
    """Where some agents were, and which way they went.

    Parameters
    ----------
    xy_m : ndarray, shape (frame, agent, 2)
        Positions in metres; NaN is lost.
    direction : ndarray, shape (frame, agent, 2)
        As `directions` returns them.
    """

    xy_m: Floats
    direction: Floats

    @classmethod
    def of(cls, xy_m: Floats, unbroken: Bools | None = None) -> Paths:
        """Return the paths of positions; parameters as of `directions`.

        Raises
        ------
        InputError
            The array has another shape.
        """
        if xy_m.ndim != 3 or xy_m.shape[2] != 2:
            raise InputError(f"Positions have the shape (frame, agent, xy), got {xy_m.shape}.")
        return cls(xy_m=xy_m, direction=directions(xy_m, unbroken))

    def at_other_times(self, shifts: Ints) -> Paths:
        """Return them later by some numbers of frames.

        What leaves at the end comes in at the start. The agents of the first shift come first.
        """
        n_frames = len(self)
        n_moved = len(shifts) * self.xy_m.shape[1]
        frame = (np.arange(n_frames)[:, None] - shifts) % max(n_frames, 1)
        parts = (part[frame] for part in (self.xy_m, self.direction))
        xy_m, direction = (part.reshape(n_frames, n_moved, 2) for part in parts)
        return Paths(xy_m=xy_m, direction=direction)

    def and_also(self, others: Paths) -> Paths:
        """Return them with others behind them.

        Raises
        ------
        InputError
            The numbers of frames differ.
        """
        _check_frames(self, others)
        return Paths(
            xy_m=np.concatenate([self.xy_m, others.xy_m], axis=1),
            direction=np.concatenate([self.direction, others.direction], axis=1),
        )

    def __len__(self) -> int:
        """Return how many frames there are."""
        return len(self.xy_m)


def lags_of(dt_s: float) -> Ints:
    """Return the lags that are compared, in frames: from minus to plus two seconds.

    Raises
    ------
    InputError
        The step is no positive time.
    """
    most = int(LAG_MAX_S / _checked(dt_s) + 1e-6)
    return np.arange(-most, most + 1, dtype=np.int64)


def shifts_of(n_frames: int, dt_s: float) -> Ints:
    """Return by how many frames a track is shifted to see what chance gives.

    Returns
    -------
    ndarray of int64, shape (shift,)
        Evenly spaced, each at least 10 s from no shift either way; fewer where there are not so
        many, none in a window that is too short.

    Raises
    ------
    InputError
        The step is no positive time.
    """
    least = int(np.ceil(SHIFT_MIN_S / _checked(dt_s) - 1e-6))
    if n_frames <= 2 * least:
        return np.zeros(0, dtype=np.int64)
    return np.unique(np.linspace(least, n_frames - least, N_SHIFTS).round().astype(np.int64))


def _checked(dt_s: float) -> float:
    if not 0 < dt_s < np.inf:
        raise InputError(f"The step dt_s must be a positive time in seconds, got {dt_s!r}.")
    return dt_s


def correlate(
    leaders: Paths, others: Paths, *, dt_s: float, same: Indices | None = None
) -> Correlations:
    r"""Compare the directions of leaders with those of others around them, at each lag.

    Parameters
    ----------
    leaders
        Each by itself.
    others
        Those who may follow, over the same frames. All are pooled.
    dt_s
        Time between two frames.
    same : ndarray of int, shape (other,)
        The number of the leader that is the same animal as an other, who does not follow itself;
        None where none is.

    Returns
    -------
    Correlations

    Notes
    -----
    :math:`C(\tau) = \langle u_i(t) \cdot u_j(t + \tau) \rangle` over all others j and all times
    t at which both directions are known and the two are within `RANGE_M` of each other at the
    earlier one of t and t + tau, when the first of them moved. So
    :math:`C_{ij}(\tau) = C_{ji}(-\tau)`.

    Nagy, Akos, Biro, Vicsek 2010, Nature 464:890.
    """
    lags = lags_of(dt_s)
    _check_frames(leaders, others)
    total, n = _sums(leaders, others, most=len(lags) // 2, same=same)
    value = np.where(n > 0, total / np.where(n > 0, n, 1.0), np.nan)
    return Correlations(
        lag_s=np.asarray(lags * dt_s, dtype=np.float64), value=value, n=n.round().astype(np.int64)
    )


def together(found: Correlations, group: Indices, n_groups: int) -> Correlations:
    """Return some leaders as one, weighted by their pairs.

    Parameters
    ----------
    found
        Of each leader.
    group : ndarray of int, shape (leader,)
        The number of each leader's group, from 0.
    n_groups
        How many groups; one without a leader has no pairs.
    """
    total = np.zeros((n_groups, len(found.lag_s)))
    n = np.zeros(total.shape, dtype=np.int64)
    np.add.at(total, group, np.where(found.n > 0, found.value * found.n, 0.0))
    np.add.at(n, group, found.n)
    value = np.where(n > 0, total / np.where(n > 0, n, 1), np.nan)
    return Correlations(lag_s=found.lag_s, value=value, n=n)


def measure_following(
    robots: Paths, fish: Paths, *, dt_s: float, places: Indices | None = None
) -> list[Measured]:
    """Measure how far fish follow the robots, with ceiling and floor.

    Parameters
    ----------
    robots, fish
        Over the same frames. Several robots count as one.
    dt_s
        Time between two frames.
    places
        The fish that are put in the robot's place, each against the other fish; None for all.

    Returns
    -------
    list of Measured
        ``direction``, a row per lag; then ``following``, ``lead`` and ``delay``. The values are
        NaN where no robot was seen near a fish. ``delay`` is NaN as well where the highest
        correlation is not above chance: the highest of noise lies anywhere.

    Raises
    ------
    InputError
        The step is no positive time, or the frames differ in number.
    """
    shifts = np.concatenate([[0], shifts_of(len(fish), dt_s)])
    n_robots, n_fish = robots.xy_m.shape[1], fish.xy_m.shape[1]
    n_moved = len(shifts) * n_robots
    # All at once: the robot as it was, at other times, and the fish in its place.
    found = correlate(
        robots.at_other_times(shifts).and_also(fish),
        fish,
        dt_s=dt_s,
        same=n_moved + np.arange(n_fish),
    )
    group = np.repeat(np.arange(len(shifts)), n_robots)
    moved = together(found.of_leaders(slice(n_moved)), group, len(shifts))
    own, chance = moved.of_leaders(slice(1)), moved.of_leaders(slice(1, None))
    places = np.arange(n_fish) if places is None else places
    alike = found.of_leaders(n_moved + places)
    names = [("direction", float(lag), int(n)) for lag, n in zip(own.lag_s, own.n[0], strict=True)]
    names += [(name, np.nan, int(own.n.sum())) for name in ("following", "lead", "delay")]
    value = _row_of(own)[0]
    floor = floor_of(
        np.column_stack([chance.value, chance.following, np.abs(chance.lead), chance.peak])
    )
    if not own.peak[0] > floor[-1]:
        value[-1] = np.nan
    # Of a delay there is none: what stands there has decided whether there is a delay.
    floor[-1] = np.nan
    return measured(names, value, in_place=_row_of(alike), floor=floor)


def _check_frames(leaders: Paths, others: Paths) -> None:
    if len(leaders) != len(others):
        raise InputError(
            f"Leaders have {len(leaders)} frames and the others {len(others)}, expected the same."
        )


def _row_of(found: Correlations) -> Floats:
    """Return all measures of leaders, shape (leader, measure)."""
    return np.column_stack([found.value, found.following, found.lead, found.delay_s])


def _sums(
    leaders: Paths, others: Paths, *, most: int, same: Indices | None
) -> tuple[Floats, Floats]:
    """Return sums of cosines, and their number, over all others, shape (leader, lag).

    One other after the other: what is multiplied stays in the processor's cache.
    """
    n_frames = len(leaders)
    (u, has_u), (v, has_v) = _filled(leaders.direction), _filled(others.direction)
    lead_m, other_m = _by_agent(leaders.xy_m), _by_agent(others.xy_m)
    later, has_later = _later(v, most), _later(has_v[:, None], most)
    total, n = np.zeros((len(u), 2 * most + 1)), np.zeros((len(u), 2 * most + 1))
    v_ahead, n_ahead = np.zeros_like(u), np.zeros_like(has_u)
    for other, place_m in enumerate(other_m):
        # A pair counts while it is near at the earlier moment, when the one who is ahead moves.
        near = _within(lead_m, place_m)
        if same is not None:
            near[same[other]] = 0.0
        ahead = near * has_u
        total[:, most:] += (ahead[:, None] * u).reshape(len(u), 2 * n_frames) @ later[other].T
        n[:, most:] += ahead @ has_later[other].T
        # Where others are ahead they can be added up before they are set against a leader.
        v_ahead += near[:, None] * v[other]
        n_ahead += near * has_v[other]
    for lag in range(1, min(most + 1, n_frames)):
        total[:, most - lag] = np.einsum("ixt,ixt->i", v_ahead[..., :-lag], u[..., lag:])
        n[:, most - lag] = np.einsum("it,it->i", n_ahead[..., :-lag], has_u[..., lag:])
    return total, n


def _within(leaders_m: Floats, place_m: Floats) -> Floats:
    """Return 1 where leaders are within range of an other, (leader, frame); 0 where one is lost."""
    away_m = leaders_m - place_m
    away_m *= away_m
    return (away_m[:, 0] + away_m[:, 1] <= RANGE_M * RANGE_M).astype(np.float64)


def _later(values: Floats, most: int) -> Floats:
    """Return (agent, component, frame) at each lag from 0 on, 0 after the end.

    The shape is (agent, lag, component times frame).
    """
    n_agents, n_components, n_frames = values.shape
    made = np.zeros((n_agents, most + 1, n_components, n_frames))
    for lag in range(min(most + 1, n_frames)):
        made[:, lag, :, : n_frames - lag] = values[:, :, lag:]
    return made.reshape(n_agents, most + 1, n_components * n_frames)


def _by_agent(values: Floats) -> Floats:
    """Return (frame, agent, xy) as (agent, xy, frame): what is added up lies side by side."""
    return np.ascontiguousarray(np.moveaxis(values, 0, -1))


def _filled(direction: Floats) -> tuple[Floats, Floats]:
    """Return directions with 0 for an unknown one, (agent, xy, frame), and 1 where it is known."""
    turned = _by_agent(direction)
    known = turned[:, 0] == turned[:, 0]
    return np.where(known[:, None], turned, 0.0), known.astype(np.float64)


def _mean(values: Floats) -> Floats:
    """Return the mean over lags, (leader,); NaN where one is not known."""
    return values.mean(axis=1)


def _highest(values: Floats) -> Floats:
    known = ~np.isnan(values)
    return np.where(known.any(axis=1), np.where(known, values, -np.inf).max(axis=1), np.nan)

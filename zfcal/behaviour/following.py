r"""Whether fish follow one of the tank: who turns first, and who later.

The directions of two agents are compared at a lag, as Nagy et al. 2010 (Nature 464:890) do for
pigeons. What is measured of a robot is measured of each fish in its place as well, and of the
robot's track set against another time of the fish, which is what chance gives.

Arrays alone: from the points of a window to rows of its table is in `influence`, who leaves a
room first in `departures`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from zfcal.arrays import Bools, Floats, Indices, Ints
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

CHANCE = 0.95
"""Quantile of the shifted tracks that is the floor."""


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

    def of_leaders(self, chosen: Indices | None) -> Correlations:
        """Return the chosen leaders; all for None."""
        if chosen is None:
            return self
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Measured:
    """A measure of the robot, with its ceiling and its floor; NaN where one is not defined.

    Parameters
    ----------
    measure
        Its name.
    lag_s
        The lag that it is of; NaN for none.
    value
        Of the robot.
    low, high
        2.5 and 97.5 % quantiles over the fish, each in the robot's place.
    ceiling
        Their mean.
    floor
        95 % quantile of what the robot's track gives against another time of the fish.
    n
        On how many observations the value stands; None where it is not defined.
    """

    measure: str
    value: float
    lag_s: float = float("nan")
    low: float = float("nan")
    high: float = float("nan")
    ceiling: float = float("nan")
    floor: float = float("nan")
    n: int | None = 0


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

    def in_single(self) -> Paths:
        """Return them in single precision."""
        return Paths(xy_m=_single(self.xy_m), direction=_single(self.direction))

    def at_other_times(self, shifts: Ints) -> Paths:
        """Return them later by some numbers of frames, in single precision.

        What leaves at the end comes in at the start. The agents of the first shift come first.
        """
        n_frames = len(self)
        frame = (np.arange(n_frames)[:, None] - shifts) % max(n_frames, 1)
        parts = (_single(part)[frame] for part in (self.xy_m, self.direction))
        xy_m, direction = (part.reshape(n_frames, -1, 2) for part in parts)
        return Paths(xy_m=xy_m, direction=direction)

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
    if not 0 < dt_s < np.inf:
        raise InputError(f"The step dt_s must be a positive time in seconds, got {dt_s!r}.")
    most = int(LAG_MAX_S / dt_s + 1e-6)
    return np.arange(-most, most + 1, dtype=np.int64)


def shifts_of(n_frames: int, dt_s: float) -> Ints:
    """Return by how many frames a track is shifted to see what chance gives.

    Returns
    -------
    ndarray of int64, shape (shift,)
        Evenly spaced, each at least 10 s from no shift either way; fewer where there are not so
        many, none in a window that is too short.
    """
    least = int(np.ceil(SHIFT_MIN_S / dt_s - 1e-6))
    if n_frames <= 2 * least:
        return np.zeros(0, dtype=np.int64)
    return np.unique(np.linspace(least, n_frames - least, N_SHIFTS).round().astype(np.int64))


def correlate(leaders: Paths, others: Paths, *, dt_s: float, apart: bool = False) -> Correlations:
    r"""Compare the directions of leaders with those of others around them, at each lag.

    Parameters
    ----------
    leaders
        Each by itself.
    others
        Those who may follow, over the same frames. All are pooled.
    dt_s
        Time between two frames.
    apart
        Whether leader i is the same animal as other i, who does not follow himself.

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
    if len(leaders) != len(others):
        raise InputError(
            f"Leaders have {len(leaders)} frames and the others {len(others)}, expected the same."
        )
    near = _near(leaders.xy_m, others.xy_m)
    if apart:
        both = np.arange(near.shape[0])
        near[both, both] = False
    total, n = _sums(leaders.direction, others.direction, near, lags)
    value = np.where(n > 0, total / np.where(n > 0, n, 1.0), np.nan)
    return Correlations(
        lag_s=np.asarray(lags * dt_s, dtype=np.float64), value=value, n=n.round().astype(np.int64)
    )


def by_chance(robots: Paths, fish: Paths, *, dt_s: float) -> Correlations:
    """Return what `correlate` finds for robots at another time of the fish, a row per shift.

    All robots count as one leader, as in `together`.
    """
    shifts = shifts_of(len(fish), dt_s)
    found = correlate(robots.at_other_times(shifts), fish, dt_s=dt_s)
    n_robots = robots.xy_m.shape[1]
    return together(found, np.repeat(np.arange(len(shifts)), n_robots), len(shifts))


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
    n_robots = robots.xy_m.shape[1]
    each = correlate(robots, fish, dt_s=dt_s)
    own = together(each, np.zeros(n_robots, dtype=np.intp), 1)
    # Single precision: of ceiling and floor nobody reads the sixth digit.
    single = fish.in_single()
    alike = correlate(single, single, dt_s=dt_s, apart=True).of_leaders(places)
    chance = by_chance(robots, single, dt_s=dt_s)
    names = [("direction", float(lag), int(n)) for lag, n in zip(own.lag_s, own.n[0], strict=True)]
    names += [(name, np.nan, int(own.n.sum())) for name in ("following", "lead", "delay")]
    value = _row_of(own)[0]
    if not own.peak[0] > floor_of(chance.peak[:, None])[0]:
        value[-1] = np.nan
    floor = floor_of(_row_of(chance))
    floor[-2:] = floor_of(np.abs(chance.lead)[:, None])[0], np.nan
    return measured(names, value, in_place=_row_of(alike), floor=floor)


def measured(
    names: Sequence[tuple[str, float, int]], value: Floats, *, in_place: Floats, floor: Floats
) -> list[Measured]:
    """Return measures with what the fish in the robot's place give.

    Parameters
    ----------
    names
        For each measure its name, its lag and its number of observations.
    value, floor : ndarray, shape (measure,)
        Of the robot, and of chance.
    in_place : ndarray, shape (fish, measure)
        Of each fish in the robot's place.
    """
    low, high = (quantile_of(in_place, q) for q in (0.025, 0.975))
    known = ~np.isnan(in_place)
    n_known = known.sum(axis=0)
    ceiling = np.where(known, in_place, 0.0).sum(axis=0) / np.where(n_known > 0, n_known, np.nan)
    return [
        Measured(
            measure=measure,
            value=float(value[i]),
            lag_s=lag_s,
            low=float(low[i]),
            high=float(high[i]),
            ceiling=float(ceiling[i]),
            floor=float(floor[i]),
            n=n,
        )
        for i, (measure, lag_s, n) in enumerate(names)
    ]


def floor_of(values: Floats) -> Floats:
    """Return what chance gives of measures: the 95 % quantile over the shifts.

    Parameters
    ----------
    values : ndarray, shape (shift, measure)

    Returns
    -------
    ndarray, shape (measure,)
        One of the values, not one between two of them; NaN where no shift has any.
    """
    return quantile_of(values, CHANCE, between=False)


def quantile_of(values: Floats, share: float, *, between: bool = True) -> Floats:
    """Return a quantile of each column, NaN left out; NaN of a column without a value.

    Parameters
    ----------
    values : ndarray, shape (row, column)
    share
        In [0, 1].
    between
        Whether it may lie between two values, rather than on the higher one of them.
    """
    if not len(values):
        return np.full(values.shape[1], np.nan)
    # NaN is sorted to the end.
    ordered = np.sort(values, axis=0)
    place = (np.count_nonzero(~np.isnan(values), axis=0) - 1) * share
    low, high = (np.maximum(f(place), 0).astype(np.intp) for f in (np.floor, np.ceil))
    columns = np.arange(values.shape[1])
    if not between:
        return np.asarray(ordered[high, columns], dtype=np.float64)
    part = place - low
    found: Floats = (1 - part) * ordered[low, columns] + part * ordered[high, columns]
    return found


def _single(values: Floats) -> Floats:
    narrow: Floats = values.astype(np.float32)
    return narrow


def _row_of(found: Correlations) -> Floats:
    """Return all measures of leaders, shape (leader, measure)."""
    return np.column_stack([found.value, found.following, found.lead, found.delay_s])


def _near(leaders_m: Floats, others_m: Floats) -> Bools:
    """Return who is within range of whom, shape (leader, other, frame); False where one is lost."""
    first, second = _by_agent(leaders_m), _by_agent(others_m)
    x, y = (first[:, None, i] - second[:, i] for i in (0, 1))
    return np.asarray(x * x + y * y <= RANGE_M * RANGE_M)


def _sums(leaders: Floats, others: Floats, near: Bools, lags: Ints) -> tuple[Floats, Floats]:
    """Return sums of cosines, and their number, shape (leader, lag), over all others.

    Directions have the shape (frame, agent, 2).
    """
    n_frames, most = len(leaders), len(lags) // 2
    (u, has_u), (v, has_v) = _filled(leaders), _filled(others)
    # A pair counts while it was near at the earlier moment, when the one who is ahead moved.
    ahead = near * has_u[:, None]
    u_ahead = ahead[:, :, None] * u[:, None]
    # Where others are ahead they can be added up before they are set against a leader.
    v_ahead = np.einsum("ijt,jxt->ixt", near.astype(v.dtype), v)
    n_ahead = np.einsum("ijt,jt->it", near.astype(v.dtype), has_v)
    total, n = np.zeros((len(u), len(lags))), np.zeros((len(u), len(lags)))
    for lag in range(min(most + 1, n_frames)):
        then, later = slice(n_frames - lag), slice(lag, None)
        plus, minus = most + lag, most - lag
        total[:, plus] = np.einsum("ijxt,jxt->i", u_ahead[..., then], v[..., later])
        n[:, plus] = np.einsum("ijt,jt->i", ahead[..., then], has_v[..., later])
        if lag:
            total[:, minus] = np.einsum("ixt,ixt->i", v_ahead[..., then], u[..., later])
            n[:, minus] = np.einsum("it,it->i", n_ahead[..., then], has_u[..., later])
    return total, n


def _by_agent(values: Floats) -> Floats:
    """Return (frame, agent, xy) as (agent, xy, frame): what is added up lies side by side."""
    return np.ascontiguousarray(np.moveaxis(values, 0, -1))


def _filled(direction: Floats) -> tuple[Floats, Floats]:
    """Return directions with 0 for an unknown one, (agent, xy, frame), and 1 where it is known."""
    turned = _by_agent(direction)
    known = turned[:, 0] == turned[:, 0]
    return np.where(known[:, None], turned, turned.dtype.type(0)), known.astype(turned.dtype)


def _mean(values: Floats) -> Floats:
    """Return the mean over lags, (leader,); NaN where one is not known."""
    return values.mean(axis=1)


def _highest(values: Floats) -> Floats:
    known = ~np.isnan(values)
    return np.where(known.any(axis=1), np.where(known, values, -np.inf).max(axis=1), np.nan)

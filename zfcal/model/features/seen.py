"""What fish have about them when they take a step."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Floats

AWAY_M = 9.0
"""In place of the distance to one who is not there."""

SOON = 0.1
"""Share of a step of a response that is a little late."""

LAGS = (1, 2, 3, 4, 5, 8)
"""Steps by which a response may be late."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Seen:
    """What the fish of some steps have about them; directions are unit vectors.

    Parameters
    ----------
    attention : ndarray, shape (step, other)
        alpha times the solid angle at which each other agent is seen; 0 for who is not seen.
    toward : ndarray, shape (step, other, 2)
        Where the base law draws to, away from who is too near. Zeros for who is not there.
    shortly_ago_toward
        Of a number of steps, or a share of one: where the base law draws to, away from who is too
        near, by where the others were so much before, shape (step, other, 2).
    sight_ago, attention_ago
        Of a number of steps: ``toward`` and ``attention`` of whom the fish would have seen, had all
        others been where they were so many steps before, shape (step, other, 2) and (step, other).
    ago_toward, then_toward
        Of a number of steps: where the others were so many steps before, seen or not, shape
        (step, other, 2). From where the fish is, and away from there for who is too near now; and
        from where it was itself, near ones as they are now. These are worked out whenever they
        are asked for, and so are directions above where positions err: kept they would be half of
        all.
        What all five return is not to be written to.
    bearing : ndarray, shape (step, other, 2)
        To the other.
    distance_m, off_axis_rad, speed_m_s, lately_m_s : ndarray, shape (step, other)
        Of the other: `AWAY_M` where it is not there; how far aside of the own heading; its last
        speed, and the mean over two seconds.
    mean_speeds_m_s
        Of a number of seconds: the mean speeds over so long of each other one, shape (step, other),
        and of the fish itself, shape (step,). Not to be written to.
    heading, course : ndarray, shape (step, other, 2)
        Of the other: the direction of its last step, and its mean velocity over two seconds in m/s;
        zeros where that is not known.
    here, too_near, in_sight, is_robot : ndarray of bool, shape (step, other)
        ``too_near``: the base law draws away from it.
    other : ndarray of int, shape (step, other)
        Track of the other; -1 for who is not there.
    own_heading, along_wall, way_out, xy_m : ndarray, shape (step, 2)
        ``way_out``: to the nearest way out of a room; zeros elsewhere.
    x_axis : ndarray, shape (step, 2)
        That of the tank. Where positions are drawn anew all directions are turned, so that the
        heading taken stays the measured one.
    follows_walls : ndarray of bool, shape (step,)
        Whether the zone does.
    zone, track : ndarray of int, shape (step,)
    own_speed_m_s : ndarray, shape (step,)
        Of the step itself, which is given.
    last_speed_m_s : ndarray, shape (step,)
        Of the step before.
    last_turn_rad : ndarray, shape (step,)
        To the left; 0 where it is not known.
    ago_heading : ndarray, shape (lag, step, 2)
        Own headings `LAGS` steps before; zeros where it is not known.
    recent_turn_rad : ndarray, shape (step,)
        Mean of the last turns, the later the more it counts; wide ones count as 1.2.
    time : ndarray, shape (step,)
        Share of the recording that has passed.
    left_s : ndarray, shape (step,)
        Since another one that is still away left the room.
    each_left_s : ndarray, shape (step, other)
        Since each other one left it, though it may have come back; infinite for who did not.
    in_open : ndarray, shape (step, other)
        Share of the last five seconds that the other was off the walls.
    straight_s : ndarray, shape (step,)
        Since the fish last turned by more than 0.6 rad, or came.
    stayed_s : ndarray, shape (step,)
        Since the fish came into its room, or between the rooms, or into the recording.
    """

    attention: Floats
    toward: Floats
    shortly_ago_toward: Callable[[float], Floats]
    sight_ago: Callable[[float], Floats]
    attention_ago: Callable[[float], Floats]
    ago_toward: Callable[[float], Floats]
    then_toward: Callable[[float], Floats]
    bearing: Floats
    distance_m: Floats
    off_axis_rad: Floats
    speed_m_s: Floats
    lately_m_s: Floats
    mean_speeds_m_s: Callable[[float], tuple[Floats, Floats]]
    heading: Floats
    course: Floats
    here: NDArray[np.bool_]
    too_near: NDArray[np.bool_]
    in_sight: NDArray[np.bool_]
    is_robot: NDArray[np.bool_]
    other: NDArray[np.int32]
    own_heading: Floats
    along_wall: Floats
    way_out: Floats
    xy_m: Floats
    x_axis: Floats
    follows_walls: NDArray[np.bool_]
    zone: NDArray[np.int64]
    track: NDArray[np.int32]
    own_speed_m_s: Floats
    last_speed_m_s: Floats
    last_turn_rad: Floats
    ago_heading: Floats
    recent_turn_rad: Floats
    time: Floats
    left_s: Floats
    each_left_s: Floats
    in_open: Floats
    straight_s: Floats
    stayed_s: Floats
    _made: dict[Callable[[Seen], Floats], Floats] = field(
        default_factory=dict, init=False, repr=False
    )

    def once(self, make: Callable[[Seen], Floats]) -> Floats:
        """Return what a function makes of what is seen, worked out once: not to be written to."""
        if make not in self._made:
            self._made[make] = make(self)
        return self._made[make]

    @property
    def nearest(self) -> Floats:
        """One for the nearest other one, else 0, shape (step, other, 1)."""
        return self.chosen(-self.distance_m, self.here)

    @property
    def soon_toward(self) -> Floats:
        """See ``shortly_ago_toward``: a tenth of a step before."""
        return self.shortly_ago_toward(SOON)

    @property
    def half_toward(self) -> Floats:
        """See ``shortly_ago_toward``: half a step before."""
        return self.shortly_ago_toward(0.5)

    @property
    def soon_ago_toward(self) -> Floats:
        """Where the others were a tenth of a step before: see ``ago_toward``."""
        return self.ago_toward(SOON)

    @property
    def in_front_m(self) -> Floats:
        """Distance to the nearest one before the fish; `AWAY_M` without one, shape (step,)."""
        ahead = self.here & (self.off_axis_rad < math.pi / 3)
        return np.where(ahead, self.distance_m, AWAY_M).min(axis=1, initial=AWAY_M)

    @property
    def foremost(self) -> Floats:
        """One for the other one that is most straight ahead, of those before the fish."""
        return self.chosen(-self.off_axis_rad, self.here & (self.off_axis_rad < math.pi / 2))

    def fastest(self, over_s: float, within_m: float, *, if_faster: bool) -> Floats:
        """Return one for the fastest of those in view and near, else 0, shape (step, other, 1).

        Parameters
        ----------
        over_s
            Speeds are means over so long.
        within_m
            Of those within this distance.
        if_faster
            Whether only where it was faster than the fish itself; else nobody is, where there
            is never more than one other.
        """
        theirs, own = self.mean_speeds_m_s(over_s)
        among = self.here & self.in_sight & (self.distance_m < within_m)
        some = theirs > own[:, None] if if_faster else self.has_rivals
        return self.chosen(theirs, among & some)

    @property
    def has_rivals(self) -> bool:
        """Whether there are ever two others, of whom one may be the fastest."""
        return bool((self.here.sum(axis=1) > 1).any())

    def chosen(self, values: Floats, among: NDArray[np.bool_]) -> Floats:
        """Return one for the other one of the highest value, else 0, shape (step, other, 1).

        Parameters
        ----------
        values, among : ndarray, shape (step, other)
            Of those among whom it is chosen.
        """
        if not among.size:
            return np.zeros((*among.shape, 1))
        best = np.where(among, values, -np.inf).argmax(axis=1)
        is_best = best[:, None] == np.arange(among.shape[1])
        return np.asarray((is_best & among)[..., None], dtype=np.float64)

"""Who leaves a room first, and whether the others follow.

After Collignon et al. 2019 (Collective departures and leadership in zebrafish, PLoS ONE 14(5)
e0216798), in which fish go to and fro between two rooms. Arrays alone: which room a point is in
says the arena.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import takewhile

import numpy as np

from zfcal.arrays import Floats, Indices, Ints
from zfcal.behaviour.measured import Measured, floor_of, measured

FOLLOW_S = 10.0
"""Whoever leaves for the same room within it has followed."""

LED, FOLLOWED = "departures_led", "departures_followed"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rooms:
    """In which rooms some agents were.

    Parameters
    ----------
    room : ndarray of int, shape (frame, agent)
        The number of the room, from 1; 0 where an agent is between rooms, or lost.
    who : ndarray of int, shape (frame, agent)
        Under which id an agent is known; negative where it is lost.
    """

    room: Ints
    who: Ints


@dataclass(frozen=True, slots=True, kw_only=True)
class Crossing:
    """An agent's way from one room to another.

    Parameters
    ----------
    agent
        Its column.
    left, arrived
        The last frame in the one room and the first in the other.
    start, end
        The two rooms.
    """

    agent: int
    left: int
    arrived: int
    start: int
    end: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Departure:
    """The first to leave a group that is together in a room.

    Parameters
    ----------
    leaders
        Columns of those who left first: several where they did at the same frame.
    followed
        Whether at least half of the others who were there have left for the same room in time.
    """

    leaders: tuple[int, ...]
    followed: bool


def crossings(room: Ints, who: Ints | None = None) -> list[Crossing]:
    """Return all crossings, in the order in which rooms were left.

    Parameters
    ----------
    room : ndarray of int, shape (frame, agent)
        The number of the room, from 1; 0 where an agent is between rooms, or lost.
    who : ndarray of int, shape (frame, agent)
        Under which id an agent is known; None for one throughout. A way that ends under
        another id than it began is none.
    """
    found = []
    for agent in range(room.shape[1]):
        frames = np.flatnonzero(room[:, agent])
        visited = room[frames, agent]
        for i in np.flatnonzero(visited[1:] != visited[:-1]):
            left, arrived = int(frames[i]), int(frames[i + 1])
            same = who is None or who[left, agent] == who[arrived, agent]
            if same:
                rooms = int(visited[i]), int(visited[i + 1])
                found.append(
                    Crossing(agent=agent, left=left, arrived=arrived, start=rooms[0], end=rooms[1])
                )
    return sorted(found, key=_in_order)


def at_other_time(ways: Sequence[Crossing], shift: int, n_frames: int) -> list[Crossing]:
    """Return crossings later by some frames; what leaves at the end comes in at the start.

    A way that would lead from the end to the start is left out.
    """
    moved = [
        replace(one, left=(one.left + shift) % n_frames, arrived=(one.arrived + shift) % n_frames)
        for one in ways
    ]
    return [one for one in moved if one.left < one.arrived]


def last_room(room: Ints) -> Ints:
    """Return the room in which each agent was last, shape (frame, agent); 0 for none so far."""
    frame = np.where(room > 0, np.arange(len(room))[:, None], 0)
    latest = np.maximum.accumulate(frame, axis=0)
    return np.asarray(np.take_along_axis(room, latest, axis=0))


def departures(ways: Sequence[Crossing], last: Ints, *, dt_s: float) -> list[Departure]:
    """Return who left a group first, in the order of time.

    Parameters
    ----------
    ways
        The crossings, as `crossings` returns them.
    last : ndarray of int, shape (frame, agent)
        As `last_room` returns it.
    dt_s
        Time between two frames.

    Returns
    -------
    list of Departure
        One who leaves up to `FOLLOW_S` after another, for the same room, follows and starts none;
        nor does one who leaves when less than half of the others are in the same room. Those
        so near to the start or the end that others could have left before it, or after it, are
        left out.
    """
    wait = int(FOLLOW_S / dt_s + 1e-6)
    found: list[Departure] = []
    begun: dict[tuple[int, int], int] = {}
    for number, way in enumerate(ways):
        rooms = way.start, way.end
        if rooms in begun and way.left - begun[rooms] <= wait:
            continue
        begun[rooms] = way.left
        last_of = last[way.left].tolist()
        there = {a for a, room in enumerate(last_of) if room == way.start and a != way.agent}
        n_others = sum(room > 0 for room in last_of) - 1
        in_time = wait <= way.left < len(last) - wait
        if there and 2 * len(there) >= n_others and in_time:
            found.append(_departure(ways[number:], there, wait))
    return found


def _departure(ways: Sequence[Crossing], there: set[int], wait: int) -> Departure:
    """Return the departure that the first of some ways begins, with those who were there."""
    first = ways[0]
    leaders, after = [first.agent], set()
    for way in takewhile(lambda one: one.left - first.left <= wait, ways):
        if way.agent in there and (way.start, way.end) == (first.start, first.end):
            after.add(way.agent)
            if way.left == first.left:
                leaders.append(way.agent)
    return Departure(leaders=tuple(leaders), followed=2 * len(after) >= len(there))


def _in_order(way: Crossing) -> tuple[int, int]:
    return way.left, way.agent


def shares_of(found: Sequence[Departure], agents: Sequence[int]) -> tuple[float, float, int, int]:
    """Return how often some agents lead.

    Parameters
    ----------
    found
        The departures of a group.
    agents
        Columns of those who count as one.

    Returns
    -------
    led, followed : float
        The share of the group's departures that they led (of one with several leaders a part),
        and the share of their own attempts that were followed; NaN of nothing.
    n_led, n_followed : int
        Of how many.
    """
    chosen = set(agents)
    group = [one for one in found if one.followed]
    own = [one for one in found if chosen.intersection(one.leaders)]
    led = sum(len(chosen.intersection(one.leaders)) / len(one.leaders) for one in group)
    followed = sum(one.followed for one in own)
    return (
        led / len(group) if group else np.nan,
        followed / len(own) if own else np.nan,
        len(group),
        len(own),
    )


def measure_departures(
    robots: Rooms, fish: Rooms, *, dt_s: float, shifts: Ints, places: Indices
) -> list[Measured]:
    """Measure how often the robots lead out of a room, with ceiling and floor.

    Parameters
    ----------
    robots, fish
        Over the same frames. Several robots count as one.
    dt_s
        Time between two frames.
    shifts
        By how many frames the robots are shifted for the floor.
    places
        The fish that are put in the robot's place, among the fish alone.

    Returns
    -------
    list of Measured
        ``departures_led`` and ``departures_followed``; NaN where there is none, and where no
        robot was seen.
    """
    if not (robots.who >= 0).any():
        return [Measured(measure=name, value=np.nan) for name in (LED, FOLLOWED)]
    n_frames, n_robots = robots.room.shape
    fish_ways, fish_last = crossings(fish.room, fish.who), last_room(fish.room)
    behind = [replace(way, agent=way.agent + n_robots) for way in fish_ways]
    own_ways, own_last = crossings(robots.room, robots.who), last_room(robots.room)
    # Where a shifted robot was last may have been in the lap before.
    laps = last_room(np.vstack([robots.room, robots.room]))

    def of_robots(shift: int) -> tuple[float, float, int, int]:
        ways = at_other_time(own_ways, shift, n_frames)
        last = laps[n_frames - shift : 2 * n_frames - shift] if shift else own_last
        together = sorted([*ways, *behind], key=_in_order)
        found = departures(together, np.hstack([last, fish_last]), dt_s=dt_s)
        return shares_of(found, range(n_robots))

    led, followed, n_led, n_followed = of_robots(0)
    among_fish = departures(fish_ways, fish_last, dt_s=dt_s)
    in_place = [shares_of(among_fish, [int(place)])[:2] for place in places]
    chance = [of_robots(int(shift))[:2] for shift in shifts]
    return measured(
        [(LED, np.nan, n_led), (FOLLOWED, np.nan, n_followed)],
        np.array([led, followed]),
        in_place=_table(in_place),
        floor=floor_of(_table(chance)),
    )


def _table(rows: Sequence[tuple[float, float]]) -> Floats:
    return np.array(rows, dtype=np.float64).reshape(-1, 2)

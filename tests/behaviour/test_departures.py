"""Who leaves a room first, and who follows: by hand."""

import numpy as np
import pytest

from zfcal.behaviour.departures import (
    Crossing,
    Departure,
    Rooms,
    at_other_time,
    crossings,
    departures,
    last_room,
    measure_departures,
    shares_of,
)

DT_S = 1.0
"""So ten frames are the ten seconds in which one may follow."""


def rooms(*leaves, n_frames=60, way=3):
    """Return agents that go from room 1 to 2 after the given frame; None stays, shape (60, n)."""
    room = np.ones((n_frames, len(leaves)), dtype=np.int64)
    for agent, left in enumerate(leaves):
        if left is not None:
            room[left + 1 : left + 1 + way, agent] = 0
            room[left + 1 + way :, agent] = 2
    return room


def found_in(room):
    """Return the departures of a group."""
    return departures(crossings(room), last_room(room), dt_s=DT_S)


def measure(robot, fish, *, places=(0, 1, 2), shifts=()):
    """Return the two measures of a robot."""
    of = [Rooms(room=one, who=np.zeros_like(one)) for one in (robot, fish)]
    return measure_departures(
        *of, dt_s=DT_S, shifts=np.array(shifts, dtype=np.int64), places=np.array(places, dtype=int)
    )


def test_a_crossing_goes_from_the_last_frame_in_a_room_to_the_first_in_the_other():
    """Who turns round in the corridor has not crossed."""
    room = np.array([1, 1, 0, 0, 2, 2, 0, 2, 1])[:, None]
    assert crossings(room) == [
        Crossing(agent=0, left=1, arrived=4, start=1, end=2),
        Crossing(agent=0, left=7, arrived=8, start=2, end=1),
    ]


def test_under_another_id_nobody_has_crossed():
    """Two animals may have been taken for one."""
    room = np.array([1, 0, 2])[:, None]
    assert crossings(room, np.array([4, 4, 5])[:, None]) == []
    assert len(crossings(room, np.array([4, -1, 4])[:, None])) == 1


def test_at_another_time_no_way_leads_from_the_end_to_the_start():
    """Where two pieces of time are put together nobody moved."""
    way = Crossing(agent=0, left=6, arrived=8, start=1, end=2)
    assert at_other_time([way], 3, 10) == []
    assert at_other_time([way], 5, 10) == [Crossing(agent=0, left=1, arrived=3, start=1, end=2)]


def test_who_leaves_first_leads_those_who_come_after():
    """Agent 1 leaves at 20, two of the three others within ten seconds."""
    assert found_in(rooms(25, 20, 30, None)) == [Departure(leaders=(1,), followed=True)]


def test_one_of_three_others_is_not_the_group():
    """Nor is one who leaves after eleven seconds; he leaves as the first of those who are left."""
    assert found_in(rooms(20, 30, None, None)) == [Departure(leaders=(0,), followed=False)]
    assert found_in(rooms(20, 30)) == [Departure(leaders=(0,), followed=True)]
    late = found_in(rooms(20, 31, None, None))
    assert late == [
        Departure(leaders=(0,), followed=False),
        Departure(leaders=(1,), followed=False),
    ]


def test_who_is_almost_alone_leaves_no_group():
    """Two of three others are in room 2 already: agent 0 joins them."""
    assert found_in(np.hstack([rooms(20, None), np.full((60, 2), 2)])) == []


def test_near_an_edge_of_the_window_nobody_knows_who_was_first():
    """Others may have left before it began, or follow after its end."""
    assert found_in(rooms(9, 12, 13)) == []
    assert found_in(rooms(50, 52, 53)) == []
    assert len(found_in(rooms(10, 12, 13))) == 1


def test_two_at_once_share_the_lead():
    """Each has led half of it."""
    found = found_in(rooms(20, 20, 25))
    assert found == [Departure(leaders=(0, 1), followed=True)]
    assert shares_of(found, [0]) == (0.5, 1.0, 1, 1)
    assert shares_of(found, [0, 1]) == (1.0, 1.0, 1, 1)


def test_shares_by_hand():
    """Of two group departures agent 0 led one, and of its two attempts one was followed."""
    found = [
        Departure(leaders=(0,), followed=True),
        Departure(leaders=(0,), followed=False),
        Departure(leaders=(1,), followed=True),
    ]
    assert shares_of(found, [0]) == (0.5, 0.5, 2, 2)
    assert np.isnan(shares_of(found, [2])[1])
    assert np.isnan(shares_of([], [0])[0])


def test_a_robot_that_leads_leads_all():
    """It leaves at 20, three fish follow; among the fish alone the first of them leads."""
    led, followed = measure(rooms(20), rooms(22, 24, 26))
    assert (led.value, led.n) == (1.0, 1)
    assert (followed.value, followed.n) == (1.0, 1)
    assert led.ceiling == pytest.approx(1 / 3)
    assert np.isnan(led.floor)


def test_at_another_time_the_robot_leads_nobody():
    """Shifted by 30 s it leaves long after the fish."""
    led, followed = measure(rooms(15), rooms(17, 18, 19), shifts=(30,))
    assert (led.value, led.floor) == (1.0, 0.0)
    # They are in the other room then, and it has no group to leave.
    assert np.isnan(followed.floor)


def test_a_robot_that_is_lost_leads_nothing():
    """The fish depart without it, and what it would have done is not known."""
    fish = Rooms(room=rooms(20, 22, 24), who=np.zeros((60, 3), dtype=np.int64))
    for n in (0, 1):
        lost = np.zeros((60, n), dtype=np.int64)
        found = measure_departures(
            Rooms(room=lost, who=lost - 1), fish, dt_s=DT_S, shifts=np.array([30]),
            places=np.arange(3),
        )  # fmt: skip
        assert all(np.isnan(one.value) and np.isnan(one.floor) and one.n == 0 for one in found)

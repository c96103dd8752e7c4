"""How fast the others were over two seconds: each by its own steps alone."""

import numpy as np
import pytest

from zfcal.model.histories import in_open, lately, mean_speed, stayed
from zfcal.model.kernels.state import FOLLOWS, ROOM, SPEED, ZONE


def test_who_comes_into_a_column_has_no_speed_of_who_was_there():
    """Two tracks share a column, with a sample between them at which nobody is there."""
    states = np.zeros((12, max(SPEED, ZONE) + 1, 1))
    states[:, ZONE] = 1.0
    states[:6, SPEED], states[6:, SPEED] = 0.1, 0.3
    states[6, ZONE] = 0.0
    found = lately(states, 0.5)[:, 0]
    assert found[:6] == pytest.approx(np.full(6, 0.1))
    assert found[6] == 0.0
    assert found[7:] == pytest.approx(np.full(5, 0.3))


def test_it_is_the_mean_of_two_seconds():
    """Four steps of half a second; fewer where there were no more."""
    states = np.ones((6, max(SPEED, ZONE) + 1, 1))
    states[:, SPEED, 0] = [1.0, 2.0, 3.0, 4.0, 5.0, np.nan]
    found = lately(states, 0.5)[:, 0]
    assert found == pytest.approx([1.0, 1.5, 2.0, 2.5, 3.5, 4.0])


def test_it_may_be_the_mean_of_other_times():
    """Two steps; of one step what that was, whatever share of a step is asked for."""
    speed = np.array([1.0, 2.0, 4.0])[:, None]
    there = np.ones((3, 1), dtype=bool)
    assert mean_speed(speed, there, 2.2)[:, 0] == pytest.approx([1.0, 1.5, 3.0])
    assert mean_speed(speed, there, 0.3)[:, 0] == pytest.approx([1.0, 2.0, 4.0])


def rooms(*numbers):
    """Return states of one agent in rooms; None where it is not there."""
    states = np.zeros((len(numbers), ROOM + 1, 1))
    states[:, ZONE, 0] = [float(number is not None) for number in numbers]
    states[:, ROOM, 0] = [number or 0.0 for number in numbers]
    return states


def test_a_stay_begins_where_the_fish_comes_into_a_room():
    """Since when it is where it was first seen nobody knows; a gap is no coming and going."""
    states = rooms(None, 1, 1, 0, 2, None, 2, 2, 1)
    track = np.array([[-1], [3], [3], [3], [3], [-1], [3], [3], [3]], dtype=np.int32)
    found = stayed(states, track, 0.5)[:, 0]
    np.testing.assert_array_equal(found[[1, 2, 3, 4, 6, 7, 8]], [np.inf, np.inf, 0, 0, 1, 1.5, 0])


def test_another_track_has_a_stay_of_its_own():
    """Who is there now may have been there long."""
    states = rooms(0, 1, 1, 1, 0)
    track = np.array([[3], [3], [4], [4], [4]], dtype=np.int32)
    found = stayed(states, track, 1.0)[:, 0]
    np.testing.assert_array_equal(found, [np.inf, 0, np.inf, np.inf, 0])


def test_a_tank_without_rooms_has_no_stays():
    """There nothing goes by how long a fish has been in its room."""
    states, track = rooms(0, 0, 0), np.full((3, 1), 3, dtype=np.int32)
    assert np.isinf(stayed(states, track, 1.0)).all()


def test_the_share_in_the_open_is_of_five_seconds():
    """Of those in which the fish was there: two of ten steps at a wall, of two seconds none."""
    states = np.zeros((12, FOLLOWS + 1, 1))
    states[2:, ZONE, 0] = 1.0
    states[[4, 6], FOLLOWS, 0] = 1.0
    found = in_open(states, 0.5)[:, 0]
    assert found[1] == 0.0
    assert found[3] == 1.0
    assert found[4] == pytest.approx(2 / 3)
    assert found[11] == pytest.approx(0.8)

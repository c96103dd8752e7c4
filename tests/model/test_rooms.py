"""Rooms, their mouths, and who has just left one."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely

from zfcal.arena import make_arena
from zfcal.model.kernels.placing import remember
from zfcal.model.kernels.rooms import find_rooms
from zfcal.model.kernels.state import (
    LEFT_AT_S,
    LEFT_S,
    MOUTH_M,
    MOUTH_X,
    MOUTH_Y,
    NEVER_S,
    ROOM,
    STATES,
    TIME,
    ZONE,
    X,
    Y,
)
from zfcal.model.simulate import tank_of
from zfcal.model.tank import make_tank

CORRIDOR, CENTRE = 1, 3


def test_the_corridor_joins_two_rooms(two_rooms):
    """0.35 x 0.35 m each, less the corner that the corridor cuts off."""
    exit_zone, rooms = find_rooms(two_rooms)
    assert exit_zone == CORRIDOR
    cut = (0.401 - 0.330) * (0.401 - 0.330) / 2
    assert [room.area for room in rooms] == pytest.approx([0.35**2 - cut] * 2, abs=1e-4)


def test_a_mouth_is_the_middle_of_the_opening(two_rooms):
    """Between (.401, .670) and (.330, .599), and its mirror image."""
    mouths = tank_of(two_rooms).rooms.mouths
    assert mouths[:, 0].tolist() == [1.0, 2.0]
    assert mouths[np.argsort(mouths[:, 1]), 1:] == pytest.approx(
        np.array([(0.3655, 0.6345), (0.6345, 0.3655)]), abs=1e-4
    )


def test_a_cell_is_of_the_nearest_room(two_rooms):
    """Every one, though most are told by squares of them; 40 cells a side fill no square."""
    for cells in (300, 40):
        tank = make_tank(two_rooms, cells=cells)
        _, rooms = find_rooms(two_rooms)
        row, column = np.indices(tank.rooms.cells.shape)
        places = shapely.points(
            tank.x0_m + (column + 0.5) / tank.per_m, tank.y0_m + (row + 0.5) / tank.per_m
        )
        distance_m = np.array([shapely.distance(room, places) for room in rooms])
        taken = np.take_along_axis(distance_m, tank.rooms.cells[None].astype(int) - 1, axis=0)[0]
        assert (taken == distance_m.min(axis=0)).all()


def test_an_open_tank_has_no_rooms():
    """Neither has a tank whose zones are belts."""
    square = shapely.box(0.0, 0.0, 0.5, 0.5)
    arena = make_arena(name="open", outline=square, wall_zone_m=0.05)
    assert find_rooms(arena) == (0, ())
    assert tank_of(arena).rooms.mouths.shape == (0, 3)


def test_who_left_a_room_is_remembered_by_who_stays(two_rooms):
    """Seconds since, for those in that room alone, until the other comes back."""
    tank = tank_of(two_rooms)
    state = np.zeros((STATES, 3))
    state[X], state[Y] = (0.2, 0.25, 0.8), (0.8, 0.75, 0.2)
    state[ZONE], state[LEFT_AT_S] = CENTRE, -NEVER_S
    remember(state, tank)
    assert state[ROOM, 0] == state[ROOM, 1] != state[ROOM, 2]
    assert (state[LEFT_S] == NEVER_S).all()

    state[X, 0], state[Y, 0], state[ZONE, 0], state[TIME] = 0.5, 0.5, CORRIDOR, 7.0
    remember(state, tank)
    state[TIME] = 9.5
    remember(state, tank)
    assert state[ROOM, 0] == 0.0
    assert state[LEFT_S].tolist() == [NEVER_S, 2.5, NEVER_S]

    state[X, 0], state[Y, 0], state[ZONE, 0] = 0.2, 0.8, CENTRE
    remember(state, tank)
    assert (state[LEFT_S] == NEVER_S).all()


def test_the_way_out_is_a_unit_vector(two_rooms):
    """From (0.2, 0.8) it is the diagonal; between rooms there is none."""
    state = np.zeros((STATES, 2))
    state[X], state[Y] = (0.2, 0.5), (0.8, 0.5)
    state[ZONE] = (CENTRE, CORRIDOR)
    remember(state, tank_of(two_rooms))
    assert state[MOUTH_X, 0] == pytest.approx(math.sqrt(0.5), abs=1e-3)
    assert state[MOUTH_Y, 0] == pytest.approx(-math.sqrt(0.5), abs=1e-3)
    assert state[MOUTH_M, 0] == pytest.approx(math.hypot(0.1655, 0.1655), abs=1e-4)
    assert state[[MOUTH_X, MOUTH_Y], 1].tolist() == [0.0, 0.0]

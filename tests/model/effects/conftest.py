"""Effects asked one by one: their functions by hand, and the tracks that they make."""

from __future__ import annotations

import ctypes
import dataclasses

import numpy as np
import pytest

from zfcal.model.effects import find_effect
from zfcal.model.kernels import state
from zfcal.model.simulate import simulate_tracks

MIDDLING = {
    "HX": 1.0, "SPEED": 0.07, "ZONE": 3.0, "WALL": 0.1, "TAU_Y": 1.0, "PAST_HX": 1.0,
    "MOUTH_M": state.NEVER_S, "LEFT_S": state.NEVER_S, "LEFT_AT_S": -state.NEVER_S, "DT_S": 0.2,
}  # fmt: skip


def _pointer(numbers):
    return np.ascontiguousarray(numbers).ctypes.data_as(ctypes.POINTER(ctypes.c_double))


class Asked:
    """The functions of one effect at given parameters, on a state that is written out."""

    def __init__(self, name, parameters, rows):
        self.effect = find_effect(name)
        n = max([np.size(values) for values in rows.values()], default=1)
        self.state = np.zeros((state.STATES, n))
        for row, values in (MIDDLING | rows).items():
            self.state[getattr(state, row)] = values
        self.sight = np.where(np.eye(n, dtype=bool), 0.0, 0.01)
        self.parameters = np.zeros(8)
        values = self.effect.values(parameters)
        self.parameters[: len(values)] = values

    def _given(self, i):
        state, sight = _pointer(self.state), _pointer(self.sight)
        return state, sight, self.state.shape[1], i, _pointer(self.parameters)

    def factor(self, theta, *, i=0, speed=0.07, landing=3):
        """Return the factor on a heading."""
        call = self.effect.factor.ctypes
        return call(*self._given(i), np.cos(theta), np.sin(theta), speed, landing)

    def sight_of(self, j, *, i=0):
        """Return the factor on the solid angle of a neighbour."""
        return self.effect.sight.ctypes(*self._given(i), j)

    def speed(self, *, i=0, chance=0.5):
        """Return the factor on the speed."""
        return self.effect.speed.ctypes(*self._given(i), chance)

    def rotation(self, *, i=0):
        """Return the angle by which the base's directions are turned."""
        return self.effect.rotation.ctypes(*self._given(i))

    def whole_rotation(self, *, i=0):
        """Return the angle by which all directions are turned."""
        return self.effect.whole_rotation.ctypes(*self._given(i))

    def component(self, *, i=0):
        """Return weight, unit vector and kappa."""
        out = np.zeros(3)
        weight = self.effect.component.ctypes(*self._given(i), _pointer(out))
        return weight, out


@pytest.fixture
def ask():
    """Return a function that takes an effect's name, its parameters, and rows of the state."""

    def asked(name, parameters, **rows):
        return Asked(name, parameters, rows)

    return asked


@pytest.fixture
def natural_model(make_natural, two_rooms):
    """Return the natural model of two rooms."""
    return make_natural(two_rooms)


@pytest.fixture
def swim(natural_model, two_rooms):
    """Return a function that simulates the natural model with one effect, or without."""

    def tracks(name=None, parameters=None, *, n_agents=5, n_steps=20_000, seed=6, n_robots=0):
        effects = {} if name is None else {name: parameters}
        return simulate_tracks(
            dataclasses.replace(natural_model, effects=effects), two_rooms, n_agents=n_agents,
            n_steps=n_steps, seed=seed, n_robots=n_robots,
        )  # fmt: skip

    return tracks


@pytest.fixture
def bearings():
    """Return a function: direction from each agent to each other one, shape (step, i, j)."""

    def between(xy_m):
        away = xy_m[:, None, :, :] - xy_m[:, :, None, :]
        return np.arctan2(away[..., 1], away[..., 0]), np.linalg.norm(away, axis=-1)

    return between

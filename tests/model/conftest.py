"""States that are hard for a sampler, and arenas and models for them."""

from __future__ import annotations

import dataclasses
import importlib.util
import math
from pathlib import Path

import pytest

from zfcal.artifacts.arenas import load_arena
from zfcal.parameters import natural

# A neighbour just beside, one just ahead, one behind, one far: seen by the agent at (x, y).
STATES = {
    "alone in the centre of a room": ([(0.22, 0.77)], [0.4]),
    "facing a wall at 4 mm": ([(0.055, 0.80), (0.10, 0.85)], [math.pi, 1.0]),
    "in a corner": ([(0.058, 0.941), (0.12, 0.90), (0.20, 0.75)], [2.3, 0.0, 4.0]),
    "in the mouth of the corridor": ([(0.41, 0.655), (0.50, 0.52), (0.30, 0.75)], [-0.8, 2.3, 0.1]),
    "in the corridor beside another": (
        [(0.50, 0.50), (0.53, 0.47), (0.46, 0.55)],
        [-0.7, -0.7, 2.0],
    ),
    "crowded": (
        [(0.25, 0.75), (0.263, 0.75), (0.25, 0.79), (0.20, 0.75), (0.30, 0.70)],
        [0.0, 1.0, 2.0, 3.0, 4.0],
    ),
    "at a reflex corner": ([(0.396, 0.676), (0.35, 0.80), (0.45, 0.58)], [-0.5, 0.0, 2.0]),
}


@pytest.fixture(scope="session")
def twin():
    """Return the module of slow and obvious formulas that stands beside the tests."""
    spec = importlib.util.spec_from_file_location("twin", Path(__file__).parent / "twin.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="session")
def two_rooms():
    """Return the default arena."""
    return load_arena("two-rooms", Path())


def natural_of(arena, *, dt_s=0.2, **changes):
    """Return natural parameters for an arena, changed as asked."""
    zones = tuple((zone.name, zone.follows_walls) for zone in arena.zones)
    return dataclasses.replace(natural(zones, dt_s=dt_s), **changes)


@pytest.fixture(scope="session")
def model(two_rooms):
    """Return natural parameters in two rooms, with a sharp preference between zones."""
    return natural_of(two_rooms)


@pytest.fixture(params=STATES, ids=lambda name: name.replace(" ", "-"))
def hard_state(request):
    """Return positions in metres and headings in radians of one hard state."""
    return STATES[request.param]


@pytest.fixture(scope="session")
def make_natural():
    """Return a function that gives natural parameters for an arena."""
    return natural_of

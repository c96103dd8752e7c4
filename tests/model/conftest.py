"""States that are hard for a sampler, and arenas and models for them."""

from __future__ import annotations

import dataclasses
import importlib.util
import math
from pathlib import Path

import numpy as np
import pytest

from zfcal.artifacts.arenas import load_arena
from zfcal.model.features import LAGS, SOON, Seen
from zfcal.model.scene import make_scene
from zfcal.model.simulate import simulate_tracks
from zfcal.parameters import natural
from zfcal.tracks import Samples

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


def _lags(soon, half):
    """Return directions by how late they are; those of whole steps are any others."""
    return {SOON: soon, 0.5: half, 1: -soon, 2: -half, 3: soon[::-1]}


@pytest.fixture
def seen():
    """Return what six steps of fish saw of two fish and a robot, all at random."""
    rng, speeds, n, others = np.random.default_rng(3), np.random.default_rng(4), 6, 3

    def ways(*shape):
        angle = rng.uniform(-np.pi, np.pi, shape)
        return np.stack([np.cos(angle), np.sin(angle)], axis=-1)

    robot = np.zeros((n, others), dtype=bool)
    robot[:, -1] = True
    ago, then = (dict(zip(LAGS, each, strict=True)) for each in ways(2, len(LAGS), n, others))
    ago |= {SOON: -ago[1], 0.5: -ago[2]}
    return Seen(
        attention=rng.uniform(0.1, 2.0, (n, others)),
        toward=ways(n, others),
        shortly_ago_toward=_lags(*ways(2, n, others)).__getitem__,
        ago_toward=ago.__getitem__,
        then_toward=then.__getitem__,
        sight_ago={1.0: ways(n, others), 2.0: ways(n, others)}.__getitem__,
        attention_ago={
            steps: rng.uniform(0.1, 2.0, (n, others)) for steps in (SOON, 0.5, 1.0, 2.0)
        }.__getitem__,
        bearing=ways(n, others),
        distance_m=rng.uniform(0.03, 0.5, (n, others)),
        off_axis_rad=rng.uniform(0, np.pi, (n, others)),
        speed_m_s=rng.uniform(0, 0.2, (n, others)),
        lately_m_s=rng.uniform(0, 0.2, (n, others)),
        mean_speeds_m_s={
            over_s: (speeds.uniform(0, 0.2, (n, others)), speeds.uniform(0, 0.1, n))
            for over_s in (0.2, 0.6, 1.0, 2.0)
        }.__getitem__,
        heading=ways(n, others),
        course=0.05 * ways(n, others),
        here=np.ones((n, others), dtype=bool),
        too_near=np.zeros((n, others), dtype=bool),
        in_sight=rng.random((n, others)) < 0.7,
        is_robot=robot,
        other=np.tile(np.array([3, 4, 5], dtype=np.int32)[:others], (n, 1)),
        own_heading=ways(n),
        x_axis=np.tile([1.0, 0.0], (n, 1)),
        way_out=ways(n),
        along_wall=ways(n),
        xy_m=rng.uniform(0.1, 0.3, (n, 2)),
        follows_walls=np.arange(n) % 2 == 0,
        zone=np.arange(n) % 3 + 1,
        track=np.arange(n, dtype=np.int32) % 3,
        own_speed_m_s=rng.uniform(0.02, 0.2, n),
        last_turn_rad=rng.normal(0, 0.3, n),
        ago_heading=np.stack([ways(n) for _ in LAGS]),
        recent_turn_rad=rng.normal(0, 0.3, n),
        time=np.linspace(0, 1, n),
        left_s=rng.uniform(0, 9, n),
        each_left_s=rng.uniform(0, 9, (n, others)),
        in_open=rng.uniform(0, 1, (n, others)),
        stayed_s=rng.uniform(0, 30, n),
        straight_s=rng.uniform(0, 8, n),
        last_speed_m_s=rng.uniform(0.02, 0.2, n),
    )


@pytest.fixture(scope="session")
def watch(two_rooms, model):
    """Return what simulates fish with effects, and makes a scene of them."""

    def scene_of(effects, *, seed, n_steps=1500, n_agents=5):
        truth = dataclasses.replace(model, effects=effects)
        xy, _ = simulate_tracks(truth, two_rooms, n_agents=n_agents, n_steps=n_steps, seed=seed)
        samples = Samples(
            dt_s=0.2,
            k=np.arange(n_steps),
            agent=np.arange(1, n_agents + 1, dtype=np.int32),
            kind=np.zeros(n_agents, dtype=np.int8),
            xy_m=xy[:n_steps],
            confidence=np.ones((n_steps, n_agents), dtype=np.float32),
        )
        return make_scene(samples, two_rooms)

    return scene_of

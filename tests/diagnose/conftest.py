"""Scenes of the base model, made once, and of simulated effects."""

import dataclasses
import importlib.util
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from zfcal.diagnose.candidates import Candidate
from zfcal.diagnose.screening import Screen
from zfcal.model.effects import find_effect
from zfcal.model.extended import maximise
from zfcal.model.scene import make_scene
from zfcal.model.simulate import simulate_tracks

_PATH = Path(__file__).parent / "worlds_for_diagnosis.py"


@pytest.fixture(scope="session")
def worlds():
    """Return the module that makes recordings with a known answer."""
    spec = importlib.util.spec_from_file_location("worlds_for_diagnosis", _PATH)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="session")
def base(worlds):
    """Return scene and fitted model of ten minutes of fish that do as the base model does."""
    return worlds.fitted_scene(worlds.base_walk(13, minutes=10))


@pytest.fixture(scope="session")
def tank(worlds):
    """Return the default arena."""
    return worlds.two_rooms()


@pytest.fixture(scope="session")
def fish(worlds, tank):
    """Return natural fish for it: the base model."""
    return worlds.natural_fish(tank)


@pytest.fixture(scope="session")
def record(worlds, tank, fish):
    """Return what simulates samples of fish, and robots last, with effects."""

    @cache
    def make(names, seed, minutes, n_fish, n_robots):
        model = dataclasses.replace(fish, effects={name: dict(values) for name, values in names})
        xy_m, _ = simulate_tracks(
            model,
            tank,
            n_agents=n_fish + n_robots,
            n_robots=n_robots,
            n_steps=round(minutes * 300),
            seed=seed,
        )
        samples = worlds.samples_of(xy_m)
        kind = (np.arange(n_fish + n_robots) >= n_fish).astype(np.int8)
        return dataclasses.replace(samples, kind=kind)

    def of(seed, effects=None, *, minutes=10.0, n_fish=5, n_robots=0):
        names = tuple((name, tuple(values.items())) for name, values in (effects or {}).items())
        return make(names, seed, minutes, n_fish, n_robots)

    return of


@pytest.fixture(scope="session")
def screen(record, tank, fish):
    """Return what fits the base model to a simulated recording, ready to be asked."""
    kept = {}

    def of(seed, effects=None, **company):
        samples = record(seed, effects, **company)
        if id(samples) not in kept:
            # The last two: several tests in a row ask the same recording.
            while len(kept) > 1:
                del kept[next(iter(kept))]
            scene = make_scene(samples, tank)
            kept[id(samples)] = Screen(scene=scene, fitted=maximise(scene, fish))
        return kept[id(samples)]

    return of


@pytest.fixture(scope="session")
def candidate():
    """Return what gives an effect at its default shape, changed as asked."""

    def of(name, **shape):
        effect = find_effect(name)
        default = {p.name: p.default for p in effect.parameters if p.name != effect.strength}
        return Candidate(effect=effect, shape=default | shape)

    return of

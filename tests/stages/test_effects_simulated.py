"""Every effect in a model file, through what reads it and swims by it."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from zfcal.artifacts.arenas import load_arena
from zfcal.artifacts.lineage import Lineage
from zfcal.artifacts.models import SCHEMA, write_model
from zfcal.artifacts.tables import read_tracks
from zfcal.calibrate.group import Group
from zfcal.model.effects import all_effects, generic_effects
from zfcal.model.simulate import pack, simulate_counts, simulate_tracks
from zfcal.parameters import natural, to_genes
from zfcal.sampling import sample
from zfcal.stages.calibrate.holdout import FixedModel
from zfcal.stages.events import say_nothing
from zfcal.stages.simulate import SimulateOptions, simulate
from zfcal.tracks import concatenate

SHY = {"robot-avoidance": {"strength": 3.0}}


@pytest.fixture
def arena(tmp_path):
    """Return the default arena."""
    return load_arena("two-rooms", tmp_path)


@pytest.fixture
def shy(arena):
    """Return a model of fish that do not mind a robot, at numbers that a genome holds."""
    zones = tuple((zone.name, zone.follows_walls) for zone in arena.zones)
    return dataclasses.replace(natural(zones, dt_s=0.2), effects=SHY)


@pytest.fixture
def swim(tmp_path, shy):
    """Return a function that simulates a trial by a model file with effects."""

    def tracks(effects, duration_s, n_fish=4):
        path = tmp_path / "model.toml"
        lineage = Lineage(schema=SCHEMA, command="extend", seed=1)
        write_model(path, dataclasses.replace(shy, effects=effects), lineage)
        options = SimulateOptions(
            model=path, duration_s=duration_s, seed=2, arena="two-rooms", n_fish=n_fish, n_robots=1
        )
        simulate(tmp_path / "swum", options, say_nothing)
        return concatenate(
            [read_tracks(part) for part in sorted((tmp_path / "swum" / "tracks").glob("*.parquet"))]
        )

    return tracks


@pytest.mark.parametrize("effect", [*all_effects(), *generic_effects()], ids=lambda one: one.name)
def test_a_model_file_with_it_is_simulated(effect, swim, arena):
    """At its middle strength and first shape, 2,000 steps: nobody is lost, all are inside."""
    (own,) = (each for each in effect.parameters if each.name == effect.strength)
    shape = effect.shapes(arena)[0]

    tracks = swim({effect.name: {own.name: own.default} | shape}, 400.0)

    assert len(tracks.time_s) == 2000 * 5
    assert (arena.zone_of(np.column_stack([tracks.x_m, tracks.y_m])) > 0).all()


def test_a_simulated_trial_knows_its_robot(swim, shy, arena):
    """Bit by bit the model's own steps with the last agent a robot, and not those without."""
    tracks = swim(SHY, 40.0)
    xy_m = sample(tracks, fps=5.0, dt_s=0.2, start_s=0.0, end_s=40.0).xy_m
    size = {"n_agents": 5, "n_steps": 200, "seed": 2}
    assert np.array_equal(xy_m, simulate_tracks(shy, arena, n_robots=1, **size)[0])
    assert not np.array_equal(xy_m, simulate_tracks(shy, arena, **size)[0])


@pytest.mark.parametrize("kind", ["group", "fixed"])
def test_calibration_and_judgement_know_the_robot(kind, shy, arena):
    """The counts are those of a simulation with one robot, and not those of one without."""
    genes = to_genes(shy)[None, :]
    if kind == "group":
        group = Group(arena=arena, template=shy, n_fish=2, n_robots=1)
    else:
        group = FixedModel(arena=arena, template=shy, n_agents=3, n_fish=2)
    seeds = np.array([4], dtype=np.uint64)
    counts = group.simulate(genes, n_counted=3, n_steps=900, seeds=seeds)

    wall = [
        simulate_counts(
            pack([shy], arena), arena, n_agents=3, n_steps=900, seeds=seeds, n_robots=n_robots
        ).wall
        for n_robots in (1, 0)
    ]
    assert np.array_equal(counts.wall, wall[0])
    assert not np.array_equal(counts.wall, wall[1])

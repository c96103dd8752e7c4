"""What the kernel counts while it simulates is what the statistics count in the recorded run."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
import shapely

from zfcal.arena import Bins, Zone, make_arena
from zfcal.artifacts.arenas import load_arena
from zfcal.behaviour.statistics import measure
from zfcal.model.kernels.crowd_runs import record_crowd_run
from zfcal.model.kernels.run import record_run
from zfcal.model.packing import pack
from zfcal.model.simulate import (
    burn_in_steps,
    individuals,
    is_crowd,
    simulate_counts,
    tank_of,
)
from zfcal.parameters import natural
from zfcal.tracks import FISH, Samples

FEATURES = ("distance", "wall", "occupation", "transition", "speed")
SEED = np.uint64(2024)

# Ranges that start above zero and end below what occurs: both outer bins hold what lies beyond.
TIGHT = make_arena(
    name="tight ranges",
    outline=shapely.box(0, 0, 0.5, 0.4).difference(shapely.box(0.2, 0.15, 0.24, 0.2)),
    zones=(Zone(name="nook", follows_walls=False, polygon=shapely.box(0.3, 0, 0.5, 0.2)),),
    wall_zone_m=0.04,
    bins=Bins(distance_m=(0.05, 0.2), wall_distance_m=(0.01, 0.05), speed_m_s=(0.02, 0.19)),
)


def arena_of(name):
    """Return an arena that comes with zfcal, or the one of this file."""
    return TIGHT if name == "tight" else load_arena(name, Path())


def model_of(arena, dt_s=0.2, **changes):
    """Return natural parameters for an arena, changed as asked."""
    zones = tuple((zone.name, zone.follows_walls) for zone in arena.zones)
    return dataclasses.replace(natural(zones, dt_s=dt_s), **changes)


def recorded(model, arena, *, n_agents, n_steps):
    """Record the run of ``SEED`` and return it as samples."""
    packed, people, tank = pack([model], arena), individuals(n_agents, 0), tank_of(arena)
    rest = (SEED, people, burn_in_steps(model.dt_s), n_steps, packed, tank)
    record = record_crowd_run(*rest) if is_crowd(n_agents, packed) else record_run(*rest, 0)
    return Samples(
        dt_s=model.dt_s,
        k=np.arange(n_steps, dtype=np.int64),
        agent=np.arange(n_agents, dtype=np.int32),
        kind=np.full(n_agents, FISH, dtype=np.int8),
        xy_m=record[:, :, :2],
        confidence=np.ones((n_steps, n_agents), dtype=np.float32),
    )


def counted(model, arena, **sizes):
    """Return the counts of the run of ``SEED``, without the axes of models and runs."""
    counts = simulate_counts(pack([model], arena), arena, seeds=np.array([SEED]), **sizes)
    return {name: getattr(counts, name)[0, 0] for name in FEATURES}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["two-rooms", "ring", "circular", "open-square", "tight"])
def test_the_kernel_counts_what_the_statistics_count(name):
    """One run of 5 agents and 3,000 samples: D, W, O, T and V are equal, count by count."""
    arena = arena_of(name)
    model = model_of(arena)

    counts = counted(model, arena, n_agents=5, n_steps=3000)
    expected = measure(recorded(model, arena, n_agents=5, n_steps=3000), arena)

    for feature in FEATURES:
        np.testing.assert_array_equal(counts[feature], getattr(expected, feature), feature)
    assert expected.n_void == 0


def test_they_agree_at_another_step_and_when_not_all_agents_count():
    """Four of six agents at a third of a second: pairs and steps of the first four alone."""
    arena = arena_of("two-rooms")
    model = model_of(arena, dt_s=1 / 3)

    counts = counted(model, arena, n_agents=6, n_counted=4, n_steps=1500)
    run = recorded(model, arena, n_agents=6, n_steps=1500)
    expected = measure(run.take_agents(np.arange(4)), arena)

    for feature in FEATURES:
        np.testing.assert_array_equal(counts[feature], getattr(expected, feature), feature)


def test_one_agent_alone_has_no_distances():
    """D is empty, the rest is that of the record."""
    arena = arena_of("two-rooms")
    model = model_of(arena)

    counts = counted(model, arena, n_agents=1, n_steps=2000)
    expected = measure(recorded(model, arena, n_agents=1, n_steps=2000), arena)

    assert counts["distance"].sum() == 0
    for feature in FEATURES:
        np.testing.assert_array_equal(counts[feature], getattr(expected, feature), feature)


def test_a_hundred_agents_are_counted_alike():
    """4,950 pairs a sample; many are nearer to each other than a body's length."""
    arena = arena_of("two-rooms")
    model = model_of(arena)

    counts = counted(model, arena, n_agents=100, n_steps=20)
    expected = measure(recorded(model, arena, n_agents=100, n_steps=20), arena)

    for feature in FEATURES:
        np.testing.assert_array_equal(counts[feature], getattr(expected, feature), feature)
    assert counts["distance"].sum() > 20 * 500


@pytest.mark.slow
def test_one_sample_has_no_step():
    """T and V are empty, O and W hold each agent once."""
    arena = arena_of("ring")

    counts = counted(model_of(arena), arena, n_agents=3, n_steps=1)

    assert counts["transition"].sum() == counts["speed"].sum() == 0
    assert counts["occupation"].sum() == counts["wall"].sum() == 3


def test_outer_bins_hold_what_lies_beyond():
    """With ranges that are too tight both outer bins of D and W are well filled."""
    counts = counted(model_of(TIGHT), TIGHT, n_agents=5, n_steps=2000)

    for feature in ("distance", "wall"):
        total = counts[feature].sum()
        assert counts[feature][:, 0].sum() > 0.03 * total
        assert counts[feature][:, 9].sum() > 0.03 * total

"""Whole simulations: counts, recorded runs, threads, seeds."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from zfcal.artifacts.arenas import load_arena
from zfcal.errors import InputError
from zfcal.model.simulate import pack, pack_genes, simulate_counts, simulate_tracks
from zfcal.parameters import from_genes, to_genes

SEEDS = np.array([3, 14, 159], dtype=np.uint64)


def test_the_numbers_do_not_depend_on_threads(two_rooms, model):
    """Twelve models, three seeds: bit-equal with one, two and five threads."""
    genes = np.random.default_rng(0).uniform(size=(12, 18))
    packed = pack_genes(genes, model, two_rooms)

    one, two, five = (
        simulate_counts(packed, two_rooms, n_agents=5, n_steps=1500, seeds=SEEDS, n_threads=threads)
        for threads in (1, 2, 5)
    )

    for alone, pair, many in zip(one, two, five, strict=True):
        assert (alone == pair).all()
        assert (alone == many).all()


def test_a_model_of_a_population_counts_as_it_does_alone(two_rooms, model):
    """Neighbours in the population leave no trace."""
    genes = np.random.default_rng(1).uniform(size=(4, 18))
    together = simulate_counts(
        pack_genes(genes, model, two_rooms), two_rooms, n_agents=5, n_steps=400, seeds=SEEDS
    )
    alone = simulate_counts(
        pack_genes(genes[2:3], model, two_rooms), two_rooms, n_agents=5, n_steps=400, seeds=SEEDS
    )

    for whole, part in zip(together, alone, strict=True):
        assert (whole[2] == part[0]).all()


def test_genes_and_models_pack_alike(two_rooms, model):
    """From a model to genes and back: the same arrays."""
    genes = to_genes(model)

    by_genes = pack_genes([genes], model, two_rooms)
    by_model = pack([from_genes(genes, model)], two_rooms)

    for left, right in zip(by_genes, by_model, strict=True):
        assert np.asarray(left) == pytest.approx(np.asarray(right))


def test_every_sample_is_counted_once(two_rooms, model):
    """Samples times agents in O and W, one less per agent in T and V, pairs at most ten in D."""
    counts = simulate_counts(
        pack([model], two_rooms), two_rooms, n_agents=5, n_steps=700, seeds=SEEDS
    )

    assert (counts.occupation.sum(axis=2) == 700 * 5).all()
    assert (counts.wall.sum(axis=(2, 3)) == 700 * 5).all()
    assert (counts.transition.sum(axis=(2, 3)) == 699 * 5).all()
    assert (counts.speed.sum(axis=(2, 3)) == 699 * 5).all()
    assert (counts.distance.sum(axis=(2, 3)) <= 700 * 10).all()
    assert (counts.distance.sum(axis=(2, 3)) > 0).all()


def test_only_the_first_agents_count_when_asked(two_rooms, model):
    """Four of five: so many samples, and at most six pairs."""
    counts = simulate_counts(
        pack([model], two_rooms), two_rooms, n_agents=5, n_counted=4, n_steps=300, seeds=SEEDS
    )

    assert (counts.occupation.sum(axis=2) == 300 * 4).all()
    assert (counts.distance.sum(axis=(2, 3)) <= 300 * 6).all()


def test_speeds_are_drawn_from_each_zones_histogram(two_rooms, model):
    """Frequencies within five standard errors, bin by bin: notices 2 % in a large bin.

    Agents that find no way stay and count as slow; with natural parameters
    there are next to none.
    """
    seeds = np.arange(30, dtype=np.uint64)
    speed = simulate_counts(
        pack([model], two_rooms), two_rooms, n_agents=5, n_steps=3000, seeds=seeds
    ).speed.sum(axis=(0, 1))

    for zone, row in zip(model.zones, speed, strict=True):
        expected = np.array(zone.speed_frequency)
        error = np.sqrt(expected * (1 - expected) / row.sum())
        # In a tight place fast draws are redrawn: three per mille is allowed for that.
        assert (np.abs(row / row.sum() - expected) < 5 * error + 0.003).all()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["two-rooms", "circular", "ring", "open-square"])
def test_nobody_leaves_the_tank(name, make_natural):
    """Every recorded position of 10,000 agent-steps is inside."""
    arena = load_arena(name, Path())

    xy, heading = simulate_tracks(make_natural(arena), arena, n_agents=5, n_steps=2000, seed=4)

    assert (arena.zone_of(xy) > 0).all()
    assert np.isfinite(heading).all()


def test_a_step_is_the_speed_along_the_new_heading(two_rooms, model):
    """Displacement and heading agree, and no step is longer than 0.2 m/s allow."""
    xy, heading = simulate_tracks(model, two_rooms, n_agents=3, n_steps=500, seed=8)

    step = np.diff(xy, axis=0)
    length = np.hypot(step[..., 0], step[..., 1])
    along = step[..., 0] * np.cos(heading[1:]) + step[..., 1] * np.sin(heading[1:])
    assert length.max() <= 0.2 * model.dt_s + 1e-12
    assert along == pytest.approx(length, abs=1e-12)


@pytest.mark.slow
def test_both_samplers_give_the_same_occupation(two_rooms, model):
    """Share of time in the centre over 24 runs each: Welch's test at p > 1e-4.

    Runs of 300 s spread by about 0.1, so a difference of 0.12 would be noticed.
    State by state the law is tested far more finely.
    """
    shares = {}
    for sampler in ("exact", "grid"):
        runs = [
            simulate_tracks(model, two_rooms, n_agents=5, n_steps=1500, seed=seed, sampler=sampler)[
                0
            ]
            for seed in range(24)
        ]
        shares[sampler] = [(two_rooms.zone_of(xy[::10]) == 3).mean() for xy in runs]

    assert np.std(shares["exact"]) < 0.2
    assert stats.ttest_ind(shares["exact"], shares["grid"], equal_var=False).pvalue > 1e-4


def test_another_seed_is_another_run_and_the_same_seed_the_same(two_rooms, model):
    """Bits, both ways."""
    first, again, other = (
        simulate_tracks(model, two_rooms, n_agents=2, n_steps=50, seed=seed)[0]
        for seed in (1, 1, 2)
    )

    assert (first == again).all()
    assert not (first == other).any()


def test_a_model_of_another_arena_is_refused(model):
    """The zones are named in the message."""
    with pytest.raises(InputError, match=r"corridor.*inner"):
        pack([model], load_arena("ring", Path()))


def test_models_with_other_steps_do_not_mix(two_rooms, model):
    """One population has one step."""
    with pytest.raises(InputError, match="same dt_s"):
        pack([model, dataclasses.replace(model, dt_s=0.1)], two_rooms)


def test_nothing_to_simulate_is_refused(two_rooms, model):
    """No steps."""
    with pytest.raises(InputError, match="0 steps"):
        simulate_counts(pack([model], two_rooms), two_rooms, n_agents=5, n_steps=0, seeds=SEEDS)

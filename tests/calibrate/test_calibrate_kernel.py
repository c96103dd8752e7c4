"""The real model behind the search: counts, threads, and a whole small round."""

from dataclasses import replace

import numpy as np
import pytest
import shapely

from zfcal.arena import Zone, make_arena
from zfcal.behaviour.scores import compare
from zfcal.behaviour.statistics import ATTRIBUTES
from zfcal.calibrate.group import Group, SeedSource, as_statistics, express, pool_runs, scale_gamma
from zfcal.calibrate.objective import Objective
from zfcal.calibrate.rounds import calibrate_window
from zfcal.calibrate.search import first_population
from zfcal.calibrate.task import Task
from zfcal.errors import InputError
from zfcal.parameters import natural, to_genes

SEEDS = np.array([3, 4], dtype=np.uint64)


@pytest.fixture(scope="module")
def arena():
    """Return half a square as a corridor; the rest is walls and centre."""
    corridor = Zone(name="corridor", follows_walls=True, polygon=shapely.box(0, 0, 0.2, 0.6))
    return make_arena(name="test", outline=shapely.box(0, 0, 0.6, 0.6), zones=(corridor,))


@pytest.fixture(scope="module")
def group(arena):
    """Return three fish and a robot in it."""
    zones = tuple((zone.name, zone.follows_walls) for zone in arena.zones)
    template = natural(zones, dt_s=0.2)
    return Group(arena=arena, template=template, n_fish=3, n_robots=1, n_workers=1)


@pytest.fixture(scope="module")
def genes(group):
    """Return the group's own genome and five random ones."""
    others = np.random.default_rng(0).random((5, 18))
    return np.vstack([to_genes(group.template), others])


def window(group, genome, *, seed=9, n_steps=600):
    """Return the statistics of the fish in one simulated window."""
    counts = group.simulate(
        genome[None], n_counted=3, n_steps=n_steps, seeds=np.array([seed], dtype=np.uint64)
    )
    return as_statistics(pool_runs(counts), 0, group.arena.zone_names)


def test_a_population_is_simulated_with_every_seed(group, genes):
    """Six genomes, two runs: every agent is in a zone at every sample."""
    counts = group.simulate(genes, n_counted=4, n_steps=100, seeds=SEEDS)
    assert counts.distance.shape == (6, 2, 3, 10)
    assert (counts.occupation.sum(axis=-1) == 400).all()
    assert (counts.transition.sum(axis=(-2, -1)) == 396).all()


def test_threads_company_and_the_scale_of_gamma_do_not_change_the_counts(group, genes):
    """One or three threads; alone or among others; rows of gamma scaled or not."""
    whole = group.simulate(genes, n_counted=4, n_steps=100, seeds=SEEDS)
    same = (
        replace(group, n_workers=3).simulate(genes, n_counted=4, n_steps=100, seeds=SEEDS),
        group.simulate(scale_gamma(genes, 3), n_counted=4, n_steps=100, seeds=SEEDS),
    )
    for other in same:
        for a, b in zip(whole, other, strict=True):
            np.testing.assert_array_equal(a, b)
    alone = group.simulate(genes[4:5], n_counted=4, n_steps=100, seeds=SEEDS[1:])
    np.testing.assert_array_equal(alone.wall[0, 0], whole.wall[4, 1])


def test_the_reported_model_behaves_as_its_genome(group, genes):
    """Genes of the model file against the genome that was bred, over 2 x 400 s."""
    model = to_genes(express(genes[2], group.template))
    pair = np.vstack([genes[2], model])
    counts = group.simulate(pair, n_counted=4, n_steps=2000, seeds=SEEDS)
    control = as_statistics(pool_runs(counts), 0, group.arena.zone_names)
    objective = Objective(group=group, control=control, n_steps=2000, seeds=SEEDS)
    assert objective.scores(pair).S[0] == pytest.approx(1.0)
    assert objective.scores(pair).S[1] > 0.9


def test_genes_of_another_arena_never_reach_the_kernel(group):
    """Seventeen genes are refused by name."""
    with pytest.raises(InputError, match="need 18 genes"):
        group.simulate(np.zeros((2, 17)), n_counted=4, n_steps=10, seeds=SEEDS)


def test_a_round_on_the_real_model_beats_its_start_and_does_not_depend_on_threads(
    group, genes, small
):
    """Four generations of twenty on half an hour of the true model.

    The champion does better than nine tenths of the initial population under the
    same long simulations, and three threads give the same to the last bit.
    """
    task = Task(
        group=group,
        control=window(group, genes[0], n_steps=9000),
        seeds=SeedSource(trial_seed=1, window_end_s=1800),
    )
    settings = replace(small, steps=2000, long_s=600.0)
    found = calibrate_window(task, settings)
    threads = calibrate_window(replace(task, group=replace(group, n_workers=3)), settings)
    start = task.confirmation(settings).scores(first_population(task, settings)).S
    assert np.quantile(start, 0.9) < found.scores.S
    assert 0.9 < found.against_ceiling < 1.3
    assert threads.champion == found.champion
    assert threads.ceiling == found.ceiling


@pytest.mark.parametrize("n_counted", [4, 2])
def test_the_recorded_counts_are_those_of_the_simulation(group, genes, n_counted):
    """By the numeric sampler paths are counted once recorded: path for path the same counts."""
    sizes = {"n_counted": n_counted, "n_steps": 200, "seeds": SEEDS}
    counted = group.simulate(genes, **sizes)
    tables = group.record(genes, ("D", "W", "O", "T"), **sizes)
    for name, table in tables.items():
        np.testing.assert_array_equal(table, getattr(counted, ATTRIBUTES[name]))


@pytest.mark.slow
def test_both_samplers_have_one_law(group, genes):
    """Two hours by either are alike; where every kappa_0 is a quarter, 0.90 to 0.93 shows it.

    Six pairs of two hours by the exact sampler were between 0.949 and 0.980.
    """
    numeric = replace(group, sampler="grid")
    base, weaker = genes[:1], genes[:1].copy()
    weaker[0, [0, 3, 6]] /= 4.0

    def counts(of, genome, seed):
        seeds = np.arange(10, dtype=np.uint64) + np.uint64(seed)
        found = of.simulate(genome, n_counted=4, n_steps=3600, seeds=seeds)
        return as_statistics(pool_runs(found), 0, group.template.zone_names)

    first, across = counts(group, base, 100), counts(numeric, base, 900)
    assert compare(first, across).S > 0.94
    assert compare(first, counts(numeric, weaker, 900)).S < 0.94
    assert (first.occupation != counts(numeric, base, 100).occupation).any()

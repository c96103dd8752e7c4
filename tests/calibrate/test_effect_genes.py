"""A search among models with effects: their strengths are genes, or stay as they are."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from zfcal.artifacts.arenas import load_arena
from zfcal.behaviour.statistics import Statistics
from zfcal.calibrate.baselines import random_search, unchanged
from zfcal.calibrate.group import (
    Group,
    SeedSource,
    as_statistics,
    express,
    pool_runs,
    scale_gamma,
)
from zfcal.calibrate.rounds import calibrate_window
from zfcal.calibrate.search import first_population
from zfcal.calibrate.task import Previous, Settings, Task
from zfcal.errors import InputError
from zfcal.model.effects.genome import to_genome
from zfcal.parameters import to_genes

TRUTH = {"turning-bias": {"strength": 2.0}, "crowding": {"per_neighbour": 0.4}}
SMALL = Settings(
    population=8, generations=3, steps=60, n_confirmed=2, long_runs=1, long_s=30.0, n_windows=4
)


@pytest.fixture(scope="module")
def arena():
    """Return the default arena."""
    return load_arena("two-rooms", Path())


@pytest.fixture
def group(template, arena):
    """Return fish and a robot with two effects."""
    extended = replace(template, effects=TRUTH)
    return Group(arena=arena, template=extended, n_fish=3, n_robots=1, n_workers=2)


@pytest.fixture
def task(group):
    """Return a task whose window is that of the true model; the template turns the other way."""
    counts = group.simulate(
        to_genome(group.template)[None],
        n_counted=3,
        n_steps=600,
        seeds=np.array([1], dtype=np.uint64),
    )
    control = as_statistics(pool_runs(counts), 0, group.template.zone_names)
    start = {"turning-bias": {"strength": -1.0}, "crowding": {"per_neighbour": 0.1}}
    return Task(
        group=group.with_template(replace(group.template, effects=start)),
        control=control,
        seeds=SeedSource(trial_seed=1, window_end_s=120),
    )


def test_strengths_are_drawn_like_any_gene(task):
    """Twenty genes, all of [0, 1]; the guest is whole."""
    guest = np.full((1, 20), 0.5)
    genes = first_population(replace(task, guests=guest), SMALL)
    assert genes.shape == (8, 20)
    assert task.n_genes == 20
    assert (genes[-1] == guest).all()
    assert np.unique(genes[:, 18:]).size >= 14


def test_a_search_moves_strengths(task):
    """Genomes of the last population differ in them, and the champion has its own."""
    result = calibrate_window(task, SMALL)
    assert result.population.genes.shape == (8, 20)
    assert len(np.unique(result.population.genes[:, 18])) > 1
    assert result.genes.shape == (20,)
    own = result.champion.effects
    assert own != task.group.template.effects
    assert own == express(result.genes, task.group.template).effects
    assert own["turning-bias"]["strength"] == pytest.approx(-4.0 + 8.0 * result.genes[18])
    assert own["crowding"]["per_neighbour"] == pytest.approx(-1.0 + 2.0 * result.genes[19])


def test_intervals_of_strengths_are_in_their_own_units(task):
    """Between the bounds that a strength may have, and the champion's lies within."""
    result = calibrate_window(task, SMALL)
    by_name = {each.name: each for each in result.intervals.parameters}
    assert len(by_name) == 20
    bias, crowd = by_name["turning-bias.strength"], by_name["crowding.per_neighbour"]
    assert -4.0 <= bias.low <= bias.value <= bias.high <= 4.0
    assert -1.0 <= crowd.low <= crowd.value <= crowd.high <= 1.0
    assert bias.value == pytest.approx(result.champion.effects["turning-bias"]["strength"])


def test_where_strengths_stay_the_search_has_the_bases_genes(task):
    """An extension has fitted them itself."""
    fixed = replace(task, moves_effects=False)
    assert fixed.n_genes == 18
    result = calibrate_window(fixed, SMALL)
    assert result.population.genes.shape == (8, 18)
    assert result.champion.effects == task.group.template.effects
    assert len(result.intervals.parameters) == 18


def test_whoever_joins_a_search_has_its_genes(task):
    """A guest without strengths is none of a search that moves them, and the other way round."""
    base, whole = to_genes(task.group.template), to_genome(task.group.template)
    with pytest.raises(InputError, match="The search has 20 genes"):
        replace(task, guests=base[None])
    with pytest.raises(InputError, match="The search has 18 genes"):
        replace(task, guests=whole[None], moves_effects=False)
    with pytest.raises(InputError, match="18 genes and 2 of effects"):
        replace(task, guests=np.full((1, 19), 0.5))


def test_a_population_of_other_effects_is_refused(task):
    """Its genes would mean something else."""
    old = Previous(
        genes=np.full((8, 19), 0.5), scores=np.full(8, 0.5), champion=np.full(19, 0.5), noise=0.1
    )
    with pytest.raises(InputError, match="18 genes and 2 of effects") as error:
        replace(task, previous=old)
    assert "other effects" in error.value.hint


def test_baselines_have_the_genes_of_the_search(task):
    """Random search draws strengths as well; what stays unchanged keeps them."""
    drawn = random_search(task, SMALL, n_evaluations=8)
    assert drawn.genes.shape == (20,)
    whole = to_genome(task.group.template)
    assert (unchanged(task, SMALL, genes=whole).genes == whole).all()
    with pytest.raises(InputError, match="18 genes and 2 of effects"):
        unchanged(task, SMALL, genes=np.full(19, 0.5))


def test_scaling_gamma_leaves_strengths_alone():
    """The rows before them have a maximum of one."""
    genes = np.full(20, 0.4)
    scaled = scale_gamma(genes, 3)
    assert scaled[18:].tolist() == [0.4, 0.4]
    assert scaled[9:18].tolist() == [1.0] * 9
    assert scaled[:9].tolist() == [0.4] * 9


def test_speeds_of_a_model_with_an_effect_on_speed_are_its_own(task):
    """Measured ones hold the effect already; a strength that moves does not change the rule."""
    assert isinstance(task.control, Statistics)
    assert task.simulator.template == task.group.template
    tilted = {"turning-bias": TRUTH["turning-bias"]}
    plain = task.group.with_template(replace(task.group.template, effects=tilted))
    assert replace(task, group=plain).simulator.template.zones != plain.template.zones

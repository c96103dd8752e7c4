"""The state, the objectives and the generations."""

import json
from copy import deepcopy
from dataclasses import FrozenInstanceError, fields

import moocore
import numpy as np
import pytest

from zfcal.calibrate import evolve, evolve_deap
from zfcal.calibrate.evolve import (
    begin,
    diversities_in,
    mean_distances,
    overall_score,
    score_and_diversities,
    step,
)
from zfcal.errors import InputError

WEIGHTS = np.random.default_rng(5).random((18, 4))


def plain_features(genes):
    """Return four smooth numbers in [0, 1] of a genome."""
    return 1.0 - 0.5 * np.abs(np.sin(2.0 * genes @ WEIGHTS))


@pytest.fixture
def state():
    """Return an initial population of 20."""
    genes = np.random.default_rng(1).random((20, 18))
    return begin(genes, plain_features(genes), seed=1)


def same(a, b):
    """Return whether two states are equal bit by bit."""
    pairs = [(getattr(a, f.name), getattr(b, f.name)) for f in fields(a)]
    return all(np.array_equal(x, y, equal_nan=True) if isinstance(x, np.ndarray) else x == y
               for x, y in pairs)  # fmt: skip


def run(state, n, evaluate=plain_features):
    """Return the state n generations later."""
    for _ in range(n):
        state = step(state, evaluate)
    return state


def test_the_score_is_the_geometric_mean_of_what_is_known():
    """(1/2 1/2 1/2 1/2) is 1/2; (1/4, null, 1, null) is 1/2; nothing known is null."""
    nan = np.nan
    table = np.array([[0.5] * 4, [0.25, nan, 1.0, nan], [nan] * 4, [0.0, 1.0, 1.0, 1.0]])
    np.testing.assert_allclose(overall_score(table), [0.5, 0.5, nan, 0.0])


def test_mean_distances_by_hand():
    """A 3-4-5 triangle: (3 + 4) / 2, (3 + 5) / 2, (4 + 5) / 2."""
    triangle = np.array([[0.0, 0.0], [3.0, 0.0], [0.0, 4.0]])
    np.testing.assert_allclose(mean_distances(triangle), [3.5, 4.0, 4.5])


def test_distances_to_the_first_points_alone_by_hand():
    """Of the same triangle: 3 / 1 and 3 / 1 for the first two, (4 + 5) / 2 for the third."""
    triangle = np.array([[0.0, 0.0], [3.0, 0.0], [0.0, 4.0]])
    np.testing.assert_allclose(mean_distances(triangle, 2), [3.0, 3.0, 4.5])
    np.testing.assert_array_equal(mean_distances(triangle, 5), mean_distances(triangle))


def test_diversity_in_the_population_does_not_depend_on_other_offspring():
    """What an offspring is worth stays the same, whoever is born beside it."""
    genes = np.random.default_rng(2).random((12, 18))
    features = plain_features(genes)
    objectives = diversities_in(8)
    together, alone = objectives(genes, features), objectives(genes[:9], features[:9])
    np.testing.assert_array_equal(together[:9], alone)
    assert not np.allclose(score_and_diversities(genes, features)[:9], together[:9])


def test_mean_distances_do_not_change_by_a_shift_or_a_null_column():
    """Distances are relative; a feature that is null for all sets nobody apart."""
    points = np.random.default_rng(0).random((9, 3))
    base_line = mean_distances(points)
    np.testing.assert_allclose(mean_distances(points + 2.0), base_line)
    with_null = np.column_stack([points, np.full(9, np.nan)])
    np.testing.assert_allclose(mean_distances(with_null), base_line)


def test_a_single_point_is_at_no_distance():
    """No division by zero."""
    assert mean_distances(np.ones((1, 3))).tolist() == [0.0]


def test_objectives_are_score_genotype_and_behaviour_in_this_order():
    """Two genomes at distance 1 with features at distance 0.4."""
    genes = np.array([[0.0, 0.5], [1.0, 0.5]])
    features = np.array([[0.5, 0.5, 0.5, 0.5], [0.5, 0.5, 0.5, 0.9]])
    expected = [[0.5, 1.0, 0.4], [(0.125 * 0.9) ** 0.25, 1.0, 0.4]]
    np.testing.assert_allclose(score_and_diversities(genes, features), expected)


def test_a_null_score_counts_as_zero():
    """A population with nothing to compare still has finite objectives."""
    objectives = score_and_diversities(np.eye(4), np.full((4, 4), np.nan))
    assert (objectives[:, 0] == 0.0).all()
    assert np.isfinite(objectives).all()


def test_diversities_are_taken_over_parents_and_offspring_together(state):
    """The objectives of the survivors are those among all 40."""
    seen = []

    def evaluate(genes):
        seen.append(genes)
        return plain_features(genes)

    after = step(state, evaluate)
    genes = np.concatenate([state.genes, *seen])
    merged = score_and_diversities(genes, plain_features(genes))
    rows = [int(np.flatnonzero((genes == row).all(axis=1))[0]) for row in after.genes]
    np.testing.assert_array_equal(after.objectives, merged[rows])


def test_parents_are_not_evaluated_again(state):
    """One call a generation, for the offspring alone; survivors keep their features."""
    sizes = []

    def evaluate(genes):
        sizes.append(len(genes))
        return plain_features(genes) * 0.0

    after = step(state, evaluate)
    assert sizes == [20]
    old = [row for row, genome in enumerate(after.genes) if (state.genes == genome).all(1).any()]
    assert len(old) > 0
    for row in old:
        (before, *_) = np.flatnonzero((state.genes == after.genes[row]).all(1))
        np.testing.assert_array_equal(after.features[row], state.features[before])
        assert after.features[row].any()


def test_the_population_is_sorted_best_first(state):
    """By front, then by crowding."""
    after = run(state, 3)
    order = np.lexsort((-after.crowding, after.rank))
    assert order.tolist() == list(range(20))


def test_the_best_score_is_never_lost(state):
    """Whoever has the highest S is not dominated and stands at the end of a front."""
    best = [state.scores.max()]
    for _ in range(15):
        state = step(state, plain_features)
        best.append(state.scores.max())
    assert best == sorted(best)
    assert best[-1] > best[0]


def test_a_seed_gives_the_same_run_bit_by_bit(state):
    """And another seed another one."""
    again = begin(state.genes, state.features, seed=1)
    other = begin(state.genes, state.features, seed=2)
    assert same(run(state, 5), run(again, 5))
    assert not same(run(state, 5), run(other, 5))


def test_a_run_that_was_stopped_goes_on_as_if_it_had_not_been(state):
    """The state, its random numbers through JSON, is all there is."""
    half = run(state, 4)
    values = {f.name: getattr(half, f.name) for f in fields(half)}
    values["rng"] = json.loads(json.dumps(values["rng"]))
    assert same(run(type(half)(**values), 3), run(state, 7))


def test_a_step_leaves_the_state_as_it_was(state):
    """Neither arrays nor random numbers are changed in place."""
    before = deepcopy(state)
    run(state, 2)
    assert same(state, before)
    with pytest.raises(FrozenInstanceError):
        state.generation = 3


def test_genes_stay_within_their_bounds(state):
    """After thirty generations of crossover and mutation."""
    genes = run(state, 30).genes
    assert ((genes >= 0.0) & (genes <= 1.0)).all()


@pytest.mark.parametrize("n", [0, 2, 6, 18])
def test_a_population_that_does_not_pair_up_is_refused(n):
    """A multiple of four is asked for, with what was got."""
    with pytest.raises(InputError, match=rf"multiple of 4.*\({n}, 18\)"):
        begin(np.zeros((n, 18)), np.zeros((n, 4)), seed=1)


@pytest.mark.parametrize("bad", [-0.1, 1.1, np.nan])
def test_a_gene_out_of_bounds_is_refused(state, bad):
    """The genome is named."""
    genes = state.genes.copy()
    genes[3, 2] = bad
    with pytest.raises(InputError, match="genome 3"):
        begin(genes, state.features, seed=1)


def test_an_evaluation_of_the_wrong_length_is_refused(state):
    """A worker that lost a genome is found out."""
    with pytest.raises(InputError, match=r"\(20, feature\), got shape \(19, 4\)"):
        step(state, lambda genes: plain_features(genes)[:-1])


def test_an_evaluation_that_knows_nothing_does_no_harm(state):
    """All null: the run goes on with what it has."""
    after = step(state, lambda genes: np.full((len(genes), 4), np.nan))
    assert np.nanmax(after.scores) == state.scores.max()


def zdt1(genes):
    """Return both objectives of ZDT1 (Zitzler, Deb and Thiele 2000), negated."""
    first = genes[:, 0]
    g = 1.0 + 9.0 * genes[:, 1:].mean(axis=1)
    return -np.column_stack([first, g * (1.0 - np.sqrt(first / g))])


def dtlz2(genes):
    """Return three objectives of DTLZ2 (Deb, Thiele, Laumanns and Zitzler 2002), negated."""
    radius = 1.0 + np.square(genes[:, 2:] - 0.5).sum(axis=1)
    a, b = genes[:, 0] * np.pi / 2, genes[:, 1] * np.pi / 2
    parts = [np.cos(a) * np.cos(b), np.cos(a) * np.sin(b), np.sin(a)]
    return -radius[:, None] * np.column_stack(parts)


def itself(_, features):
    """Return the features as objectives."""
    return features


def solve(optimiser, problem, *, n, n_genes, generations):
    """Return the last population of a run from random genomes."""
    genes = np.random.default_rng(4).random((n, n_genes))
    state = optimiser.begin(genes, problem(genes), seed=4, objectives=itself)
    for _ in range(generations):
        state = optimiser.step(state, problem, itself)
    return state


def test_zdt1_is_solved():
    """The hypervolume below (1.1, 1.1) comes to within 2 % of the front's.

    The front y = 1 - sqrt(x) has 0.1 + 2/3 on [0, 1] and 0.11 beyond.
    """
    final = solve(evolve, zdt1, n=60, n_genes=18, generations=200)
    volume = moocore.hypervolume(final.features, ref=[-1.1, -1.1], maximise=True)
    assert volume > 0.98 * (0.1 + 2 / 3 + 0.11)


def test_dtlz2_is_solved():
    """All points come to the unit sphere within 10 %, and spread to its three corners."""
    final = solve(evolve, dtlz2, n=60, n_genes=8, generations=120)
    assert np.linalg.norm(final.features, axis=1).max() < 1.1
    assert (final.features.min(axis=0) < -0.97).all()
    assert (final.features.max(axis=0) > -0.05).all()


def test_zdt1_is_solved_as_well_as_by_deap():
    """At equal cost the hypervolume is DEAP's within 3 % after 100 generations."""
    volumes = [
        moocore.hypervolume(
            solve(optimiser, zdt1, n=60, n_genes=18, generations=100).features,
            ref=[-1.1, -1.1],
            maximise=True,
        )
        for optimiser in (evolve, evolve_deap)
    ]
    assert volumes[0] == pytest.approx(volumes[1], rel=0.03)


def rugged_features(genes):
    """Return features that are hard to raise together, as those of the model are."""
    ridges = np.square(genes @ (WEIGHTS - 0.5) - np.array([0.3, -0.3, 0.1, 0.2]))
    return np.exp(-4.0 * ridges) * np.exp(-np.square(genes - 0.6).sum(axis=1) / 3.0)[:, None]


@pytest.mark.slow
def test_populations_come_out_as_deaps_do():
    """Best S, median S and both mean diversities after ten generations, over 60 seeds.

    Means within five standard errors: notices 0.04 in the best S (of about 0.5), as
    when crossover is left out (the next test). Mutation moves little in ten
    generations: its law is tested by itself.
    """
    ours, theirs = (outcomes(optimiser) for optimiser in (evolve, evolve_deap))
    assert (far_apart(ours, theirs) < 5).all()


@pytest.mark.slow
def test_the_comparison_with_deap_would_notice_a_missing_crossover(monkeypatch):
    """Power: best S and both diversities come out otherwise."""
    theirs = outcomes(evolve_deap)
    monkeypatch.setattr(evolve, "crossover", lambda genes, _: genes)
    assert (far_apart(outcomes(evolve), theirs)[[0, 2, 3]] > 5).all()


def outcomes(optimiser):
    """Return best S, median S and mean diversities of 60 short runs, shape (run, 4)."""
    rows = []
    for seed in range(60):
        genes = np.random.default_rng(seed).random((20, 18))
        state = optimiser.begin(genes, rugged_features(genes), seed=seed)
        for _ in range(10):
            state = optimiser.step(state, rugged_features)
        diversities = state.objectives[:, 1:].mean(axis=0)
        rows.append([state.scores.max(), np.median(state.scores), *diversities])
    return np.array(rows)


def far_apart(ours, theirs):
    """Return the differences of means in standard errors."""
    error = np.sqrt((ours.var(axis=0) + theirs.var(axis=0)) / len(ours))
    return np.abs(ours.mean(axis=0) - theirs.mean(axis=0)) / error

"""The operators, against values by hand and against DEAP's."""

import random

import numpy as np
import pytest
from deap import base, tools
from scipy import stats

from zfcal.calibrate.nsga2 import (
    crossover,
    crowding_distances,
    dominance,
    front_ranks,
    mutate,
    survivors,
    tournament,
)
from zfcal.errors import InputError

N_DRAWS = 30_000
ALPHA = 1e-4


class Fitness(base.Fitness):
    """Three objectives to maximise."""

    weights = (1.0, 1.0, 1.0)


class Individual(list):
    """A genome as DEAP wants it."""

    def __init__(self, row, values):
        super().__init__([row])
        self.fitness = Fitness(values)


def population(objectives):
    """Return the points as DEAP's individuals."""
    return [Individual(row, tuple(values)) for row, values in enumerate(objectives)]


@pytest.fixture
def objectives():
    """Return 120 points in three objectives, some of them in later fronts."""
    return np.random.default_rng(3).random((120, 3)) ** 2


def test_the_better_in_both_dominates_and_equals_do_not():
    """(2, 2) beats (1, 2) and (1, 1); (1, 2) and (2, 1) do not beat each other."""
    points = np.array([[2.0, 2.0], [1.0, 2.0], [2.0, 1.0], [2.0, 2.0], [1.0, 1.0]])
    beats = dominance(points)
    assert beats[0].tolist() == [False, True, True, False, True]
    assert beats[1].tolist() == [False, False, False, False, True]
    assert not beats[4].any()


def test_fronts_by_hand():
    """A staircase, a point below it, and one below that."""
    points = np.array([[0.0, 3.0], [3.0, 0.0], [2.0, 2.0], [1.0, 1.0], [0.5, 0.5], [1.0, 1.0]])
    assert front_ranks(points).tolist() == [0, 0, 0, 1, 2, 1]


def test_crowding_by_hand():
    """Points at 0, 1, 4 on a falling line of length 4: (4/4 + 4/4) / 2 = 1 for the middle one."""
    points = np.array([[0.0, 4.0], [1.0, 3.0], [4.0, 0.0]])
    assert crowding_distances(points, np.zeros(3, dtype=int)).tolist() == [np.inf, 1.0, np.inf]


def test_crowding_is_counted_within_each_front_alone():
    """A second front does not lie between the points of the first."""
    first = np.array([[0.0, 4.0], [1.0, 3.0], [4.0, 0.0]])
    second = first - 0.5
    ranks = np.array([0, 0, 0, 1, 1, 1])
    crowding = crowding_distances(np.concatenate([first, second]), ranks)
    assert crowding.tolist() == [np.inf, 1.0, np.inf] * 2


def test_a_front_without_spread_has_no_crowding_but_its_ends():
    """Five equal points: no division by zero, two infinite ends, the rest 0."""
    crowding = crowding_distances(np.ones((5, 2)), np.zeros(5, dtype=int))
    assert sorted(crowding.tolist()) == [0.0, 0.0, 0.0, np.inf, np.inf]


@pytest.mark.parametrize("seed", range(5))
def test_fronts_crowding_and_survivors_are_deaps(seed):
    """120 random points in three objectives; without ties all three are unique."""
    points = np.random.default_rng(seed).random((120, 3)) ** 2
    others = population(points)
    theirs = tools.sortNondominated(others, len(others))
    for front in theirs:
        tools.emo.assignCrowdingDist(front)
    ranks = front_ranks(points)
    crowding = crowding_distances(points, ranks)
    for rank, front in enumerate(theirs):
        rows = sorted(individual[0] for individual in front)
        assert np.flatnonzero(ranks == rank).tolist() == rows
        for individual in front:
            assert crowding[individual[0]] == pytest.approx(individual.fitness.crowding_dist)
    kept = {individual[0] for individual in tools.selNSGA2(others, 60)}
    # Several ends of the last front are equally infinite; all else is decided.
    last = np.isinf(crowding) & (ranks == ranks[survivors(ranks, crowding, 60)].max())
    ours = set(survivors(ranks, crowding, 60).tolist())
    assert ours - set(np.flatnonzero(last)) == kept - set(np.flatnonzero(last))
    assert len(ours) == len(kept) == 60


def test_fronts_do_not_depend_on_the_order_of_individuals(objectives):
    """Shuffled points keep their front and their crowding."""
    order = np.random.default_rng(1).permutation(len(objectives))
    ranks = front_ranks(objectives)
    assert (front_ranks(objectives[order]) == ranks[order]).all()
    crowding = crowding_distances(objectives, ranks)
    np.testing.assert_allclose(
        crowding_distances(objectives[order], ranks[order]), crowding[order], rtol=1e-12
    )


def test_survivors_are_the_lower_fronts_and_then_the_least_crowded():
    """Two of front 0, then of front 1 the one with the larger distance; equals as given."""
    ranks = np.array([1, 0, 1, 0, 1])
    crowding = np.array([0.2, 0.5, 0.9, 0.5, 0.1])
    assert survivors(ranks, crowding, 3).tolist() == [1, 3, 2]


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_an_objective_that_is_no_number_is_refused(objectives, bad):
    """NaN would never be dominated and so would win."""
    objectives[17, 1] = bad
    with pytest.raises(InputError, match="individual 17"):
        front_ranks(objectives)


def test_everybody_competes_twice_and_the_best_wins_both():
    """In a chain of dominance the best is chosen twice, the worst never."""
    chain = np.arange(8.0)[:, None] * np.ones(2)
    for seed in range(20):
        chosen = tournament(chain, np.zeros(8), np.random.default_rng(seed)).tolist()
        assert len(chosen) == 8
        assert chosen.count(7) == 2
        assert chosen.count(0) == 0
        assert max(chosen.count(k) for k in range(8)) <= 2


def test_the_less_crowded_wins_where_none_dominates():
    """On one front, crowding decides."""
    front = np.column_stack([np.arange(8.0), -np.arange(8.0)])
    crowding = np.arange(8.0)
    chosen = tournament(front, crowding, np.random.default_rng(0)).tolist()
    assert chosen.count(7) == 2
    assert chosen.count(0) == 0


def test_tournaments_choose_as_often_as_deaps(objectives):
    """Mean number of times each is chosen, over 400 tournaments of both.

    A difference of 0.3 in any of the 120 means would be noticed (five standard errors).
    """
    crowding = crowding_distances(objectives, front_ranks(objectives))
    others = population(objectives)
    for individual, distance in zip(others, crowding, strict=True):
        individual.fitness.crowding_dist = distance
    random.seed(5)
    rng = np.random.default_rng(5)
    ours, theirs = np.zeros(120), np.zeros(120)
    for _ in range(400):
        ours += np.bincount(tournament(objectives, crowding, rng), minlength=120)
        chosen = [one[0] for one in tools.selTournamentDCD(others, 120)]
        theirs += np.bincount(chosen, minlength=120)
    assert np.abs(ours - theirs).max() / 400 < 0.3


def deap_children(first, second, eta):
    """Return DEAP's children of many equal pairs."""
    random.seed(11)
    one, other = [first] * N_DRAWS, [second] * N_DRAWS
    tools.cxSimulatedBinaryBounded(one, other, eta, 0.0, 1.0)
    return np.array(one), np.array(other)


def our_children(first, second, eta):
    """Return our children of many equal pairs that do mate."""
    parents = np.tile([[first], [second]], (N_DRAWS * 2, 1))
    children = crossover(parents, np.random.default_rng(11), eta=eta)
    return children[0::2, 0], children[1::2, 0]


def crossed(one, first, second):
    """Return the children that are no copy of a parent."""
    return one[(one != first) & (one != second)]


@pytest.mark.parametrize(("first", "second"), [(0.2, 0.7), (0.98, 0.02), (0.5, 0.501), (0.0, 0.3)])
def test_crossover_draws_from_deaps_law(first, second):
    """Kolmogorov-Smirnov on the children that were crossed, 13,000 a side at least.

    Notices eta 16 in the place of 20, as the next test shows.
    """
    for ours, theirs in zip(
        our_children(first, second, 20.0), deap_children(first, second, 20.0), strict=True
    ):
        found = stats.ks_2samp(crossed(ours, first, second), crossed(theirs, first, second))
        assert found.pvalue > ALPHA


def test_the_crossover_test_would_notice_another_eta():
    """Power: eta 16 against DEAP's 20 is found out."""
    ours, theirs = our_children(0.2, 0.7, 16.0)[0], deap_children(0.2, 0.7, 20.0)[0]
    found = stats.ks_2samp(crossed(ours, 0.2, 0.7), crossed(theirs, 0.2, 0.7))
    assert found.pvalue < ALPHA


def test_a_gene_is_crossed_in_45_of_100_pairs():
    """Probability 0.9 that a pair mates times 1/2 a gene, within five standard errors.

    Notices 0.88 or 0.92 in the place of 0.9 for pairs.
    """
    parents = np.random.default_rng(0).random((20_000, 18))
    children = crossover(parents, np.random.default_rng(1))
    moved = (children != parents)[0::2]
    assert moved.mean() == pytest.approx(0.45, abs=0.004)
    assert moved.any(axis=1).mean() == pytest.approx(0.9, abs=5 * np.sqrt(0.09 / 10_000))


def test_crossover_keeps_the_middle_of_a_pair_that_is_far_from_the_bounds():
    """Without a bound in reach, children lie mirrored about their parents' middle."""
    parents = np.tile([[0.45], [0.55]], (500, 1))
    children = crossover(parents, np.random.default_rng(2))
    np.testing.assert_allclose(children[0::2] + children[1::2], 1.0, atol=1e-9)


def test_equal_parents_have_equal_children():
    """Nothing to cross: no NaN from the empty span."""
    parents = np.full((8, 18), 0.3)
    assert (crossover(parents, np.random.default_rng(0)) == 0.3).all()


def deap_mutants(value, eta):
    """Return DEAP's mutants of many equal genes."""
    random.seed(13)
    (mutant,) = tools.mutPolynomialBounded([value] * N_DRAWS, eta, 0.0, 1.0, 1.0)
    return np.array(mutant)


def our_mutants(value, eta):
    """Return mutants of genomes of a single gene, each of which mutates."""
    return mutate(np.full((N_DRAWS, 1), value), np.random.default_rng(13), eta=eta)[:, 0]


@pytest.mark.parametrize("value", [0.0, 0.03, 0.5, 0.9, 1.0])
def test_mutation_draws_from_deaps_law(value):
    """Kolmogorov-Smirnov, 30,000 a side; notices eta 18 in the place of 20."""
    found = stats.ks_2samp(our_mutants(value, 20.0), deap_mutants(value, 20.0))
    assert found.pvalue > ALPHA


def test_the_mutation_test_would_notice_another_eta():
    """Power: eta 18 against DEAP's 20 is found out."""
    found = stats.ks_2samp(our_mutants(0.5, 18.0), deap_mutants(0.5, 20.0))
    assert found.pvalue < ALPHA


def test_one_gene_of_a_genome_mutates_on_average():
    """Probability 1 / 18 a gene, within five standard errors (notices 1/17 and 1/19)."""
    genes = np.random.default_rng(0).random((20_000, 18))
    moved = mutate(genes, np.random.default_rng(1)) != genes
    assert moved.mean() == pytest.approx(1 / 18, abs=5 * np.sqrt(1 / 18 / moved.size))


def test_mutation_is_symmetric_about_the_middle():
    """A gene at 0.1 moves as one at 0.9 does in the mirror."""
    low, high = our_mutants(0.1, 20.0), our_mutants(0.9, 20.0)
    assert stats.ks_2samp(low, 1.0 - high).pvalue > ALPHA

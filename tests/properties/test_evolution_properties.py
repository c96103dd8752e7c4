"""What holds for every population, whatever is in it."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from zfcal.calibrate.evolve import begin, score_and_diversities, step
from zfcal.calibrate.group import scale_gamma
from zfcal.calibrate.nsga2 import (
    crossover,
    crowding_distances,
    dominance,
    front_ranks,
    mutate,
    survivors,
)

unit = st.floats(0.0, 1.0, allow_subnormal=False)
coarse = st.sampled_from([0.0, 0.25, 0.5, 1.0])
points = st.integers(1, 24).flatmap(lambda n: arrays(np.float64, (n, 3), elements=coarse))
genomes = st.integers(1, 6).flatmap(lambda n: arrays(np.float64, (4 * n, 18), elements=unit))
seeds = st.integers(0, 2**63)


@given(objectives=points)
def test_fronts_are_what_their_name_says(objectives):
    """Within a front none dominates another; each of a later one is dominated from just before."""
    ranks, beats = front_ranks(objectives), dominance(objectives)
    assert set(ranks) == set(range(ranks.max() + 1))
    for rank in range(ranks.max() + 1):
        front = ranks == rank
        assert not beats[np.ix_(front, front)].any()
        if rank:
            assert beats[np.ix_(ranks == rank - 1, front)].any(axis=0).all()


@given(objectives=points)
def test_crowding_is_a_distance_and_every_front_has_its_ends(objectives):
    """Never negative, never NaN; the best and the worst of each objective are at infinity."""
    ranks = front_ranks(objectives)
    crowding = crowding_distances(objectives, ranks)
    assert (crowding >= 0).all()
    for rank in set(ranks):
        assert np.isinf(crowding[ranks == rank]).any()


@given(objectives=points, share=unit)
def test_nobody_survives_before_someone_of_a_lower_front(objectives, share):
    """Survivors are distinct and come front by front."""
    ranks = front_ranks(objectives)
    n = round(share * len(objectives))
    kept = survivors(ranks, crowding_distances(objectives, ranks), n)
    assert len(set(kept.tolist())) == n
    assert ranks[kept].tolist() == sorted(ranks)[:n]


@given(genes=genomes, seed=seeds)
def test_children_and_mutants_stay_within_the_bounds(genes, seed):
    """From parents anywhere, equal ones and ones at the bounds included; never NaN."""
    rng = np.random.default_rng(seed)
    for made in (crossover(genes, rng), mutate(genes, rng)):
        assert made.shape == genes.shape
        assert ((made >= 0.0) & (made <= 1.0)).all()


@given(genes=genomes)
def test_scaling_gamma_twice_is_scaling_it_once(genes):
    """And a common factor of a row does not matter."""
    once = scale_gamma(genes, 3)
    np.testing.assert_array_equal(scale_gamma(once, 3), once)
    assert (once[:, 9:].reshape(-1, 3, 3).max(axis=2) == 1.0).all()
    halved = genes.copy()
    halved[:, 9:12] *= 0.5
    # Halving is exact but for numbers next to nothing.
    np.testing.assert_allclose(scale_gamma(halved, 3), once, atol=1e-12)


@given(genes=genomes, seed=st.integers(0, 1000), features=st.data())
def test_a_generation_keeps_what_cannot_be_improved(genes, seed, features):
    """The best S stays, the size stays, and null features break nothing."""
    cell = st.one_of(unit, st.just(np.nan))

    def evaluate(table):
        return features.draw(arrays(np.float64, (len(table), 4), elements=cell))

    state = begin(genes, evaluate(genes), seed=seed)
    after = step(state, evaluate)
    assert len(after.genes) == len(genes)
    assert np.isfinite(after.objectives).all()
    assert after.objectives[:, 0].max() >= state.objectives[:, 0].max()
    assert score_and_diversities(after.genes, after.features).shape == (len(genes), 3)

"""What is told of each generation."""

import numpy as np
import pytest

from zfcal.calibrate.evolve import begin
from zfcal.calibrate.history import describe, hypervolume


def test_hypervolume_by_hand():
    """Boxes .5 x .5 and .25 x 1 overlap in .25 x .5: .25 + .25 - .125 = .375; times 1 x 1."""
    features = np.array([[0.5, 0.5, 1.0, 1.0], [0.25, 1.0, 1.0, 1.0]])
    assert hypervolume(features) == pytest.approx(0.375)


def test_a_dominated_individual_adds_nothing():
    """And the order of individuals does not matter."""
    features = np.array([[0.5, 0.6, 0.7, 0.8], [0.9, 0.1, 0.5, 0.5], [0.4, 0.6, 0.6, 0.8]])
    assert hypervolume(features) == pytest.approx(hypervolume(features[:2]))
    assert hypervolume(features[::-1]) == pytest.approx(hypervolume(features))


def test_a_feature_that_is_null_for_all_is_left_out():
    """Two features of 1/2: 1/4. Where it is null for one alone, that one counts for nothing."""
    nan = np.nan
    assert hypervolume(np.array([[nan, 0.5, 0.5, nan]])) == pytest.approx(0.25)
    features = np.array([[nan, 1.0, 1.0, 1.0], [0.5, 0.5, 0.5, 0.5]])
    assert hypervolume(features) == pytest.approx(1 / 16)
    assert hypervolume(np.full((3, 4), nan)) == 0.0


def test_a_population_is_described_by_its_best_and_its_volume():
    """Generation 0 of four genomes of which one is known."""
    features = np.full((4, 4), np.nan)
    features[2] = 0.5
    line = describe(begin(np.random.default_rng(0).random((4, 18)), features, seed=1))
    assert (line.generation, line.evaluations) == (0, 4)
    assert line.best_score == pytest.approx(0.5)
    assert line.hypervolume == pytest.approx(1 / 16)

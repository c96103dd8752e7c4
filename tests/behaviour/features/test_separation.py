"""Distances of pairs over the whole tank."""

import numpy as np
import pytest

from zfcal.behaviour.features.distance import STATISTICS as OF_D
from zfcal.behaviour.features.registry import SCORED, statistics
from zfcal.behaviour.features.separation import STATISTICS, edges_of


def test_bins_are_squares_to_the_diagonal_by_hand(tank):
    """Of a square of 0.4 m the last edge is 0.566 m, and the fifth a quarter of it."""
    edges = edges_of(tank)

    assert edges[[0, 5, 10]] == pytest.approx([0.0, 0.1414, 0.5657], abs=1e-4)
    assert (np.diff(np.diff(edges)) > 0).all()


def test_it_counts_the_pairs_that_d_counts():
    """The same observations in other bins, and never a part of S."""
    (own,), (d,) = STATISTICS, OF_D

    assert own.observe is d.observe
    assert own.bounded
    assert own.name in statistics()
    assert own.name not in SCORED

"""Vectors in the plane."""

import numpy as np

from zfcal.model.directions import lengths


def test_lengths_are_those_of_numpy_bit_for_bit():
    """Three and four make five; nothing is known of what is not known; any shape."""
    assert lengths(np.array([3.0, 4.0])) == 5.0
    assert np.isnan(lengths(np.array([[np.nan, 1.0]]))).all()
    ways = np.random.default_rng(1).normal(size=(5, 7, 2))
    np.testing.assert_array_equal(lengths(ways), np.linalg.norm(ways, axis=-1))

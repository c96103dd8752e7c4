"""Vectors in the plane."""

import numpy as np

from zfcal.model.directions import in_tank, lengths, of_tank, turned_by


def test_lengths_are_those_of_numpy_bit_for_bit():
    """Three and four make five; nothing is known of what is not known; any shape."""
    assert lengths(np.array([3.0, 4.0])) == 5.0
    assert np.isnan(lengths(np.array([[np.nan, 1.0]]))).all()
    ways = np.random.default_rng(1).normal(size=(5, 7, 2))
    np.testing.assert_array_equal(lengths(ways), np.linalg.norm(ways, axis=-1))


def test_directions_of_the_tank_come_back():
    """As seen, and in the tank again; with the axes where they are nothing changes."""
    rng = np.random.default_rng(2)
    x_axis, ways = (turned_by(np.tile([1.0, 0.0], (5, 1)), rng.normal(0, 2, 5)) for _ in range(2))
    seen = of_tank(x_axis, ways[:, None])
    np.testing.assert_allclose(in_tank(x_axis, seen)[:, 0], ways)
    np.testing.assert_allclose(seen[:, 0], turned_by(ways, np.arctan2(x_axis[:, 1], x_axis[:, 0])))
    np.testing.assert_array_equal(in_tank(np.tile([1.0, 0.0], (5, 1)), ways[:, None])[:, 0], ways)

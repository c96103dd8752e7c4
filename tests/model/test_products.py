"""Weights under circumstances and ways to a place, in one pass over the steps."""

import numpy as np

from zfcal.model.kernels.products import products, vector_products
from zfcal.model.kernels.ways_to import write_ways_to


def test_products_are_each_weight_times_each_circumstance():
    """Of sources that share their circumstances, of those that do not, and of vectors."""
    random = np.random.default_rng(3)
    own, vectors = random.normal(size=(7, 3, 2)), random.normal(size=(7, 2, 2))
    for by in random.normal(size=(7, 3, 4)), random.normal(size=(7, 1, 4)):
        wanted = (own[..., None] * by[..., None, :]).reshape(7, 3, 8)
        np.testing.assert_array_equal(products(own, by), wanted)
    by = random.normal(size=(7, 4))
    wanted = (vectors[:, :, None] * by[:, None, :, None]).reshape(7, 8, 2)
    np.testing.assert_array_equal(vector_products(vectors, by), wanted)


def test_ways_to_a_place_are_as_they_are_seen():
    """A tank that is seen turned to the left has them turned so; at the place there is none."""
    xy_m, spot = np.array([[0.1, 0.2], [0.4, 0.6], [0.4, 0.5]]), np.array([0.4, 0.6])
    x_axis = np.array([[1.0, 0.0], [0.0, 1.0], [0.0, 1.0]])
    toward, far_m = np.empty((3, 2)), np.empty(3)
    write_ways_to(xy_m, x_axis, spot, toward, far_m)
    np.testing.assert_allclose(toward, [[0.6, 0.8], [0.0, 0.0], [-1.0, 0.0]], atol=1e-12)
    np.testing.assert_allclose(far_m, [0.5, 0.0, 0.1])

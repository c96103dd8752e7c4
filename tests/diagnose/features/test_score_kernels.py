"""One pass over the steps gives the very numbers that numpy gives in several."""

import numpy as np
import pytest
from scipy.special import i0e

from zfcal.diagnose.features.score_kernels import (
    lengths_of,
    sums_of,
    weighed,
    write_scores,
    write_slopes,
    write_tried,
)
from zfcal.diagnose.features.waves import concentrated, series_of

N = 3000


@pytest.fixture
def random():
    """Return what draws the numbers."""
    return np.random.default_rng(5)


def test_scores_are_those_of_arrays(random):
    """Of what adds to a mixture, to the last bit."""
    at, over = random.uniform(size=(2, N, 3))
    base_at, base_over = random.uniform(0.5, 1.5, size=(2, N, 1))
    no_lapse, made = random.uniform(size=N), np.empty((N, 3))
    write_scores((at, over), (base_at, base_over), no_lapse, made)
    np.testing.assert_array_equal(made, no_lapse[:, None] * (at / base_at - over / base_over))


def test_slopes_are_those_of_arrays(random):
    """What stands beside them stays as it is."""
    at, over = random.uniform(size=(2, N, 3))
    by_top, by_whole = random.uniform(size=(2, N))
    made = np.full((N, 4), 7.0)
    write_slopes(at, over, by_top, by_whole, made)
    np.testing.assert_array_equal(made[:, :3], by_top[:, None] * at - by_whole[:, None] * over)
    assert (made[:, 3] == 7.0).all()


def test_densities_with_a_share_are_those_of_arrays(random):
    """Of one more component, the lapses as they are."""
    here, uniform, base_at, base_over, at, over = random.uniform(0.5, 1.5, size=(6, N))
    made = np.empty(N)
    write_tried(here, (base_at, base_over), (at, over), 0.02, uniform, made)
    np.testing.assert_array_equal(
        made, here * (base_at + 0.02 * at) / (base_over + 0.02 * over) + uniform
    )


@pytest.mark.parametrize("n", [1, 4])
def test_sums_and_lengths_are_those_of_numpy(random, n):
    """Of one column, which numpy adds up in another order, and of several."""
    columns = random.normal(size=(N, n))
    np.testing.assert_array_equal(sums_of(columns), columns.sum(axis=0))
    np.testing.assert_array_equal(lengths_of(columns), np.linalg.norm(columns, axis=0))


def test_sources_are_added_up_by_their_weights(random):
    """At the heading taken, and integrated."""
    columns, weights = tuple(random.normal(size=(2, N, 4))), random.normal(size=(N, 4, 3))
    for found, each in zip(weighed(columns, weights), columns, strict=True):
        np.testing.assert_allclose(found, np.einsum("sj,sjb->sb", each, weights), atol=1e-14)


@pytest.mark.parametrize("kappa", [3.0, np.linspace(1.0, 40.0, 7)])
def test_one_concentration_is_that_of_all_steps(kappa):
    """It needs one series, and gives what each step would."""
    each = np.broadcast_to(kappa, 7).copy()
    known, order, series, scale = concentrated(kappa, 7)
    wanted_order, wanted = series_of(each)
    np.testing.assert_array_equal(known, each)
    np.testing.assert_array_equal(series[order], wanted[wanted_order])
    np.testing.assert_array_equal(np.broadcast_to(scale, (7, 1))[:, 0], 1 / (2 * np.pi * i0e(each)))

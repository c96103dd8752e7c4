"""Ten bins, and how alike two histograms are."""

import numpy as np
import pytest

from zfcal.behaviour.histograms import bin_edges, bin_of, frequencies, similarity
from zfcal.errors import InputError


def test_bins_are_half_open_and_the_last_is_closed():
    """On [0, 10]: an edge belongs to the bin above it, 10 and beyond to the last."""
    values = [0.0, 0.999, 1.0, 8.999, 9.0, 10.0, 10.001, 1e9]

    assert bin_of(values, bin_edges((0, 10))).tolist() == [0, 0, 1, 8, 9, 9, 9, 9]


def test_what_lies_below_the_first_edge_is_in_the_first_bin():
    """On [5, 15] the bins begin at 5; 4.9 and 0 are in the first."""
    assert bin_of([0.0, 4.9, 5.0, 5.9, 6.0, 15.0], bin_edges((5, 15))).tolist() == [
        0,
        0,
        0,
        0,
        1,
        9,
    ]


def test_an_edge_of_a_decimal_range_is_in_the_bin_above():
    """0.02, 0.04, ... 0.18 m/s, of which none is an exact number, open bins 1 to 9."""
    assert bin_of(bin_edges((0, 0.2))[1:-1], bin_edges((0, 0.2))).tolist() == list(range(1, 10))


def test_frequencies_sum_to_one_or_are_unknown():
    """1, 3 is 1/4, 3/4; a histogram without a count has no frequencies."""
    shares = frequencies([[1, 3], [0, 0]])

    assert shares[0].tolist() == [0.25, 0.75]
    assert np.isnan(shares[1]).all()


def test_similarity_by_hand():
    """With (1/2, 1/2) and (1, 0) the overlap is sqrt(1/2), H = sqrt(1 - sqrt(1/2)) = 0.541196."""
    assert similarity([5, 5], [3, 0]) == pytest.approx(1 - 0.5411961, abs=1e-7)


def test_similarity_is_one_for_proportional_and_zero_for_disjoint_counts():
    """Counts are scaled to frequencies first."""
    assert similarity([1, 2, 3], [7, 14, 21]) == pytest.approx(1.0, abs=1e-7)
    assert similarity([1, 2, 3], [1, 2, 3]) == 1.0
    assert similarity([1, 2, 0], [0, 0, 5]) == pytest.approx(0.0, abs=1e-7)


def test_an_empty_side_scores_zero_and_two_empty_sides_have_no_score():
    """Nothing is like something: 0. Nothing is like nothing: no number."""
    alike = similarity([[0, 0], [1, 1], [0, 0]], [[1, 1], [0, 0], [0, 0]])

    assert alike[:2].tolist() == [0.0, 0.0]
    assert np.isnan(alike[2])


def test_histograms_of_different_bins_are_refused():
    """Ten bins and nine cannot be compared."""
    with pytest.raises(InputError, match="differ in bins: 10 and 9"):
        similarity(np.ones(10), np.ones(9))

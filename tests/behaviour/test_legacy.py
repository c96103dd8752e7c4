"""The authors' published score, by hand."""

import math

import numpy as np
import pytest

from zfcal.behaviour.legacy import (
    EXTENT_M,
    LegacyStatistics,
    compare_legacy,
    measure_legacy,
)
from zfcal.errors import InputError


@pytest.fixture
def window_a(samples_of):
    """Three fish, three samples; see `test_mean_distances_by_hand`."""
    return samples_of(
        [
            [(0.05, 0.10), (0.08, 0.10), (0.19, 0.10)],
            [(0.05, 0.10), (0.15, 0.10), (0.30, 0.10)],
            [(0.05, 0.02), (0.05, 0.38), (0.30, 0.10)],
        ]
    )


@pytest.fixture
def window_b(samples_of):
    """Two fish that stay, 0.10 apart, for two samples."""
    return samples_of([[(0.05, 0.10), (0.15, 0.10)]] * 2)


def test_mean_distances_by_hand(tank, window_a):
    """With an extent of 0.4 m the bins are 0.01 m wide and end at 0.1 m.

    k = 0: three left, 0.03, 0.11 and 0.14 apart, over 6 pairs with self-pairs:
    0.28 / 6 = 0.0467, bin 4. k = 1: two left, 0.10 / 3 = 0.0333, bin 3, and one
    alone, which gives nothing. k = 2: 0.36 / 3 = 0.12, beyond, in no bin but
    in the total of three.
    """
    counts = measure_legacy(window_a, tank, extent_m=0.4)

    assert counts.distance.tolist() == [[0, 0, 0, 1, 1, 0, 0, 0, 0, 0], [0] * 10]
    assert counts.n_distance.tolist() == [3, 0]
    assert counts.occupation.tolist() == [7, 2]
    assert counts.transition.tolist() == [[4, 1], [0, 1]]


def test_a_whole_legacy_score_by_hand(tank, window_a, window_b):
    """Window A against window B, whose fish are 0.10 apart twice (bin 3).

    D left: p = (1/3, 1/3) in bins 3 and 4 (1/3 is beyond), q = (1, 0):
    H^2 = ((0.577350 - 1)^2 + 1/3) / 2 = 0.255983, H = 0.505948,
    (1 - H)^2 = 0.244087; nobody meets right, so this is D.
    O: p = (7/9, 2/9), q = (1, 0): H^2 = 1 - sqrt(7/9) = 0.118083, H = 0.343632,
    (1 - H)^2 = 0.430819.
    T: p = (0.8, 0.2, 0, 1), q = (1, 0, 0, 0), not scaled:
    H^2 = ((0.894427 - 1)^2 + 0.2 + 1) / 2 = 0.605573, H = 0.778186,
    (1 - H)^2 = 0.049202.
    S = (0.244087 * 0.430819 * 0.049202)^(1/3) = 0.172958.
    """
    a, b = (measure_legacy(window, tank, extent_m=0.4) for window in (window_a, window_b))

    scores = compare_legacy(a, b)

    assert pytest.approx((0.244087, math.nan), abs=1e-6, nan_ok=True) == scores.D
    assert pytest.approx(0.244087, abs=1e-6) == scores.I_D
    assert pytest.approx(0.430819, abs=1e-6) == scores.I_O
    assert pytest.approx(0.049202, abs=1e-6) == scores.I_T
    assert pytest.approx(0.172958, abs=1e-6) == scores.S
    assert scores.n_features == 3
    assert math.isnan(scores.I_W)
    assert all(math.isnan(value) for value in (*scores.W, *scores.T))


def test_the_order_of_the_windows_does_not_matter(tank, window_a, window_b):
    """The distance is symmetric."""
    a, b = (measure_legacy(window, tank, extent_m=0.4) for window in (window_a, window_b))

    assert compare_legacy(a, b).values == pytest.approx(
        compare_legacy(b, a).values, abs=0, nan_ok=True
    )


def test_a_window_is_like_itself(tank, wander):
    """1 in every feature."""
    counts = measure_legacy(wander(1), tank)

    scores = compare_legacy(counts, counts)

    assert (scores.S, scores.I_D, scores.I_O, scores.I_T) == (1.0, 1.0, 1.0, 1.0)


def test_the_extent_is_that_of_the_authors_unless_given(tank, samples_of):
    """0.89 m: bins of 0.02225 m. Two fish 0.36 m apart, mean 0.12, are in bin 5."""
    counts = measure_legacy(samples_of([[(0.1, 0.02), (0.1, 0.38)]]), tank)

    assert EXTENT_M == 0.89
    assert counts.distance[0].tolist() == [0, 0, 0, 0, 0, 1, 0, 0, 0, 0]


def test_a_mean_at_the_end_of_the_range_is_still_in_it(tank, samples_of):
    """0.3 / 3 = 0.1 of a range to 0.1: the last bin is closed."""
    counts = measure_legacy(samples_of([[(0.1, 0.0625), (0.1, 0.25)]]), tank, extent_m=0.25)

    assert counts.distance[0].tolist() == [0] * 9 + [1]


def test_the_vectorised_means_are_the_slow_ones(tank, wander):
    """Every sample and zone one by one, with agents lost and outside."""
    samples = wander(2, n_samples=80, n_agents=6)
    expected, total = np.zeros((2, 10), int), np.zeros(2, int)
    xy_m = tank.settle(samples.xy_m)[0]
    zone = tank.zone_of(xy_m)
    for k in range(80):
        for z in (1, 2):
            group = [xy_m[k, i] for i in range(6) if zone[k, i] == z]
            if len(group) < 2:
                continue
            pairs = [math.dist(group[i], group[j]) for i in range(len(group)) for j in range(i + 1)]
            mean_m = sum(pairs) / len(pairs)
            total[z - 1] += 1
            if mean_m < 0.05:
                expected[z - 1, int(mean_m / 0.05 * 10)] += 1

    counts = measure_legacy(samples, tank, extent_m=0.2)

    assert np.array_equal(counts.distance, expected)
    assert np.array_equal(counts.n_distance, total)
    assert 0 < expected.sum() < total.sum()


def legacy(n_zones=2, **given):
    """Return statistics that are 0 but for what is given."""
    parts = {
        "distance": np.zeros((n_zones, 10), dtype=np.int64),
        "n_distance": np.zeros(n_zones, dtype=np.int64),
        "occupation": np.zeros(n_zones, dtype=np.int64),
        "transition": np.zeros((n_zones, n_zones), dtype=np.int64),
    }
    parts |= {name: np.asarray(value, dtype=np.int64) for name, value in given.items()}
    return LegacyStatistics(zone_names=tuple("abcdefgh"[:n_zones]), **parts)


def test_a_feature_that_neither_side_has_is_left_out():
    """Only O is there on both sides: S is O's."""
    a, b = legacy(occupation=[3, 1]), legacy(occupation=[4, 0])

    scores = compare_legacy(a, b)

    assert scores.n_features == 1
    assert pytest.approx(scores.I_O) == scores.S
    assert math.isnan(scores.I_D)
    assert math.isnan(scores.I_T)


def test_a_zone_where_one_side_alone_meets_scores_zero():
    """Also when all its distances lie beyond the bins."""
    a = legacy(n_distance=[5, 0], occupation=[1, 1])
    b = legacy(occupation=[1, 1])

    assert pytest.approx((0.0, math.nan), nan_ok=True) == compare_legacy(a, b).D


def test_distances_all_beyond_are_an_empty_vector_as_in_the_scripts():
    """H^2 of (0, ...) and (1, 0, ...) is 1/2: (1 - sqrt(1/2))^2 = 0.085786."""
    a = legacy(n_distance=[5, 0])
    b = legacy(n_distance=[5, 0], distance=[[5] + [0] * 9, [0] * 10])

    assert pytest.approx(0.085786, abs=1e-6) == compare_legacy(a, b).I_D


def test_unscaled_transitions_never_score_above_one():
    """Eight zones that nobody leaves against eight that everybody does: H = sqrt(8), cut at 1."""
    a = legacy(8, transition=np.eye(8))
    b = legacy(8, transition=np.roll(np.eye(8), 1, axis=1))

    assert compare_legacy(a, b).I_T == 1.0


def test_windows_of_other_zones_and_a_wrong_extent_are_refused(tank, window_a):
    """Zones go by name; an extent is a length."""
    with pytest.raises(InputError, match="different zones"):
        compare_legacy(legacy(2), legacy(3))
    for extent_m in (0.0, float("nan"), float("inf")):
        with pytest.raises(InputError, match="positive length"):
            measure_legacy(window_a, tank, extent_m=extent_m)

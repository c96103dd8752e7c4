"""How alike two groups are, by hand and beside a slow twin."""

import math
import time
from typing import NamedTuple

import numpy as np
import pytest

from zfcal.behaviour.scores import (
    FeatureScores,
    Scores,
    compare,
    from_zones,
    population_scores,
    score_keys,
)
from zfcal.behaviour.statistics import Statistics, measure
from zfcal.errors import InputError

NAN = float("nan")


class Many(NamedTuple):
    """Counts of many candidates."""

    distance: np.ndarray
    wall: np.ndarray
    occupation: np.ndarray
    transition: np.ndarray


def random_counts(rng, leading=(), *, n_zones=3, empty=0.3):
    """Return counts, some of whose histograms are empty."""

    def part(*shape):
        counts = rng.integers(0, 50, (*leading, *shape))
        gone = rng.random((*leading, *shape[:-1], 1)) < empty
        return np.where(gone, 0, counts).astype(np.int64)

    return Many(
        distance=part(n_zones, 10),
        wall=part(n_zones, 10),
        occupation=part(n_zones),
        transition=part(n_zones, n_zones),
    )


def statistics(counts, zone_names=("a", "b", "c")):
    """Return one candidate's counts as statistics."""
    n = len(zone_names)
    return Statistics(
        zone_names=zone_names, speed=np.zeros((n, 10), dtype=np.int64), **counts._asdict()
    )


def test_a_whole_score_by_hand(tank, samples_of):
    """Two fish for two samples, in each of two windows.

    Window A: fish 0 stays left, (0.10, 0.10) to (0.10, 0.14); fish 1 goes from
    left to right, (0.10, 0.20) to (0.30, 0.20). Window B: both stay left,
    (0.10, 0.10) to (0.10, 0.12) and (0.10, 0.20) to (0.10, 0.30).

    D left: A has 0.10 (bin 4) once; B has 0.10 (bin 4) and 0.18 (bin 8). With
    p = (1, 0), q = (1/2, 1/2) the overlap sum sqrt(p q) is sqrt(1/2) = 0.707107,
    H = sqrt(1 - 0.707107) = 0.541196, I = 0.458804. D right: no pair in either,
    left out. I_D = 0.458804.

    W left: every fish is 0.10 from a wall (bin 5) in both: 1. W right: A alone
    has a count: 0. I_W = (1 + 0) / 2 = 0.5.

    O: A (3/4, 1/4), B (1, 0): overlap sqrt(3/4) = 0.866025, H = 0.366025,
    I_O = 0.633975.

    T left: A (1/2, 1/2), B (1, 0): 0.458804 as above. T right: nobody leaves
    from there, left out. I_T = 0.458804.

    S = (0.458804 * 0.5 * 0.633975 * 0.458804)^(1/4) = 0.0667262^(1/4) = 0.508246.
    """
    a = measure(samples_of([[(0.10, 0.10), (0.10, 0.20)], [(0.10, 0.14), (0.30, 0.20)]]), tank)
    b = measure(samples_of([[(0.10, 0.10), (0.10, 0.20)], [(0.10, 0.12), (0.10, 0.30)]]), tank)

    scores = compare(a, b)

    assert scores.zone_names == ("left", "right")
    assert pytest.approx((0.458804, NAN), abs=1e-6, nan_ok=True) == scores.D
    assert pytest.approx((1.0, 0.0), abs=1e-6) == scores.W
    assert pytest.approx((0.458804, NAN), abs=1e-6, nan_ok=True) == scores.T
    assert pytest.approx(0.458804, abs=1e-6) == scores.I_D
    assert pytest.approx(0.5) == scores.I_W
    assert pytest.approx(0.633975, abs=1e-6) == scores.I_O
    assert pytest.approx(0.458804, abs=1e-6) == scores.I_T
    assert pytest.approx(0.508246, abs=1e-6) == scores.S
    assert scores.n_features == 4


def test_the_mean_is_over_the_zones_that_have_a_score():
    """0.2 and 0.6 with one zone left out: 0.4, not 0.267."""
    scores = from_zones(
        D=np.array([[0.2, NAN, 0.6]]),
        W=np.array([[0.4, 0.4, 0.4]]),
        O=np.array([0.4]),
        T=np.array([[0.4, NAN, NAN]]),
    )

    assert scores.I_D[0] == pytest.approx(0.4)
    assert scores.S[0] == pytest.approx(0.4)
    assert scores.n_features.tolist() == [4]


def test_a_feature_without_any_zone_is_null_and_left_out_of_the_mean():
    """Two agents that never meet: S = (0.25 * 0.5 * 0.125)^(1/3) = 0.25 of three features."""
    scores = from_zones(
        D=np.array([[NAN, NAN]]),
        W=np.array([[0.25, NAN]]),
        O=np.array([0.5]),
        T=np.array([[0.125, 0.125]]),
    )

    assert math.isnan(scores.I_D[0])
    assert scores.S[0] == pytest.approx(0.25)
    assert scores.n_features.tolist() == [3]


def test_nothing_on_both_sides_has_no_score():
    """All features are null, and so is S; no warning is given."""
    empty = random_counts(np.random.default_rng(0), empty=1.1)

    scores = compare(statistics(empty), statistics(empty))

    assert all(math.isnan(value) for value in scores.values)
    assert scores.n_features == 0


def test_nothing_on_one_side_scores_zero():
    """A candidate that never moved or met anybody is not excused."""
    rng = np.random.default_rng(1)
    empty, full = random_counts(rng, empty=1.1), random_counts(rng, empty=0.0)

    scores = compare(statistics(empty), statistics(full))

    assert set(scores.values) == {0.0}
    assert scores.n_features == 4


def test_one_feature_of_zero_makes_the_whole_zero():
    """The mean is geometric: 0, 1, 1, 1 gives 0."""
    one = np.array([[1.0]])

    assert from_zones(D=one * 0, W=one, O=one[0], T=one).S.tolist() == [0.0]


def slow_scores(a, b):
    """Score as the definition says, one bin at a time; return D, W, T, the four I and S."""

    def alike(p, q):
        if sum(p) == 0 and sum(q) == 0:
            return NAN
        if sum(p) == 0 or sum(q) == 0:
            return 0.0
        squares = 0.0
        for x, y in zip(p, q, strict=True):
            squares += (math.sqrt(x / sum(p)) - math.sqrt(y / sum(q))) ** 2
        return 1 - math.sqrt(squares) / math.sqrt(2)

    def mean(values):
        known = [value for value in values if not math.isnan(value)]
        return sum(known) / len(known) if known else NAN

    zones = {
        feature: [
            alike(p, q)
            for p, q in zip(getattr(a, name).tolist(), getattr(b, name).tolist(), strict=True)
        ]
        for feature, name in (("D", "distance"), ("W", "wall"), ("T", "transition"))
    }
    means = {feature: mean(values) for feature, values in zones.items()}
    means["O"] = alike(a.occupation.tolist(), b.occupation.tolist())
    known = [value for value in means.values() if not math.isnan(value)]
    S = math.prod(known) ** (1 / len(known)) if known else NAN
    return Scores(
        zone_names=("a", "b", "c"),
        **zones,
        **{f"I_{feature}": value for feature, value in means.items()},
        S=S,
        n_features=len(known),
    )


def test_a_population_is_scored_as_its_candidates_one_by_one_and_as_the_slow_twin():
    """A hundred candidates, many with empty zones and features, in one call and in three ways."""
    rng = np.random.default_rng(7)
    population = random_counts(rng, (100,), empty=0.4)
    # Nobody met in the control group: a candidate without pairs has no score for D.
    control = random_counts(rng, empty=0.3)._replace(distance=np.zeros((3, 10), dtype=np.int64))

    together = population_scores(population, control).each(("a", "b", "c"))

    null_features = 0
    for at, scores in enumerate(together):
        one = Many(*(part[at] for part in population))
        alone = compare(statistics(one), statistics(control))
        slow = slow_scores(one, control)
        assert scores.values == pytest.approx(alone.values, abs=0, nan_ok=True)
        assert scores.values == pytest.approx(slow.values, abs=1e-7, nan_ok=True)
        assert scores.n_features == alone.n_features == slow.n_features
        null_features += scores.n_features < 4
    assert 0 < null_features < 100


def test_each_candidate_can_have_its_own_control():
    """With a leading axis on both sides, candidate i is scored against control i."""
    rng = np.random.default_rng(8)
    a, b = random_counts(rng, (5,)), random_counts(rng, (5,))

    together = population_scores(a, b)

    for at in range(5):
        alone = compare(*(statistics(Many(*(part[at] for part in side))) for side in (a, b)))
        assert together.S[at] == pytest.approx(alone.S, abs=0)


def test_the_feature_vectors_are_those_of_the_diversity_objective():
    """(I_D, I_W, I_O, I_T), a row per candidate."""
    scores = population_scores(
        random_counts(np.random.default_rng(9), (6,)), random_counts(np.random.default_rng(10))
    )

    assert scores.features.shape == (6, 4)
    assert np.array_equal(scores.features[:, 2], scores.I_O)
    assert isinstance(scores, FeatureScores)


def test_scores_come_zone_by_zone_then_as_mean():
    """The order of the table: D, W, T by zone and mean, then O and S."""
    keys = score_keys(("left", "right"))

    assert keys[:3] == (("D", "left"), ("D", "right"), ("D", None))
    assert keys[-2:] == (("O", None), ("S", None))
    assert len(keys) == 11


def test_a_population_of_sixty_takes_about_a_fifth_of_a_millisecond():
    """It runs in every generation; the limit here is ten times what is measured."""
    rng = np.random.default_rng(11)
    population, control = random_counts(rng, (60,)), random_counts(rng)
    taken = []
    for _ in range(30):
        start = time.perf_counter()
        population_scores(population, control)
        taken.append(time.perf_counter() - start)

    assert min(taken) < 2e-3


def test_counts_of_other_zones_are_refused():
    """Two zones against three, and three of other names."""
    rng = np.random.default_rng(12)
    two, three = random_counts(rng, (4,), n_zones=2), random_counts(rng)

    with pytest.raises(InputError, match="differ in zones or bins"):
        population_scores(two, three)
    with pytest.raises(InputError, match="different zones"):
        compare(statistics(three), statistics(three, zone_names=("a", "b", "x")))


def test_scores_of_a_wrong_length_are_refused():
    """Two zones need two D."""
    with pytest.raises(InputError, match="as many D"):
        Scores(
            zone_names=("a", "b"), D=(1.0,), W=(1.0, 1.0), T=(1.0, 1.0),
            I_D=1.0, I_W=1.0, I_O=1.0, I_T=1.0, S=1.0, n_features=4,
        )  # fmt: skip

"""Whether model and data disagree at all: quiet on the model, loud on what nobody listed."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.stats import chi2, kstest, norm

from zfcal.diagnose.chances import by_context, normal_of, rare_by_context
from zfcal.diagnose.kernels import cell_ranks, product_sums, rare_headings
from zfcal.diagnose.omnibus import judge, statistics
from zfcal.diagnose.ranks import heading_ranks, scores_of, speed_ranks
from zfcal.diagnose.standing import standing_of
from zfcal.diagnose.surroundings import probabilities, signed_angle, surroundings
from zfcal.model.scene import Moves

CELLS = 64


def test_ranks_by_hand():
    """Probabilities of 1/4 at four headings: turned to the left by 90 degrees, counted from
    -180, there are those behind, right and ahead before it; its size comes second.
    """
    probability = np.zeros((1, CELLS))
    probability[0, ::16] = 0.25
    taken, ahead, lot = np.array([[0.0, 1.0]]), np.array([[1.0, 0.0]]), np.array([0.5])
    ranks = np.empty(1)

    cell_ranks(probability, taken, ahead, False, lot, ranks)
    assert ranks[0] == pytest.approx(0.75 + 0.125)
    # Left and right mirror each other: one atom of 1/2 after the 1/4 ahead.
    cell_ranks(probability, taken, ahead, True, lot, ranks)
    assert ranks[0] == pytest.approx(0.25 + 0.25)


def test_ranks_of_the_model_are_uniform_in_every_order(base):
    """Kolmogorov and Smirnov on 12,000 turns, seven orders: all p above 0.001.

    A shift of all ranks by 0.02 would be noticed with probability 0.9.
    """
    scene, fitted = base
    about = surroundings(scene, scene.turns)
    found = heading_ranks(scene.turns, about, probabilities(fitted), np.random.default_rng(1))

    assert len(found) == 7
    for ranks in found.values():
        assert kstest(ranks[~np.isnan(ranks)], "uniform").pvalue > 0.001


def test_scores_have_mean_zero_and_variance_one():
    """Over a fine grid of ranks both polynomials have moments 0 and 1, and do not correlate."""
    scores = scores_of((np.arange(10_000) + 0.5) / 10_000)

    assert scores.mean(axis=0) == pytest.approx([0, 0], abs=1e-6)
    assert scores.T @ scores / 10_000 == pytest.approx(np.eye(2), abs=1e-6)


def test_speeds_are_ranked_within_their_zone():
    """Speeds 1, 2 in one zone and 5, 4 in another: ranks 1/4, 3/4, 3/4, 1/4."""
    zeros = np.zeros(4, dtype=np.int64)
    moves = Moves(
        at=zeros, who=zeros, track=zeros.astype(np.int32),
        zone=np.array([1, 1, 2, 2]), speed_m_s=np.array([1.0, 2.0, 5.0, 4.0]),
    )  # fmt: skip

    ranks = speed_ranks(moves, np.ones(4), np.random.default_rng(2))

    assert ranks.tolist() == [0.25, 0.75, 0.75, 0.25]


@pytest.mark.parametrize(("value", "df"), [(3.84, 1), (40.0, 20), (900.0, 10)])
def test_a_chi_square_keeps_its_tail(value, df):
    """The normal number has the same probability above it."""
    z = normal_of(value, df)

    assert norm.logsf(z) == pytest.approx(chi2.logsf(value, df), rel=1e-6)


@pytest.mark.parametrize("df", [1, 4, 60, 900])
def test_a_chi_square_beyond_all_numbers_has_the_tail_that_goes_on(df):
    """On both sides of a tail of 1e-290 the steps are alike: it grows as the root of the value."""
    edge = brentq(lambda value: chi2.logsf(value, df) + 290 * math.log(10), df, df + 3_000)
    z = [normal_of(edge + by, df) for by in np.linspace(-3, 3, 8)]
    steps = np.diff(z)

    assert (steps > 0).all()
    assert steps == pytest.approx(np.full(7, steps[0]), rel=0.02)
    assert z[0] == pytest.approx(36.4, abs=0.1)


def test_a_chi_square_without_freedom_is_no_number():
    """And one that leaves nothing over is not less than three standard deviations below."""
    assert math.isnan(normal_of(1.0, 0))
    assert normal_of(0.0, 4) == pytest.approx(-3.0902, abs=1e-4)
    assert normal_of(1e6, 4) == pytest.approx(1e3, rel=1e-3)


def test_a_context_by_hand():
    """Two bins of 25 steps of value 1 and -1: each contributes 25^2 / 25, chi-square 50."""
    values = np.repeat([[1.0], [-1.0]], 25, axis=0)
    bins = np.repeat([0, 1], 25)

    assert by_context(values, bins) == pytest.approx(normal_of(50.0, 2))
    assert math.isnan(by_context(values, np.full(50, -1)))
    # A third bin of ten steps is too small to count.
    more = np.concatenate([values, np.ones((10, 1))])
    assert by_context(more, np.repeat([0, 1, 2], [25, 25, 10])) == pytest.approx(normal_of(50.0, 2))


def test_one_rare_heading_does_not_decide():
    """A residual of 30 among variances of 1 / 40 each is not worth its 30 / sqrt(1)."""
    residual, variance = np.zeros((40, 1)), np.full((40, 1), 1 / 40)
    residual[0] = 30.0
    bins = np.zeros(40, dtype=np.int64)

    assert rare_by_context(residual, variance, bins, 33.0)[0] < 1.7
    assert rare_by_context(residual, variance, bins, 0.0)[0] > 20


def test_rare_headings_have_mean_zero_under_the_model(base):
    """Summed over all turns the score of a component is within four standard errors of zero."""
    scene, fitted = base
    axis = np.ascontiguousarray(surroundings(scene, scene.turns).toward_near[:, None])
    residual, variance = np.empty((len(axis), 2)), np.empty((len(axis), 2))

    rare_headings(probabilities(fitted), scene.turns.taken, axis, 0.03, residual, variance)

    assert (variance >= -1e-12).all()
    assert (abs(residual.sum(axis=0)) < 4 * np.sqrt(variance.sum(axis=0))).all()


def test_rare_headings_by_hand():
    """At equal chances half of the cells count for a direction, and the others against it."""
    probability, taken = np.full((1, 64), 1 / 64), np.array([[-1.0, 0.0]])
    residual, variance = np.empty((1, 2)), np.empty((1, 2))

    rare_headings(probability, taken, np.array([[[1.0, 0.0]]]), 0.0, residual, variance)

    # Means of cos^6 and cos^12 over the circle are 5/16 and 231/1024; half of them each.
    assert residual[0] == pytest.approx([-5 / 32, 1 - 5 / 32])
    assert variance[0] == pytest.approx([231 / 2048 - 25 / 1024] * 2)


def omnibus(scene, fitted):
    """Return whether a scene differs from a model at all, by the model's own law."""
    return judge(statistics(standing_of(scene, fitted), np.random.default_rng(0)))


@pytest.mark.slow
def test_nothing_is_said_of_the_base_model(worlds):
    """Six recordings of five minutes: none below p = 0.02, and the mean statistic is about 0."""
    for seed in range(40, 46):
        found = omnibus(*worlds.fitted_scene(worlds.base_walk(seed)))
        assert found.p > 0.02
        assert len(found.statistics) > 300
        assert -0.6 < np.mean(list(found.statistics.values())) < 0.4


def test_a_sound_at_fixed_times_is_noticed(base, worlds):
    """In three seconds of each minute headings away from a corner weigh up to e times more."""
    scene, fitted = base
    loud = scene.time_s(scene.turns) % 60 < 3

    def away(angle):
        return np.exp(loud[:, None] * np.cos(angle + math.pi / 4)[None])

    wrong = worlds.redrawn(scene, fitted, np.random.default_rng(6), away)

    found = omnibus(wrong, fitted)

    assert found.p < 1e-3
    assert any("pulses" in name for name, z in found.statistics.items() if z > 4)


def test_wall_following_that_waxes_and_wanes_is_noticed(base, worlds):
    """Along walls the present sense weighs more and less by a sine of four minutes."""
    scene, fitted = base
    about = surroundings(scene, scene.turns)
    wave = about.follows * np.sin(2 * np.pi * about.time_s / 240)
    way = np.arctan2(about.along_wall[:, 1], about.along_wall[:, 0])

    def along(angle):
        return np.exp(0.5 * wave[:, None] * np.cos(angle[None] - way[:, None]))

    wrong = worlds.redrawn(scene, fitted, np.random.default_rng(7), along)

    found = omnibus(wrong, fitted)

    assert found.p < 1e-3
    assert "minute" in found.worst


def test_a_preferred_distance_is_noticed(base, worlds):
    """Neighbours within 6 cm repel: headings toward them weigh less by half at the most."""
    scene, fitted = base
    about = surroundings(scene, scene.turns)
    way = np.arctan2(about.toward_near[:, 1], about.toward_near[:, 0])

    def apart(angle):
        return np.exp(-0.35 * (about.near_m < 0.06)[:, None] * np.cos(angle[None] - way[:, None]))

    wrong = worlds.redrawn(scene, fitted, np.random.default_rng(8), apart)

    found = omnibus(wrong, fitted)

    assert found.p < 1e-3
    assert "nearest neighbour" in found.worst


def test_a_startle_that_spreads_is_noticed(base):
    """Every 15 s one fish darts for three steps, and its nearest neighbour with it."""
    scene, fitted = base
    moves, rng = scene.moves, np.random.default_rng(9)
    near = surroundings(scene, moves).near
    speed = moves.speed_m_s.copy()
    for start in range(20, len(scene.k) - 4, 75):
        who = rng.integers(5)
        here = np.flatnonzero((moves.at == start) & (moves.who == who))
        others = near[here]
        for one in (who, *others):
            rows = (moves.who == one) & (moves.at >= start) & (moves.at < start + 3)
            speed[rows] = rng.uniform(0.16, 0.2, rows.sum())
    wrong = dataclasses.replace(scene, moves=dataclasses.replace(moves, speed_m_s=speed))

    found = omnibus(wrong, fitted)

    assert found.p < 1e-3
    assert "speed" in found.worst or "fast" in found.worst


def test_what_every_replicate_shows_is_no_disagreement():
    """A statistic of 9 that is 9 +- 1 under noise counts for nothing; one of 8 that is 0 does."""
    rng = np.random.default_rng(10)
    nulls = [{"noisy": rng.normal(9, 1), "quiet": rng.normal(0, 1)} for _ in range(39)]

    assert judge({"noisy": 9.0, "quiet": 0.5}, nulls).p > 0.2
    found = judge({"noisy": 9.0, "quiet": 8.0}, nulls)
    assert found.worst == "quiet"
    assert found.p < 1e-6


def test_the_largest_of_all_counts_once_for_each():
    """Of three statistics 2.0 is the largest: p = 3 * 0.02275."""
    found = judge({"a": 2.0, "b": 0.0, "c": -1.0})

    assert found.p == pytest.approx(3 * 0.0227501, rel=1e-5)
    assert (found.worst, found.z) == ("a", 2.0)


def test_sharp_positions_have_the_theory_beside_few_replicates():
    """Five standard deviations stand out of four hundred statistics then; where the theory counts
    for ten replicates beside twenty they do not. What replicates show counts all the same.
    """
    rng = np.random.default_rng(13)
    names = [f"turn by context {n}" for n in range(400)]
    nulls = [dict(zip(names, rng.normal(size=400), strict=True)) for _ in range(20)]
    measured = {**dict.fromkeys(names, 0.0), names[7]: 5.2}

    assert judge(measured, nulls).p > 1e-3
    assert judge(measured, nulls, sharp=True).p < 1e-3
    wide = [{name: 3 * z for name, z in null.items()} for null in nulls]
    assert judge(measured, wide, sharp=True).p > 1e-3


def test_no_statistics_no_disagreement():
    """An empty table: p is 1."""
    assert judge({}).p == 1.0


def test_the_same_seed_gives_the_same_statistics(base):
    """What is drawn at random is drawn from the generator that is given."""
    one, other = (statistics(standing_of(*base), np.random.default_rng(3)) for _ in range(2))

    assert one == other


def test_angles_are_counted_to_the_left():
    """Up seen from right is a quarter turn to the left."""
    assert signed_angle(np.array([[0.0, 1.0]]), np.array([[1.0, 0.0]])) == pytest.approx(
        [math.pi / 2]
    )


def test_what_noise_explains_is_trusted_to_a_quarter():
    """Thirteen where replicates show nine is no disagreement; where they show none it is."""
    rng = np.random.default_rng(12)
    noisy = [{"a": rng.normal(9, 1)} for _ in range(39)]
    quiet = [{"a": rng.normal(0, 1)} for _ in range(39)]
    assert judge({"a": 13.0}, noisy).p > 0.01
    assert judge({"a": 13.0}, quiet).p < 1e-6


def test_products_are_summed_over_steps_that_both_have_a_score():
    """Neither over steps without another, nor where either has none."""
    values = np.array([[1.0, 2.0], [3.0, -1.0], [np.nan, np.nan], [0.5, 4.0]])
    sums = np.zeros(2)

    n = product_sums(values, np.array([1, -1, 0, 1]), sums)

    assert n == 2
    assert sums == pytest.approx([1 * 3 + 0.5 * 3, 2 * -1 + 4 * -1])

"""What the rounds benchmark makes of its numbers."""

import numpy as np
import pytest

from zfcal.parameters import natural, to_genes


@pytest.fixture(scope="module")
def rounds(scripts):
    """Return the script."""
    return scripts("bench_rounds")


@pytest.fixture
def trials():
    """Two trials of two rounds; the second has no next window for its last round."""
    return [
        {
            "guided": [
                {"end_s": 120, "S": 0.8, "next": 0.7},
                {"end_s": 180, "S": 0.9, "next": 0.6},
            ],
            "alone": [{"end_s": 120, "S": 0.6, "next": 0.7}, {"end_s": 180, "S": 0.8, "next": 0.8}],
        },
        {
            "guided": [
                {"end_s": 120, "S": 0.6, "next": 0.5},
                {"end_s": 180, "S": 0.7, "next": None},
            ],
            "alone": [
                {"end_s": 120, "S": 0.5, "next": 0.4},
                {"end_s": 180, "S": 0.7, "next": None},
            ],
        },
    ]


def test_a_curve_is_mean_and_sd_over_trials(rounds, trials):
    """0.8 and 0.6 are 0.7 +- 0.1414; a trial without a value does not count."""
    line = rounds.rounds_document.curve(trials, "guided", "S")
    assert line.at(120) == "0.700 ± 0.141"
    assert line.at(240) == "–"
    late = rounds.rounds_document.curve(trials, "guided", "next")
    assert late.n.tolist() == [2, 1]
    assert late.at(180) == "0.600"


def test_the_gain_is_paired_by_trial(rounds, trials):
    """At 120 s it is 0.2 and 0.1: 0.15 with a standard error of 0.05."""
    difference = rounds.rounds_document.difference
    assert difference(trials, "S", 120) == pytest.approx((0.15, 0.05))
    # Over all rounds 0.15 and 0.05, a mean per trial.
    assert difference(trials, "S") == pytest.approx((0.10, 0.05))
    assert np.isnan(difference(trials, "S", 600)).all()


def test_the_gain_leaves_out_a_trial_without_a_value(rounds, trials):
    """Only the first trial has a next window at 180 s; one trial has no standard error."""
    gain, error = rounds.rounds_document.difference(trials, "next", 180)
    assert gain == pytest.approx(-0.2)
    assert np.isnan(error)


def test_true_models_differ_and_stay_within_bounds(rounds):
    """Around the natural model, each trial its own, the same for the same seed."""
    zones = (("corridor", True), ("walls", True), ("centre", False))
    start = natural(zones, dt_s=0.2)
    genes = np.array([to_genes(rounds.truth_of(start, seed)) for seed in range(50)])
    assert np.array_equal(genes[3], to_genes(rounds.truth_of(start, 3)))
    assert len(np.unique(genes, axis=0)) == 50
    assert ((genes > 0) & (genes <= 1)).all()
    spread = np.log(genes[:, 0] / to_genes(start)[0]).std()
    assert spread == pytest.approx(rounds.SPREAD, rel=0.35)


def test_each_trial_is_compared_with_itself(rounds, trials):
    """S 0.85 over 0.7 in the first, 0.65 over 0.6 in the second; 2 s against 0.5 s."""
    for trial, ceiling in zip(trials, (1.0, 0.5), strict=True):
        trial["seed"] = 4
        for row in trial["guided"]:
            row["ceiling"] = ceiling
    times = {"load": [3.0], "cold_median_s": [9.0, 2.0], "warm_median_s": [3.0, 0.5],
             "warm_largest_s": [4.0, 0.7]}  # fmt: skip
    first, second = (
        [r.value for r in rounds.ratios({"simulated": [t], "likelihood_times": times}).values()]
        for t in trials
    )
    assert first == pytest.approx([0.85 / 0.7, 0.85, 4.0, 0.5])
    assert second == pytest.approx([0.65 / 0.6, 1.3, 4.0, 0.5])


@pytest.mark.parametrize(("words", "n"), [([], 2), (["--full"], 6), (["--write"], 6)])
def test_what_is_committed_is_measured_in_full(rounds, words, n):
    """And what is measured by default is among it, to be compared with."""
    options_of = rounds.parser(rounds.__doc__)
    options_of.add_argument("--full", action="store_true")
    seeds = rounds.effort_of(options_of.parse_args(words)).seeds
    assert len(seeds) == n
    assert set(seeds) <= set(rounds.FULL.seeds)

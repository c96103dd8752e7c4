"""What a genome scores."""

from dataclasses import replace

import numpy as np
import pytest

from zfcal.behaviour.scores import compare
from zfcal.calibrate.group import (
    as_statistics,
    pool_runs,
    runs_of,
)
from zfcal.calibrate.objective import Objective, n_counted
from zfcal.errors import InputError

NAMES = ("corridor", "walls", "centre")


@pytest.fixture
def objective(stand_in, window):
    """Return two runs of 400 steps against a window."""
    return Objective(
        group=stand_in, control=window(), n_steps=400, seeds=np.array([5, 6], dtype=np.uint64)
    )


def test_runs_are_pooled_before_they_are_scored(objective, truth):
    """The histogram is the sum over runs, and its score that of `compare`."""
    counts = objective.group.simulate(truth[None], n_counted=5, n_steps=400, seeds=objective.seeds)
    pooled = as_statistics(pool_runs(counts), 0, NAMES)
    assert pooled.occupation.sum() == 2 * 5 * 400
    one_by_one = runs_of(counts, 0)
    assert (one_by_one.wall.sum(axis=0) == pooled.wall).all()
    expected = compare(pooled, objective.control)
    found = objective(truth[None])[0]
    assert found == pytest.approx([expected.I_D, expected.I_W, expected.I_O, expected.I_T])
    assert objective.scores(truth[None]).S[0] == pytest.approx(expected.S)


def test_a_genome_scores_the_same_in_any_company(objective, truth):
    """Common random numbers: neither order nor neighbours matter."""
    genes = np.vstack([np.random.default_rng(0).random((7, 18)), truth])
    table = objective(genes)
    assert (objective(genes[::-1])[::-1] == table).all()
    assert (objective(truth[None])[0] == table[7]).all()


def test_the_true_genome_scores_best(objective, truth):
    """Against 50 random ones."""
    genes = np.vstack([truth, np.random.default_rng(1).random((50, 18))])
    assert np.argmax(objective.scores(genes).S) == 0


def test_a_window_without_fish_is_refused(objective):
    """There is nothing to compare with."""
    empty = replace(objective.control, occupation=np.zeros(3, dtype=np.int64))
    with pytest.raises(InputError, match="no position of a fish"):
        replace(objective, control=empty)


@pytest.mark.parametrize("change", [{"n_steps": 0}, {"seeds": np.empty(0, dtype=np.uint64)}])
def test_an_evaluation_of_nothing_is_refused(objective, change):
    """No run, or no step."""
    with pytest.raises(InputError, match="at least one run of one step"):
        replace(objective, **change)


def test_a_single_fish_beside_a_robot_is_counted_alone(stand_in):
    """Else its window, which has no pairs, would score 0 against every simulation."""
    assert n_counted(stand_in) == 5
    assert n_counted(replace(stand_in, n_fish=1)) == 1
    assert n_counted(replace(stand_in, n_fish=0)) == 1
    assert n_counted(replace(stand_in, n_fish=1, n_robots=0)) == 1


def test_a_window_of_a_single_fish_has_a_score_without_distances(stand_in, window, truth):
    """I_D is null, S is the geometric mean of the other three."""
    control = replace(window(), distance=np.zeros((3, 10), dtype=np.int64))
    alone = Objective(
        group=replace(stand_in, n_fish=1),
        control=control,
        n_steps=400,
        seeds=np.array([5], dtype=np.uint64),
    )
    scores = alone.scores(truth[None])
    assert np.isnan(scores.I_D[0])
    assert scores.n_features[0] == 3
    assert scores.S[0] > 0.8

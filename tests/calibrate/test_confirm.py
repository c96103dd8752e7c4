"""The second look at the best."""

from dataclasses import replace

import numpy as np
import pytest

from zfcal.behaviour.scores import compare
from zfcal.calibrate.confirm import best_distinct, confirm
from zfcal.errors import InputError


@pytest.fixture
def objective(task, small):
    """Return the long evaluation of a round."""
    return task.confirmation(small)


def test_the_winner_is_the_best_of_the_long_simulations(objective, truth):
    """Whatever its place among the candidates; its scores are those of its long run."""
    others = np.random.default_rng(0).random((6, 18))
    genes = np.vstack([others[:4], truth, others[4:]])
    found = confirm(objective, genes)
    assert (found.genes == truth).all()
    assert found.scores.S == found.candidates.max() == found.candidates[4]
    assert found.scores == compare(found.long_run, objective.control)
    assert found.long_run.occupation.sum() == 2 * 600 * 5


def test_a_window_that_says_nothing_still_has_a_winner(objective, truth):
    """Counts of nothing but one zone's occupation: O alone decides."""
    nothing = {
        name: np.zeros_like(getattr(objective.control, name))
        for name in ("distance", "wall", "transition")
    }
    blind = replace(objective, control=replace(objective.control, **nothing))
    found = confirm(blind, truth[None])
    assert found.scores.I_O > 0.5
    assert found.scores.S == 0.0


def test_nobody_cannot_win(objective):
    """An empty list of candidates is refused."""
    with pytest.raises(InputError, match="No genome to confirm"):
        confirm(objective, np.empty((0, 18)))


def test_the_best_are_listed_once_each_best_first():
    """Copies are left out, null scores come last, of equals the earlier one is first."""
    genes = np.array([[0.1], [0.2], [0.3], [0.2], [0.4], [0.5]])
    scores = np.array([0.7, 0.9, np.nan, 0.9, 0.8, 0.8])
    assert best_distinct(genes, scores, 4)[:, 0].tolist() == [0.2, 0.4, 0.5, 0.1]
    assert best_distinct(genes, scores, 99)[:, 0].tolist() == [0.2, 0.4, 0.5, 0.1, 0.3]

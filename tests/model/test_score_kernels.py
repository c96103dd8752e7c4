"""Scores of effects on headings, by hand-made others."""

import numpy as np
import pytest

from zfcal.model.kernels.scores import late_score

pytestmark = pytest.mark.plain

STEPS, CELLS = 6, 32


def seen(rng, others):
    """Return unit vectors and solid angles of others."""
    toward = rng.normal(size=(STEPS, others, 2))
    toward /= np.linalg.norm(toward, axis=2, keepdims=True)
    return toward, rng.uniform(0.1, 1.0, (STEPS, others))


def score_of(sight, late):
    """Return the scores of a model that sees as ``late`` has it."""
    rng = np.random.default_rng(3)
    taken = seen(rng, 1)[0][:, 0]
    mixture = rng.uniform(0.5, 1.0, (STEPS, CELLS))
    probability = np.full((STEPS, CELLS), 1 / CELLS)
    score = np.full(STEPS, np.nan)
    late_score(
        sight, late, taken, 5.0, 1.0, 0.7, mixture, probability,
        rng.uniform(0.5, 1.0, STEPS), np.full(STEPS, 0.1), score,
    )  # fmt: skip
    return score


def padded(sight, others):
    """Return others with more of them, who are not seen."""
    toward, angle_sr = sight
    more = others - angle_sr.shape[1]
    return (
        np.concatenate([toward, np.ones((STEPS, more, 2))], axis=1),
        np.concatenate([angle_sr, np.zeros((STEPS, more))], axis=1),
    )


@pytest.mark.parametrize(("now", "then"), [(6, 3), (3, 6), (4, 4)])
def test_whoever_is_not_seen_at_one_of_the_times_counts_for_the_other(now, then):
    """As if those who lack were there and covered nothing."""
    rng = np.random.default_rng(4)
    sight, late = seen(rng, now), seen(rng, then)
    most = max(now, then)
    found = score_of(sight, late)
    assert found == pytest.approx(score_of(padded(sight, most), padded(late, most)), rel=1e-12)
    assert np.abs(found).min() > 1e-3


def test_who_sees_the_same_has_no_score():
    """Exactly none, whoever is out of view beside."""
    sight = seen(np.random.default_rng(5), 3)
    assert score_of(sight, sight).tolist() == [0.0] * STEPS
    assert score_of(padded(sight, 5), sight).tolist() == [0.0] * STEPS

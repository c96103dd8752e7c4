"""How scores of speeds are spread: what a few of them show, and what chance makes of it."""

import numpy as np
import pytest

from zfcal.diagnose.features.spreads import Spreads
from zfcal.diagnose.features.swum import normal_scores, scores_of_speeds

N = 6000


def law(scores, who=None):
    """Return the law of scores, of one fish or several."""
    return Spreads(scores=scores, who=np.zeros(len(scores), int) if who is None else who)


def centred(rng, n_columns=1, n=N):
    """Return columns of mean nothing and variance one."""
    made = rng.normal(size=(n, n_columns))
    return (made - made.mean(axis=0)) / made.std(axis=0)


def test_chance_gains_what_wilks_says():
    """Twice the gain of a factor on nothing has the mean of chi-square with its strengths."""
    gains = []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        drawn = law(rng.normal(size=N)).spread(centred(rng))
        assert drawn.n_strengths == 4
        gains.append(2 * drawn.log_p.sum())
    assert np.mean(gains) == pytest.approx(4.0, abs=1.2)


def test_chance_copies_nothing():
    """A component about scores that have nothing to do with the step gains next to nothing."""
    gains = []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        scores = rng.normal(size=N)
        gains.append(law(scores).copied(rng.normal(size=(N, 1)), np.ones((N, 1, 1))).log_p.sum())
    assert 0 <= np.mean(gains) < 1
    assert np.quantile(gains, 0.95) < 3


def rare_slow(rng, share=0.04):
    """Return scores of which a few are slow where a column is high, and the column."""
    column = rng.uniform(size=N)
    slow = rng.uniform(size=N) < share * column
    scores = np.where(slow, rng.normal(-2.2, 0.3, N), rng.normal(size=N))
    return scores, (column - column.mean())[:, None]


def test_a_few_slow_steps_show_that_hardly_change_the_mean():
    """The regression of the mean sees half of it or less."""
    scores, column = rare_slow(np.random.default_rng(1), share=0.12)
    drawn = law(scores).spread(column / column.std())
    left = scores - column[:, 0] * (column[:, 0] @ scores) / (column[:, 0] @ column[:, 0])
    by_mean = 0.5 * N * np.log(((scores - scores.mean()) ** 2).mean() / left.var())
    assert drawn.log_p.sum() > 25
    assert drawn.log_p.sum() > 2 * by_mean


def test_copied_scores_show():
    """One score in twelve is about the known one: the share comes back."""
    rng = np.random.default_rng(2)
    known = rng.normal(size=N)
    copies = rng.uniform(size=N) < 1 / 12
    scores = np.where(copies, rng.normal(known, 0.25), rng.normal(size=N))
    drawn = law(scores).copied(known[:, None], np.ones((N, 1, 1)))
    assert drawn.log_p.sum() > 25
    assert drawn.expected.sum() == pytest.approx(drawn.log_p.sum(), rel=0.4)
    assert np.all(drawn.expected > -1e-9)


def test_a_factor_expects_what_it_gains():
    """If scores are drawn from it: the mean over steps of its own law."""
    scores, column = rare_slow(np.random.default_rng(3), share=0.12)
    drawn = law(scores).spread(column / column.std())
    assert drawn.expected.sum() == pytest.approx(drawn.log_p.sum(), rel=0.3)


def test_who_is_unknown_is_not_copied():
    """Steps without a known one have their law as it was; without any nothing is fitted."""
    rng = np.random.default_rng(4)
    scores, known = rng.normal(size=N), np.full((N, 1), np.nan)
    assert law(scores).copied(known, np.ones((N, 1, 1))).n_strengths == 0
    known[: N // 2, 0] = scores[: N // 2]
    drawn = law(scores).copied(known, np.ones((N, 1, 1)))
    assert drawn.n_strengths == 1
    assert np.all(drawn.log_p[N // 2 :] == 0)


@pytest.mark.parametrize("sort", ["spread", "copied"])
def test_what_is_there_gains_nothing_more(sort):
    """Beside itself a feature adds next to nothing."""
    rng = np.random.default_rng(5)
    scores, column = rare_slow(rng, share=0.12)
    column = column / column.std()
    if sort == "spread":
        drawn = law(scores).spread(column)
        again = law(scores).beside(drawn).spread(column)
    else:
        about, one = np.where(scores < -1.5, scores, 2.0)[:, None], np.ones((N, 1, 1))
        drawn = law(scores).copied(about, one)
        again = law(scores).beside(drawn).copied(about, one)
    assert drawn.log_p.sum() > 30
    assert again.log_p.sum() < 0.15 * drawn.log_p.sum()


def test_fish_that_differ_are_no_effect():
    """Each has a law of its own: a fast fish is fast wherever the column is high."""
    rng = np.random.default_rng(6)
    who = np.repeat([0, 1], N // 2)
    scores = rng.normal(size=N) * np.where(who, 0.4, 1.3)
    column = centred(rng)
    column -= np.array([column[who == k].mean() for k in (0, 1)])[who][:, None]
    assert law(scores, who).spread(column).log_p.sum() < 10


def test_scores_of_speeds_are_those_of_their_ranks():
    """A known speed has the score that its step would have; none has none."""
    rng = np.random.default_rng(7)
    speeds, zone = rng.gamma(3.0, 0.03, 400), np.repeat([1, 2], 200)
    found = scores_of_speeds(speeds[:, None], speeds, zone)[:, 0]
    assert found == pytest.approx(normal_scores(speeds, zone), abs=1e-9)
    edges = scores_of_speeds(np.array([[0.0], [9.0], [np.nan]]), speeds[:3], np.ones(3, int))
    assert edges[0, 0] < -1 < 1 < edges[1, 0]
    assert np.isnan(edges[2, 0])

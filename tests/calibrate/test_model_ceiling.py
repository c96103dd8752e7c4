"""What a model reaches against itself."""

import numpy as np
import pytest

from zfcal.behaviour.ceilings import Ceiling
from zfcal.behaviour.scores import compare, score_keys
from zfcal.calibrate.ceiling import measure_ceiling, window_noise
from zfcal.calibrate.group import as_statistics, pool_runs, runs_of
from zfcal.errors import InputError

NAMES = ("corridor", "walls", "centre")
SEEDS = np.arange(100, 150, dtype=np.uint64)


@pytest.fixture
def long_run(stand_in, truth):
    """Return the pooled counts of two half hours."""
    counts = stand_in.simulate(
        truth[None], n_counted=5, n_steps=9000, seeds=np.array([1, 2], dtype=np.uint64)
    )
    return as_statistics(pool_runs(counts), 0, NAMES)


def test_the_ceiling_is_mean_and_quantiles_of_windows_scored_one_by_one(stand_in, truth, long_run):
    """The slow way: each window's statistics through `compare`; only the four fish count."""
    ceiling = measure_ceiling(stand_in, truth, long_run=long_run, n_steps=600, seeds=SEEDS)
    counts = stand_in.simulate(truth[None], n_counted=4, n_steps=600, seeds=SEEDS)
    windows = [as_statistics(runs_of(counts, 0), run, NAMES) for run in range(len(SEEDS))]
    assert windows[0].occupation.sum() == 4 * 600
    scores = np.array([compare(window, long_run).values for window in windows])
    assert ceiling.n_windows == 50
    assert ceiling.mean == pytest.approx(scores.mean(axis=0))
    assert ceiling.low == pytest.approx(np.quantile(scores, 0.025, axis=0))
    assert ceiling.high == pytest.approx(np.quantile(scores, 0.975, axis=0))


def test_the_ceiling_covers_every_feature_and_zone(stand_in, truth, long_run):
    """D, W, T by zone and as means, O and S; each mean within its interval."""
    ceiling = measure_ceiling(stand_in, truth, long_run=long_run, n_steps=600, seeds=SEEDS)
    for key in score_keys(NAMES):
        mean, low, high = ceiling.of(*key)
        assert 0.0 < low <= mean <= high <= 1.0


def test_longer_windows_have_a_higher_ceiling_and_less_noise(stand_in, truth, long_run):
    """The ceiling measures how short a window is."""
    short, long = (
        measure_ceiling(stand_in, truth, long_run=long_run, n_steps=n, seeds=SEEDS)
        for n in (100, 3000)
    )
    assert short.of("S")[0] < long.of("S")[0] < 1.0
    assert window_noise(long) < window_noise(short)


def test_a_ceiling_needs_a_window(stand_in, truth, long_run):
    """None was asked for."""
    with pytest.raises(InputError, match="got 0 windows"):
        measure_ceiling(stand_in, truth, long_run=long_run, n_steps=600, seeds=SEEDS[:0])


def test_the_noise_of_a_window_by_hand():
    """An interval of 2 x 1.959964 standard deviations of 0.05."""
    half = 0.05 * 1.959964
    column = (0.8,) * 14
    ceiling = Ceiling(
        zone_names=NAMES,
        mean=column,
        low=tuple(value - half for value in column),
        high=tuple(value + half for value in column),
        n_windows=200,
    )
    assert window_noise(ceiling) == pytest.approx(0.05, rel=1e-6)

"""The null: by hand, and through the measurement."""

import dataclasses
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from zfcal.diagnose.null import (
    Chain,
    Measurement,
    check_length,
    from_replicates,
    moments_of,
    replicate,
    run_null,
    theory,
)
from zfcal.diagnose.screening import Screen
from zfcal.errors import InputError
from zfcal.model.extended import maximise
from zfcal.model.scene import make_scene


@pytest.fixture(scope="module")
def chain_of(tank, fish):
    """Return what fits the base model to samples and makes replicates of it."""

    def of(samples, **measurement):
        fitted = maximise(make_scene(samples, tank), fish)
        own = Measurement(**measurement)
        return Chain(samples=samples, arena=tank, fitted=fitted, measurement=own, seed=4)

    return of


@pytest.fixture(scope="module")
def gappy(record):
    """Return two minutes of four fish and a robot; one fish changes its id after a gap."""
    samples = record(2, minutes=2.0, n_fish=4, n_robots=1)
    xy_m = np.concatenate([samples.xy_m, samples.xy_m[:, :1]], axis=1)
    xy_m[300:, 0], xy_m[:310, 5] = np.nan, np.nan
    xy_m[50:53, 1] = np.nan
    return dataclasses.replace(
        samples,
        agent=np.array([1, 2, 3, 4, 5, 9], dtype=np.int32),
        kind=np.array([0, 0, 0, 0, 1, 0], dtype=np.int8),
        xy_m=xy_m,
        confidence=np.where(np.isnan(xy_m[..., 0]), np.nan, 1.0).astype(np.float32),
    )


def test_theory_is_the_standard_normal():
    """1.96 either way is one chance in twenty."""
    null = theory(2)
    z = np.array([1.959964, -1.959964])
    assert np.array_equal(null.standardised(z), z)
    assert null.p(z) == pytest.approx([0.05, 0.05], abs=1e-6)


def test_centre_and_spread_by_hand():
    """Z of 0 and 4: centre 2, squares 8; with twenty of theory sqrt(28 / 21)."""
    null = from_replicates(np.array([[0.0, 1.0], [4.0, 1.0]]))
    assert null.centre == pytest.approx([2.0, 1.0])
    assert null.spread == pytest.approx([math.sqrt(28 / 21), math.sqrt(20 / 21)])
    assert null.n == 2
    assert null.largest == pytest.approx([2 * math.sqrt(2) / math.sqrt(28 / 21)] * 2)
    assert null.standardised(np.array([2.0, 2.0]))[0] == 0.0


def test_moments_by_hand():
    """Of 0 and 4, with a weight of ten: squares 8, so 18 / 11; half as much more for one more."""
    moments = moments_of(np.array([[0.0], [4.0]]), 10.0)

    assert moments.centre == pytest.approx([2.0])
    assert moments.variance == pytest.approx([18 / 11])
    assert moments.df == 11
    assert moments.spread_of_one_more(2) == pytest.approx([math.sqrt(18 / 11 * 1.5)])


def test_without_replicates_the_theory_is_left():
    """Centre 0, variance 1, and the degrees of freedom that it counts for."""
    moments = moments_of(np.zeros((0, 3)), 10.0)

    assert moments.centre.tolist() == [0.0] * 3
    assert moments.variance.tolist() == [1.0] * 3
    assert moments.df == 10


def test_chances_by_hand():
    """With 39 replicates Student's law of 58 degrees, widened for the centre's own error."""
    null = from_replicates(np.random.default_rng(1).normal(size=(39, 1)))
    by_hand = 2 * stats.t.sf(3.0 / math.sqrt(1 + 1 / 39), 58)
    assert null.p(np.array([3.0])) == pytest.approx([by_hand])
    assert null.p(np.array([3.0]))[0] > theory(1).p(np.array([3.0]))[0]


def test_many_replicates_outweigh_the_theory():
    """A spread of three, shown by 2000 replicates, is found within a twentieth."""
    table = np.random.default_rng(2).normal(1.0, 3.0, size=(2000, 1))
    null = from_replicates(table)
    assert null.spread[0] == pytest.approx(3.0, rel=0.05)
    assert null.centre[0] == pytest.approx(1.0, abs=0.3)


def test_a_replicate_keeps_gaps_and_ids(gappy, chain_of, tank):
    """What was missing is missing; what was a robot is one; nobody is in two places."""
    chain = chain_of(gappy)
    made = replicate(gappy, tank, chain.fitted, Measurement(), seed=1)

    assert np.array_equal(np.isnan(made.xy_m), np.isnan(gappy.xy_m))
    for name in ("k", "agent", "kind", "confidence"):
        assert np.array_equal(getattr(made, name), getattr(gappy, name), equal_nan=True)
    inside = ~np.isnan(made.xy_m[..., 0])
    assert (tank.zone_of(made.xy_m[inside]) > 0).all()
    away = np.linalg.norm(made.xy_m[:, :, None] - made.xy_m[:, None], axis=-1)
    assert np.nanmin(away[:, ~np.eye(6, dtype=bool)]) > 0
    # Id 9 takes over the fish that id 1 was: it is where that one can be 11 steps later.
    assert np.linalg.norm(made.xy_m[310, 5] - made.xy_m[299, 0]) < 11 * 0.2 * 0.4


def test_a_replicate_is_made_by_its_seed(gappy, chain_of, tank):
    """The same again, and another one with another seed."""
    fitted = chain_of(gappy).fitted
    one, two, three = (
        replicate(gappy, tank, fitted, Measurement(), seed=seed).xy_m for seed in (1, 1, 2)
    )
    assert np.array_equal(one, two, equal_nan=True)
    assert not np.array_equal(one, three, equal_nan=True)


def test_noise_and_grain_are_added(gappy, chain_of, tank):
    """Of some 7,000 coordinates the spread is known to a hundredth."""
    fitted = chain_of(gappy).fitted
    clean, noisy, coarse = (
        replicate(gappy, tank, fitted, Measurement(**how), seed=1).xy_m
        for how in ({}, {"noise_m": 0.002}, {"grain_m": 0.005})
    )
    error = (noisy - clean)[~np.isnan(clean)]
    assert error.std() == pytest.approx(0.002, rel=0.05)
    assert abs(error.mean()) < 5 * 0.002 / math.sqrt(error.size)
    steps = coarse[~np.isnan(coarse)] / 0.005
    assert steps == pytest.approx(np.round(steps), abs=1e-6)
    assert np.nanmax(np.abs(coarse - clean)) <= 0.0025 + 1e-9


@pytest.mark.slow
def test_noise_poses_as_memory_in_theory_and_not_in_the_chain(record, chain_of, candidate):
    """Two millimetres of noise on a right model: far out by theory, usual among replicates.

    A point that is misplaced turns the step into it and the one out of it in opposite ways.
    """
    samples = record(8, minutes=20.0)
    rng = np.random.default_rng(8)
    noisy = dataclasses.replace(
        samples, xy_m=samples.xy_m + rng.normal(0, 0.002, samples.xy_m.shape)
    )
    chain = chain_of(noisy, noise_m=0.002)
    memory = candidate("turning-memory", forgets_wide=1.0)
    z = Screen(scene=make_scene(noisy, chain.arena), fitted=chain.fitted).ask(memory).z
    rows = run_null(
        chain, lambda _n, screen: np.array([screen.ask(memory).z]), range(6), n_workers=2
    )
    null = from_replicates(np.array(rows))

    assert abs(z) > 5
    assert abs(null.centre[0]) > 4
    assert abs(null.standardised(np.array([z]))[0]) < 3.5


def test_replicates_do_not_depend_on_workers(record, chain_of, candidate):
    """Their order neither; each that is done is told."""
    chain, bias = chain_of(record(5, minutes=2.0)), candidate("turning-bias")
    told = []
    one, two = (
        run_null(chain, lambda n, s: (n, s.ask(bias).z), range(4), n_workers=w, done=told.append)
        for w in (1, 2)
    )
    assert one == two
    assert [number for number, _ in one] == [0, 1, 2, 3]
    assert len({z for _, z in one}) == 4
    assert told == [1, 2, 3, 4] * 2


def test_a_replicate_that_is_kept_is_made_once_and_keeps_no_tables(record, chain_of, candidate):
    """Of as many as asked for; what was worked out for one question goes with it."""
    chain = replace(chain_of(record(5, minutes=2.0)), keeps=1)
    first, again = chain.screen(0), chain.screen(0)
    assert first.fitted is again.fitted
    assert chain.screen(1).fitted is not chain.screen(1).fitted
    first.ask(candidate("turning-bias"))
    assert "_tables" in vars(first)
    assert "_tables" not in {*vars(again), *vars(chain.screen(0))}


def test_too_few_steps_are_refused(record, tank):
    """The message has both numbers."""
    samples = record(5, minutes=0.1)
    scene = make_scene(samples, tank)
    with pytest.raises(InputError, match=f"needs 200 steps .* got {len(scene.turns)} in 30"):
        check_length(samples, scene, 200)
    check_length(samples, scene, 10)

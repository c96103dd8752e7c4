"""DEAP's own operators behind the same state."""

import json
import random
from dataclasses import fields

import numpy as np
import pytest

from zfcal.calibrate import evolve_deap

WEIGHTS = np.random.default_rng(5).random((18, 4))


def plain_features(genes):
    """Return four smooth numbers in [0, 1] of a genome."""
    return 1.0 - 0.5 * np.abs(np.sin(2.0 * genes @ WEIGHTS))


def run(state, n, evaluate=plain_features):
    """Return the state n generations later."""
    for _ in range(n):
        state = evolve_deap.step(state, evaluate)
    return state


def same(a, b):
    """Return whether two states are equal bit by bit."""
    pairs = [(getattr(a, f.name), getattr(b, f.name)) for f in fields(a) if f.name != "rng"]
    return a.rng == b.rng and all(np.array_equal(x, y) for x, y in pairs)


@pytest.fixture
def state():
    """Return an initial population of 20."""
    genes = np.random.default_rng(1).random((20, 18))
    return evolve_deap.begin(genes, plain_features(genes), seed=1)


def test_a_seed_gives_the_same_run_whatever_the_global_streams_are_at(state):
    """Both of DEAP's streams are the run's own."""
    expected = run(state, 3)
    random.seed(99)
    np.random.seed(99)  # noqa: NPY002 - this very stream is the matter
    again = evolve_deap.begin(state.genes, state.features, seed=1)
    assert same(run(again, 3), expected)


def test_the_caller_finds_both_global_streams_as_they_were(state):
    """After a generation, and also after one that failed."""

    def lost(_):
        raise RuntimeError("worker lost")

    random.seed(99)
    np.random.seed(99)  # noqa: NPY002
    before = random.getstate(), np.random.get_state(legacy=False)  # noqa: NPY002
    run(state, 2)
    with pytest.raises(RuntimeError):
        run(state, 1, lost)
    after = random.getstate(), np.random.get_state(legacy=False)  # noqa: NPY002
    assert after[0] == before[0]
    np.testing.assert_equal(after[1], before[1])


def test_an_evaluation_that_draws_global_numbers_does_not_change_the_run(state):
    """The streams are lent to the operators only."""

    def evaluate(genes):
        random.random()  # noqa: S311
        return plain_features(genes)

    assert same(run(state, 3, evaluate), run(state, 3))


def test_a_run_that_was_stopped_goes_on_as_if_it_had_not_been(state):
    """The random numbers pass through JSON."""
    half = run(state, 2)
    values = {f.name: getattr(half, f.name) for f in fields(half)}
    values["rng"] = json.loads(json.dumps(values["rng"]))
    assert same(run(type(half)(**values), 2), run(state, 4))


def test_it_gets_better_and_keeps_its_best(state):
    """S never falls in ten generations, and rises."""
    after = run(state, 10)
    assert after.generation == 10
    assert after.evaluations == 220
    assert after.scores.max() > state.scores.max()
    assert ((after.genes >= 0.0) & (after.genes <= 1.0)).all()

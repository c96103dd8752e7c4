"""A chain of swimming and resting, seen through steps that may be short without a rest."""

import itertools
import math

import numpy as np
import pytest

from zfcal.diagnose.rests import Chain, Runs, fit_chain

LIMITS = ((1e-6, 0.33), (0.13, 0.997))


def drawn(chain, n, *, seed=3, first_rests=False):
    """Return whether each of n steps is still, of a fish that swam before, or rested."""
    rng = np.random.default_rng(seed)
    resting, still = first_rests, np.empty(n, dtype=bool)
    for step in range(n):
        resting = rng.random() < (chain.stays if resting else chain.begins)
        still[step] = resting or rng.random() < chain.short[0]
    return still


def runs_in(still):
    """Return the runs of one fish in one zone whose step before these was no rest."""
    length, before = np.zeros(len(still), dtype=np.int64), 0
    for step, now in enumerate(still):
        length[step] = min(before, 30)
        before = before + 1 if now else 0
    zeros = np.zeros(len(still), dtype=np.int64)
    return Runs(open_=zeros, length=length, zone=zeros, now=still, n_zones=1)


def probability(still, chain, rest_first):
    """Return the chance of a sequence by summing over all ways of having rested in it."""
    total = 0.0
    for path in itertools.product((False, True), repeat=len(still)):
        chance, begins = 1.0, rest_first
        for now, rests in zip(still, path, strict=True):
            seen = 1.0 if rests else chain.short[0]
            chance *= (begins if rests else 1 - begins) * (seen if now else 1 - seen)
            begins = chain.stays if rests else chain.begins
        total += chance
    return total


@pytest.fixture
def chain():
    """Return a chain with rests of ten steps, and a tenth of draws too short."""
    return Chain(begins=0.05, stays=0.9, at_first=0.4, short=np.array([0.1]))


@pytest.mark.parametrize("word", ["0", "1", "011", "11101", "1111110", "0110100"])
def test_a_sequence_is_as_likely_as_the_sum_over_all_that_may_lie_behind_it(chain, word):
    """After a step that was no rest."""
    still = np.array([letter == "1" for letter in word])
    told = runs_in(still).log_chance(chain).sum()
    assert math.exp(told) == pytest.approx(probability(still, chain, chain.begins))


def test_a_fish_that_is_still_at_first_has_a_chance_of_its_own(chain):
    """Whether it rests there is no matter of how often others begin to."""
    still = np.array([True, True, False])
    runs = Runs(
        open_=np.ones(3, dtype=np.int64), length=np.arange(3), zone=np.zeros(3, dtype=np.int64),
        now=still, n_zones=1,
    )  # fmt: skip
    told = math.exp(runs.log_chance(chain).sum())
    assert told == pytest.approx(probability(still, chain, 0.4))


def test_a_chain_without_rests_is_one_of_short_draws():
    """However long the fish has been still."""
    alike = Chain(begins=0.0, stays=0.5, at_first=0.0, short=np.array([0.2, 0.3]))
    assert alike.still() == pytest.approx(np.broadcast_to([0.2, 0.3], (2, 31, 2)))


def test_a_chain_is_found_again():
    """Of 30,000 steps with a thousand rests: each chance within three standard errors."""
    true = Chain(begins=0.05, stays=0.8, at_first=0.5, short=np.array([0.08]))
    found = fit_chain(runs_in(drawn(true, 30_000)).counts(np.ones(30_000, dtype=bool)), LIMITS)
    logit = [math.log(p / (1 - p)) for p in (true.begins, true.stays)]
    ours = [math.log(p / (1 - p)) for p in (found.chain.begins, found.chain.stays)]
    for want, have, error in zip(logit, ours, found.errors, strict=True):
        assert abs(have - want) < 3 * error
        assert 0.01 < error < 0.1
    assert found.chain.short[0] == pytest.approx(0.08, abs=0.01)


def test_short_draws_alone_are_no_rests():
    """Half of all steps are still, one as likely as the other: rests win no more than two nats."""
    true = Chain(begins=0.0, stays=0.5, at_first=0.0, short=np.array([0.5]))
    runs = runs_in(drawn(true, 5000))
    found = fit_chain(runs.counts(np.ones(5000, dtype=bool)), LIMITS)
    gain = runs.log_chance(found.chain).sum() - runs.log_chance(found.alike).sum()
    assert -0.1 < gain < 3
    assert found.alike.short[0] == pytest.approx(runs.now.mean())


def test_steps_that_are_left_out_are_not_learnt_from(chain):
    """Counts are of the steps that are asked for."""
    still = drawn(chain, 1000)
    runs, some = runs_in(still), np.arange(1000) < 400
    assert runs.counts(some).sum() == 400
    assert runs.counts(some)[..., 1].sum() == still[:400].sum()

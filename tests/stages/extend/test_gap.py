"""Shares of a gap and their intervals."""

import math

import numpy as np
import pytest

from zfcal.diagnose.heldout import Gains, Steps
from zfcal.errors import InputError
from zfcal.stages.extend.gap import (
    Draws,
    draw_blocks,
    effect_gap,
    likelihood_gap,
    make_gap,
    shares,
)
from zfcal.stages.extend.halves import split
from zfcal.stages.track_window import read_stretch
from zfcal.stages.trial_context import open_trial


def column(*values):
    """Return values as measured and as drawn."""
    return np.array(values, dtype=float)


def test_the_share_by_hand():
    """From 1.0 to 0.4 with a floor of 0.2 are 3/4, whichever way is better."""
    less = shares(column(1.0), column(0.4), column(0.2), -1.0)
    more = shares(column(0.0), column(0.6), column(0.8), 1.0)
    assert less == pytest.approx([0.75])
    assert more == pytest.approx([0.75])


def test_a_worse_model_opens_the_gap_and_a_lucky_one_closes_more():
    """Below zero and above one are told as they are."""
    assert shares(column(1.0), column(1.2), column(0.0), -1.0) == pytest.approx([-0.2])
    assert shares(column(1.0), column(-0.5), column(0.0), -1.0) == pytest.approx([1.5])


def test_where_there_is_no_gap_there_is_no_share():
    """A model at or beyond the floor; and a NaN says nothing."""
    before = column(0.9, 1.0, math.nan)
    assert np.isnan(shares(before, before, column(0.9, 0.8, 0.5), 1.0)).all()


def test_a_gap_that_may_be_none_has_no_share():
    """Every tenth draw leaves none: neither share nor placebo nor interval."""
    before = np.full(101, 0.5)
    floor = np.where(np.arange(101) % 10 == 5, 0.4, 0.9)
    found = make_gap("D", (before, before + 0.1), floor, before)
    assert math.isnan(found.closed)
    assert math.isnan(found.placebo)
    assert math.isnan(found.interval[0])
    sure = make_gap("D", (before, before + 0.1), np.full(101, 0.9), before)
    assert sure.closed == pytest.approx(0.25)
    assert sure.placebo == 0.0


def test_the_interval_is_that_of_the_draws():
    """Shares from 0 to 1 in even steps: 2.5 and 97.5 %."""
    after = np.concatenate([[0.5], np.linspace(0, 1, 1001)])
    zeros = np.zeros(1002)
    found = make_gap("D", (zeros, after), zeros + 1, zeros)
    assert found.interval == pytest.approx((0.025, 0.975))


@pytest.fixture
def halves(make_trial):
    """The blocks of 5 minutes and a bit: three to learn from, three to judge on."""
    opened = open_trial(make_trial(seconds=310))
    return split(opened, read_stretch(opened, None, lambda _: None))


def test_every_other_minute_is_held_out(halves):
    """The sixth is a part of one."""
    assert halves.learnt.tolist() == [True, False] * 3
    assert halves.held_out.tolist() == [False, True] * 3
    assert halves.seconds(halves.learnt) == pytest.approx(180)
    assert halves.seconds(halves.held_out) == pytest.approx(130)


def test_statistics_of_blocks_count_every_sample_once(halves):
    """3 fish at 1550 samples; steps stay within their block: 299 of each, and 49."""
    pooled = halves.pooled(halves.learnt) + halves.pooled(halves.held_out)
    assert pooled.occupation.sum() == 3 * 1550
    assert pooled.transition.sum() == 3 * (5 * 299 + 49)


def test_draws_are_of_held_out_minutes(halves):
    """The first row is what was measured; the others draw as many."""
    draws = draw_blocks(halves, np.random.default_rng(1), 50)
    assert draws.blocks.tolist() == [1, 3, 5]
    assert draws.weights[0].tolist() == [1, 1, 1]
    assert (draws.weights.sum(axis=1) == 3).all()
    by_block = np.array([100.0, 1.0, 100.0, 2.0, 100.0, 4.0])
    assert draws.sums(by_block)[0] == 7.0


def test_the_effects_own_statistic_by_hand(halves):
    """Scores 1 at nine steps: z is 3, over the root of nine it is 1; 0 with the effect.

    The floor is the mean size of a standard normal over 3, 0.266.
    """
    at = np.array([300] * 9)
    draws = Draws(blocks=np.array([1]), weights=np.ones((3, 1)))
    before, after = Steps(at=at, values=np.ones(9)), Steps(at=at, values=np.tile([1, -1, 0], 3))
    found = effect_gap(halves, draws, (before, after, None))
    assert (found.before, found.after) == (1.0, 0.0)
    assert found.floor == pytest.approx(math.sqrt(2 / math.pi) / 3)
    assert found.closed == pytest.approx(1 / (1 - found.floor))
    assert math.isnan(found.placebo)


@pytest.mark.parametrize(("expected", "is_gap"), [(0.25, True), (0.2, False)])
def test_a_gain_of_less_than_two_nats_is_no_gap(halves, expected, is_gap):
    """Nine steps with 0.25 nats expected of each are 2.25 nats, with 0.2 they are 1.8."""
    at = np.array([300] * 9)
    draws = Draws(blocks=np.array([1]), weights=np.ones((3, 1)))
    base, gain, most = (Steps(at=at, values=np.full(9, by)) for by in (-1.0, 0.1, expected))
    found = likelihood_gap(halves, draws, [Gains(base=base, gain=gain, expected=most)], [])
    assert (found.before, found.after) == pytest.approx((-1.0, -0.9))
    assert found.floor == pytest.approx(-1.0 + expected)
    assert math.isnan(found.closed) != is_gap


def test_an_effect_that_was_not_missed_leaves_no_gap(halves):
    """Scores whose z is 1.46 before; the 3 of another test is one."""
    at = np.array([300] * 9)
    draws = Draws(blocks=np.array([1]), weights=np.ones((3, 1)))
    before = Steps(at=at, values=np.array([1.0] * 6 + [-0.5, -0.5, -1.0]))
    after = Steps(at=at, values=np.tile([1, -1, 0], 3))
    found = effect_gap(halves, draws, (before, after, None))
    assert found.before == pytest.approx(1.4606 / 3, abs=1e-4)
    assert math.isnan(found.closed)
    assert math.isnan(found.interval[0])


def test_a_recording_too_short_to_hold_anything_out_is_refused(make_trial):
    """Three minutes leave one to judge on."""
    opened = open_trial(make_trial(seconds=180))
    stretch = read_stretch(opened, None, lambda _: None)
    with pytest.raises(InputError, match="2 minutes to learn from and 1 to judge on"):
        split(opened, stretch)

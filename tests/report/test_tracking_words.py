"""How much of the animals was seen."""

from dataclasses import replace

import numpy as np
import pytest

from zfcal.report.summary import statements
from zfcal.report.tracking_words import tracking_statement
from zfcal.tracks import FISH


@pytest.fixture
def view_of(make_view):
    """Return a view of 600 samples in which so many points of four fish are in each zone."""

    def make(*zones):
        view = make_view()
        fish = replace(view.seen.visits[FISH], zones=np.array(zones))
        return replace(view, seen=replace(view.seen, visits={**view.seen.visits, FISH: fish}))

    return make


def test_the_share_of_known_positions_by_hand(view_of):
    """2280 of 4 x 600: 95 %; of them and 600 of the robot 28 lie outside, 1 %."""
    said = tracking_statement(view_of(28, 1000, 1000, 252))

    assert said.figure == ("95.0 %", "of the fish's positions are known")
    assert "Over 120 s" in said.answer
    assert "100 % of the robot's" in said.answer
    assert "1.0 % lie outside the tank" in said.answer
    assert "near distances" not in said.answer
    assert not said.warns


def test_what_is_missing_is_said_to_be_of_a_kind(view_of):
    """Below nine in ten."""
    assert "near distances may be too rare" in tracking_statement(view_of(0, 2000, 0, 0)).answer


def test_more_fish_than_there_are_put_all_else_in_doubt(view_of):
    """3000 positions of 2400."""
    said = tracking_statement(view_of(0, 3000, 0, 0))

    assert said.warns
    assert said.figure[0] == "125.0 %"
    assert "more than there are fish" in said.answer


def test_nearly_all_is_not_all(view_of):
    """2399 of 2400 are 99.9 %, not 100."""
    assert tracking_statement(view_of(0, 2399, 0, 0)).figure[0] == "99.9 %"
    assert tracking_statement(view_of(0, 2400, 0, 0)).figure[0] == "100 %"


def test_it_is_said_of_a_trial_with_tracks_alone(make_view):
    """It stands in the summary; without tracks there is nothing to say."""
    question = "How well were the animals tracked?"

    assert question in [said.question for said in statements(make_view())]
    assert tracking_statement(make_view(seen=None)) is None

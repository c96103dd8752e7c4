"""Suspects that a part of the steps rules out."""

import numpy as np
import pytest

from zfcal.diagnose import heats
from zfcal.diagnose.heats import unbeaten
from zfcal.diagnose.naming import refit

SUSPECTS = ("group-cohesion", "leader-following", "wall-persistence", "burst-and-coast")


@pytest.fixture(scope="module")
def asked(screen, candidate):
    """A recording of strong cohesion, and what it asks of four suspects."""
    found = screen(31, {"group-cohesion": {"weight": 4.0}}, minutes=8.0)
    return found, [found.ask(candidate(name)) for name in SUSPECTS]


@pytest.fixture
def short(monkeypatch):
    """Heats of few enough steps for a short recording."""
    monkeypatch.setattr(heats, "HEAT_TURNS", 4000)


def test_only_what_cannot_be_the_best_is_left_out(asked, short):
    """Whoever wins with all steps has won its heat, and the heat was of some use."""
    screen, scores = asked
    worth = unbeaten(screen, scores, 2)
    nats = [refit(screen, score).nats for score in scores]

    assert worth[int(np.argmax(nats))]
    assert worth[SUSPECTS.index("group-cohesion")]
    assert not all(worth)


def test_a_recording_without_any_of_them_keeps_them_all(screen, candidate, short):
    """Nobody is five standard errors ahead where there is nothing."""
    nothing = screen(32, minutes=8.0)
    assert all(unbeaten(nothing, [nothing.ask(candidate(name)) for name in SUSPECTS], 1))


def test_two_suspects_or_few_steps_are_worth_no_heat(asked):
    """They are all fitted to everything."""
    screen, scores = asked
    assert unbeaten(screen, scores[:2], 1) == [True, True]
    assert unbeaten(screen, scores, 1) == [True] * 4


def test_a_heat_does_not_depend_on_the_threads(asked, short):
    """The same answer by one and by three."""
    screen, scores = asked
    assert unbeaten(screen, scores, 1) == unbeaten(screen, scores, 3)

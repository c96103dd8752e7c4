"""Suspects that a part of the steps rules out."""

import numpy as np
import pytest

from zfcal.diagnose import heats, naming
from zfcal.diagnose.heats import Sampled, ahead, hopeful, run_heats, unbeaten
from zfcal.diagnose.naming import refit
from zfcal.diagnose.selection import least_z

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


@pytest.fixture
def ran(asked, short):
    """The four suspects' heats."""
    screen, scores = asked
    return run_heats(Sampled(whole=screen), scores, 2)


def names(found):
    """Return the effects of some heats."""
    return [heat.score.candidate.name for heat in found]


@pytest.mark.slow
def test_only_what_cannot_be_the_best_is_left_out(asked, ran):
    """Whoever wins with all steps has won its heat, and the heat was of some use."""
    screen, scores = asked
    worth = names(unbeaten(ran))
    nats = [refit(screen, score).nats for score in scores]

    assert SUSPECTS[int(np.argmax(nats))] in worth
    assert "group-cohesion" in worth
    assert len(worth) < len(SUSPECTS)


@pytest.mark.slow
def test_a_recording_without_any_of_them_keeps_them_all(screen, candidate, short):
    """Nobody is five standard errors ahead where there is nothing."""
    nothing = screen(32, minutes=8.0)
    scores = [nothing.ask(candidate(name)) for name in SUSPECTS]
    assert names(unbeaten(run_heats(Sampled(whole=nothing), scores, 1))) == list(SUSPECTS)


def test_what_must_be_ahead_in_the_end_is_out_sooner(ran):
    """Those behind the others' best by a standard error are out, and it itself never is."""
    cohesion, rest = ran[:1], ran[1:]
    assert ahead(rest, cohesion) == []
    assert ahead(cohesion, rest) == cohesion
    assert ahead(cohesion, cohesion) == cohesion
    assert ahead(rest, []) == rest


def test_what_all_steps_may_gain_is_told_by_some(asked, ran):
    """Cohesion may gain what it gains in the end, which an idle effect may not."""
    screen, scores = asked
    whole = refit(screen, scores[0]).nats
    assert ran[0].share >= 2
    assert ran[0].gains(whole)
    assert not ran[0].gains(3 * whole)
    assert not any(heat.gains(whole) for heat in ran[1:])


def test_few_steps_are_worth_no_heat(asked):
    """All are then fitted to everything, and may gain anything."""
    screen, scores = asked
    ran = run_heats(Sampled(whole=screen), scores, 1)
    assert [heat.first for heat in ran] == [None] * 4
    assert unbeaten(ran) == ran == ahead(ran, ran)
    assert all(heat.gains(1e9) for heat in ran)


@pytest.mark.slow
def test_a_heat_does_not_depend_on_the_threads(asked, ran):
    """The same fits by one and by two."""
    screen, scores = asked
    alone = run_heats(Sampled(whole=screen), scores, 1)
    assert [heat.first.values for heat in alone] == [heat.first.values for heat in ran]
    assert [heat.first.nats for heat in alone] == [heat.first.nats for heat in ran]


@pytest.mark.slow
def test_a_fit_goes_on_where_its_heat_ended(asked, ran, monkeypatch):
    """It comes to the same maximum as one that looks for its start, and looks for none."""
    screen, scores = asked
    found = refit(screen, scores[0])
    monkeypatch.setattr(naming, "_start", None)
    again = refit(screen, scores[0], ran[0].first)
    assert again.nats == pytest.approx(found.nats, abs=0.05)
    assert again.values["weight"] == pytest.approx(found.values["weight"], rel=0.02)


def test_what_all_steps_cannot_ask_for_is_not_asked_of_them(asked, short, candidate):
    """Cohesion may reach what it reaches in the end, and none of the idle ones so much."""
    screen, scores = asked
    candidates = [score.candidate for score in scores]
    sampled = Sampled(whole=screen)
    assert sampled.share >= 2
    assert hopeful(sampled, candidates, scores[0].z, 2) == candidates[:1]
    assert hopeful(sampled, candidates, 3 * scores[0].z, 2) == []


def test_what_some_steps_do_not_tell_has_hope(asked, short, candidate):
    """How individuals differ, and rests; a score that all may have; a recording that is short."""
    screen, _scores = asked
    candidates = [candidate("boldness"), candidate("freezing"), candidate("fatigue")]
    assert hopeful(Sampled(whole=screen), candidates, 1e3, 1) == candidates[:2]
    assert hopeful(Sampled(whole=screen), candidates, 2.0, 1) == candidates


def test_few_steps_leave_hope_to_all(asked):
    """There is no part of them to be asked first."""
    screen, scores = asked
    candidates = [score.candidate for score in scores]
    assert Sampled(whole=screen).part is screen
    assert hopeful(Sampled(whole=screen), candidates, 1e3, 1) == candidates


def test_a_strong_effect_gains_more_than_its_score_promises(screen, candidate):
    """Half the square of the score is less than the gain; what is asked for allows for that."""
    fast = screen(33, {"burst-and-coast": {"exponent": 0.9}}, minutes=8.0)
    score = fast.ask(candidate("burst-and-coast"))
    nats = refit(fast, score).nats
    assert score.z < np.sqrt(2 * nats)
    assert score.z > least_z(nats)

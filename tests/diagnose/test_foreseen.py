"""Scores with another effect in the model, before they are asked again."""

import dataclasses
import math

import numpy as np
import pytest

from zfcal.diagnose import heats
from zfcal.diagnose.candidates import candidates_of
from zfcal.diagnose.foreseen import Known, foreseen, is_untouched, unforeseen
from zfcal.diagnose.naming import refit
from zfcal.diagnose.null import theory
from zfcal.diagnose.screening import ask_all
from zfcal.diagnose.selection import Asked, Selector
from zfcal.model.effects import find_effect

BOTH = {"group-cohesion": {"weight": 0.1}, "turning-bias": {"strength": 0.25}}
HEADINGS = ("turning-bias", "alignment", "wall-persistence", "leader-following", "turning-memory")


@pytest.fixture(scope="module")
def before(screen):
    """Return fish that keep together and turn left, in the model of neither."""
    return screen(31, BOTH, minutes=8.0)


@pytest.fixture(scope="module")
def cohesion(before, candidate):
    """Return the first effect's score, and the model with it."""
    score = before.ask(candidate("group-cohesion"))
    return score, refit(before, score).screen


def test_what_is_foreseen_is_what_is_found(before, cohesion, candidate):
    """To one and a half standard errors, beside one with more than nine."""
    added, after = cohesion
    assert added.z > 9
    for name in HEADINGS:
        score = before.ask(candidate(name))
        assert foreseen(score, added).z == pytest.approx(after.ask(candidate(name)).z, abs=1.5)
    assert foreseen(added, added).z == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("name", ["boldness", "freezing"])
def test_of_individuals_and_rests_nothing_is_foreseen(before, cohesion, candidate, name):
    """They are asked again whatever they were."""
    assert foreseen(before.ask(candidate(name)), cohesion[0]).z == math.inf


def test_headings_say_nothing_of_speeds(before, cohesion, candidate):
    """A score of speeds is the same to the last digit; an effect of individuals may not be."""
    added, after = cohesion
    own, memory = candidate("crowding"), candidate("turning-memory")
    assert is_untouched(before.ask(own), added.candidate)
    np.testing.assert_array_equal(before.ask(own).steps, after.ask(own).steps)
    slower = refit(before, before.ask(own)).screen
    assert is_untouched(before.ask(memory), own)
    np.testing.assert_array_equal(before.ask(memory).steps, slower.ask(memory).steps)
    assert not is_untouched(before.ask(memory), added.candidate)
    assert not is_untouched(before.ask(candidate("boldness")), own)


def test_a_second_effect_is_found_among_those_that_are_asked_again(before, tank, monkeypatch):
    """Most others are not: they were shadows, or never there."""
    effects = tuple(find_effect(name) for name in ("group-cohesion", *HEADINGS, "crowding"))
    family = Asked(candidates=candidates_of(effects, tank), held=(), null=theory(0))
    asked = []
    monkeypatch.setattr(
        "zfcal.diagnose.selection.ask_all",
        lambda screen, chosen, n: asked.append(len(chosen)) or ask_all(screen, chosen, n),
    )
    selector = Selector(listed=family, rivals=lambda *_: [], suspicious=False, n_workers=2)
    found = selector.select(before, ask_all(before, family.candidates, 2))
    assert {step.choice.best.name for step in found.steps} == set(BOTH)
    assert 0 < sum(asked) < len(family.candidates)


def test_only_what_was_asked_of_a_model_counts_there(before, cohesion, candidate):
    """Whatever is foreseen stays so beside an effect that does not touch it."""
    added, _ = cohesion
    memory, slower, rests = (
        before.ask(candidate(name)) for name in ("turning-memory", "crowding", "freezing")
    )
    asked = Known(score=memory, asked=True)
    assert asked.beside(slower) is asked
    later = asked.beside(added)
    assert not later.asked
    assert later.beside(slower) is later
    assert later.score.z == foreseen(memory, added).z
    unknown = Known(score=slower, asked=True).beside(rests)
    assert not unknown.asked
    assert unknown.score.z == math.inf
    assert unknown.beside(memory) is unknown
    assert unknown.beside(before.ask(candidate("speed-matching"))).score.z == math.inf


def test_the_clearer_the_other_the_less_is_foreseen(cohesion):
    """Two standard errors, or a tenth of its own."""
    added, _ = cohesion
    assert unforeseen(dataclasses.replace(added, z=15.0)) == 2.0
    assert unforeseen(dataclasses.replace(added, z=40.0)) == 4.0


@pytest.mark.slow
def test_three_effects_are_found_whatever_was_foreseen(screen, candidate, tank, monkeypatch):
    """Rests first, of which nothing is foreseen; headings that a part of the steps leaves out."""
    monkeypatch.setattr(heats, "HEAT_TURNS", 8000)
    three = {
        "freezing": {"rate_per_s": 0.25 * candidate("freezing").notable},
        "turning-bias": {"strength": 0.42},
        "wall-persistence": {"strength": 0.38},
    }
    own = screen(31, three, minutes=14.0)
    effects = tuple(find_effect(name) for name in (*three, *HEADINGS[1:2], "crowding"))
    family = Asked(candidates=candidates_of(effects, tank), held=(), null=theory(0))
    selector = Selector(listed=family, rivals=lambda *_: [], suspicious=False, n_workers=2)
    found = selector.select(own, ask_all(own, family.candidates, 2))
    assert {step.choice.best.name for step in found.steps} == set(three)

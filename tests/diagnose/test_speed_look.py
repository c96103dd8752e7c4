"""Features name what the law of speeds lacks; rests have a law of their own."""

from types import SimpleNamespace

import numpy as np
import pytest

from zfcal.diagnose import speed_look as looking
from zfcal.diagnose.case import open_case
from zfcal.diagnose.diagnose import _looked
from zfcal.diagnose.features.gains import Gain
from zfcal.diagnose.features.naming import Answer, Told
from zfcal.diagnose.looks import Found
from zfcal.diagnose.question import Question
from zfcal.diagnose.speed_look import gone_given, speed_look
from zfcal.model.effects import find_effect
from zfcal.model.kernels.curves import BY_TIME

LIT = {"generic:speed:place": {"strength": 0.4, "x_m": 0.22, "y_m": 0.78, "reach_m": 0.35}}


@pytest.fixture(scope="module")
def case(tank, fish, record):
    """Return the case of fish of which some effects are hidden."""

    def of(effects=None, seed=31, minutes=6.0):
        question = Question(
            samples=record(seed, effects, minutes=minutes), arena=tank, model=fish, noise_m=0.0,
            noise_source="known", n_null=5, quick=True, seed=1, n_workers=1,
        )  # fmt: skip
        return open_case(question)

    return of


def nothing(**said):
    """Return what has no features: nothing, or these."""
    return SimpleNamespace(
        listed_one=lambda _screen, **_of: said.get("rests"),
        beyond=lambda _screen, **_of: said.get("guess"),
    )


@pytest.mark.slow
def test_what_speeds_lack_is_named_one_after_the_other(case):
    """The clearest first; nothing where nothing is missing."""
    both = {"crowding": {"per_neighbour": 0.3}, "burst-and-coast": {"exponent": 0.4}}
    steps = speed_look(case(both), nothing()).steps
    assert {step.choice.best.name for step in steps} == set(both)
    assert steps[1].before is steps[0].choice.best.screen
    assert all(step.choice.ties == () for step in steps)
    assert speed_look(case(minutes=10.0), nothing()).steps == ()


@pytest.mark.slow
def test_crowding_in_a_lit_room_is_named(case):
    """A lamp makes one room fast, and fish gather there: fish are fast in company."""
    shy = LIT | {"crowding": {"per_neighbour": 0.1, "radius_m": 0.35}}
    names = [each.choice.best.name for each in speed_look(case(shy, seed=40), nothing()).steps]
    assert names == ["crowding"]


@pytest.mark.slow
def test_speeds_that_sag_and_recover_are_fatigue(case):
    """They are as fast at the end as at the beginning: the form goes by the time, as a curve."""
    ends = {"by": 1.0, "knot_1": 0.0, "knot_2": 300.0, "knot_3": 600.0}
    sag = {"per_hour": 0.0, "usual_at_s": 300.0, "more_1": 2.0, "more_3": -2.0}
    (step,) = speed_look(case({"fatigue": ends | sag}, minutes=10.0), nothing()).steps
    assert step.choice.best.name == "fatigue"
    values = step.choice.best.values
    assert values["by"] == BY_TIME
    assert values["more_1"] > 0.5
    assert values["more_3"] < -0.5


@pytest.mark.slow
def test_speeds_that_turns_go_by_are_no_crowding(case):
    """In our law the speed comes first: given the turn it depends on others, and names nothing.

    What is there given the turn stays, and what is gone is not asked again.
    """
    coupling = {"speed-turn-coupling": {"strength": 1.5}}
    own = case(coupling)
    found = _looked(own, nothing(), lambda *_: None)
    assert [each.choice.best.name for each in found.steps] == ["speed-turn-coupling"]
    both = case(coupling | {"crowding": {"per_neighbour": 0.3}})
    found = speed_look(both, nothing())
    effect = [find_effect("speed-turn-coupling")]
    assert [each.choice.best.name for each in found.steps] == ["crowding"]
    assert gone_given(found, both.screen, effect) == []
    without = speed_look(both, nothing(guess="any"), ["crowding"])
    assert "crowding" not in [each.choice.best.name for each in without.steps]


def step(name, nats=20.0):
    """Return an effect that would be added."""
    effect = find_effect(name)
    best = SimpleNamespace(
        candidate=SimpleNamespace(effect=effect), nats=nats, name=name,
        is_generic=effect.generic, screen=f"with {name}",
    )  # fmt: skip
    return SimpleNamespace(choice=SimpleNamespace(best=best))


def test_where_ranks_are_no_law_effects_are_asked_by_scores(case, monkeypatch):
    """Tracks in short pieces have no past: no features can be asked, and the name is found."""
    asked = []

    def listed_one(_screen, *, on_speed, least, has_features):
        asked.append((on_speed, has_features))

    plain = SimpleNamespace(listed_one=listed_one, beyond=lambda _screen, **_of: None)
    own = case()
    for has_law in (True, False):
        monkeypatch.setattr(looking.Paces, "has_law", property(lambda _self, law=has_law: law))
        speed_look(own, plain)
    assert asked == [(True, True), (True, False)]


def test_each_effect_is_asked_beside_those_before_it(case, monkeypatch):
    """In the model that has them, until there is none."""
    asked, answers = [], [step("freezing", 100.0), step("crowding", 40.0), None]

    def further(looks, _unfeatured, there):
        asked.append((looks.number, [e.name for e in looks.beside], [e.name for e in there]))
        found = answers.pop(0)
        return Found(steps=() if found is None else (found,), nats=30.0)

    monkeypatch.setattr(looking, "further", further)
    found = speed_look(case(), nothing())
    assert len(found.steps) == 2
    # What features of headings gain is another matter.
    assert found.nats == 0.0
    names = ["freezing", "crowding"]
    assert asked == [(n, names[:n], names[:n]) for n in range(3)]


def test_what_no_form_of_speeds_bears_out_is_suspicious(case, monkeypatch):
    """Features of speeds gain, and nothing is named."""
    told = Told(
        gain=Gain(name="crowding", label="number", log_p=np.full(300, 0.1), n_strengths=1),
        p=0.0, ties=(),
    )  # fmt: skip
    monkeypatch.setattr(looking._Looks, "ask", lambda _self: Answer(told=told))
    monkeypatch.setattr(looking._Looks, "borne_out", lambda *_: None)
    found = speed_look(case(), nothing())
    assert (found.steps, found.suspicious) == ((), True)


def test_what_is_there_in_another_form_leaves_no_guess(case):
    """Fish of which the model's crowding is too weak: its features say what is left."""
    own = case({"crowding": {"per_neighbour": 0.3}})
    looks = looking._Looks(case=own, screen=own.screen, beside=(find_effect("crowding"),))
    left, n = looks.paces.gained_beside
    assert left.sum() - n > 20
    n_samples = len(own.scene.k)
    for nats, kept in ((0.1 * left.sum(), False), (10 * left.sum(), True)):
        best = SimpleNamespace(gain=np.full(n_samples, nats / n_samples), nats=nats)
        guess = SimpleNamespace(choice=SimpleNamespace(best=best))
        assert (looks.not_left_over(guess) is guess) is kept
    alone = looking._Looks(case=own, screen=own.screen, beside=())
    assert alone.not_left_over("any") == "any"

"""Of all that a law may lack one effect is added."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from zfcal.diagnose import adding
from zfcal.diagnose.adding import further
from zfcal.diagnose.features.gains import Gain
from zfcal.diagnose.features.naming import Answer, Hidden, Told
from zfcal.model.effects import find_effect

ONE = Told(
    gain=Gain(name="alignment", label="x", log_p=np.full(400, 0.1), n_strengths=1), p=0.0, ties=()
)
LATE = Hidden(name="reaction-delay", nats=25.0, noise_nats=40.0, noise_share=0.3)


def step(name, nats=20.0, ahead=9.0):
    """Return an effect that would be added, and leads any other by so many standard errors."""
    effect = find_effect(name)
    best = SimpleNamespace(
        name=name, nats=nats, is_generic=effect.generic, over=lambda _other: ahead,
        candidate=SimpleNamespace(effect=effect),
    )  # fmt: skip
    return SimpleNamespace(choice=SimpleNamespace(best=best))


@pytest.fixture
def added(tank, monkeypatch):
    """Return what is added to a model, of what features, forms and scores say."""

    def of(
        *, told=ONE, borne_out=True, guess=None, plain=None, named=(), nats=0.0, may_doubt=True,
        outdoes=True, ties=None,
    ):  # fmt: skip
        monkeypatch.setattr(adding, "outdoes", lambda *_: outdoes)
        wanted, of.explained = {}, []

        def explain(unexplained):
            of.explained.append([each.gain.name for each in unexplained.others])
            return told

        def said(kind, found):
            def of_kind(_screen, *, on_speed, least, **_how):
                assert not on_speed
                wanted[kind] = least
                return found

            return of_kind

        look = SimpleNamespace(
            ask=lambda: Answer(
                told=told and replace(told, cause=None, ties=ties or told.ties), hidden=(LATE,)
            ),
            explained=explain,
            screen=SimpleNamespace(scene=SimpleNamespace(arena=tank)), on_speed=False,
            has_features=True, may_doubt=may_doubt, of=None, not_left_over=lambda guess: guess,
            borne_out=lambda told, _guess: (
                step(told.gain.name) if borne_out in {True, told.gain.name} else None
            ),
        )  # fmt: skip
        unfeatured = SimpleNamespace(beyond=said("guess", guess), listed_one=said("plain", plain))
        made = further(look, unfeatured, [step(n, 100.0).choice.best for n in named], nats)
        return [each.choice.best.name for each in made.steps], made, wanted

    return of


def test_what_features_name_is_added(added):
    """With what it gains by features, and what noise hides."""
    names, made, _ = added()
    assert names == ["alignment"]
    assert made.nats == pytest.approx(39.0)
    assert made.hidden == (LATE,)
    names, made, _ = added(told=None)
    assert (names, made.suspicious) == ([], False)


def test_what_nothing_bears_out_is_suspicious(added):
    """And what gains too little beside another is nothing, or what is left over from it."""
    names, made, _ = added(borne_out=False)
    assert (names, made.suspicious, made.hidden) == ([], True, (LATE,))
    assert not added(borne_out=False, may_doubt=False)[1].suspicious
    assert added(named=["turning-bias"], nats=400.0)[0] == []


def test_what_chance_may_do_once_in_a_thousand_is_not_suspicious(added):
    """Though it is enough for a name that something bears out."""
    for p, is_sure in ((0.0009, True), (0.0011, False)):
        told = replace(ONE, p=p)
        assert added(told=told, borne_out=False)[1].suspicious is is_sure
        assert added(told=told)[0] == ["alignment"]


def test_what_explains_a_name_is_asked_first(added):
    """Where nothing bears it out the name is asked itself; what it gains counts either way."""
    few = Gain(name="group-cohesion", label="x", log_p=np.full(400, 0.03), n_strengths=1)
    told = replace(ONE, cause=Told(gain=few, p=0.0, ties=(), lead=0.0))
    for borne_out, expected in (
        (True, ["group-cohesion"]), ("group-cohesion", ["group-cohesion"]),
        ("alignment", ["alignment"]), (False, []),
    ):  # fmt: skip
        names, made, _ = added(told=told, borne_out=borne_out, named=["turning-bias"], nats=100.0)
        assert names == expected
        assert made.nats == (pytest.approx(39.0) if expected else 0.0)
        assert made.suspicious is (not expected)


def test_what_explains_a_name_is_not_asked_where_that_is_not_added(added):
    """It gains too little beside another, or an effect beyond the list leads all features."""
    wall, heading = (
        step(f"generic:heading:{name}", 90.0) for name in ("wall", "neighbour-heading")
    )
    for how, times in (
        ({}, 1), ({"named": ["turning-bias"], "nats": 400.0}, 0), ({"guess": wall}, 0),
        ({"guess": wall, "outdoes": False}, 1), ({"guess": heading}, 1),
    ):  # fmt: skip
        names, _, _ = added(**how)
        assert added.explained == [[]] * times
        assert names == (
            [] if "nats" in how else ["alignment"] if times else ["generic:heading:wall"]
        )


def test_what_explains_a_name_keeps_out_another_form_of_it(added):
    """Such names alone are asked at first where an effect beyond the list leads all features."""
    turns, alike = (
        Told(gain=replace(ONE.gain, name=name), p=0.0, ties=(), lead=0.0)
        for name in ("turning-bias", "alignment")
    )
    walls = replace(ONE, gain=replace(ONE.gain, name="wall-persistence"), others=(turns, alike))
    guess = step("generic:heading:neighbour-heading", 90.0)
    names, _, _ = added(told=replace(walls, cause=alike), guess=guess)
    assert (names, added.explained) == (
        ["alignment"],
        [["alignment"], ["turning-bias", "alignment"]],
    )
    names, _, _ = added(told=walls, guess=guess)
    assert (names, added.explained) == (["generic:heading:neighbour-heading"], [["alignment"]])


def test_what_explains_a_name_is_asked_where_a_form_of_it_comes_near_the_guess(added):
    """Its features do not."""
    turns = Told(gain=replace(ONE.gain, name="turning-bias"), p=0.0, ties=(), lead=0.0)
    told, guess = replace(ONE, cause=turns), step("generic:heading:wall", 90.0, ahead=1.9)
    assert added(told=told, guess=guess)[0] == ["turning-bias"]


def test_what_explains_a_name_is_asked_where_a_tie_keeps_out_a_guess(added):
    """Though the name gains too little to be added itself."""
    told = replace(ONE, gain=replace(ONE.gain, name="wall-persistence"))
    guess = step("generic:heading:neighbour-heading", 90.0)
    names, _, _ = added(told=told, guess=guess, named=["freezing"], nats=400.0, ties=(ONE.gain,))
    assert (names, added.explained) == (["generic:heading:neighbour-heading"], [[]])


def test_the_least_chance_of_all_names_counts_for_what_has_none(added):
    """The one that gains most may have more strengths."""
    other = Told(gain=replace(ONE.gain, name="crowding"), p=1e-9, ties=(), lead=0.0)
    told = replace(ONE, p=0.005, others=(other,))
    assert added(told=told, borne_out=False)[1].suspicious
    told = replace(ONE, p=0.005, others=(replace(other, p=0.006),))
    assert not added(told=told, borne_out=False)[1].suspicious


def test_further_effects_gain_a_share_of_the_clearest(added):
    """15 % of it; half beside one beyond the list, and one beyond the list beside others."""
    rests = "freezing"
    for named, least in ((["turning-bias"], 15.0), (["generic:heading:wall"], 50.0)):
        _, _, wanted = added(named=named)
        assert wanted == {"plain": pytest.approx(least)}
    assert added(named=[rests])[2] == {"plain": 15.0, "guess": 50.0}
    assert added(named=[rests], nats=200.0)[2] == {"plain": 30.0, "guess": 100.0}
    assert added()[2] == {"plain": 0.0, "guess": 0.0}


@pytest.mark.parametrize(
    ("told", "borne_out", "plain", "guess", "expected"),
    [
        (ONE, True, None, ("generic:heading:wall", 90.0), "generic:heading:wall"),
        (ONE, True, None, ("generic:heading:wall", 90.0, 1.9), "alignment"),
        (ONE, True, None, ("generic:heading:neighbour-heading", 90.0), "alignment"),
        (ONE, False, None, ("generic:heading:wall", 90.0), "generic:heading:wall"),
        (ONE, False, None, ("generic:heading:neighbour-heading", 90.0), None),
        (None, False, None, ("generic:heading:neighbour-heading", 90.0),
         "generic:heading:neighbour-heading"),
        (ONE, True, ("freezing", 50.0), None, "freezing"),
        (ONE, True, ("freezing", 30.0), None, "alignment"),
        (ONE, False, ("freezing", 30.0), None, None),
        (None, False, ("freezing", 30.0), None, "freezing"),
        (None, False, ("freezing", 30.0), ("generic:heading:wall", 90.0), "generic:heading:wall"),
        (None, False, ("freezing", 30.0), ("generic:heading:wall", 90.0, 1.9), "freezing"),
    ],
)  # fmt: skip
def test_of_all_that_may_be_added_one_is(added, told, borne_out, plain, guess, expected):
    """Features gain 39 nats, their form 20. What has none gains more than both; a guess clearly."""
    names, _, _ = added(
        told=told,
        borne_out=borne_out,
        plain=plain and step(*plain),
        guess=guess and step(*guess),
    )
    assert names == ([] if expected is None else [expected])

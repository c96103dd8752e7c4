"""Places that fish are on one side of."""

from types import SimpleNamespace

import numpy as np
import pytest

from zfcal.diagnose.candidates import candidates_of
from zfcal.diagnose.heats import Heat, Sampled
from zfcal.diagnose.naming import Refit, refit
from zfcal.diagnose.null import theory
from zfcal.diagnose.scores import Score
from zfcal.diagnose.screening import Screen, ask_all
from zfcal.diagnose.selection import Asked, Best, Selector
from zfcal.diagnose.sides import directions, feigned, one_sided, with_direction
from zfcal.model.effects import find_effect
from zfcal.model.extended import maximise
from zfcal.model.kernels.state import STATES, X

DRIFT = {"directional-drift": {"strength": 0.4, "direction_rad": 1.2, "by_slowness": 1.0}}
PLACE = {"place-preference": {"strength": 1.5, "x_m": 0.25, "y_m": 0.75, "reach_m": 0.3}}

SHARES = np.linspace(0.5, 1.5, 100) / 100.0
"""Of what is gained each sample has so much."""


@pytest.fixture
def suspect(candidate):
    """Return what makes a suspect up that gains so many nats, of fish at these points."""

    def of(name, nats, points=(), **values):
        states = np.zeros((len(points), STATES, 1))
        states[:, :2, 0] = np.reshape(points, (-1, 2))
        at = np.arange(len(points))
        turns = SimpleNamespace(at=at, who=np.zeros_like(at))
        scene = SimpleNamespace(states=states, turns=turns)
        return Refit(
            candidate=candidate(name), screen=SimpleNamespace(scene=scene), values=values,
            interval={}, gain=(nats + 1.0) * SHARES, n_free=1,
        )  # fmt: skip

    return of


@pytest.mark.parametrize(
    ("points", "expected"),
    [
        ([(0, 0), (0.1, 0)], 1.0),
        ([(0, 0), (2, 0)], 0.0),
        ([(0, 0), (1, 1)], np.sqrt(0.5)),
        ([(0, 0), (1, 101)], 1.0),
    ],
)
def test_sides_by_hand(suspect, points, expected):
    """A place at (1, 0): both west of it; west and east; west and north; one out of its reach."""
    place = suspect("place-preference", 1.0, points, x_m=1.0, y_m=0.0, reach_m=2.0)
    assert one_sided(place) == pytest.approx(expected, abs=0.06)


AT = {"x_m": 1.0, "y_m": 0.0, "reach_m": 2.0}
WITHOUT = SimpleNamespace(fitted=SimpleNamespace(parameters=SimpleNamespace(effects={})))


def test_a_place_on_one_side_must_gain_clearly_more_than_a_direction(suspect):
    """1.2 and 1.6 times what the direction gains; round it both count, and alone any."""
    drift, other = suspect("directional-drift", 100.0), suspect("alignment", 10.0)
    little, clear = (suspect("place-preference", n, [(0, 0)], **AT) for n in (120.0, 160.0))
    inside = suspect("place-preference", 120.0, [(0, 0), (2, 0)], **AT)
    assert feigned([little, drift, other], WITHOUT) == [little]
    for place in (clear, inside):
        assert feigned([place, drift, other], WITHOUT) == []
    assert feigned([little, other], WITHOUT) == []


def test_beside_a_direction_in_the_model_a_place_must_gain_half_of_what_it_does(
    screen, candidate, suspect
):
    """What a current leaves over is no place, whether the current was found or came with it."""
    own = screen(31, DRIFT)
    drift = refit(own, own.ask(candidate("directional-drift")))
    for points in ([(0, 0)], [(0, 0), (2, 0)]):
        # Fish that are all on one side of it, and fish all round it.
        little, clear = (
            suspect("place-preference", share * drift.nats, points, **AT) for share in (0.4, 0.6)
        )
        assert feigned([little], drift.screen) == [little]
        assert feigned([clear], drift.screen) == []


def chosen(worth, aside):
    """Return what is chosen of suspects; all of them stand beside each other."""
    selector = Selector(listed=None, rivals=None, suspicious=False, n_workers=1)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(Selector, "_stands", lambda *_: True)
        choice = selector._choose(worth, aside)
    return choice and choice.best


def test_what_is_beyond_the_list_must_beat_what_is_put_aside(suspect):
    """Of 140 nats it is more than a quarter ahead of the drift's 100 alone, of 200 of both."""
    drift, place = suspect("directional-drift", 100.0), suspect("place-preference", 130.0)
    little, clear = (suspect("generic:heading:wall", nats) for nats in (140.0, 200.0))
    assert chosen([drift, place, little], [place]) is drift
    assert chosen([drift, place, clear], [place]) is clear
    assert chosen([drift, little], []) is little
    assert chosen([place, little], [place]) is None
    assert chosen([place, clear], [place]) is clear


def test_what_is_put_aside_leaves_a_direction_that_is_worth_as_much(suspect):
    """Though it alone would gain too little; the same direction is not there twice."""
    drift, place = suspect("directional-drift", 5.0), suspect("place-preference", 7.0)
    assert directions([drift, place], [place]) == [drift]
    assert directions([drift, place], [place, drift]) == []


def test_what_is_explained_better_beyond_the_list_is_no_further_effect(selected_beside):
    """A guess of 118 nats says more than a place of 54, and less than half of a drift of 316."""
    assert selected_beside(place=54.0, guess=118.0) is None
    assert selected_beside(place=110.0, guess=118.0) == "place-preference"
    assert selected_beside(place=54.0, guess=200.0) == "generic:heading:wall"


@pytest.fixture
def selected_beside(suspect, monkeypatch):
    """Return what names the effect that is found after a drift: of a place, and of a guess."""
    drift = SimpleNamespace(choice=SimpleNamespace(best=suspect("directional-drift", 316.0)))

    def of(*, place, guess):
        nats = {"place-preference": place, "generic:heading:wall": guess}
        bests = [
            Best(score=heat_of(suspect(name, 0.0)).score, z=9.0, p=0.0, information=1.0)
            for name in nats
        ]
        whole = SimpleNamespace(scene=SimpleNamespace(turns=()), fitted=None)
        selector = Selector(listed=None, rivals=lambda *_: bests[1:], suspicious=False, n_workers=1)
        monkeypatch.setattr(Selector, "_stands", lambda *_: True)
        monkeypatch.setattr(
            Selector, "_refits",
            lambda _, __, heats: [
                suspect(heat.score.candidate.name, nats[heat.score.candidate.name])
                for heat in heats
            ],
        )  # fmt: skip
        monkeypatch.setattr("zfcal.diagnose.selection.feigned", lambda *_: [])
        step, _ = selector._step(Sampled(whole=whole), bests[:1], [drift])
        return step and step.choice.best.name

    return of


def heat_of(first):
    """Return the heat that a suspect has run."""
    score = Score(candidate=first.candidate, z=9.0, strength=1.0, information=1.0, steps=None)
    return Heat(score=score, first=first, share=4)


def test_a_direction_comes_along_with_a_place_on_one_side(suspect):
    """Whatever it gained in its heat; not with a place that fish are round, nor without one."""
    direction = heat_of(suspect("directional-drift", 1.0))
    sided = heat_of(suspect("place-preference", 100.0, [(0, 0)], **AT))
    inside = heat_of(suspect("place-preference", 100.0, [(0, 0), (2, 0)], **AT))
    other = heat_of(suspect("alignment", 99.0))
    assert with_direction([sided, other], [sided, other, direction]) == [sided, other, direction]
    assert with_direction([sided, direction], [sided, direction]) == [sided, direction]
    assert with_direction([inside, other], [inside, other, direction]) == [inside, other]
    assert with_direction([other], [other, direction]) == [other]


@pytest.mark.slow
@pytest.mark.parametrize(("effects", "kept"), [(DRIFT, False), (PLACE, True)])
def test_a_current_is_no_place(screen, candidate, effects, kept):
    """A current pulls the same way everywhere, whatever place comes near it; a place does not."""
    own = screen(31, effects)
    asked = [candidate("directional-drift"), candidate("place-preference", x_m=0.25, y_m=0.75)]
    drift, place = (refit(own, own.ask(each)) for each in asked)
    assert (one_sided(place) < 0.8) is kept
    assert (place not in feigned([drift, place], own)) is kept


@pytest.fixture
def selected(tank):
    """Return what names the effects that a screen lacks, of a direction and places."""
    both = tuple(find_effect(name) for name in ("directional-drift", "place-preference"))
    family = Asked(candidates=candidates_of(both, tank), held=(), null=theory(0))
    selector = Selector(listed=family, rivals=lambda *_: [], suspicious=False, n_workers=2)

    def of(screen):
        steps = selector.select(screen, ask_all(screen, family.candidates, 2)).steps
        return [step.choice.best.name for step in steps]

    return of


def test_a_current_that_is_not_the_same_everywhere_is_named(selected, worlds, base, fish):
    """From nothing at one end of the tank to all of it at the other: there is no place in it."""
    scene, fitted = base
    x_m = scene.states[scene.turns.at, X, scene.turns.who]
    strength = 1.2 * (x_m - x_m.min()) / np.ptp(x_m)
    rng = np.random.default_rng(2)
    drawn = worlds.redrawn(
        scene, fitted, rng, lambda angle: np.exp(strength[:, None] * np.cos(angle - 1.2))
    )
    own = Screen(scene=drawn, fitted=maximise(drawn, fish))
    assert selected(own) == ["directional-drift"]


def test_a_place_is_named_alone(selected, screen):
    """Though a direction comes into question as well."""
    assert selected(screen(31, PLACE)) == ["place-preference"]

"""What has no features: rests, and effects beyond the list."""

import dataclasses
from types import SimpleNamespace

import pytest

from zfcal.diagnose import beyond as asking
from zfcal.diagnose.beyond import Unfeatured
from zfcal.diagnose.case import open_case
from zfcal.diagnose.null import theory
from zfcal.diagnose.question import Question
from zfcal.diagnose.screening import ask_all
from zfcal.diagnose.selection import Asked, best_of

WALLS = {"generic:heading:wall": {"strength": -0.8}}
RESTS = {"freezing": {"rate_per_s": 0.02, "duration_s": 4.0}}


@pytest.fixture(scope="module")
def unfeatured(tank, fish, record):
    """Return what asks of six minutes of fish for what has no features."""

    def of(effects=None, seed=31, *, suspicious=False, **changes):
        known = {"noise_m": 0.0, "noise_source": "known", "n_null": 5, "quick": True}
        question = Question(
            samples=record(seed, effects, minutes=6.0), arena=tank, model=fish, seed=1, n_workers=2,
            **{**known, **changes},
        )  # fmt: skip
        case = open_case(question)
        family = Asked(candidates=case.listed, held=(), null=theory(0))
        scores = ask_all(case.screen, case.listed, 2)
        return Unfeatured(
            case=case, listed=family, screened=tuple(best_of(family, scores)), suspicious=suspicious
        )

    return of


@pytest.fixture(scope="module")
def at_walls(unfeatured):
    """Return what asks of fish that are drawn to walls."""
    return unfeatured(WALLS)


@pytest.mark.slow
def test_what_is_beyond_the_list_is_found_and_holds(at_walls):
    """Of headings, and of them alone; in the model that lacked it."""
    step = at_walls.beyond(at_walls.case.screen, on_speed=False)
    assert step.choice.best.name == "generic:heading:wall"
    assert step.choice.best.values["strength"] < -0.4
    assert step.before is at_walls.case.screen
    assert at_walls.beyond(at_walls.case.screen, on_speed=True) is None
    again = at_walls.beyond(step.choice.best.screen, on_speed=False)
    assert again is None or again.choice.best.name != "generic:heading:wall"


@pytest.mark.slow
def test_it_gains_what_is_asked_and_holds_on_held_out_steps(at_walls, monkeypatch):
    """More than so many nats; an effect that does not hold is none."""
    screen = at_walls.case.screen
    assert at_walls.beyond(screen, on_speed=False, least=1e4) is None
    monkeypatch.setattr(asking, "holds", lambda *_, **__: False)
    assert at_walls.beyond(screen, on_speed=False) is None


@pytest.mark.slow
def test_where_nothing_stands_out_nothing_beyond_the_list_is_asked(at_walls, monkeypatch):
    """It costs time; a suspicion is enough to ask."""
    quiet = dataclasses.replace(
        at_walls, screened=tuple(dataclasses.replace(best, p=0.5) for best in at_walls.screened)
    )
    assert not quiet.stands_out
    assert quiet.beyond(quiet.case.screen, on_speed=False) is None
    doubted = dataclasses.replace(quiet, suspicious=True)
    assert doubted.beyond(doubted.case.screen, on_speed=False) is not None


def test_other_forms_of_what_is_there_are_not_asked(at_walls, monkeypatch):
    """A speed that follows the last one in a line is burst and coast."""
    asked = []

    def none_clear(_screen, candidates, _n):
        asked.extend(each.name for each in candidates)
        return []

    monkeypatch.setattr(asking, "ask_all", none_clear)
    for effects, is_asked in (({}, True), ({"burst-and-coast": {}}, False)):
        asked.clear()
        parameters = SimpleNamespace(effects=effects)
        screen = SimpleNamespace(fitted=SimpleNamespace(parameters=parameters))
        assert at_walls.beyond(screen, on_speed=True) is None
        assert ("generic:speed:own-speed" in asked) is is_asked


@pytest.mark.slow
def test_fish_that_rest_now_and_then_are_found(unfeatured):
    """By their chain of moves and rests; not again beside it, and not of fish that do not rest."""
    own = unfeatured(RESTS)
    step = own.listed_one(own.case.screen, on_speed=True)
    assert step.choice.best.name == "freezing"
    assert own.listed_one(step.choice.best.screen, on_speed=True) is None
    assert own.listed_one(own.case.screen, on_speed=True, least=1e6) is None
    plain = unfeatured()
    assert plain.listed_one(plain.case.screen, on_speed=True) is None


def test_the_clearest_are_put_into_the_model_and_the_worthiest_that_holds_is_taken(
    at_walls, monkeypatch
):
    """At most three, none with less than half of the standard errors of the first."""
    made, held = [], []

    def refitted(_screen, score, n_workers):
        made.append(score)
        return SimpleNamespace(
            nats=10.0 + score, worth=score, is_generic=score == 13, over=lambda _other: 1.0
        )

    def hold(step, n_workers):
        held.append(step.best.score)
        return step.best.score != 20

    monkeypatch.setattr(asking, "refit", refitted)
    monkeypatch.setattr(asking, "holds", hold)

    def ranked(*z):
        return [SimpleNamespace(z=each, score=each) for each in z]

    step = at_walls._added("screen", ranked(20, 12, 11, 10.5), 0.0)
    assert made == [20, 12, 11]
    assert held == [20, 12]
    assert step.best.score == 12
    assert len(step.choice.ties) == 2
    assert at_walls._added("screen", ranked(20, 13), 0.0).choice.ties == ()
    made.clear()
    assert at_walls._added("screen", ranked(15, 7), 0.0).best.score == 15
    assert made == [15]
    assert at_walls._added("screen", [], 0.0) is None


def test_a_listed_one_without_features_is_there_all_the_time(at_walls, monkeypatch):
    """Rests and individuals come and go by nature; an effect of one's own does not."""
    monkeypatch.setattr(asking, "is_featured", lambda effect, _arena: effect.name != "turning-bias")
    monkeypatch.setattr(Unfeatured, "_added", lambda _self, _screen, ranked, _least: ranked)
    screened = tuple(dataclasses.replace(best, p=1e-9) for best in at_walls.screened)
    own = dataclasses.replace(at_walls, screened=screened)
    for steady, pulsed, n in ((True, False, 1), (False, False, 0), (True, True, 0)):
        monkeypatch.setattr(asking, "is_steady", lambda *_, told=steady: told)
        monkeypatch.setattr(asking, "has_pulses", lambda *_, told=pulsed: told)
        found = own.listed_one(own.case.screen, on_speed=False)
        assert [best.score.candidate.name for best in found] == ["turning-bias"] * n


def test_where_features_cannot_be_asked_all_effects_are_without(at_walls, monkeypatch):
    """Speeds of tracks in short pieces, say."""
    monkeypatch.setattr(Unfeatured, "_added", lambda _self, _screen, ranked, _least: ranked)
    monkeypatch.setattr(asking, "is_steady", lambda *_: True)
    monkeypatch.setattr(asking, "has_pulses", lambda *_: False)
    screened = tuple(dataclasses.replace(best, p=1e-9) for best in at_walls.screened)
    own = dataclasses.replace(at_walls, screened=screened)
    names = {
        has_features: {
            best.score.candidate.name
            for best in own.listed_one(
                own.case.screen, on_speed=True, has_features=has_features
            )
        }
        for has_features in (True, False)
    }  # fmt: skip
    assert names[True] == {"freezing"}
    assert names[False] >= {"freezing", "crowding", "fatigue", "burst-and-coast"}


@pytest.mark.slow
def test_where_positions_err_replicates_are_asked_as_well(unfeatured, monkeypatch):
    """What noise does to an effect beyond the list is taken off."""
    own = unfeatured(WALLS, noise_m=5e-4)
    assert own.beyond(own.case.screen, on_speed=False) is not None
    chance = SimpleNamespace(ask=lambda _candidate: SimpleNamespace(z=-60.0))
    monkeypatch.setattr(
        asking, "run_null", lambda _chain, ask, some, **_: [ask(k, chance) for k in some]
    )
    assert own.beyond(own.case.screen, on_speed=False) is None

"""Features name what no form of ours shows, and take the place of what gains less."""

import dataclasses
import math
from types import SimpleNamespace

import numpy as np
import pytest

from zfcal.diagnose import diagnose as whole
from zfcal.diagnose import looks as common
from zfcal.diagnose import second_look as looking
from zfcal.diagnose.case import open_case
from zfcal.diagnose.diagnose import diagnose
from zfcal.diagnose.features.gains import Gain
from zfcal.diagnose.features.law import Law
from zfcal.diagnose.features.naming import Told
from zfcal.diagnose.findings import Verdict
from zfcal.diagnose.looks import Found, bound, level_of, stays
from zfcal.diagnose.naming import Choice
from zfcal.diagnose.question import Question
from zfcal.diagnose.screening import Screen
from zfcal.diagnose.second_look import _noise_nats, second_look
from zfcal.diagnose.selection import LEVEL, Best, Step
from zfcal.model.effects import find_effect
from zfcal.model.extended import maximise

NOTHING = Found(steps=(), confirmed=())


@pytest.fixture(scope="module")
def question(tank, fish, record):
    """Return what asks of ten minutes of fish."""

    def of(effects=None, seed=31, **changes):
        known = {"noise_m": 0.0, "noise_source": "known", "n_null": 5, "quick": True}
        return Question(
            samples=record(seed, effects), arena=tank, model=fish, seed=1, n_workers=2,
            **{**known, **changes},
        )  # fmt: skip

    return of


@pytest.fixture(scope="module")
def drawn(question, worlds):
    """Return a case of steps of which 5 % are drawn about a place, from one room and no farther."""
    case = open_case(question())
    scene, fitted = case.scene, case.screen.fitted
    mixture, _, _ = fitted.tables()
    own = scene.states[scene.turns.at, :, scene.turns.who]
    way = np.array([0.8, 0.2]) - own[:, :2]
    bearing, far = np.arctan2(way[:, 1], way[:, 0]), np.hypot(*way.T)

    def factor(angle):
        law = np.exp(4.0 * (np.cos(angle - bearing[:, None]) - 1))
        law *= len(angle) / (2 * math.pi) / law.sum(axis=1, keepdims=True)
        near = ((own[:, 0] > own[:, 1]) & (far < 0.35))[:, None]
        return 1 + 0.06 * near * law / np.maximum(mixture, 1e-12)

    there = worlds.redrawn(scene, fitted, np.random.default_rng(3), factor)
    screen = Screen(scene=there, fitted=maximise(there, fitted.parameters))
    return dataclasses.replace(case, scene=there, screen=screen)


@pytest.mark.slow
def test_what_features_name_goes_into_the_model_in_our_nearest_form(drawn):
    """A place, of which some headings are drawn, at where it is."""
    now = second_look(drawn, NOTHING)
    (only,), (confirmed,) = now.steps, now.confirmed
    best = only.choice.best
    assert best.name == "place-preference"
    assert best.values["drawn"] == 1.0
    assert best.values["strength"] > 0.005
    assert math.hypot(best.values["x_m"] - 0.8, best.values["y_m"] - 0.2) < 0.1
    assert best.nats > 10
    assert only.best.p < 1e-4
    assert confirmed.holds
    assert confirmed.steady
    assert confirmed.gain_nats_per_step > 0


@pytest.mark.slow
def test_nothing_is_named_where_nothing_is_missing(question):
    """Nor where the model has the effect already."""
    case = open_case(question())
    assert second_look(case, NOTHING) is None


def gain(name, values):
    """Return a gain of one strength at each step."""
    return Gain(name=name, label="x", log_p=values, n_strengths=1)


@pytest.fixture(scope="module")
def law(base):
    """Return that of ten minutes of fish that do as the base model does."""
    scene, fitted = base
    return Law(scene=scene, fitted=fitted)


@pytest.mark.parametrize(
    ("generic", "share", "kept"),
    [
        (False, 1.0, True),
        (False, 0.5, False),
        (True, 1.0, False),
        (True, 0.5, False),
        (True, 3.0, True),
    ],
)
def test_what_was_named_stays_by_what_it_gains(law, generic, share, kept):
    """A listed one where it gains as much as features do; one beyond the list has to gain more."""
    n = len(law.rows)
    values = np.random.default_rng(4).normal(0.02, 0.1, n)
    by = np.bincount(law.turns.at, share * values, minlength=len(law.scene.k))
    # Two forms of one effect differ from step to step.
    apart = np.random.default_rng(6).normal(0, 0.1, len(by))
    by += apart - apart.mean()
    there = SimpleNamespace(name="other", gain=by, nats=by.sum() - 1, is_generic=generic)
    told = Told(gain=gain("place-preference", values), p=1e-6, ties=())
    assert stays(there, told, law.scene, law.turns.at) is kept


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("group-cohesion", {"weight": 2.5}),
        ("directional-drift", {"strength": 1.5, "direction_rad": 2.0}),
        ("place-preference", {"strength": 3.0, "x_m": 0.3, "y_m": 0.8}),
    ],
)
def test_a_name_gets_the_form_that_the_fish_have(question, name, values):
    """Fish that turn to something look as if all their headings leaned toward it, or to a place."""
    given = {**values, "turning": 1.0}
    (effect,) = diagnose(question({name: given}), lambda *_: None).effects
    strength = find_effect(name).strength
    assert (effect.name, effect.strength["turning"]) == (name, 1.0)
    low, high = effect.interval[strength]
    assert low < values[strength] < high


@pytest.mark.slow
@pytest.mark.parametrize("direction_rad", [2.0, 2.0 - math.pi])
def test_of_a_direction_and_its_opposite_the_right_one_is_fitted(question, direction_rad):
    """Their scores have the same size: only the sign tells which of them fish prefer."""
    given = {"strength": 0.3, "direction_rad": direction_rad}
    case = open_case(question({"directional-drift": given}))
    found, _ = common.in_the_model(case, case.screen, "directional-drift")
    assert found.values["turning"] == found.values["drawn"] == 0.0
    assert found.interval["strength"][0] > 0.1
    assert abs(math.remainder(found.values["direction_rad"] - direction_rad, math.tau)) < 0.5


@pytest.mark.slow
def test_a_place_that_all_fish_have_on_one_side_is_a_direction(question):
    """Features of places that fish turn to bend to any direction, and gain as much as it."""
    given = {"strength": 0.8, "direction_rad": 2.0, "turning": 1.0}
    case = open_case(question({"directional-drift": given}))
    (named,) = second_look(case, NOTHING).steps
    assert named.choice.best.name == "directional-drift"
    assert named.choice.ties == ()


def test_what_says_the_same_in_another_form_gets_the_listed_name(law):
    """A neighbour's heading, beyond the list, is alignment, whatever it gains by itself."""
    values = np.full(len(law.rows), 0.1)
    by = 5 * np.bincount(law.turns.at, values, minlength=len(law.scene.k))
    told = Told(gain=gain("alignment", values), p=0.0, ties=())
    for name, kept in (
        ("generic:heading:neighbour-heading", False),
        ("generic:heading:wall", True),
    ):
        there = SimpleNamespace(name=name, gain=by, nats=by.sum() - 1, is_generic=True)
        assert stays(there, told, law.scene, law.turns.at) is kept


@pytest.mark.slow
def test_noise_alone_gains_something(question):
    """Of a response that is a little late, on replicates with half a millimetre of noise."""
    case = open_case(question(noise_m=5e-4))
    late = Gain(name="reaction-delay", label="a tenth of a step", log_p=np.zeros(3), n_strengths=1)
    (nats,) = _noise_nats(case, [late])
    assert 0 < nats < 40


@pytest.mark.slow
def test_a_diagnosis_names_what_features_name(question, monkeypatch):
    """Where forms named nothing the verdict is that of the features, with a strength."""
    asked = question({"directional-drift": {"strength": 0.07, "direction_rad": 2.0, "drawn": 1.0}})
    plain = whole._judged
    kept = []

    def nothing(*args):
        judged = plain(*args)
        kept.append([step.choice.best.name for step in judged.kept])
        return dataclasses.replace(judged, kept=(), confirmed=(), suspicious=True)

    monkeypatch.setattr(whole, "_judged", nothing)
    found = diagnose(asked, lambda *_: None)
    assert found.verdict is Verdict.NAMED
    (effect,) = found.effects
    assert effect.name == "directional-drift"
    assert effect.strength["drawn"] == 1.0
    assert effect.strength["strength"] == pytest.approx(0.07, abs=0.03)
    assert effect.gain_nats_per_step > 0


@pytest.fixture
def looked(monkeypatch):
    """Return what is asked of features, look by look, and what they are to say of each."""
    calls, answers = [], []

    def named(looks, **how):
        calls.append((looks, how))
        return answers.pop(0) if answers else None

    monkeypatch.setattr(looking, "_named", named)
    return calls, answers


def step(name, screen, nats=20.0):
    """Return an effect that was named, in a model of that screen."""
    effect = SimpleNamespace(effect=find_effect(name))
    best = SimpleNamespace(
        candidate=effect, screen=screen, nats=nats, name=name, is_generic=":" in name
    )
    return Step(
        choice=Choice(best=best, ties=(), considered=(best,)),
        best=Best(score="score", z=9.0, p=1e-9, information=1.0),
        before="before",
    )


def found(*names, nats=20.0, **more):
    """Return that these were found."""
    steps = tuple(step(name, f"with {name}", nats) for name in names)
    return Found(steps=steps, confirmed=names, nats=nats, **more)


def test_features_are_asked_of_the_model_as_it_is(question, looked):
    """Where nothing was named."""
    case = open_case(question())
    assert second_look(case, NOTHING) is None
    ((looks, how),) = looked[0]
    assert (looks.case, looks.screen, looks.beside) == (case, case.screen, ())
    assert how == {"there": None}


def test_what_no_form_bears_out_is_unexplained_where_nothing_else_was_named(question, looked):
    """Beside what was named nothing changes, and further looks go on."""
    case = open_case(question())
    doubt = Found(steps=(), confirmed=(), nats=30.0, suspicious=True)
    looked[1].append(doubt)
    assert second_look(case, NOTHING) is doubt
    looked[1].append(doubt)
    assert second_look(case, found("turning-bias")) is None
    assert [looks.number for looks, _ in looked[0]] == [0, 0, 1]


@pytest.mark.slow
def test_a_name_without_a_form_of_ours_is_unexplained(question, monkeypatch):
    """Features gain, no form does and the name does not lead: the verdict says so."""
    asked = question({"directional-drift": {"strength": 0.07, "direction_rad": 2.0, "drawn": 1.0}})
    plain = whole._judged
    monkeypatch.setattr(
        whole, "_judged",
        lambda *args: dataclasses.replace(plain(*args), kept=(), confirmed=(), suspicious=False),
    )  # fmt: skip
    monkeypatch.setattr(looking, "gains_by_itself", lambda _form: False)
    monkeypatch.setattr(looking, "BY_ITSELF", math.inf)
    monkeypatch.setattr(looking._Looks, "explains", lambda *_: False)
    assert diagnose(asked, lambda *_: None).verdict is Verdict.UNEXPLAINED


def test_looks_share_a_level():
    """The first ones at speeds and at headings have it together, and so have all that follow."""
    assert 2 * level_of(0) == LEVEL
    assert 2 * sum(level_of(k) for k in range(1, 30)) == pytest.approx(LEVEL)


def test_where_noise_is_not_known_it_is_that_of_the_likeliest_law(question):
    """Of exact positions that is none; the note says where it is from."""
    case = open_case(question(noise_m=None, noise_source="unknown"))
    assert case.noise_is_likely
    assert case.question.noise_m == 0.0
    assert case.question.noise_source == "the law of headings"
    assert not open_case(question(noise_m=0.0)).noise_is_likely


def test_likely_noise_is_held_against_none(question):
    """Since a late response makes a law of noise likelier as well; known noise is not doubted."""
    case = open_case(question())
    for is_likely, levels in ((True, [4e-4, 0.0]), (False, [4e-4])):
        noisy = dataclasses.replace(
            case,
            question=dataclasses.replace(case.question, noise_m=4e-4),
            noise_is_likely=is_likely,
        )
        looks = looking._Looks(case=noisy, screen=case.screen, beside=())
        assert [law.noise_m for law in looks.laws] == levels
        # Of exact positions the exact law is likelier: then nothing is gained over the noisy one.
        gains = looks.gains([find_effect("turning-bias")], ())
        assert {gain.without_noise for gain in gains} == {is_likely}
        assert len(gains) == len(find_effect("turning-bias").features(case.scene.arena))
        explained = dataclasses.replace(looks, without_noise=True)
        assert [law.noise_m for law in explained.laws] == [0.0]


def test_effects_that_the_model_came_with_are_there(question, fish, looked):
    """On headings: of speeds features say nothing."""
    for name, values, n in (("turning-bias", {"strength": 0.2}, 1), ("crowding", {}, 0)):
        own = dict(zip(find_effect(name).names, find_effect(name).values(values), strict=True))
        model = dataclasses.replace(fish, effects={name: own})
        assert second_look(open_case(dataclasses.replace(question(), model=model)), NOTHING) is None
        assert [effect.name for effect in looked[0].pop()[0].beside] == [name] * n


def test_the_first_effect_on_headings_is_held_against_features(question, looked, monkeypatch):
    """In the model before it: those on speed stay or are added anew, others after it go."""
    case, (calls, answers) = open_case(question()), looked

    def anew(_case, screen, name):
        assert screen == "with reaction-delay"
        return step(name, f"{screen} and {name}").choice.best, "its score there"

    monkeypatch.setattr(common, "in_the_model", anew)
    before = found("crowding", "alignment", "turning-bias", "fatigue")
    answers.append(found("reaction-delay", without_noise=True))
    now = second_look(case, before)
    assert calls[0][0].screen == "with crowding"
    assert calls[0][1] == {"there": before.steps[1]}
    names = ["crowding", "reaction-delay", "fatigue"]
    assert [each.choice.best.name for each in now.steps] == names
    assert list(now.confirmed) == names
    assert now.steps[-1].choice.best.screen == "with reaction-delay and fatigue"
    assert (now.steps[-1].before, now.steps[-1].best.score) == (
        "with reaction-delay",
        "its score there",
    )


def test_what_was_named_after_an_effect_that_gives_way_is_put_back(question, monkeypatch):
    """In the model that there is now; what is there already is not there twice."""
    case = open_case(question())

    def anew(_case, screen, name):
        return step(name, f"{screen} and {name}").choice.best, "its score there"

    monkeypatch.setattr(common, "in_the_model", anew)
    before = found("generic:speed:own-speed", "turning-bias", "burst-and-coast", "freezing")
    later = zip(before.steps[1:], before.confirmed[1:], strict=True)
    now = common.with_again(case, found("burst-and-coast"), later)
    names = ["burst-and-coast", "turning-bias", "freezing"]
    assert [each.choice.best.name for each in now.steps] == names
    assert list(now.confirmed) == names
    assert now.steps[2].before == "with burst-and-coast and turning-bias"


def test_further_effects_are_looked_for_beside_what_is_there(question, looked):
    """Each gains 15 % of what the clearest one does; what noise seemed to do stays explained."""
    case, (calls, answers) = open_case(question()), looked
    answers += [found("reaction-delay", nats=400.0, without_noise=True), found("turning-bias")]
    now = second_look(case, NOTHING)
    assert [each.choice.best.name for each in now.steps] == ["reaction-delay", "turning-bias"]
    assert [[effect.name for effect in looks.beside] for looks, _ in calls] == [
        [],
        ["reaction-delay"],
        ["reaction-delay", "turning-bias"],
    ]
    assert [looks.without_noise for looks, _ in calls] == [False, True, True]
    assert [how.get("least") for _, how in calls] == [None, 60.0, 60.0]


def test_beside_a_guess_a_further_effect_gains_half_as_much(question, looked):
    """One beyond the list has no features, so its left-overs answer to those of others."""
    case, (calls, answers) = open_case(question()), looked
    answers += [None, None]
    assert second_look(case, found("generic:heading:wall", nats=80.0)) is None
    assert [how.get("least") for _, how in calls] == [None, 40.0]


def test_what_stays_is_beside_further_effects(question, looked):
    """Features that name nothing else leave what was named, and add to it."""
    case, (_, answers) = open_case(question()), looked
    answers += [None, found("turning-bias")]
    now = second_look(case, found("alignment"))
    assert [each.choice.best.name for each in now.steps] == ["alignment", "turning-bias"]
    answers += [None, None]
    assert second_look(case, found("alignment")) is None


@pytest.mark.slow
def test_a_second_effect_is_named_beside_the_first(question):
    """Of two, each in a form of ours, features name both; a tie needs something to say."""
    both = {
        "directional-drift": {"strength": 0.07, "direction_rad": 2.0, "drawn": 1.0},
        "wall-persistence": {"strength": 0.5},
    }
    now = second_look(open_case(question(both)), NOTHING)
    assert {each.choice.best.name for each in now.steps} == set(both)
    assert all(not each.choice.ties for each in now.steps)


def test_noise_seldom_gains_more_than_itsbound():
    """Of three features of which six replicates are known one exceeds it in 2 % of cases."""
    rng = np.random.default_rng(5)
    gains = rng.normal(40.0, 6.0, (4000, 7, 3))
    beyond = [(case[6] > bound(case[:6])).any() for case in gains]
    assert 0.014 < np.mean(beyond) < 0.026

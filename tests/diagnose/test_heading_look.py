"""Features name what the law of headings lacks, one after the other."""

import dataclasses
import math
from types import SimpleNamespace

import numpy as np
import pytest

from zfcal.diagnose import heading_look as looking
from zfcal.diagnose import looks as common
from zfcal.diagnose.candidates import candidate_of
from zfcal.diagnose.case import open_case
from zfcal.diagnose.diagnose import diagnose
from zfcal.diagnose.features.false_gains import ByNoise
from zfcal.diagnose.features.gains import Gain, idle_of
from zfcal.diagnose.features.law import Law
from zfcal.diagnose.features.naming import Hidden, Told, tried
from zfcal.diagnose.findings import Verdict
from zfcal.diagnose.heading_look import _noise_of, heading_look
from zfcal.diagnose.looks import Found, clearest_first, level_of, outdoes
from zfcal.diagnose.naming import Choice
from zfcal.diagnose.question import Question
from zfcal.diagnose.screening import Screen
from zfcal.diagnose.selection import LEVEL, Best, Step
from zfcal.model.effects import find_effect
from zfcal.model.extended import maximise
from zfcal.model.kernels.curves import BY_NEAREST

NOTHING = Found()
IDLE = frozenset({("turning-bias", "offset", True)})


def no_guess(guess=None):
    """Return what says of each model that there is nothing beyond the list, or this."""
    return SimpleNamespace(
        beyond=lambda _screen, **_of: guess, listed_one=lambda _screen, **_of: None
    )


def asked(case, before, guess=None):
    """Return the effects that are found."""
    return heading_look(case, before, no_guess(guess))


@pytest.fixture(scope="module")
def question(tank, fish, record):
    """Return what asks of some minutes of fish."""

    def of(effects=None, seed=31, minutes=6.0, **changes):
        known = {"noise_m": 0.0, "noise_source": "known", "n_null": 5, "quick": True}
        samples = record(seed, effects, minutes=minutes)
        asked = {"samples": samples, "arena": tank, "model": fish, "seed": 1, "n_workers": 1}
        return Question(**{**asked, **known, **changes})

    return of


@pytest.fixture(scope="module")
def drawn(question, worlds):
    """Return a case of steps of which 7 % are drawn about a place, from one room and no farther."""
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
        return 1 + 0.08 * near * law / np.maximum(mixture, 1e-12)

    there = worlds.redrawn(scene, fitted, np.random.default_rng(3), factor)
    screen = Screen(scene=there, fitted=maximise(there, fitted.parameters))
    return dataclasses.replace(case, scene=there, screen=screen)


@pytest.mark.slow
def test_what_features_name_goes_into_the_model_in_our_nearest_form(drawn):
    """A place, of which some headings are drawn, at where it is."""
    now = asked(drawn, NOTHING)
    (only,) = now.steps
    best = only.choice.best
    assert best.name == "place-preference"
    assert best.values["drawn"] == 1.0
    assert best.values["strength"] > 0.005
    assert math.hypot(best.values["x_m"] - 0.8, best.values["y_m"] - 0.2) < 0.1
    assert best.nats > 10
    assert only.best.p < 1e-4
    assert only.before is drawn.screen


@pytest.mark.slow
def test_nothing_is_named_where_nothing_is_missing(question):
    """Nor where the model has the effect already."""
    case = open_case(question(minutes=10.0))
    assert asked(case, NOTHING).steps == ()


def gain(name, values):
    """Return a gain of one strength at each step."""
    return Gain(name=name, label="x", log_p=np.asarray(values), n_strengths=1)


@pytest.fixture(scope="module")
def law(base):
    """Return that of ten minutes of fish that do as the base model does."""
    scene, fitted = base
    return Law(scene=scene, fitted=fitted)


@pytest.mark.parametrize(("share", "more"), [(1.0, False), (0.5, False), (3.0, True)])
def test_an_effect_outdoes_features_by_more_than_the_error(law, share, more):
    """Two forms of one effect differ from step to step."""
    n = len(law.rows)
    values = np.random.default_rng(4).normal(0.02, 0.1, n)
    by = np.bincount(law.turns.at, share * values, minlength=len(law.scene.k))
    apart = np.random.default_rng(6).normal(0, 0.1, len(by))
    by += apart - apart.mean()
    guess = SimpleNamespace(choice=Choice(best=SimpleNamespace(gain=by, nats=by.sum() - 1)))
    nats = gain("place-preference", values).nats
    assert outdoes(guess, values, nats, (law.scene, law.turns.at)) is more


def test_a_place_that_is_a_direction_is_put_aside_for_it(question, monkeypatch):
    """Though its form gains more than the direction's; where nothing is left there is no name."""
    forms = {
        name: SimpleNamespace(
            name=name, nats=nats, values={"strength": 1.0}, over=lambda _other: 9.0,
            candidate=SimpleNamespace(effect=find_effect(name)),
        )
        for name, nats in (("place-preference", 120.0), ("directional-drift", 100.0))
    }  # fmt: skip
    score = SimpleNamespace(clearness=9.0, information=1.0)
    monkeypatch.setattr(
        common, "in_the_model", lambda _case, _screen, own: (forms[own.name], score)
    )
    monkeypatch.setattr(
        common, "feigned", lambda made, _before: [x for x in made if "place" in x.name]
    )
    place, drift = (gain(name, np.full(9, 1.0)) for name in forms)
    both = common.as_step(None, None, Told(gain=place, p=0.0, ties=(drift,)))
    assert (both.choice.best.name, both.choice.ties) == ("directional-drift", ())
    assert common.as_step(None, None, Told(gain=place, p=0.0, ties=())) is None
    forms["directional-drift"].values["strength"] = 0.0
    assert common.as_step(None, None, Told(gain=drift, p=0.0, ties=())) is None
    # Of a curve it may be 0 at the middle one of three knots.
    forms["directional-drift"].values.update(by=4.0, more_1=0.5, more_3=-0.5)
    assert common.as_step(None, None, Told(gain=drift, p=0.0, ties=())) is not None


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "values", "seed"),
    [
        ("group-cohesion", {"weight": 2.5}, 31),
        ("directional-drift", {"strength": 1.5, "direction_rad": 2.0}, 31),
        ("place-preference", {"strength": 3.0, "x_m": 0.3, "y_m": 0.8}, 31),
        ("turning-bias", {"strength": 0.8}, 32),
    ],
)
def test_a_name_gets_the_form_that_the_fish_have(question, name, values, seed):
    """Fish that turn to something look as if all their headings leaned toward it, or to a place."""
    given = {**values, "turning": 1.0}
    (effect,) = diagnose(question({name: given}, seed=seed), lambda *_: None).effects
    strength = find_effect(name).strength
    assert (effect.name, effect.strength["turning"]) == (name, 1.0)
    low, high = effect.interval[strength]
    assert low < values[strength] < high


@pytest.mark.slow
def test_bold_fish_that_swim_into_the_open_have_that_form(question):
    """In a tank in which none of them leaves rooms more readily."""
    given = {"spread": 0.7, "heading_share": 0.0, "into_zone": 3.0}
    (effect,) = diagnose(question({"boldness": given}), lambda *_: None).effects
    assert (effect.name, effect.strength["into_zone"]) == ("boldness", 3.0)
    low, high = effect.interval["spread"]
    assert low < high
    assert effect.strength["spread"] == pytest.approx(0.7, abs=0.3)


@pytest.mark.parametrize(
    ("clear", "tried"),
    [
        ([4.0, 3.0, 2.1, 1.9, 0.5], [4.0, 3.0, 2.1]),
        ([9.0, 8.0, 7.0, 6.0, 5.6, 5.5, 5.4], [9.0, 8.0, 7.0, 6.0, 5.6, 5.5]),
        ([1.9, 0.4, -0.5], [1.9, 0.4, -0.5]),
        ([-0.4, -0.5], [-0.4, -0.5]),
    ],
)
def test_forms_that_say_little_are_not_put_into_the_model(monkeypatch, clear, tried):
    """Beside a clear one those within reach of it are, six at most; that worth most is taken."""
    effect = find_effect("directional-drift")
    scores = [
        SimpleNamespace(
            clearness=own,
            candidate=SimpleNamespace(effect=effect, shape={effect.fixed[0]: float(n)}),
        )
        for n, own in enumerate(clear)
    ]
    fitted = []

    def refit(_screen, score, n_workers):
        assert n_workers >= 1
        fitted.append(score.clearness)
        return SimpleNamespace(worth=-score.clearness, nats=0.0, gain=np.zeros(9))

    monkeypatch.setattr(common, "further_forms", lambda *_: [])
    monkeypatch.setattr(common, "ask_all", lambda *_: scores[::-1])
    monkeypatch.setattr(common, "refit", refit)
    monkeypatch.setattr(common, "curved", lambda *_: None)
    case = SimpleNamespace(listed=(), generic=(), scene=None, question=SimpleNamespace(n_workers=1))
    _, best = common.in_the_model(case, None, gain(effect.name, np.zeros(9)))
    assert fitted == tried
    assert best.clearness == tried[-1]


@pytest.mark.slow
@pytest.mark.parametrize("direction_rad", [2.0, 2.0 - math.pi])
def test_of_a_direction_and_its_opposite_the_right_one_is_fitted(question, direction_rad):
    """Their scores have the same size: only the sign tells which of them fish prefer."""
    given = {"strength": 0.3, "direction_rad": direction_rad}
    case = open_case(question({"directional-drift": given}))
    found, _ = common.in_the_model(case, case.screen, gain("directional-drift", np.zeros(1)))
    assert found.values["turning"] == found.values["drawn"] == 0.0
    assert found.interval["strength"][0] > 0.1
    assert abs(math.remainder(found.values["direction_rad"] - direction_rad, math.tau)) < 0.5


@pytest.mark.slow
def test_a_form_gets_a_curve_where_that_gains_more(question):
    """Fish that turn left near others and right far from them: half of it is no plain form."""
    bent = {"by": float(BY_NEAREST), "knot_1": 0.03, "knot_2": 0.1, "knot_3": 0.25}
    given = {"strength": 0.0, "more_1": 0.8, "more_3": -0.8} | bent
    (effect,) = diagnose(question({"turning-bias": given}), lambda *_: None).effects
    assert effect.name == "turning-bias"
    assert bent.items() <= effect.strength.items()
    for key in ("strength", "more_1", "more_3"):
        low, high = effect.interval[key]
        assert low - 0.2 < given[key] < high + 0.2
    assert "Fitted strength by distance to the nearest: " in effect.says
    curve = effect.by_features
    assert curve.cue == "distance to the nearest (m)"
    assert curve.at.tolist() == [0.03, 0.1, 0.25]
    assert curve.form == pytest.approx(curve.strength, abs=0.2)
    assert curve.form_nats > 0.9 * curve.nats


@pytest.mark.slow
def test_a_plain_form_stays_where_fish_have_it(question):
    """Its features under circumstances gain no more than it does."""
    (effect,) = diagnose(question({"turning-bias": {"strength": 0.8}}), lambda *_: None).effects
    assert "by" not in effect.strength


@pytest.mark.slow
def test_a_place_that_all_fish_have_on_one_side_is_a_direction(question):
    """Features of places that fish turn to bend to any direction, and gain as much as it."""
    given = {"strength": 0.8, "direction_rad": 2.0, "turning": 1.0}
    case = open_case(question({"directional-drift": given}))
    (named,) = asked(case, NOTHING).steps
    assert named.choice.best.name == "directional-drift"
    assert named.choice.ties == ()


@pytest.mark.slow
def test_noise_alone_gains_something(question):
    """Of a response that is a little late, on replicates with half a millimetre of noise."""
    case = open_case(question(minutes=10.0, noise_m=5e-4))
    late = Gain(name="reaction-delay", label="a tenth of a step", log_p=np.zeros(3), n_strengths=1)
    (own,) = _noise_of(case, [late], ())
    assert 0 < own.more(1) < 20


@pytest.fixture
def looked(monkeypatch):
    """Return what is asked of features, look by look, and what they are to say of each."""
    calls, answers = [], []

    def further(looks, _unfeatured, named, nats=0.0):
        calls.append((looks, [each.name for each in named], nats))
        return answers.pop(0) if answers else Found()

    monkeypatch.setattr(looking, "further", further)
    monkeypatch.setattr(looking._Looks, "promising_nothing", IDLE)
    return calls, answers


def step(name, screen, nats=20.0):
    """Return an effect that was named, in a model of that screen."""
    effect = SimpleNamespace(effect=find_effect(name))
    best = SimpleNamespace(
        candidate=effect, screen=screen, nats=nats, name=name, is_generic=":" in name
    )
    return Step(
        choice=Choice(best=best),
        best=Best(score="score", z=9.0, p=1e-9, information=1.0),
        before="before",
    )


def found(*names, nats=20.0, **more):
    """Return that these were found."""
    steps = tuple(step(name, f"with {name}", nats) for name in names)
    return Found(steps=steps, nats=nats, **more)


def test_features_are_asked_of_the_model_as_it_is(question, looked):
    """Where nothing was named."""
    case = open_case(question())
    assert asked(case, NOTHING).steps == ()
    ((looks, named, nats),) = looked[0]
    assert (looks.case, looks.screen, looks.beside) == (case, case.screen, ())
    assert (looks.number, named, nats) == (0, [], 0.0)


def test_what_no_form_bears_out_is_unexplained_where_nothing_else_was_named(question, looked):
    """Beside what is named nothing changes; what speeds say stays said."""
    case = open_case(question())
    doubt = Found(nats=30.0, suspicious=True)
    looked[1].append(doubt)
    assert asked(case, NOTHING).suspicious
    looked[1].append(doubt)
    assert asked(case, Found(suspicious=True)).suspicious
    crowding = found("crowding")
    assert asked(case, crowding).steps == crowding.steps
    assert not asked(case, crowding).suspicious


@pytest.mark.slow
def test_a_name_without_a_form_of_ours_is_unexplained(question, monkeypatch):
    """Features gain, no form does and the name does not lead: the verdict says so."""
    own = question({"directional-drift": {"strength": 0.07, "direction_rad": 2.0, "drawn": 1.0}})
    (effect,) = diagnose(own, lambda *_: None).effects
    assert (effect.name, effect.strength["drawn"]) == ("directional-drift", 1.0)
    assert effect.strength["strength"] == pytest.approx(0.07, abs=0.03)
    assert effect.gain_nats_per_step > 0
    monkeypatch.setattr(looking, "gains_by_itself", lambda *_: False)
    monkeypatch.setattr(looking, "BY_ITSELF", math.inf)
    monkeypatch.setattr(looking._Looks, "explains", lambda *_: False)
    assert diagnose(own, lambda *_: None).verdict is Verdict.UNEXPLAINED


A, B, C = "wall-persistence", "speed-turn-coupling", "turning-memory"


def shown(name, nats):
    """Return what features of a name gain in nine steps."""
    return gain(name, np.full(9, (nats + 1) / 9) + 0.1 * np.sin(np.arange(9) + len(name)))


def beside(nats):
    """Return what tells the nats of names beside another; four are no more than chance."""

    def ask(effects, other):
        some = [nats(effect.name, other.name) for effect in effects]
        return [common.Beside(each, each > 4) for each in some]

    return ask


def told_of(names):
    """Return the first of some names with their nats, and the others."""
    first, *others = (
        Told(gain=shown(name, nats), p=0.0, ties=(), lead=0.0) for name, nats in names.items()
    )
    return dataclasses.replace(first, lead=1.5, others=tuple(others))


@pytest.mark.parametrize(
    ("nats", "left", "cause"),
    [
        (14.0, {A: 2.0, B: 17.0}, B),
        (14.0, {A: 41.0, B: 4.4}, None),
        (14.0, {A: 2.0, B: -1.0}, None),
        (14.0, {A: 6.0, B: 17.0}, None),  # Little, but more than chance.
        (5.0, {A: 2.0, B: 17.0}, None),  # It gains too little to count as a further one.
        (14.0, {A: -9.0, B: 17.0}, B),
    ],
)
def test_a_name_that_leaves_next_to_nothing_of_another_one_explains_it(nats, left, cause):
    """And of which that one leaves something; what gains most stays known."""
    told = told_of({A: 43.0, B: nats})
    found = common.explained(told, beside(lambda name, _other: left[name]))
    assert (found.gain, found.lead, found.ties) == (told.gain, 1.5, ())
    assert (found.cause.gain.name if found.cause else None) == cause


def test_next_to_nothing_is_little_of_what_it_was():
    """A weak name may be no more than chance beside any that can do much."""
    told = told_of({A: 12.0, B: 11.0})
    found = common.explained(told, beside(lambda name, _other: 5.0 if name == B else 3.0))
    assert found.cause is None


TIES = pytest.mark.parametrize(
    ("left", "right", "is_tie"),
    [(20.0, 20.0, True), (0.0, 20.0, False), (0.0, 0.0, True), (20.0, 0.0, True)],
)


@TIES
def test_what_explains_ties_with_names_that_gain_as_much(left, right, is_tie):
    """Unless these have nothing to say beside it, while it has beside them."""
    told = told_of({A: 43.0, C: 40.0, B: 30.0})
    nats = {(A, C): 20.0, (C, A): 20.0, (A, B): 1.0, (B, A): 20.0, (C, B): left, (B, C): right}
    found = common.explained(told, beside(lambda *names: nats[names]))
    assert found.cause.gain.name == B
    assert [tie.name for tie in found.cause.ties] == [C] * is_tie


@TIES
def test_a_tie_has_something_to_say_beside_what_gains_most(left, right, is_tie):
    """Or neither of the two has: then they cannot be told apart."""
    told = dataclasses.replace(told_of({A: 43.0}), ties=(shown(C, 40.0),))
    nats = {(C, A): left, (A, C): right}
    found = common.explained(told, beside(lambda *names: nats[names]))
    assert [tie.name for tie in found.ties] == [C] * is_tie


def test_each_name_stands_by_its_own_features():
    """Of some that are asked at the same time, beside one more."""
    gains = [shown(A, 30.0), shown(C, 1.0)]
    effects = [find_effect(name) for name in (A, B, C)]
    found = common.beside_of(effects, gains, None)
    assert [each.stands for each in found] == [True, False, False]
    assert [each.nats for each in found] == pytest.approx([30.0, 0.0, 1.0], abs=0.3)


def test_looks_share_a_level():
    """The first ones at speeds and at headings have it together, and so have all that follow."""
    assert 2 * level_of(0) == LEVEL
    assert 2 * sum(level_of(k) for k in range(1, 30)) == pytest.approx(LEVEL)


@pytest.mark.slow
def test_where_noise_is_not_known_it_is_that_of_the_likeliest_law(question):
    """Of exact positions that is none; the note says where it is from."""
    case = open_case(question(noise_m=None, noise_source="unknown"))
    assert case.noise_is_likely
    assert case.question.noise_m == 0.0
    assert case.question.noise_source == "the law of headings"
    assert not open_case(question(noise_m=0.0)).noise_is_likely


@pytest.mark.slow
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
        gains = looks.gains([find_effect("turning-bias")], (), frozenset())
        assert {gain.without_noise for gain in gains} == {is_likely}
        kinds = {kind for _, kind in (gain.key for gain in gains)}
        assert {"offset", "leaning", "along the wall"} <= kinds
        explained = dataclasses.replace(looks, without_noise=True)
        assert [law.noise_m for law in explained.laws] == [0.0]


def test_effects_that_the_model_came_with_are_there(question, fish, looked):
    """On headings: of speeds features say nothing."""
    for name, values, n in (("turning-bias", {"strength": 0.2}, 1), ("crowding", {}, 0)):
        own = dict(zip(find_effect(name).names, find_effect(name).values(values), strict=True))
        model = dataclasses.replace(fish, effects={name: own})
        given = open_case(dataclasses.replace(question(), model=model))
        assert asked(given, NOTHING).steps == ()
        assert [effect.name for effect in looked[0].pop()[0].beside] == [name] * n


def test_headings_are_asked_beside_what_speeds_lack(question, looked):
    """In the model that has it. What speeds name may act on headings: it is there, and no look."""
    case, (calls, answers) = open_case(question()), looked
    answers.append(found("alignment"))
    now = asked(case, found("crowding", "speed-turn-coupling"))
    names = ["crowding", "speed-turn-coupling", "alignment"]
    assert [each.choice.best.name for each in now.steps] == names
    assert [looks.screen for looks, *_ in calls] == ["with speed-turn-coupling", "with alignment"]
    assert [[effect.name for effect in looks.beside] for looks, *_ in calls] == [
        ["speed-turn-coupling"],
        ["speed-turn-coupling", "alignment"],
    ]
    assert [(looks.number, named) for looks, named, _ in calls] == [(0, []), (1, ["alignment"])]


ONE = Told(gain=gain("alignment", np.full(400, 0.1)), p=0.0, ties=())


def test_further_effects_are_looked_for_beside_what_is_there(question, looked):
    """What noise seemed to do stays explained."""
    case, (calls, answers) = open_case(question()), looked
    answers += [found("reaction-delay", nats=400.0, without_noise=True), found("turning-bias")]
    now = asked(case, NOTHING)
    assert [each.choice.best.name for each in now.steps] == ["reaction-delay", "turning-bias"]
    assert [[effect.name for effect in looks.beside] for looks, *_ in calls] == [
        [],
        ["reaction-delay"],
        ["reaction-delay", "turning-bias"],
    ]
    assert [looks.without_noise for looks, *_ in calls] == [False, True, True]
    assert [looks.idle for looks, *_ in calls] == [frozenset(), IDLE, IDLE]
    assert [nats for *_, nats in calls] == [0.0, 400.0, 400.0]


def test_another_form_beyond_the_list_bears_a_name_out(monkeypatch):
    """Though the listed form gains nothing; nothing does that says something else."""
    form = step("alignment", None)
    monkeypatch.setattr(looking, "as_step", lambda *_: form)
    monkeypatch.setattr(looking, "gains_by_itself", lambda *_: False)
    monkeypatch.setattr(looking, "_is_steady", lambda _step: True)
    monkeypatch.setattr(looking._Looks, "laws", (SimpleNamespace(noise_m=0.0),))
    looks = looking._Looks(case=None, screen=None, beside=())
    monkeypatch.setattr(looking._Looks, "explains", lambda _self, _told: False)
    told = dataclasses.replace(ONE, lead=1.0)
    same, other = (step(f"generic:heading:{cue}", None) for cue in ("neighbour-heading", "wall"))
    assert looks.borne_out(told, same) is form
    assert looks.borne_out(told, other) is None
    assert looks.borne_out(told, None) is None


@pytest.mark.parametrize(("beside", "name"), [(True, "turning-bias"), (False, None)])
def test_of_two_that_are_both_there_the_second_may_be_borne_out_first(monkeypatch, beside, name):
    """The first is not there all the time; where one says what the other does neither is named."""
    monkeypatch.setattr(looking, "as_step", lambda _case, _screen, told: step(told.gain.name, None))
    monkeypatch.setattr(looking, "gains_by_itself", lambda *_: True)
    monkeypatch.setattr(looking, "_is_steady", lambda made: made.choice.best.name == "turning-bias")
    monkeypatch.setattr(looking._Looks, "explains", lambda _self, _told: False)
    monkeypatch.setattr(looking._Looks, "_stands", lambda *_: beside)
    monkeypatch.setattr(looking._Looks, "laws", (SimpleNamespace(noise_m=0.0),))
    tie = gain("turning-bias", np.full(400, 0.1))
    told = dataclasses.replace(ONE, lead=0.5, ties=(tie,))
    made = looking._Looks(case=None, screen=None, beside=()).borne_out(told, None)
    assert (made and made.choice.best.name) == name


@pytest.mark.parametrize(
    ("noise_m", "without_noise", "mean_nats", "borne_out"),
    [(0.0, False, 60.0, True), (5e-4, False, 60.0, False), (5e-4, False, 20.0, True),
     (5e-4, True, 60.0, True)],
)  # fmt: skip
def test_a_form_is_held_against_noise_where_positions_err(
    monkeypatch, noise_m, without_noise, mean_nats, borne_out
):
    """Of the 50 nats that it gains noise makes 60; not where the exact law is the likelier."""
    form = step("alignment", None)
    form.choice.best.gain, form.choice.best.n_free = np.full(100, 0.5), 1
    monkeypatch.setattr(looking, "as_step", lambda *_: form)
    monkeypatch.setattr(looking, "_is_steady", lambda _step: True)
    monkeypatch.setattr(looking, "noise_of_form", lambda *_: ByNoise(mean_nats=mean_nats))
    monkeypatch.setattr(looking._Looks, "explains", lambda _self, _told: False)
    monkeypatch.setattr(looking._Looks, "laws", (SimpleNamespace(noise_m=noise_m),))
    own = dataclasses.replace(ONE.gain, without_noise=without_noise)
    told = dataclasses.replace(ONE, gain=own, lead=0.5)
    made = looking._Looks(case=None, screen=None, beside=()).borne_out(told, None)
    assert (made is form) is borne_out


@pytest.mark.slow
def test_noise_alone_makes_a_form_gain(question):
    """A response a tenth of a step late, by the law of measured positions; handedness hardly."""
    case = open_case(question(minutes=10.0, noise_m=5e-4))
    late = candidate_of("reaction-delay", {"delay_s": 0.02, "felt_m": 0.0, "whole": 1.0})
    form = SimpleNamespace(candidate=late, n_free=1)
    assert common.noise_of_form(case, form).more(1) > 10
    handed = SimpleNamespace(candidate=candidate_of("turning-bias", {}), n_free=1)
    assert common.noise_of_form(case, handed).more(1) < 10


def test_a_name_that_no_form_bears_out_leads_all_others(monkeypatch):
    """However silent these are beside it: a name by chance leads by next to nothing."""
    monkeypatch.setattr(looking, "tell", lambda *_args, **_how: None)
    quiet = SimpleNamespace(
        _asked=[], beside=(), number=0, idle=IDLE, gains=lambda *_: [],
        _noise=lambda _beside: None,
    )  # fmt: skip
    told = Told(gain=gain("alignment", np.full(400, 0.1)), p=0.0, ties=(), lead=1.9)
    assert not looking._Looks.explains(quiet, told)
    assert looking._Looks.explains(quiet, dataclasses.replace(told, lead=2.1))


@pytest.mark.slow
def test_a_second_effect_is_named_beside_the_first(question, monkeypatch):
    """Of two, each in a form of ours, features name both; a tie needs something to say.

    What promised nothing at first is left out of later looks, and counts as tried there.
    """
    looks, of = [], looking.gains_of

    def noted(law, **how):
        looks.append((how["idle"], of(law, **how)))
        return looks[-1][1]

    monkeypatch.setattr(looking, "gains_of", noted)
    both = {
        "directional-drift": {"strength": 0.07, "direction_rad": 2.0, "drawn": 1.0},
        "wall-persistence": {"strength": 0.5},
    }
    now = asked(open_case(question(both)), NOTHING)
    assert {each.choice.best.name for each in now.steps} == set(both)
    assert all(not each.choice.ties for each in now.steps)
    (nothing_idle, first), *_ = looks
    assert not nothing_idle
    idle, second = next(each for each in looks if each[0])
    assert idle == idle_of(first)
    assert len(idle) > len({gain.key for gain in first}) / 2
    names = {gain.name for gain in second}
    asked_before = [gain for gain in first if gain.name in names]
    assert tried(second) == tried(asked_before)
    assert idle_of(second) > idle_of(asked_before)


def test_what_is_named_in_the_end_is_not_hidden():
    """Noise may hide a name at first that stands beside another one."""
    late, fast = (
        Hidden(name=name, nats=25.0, noise_nats=40.0, noise_share=0.3)
        for name in ("reaction-delay", "crowding")
    )
    now = Found(hidden=(late, fast)).and_further(found("crowding"))
    assert now.hidden == (late,)
    assert Found().and_further(Found(suspicious=True)).suspicious
    assert not found("crowding").and_further(Found(suspicious=True)).suspicious


def test_effects_of_the_law_with_the_clearest_one_are_told_first():
    """Those of one law stay in the order of adding, however much the later ones gain."""
    steps = [
        step("crowding", None, 30.0),
        step("speed-matching", None, 40.0),
        step("alignment", None, 20.0),
        step("turning-bias", None, 50.0),
    ]
    assert clearest_first(steps) == [2, 3, 0, 1]
    assert clearest_first(steps[:3]) == [0, 1, 2]
    assert clearest_first([]) == []


def test_laws_of_the_last_two_models_are_kept(base):
    """The curve of a named effect finds the law that named it; of noisy positions none is kept."""
    case = SimpleNamespace(laws={}, question=SimpleNamespace(seed=1))
    scene, fitted = base
    models = [Screen(scene=scene, fitted=fitted) for _ in range(3)]
    made = [looking._law(case, model, 0.0) for model in models]
    assert looking._law(case, models[2], 0.0) is made[2]
    assert looking._law(case, models[1], 0.0) is made[1]
    assert looking._law(case, models[0], 0.0) is not made[0]
    assert len(case.laws) == 2
    assert looking._law(case, models[0], 1e-3) is not looking._law(case, models[0], 1e-3)

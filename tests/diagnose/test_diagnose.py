"""From tracks to a verdict."""

import dataclasses
import math

import numpy as np
import pytest

from zfcal.diagnose.case import open_case
from zfcal.diagnose.diagnose import _omnibus, _Row, diagnose
from zfcal.diagnose.findings import Verdict
from zfcal.diagnose.question import Question
from zfcal.errors import InputError
from zfcal.model.effects import all_effects
from zfcal.tracks import ROBOT


@pytest.fixture(scope="module")
def question(tank, fish):
    """Return what asks for samples; keywords change the question."""

    def of(samples, **changes):
        known = {
            "noise_m": 0.0,
            "noise_source": "known",
            "n_null": 5,
            "quick": True,
            "seed": 1,
            "n_workers": 1,
        }
        return Question(samples=samples, arena=tank, model=fish, **{**known, **changes})

    return of


@pytest.fixture(scope="module")
def ask(question):
    """Return what diagnoses samples; keywords change the question."""

    def of(samples, *, tell=lambda _stage, _done, _all: None, **changes):
        return diagnose(question(samples, **changes), tell)

    return of


BIAS = {"turning-bias": {"strength": 0.4}}


@pytest.fixture(scope="module")
def named(ask, record):
    """Return a quick diagnosis of fish that tend to the left."""
    return ask(record(23, BIAS, minutes=6.0))


@pytest.mark.slow
def test_an_effect_is_named_and_measured(named):
    """First of all, 0.4 within its interval, and in the extended model."""
    assert named.verdict is Verdict.NAMED
    effect = named.effects[0]
    assert effect.name == "turning-bias"
    low, high = effect.interval["strength"]
    assert low < effect.strength["strength"] < high
    assert low < 0.4 < high
    assert effect.ties == ()
    assert effect.p < 1e-6
    assert effect.gain_nats_per_step > 4 * effect.gain_se > 0
    assert named.extended.effects["turning-bias"] == effect.strength
    assert named.base.effects == {}
    assert effect.trace is not None


@pytest.mark.slow
def test_all_effects_are_accounted_for(named):
    """Screened, or lacking something; the clearest first."""
    names = [each.name for each in named.screened]
    assert sorted(names) == sorted(effect.name for effect in all_effects())
    assert names[0] == "turning-bias"
    lacking = {each.name: each.lacks for each in named.screened if each.lacks}
    assert lacking == {"robot-avoidance": "a robot"}
    sizes = [abs(each.z) for each in named.screened if not each.lacks]
    assert sizes == sorted(sizes, reverse=True)
    assert named.minutes == pytest.approx(6.0)
    assert {note.name for note in named.notes} == {"noise", "halves", "controls", "omnibus", "null"}


@pytest.mark.slow
def test_what_disagrees_is_located(named):
    """Turning is found among the places, by false-discovery control."""
    assert named.where
    assert all(0 <= place.q <= 0.1 for place in named.where)
    assert any("turn" in place.statistic for place in named.where)


@pytest.mark.slow
def test_a_right_model_has_nothing_missing(ask, record):
    """No effect, and the model that was fitted as it is; every z is told."""
    found = ask(record(11, minutes=6.0))
    assert found.verdict is Verdict.NO_EFFECT
    assert found.effects == ()
    assert found.extended == found.base
    assert all(abs(each.z) < 4.5 for each in found.screened if not each.lacks)


@pytest.mark.slow
def test_the_null_through_the_measurement_does_not_depend_on_workers(ask, record):
    """Three replicates of three minutes; stages are told in order, and none is left out."""
    told = []
    samples = record(23, BIAS, minutes=3.0)
    one, two = (
        ask(samples, quick=False, n_null=3, n_workers=n, tell=lambda *a: told.append(a))
        for n in (1, 2)
    )
    assert [(e.name, e.strength, e.p) for e in one.effects] == [
        (e.name, e.strength, e.p) for e in two.effects
    ]
    assert [(s.name, s.z, s.p) for s in one.screened if not s.lacks] == [
        (s.name, s.z, s.p) for s in two.screened if not s.lacks
    ]
    assert one.effects[0].name == "turning-bias"
    assert one.where == two.where
    replicates = [(done, all_) for stage, done, all_ in told if stage == "null replicates"]
    assert replicates == [(n, 3) for n in (1, 2, 3)] * 2
    (null,) = (note for note in one.notes if note.name == "null")
    assert null.values["replicates"] == 3


@pytest.mark.parametrize(("has", "asked"), [((), True), (("burst-and-coast",), False)])
def test_no_other_form_is_asked_of_what_the_model_has(question, record, fish, has, asked):
    """A speed that follows the last one in a line says what a power of it says."""
    own = dataclasses.replace(fish, effects={name: {"exponent": 0.1} for name in has})
    case = open_case(dataclasses.replace(question(record(3, minutes=1.0, n_fish=2)), model=own))
    assert ("generic:speed:own-speed" in {each.name for each in case.generic}) == asked


@pytest.fixture(scope="module")
def beside_cohesion(question, record, fish):
    """Return what diagnoses fish with cohesion, by a model whose own cohesion reaches less far."""

    def of(**others):
        cohesion = {"weight": 4.0, "full_m": 0.3, "leaning": 1.0}
        faded = {"weight": 4.0, "full_m": 0.05, "leaning": 0.0}
        model = dataclasses.replace(fish, effects={"group-cohesion": faded})
        samples = record(71, {"group-cohesion": cohesion, **others}, minutes=12.0)
        # Without a word of the noise the omnibus test says nothing.
        asked = question(samples, noise_m=None)
        return diagnose(dataclasses.replace(asked, model=model), lambda _stage, _done, _all: None)

    return of


@pytest.mark.slow
def test_what_a_given_effect_leaves_over_is_unexplained(beside_cohesion):
    """An effect stands out, no other one than that of the model: neither named nor nothing."""
    found = beside_cohesion()
    assert max(abs(each.z) for each in found.screened if not each.lacks) > 8.0
    assert found.verdict is Verdict.UNEXPLAINED
    assert found.effects == ()


@pytest.mark.slow
def test_what_is_there_beside_a_given_effect_is_named(beside_cohesion):
    """What the given effect leaves over stands out more, and does not hide it."""
    found = beside_cohesion(**{"turning-bias": {"strength": 0.12}})
    assert found.screened[0].name != "turning-bias"
    assert [effect.name for effect in found.effects] == ["turning-bias"]


def test_a_short_recording_is_untestable(ask, record):
    """A minute of two fish: most effects could not show, and minutes are asked for."""
    found = ask(record(3, minutes=1.0, n_fish=2))
    assert found.verdict is Verdict.UNTESTABLE
    needed = [each.minutes_needed for each in found.screened if each.minutes_needed]
    assert needed
    assert min(needed) > 1.0


OWN = ("turning-bias", "directional-drift", "fatigue", "place-preference")
"""Effects that a fish shows wherever the others are."""


@pytest.mark.slow
def test_the_minutes_needed_are_the_same_however_long_the_recording(ask, record):
    """From one minute and from three; a change with the hour counts by its cube."""
    short, longer = (
        {each.name: each.minutes_needed for each in ask(record(3, minutes=m, n_fish=2)).screened}
        for m in (1.0, 3.0)
    )
    for name in OWN:
        assert 3.0 < longer[name] < 100.0
        assert 0.6 < short[name] / longer[name] < 1.7


@pytest.mark.slow
def test_one_fish_alone_can_be_asked(ask, record):
    """Of walls, places, turns and speeds; neighbours are lacking."""
    found = ask(record(5, {"turning-bias": {"strength": 0.6}}, n_fish=1))
    assert found.effects[0].name == "turning-bias"
    assert {each.name: each.lacks for each in found.screened}["alignment"] == "a neighbour"


@pytest.mark.slow
def test_the_model_keeps_the_effects_that_it_has(record, tank, fish):
    """A bias in the model is fitted along and not asked for again."""
    having = dataclasses.replace(fish, effects={"turning-bias": {"strength": 0.1}})
    question = Question(
        samples=record(23, BIAS, minutes=6.0), arena=tank, model=having, noise_m=0.0,
        noise_source="known", n_null=5, quick=True, seed=1, n_workers=1,
    )  # fmt: skip
    found = diagnose(question, lambda _stage, _done, _all: None)
    assert found.verdict is Verdict.NO_EFFECT
    assert found.base.effects["turning-bias"]["strength"] == pytest.approx(0.4, abs=0.1)
    assert "turning-bias" not in {each.name for each in found.screened}


def test_robots_alone_are_refused(ask, record):
    """There is nobody to diagnose."""
    samples = record(1, minutes=2.0, n_fish=3)
    robots = dataclasses.replace(samples, kind=np.full(3, ROBOT, dtype=np.int8))
    with pytest.raises(InputError, match="needs fish at three samples in a row"):
        ask(robots)


def test_too_short_a_recording_is_refused(ask, record):
    """Twelve seconds of one fish have not 200 steps."""
    with pytest.raises(InputError, match="needs 200 steps of fish with a heading, got"):
        ask(record(1, minutes=0.2, n_fish=1))


def test_fish_that_were_never_seen_are_refused(ask, record):
    """All positions are missing."""
    samples = record(1, minutes=2.0, n_fish=3)
    lost = dataclasses.replace(samples, xy_m=np.full_like(samples.xy_m, np.nan))
    with pytest.raises(InputError, match="got 0 in 600 samples"):
        ask(lost)


def test_fish_that_never_move_are_refused(ask, record):
    """Nobody has a heading."""
    samples = record(1, minutes=2.0, n_fish=3)
    still = np.broadcast_to(samples.xy_m[:1], samples.xy_m.shape).copy()
    with pytest.raises(InputError, match="got 0 in 600 samples"):
        ask(dataclasses.replace(samples, xy_m=still))


@pytest.mark.slow
def test_a_constant_speed_is_no_trouble(ask, worlds):
    """Two fish on circles, each step 1 cm: every number that is told is one, or is missing."""
    angle = np.arange(1500) * 0.2
    xy_m = np.stack(
        [
            np.stack([x + 0.05 * np.cos(angle), y + 0.05 * np.sin(angle)], axis=1)
            for x, y in ((0.22, 0.77), (0.77, 0.22))
        ],
        axis=1,
    )
    found = ask(worlds.samples_of(xy_m))
    assert found.verdict in set(Verdict)
    asked = [each for each in found.screened if not each.lacks]
    assert all(math.isfinite(each.z) and 0 <= each.p <= 1 for each in asked)
    for effect in found.effects:
        assert all(math.isfinite(value) for value in effect.strength.values())


@pytest.mark.slow
def test_a_quick_answer_does_not_name_the_trackers_noise(ask, record):
    """Taken for exact, positions that err by 2 mm show an effect; known to err, they do not."""
    exact = record(41, minutes=4.0)
    wrong_m = np.random.default_rng(4).normal(0.0, 0.002, exact.xy_m.shape)
    noisy = dataclasses.replace(exact, xy_m=exact.xy_m + wrong_m)
    assert ask(noisy, noise_m=0.0).effects
    held = ask(noisy, noise_m=0.002)
    assert held.effects == ()
    (null,) = (note for note in held.notes if note.name == "null")
    assert null.values["replicates"] == 6


@pytest.mark.slow
def test_a_clear_effect_is_named_in_spite_of_noise(ask, record):
    """Half a millimetre, and six replicates."""
    exact = record(23, BIAS, minutes=4.0)
    wrong_m = np.random.default_rng(4).normal(0.0, 0.0005, exact.xy_m.shape)
    found = ask(dataclasses.replace(exact, xy_m=exact.xy_m + wrong_m), noise_m=0.0005)
    assert found.effects[0].name == "turning-bias"
    assert found.effects[0].ties == ()


@pytest.mark.parametrize(("noise_m", "sure"), [(0.0, True), (0.001, False), (None, False)])
def test_replicates_of_sharp_positions_have_the_theory_beside_them(question, record, noise_m, sure):
    """One in four hundred at 5.2 is enough then; where positions err, or may, it is not."""
    rng = np.random.default_rng(14)
    names = [f"turn by context {n}" for n in range(400)]
    rows = [
        _Row(
            listed=np.zeros(0),
            controls=None,
            at_large=({}, dict(zip(names, rng.normal(size=400), strict=True))),
        )
        for _ in range(20)
    ]
    asks = question(record(23, BIAS, minutes=6.0), noise_m=noise_m, quick=False)
    own = {**dict.fromkeys(names, 0.0), names[7]: 5.2}
    assert (_omnibus(asks, own, rows).p < 1e-3) == sure


LINEAR = {"generic:speed:own-speed": {"strength": 0.12}}
"""Fish that stay fast, by another form than that of the listed effect."""


@pytest.mark.slow
def test_another_form_of_a_listed_effect_is_called_by_its_name(ask, record):
    """Speed follows the own speed in a straight line, not by a power: that is burst and coast."""
    found = ask(record(61, LINEAR, minutes=6.0))
    assert found.effects[0].name == "burst-and-coast"


@pytest.mark.slow
def test_what_is_small_beside_a_listed_effect_is_no_effect_beyond_the_list(ask, record):
    """Strong handedness, and a little pull to walls: by itself that is said, beside it not."""
    walls = {"generic:heading:wall": {"strength": -0.55}}
    alone = ask(record(62, walls, minutes=4.0))
    assert [each.name for each in alone.effects] == ["generic:heading:wall"]
    both = ask(record(62, {"turning-bias": {"strength": 0.7}, **walls}, minutes=6.0))
    assert [each.name for each in both.effects] == ["turning-bias"]


@pytest.mark.slow
def test_beside_what_is_only_a_guess_a_small_listed_effect_is_not_said(ask, record):
    """A strong pull to walls has no mechanism; a little handedness may be left over from it."""
    walls = {"generic:heading:wall": {"strength": -1.2}}
    bias = {"turning-bias": {"strength": 0.35}}
    assert [each.name for each in ask(record(63, bias, minutes=4.0)).effects] == ["turning-bias"]
    both = ask(record(63, {**walls, **bias}, minutes=6.0))
    assert [each.name for each in both.effects] == ["generic:heading:wall"]


@pytest.mark.slow
def test_speeds_are_another_matter_beside_a_guess_about_headings(ask, record):
    """The same pull to walls, and fish that get slower: both are said."""
    walls = {"generic:heading:wall": {"strength": -1.2}}
    found = ask(record(64, {**walls, "fatigue": {"per_hour": 4.0}}))
    assert {each.name for each in found.effects} == {"generic:heading:wall", "fatigue"}

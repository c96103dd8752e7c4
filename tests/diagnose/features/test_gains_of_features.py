"""What features gain: nothing where nothing is missing, and most of what is in whatever form."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.special import logit
from scipy.stats import chi2, ncx2

from zfcal.diagnose.features.asking import fits_beside, gains_of, kind_of
from zfcal.diagnose.features.climbing import climb, climb_within
from zfcal.diagnose.features.false_gains import ByNoise
from zfcal.diagnose.features.first_look import FirstLook
from zfcal.diagnose.features.fits import Fits
from zfcal.diagnose.features.gains import Gain, idle_of
from zfcal.diagnose.features.law import Law
from zfcal.diagnose.features.naming import answer, best_by_name, tell, tried
from zfcal.model.effects import all_effects, find_effect
from zfcal.model.extended import LAPSE, maximise, with_effect
from zfcal.model.features import Component, Landing, Leaving, OneOf, Sharper, Tilt, Turned


def gain(name, values, *, n_strengths=1, label="one", n_tried=1):
    """Return what a feature gains at each of some steps."""
    return Gain(
        name=name,
        label=label,
        log_p=np.asarray(values, dtype=float),
        n_strengths=n_strengths,
        n_tried=n_tried,
    )


@pytest.fixture(scope="module")
def nothing(base):
    """Return fits to ten minutes of fish that do as the base model does."""
    scene, fitted = base
    return Fits(law=Law(scene=scene, fitted=fitted))


@pytest.fixture(scope="module")
def hidden(base, worlds):
    """Return what makes fits to steps of which each heading is drawn from another law.

    Where everybody was stays as it was: the law is the base's times a factor on its cells.
    """
    scene, fitted = base

    def make(factor, seed=5):
        drawn = worlds.redrawn(scene, fitted, np.random.default_rng(seed), factor)
        return Law(scene=drawn, fitted=maximise(drawn, fitted.parameters))

    return make


def bump(angle, centre, kappa):
    """Return a von Mises density on cells, shape (turn, cell)."""
    law = np.exp(kappa * (np.cos(angle - np.asarray(centre)[:, None]) - 1))
    return law / law.sum(axis=1, keepdims=True) * len(angle) / (2 * math.pi)


@pytest.mark.slow
def test_nothing_is_gained_where_nothing_is_missing(base):
    """No name is told; the best gains a few nats less its strengths, as chance has it."""
    scene, fitted = base
    found = gains_of(Law(scene=scene, fitted=fitted), all_effects())
    assert tell(found) is None
    assert {each.name for each in found} == {e.name for e in all_effects() if not e.on_speed}
    assert -10 < best_by_name(found)[0].nats < 6


def test_what_promises_less_than_it_costs_is_not_fitted(nothing, monkeypatch):
    """It counts as tried, what is fitted gains the same, and who asks for a kind has it fitted."""
    effect = find_effect("turning-memory")
    fitted, fit = [], Fits.fit

    def noted(fits, feature):
        fitted.append(feature.label)
        return fit(fits, feature)

    monkeypatch.setattr(Fits, "fit", noted)
    some, n_some = gains_of(nothing.law, [effect]), len(fitted)
    single = [
        each
        for each in effect.features(nothing.law.scene.arena)
        if not isinstance(each, (OneOf, Sharper))
    ]
    idle = {each.label for each in single if nothing.first_look.nats(each) < 0}
    assert len(idle) > 5
    assert not idle & set(fitted)
    with monkeypatch.context() as patch:
        patch.setattr(Fits, "may_gain", lambda *_: True)
        every = gains_of(nothing.law, [effect])
    assert len(fitted) >= 2 * n_some + len(idle)
    assert tried(some) == tried(every)
    for one, other in zip(some, every, strict=True):
        assert one.key == other.key
        if one.label in idle:
            assert other.nats < 2
            assert (float(one.log_p.sum()), one.p) == (0.0, 1.0)
        else:
            np.testing.assert_array_equal(one.log_p, other.log_p)
    before = len(fitted)
    asked = gains_of(nothing.law, [effect], kinds={(effect.name, label) for label in idle})
    assert set(fitted[before:]) == idle
    fits_of_all = {each.label: each.log_p for each in every}
    for each in asked:
        np.testing.assert_array_equal(each.log_p, fits_of_all[each.label])
    # Some may be at their best where they have no strength: which ones, goes by the processor.
    assert any(each.log_p.any() for each in asked)


@pytest.mark.slow
def test_what_is_idle_counts_as_tried_and_is_not_looked_at(nothing, monkeypatch):
    """By the law by which it was idle alone."""
    effect, looked, nats = find_effect("turning-memory"), [], FirstLook.nats

    def noted(look, feature):
        looked.append(feature)
        return nats(look, feature)

    monkeypatch.setattr(FirstLook, "nats", noted)
    # A law that nobody has asked: one keeps what was looked for.
    every = gains_of(replace(nothing.law), [effect])
    n, idle = len(looked), idle_of(every)
    assert {key[:2] for key in idle} < {gain.key for gain in every}
    assert len(idle) > 5
    again = gains_of(replace(nothing.law), [effect], idle=idle)
    assert len(looked) - n < n / 2
    assert tried(again) == tried(every)
    one, other = ({gain.key: gain.n_tried * gain.p for gain in of} for of in (every, again))
    assert one == other
    noisy = replace(nothing.law, noise_m=1e-9, n_draws=1, every=10)
    for law, other in ((replace(nothing.law), {(*key[:2], False) for key in idle}), (noisy, idle)):
        n = len(looked)
        gains_of(law, [effect], idle=other)
        assert len(looked) - n > 20


def test_what_is_not_fitted_has_to_make_up_for_another_law(nothing):
    """As what is fitted has: the base alone is likelier by that law."""
    beyond = nothing.null_log_p + 0.01
    fits = replace(nothing, beyond=beyond)
    (feature, *_) = find_effect("turning-memory").features(nothing.law.scene.arena)
    assert fits.nothing("turning-memory", feature).log_p == pytest.approx(-0.01)


@pytest.mark.slow
def test_what_each_fish_does_its_own_way_is_told(base, hidden):
    """Half of them lean to the north and half to the south: all together to no direction."""
    scene, _ = base
    north = np.where(scene.turns.track % 2 == 0, 1.0, -1.0)
    law = hidden(lambda angle: np.exp(0.25 * north[:, None] * np.sin(angle)))
    told = tell(gains_of(law, all_effects()))
    assert told.gain.name == "directional-drift"
    assert told.gain.label == "leaning, by who"
    alike = gains_of(law, [find_effect("directional-drift")], kinds={(told.gain.name, "leaning")})
    assert alike[0].nats < 0.2 * told.gain.nats


@pytest.mark.parametrize("differs", [True, False])
def test_what_all_do_alike_counts_with_how_they_differ(base, hidden, differs):
    """Its chance is that of the difference. Where all are alike nothing is told."""
    scene, fitted = base
    mixture, _, _ = fitted.tables()
    tracks = np.unique(scene.turns.track)
    own = np.where(scene.turns.track == tracks[0], 0.12, 0.0) if differs else 0.05

    def factor(angle):
        drawn = bump(angle, np.full(len(mixture), 2.3), 4.0)
        return 1 + np.reshape(own, (-1, 1)) * drawn / np.maximum(mixture, 1e-12)

    def toward(seen):
        return np.broadcast_to([math.cos(2.3), math.sin(2.3)], (len(seen.zone), 1, 2))

    def by_who(seen):
        return (seen.track[:, None] == tracks).astype(float)[:, None]

    def drawn(label, weights, **more):
        return Component(label=label, toward=toward, weights=weights, kappa=4.0, **more)

    fits = Fits(law=hidden(factor))
    alike = drawn("alike", lambda seen: np.ones((len(seen.zone), 1, 1)))
    apart, counted = (
        fits.gain("x", drawn("by who", by_who, over=alike, counts_whole=counts))
        for counts in (False, True)
    )
    assert apart.whole is apart
    assert (counted.p, counted.nats) == (apart.p, apart.nats)
    whole = counted.whole
    assert (whole.p, whole.n_strengths) == (apart.p, len(tracks))
    np.testing.assert_allclose(whole.log_p - apart.log_p, fits.fit(alike).log_p)
    assert whole.nats > apart.nats + 5
    assert (tell([counted]) is not None) == differs
    if differs:
        assert tell([counted]).gain.nats == whole.nats


def test_of_noisy_positions_what_all_do_alike_does_not_count(base):
    """What noise makes of it is not known."""
    scene, fitted = base

    def each(seen):
        return np.stack([seen.track == 0, seen.track != 0], axis=1)[:, None].astype(float)

    def pulled(weights, **more):
        return Component(label="x", toward="toward", weights=weights, low=-0.5, **more)

    alike = pulled(lambda seen: seen.attention[..., None] * np.ones((1, 1, 1)))
    apart = pulled(
        lambda seen: seen.attention[..., None] * each(seen), over=alike, counts_whole=True
    )
    exact, noisy = (
        Fits(law=Law(scene=scene, fitted=fitted, noise_m=noise_m, n_draws=2, every=20))
        for noise_m in (0.0, 5e-4)
    )
    assert exact.gain("x", apart).common is not None
    assert noisy.gain("x", apart).common is None


def test_what_counts_with_a_gain_counts_beyond_chance_alone():
    """Of twenty names: chance is that of the family, and not of the one feature."""
    others = [gain(f"name {k}", np.zeros(300)) for k in range(20)]
    place = gain("place", np.full(300, 0.1))
    common = np.full(300, 0.2)

    def bold(nats):
        return replace(gain("bold", np.full(300, nats / 300)), common=common, n_common=1)

    less, more = bold(4.0), bold(15.0)
    assert less.p < 0.02 < less.p * 22
    alone = tell([place, *others])
    for each, name in ((less, "place"), (more, "bold")):
        told = tell([each, place, *others])
        assert told.gain.name == name
        assert told.ties == ()
    beside = tell([less, place, *others])
    assert beside.lead == min(alone.lead, tell([place, replace(less, common=None)]).lead)
    told = tell([more, place, *others])
    assert told.gain.nats == pytest.approx(15 + 60 - 2)
    assert told.p == pytest.approx(22 * more.p)


def test_noise_hides_a_gain_with_what_counts_with_it():
    """What all do alike makes it no tie, and says nothing of the noise at which it would show."""
    place = gain("place", np.full(300, 0.15))
    bold = gain("bold", np.full(300, 0.05))
    more = replace(bold, common=np.full(300, 0.2), n_common=1)
    noise = {"place": ByNoise(), "bold": ByNoise(mean_nats=12.0)}

    def held(some):
        return [noise[each.name] for each in some]

    said, without = (answer([each, place], held) for each in (more, bold))
    assert (said.told.gain.name, said.told.ties) == ("place", ())
    assert said.told.lead == without.told.lead
    assert said.hidden == without.hidden != ()


@pytest.mark.slow
def test_a_component_in_a_form_that_nobody_knows_is_told(base, hidden):
    """Of headings 4 % are drawn about north-west, in a wide and lopsided bump: a direction."""
    _, fitted = base
    mixture, _, _ = fitted.tables()

    def factor(angle):
        odd = bump(angle, np.full(len(mixture), 2.3), 2.0)
        odd = odd + 0.5 * bump(angle, np.full(len(mixture), 1.6), 6.0)
        return 1 + 0.04 * odd / np.maximum(mixture, 1e-12)

    law = hidden(factor)
    told = tell(gains_of(law, all_effects()))
    assert told.gain.name == "directional-drift"
    assert told.gain.label.startswith("drawn")
    assert told.p < 1e-6


@pytest.mark.slow
def test_a_tilt_is_told_as_well(base, hidden):
    """All headings lean to the right of where they would go: handedness."""
    scene, _ = base
    heading = np.arctan2(scene.turns.heading[:, 1], scene.turns.heading[:, 0])
    law = hidden(lambda angle: np.exp(-0.25 * np.sin(angle - heading[:, None])))
    told = tell(gains_of(law, all_effects()))
    assert told.gain.name == "turning-bias"
    assert told.gain.log_p.sum() > 20


@pytest.mark.slow
def test_a_tilt_along_an_axis_is_told(hidden):
    """As many go one way as the other: no direction of its own is preferred."""
    law = hidden(lambda angle: np.exp(0.25 * np.cos(2 * (angle - 0.8))))
    told = tell(gains_of(law, all_effects()))
    assert (told.gain.name, told.gain.label) == ("directional-drift", "leaning along an axis")
    feature = Tilt(
        label="x", vectors=lambda seen: np.broadcast_to(np.eye(2), (len(seen.zone), 2, 2)),
        axial=True,
    )  # fmt: skip
    fit = Fits(law=law).tilt(feature)
    expected = 0.25 * np.array([math.cos(1.6), math.sin(1.6)])
    np.testing.assert_allclose(fit.strengths, expected, atol=0.09)


@pytest.mark.slow
def test_lapses_of_one_zone_are_no_effect(base, hidden):
    """Off the walls one heading in 20 is anything at all: features begin where the model ended.

    With one lapse for all zones the law of features would be tens of nats below the model's, and
    what takes over these headings off the walls would gain them back.
    """
    scene, fitted = base
    mixture, _, _ = fitted.tables()
    off_walls = ~Law(scene=scene, fitted=fitted).follows[:, None]
    law = hidden(lambda _: 1 + off_walls * 0.05 / (2 * math.pi) / np.maximum(mixture, 1e-12))
    fits = Fits(law=law)
    assert law.fitted.x[2][-1] > 10 * max(x[-1] for x in law.fitted.x[:2])
    assert fits.null_log_p.sum() == pytest.approx(law.fitted.nats, abs=1.0)
    assert tell(gains_of(law, all_effects())) is None


def test_what_fish_swim_away_from_is_a_place(base, hidden):
    """Near a spot some headings are drawn about the way from there: no spot draws them so."""
    scene, fitted = base
    mixture, _, _ = fitted.tables()
    off = scene.states[scene.turns.at, :2, scene.turns.who] - (0.3, 0.7)
    near, away = np.linalg.norm(off, axis=1) < 0.15, np.arctan2(off[:, 1], off[:, 0])

    def factor(angle):
        return 1 + 0.2 * near[:, None] * bump(angle, away, 4.0) / np.maximum(mixture, 1e-12)

    kinds = {("place-preference", kind) for kind in ("drawn", "driven away", "leaning")}
    found = gains_of(hidden(factor), [find_effect("place-preference")], kinds=kinds)
    best = max(found, key=lambda each: each.nats)
    assert best.kind == "driven away"
    assert best.nats > 2 * max(each.nats for each in found if each.kind != best.kind)


def test_fish_that_turn_less_when_fast_are_told(base, hidden):
    """Beyond 0.1 m/s a turn of more than 60 degrees is seldom, below it as the model has it."""
    scene, _ = base
    turns = scene.turns
    own = np.arctan2(turns.heading[:, 1], turns.heading[:, 0])
    fast = turns.speed_m_s > 0.1

    def factor(angle):
        return np.where(fast[:, None] & (np.cos(angle - own[:, None]) < 0.5), 0.3, 1.0)

    coupling = find_effect("speed-turn-coupling")
    found = gains_of(hidden(factor), [coupling])
    best = max(found, key=lambda each: each.nats)
    assert best.label == "turns of steps faster than 0.1 m/s"
    assert best.p < 1e-6


def test_turns_off_the_walls_are_those_everywhere_but_along_walls(nothing):
    """Of all names that have both, and of each weight."""
    seen, named, end = nothing.law.draws[0].seen, [], ", off the walls"
    walls = seen.follows_walls
    for effect in all_effects():
        features = effect.features(nothing.law.scene.arena)
        turned = {each.label: each for each in features if isinstance(each, Turned)}
        for label, feature in turned.items():
            if label.endswith(end):
                off_walls = feature.by(seen)
                everywhere = turned[label.removesuffix(end)].by(seen)
                np.testing.assert_array_equal(off_walls[~walls], everywhere[~walls])
                assert not off_walls[walls].any()
                # Of fish without a robot nobody turns from one.
                assert everywhere[walls].any() == (effect.name != "robot-avoidance")
                named.append(effect.name)
    assert len(named) == 7


def test_turns_of_the_whole_law_are_always_taken_along(base):
    """A model's effect may have too much of them, which a first look at more of it does not see."""
    scene, fitted = base
    fits = fits_beside(Law(scene=scene, fitted=fitted), [find_effect("turning-bias")])
    assert {"offset", "offset, off the walls"} <= {each.label for each in fits.also}


@pytest.mark.parametrize("name", ["alignment", "turning-bias", "collective-departure"])
def test_more_strengths_never_lose(nothing, name):
    """At worst they are zero: the log likelihood is that of the base."""
    for feature in find_effect(name).features(nothing.law.scene.arena):
        for each in feature.features[:2] if isinstance(feature, OneOf) else [feature]:
            assert nothing.gain(name, each).log_p.sum() > -1e-2


def test_the_own_way_is_never_gone(nothing):
    """Derivatives and attention below zero would make a mixture negative, and gain for ever."""
    wild = Component(
        label="wild",
        toward="toward",
        weights=lambda seen: seen.attention[..., None] * np.ones((1, 1, 1)),
        low=-50.0,
    )
    assert nothing.gain("x", wild).log_p.sum() < 6


def test_of_places_a_few_are_fitted_and_all_are_counted(nothing):
    """Each gain says of how many it is the best, and its chance is that of so many."""
    place = find_effect("place-preference")
    drawn = place.features(nothing.law.scene.arena)[0]
    found = gains_of(nothing.law, [place], kinds={("place-preference", "drawn")})
    assert 0 < len(found) <= 2
    assert {each.n_tried for each in found} == {drawn.n_tried}
    assert {each.key for each in found} == {("place-preference", "drawn")}
    one = gain("x", [9.0], n_strengths=2)
    many = gain("x", [9.0], n_strengths=2, n_tried=50)
    assert many.p == pytest.approx(50 * one.p)


def test_a_gain_by_hand():
    """Five nats by two strengths: a chi-square of 10 with two degrees, exp(-5)."""
    own = gain("x", [3.0, 2.0], n_strengths=2)
    assert own.nats == pytest.approx(3.0)
    assert own.p == pytest.approx(math.exp(-5))
    noisy = replace(own, noise=ByNoise(mean_nats=3.0))
    assert noisy.nats == pytest.approx(1.0)
    assert noisy.p == pytest.approx(ncx2.sf(10, 2, 4))


def test_features_are_asked_by_kind(nothing):
    """Those that replicates are asked for are these alone."""
    effects = [find_effect("alignment"), find_effect("place-preference")]
    found = gains_of(nothing.law, effects, kinds={("place-preference", "leaning")})
    assert {each.key for each in found} <= {("place-preference", "leaning")}
    kinds = [kind_of(each) for each in effects[1].features(nothing.law.scene.arena)]
    assert kinds == [
        "drawn",
        "driven away",
        "leaning",
        "turning",
        "turning as a whole",
        "leaning, by circumstances",
        "landing at a wall",
        "landing at a place",
    ]


@pytest.mark.slow
def test_numbers_do_not_depend_on_threads(base):
    """To the digit."""
    scene, fitted = base
    effects = [find_effect("group-cohesion"), find_effect("reaction-delay")]
    one, two = (gains_of(Law(scene=scene, fitted=fitted), effects, n_workers=n) for n in (1, 3))
    assert [each.key for each in one] == [each.key for each in two]
    for first, second in zip(one, two, strict=True):
        np.testing.assert_array_equal(first.log_p, second.log_p)


def test_every_sort_of_feature_has_its_fit(base):
    """Steps of two rooms have all of them."""
    sorts = set()
    for effect in all_effects():
        for feature in effect.features(base[0].arena):
            sorts.add(type(feature))
    assert sorts == {Component, Tilt, Turned, Sharper, Leaving, Landing, OneOf}


@pytest.mark.parametrize(("into", "from_between"), [("between", False), ("again", True)])
def test_steps_count_by_where_they_begin(nothing, into, from_between):
    """Half of those that land between the rooms are marked: it tells of steps that begin there.

    Or of those that do not; of the others it tells nothing.
    """
    turns, between = nothing.law.turns, nothing.law.between
    marked = (turns.landing == between) & (np.arange(len(turns.zone)) % 2 == 0)

    def gained(begins):
        feature = Leaving(label="x", weights=lambda _: 1.0 * (marked & begins)[:, None], into=into)
        return nothing.fit(feature).log_p.sum()

    there = turns.zone == between
    assert gained(there if from_between else ~there) > 20
    assert gained(~there if from_between else there) == pytest.approx(0.0, abs=1e-6)


def test_of_what_no_step_asks_for_nothing_is_known(nothing):
    """A strength has no bound but that there is not less than none, and nothing warns of it."""
    never = Component(
        label="never", toward="toward", weights=lambda seen: 0.0 * seen.attention[..., None]
    )
    with np.errstate(all="raise", under="ignore"):
        fit = nothing.fit(never)
        assert fit.log_p.sum() == pytest.approx(0.0, abs=1e-9)
        np.testing.assert_array_equal(fit.interval, [[0.0, np.inf]])


STEPS = np.random.default_rng(8).normal(0.02, 0.1, 4000)


def test_the_name_that_gains_most_is_told():
    """By its best feature, with its chance over the features of the name, and over all names."""
    gains = [gain("a", STEPS), gain("a", STEPS / 2, label="two"), gain("b", 0 * STEPS)]
    told = tell(gains)
    assert (told.gain.name, told.gain.label, told.ties) == ("a", "one", ())
    assert told.p == pytest.approx(2 * 2 * gains[0].p)


def test_a_name_with_many_features_takes_nothing_from_another():
    """Its own chance is that of so many; the other's is as if it had one."""
    few = [gain("a", STEPS), gain("b", 0 * STEPS)]
    many = [gain("b", 0 * STEPS, label=str(k)) for k in range(50)]
    assert tell(few).p == pytest.approx(tell([*few, *many]).p)
    assert tried([*few, *many]) == {"a": 2, "b": 102}


def test_names_that_gain_alike_are_tied():
    """The difference is less than two of its standard errors."""
    other = STEPS + np.random.default_rng(9).normal(0, 0.05, len(STEPS))
    told = tell([gain("a", STEPS), gain("b", other - other.mean() + STEPS.mean() - 1e-4)])
    assert (told.gain.name, [each.name for each in told.ties]) == ("a", ["b"])


def test_what_noise_gains_is_taken_off():
    """Asked of those alone that stand out; one that noise explains falls."""
    asked = []

    def noise(clear):
        asked.extend(each.name for each in clear)
        return [ByNoise(mean_nats=1e3 if each.name == "a" else 0.5) for each in clear]

    told = tell([gain("a", 2 * STEPS), gain("b", STEPS), gain("c", 0 * STEPS)], noise)
    assert (asked, told.gain.name) == (["a", "b"], "b")


def test_what_noise_hides_is_said_with_the_noise_at_which_it_would_show():
    """Of 30 nats of one strength noise makes 40; without noise so few are needed at 2 % of ten."""
    late = Gain(name="reaction-delay", label="x", log_p=np.full(300, 0.1), n_strengths=1)
    others = [
        Gain(name=f"name {k}", label="x", log_p=np.zeros(300), n_strengths=1) for k in range(9)
    ]
    noise = ByNoise(mean_nats=40.0)
    said = answer([late, *others], lambda clear: [noise for _ in clear])
    assert said.told is None
    (hidden,) = said.hidden
    needed, with_noise = chi2.isf(0.02 / 10, 1) / 2, noise.most(1, 0.02 / 10)
    assert (hidden.name, hidden.nats) == ("reaction-delay", pytest.approx(29))
    assert hidden.noise_nats == pytest.approx(with_noise - needed)
    assert hidden.noise_share == pytest.approx((30 - needed) / (with_noise - needed))
    told = answer([late, *others], lambda clear: [ByNoise(mean_nats=1.0) for _ in clear])
    assert (told.told.gain.name, told.hidden) == ("reaction-delay", ())
    assert answer([late, *others]).hidden == ()


def test_a_name_is_told_by_what_noise_leaves_of_its_gain():
    """The one that gains most falls behind, and the chance that is told is that of what is left."""
    told = tell(
        [gain("a", 2 * STEPS), gain("b", 1.5 * STEPS)],
        lambda clear: [
            ByNoise(mean_nats=1.5 * STEPS.sum() if each.name == "a" else 1.0) for each in clear
        ],
    )
    assert told.gain.name == "b"
    noisy = replace(gain("b", 1.5 * STEPS), noise=ByNoise(mean_nats=1.0))
    assert told.p == pytest.approx(2 * noisy.p)


def test_a_name_is_compared_with_others_by_what_noise_leaves_of_theirs():
    """One that gained more before noise was taken off is not ahead of it."""
    told = tell(
        [gain("a", 2 * STEPS), gain("b", STEPS)],
        lambda clear: [
            ByNoise(mean_nats=2 * STEPS.sum() if each.name == "a" else 0.5) for each in clear
        ],
    )
    assert told.gain.name == "b"
    assert told.lead > 0


def test_names_that_noise_hides_do_not_stand_before_others():
    """Three that gain most are hidden; the fourth is asked then, and told."""
    asked = []

    def noise(clear):
        asked.append([each.name for each in clear])
        return [ByNoise(mean_nats=0.5 if each.name == "d" else 4 * STEPS.sum()) for each in clear]

    gains = [gain(name, by * STEPS) for name, by in zip("abcd", (4, 3.5, 3, 1), strict=True)]
    said = answer(gains, noise)
    assert asked == [["a", "b", "c"], ["d"]]
    assert said.told.gain.name == "d"
    assert {each.name for each in said.hidden} == {"a", "b", "c"}


def test_what_noise_hides_and_gains_more_is_a_tie():
    """Of 80 nats noise makes 25 that spread widely: it is not told, and not beaten either."""
    wide = ByNoise(mean_nats=0.3 * STEPS.sum(), stretch=9.0)
    calm = ByNoise(mean_nats=0.5)
    told = tell(
        [gain("a", STEPS), gain("b", STEPS / 2)],
        lambda clear: [wide if each.name == "a" else calm for each in clear],
    )
    assert told.gain.name == "b"
    assert [each.name for each in told.ties] == ["a"]


def test_a_feature_may_have_to_gain_more_than_another(nothing):
    """Of what both say nothing is left, and the other's strengths are not its own."""
    weights = lambda seen: seen.attention[..., None] * np.ones((1, 1, 1))  # noqa: E731
    alone = Component(label="alone", toward="toward", weights=weights, low=-0.5)
    same = replace(alone, label="over itself", over=alone)
    assert nothing.gain("x", same).log_p == pytest.approx(0.0, abs=1e-9)
    assert (nothing.gain("x", alone).n_strengths, nothing.gain("x", same).n_strengths) == (1, 0)


def test_chance_tells_a_name_as_seldom_as_the_level_says():
    """Of 40 features of nothing, chi-squares of one degree: 2000 families."""
    rng = np.random.default_rng(2)
    ratios = rng.chisquare(1, (2000, 40)) / 2
    told = sum(tell([gain(str(k), [r]) for k, r in enumerate(row)]) is not None for row in ratios)
    assert 0.005 < told / 2000 < 0.02 + 3 * math.sqrt(0.02 / 2000)


def test_a_search_ends_where_a_library_ends():
    """A lapse and two bounded strengths, one of them at its bound: the maximum is the same."""
    rng = np.random.default_rng(3)
    columns, density = rng.normal(size=(400, 2)), np.exp(rng.normal(size=400))

    def log_p(x):
        lapse = 1 / (1 + math.exp(-x[2]))
        made = density * np.exp(columns @ x[:2] - (x[:2] ** 2).sum())
        return np.log((1 - lapse) * made + lapse / (2 * math.pi))

    def objective(x):
        def scores():
            return np.stack([(log_p(x + d) - log_p(x - d)) / 2e-6 for d in 1e-6 * np.eye(3)], 1)

        return log_p(x).sum(), scores

    bounds = [(None, None), (0.2, 1.0)]
    peak = climb(objective, np.array([0.0, 0.5, -3.0]), bounds)
    ours = peak.x
    ends = [*bounds, tuple(logit(LAPSE))]
    theirs = minimize(lambda x: -log_p(x).sum(), [0.0, 0.5, -3.0], bounds=ends)
    assert log_p(ours).sum() == pytest.approx(-theirs.fun, abs=0.02)
    assert ours[1] == 0.2


def test_the_base_is_fitted_again_beside_a_tilt(base, hidden):
    """All headings lean on: the own concentration had grown by it, and goes back."""
    scene, _ = base
    heading = np.arctan2(scene.turns.heading[:, 1], scene.turns.heading[:, 0])
    along = np.arctan2(scene.turns.along_wall[:, 1], scene.turns.along_wall[:, 0])
    follows = np.abs(scene.turns.along_wall).sum(axis=1) > 0
    law = hidden(
        lambda angle: np.exp(0.8 * np.where(follows, 1.0, 0.0)[:, None]
                             * np.cos(angle - np.where(follows, along, heading)[:, None]))
    )  # fmt: skip
    fits = Fits(law=law)
    tilt = Tilt(label="on", vectors=lambda seen: seen.along_wall[:, None])
    first = fits.gain("x", tilt)
    again = fits.refitted(tilt, first)
    assert again.log_p.sum() > first.log_p.sum() + 3
    assert fits.refitted(tilt, again).log_p.sum() == pytest.approx(again.log_p.sum())


def test_what_fish_are_drawn_to_of_each_that_they_see_is_cohesion(base, hidden):
    """Nobody behind draws: with those behind as well half of it would be lost."""
    scene, fitted = base
    mixture, _, _ = fitted.tables()
    law = Law(scene=scene, fitted=fitted)
    (draw,) = law.draws
    seen = draw.seen

    def factor(angle):
        odd = np.zeros_like(mixture)
        for j in range(seen.bearing.shape[1]):
            centre = np.arctan2(seen.bearing[:, j, 1], seen.bearing[:, j, 0])
            odd += 0.05 * seen.in_sight[:, j, None] * bump(angle, centre, 5.0)
        return 1 + odd / np.maximum(mixture, 1e-12)

    found = gains_of(hidden(factor), [find_effect("group-cohesion")])
    nats = {each.label: each.nats for each in found}
    assert nats["drawn to each seen"] == max(nats.values())
    assert nats["drawn to each seen"] > nats["drawn to each"] + 3


@pytest.mark.slow
def test_beside_an_effect_nothing_is_gained_by_less_than_none(base, worlds):
    """A model that has the effect, and fish that do as it says: no name is missing beside it.

    Components that took away more than there is would make densities negative where no heading
    was taken, and gain for ever.
    """
    scene, fitted = base
    model = with_effect(fitted.parameters, "alignment", {"weight": 30.0, "kappa": 8.0})
    there = maximise(scene, model, start=fitted.x, rounds=0)
    drawn = worlds.redrawn(scene, there, np.random.default_rng(8), np.ones_like)
    law = Law(scene=drawn, fitted=maximise(drawn, model))
    effect = find_effect("alignment")
    gained = fits_beside(law, [effect]).null_log_p.sum() - Fits(law=law).null_log_p.sum()
    assert -0.1 < gained < 30
    others = [each for each in all_effects() if each.name != "alignment"]
    assert tell(gains_of(law, others, beside=[effect])) is None


def test_a_model_may_have_too_much_of_a_component(base, worlds):
    """Twice as heavy as it is: the column of its weight takes the half away."""
    scene, fitted = base
    given = {"weight": 30.0, "kappa": 8.0}
    half = with_effect(fitted.parameters, "alignment", {**given, "weight": 15.0})
    there = maximise(scene, half, start=fitted.x, rounds=0)
    drawn = worlds.redrawn(scene, there, np.random.default_rng(8), np.ones_like)
    double = with_effect(fitted.parameters, "alignment", given)
    too_much = maximise(drawn, double, start=fitted.x, rounds=0)
    right = maximise(drawn, half, start=fitted.x, rounds=0)
    found = [Fits(law=Law(scene=drawn, fitted=each)).null_log_p.sum() for each in (too_much, right)]
    assert np.nansum(too_much.log_p) < np.nansum(right.log_p) - 10
    assert found[0] == pytest.approx(found[1], abs=3)


@pytest.mark.parametrize(
    ("name", "given"),
    [
        ("turning-bias", {"strength": 1.2, "turning": 1.0}),
        ("turning-bias", {"strength": 0.4}),
        ("alignment", {"weight": 30.0, "kappa": 8.0}),
        ("interaction-range", {"range_m": 0.15, "sharp": 1.0}),
        ("directional-drift", {"strength": 0.5, "direction_rad": 1.0}),
    ],
    ids=str,
)
def test_features_see_most_of_what_a_form_of_the_name_makes(base, worlds, name, given):
    """Of headings drawn from a model that has it, three quarters of what the model itself gains."""
    scene, fitted = base
    model = with_effect(fitted.parameters, name, given)
    there = maximise(scene, model, start=fitted.x, rounds=0)
    drawn = worlds.redrawn(scene, there, np.random.default_rng(8), np.ones_like)
    without = maximise(drawn, fitted.parameters)
    form = np.nansum(maximise(drawn, model, start=without.x).log_p) - np.nansum(without.log_p)
    best = best_by_name(gains_of(Law(scene=drawn, fitted=without), [find_effect(name)]))[0]
    assert form > 15
    assert best.log_p.sum() > 0.75 * form


def test_an_argument_that_no_step_asks_for_stays_where_it_is():
    """In units of next to nothing rounding would carry it to where no number has a meaning."""
    random = np.random.default_rng(4)
    scores = np.column_stack([random.normal(0.1, 1.0, (500, 3)), np.full(500, 1e-170)])

    def objective(x):
        at = scores @ x
        return float((at - at**2 / 2).sum()), lambda: scores * (1 - at)[:, None]

    peak = climb_within(objective, np.full(4, 0.01), [(None, None)] * 4)
    assert peak.x[3] == pytest.approx(0.01, abs=1e-6)
    assert np.abs(peak.x[:3] - 0.01).max() > 1e-3

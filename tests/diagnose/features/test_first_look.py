"""A first look says about what a fit gains, before there is one."""

import dataclasses

import numpy as np
import pytest

from zfcal.diagnose.features.first_look import FirstLook, basis_of, off, thinned
from zfcal.diagnose.features.fits import Fits
from zfcal.diagnose.features.law import Law
from zfcal.model.effects import all_effects, find_effect
from zfcal.model.effects.circumstances import by_circumstances
from zfcal.model.effects.weights import evenly, factor_on_attention
from zfcal.model.extended import maximise
from zfcal.model.features import Component, Leaving, OneOf, Tilt, Turned
from zfcal.model.scene import make_scene


@pytest.fixture(scope="module")
def fits(base, worlds):
    """Return fits to ten minutes of fish that lean a little to the north, fast ones more so."""
    scene, fitted = base
    speed = scene.turns.speed_m_s
    north = np.where(speed > np.median(speed), 0.4, 0.05)
    drawn = worlds.redrawn(
        scene,
        fitted,
        np.random.default_rng(8),
        lambda angle: np.exp(north[:, None] * np.sin(angle)),
    )
    made = Fits(law=Law(scene=drawn, fitted=maximise(drawn, fitted.parameters)))
    made.prepare()
    return made


def asked_of(base, sort):
    """Return features of a sort of which a few are chosen, the first ones of each kind."""
    return [
        each
        for effect in all_effects()
        for feature in effect.features(base[0].arena)
        if isinstance(feature, OneOf)
        for each in feature.features[:8]
        if isinstance(each, sort)
    ]


@pytest.mark.slow
@pytest.mark.parametrize("sort", [Component, Tilt, Turned, Leaving])
def test_it_says_about_what_a_fit_gains(base, fits, sort):
    """Of strengths that may go either way, and of those that may not; what they have to beat off.

    Of components that are asked for by a few strengths it says less than a fit, not much more.
    """
    features = asked_of(base, sort)
    looked, made = (
        np.array([of(each) for each in features])
        for of in (fits.first_look.nats, lambda each: fits.gain("x", each).nats)
    )
    by_scores = np.array([sort is not Component or each.low < 0 for each in features])
    apart = looked - made
    assert by_scores.sum() > 6
    assert np.median(np.abs(apart[by_scores])) < 1.0
    assert (np.abs(apart[by_scores]) < 2.0 + 0.3 * np.abs(made[by_scores])).mean() > 0.9
    assert apart.max() < 8.0


def test_it_sees_what_is_there(base, fits):
    """Of the drift under circumstances the speed says most, and more than it costs."""
    drift = next(effect for effect in all_effects() if effect.name == "directional-drift")
    kinds = {
        feature.kind: feature
        for feature in drift.features(base[0].arena)
        if isinstance(feature, OneOf)
    }
    leaning = kinds["leaning, by circumstances"]
    looked = {each.label: fits.first_look.nats(each) for each in leaning.features}
    best = max(looked, key=looked.get)
    assert best == "leaning, by the speed"
    assert fits.most_promising(leaning, 1)[0].label == best
    assert looked[best] > 20


def test_what_was_looked_for_is_not_looked_for_again(base, fits, monkeypatch):
    """Nor a part of it; more than that is."""
    drift = next(effect for effect in all_effects() if effect.name == "directional-drift")
    choice = next(each for each in drift.features(base[0].arena) if isinstance(each, OneOf))
    both = fits.most_promising(choice)
    with monkeypatch.context() as patch:
        patch.setattr(FirstLook, "nats", None)
        assert fits.most_promising(choice) == both
        assert fits.most_promising(choice, 1) == both[:1]
        with pytest.raises(TypeError):
            fits.most_promising(choice, 3)
    assert fits.most_promising(choice, 3)[:2] == both


def towards(angle_rad):
    """Return a leaning to a direction of the tank, as strong everywhere."""
    way = np.array([np.cos(angle_rad), np.sin(angle_rad)])
    return Tilt(
        label=f"{angle_rad:.2f}",
        vectors=lambda seen: np.broadcast_to(way, (len(seen.zone), 1, 2)),
        low=0.0,
    )


def test_of_many_features_a_few_are_looked_at_in_all_steps(fits, monkeypatch):
    """Those of which a quarter of the steps says most; the others in these alone."""
    ways = [towards(2 * np.pi * k / 40) for k in range(40)]
    looks = []
    nats = FirstLook.nats

    def counted(look, feature):
        looks.append(len(look.law.rows))
        return nats(look, feature)

    monkeypatch.setattr(FirstLook, "nats", counted)
    (best,) = fits.most_promising(OneOf(kind="ways", features=ways), 1)
    assert float(best.label) == pytest.approx(np.pi / 2, abs=0.4)
    n_steps = len(fits.law.rows)
    assert looks.count(n_steps) == 10
    (few,) = {n for n in looks if n != n_steps}
    assert looks.count(few) == 40
    assert few == pytest.approx(n_steps / 4, rel=0.05)
    looks.clear()
    fits.most_promising(OneOf(kind="ways", features=ways[:20]), 1)
    assert looks == [n_steps] * 20


def test_the_law_of_a_few_steps_is_that_of_all_of_them(fits):
    """With factors on headings and on leaving, which are of each step."""
    law, steps = fits.law, np.arange(len(fits.law.rows))
    bent = (0.001 * steps[:, None] * np.ones(law.weight.shape[1]), 0.002 * steps)
    law = law.absorbing(bent=bent, leaving=(2, 0.0001 * steps))
    few, kept = thinned(law, 3)
    np.testing.assert_array_equal(few.rows, law.rows[kept])
    np.testing.assert_allclose(few.cells, law.cells[kept], rtol=1e-12)
    np.testing.assert_allclose(few.log_here, law.log_here[kept], rtol=1e-12)
    np.testing.assert_allclose(few.base[1], law.base[1][kept], rtol=1e-9)
    np.testing.assert_array_equal(few.absorbing(leaving=(2, 0.0 * kept)).rows, few.rows)
    noisy, _ = thinned(dataclasses.replace(law, noise_m=1e-3), 5)
    assert len(noisy.draws) == 1


def test_each_fish_has_as_many_of_a_few_steps(fits):
    """Steps of as many fish follow each other in turn: none may be left out for that."""
    few, kept = thinned(fits.law, 4)
    whole, some = (np.bincount(each) for each in (fits.law.turns.who, few.turns.who))
    np.testing.assert_allclose(some, whole / 4, rtol=0.15)
    for n in (2, 3, 4, 5):
        assert np.bincount(kept % n, minlength=n).min() > 0.8 * len(kept) / n


def test_a_few_steps_promise_what_all_do(fits):
    """About as much, of features of one strength and of several; idle ones cost as much."""
    drift = find_effect("directional-drift").features(fits.law.scene.arena)
    kind = next(each for each in drift if getattr(each, "kind", "") == "leaning, by circumstances")
    whole = np.array([fits.first_look.nats(each) for each in kind.features])
    some = np.array([fits._few.nats(each) for each in kind.features])
    assert np.ptp(whole) > 10
    assert np.abs(some - whole).max() < 0.6 * whole.max()


def test_features_that_promise_nothing_are_not_fitted(base, fits):
    """Of a kind none may be left."""
    none = Component(
        label="none", toward="bearing", weights=lambda seen: 1e-12 * seen.attention[..., None]
    )
    assert fits.most_promising(OneOf(kind="none", features=(none,))) == []


def test_what_the_base_model_has_already_promises_nothing(fits):
    """Attention in each zone is a parameter of the base: rounding is all that is left of it."""
    by_zone = by_circumstances(factor_on_attention(evenly), among=("the zone",)).features[0]
    n_zones = len(np.unique(fits.law.turns.zone))
    assert fits.first_look.nats(by_zone) == pytest.approx(-n_zones, abs=0.1)


def test_what_is_next_to_a_parameter_of_the_base_is_seen_beside_it(fits):
    """Attention that a coin makes a little more or less: by chance it gains something."""

    def of_a_coin(seed):
        coin = np.random.default_rng(seed).choice([-1.0, 1.0], len(fits.law.rows))
        return factor_on_attention(
            lambda seen: (1 + 0.2 * coin)[:, None, None] * evenly(seen), label="coin"
        )

    coins = [of_a_coin(seed) for seed in range(12)]
    looked = np.array([fits.first_look.nats(each) for each in coins])
    made = np.array([fits.gain("x", each).nats for each in coins])
    assert np.ptp(made) > 0.5
    np.testing.assert_allclose(looked, made, atol=0.2)


def test_rounding_is_nothing():
    """Sums of what is there have no scores of their own; what is new keeps what is new of it."""
    rng = np.random.default_rng(4)
    basis = basis_of(rng.normal(size=(500, 4)))
    sums, new = basis @ rng.normal(size=(4, 3)), rng.normal(size=(500, 1))
    assert not off(sums, basis).any()
    left = off(new, basis)
    np.testing.assert_allclose(basis.T @ left, 0.0, atol=1e-12)
    assert np.linalg.norm(left) > 0.9 * np.linalg.norm(new)


@pytest.mark.slow
def test_noise_does_not_hide_a_component_from_it(record, tank, fish):
    """The model's lapses are those of exact positions, and take what a component would explain."""
    samples, noise_m = record(41, {"alignment": {"weight": 2.0, "kappa": 12.0}}), 1e-3
    errors_m = noise_m * np.random.default_rng(6).standard_normal(samples.xy_m.shape)
    scene = make_scene(dataclasses.replace(samples, xy_m=samples.xy_m + errors_m), tank)
    fits = Fits(law=Law(scene=scene, fitted=maximise(scene, fish), noise_m=noise_m))
    fits.prepare()
    drawn = next(
        each
        for each in find_effect("alignment").features(tank)
        if isinstance(each, Component) and each.label == "drawn, as seen"
    )
    gained = fits.gain("alignment", drawn).nats
    assert gained > 50
    assert 0.4 * gained < fits.first_look.nats(drawn) < gained


def test_what_is_at_its_floor_has_no_score(fits):
    """There the law does not change, however much is added: one step would outweigh all others."""
    turning = next(
        each
        for effect in all_effects()
        for each in effect.features(fits.law.scene.arena)
        if isinstance(each, Turned)
    )
    look, (at, over) = fits.first_look, fits.first_look.null.base
    low = at.copy()
    low[7] *= 1e-9
    changing = low.copy()
    changing[7] = np.inf
    made = [
        dataclasses.replace(
            look, null=dataclasses.replace(look.null, base=(low, over), changing=(each, over))
        )._scores_of(fits.law.turned(turning))
        for each in (low, changing)
    ]
    assert np.abs(made[0][7]).max() > 1e3
    assert np.abs(made[1][7]).max() < 10


def test_the_mixture_says_where_it_is_at_a_floor(base, monkeypatch):
    """A parameter that takes away more than there is leaves the floor, and no change."""
    made = Fits(law=Law(scene=base[0], fitted=base[1]))
    _ = made._null
    peak = dataclasses.replace(made._null.peak, x=-1e6 * np.ones_like(made._null.peak.x))
    monkeypatch.setitem(made.__dict__, "_null", dataclasses.replace(made._null, peak=peak))
    null = made._at_null
    lowest = 1e-9 * made.law.base[0]
    np.testing.assert_array_equal(np.isinf(null.changing[0]), null.base[0] <= lowest)
    assert 0.3 < np.isinf(null.changing[0]).mean() < 1.0
    assert (null.base[0] >= lowest).all()
    there = np.flatnonzero(np.isinf(null.changing[1]))
    assert np.isinf(null.take(there).changing[1]).all()
    assert np.isfinite(null.base[1]).all()

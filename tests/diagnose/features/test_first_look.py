"""A first look says about what a fit gains, before there is one."""

import dataclasses

import numpy as np
import pytest

from zfcal.diagnose.features.gains import Fits
from zfcal.diagnose.features.law import Law
from zfcal.model.effects import all_effects
from zfcal.model.extended import maximise
from zfcal.model.features import Component, Leaving, OneOf, Tilt, Turned


@pytest.fixture(scope="module")
def fits(base, worlds):
    """Return fits to ten minutes of fish that lean a little to the north, off the walls more so."""
    scene, fitted = base
    north = np.where(scene.turns.zone % 2 == 0, 0.25, 0.05)
    drawn = worlds.redrawn(
        scene,
        fitted,
        np.random.default_rng(8),
        lambda angle: np.exp(north[:, None] * np.sin(angle)),
    )
    made = Fits(law=Law(scene=drawn, fitted=maximise(drawn, fitted.parameters)))
    made.prepare()
    return made


def free(feature):
    """Return a feature whose strengths have no bounds that a maximum could lie at."""
    if isinstance(feature, Tilt | Turned):
        return dataclasses.replace(feature, low=None)
    return feature


@pytest.mark.parametrize("sort", [Tilt, Turned, Leaving])
def test_it_says_about_what_a_fit_gains(base, fits, sort):
    """Within a nat as a rule, for strengths that may go either way; what it has to beat is off."""
    features = [
        (effect, free(each))
        for effect in all_effects()
        for feature in effect.features(base[0].arena)
        for each in (feature.features[:6] if isinstance(feature, OneOf) else [feature])
        if isinstance(each, sort)
    ]
    looked, made = (
        np.array([of(each) for _, each in features])
        for of in (fits.first_look.nats, lambda each: fits.gain("x", each).nats)
    )
    assert len(features) > 6
    assert np.median(np.abs(looked - made)) < 1.0
    assert (np.abs(looked - made) < 2.0 + 0.3 * np.abs(made)).mean() > 0.9


def test_it_sees_what_is_there(base, fits):
    """Of the drift under circumstances the zones say most, and more than they cost."""
    drift = next(effect for effect in all_effects() if effect.name == "directional-drift")
    kinds = {
        feature.kind: feature
        for feature in drift.features(base[0].arena)
        if isinstance(feature, OneOf)
    }
    leaning = kinds["leaning, by circumstances"]
    looked = {each.label: fits.first_look.nats(each) for each in leaning.features}
    best = max(looked, key=looked.get)
    assert best == "leaning, by the zone"
    assert fits.most_promising(leaning, 1)[0].label == best
    assert looked[best] > 20


def test_features_that_promise_nothing_are_not_fitted(base, fits):
    """Of a kind none may be left."""
    none = Component(
        label="none", toward="bearing", weights=lambda seen: 1e-12 * seen.attention[..., None]
    )
    assert fits.most_promising(OneOf(kind="none", features=(none,))) == []

"""The curve of a feature: where it lies over the fish's own, and over that of the model's form."""

import dataclasses

import numpy as np
import pytest

from zfcal.diagnose.candidates import in_model
from zfcal.diagnose.diagnose import diagnose
from zfcal.diagnose.features.curves import curve_of, redrawn
from zfcal.diagnose.features.law import Law
from zfcal.diagnose.question import Question
from zfcal.diagnose.screening import Screen
from zfcal.model.effects import find_effect
from zfcal.model.extended import maximise, with_effect
from zfcal.model.features import Along, Component
from zfcal.model.kernels.hats import hats

EFFECT = find_effect("interaction-range")
RANGE = {"ignored": 1.0, "range_m": 0.12}


@pytest.fixture(scope="module")
def there(screen):
    """Return fish that attend to nobody beyond 0.12 m, under the base model."""
    return screen(41, {EFFECT.name: RANGE})


@pytest.fixture(scope="module")
def with_it(there):
    """Return the same recording under the model that has the effect in its true form."""
    parameters = with_effect(there.fitted.parameters, EFFECT.name, RANGE)
    fitted = maximise(there.scene, parameters, free=((EFFECT.name, "ignored"),))
    return Screen(scene=there.scene, fitted=fitted)


@pytest.fixture(scope="module")
def law(there):
    """Return the law of the model without the effect."""
    return Law(scene=there.scene, fitted=there.fitted)


@pytest.fixture(scope="module")
def curve(law, with_it):
    """Return what the effect's best feature says."""
    return curve_of(law, EFFECT, with_it, nats=20.0)


def test_the_curve_lies_where_attention_is_lost(curve):
    """Far beyond the range, and little of it within."""
    assert (curve.label, curve.form_nats) == ("attention", 20.0)
    assert curve.cue == "distance to the other (m)"
    assert curve.at[0] == curve.strength[0] == 0.0
    far = (curve.at >= 0.3) & (curve.at < 0.7)
    assert (curve.high[far] < 0.0).all()
    assert (curve.low <= curve.strength).all()
    assert (curve.strength <= curve.high).all()
    assert (curve.low >= -0.98).all()


def test_the_form_of_the_fish_has_their_curve(curve):
    """Where the model has the effect as the fish do, both curves are alike."""
    assert ((curve.low - 0.25 < curve.form) & (curve.form < curve.high + 0.25)).all()
    assert curve.form[curve.at >= 0.3].max() < -0.4


def test_the_curve_ends_where_no_step_asks_for_a_strength(law, with_it):
    """Nobody is 2 m away, so a weight that begins there has any strength, and is not drawn."""
    knots_m = (0.0, 0.5, 2.0, 5.0)
    feature = Component(
        label="attention by wide steps of distance", toward="toward",
        weights=lambda seen: seen.attention[..., None] * hats(seen.distance_m, knots_m),
        along=Along(cue="distance to the other (m)", knots=knots_m),
    )  # fmt: skip
    wide = dataclasses.replace(EFFECT, features=lambda _: (feature,))
    found = curve_of(law, wide, with_it, nats=20.0)
    np.testing.assert_array_equal(found.at, knots_m[:-1])
    for values in (found.strength, found.low, found.high, found.form):
        assert np.isfinite(values).all()
        assert len(values) == len(found.at)


def test_a_form_that_is_not_there_has_no_curve(law, there, curve):
    """Headings drawn from the base itself show nothing of the effect where the fish show most."""
    without = curve_of(law, EFFECT, there, nats=0.0)
    assert np.abs(without.form).max() < 0.4 * np.abs(curve.strength).max()


def test_headings_are_drawn_by_the_law_of_the_model(law, there):
    """Of the base: the mean log density of what is drawn is what the base expects."""
    made = redrawn(law, there, np.random.default_rng(2))
    assert made.draws is law.draws
    p = there.probability[law.rows]
    cell = np.round(np.arctan2(*made.turns.taken.T[::-1]) / (2 * np.pi) * p.shape[1]).astype(int)
    own = np.log(p[np.arange(len(p)), cell % p.shape[1]])
    mean = (p * np.log(np.maximum(p, 1e-300))).sum(axis=1)
    apart = own - mean
    assert abs(apart.mean()) < 4 * apart.std() / np.sqrt(len(apart))
    share = law.turns.share[np.arange(len(p)), cell % p.shape[1]]
    assert (share[np.arange(len(p)), made.turns.landing - 1] > 0).mean() > 0.99


@pytest.mark.slow
def test_a_diagnosis_says_it_and_effects_of_the_model_are_beside(record, tank, fish):
    """An effect that the model came with has no curve; who is named has one, also on speed none."""
    given = dataclasses.replace(fish, effects={"crowding": {"per_neighbour": 0.01}})
    assert [each.name for each in in_model(given)] == ["crowding"]
    found = diagnose(
        Question(
            samples=record(41, {EFFECT.name: RANGE}), arena=tank, model=given, seed=1, n_workers=2,
            noise_m=0.0, noise_source="known", n_null=5, quick=True,
        ),
        lambda *_: None,
    )  # fmt: skip
    (effect,) = [each for each in found.effects if each.name == EFFECT.name]
    assert effect.by_features.label == "attention"
    assert len(effect.by_features.at) == len(effect.by_features.form) == 6

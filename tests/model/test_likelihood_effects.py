"""The likelihood of models with effects: strengths are fitted along with the base."""

from __future__ import annotations

import dataclasses

import pytest

from zfcal.model.effects import find_effect
from zfcal.model.likelihood import fit

HEADINGS = {
    "component": ("alignment", "weight", 15.0, {"kappa": 8.0}),
    "tilt": ("turning-bias", "strength", 1.0, {}),
    "sight": ("rear-blind-zone", "ignored", 0.6, {}),
}


def with_effects(model, **effects):
    """Return a model with effects, whose names have underscores here."""
    named = {name.replace("_", "-"): given for name, given in effects.items()}
    return dataclasses.replace(model, effects=named)


@pytest.mark.parametrize("kind", HEADINGS)
def test_the_strength_of_an_effect_on_headings_is_recovered(watch, model, kind):
    """Five minutes of five fish, from a start of a third: within its interval, which is short."""
    name, key, truth, shape = HEADINGS[kind]
    scene = watch({name: {key: truth, **shape}}, seed=4)
    start = dataclasses.replace(model, effects={name: {key: truth / 3, **shape}})

    found = fit(scene, start)

    value = found.parameters.effects[name][key]
    low, high = found.interval[f"{name}.{key}"]
    assert low <= truth <= high
    assert low <= value <= high
    assert high - low < truth
    assert found.identified[f"{name}.{key}"]
    assert shape.items() <= found.parameters.effects[name].items()


@pytest.mark.slow
def test_the_base_beside_an_effect_is_recovered_too(watch, model):
    """Without the effect the base would take some of it over: kappa of the centre is 8."""
    scene = watch({"turning-bias": {"strength": 2.0}}, seed=4)

    beside = fit(scene, with_effects(model, turning_bias={"strength": 0.5}))
    alone = fit(scene, model)

    low, high = beside.interval["centre.kappa_0"]
    assert low <= 8.0 <= high
    assert beside.parameters.zones[2].kappa_0 == pytest.approx(8.0, rel=0.1)
    assert abs(alone.parameters.zones[2].kappa_0 - 8.0) > 1.0
    assert beside.nats_per_step > alone.nats_per_step + 0.01


@pytest.mark.slow
def test_the_fit_does_not_depend_on_where_it_starts(watch, model):
    """From a turn to the other side as well, to a tenth of the interval."""
    scene = watch({"turning-bias": {"strength": 1.0}}, seed=4)

    here, there = (
        fit(scene, with_effects(model, turning_bias={"strength": start})) for start in (1.0, -1.0)
    )

    low, high = here.interval["turning-bias.strength"]
    ours, theirs = (found.parameters.effects["turning-bias"]["strength"] for found in (here, there))
    assert ours == pytest.approx(theirs, abs=(high - low) / 10)
    assert here.nats_per_step == pytest.approx(there.nats_per_step, abs=1e-4)


@pytest.mark.slow
def test_two_effects_are_fitted_together(watch, model):
    """Each within its own interval."""
    truth = {"alignment": {"weight": 15.0, "kappa": 8.0}, "turning-bias": {"strength": 1.0}}
    scene = watch(truth, seed=4)

    found = fit(
        scene, with_effects(model, alignment={"weight": 5.0, "kappa": 8.0}, turning_bias={})
    )

    for pair, value in (("alignment.weight", 15.0), ("turning-bias.strength", 1.0)):
        low, high = found.interval[pair]
        assert low <= value <= high
    assert list(found.parameters.effects) == ["alignment", "turning-bias"]


@pytest.mark.slow
def test_an_effect_that_is_not_there_has_no_strength(watch, model):
    """An interval about zero, or one that begins there where a strength cannot be negative."""
    scene = watch({}, seed=4)

    bias = fit(scene, with_effects(model, turning_bias={})).interval["turning-bias.strength"]
    low, high = fit(scene, with_effects(model, alignment={"kappa": 8.0})).interval[
        "alignment.weight"
    ]

    assert bias[0] < 0.0 < bias[1]
    assert bias[1] - bias[0] < 0.3
    assert low == 0.0
    assert high < 4.0


def test_a_recording_that_says_nothing_leaves_the_whole_range(watch, model):
    """A fish alone has nobody to align with: the strength stays, and is not pinned down."""
    scene = watch({}, seed=4, n_agents=1)

    found = fit(scene, with_effects(model, alignment={"weight": 12.0}))

    assert found.interval["alignment.weight"] == (0.0, 50.0)
    assert not found.identified["alignment.weight"]
    assert found.parameters.effects["alignment"]["weight"] == pytest.approx(12.0)


def test_an_effect_on_speed_is_left_to_those_who_know_of_speeds(watch, model):
    """A heading says nothing of it: it stays as it is, and has no interval here."""
    scene = watch({"crowding": {"per_neighbour": 0.3}}, seed=4)

    found = fit(scene, with_effects(model, crowding={"per_neighbour": 0.1}))

    assert found.parameters.effects["crowding"]["per_neighbour"] == 0.1
    assert not any(name.startswith("crowding") for name in found.interval)
    assert set(found.identified) == set(found.interval)


def test_a_model_without_effects_is_fitted_as_before(watch, model):
    """Nothing of effects among its numbers."""
    found = fit(watch({}, seed=4), model)

    assert found.parameters.effects == {}
    assert len(found.interval) == 18


@pytest.mark.slow
@pytest.mark.parametrize("kind", HEADINGS)
def test_intervals_of_strengths_hold_the_truth(watch, model, kind):
    """Two minutes of five fish, 20 seeds: at least 16 hold it.

    A right interval of 95 % fails this three times in a thousand, one of 70 % nine times in ten.
    """
    name, key, truth, shape = HEADINGS[kind]
    assert find_effect(name).strength == key
    start = dataclasses.replace(model, effects={name: {key: truth, **shape}})
    held = []
    for seed in range(20):
        scene = watch({name: {key: truth, **shape}}, seed=300 + seed, n_steps=600)
        low, high = fit(scene, start).interval[f"{name}.{key}"]
        held.append(low <= truth <= high)
    assert sum(held) >= 16

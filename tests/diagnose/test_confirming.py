"""Whether an effect holds on steps that it was not fitted to."""

import dataclasses

import numpy as np
import pytest

from zfcal.diagnose.confirming import (
    confirm,
    half_of,
    halves,
    is_shared,
)
from zfcal.diagnose.naming import Choice, refit
from zfcal.diagnose.scores import summed
from zfcal.diagnose.screening import Screen
from zfcal.diagnose.selection import Best, Step
from zfcal.model.extended import maximise
from zfcal.model.scene import make_scene
from zfcal.model.simulate import simulate_tracks


def added(screen, candidate):
    """Return the step of selection in which a candidate, alone, is added."""
    score = screen.ask(candidate)
    choice = Choice(best=refit(screen, score))
    best = Best(score=score, z=score.z, p=1.0, information=score.information)
    return Step(choice=choice, best=best, before=screen)


def alone(step):
    """Return what held-out steps say of one effect."""
    ((told,), _) = confirm(step.before, (step,), n_workers=1)
    return told


def halves_note(screen):
    """Return how far the halves of a recording differ by a model without effects."""
    confirmed, note = confirm(screen, (), n_workers=1)
    assert confirmed == ()
    return note


def test_halves_are_alternating_minutes(screen):
    """A step at 59.8 s is in the first half, one at 60 s in the second; none is lost."""
    scene = screen(11).scene
    first, second = halves(scene)
    assert len(first.turns) + len(second.turns) == len(scene.turns)
    assert len(first.moves) + len(second.moves) == len(scene.moves)
    minute = np.floor(scene.time_s(scene.turns) / 60 + 1e-9)
    assert np.array_equal(half_of(scene, scene.turns, 1), minute % 2 == 1)
    assert np.array_equal(first.states, scene.states)


def test_a_short_recording_has_four_blocks(screen):
    """Of two minutes: 30 s each, two in each half."""
    scene = screen(11, minutes=2.0).scene
    block = np.floor(scene.time_s(scene.turns) / 30 + 1e-9)
    assert np.array_equal(half_of(scene, scene.turns, 1), block % 2 == 1)


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["turning-bias", "alignment", "directional-drift", "burst-and-coast", "boldness"]
)
def test_an_effect_that_is_not_there_is_not_confirmed(screen, candidate, name):
    """Two kinds of strength, and one on speed: what chance gave is not given again."""
    for seed in (11, 12):
        told = alone(added(screen(seed), candidate(name)))
        assert not told.holds
        assert told.gain_nats_per_step < 3 * told.gain_se


@pytest.fixture(scope="module")
def short_screens(record, tank, fish):
    """Return ten recordings of three minutes, ready to be asked of speeds."""
    scenes = [make_scene(record(seed, minutes=3.0), tank) for seed in range(100, 110)]
    return [Screen(scene=scene, fitted=maximise(scene, fish, rounds=0)) for scene in scenes]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["burst-and-coast", "speed-matching", "crowding", "fatigue"])
def test_speeds_that_owe_an_effect_nothing_do_not_confirm_it(short_screens, candidate, name):
    """One of ten recordings at the most, where one in forty would be chance."""
    held = [alone(added(own, candidate(name))).holds for own in short_screens]
    assert sum(held) <= 1


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("turning-bias", {"strength": 0.4}),
        ("alignment", {"weight": 20.0}),
        ("burst-and-coast", {"exponent": 0.4}),
    ],
)
def test_an_effect_that_is_there_is_confirmed(screen, candidate, name, values):
    """With about what it gained where it was fitted."""
    step = added(screen(23, {name: values}), candidate(name))
    told = alone(step)
    assert told.holds
    assert told.gain_nats_per_step > 4 * told.gain_se
    gained = step.choice.best.gain.sum()
    n = len(step.before.scene.turns)
    assert told.gain_nats_per_step == pytest.approx(gained / n, rel=0.25)


@pytest.mark.slow
def test_effects_are_confirmed_each_beside_those_before_it(screen, candidate):
    """As one by one, whatever the number of threads: a turn, a speed, and a turn again."""
    own = screen(23, {"turning-bias": {"strength": 0.4}}, minutes=4.0)
    steps = []
    for name in ("turning-bias", "burst-and-coast", "alignment"):
        before = steps[-1].choice.best.screen if steps else own
        steps.append(added(before, candidate(name)))
    confirmed, note = confirm(own, steps, n_workers=3)
    assert confirmed == tuple(alone(step) for step in steps)
    assert confirmed[0].holds
    assert (confirmed, note) == confirm(own, steps, n_workers=1)
    assert note == halves_note(own)


def test_the_halves_of_a_right_model_agree(screen):
    """Of nine differences the largest lies within four standard errors."""
    assert 0 < halves_note(screen(11)).values["largest"] < 4


def test_the_halves_of_a_fish_alone_can_be_compared(screen):
    """It says nothing of neighbours: what cannot be known has no difference."""
    assert 0 < halves_note(screen(5, n_fish=1)).values["largest"] < 4


def test_halves_that_differ_are_told(record, worlds, tank, fish):
    """Every other minute fish keep their heading half as well."""
    xy = record(11).xy_m.copy()
    loose = dataclasses.replace(
        fish,
        zones=tuple(dataclasses.replace(zone, kappa_0=zone.kappa_0 / 3) for zone in fish.zones),
    )
    other, _ = simulate_tracks(loose, tank, n_agents=5, n_steps=3000, seed=12)
    odd = (np.arange(3000) // 300) % 2 == 1
    xy[odd] = other[odd]
    scene = make_scene(worlds.samples_of(xy), tank)
    note = halves_note(Screen(scene=scene, fitted=maximise(scene, fish)))
    assert note.values["largest"] > 6


def of_fish(screen, candidate, strengths, seed=5):
    """Return scores of unit spread on a recording's turns, of a strength for each fish."""
    scene = screen(11).scene
    draws = np.random.default_rng(seed).normal(size=len(scene.turns))
    who = np.unique(scene.turns.track, return_inverse=True)[1]
    return summed(candidate, draws + np.array(strengths)[who]), scene


def test_an_effect_on_all_fish_is_shared(screen, candidate):
    """Of either sign, though half as strong in some, in all of twenty."""
    bias = candidate("turning-bias")
    for seed in range(20):
        for sign in (1, -1):
            strengths = sign * np.linspace(0.05, 0.1, 5)
            score, scene = of_fish(screen, bias, strengths, seed)
            assert is_shared(score, scene)


def test_an_effect_of_one_fish_is_not(screen, candidate):
    """However clear, on either side; in at most 12 of 200, of which chance makes one in forty."""
    bias, shared = candidate("turning-bias"), 0
    for seed in range(200):
        sign = 1 if seed % 2 else -1
        score, scene = of_fish(screen, bias, [0, 0, sign * 0.3, 0, 0], seed)
        assert sign * score.z > 4
        shared += is_shared(score, scene)
    assert shared <= 12


def test_effects_of_all_fish_that_add_up_to_nothing_are_not_shared(screen, candidate):
    """Fish that differ to both sides: without the one, the others say the opposite."""
    score, scene = of_fish(screen, candidate("turning-bias"), [0.3, -0.1, 0.1, -0.1, 0.0])
    assert not is_shared(score, scene)


@pytest.mark.parametrize("name", ["boldness", "freezing"])
def test_what_one_fish_may_have_alone_is_not_asked_of_others(screen, candidate, name):
    """Individuals differ by the effect's own sentence, and one may rest."""
    score, scene = of_fish(screen, candidate(name), [0, 0, 0.3, 0, 0])
    assert is_shared(score, scene)


@pytest.mark.slow
def test_beside_individuals_that_differ_an_effect_must_be_shared(screen, candidate):
    """A model with boldness asks the other fish as well; a model without it does not."""
    bias = candidate("turning-bias")
    plain = screen(23, {"turning-bias": {"strength": 0.4}}, minutes=4.0)
    bold = added(plain, candidate("boldness")).choice.best.screen
    track = plain.scene.turns.track
    draws = np.random.default_rng(5).normal(size=len(track))
    of_one = summed(bias, draws + 0.3 * (track == track[0]))
    for before, holds in ((plain, True), (bold, False)):
        step = added(before, bias)
        assert alone(step).holds
        best = Best(score=of_one, z=of_one.z, p=0.0, information=1.0)
        step = dataclasses.replace(step, best=best)
        assert alone(step).holds == holds

"""Whether an effect is there all the time."""

import numpy as np
import pytest

from zfcal.diagnose.scores import summed
from zfcal.diagnose.steadiness import (
    MINUTES_S,
    Course,
    _has_one_strength,
    _lasts,
    has_pulses,
    is_steady,
)


def scores_at(screen, candidate, when, strength=0.25, seed=5):
    """Return scores of unit spread on a recording's turns, of a strength at some times."""
    scene = screen(11).scene
    draws = np.random.default_rng(seed).normal(size=len(scene.turns))
    steps = draws + np.where(when(scene.time_s(scene.turns)), strength, 0.0)
    return summed(candidate, steps), scene


@pytest.mark.parametrize("block_s", [MINUTES_S, 10.0])
def test_an_effect_that_is_there_all_the_time_is_steady(screen, candidate, block_s):
    """Clear or faint, and at a strength that halves on the way: in all of sixty."""
    bias = candidate("turning-bias")
    for seed in range(20):
        for strength in (0.06, 0.5):
            score, scene = scores_at(screen, bias, lambda t: t >= 0, strength, seed)
            assert is_steady(score, scene, block_s)
        steps = score.steps - 0.25 * (scene.time_s(scene.turns) > 300)
        assert is_steady(summed(bias, steps), scene, block_s)


@pytest.mark.parametrize(
    ("when", "block_s"),
    [
        (lambda t: t % 300 < 60, MINUTES_S),
        (lambda t: t % 40 < 5, 10.0),
        (lambda t: (t > 150) & (t < 210), MINUTES_S),
    ],
    ids=["a minute in five", "five seconds in forty", "once"],
)
def test_an_effect_that_comes_and_goes_is_not(screen, candidate, when, block_s):
    """Whatever its times, if it is clear while it is there."""
    score, scene = scores_at(screen, candidate("turning-bias"), when, strength=1.0)
    assert score.z > 4
    assert not is_steady(score, scene, block_s)


@pytest.mark.parametrize("seed", [5, 6, 7])
def test_pulses_that_blocks_do_not_see(screen, candidate, seed):
    """Two seconds in each twenty, whenever they begin: blocks have one strength, phases do not."""
    bias = candidate("turning-bias")
    score, scene = scores_at(screen, bias, lambda t: (t + 1.7) % 20 < 2, 0.5, seed)
    assert score.z > 3
    assert is_steady(score, scene, MINUTES_S)
    assert has_pulses(score, scene)


def test_pulses_of_an_effect_on_speed(screen, candidate):
    """They are of all moves, with headings or not: of another number than turns are."""
    scene = screen(11).scene
    draws = np.random.default_rng(5).normal(size=len(scene.moves))
    assert not has_pulses(summed(candidate("crowding"), draws + 0.1), scene)
    at_times = (scene.time_s(scene.moves) + 1.7) % 60 < 3
    for strength in (0.8, 1.5, 3.0):
        assert has_pulses(summed(candidate("crowding"), draws + strength * at_times), scene)


def test_what_cannot_be_told_has_no_pulses(screen, candidate):
    """Scores that are 0 or not known, in a recording too short for four pulses as well."""
    score, scene = scores_at(screen, candidate("turning-bias"), lambda t: t % 60 < 3, 1.0)
    for value in (0.0, np.nan):
        assert not has_pulses(summed(score.candidate, np.full_like(score.steps, value)), scene)
    brief = screen(11, minutes=0.25).scene
    steps = np.ones(len(brief.turns))
    assert not has_pulses(summed(score.candidate, steps), brief)


def test_what_is_there_all_the_time_has_no_pulses(screen, candidate):
    """Clear or faint: in none of eighty, though chance alone gives phases that differ to one in ten
    faint ones. Nor has what waxes and wanes by less than its mean, however plain its period is, or
    what is of individuals.
    """
    bias = candidate("turning-bias")
    for seed in range(40):
        for strength in (0.02, 0.5):
            assert not has_pulses(*scores_at(screen, bias, lambda t: t >= 0, strength, seed))
    score, scene = scores_at(screen, bias, lambda t: t >= 0, 1.0)
    wave = 0.6 * np.sin(2 * np.pi * scene.time_s(scene.turns) / 60)
    assert not has_pulses(summed(bias, score.steps + wave), scene)
    assert has_pulses(summed(bias, score.steps - 0.7 + wave), scene)
    assert not has_pulses(summed(candidate("boldness"), score.steps - 0.7 + wave), scene)


@pytest.mark.parametrize("name", ["boldness", "freezing", "generic:heading:time"])
def test_what_differs_between_times_by_nature_may_do_so(screen, candidate, name):
    """Individuals are near a door at times, rests go on, and some effects have their times."""
    score, scene = scores_at(screen, candidate(name), lambda t: t % 300 < 60, strength=1.0)
    assert is_steady(score, scene, MINUTES_S)
    assert not _lasts(score.candidate)


def course(scene, strength, gain, rng):
    """Return what an effect gains at each step whose strength differs between steps."""
    at = scene.moves.at
    asked = np.full(len(at), gain)
    luck = rng.normal(size=len(at)) * np.sqrt(asked)
    return Course(apart=asked * (strength - 1) + luck, expected=asked / 2, of=(scene, at))


@pytest.mark.parametrize(("spread", "steady"), [(0.0, True), (0.6, True), (1.4, False)])
@pytest.mark.parametrize("gain", [0.02, 2.0])
def test_minutes_may_differ_by_less_than_the_mean(screen, spread, steady, gain):
    """Though a long recording of a strong effect tells any two of them apart."""
    scene = screen(5).scene
    minute = scene.time_s(scene.moves) // MINUTES_S
    strength = 1 + spread * np.where(minute % 2 == 0, 1.0, -1.0)
    rng = np.random.default_rng(5)
    own = course(scene, strength - strength.mean() + 1, gain, rng)
    assert own.in_all_minutes is steady


def test_one_block_alone_tells_of_no_spread():
    """However the others are: they weigh nothing beside it."""
    one = np.ones(3)
    assert _has_one_strength(np.array([1.0, 1, 2]), one, np.array([1e-20, 1, 1]))
    assert _has_one_strength(np.array([1e-170, 2e-170]), np.full(2, 1e-170), np.full(2, 1e-30))
    assert _has_one_strength(one[:1], one[:1], one[:1])
    assert not _has_one_strength(np.array([900.0, 0, 0]), 300 * one, 300 * one)

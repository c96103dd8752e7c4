"""What effects add on steps that their fit has not seen."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from zfcal.artifacts.arenas import load_arena
from zfcal.diagnose.candidates import candidate_of
from zfcal.diagnose.heldout import (
    Steps,
    effect_steps,
    evaluate,
    fit_base,
    fit_effects,
    heading_gains,
    own_speeds,
    scene_of,
    speed_gains,
)
from zfcal.diagnose.placebo import count_free, placebo_for
from zfcal.model.effects import find_effect
from zfcal.model.effects.base import Company
from zfcal.model.scene import make_scene
from zfcal.model.simulate import simulate_tracks
from zfcal.parameters import natural
from zfcal.tracks import Samples

DT_S = 0.2
BLOCK = 300
"""Samples in a minute."""


@pytest.fixture(scope="module")
def arena():
    """Two rooms."""
    return load_arena("two-rooms", Path())


@pytest.fixture(scope="module")
def model(arena):
    """What drives the fish, but for effects."""
    return natural(tuple((z.name, z.follows_walls) for z in arena.zones), dt_s=DT_S)


def simulated(arena, model, minutes, *, seed=1):
    """Return a scene of 4 fish and a robot that the model drives, and its blocks."""
    n_steps = round(60 * minutes / DT_S)
    xy, _ = simulate_tracks(model, arena, n_agents=5, n_robots=1, n_steps=n_steps, seed=seed)
    samples = Samples(
        dt_s=DT_S,
        k=np.arange(n_steps),
        agent=np.arange(5, dtype=np.int32),
        kind=np.array([0, 0, 0, 0, 1], dtype=np.int8),
        xy_m=xy,
        confidence=np.ones((n_steps, 5), dtype=np.float32),
    )
    return make_scene(samples, arena), np.arange(n_steps) // BLOCK


def halves(scene, block):
    """Return the steps of even and of odd minutes."""
    even = np.arange(block[-1] + 1) % 2 == 0
    return scene_of(scene, block, even), scene_of(scene, block, ~even)


@pytest.fixture(scope="module")
def aligned(arena, model):
    """Ten minutes of fish that align: base and extended model fitted, and the other minutes."""
    true = dataclasses.replace(model, effects={"alignment": {"weight": 15.0, "kappa": 8.0}})
    training, judging = halves(*simulated(arena, true, 10))
    base = fit_base(training, model)
    return base, fit_effects(base, {"alignment": {"weight": 8.0}}), judging


def test_no_step_crosses_an_edge_of_its_block(arena, model):
    """A step needs the displacement before and after: the first and last of a minute fall."""
    scene, block = simulated(arena, model, 2)
    training, judging = halves(scene, block)
    for part, own in ((training, 0), (judging, 1)):
        at = part.turns.at
        assert (block[at] == own).all()
        assert (block[at - 1] == own).all()
        assert (block[at + 1] == own).all()
    moves = np.concatenate([training.moves.at, judging.moves.at])
    assert not {BLOCK - 1, BLOCK} & set(moves.tolist())
    assert {BLOCK - 2, BLOCK + 1} <= set(moves.tolist())
    assert training.states is scene.states


def test_an_effect_is_fitted_and_its_gain_is_what_the_model_expects(aligned):
    """Weight 15 and kappa 8 within 30 %; measured over expected gain within 0.25 of one.

    Over 4500 held-out steps of about 0.1 nats the ratio scatters by some 0.08.
    """
    base, extended, judging = aligned
    values = extended.fitted.parameters.effects["alignment"]
    assert values["weight"] == pytest.approx(15.0, rel=0.3)
    assert values["kappa"] == pytest.approx(8.0, rel=0.3)
    gains = heading_gains(evaluate(extended, judging), evaluate(base, judging))
    assert gains.gain.values.mean() > 0.03
    ratio = gains.gain.values.sum() / gains.expected.values.sum()
    assert abs(ratio - 1) < 0.25
    assert (gains.expected.values >= -1e-9).all()


def test_a_wrong_effect_gains_nothing(aligned):
    """A handedness, where fish align: within a hundredth of a nat a step."""
    base, _, judging = aligned
    wrong = fit_effects(base, {"turning-bias": {}})
    gains = heading_gains(evaluate(wrong, judging), evaluate(base, judging))
    assert abs(gains.gain.values.mean()) < 0.01


def test_a_model_gains_nothing_over_itself(aligned):
    """Neither measured nor expected."""
    base, _, judging = aligned
    there = evaluate(base, judging)
    gains = heading_gains(there, there)
    assert not gains.gain.values.any()
    assert gains.expected.values == pytest.approx(0.0, abs=1e-12)
    assert speed_gains(there, there, base, random=np.random.default_rng(0)) is None


def test_the_effects_own_statistic_vanishes_with_it(aligned):
    """Z above 15 without the effect, below 4 with it, on held-out steps."""
    base, extended, judging = aligned
    values = extended.fitted.parameters.effects["alignment"]

    def z(screen):
        steps = effect_steps(evaluate(screen, judging), screen, "alignment", values).values
        return steps.sum() / np.sqrt((steps**2).sum())

    assert z(base) > 15
    assert abs(z(extended)) < 4


def test_an_effect_on_speed_is_not_in_the_speeds_a_second_time(arena, model):
    """Fish that lose half of their speed in 14 minutes draw the frequencies of the model.

    With the effect left in, the histogram is wider than that by far more.
    """
    true = dataclasses.replace(model, effects={"fatigue": {"per_hour": 3.0, "usual_at_s": 420.0}})
    scene, block = simulated(arena, true, 14)
    training, judging = halves(scene, block)
    base = fit_base(training, model)
    extended = fit_effects(base, {"fatigue": {"per_hour": 2.0, "usual_at_s": 420.0}})
    assert extended.fitted.parameters.effects["fatigue"]["per_hour"] == pytest.approx(3.0, rel=0.2)
    limits = arena.bins.speed_m_s

    def off(screen):
        found = own_speeds(screen, model, limits)
        return sum(
            np.abs(np.subtract(own.speed_frequency, drawn.speed_frequency)).sum()
            for own, drawn in zip(found.zones, model.zones, strict=True)
        )

    assert off(extended) < 0.6 * off(base)
    there = evaluate(extended, judging), evaluate(base, judging)
    gains = speed_gains(*there, extended, random=np.random.default_rng(0))
    ratio = gains.gain.values.sum() / gains.expected.values.sum()
    assert abs(ratio - 1) < 0.3


def test_rests_are_not_draws_of_no_speed(arena, model):
    """Fish that stop for 3 s ten times a minute: the lowest bin is that of the model again."""
    true = dataclasses.replace(model, effects={"freezing": {"rate_per_s": 0.15, "duration_s": 3.0}})
    training, judging = halves(*simulated(arena, true, 8))
    base = fit_base(training, model)
    extended = fit_effects(base, {"freezing": {"rate_per_s": 0.1, "duration_s": 2.0}})
    walls = extended.fitted.parameters.zone_names.index("walls")
    lowest = own_speeds(extended, model, arena.bins.speed_m_s).zones[walls].speed_frequency[0]
    drawn = model.zones[walls].speed_frequency[0]
    still = float(extended.still[0].mean())
    assert still > 0.2
    assert abs(lowest - drawn) < 0.03
    there = evaluate(extended, judging), evaluate(base, judging)
    gains = speed_gains(*there, extended, random=np.random.default_rng(0))
    assert np.isfinite(gains.base.values).all()
    assert gains.gain.values.mean() > 0.1
    assert gains.gain.values.sum() / gains.expected.values.sum() == pytest.approx(1.0, abs=0.15)


def test_rare_rests_among_many_short_draws_are_worth_what_they_are_to_be(arena, model):
    """A rest of 2 s every 100 s and fish, among a twentieth of draws that are too short.

    Held out the chain gains what a chain like it would, and its own statistic, more steps at rest
    after steps at rest than short draws make, is large without it and gone with it.
    """
    values = {"rate_per_s": 0.01, "duration_s": 2.0}
    true = dataclasses.replace(model, effects={"freezing": values})
    training, judging = halves(*simulated(arena, true, 9))
    base = fit_base(training, model)
    extended = fit_effects(base, {"freezing": values})
    there = evaluate(extended, judging), evaluate(base, judging)

    gains = speed_gains(*there, extended, random=np.random.default_rng(0))

    assert gains.gain.values.sum() > 20
    assert gains.gain.values.sum() / gains.expected.values.sum() == pytest.approx(1.0, abs=0.4)
    found = extended.fitted.parameters.effects["freezing"]
    with_, without = (effect_steps(each, extended, "freezing", found).values for each in there)
    assert without.sum() / np.sqrt((without**2).sum()) > 5
    assert abs(with_.sum()) < 0.3 * abs(without.sum())


def test_sums_by_block_by_hand():
    """Steps at samples 0, 1 and 3 in blocks 0, 0 and 1."""
    steps = Steps(at=np.array([0, 1, 3]), values=np.array([1.0, 2.0, 5.0]))
    sums, counts = steps.by_block(np.array([0, 0, 1, 1]), 3)
    assert sums.tolist() == [3.0, 5.0, 0.0]
    assert counts.tolist() == [2.0, 1.0, 0.0]


def test_a_candidate_takes_its_shape_from_the_parameters():
    """All but the strength; what is not given has its default."""
    late = {"delay_s": 0.4, "felt_m": 0.0, "whole": 1.0, "then": 0.0, "near": 0.0}
    assert candidate_of("reaction-delay", {"share": 0.3, "delay_s": 0.4}).shape == late
    shape = candidate_of("alignment", {"weight": 3.0, "kappa": 5.0}).shape
    assert "weight" not in shape
    assert shape["kappa"] == 5.0


COMPANY = Company(n_fish=4, n_robots=0, has_rooms=True, follows_walls=True)


def test_a_placebo_changes_the_same_and_has_as_many_parameters():
    """Heading for heading, speed for speed; the same one whatever the data."""
    for name in ("alignment", "group-cohesion", "fatigue", "turning-bias"):
        wrong = placebo_for(name, COMPANY, without=())
        assert wrong.on_speed == find_effect(name).on_speed
        assert wrong.name != name
        assert wrong == placebo_for(name, COMPANY, without=())
    assert count_free(find_effect("turning-bias")) == count_free(
        placebo_for("turning-bias", COMPANY, without=())
    )


def test_a_placebo_is_none_of_what_is_missing_and_needs_no_more_than_there_is():
    """Excluded ones are passed over, and so is what needs a robot."""
    first = placebo_for("turning-bias", COMPANY, without=()).name
    second = placebo_for("turning-bias", COMPANY, without=(first,)).name
    assert second not in {first, "turning-bias"}
    everybody = {first, second, "robot-avoidance"}
    alone = Company(n_fish=1, n_robots=0, has_rooms=False, follows_walls=False)
    found = placebo_for("turning-bias", alone, without=everybody)
    assert found is None or found.lacks(alone) is None

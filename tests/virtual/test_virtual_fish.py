"""The fish of a virtual tank: how they differ, drift, swim and are tracked."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from zfcal.artifacts.arenas import load_arena
from zfcal.errors import InputError
from zfcal.parameters import ALPHA_MAX, natural
from zfcal.stages.trial_context import OpenTrial
from zfcal.tracks import FISH, ROBOT
from zfcal.trial import Trial
from zfcal.virtual.fish import FishOptions, Truth, VirtualFish, varied

ARENA = load_arena("two-rooms", Path())
BASE = natural(tuple((z.name, z.follows_walls) for z in ARENA.zones), dt_s=0.2)
FPS = 15.0
STILL = np.array([0.225, 0.775, 0.5])


def tank(seed=1, **options):
    """Return four virtual fish."""
    trial = Trial(
        root=Path(), arena="two-rooms", n_fish=4, n_robots=1, fps=FPS, dt_s=0.2, seed=seed
    )
    return VirtualFish(BASE, OpenTrial(trial=trial, arena=ARENA), FishOptions(**options))


def logs_of(parameters):
    """Return the log of what varies freely, relative to the base, shape (zone, 2)."""
    return np.log(
        [
            [zone.kappa_0 / base.kappa_0, zone.kappa_f / base.kappa_f]
            for zone, base in zip(parameters.zones, BASE.zones, strict=True)
        ]
    )


def test_without_variation_they_are_the_species():
    """All standard deviations zero, no wariness: the base parameters, gamma rows scaled."""
    options = FishOptions(between_sd=0.0, drift_sd=0.0, wariness=0.0)
    truth = Truth(BASE, options, seed=4)
    truth.carry_on(1000.0)
    np.testing.assert_allclose(logs_of(truth.parameters), 0.0, atol=1e-12)
    assert truth.parameters.effects == {}
    assert all(max(zone.gamma.values()) == 1.0 for zone in truth.parameters.zones)


def test_trials_differ_by_the_stated_spread():
    """Over 200 trials the logs have mean 0 and the standard deviation that was asked for."""
    options = FishOptions(between_sd=0.2, drift_sd=0.0)
    logs = np.array([logs_of(Truth(BASE, options, seed=s).parameters) for s in range(200)])
    assert abs(logs.mean()) < 0.02
    assert logs.std() == pytest.approx(0.2, rel=0.06)


def test_drift_keeps_its_spread_and_forgets():
    """At any time it has its standard deviation; after its time the correlation is 1/e."""
    options = FishOptions(between_sd=0.0, drift_sd=0.1, drift_s=600.0)
    pairs = []
    for seed in range(300):
        truth = Truth(BASE, options, seed=seed)
        early = logs_of(truth.parameters)
        for _ in range(60):
            truth.carry_on(10.0)
        pairs.append((early, logs_of(truth.parameters)))
    early, late = np.moveaxis(np.array(pairs).reshape(300, 2, -1), 1, 0)
    assert early.std() == pytest.approx(0.1, rel=0.06)
    assert late.std() == pytest.approx(0.1, rel=0.06)
    kept = np.mean(early * late) / (early.std() * late.std())
    assert kept == pytest.approx(np.exp(-1), abs=0.08)


def test_what_a_calibration_cannot_reach_is_cut_off():
    """Genes end at their bounds: the truth must be one that a search could find."""
    far = varied(BASE, np.full((3, 6), 2.0))
    assert max(zone.alpha for zone in far.zones) == ALPHA_MAX


def test_the_same_seed_gives_the_same_fish():
    """Frame by frame, with what the tracker makes of them; another seed gives others."""

    def frames(seed):
        fish = tank(seed)
        return [fish.tracked(fish.next_frame(STILL)) for _ in range(300)]

    assert frames(3) == frames(3)
    assert frames(3) != frames(4)


def test_between_steps_they_swim_straight():
    """Every third frame is a step; the two between lie on the line, a third apart."""
    fish = tank()
    frames = [fish.next_frame(STILL) for _ in range(31)]
    xy_m = np.array([[(a.x_m, a.y_m) for a in f.agents if a.kind == FISH] for f in frames])
    third = (xy_m[3::3] - xy_m[:-1:3]) / 3
    np.testing.assert_allclose(xy_m[1::3], xy_m[:-1:3] + third, atol=1e-12)
    np.testing.assert_allclose(xy_m[2::3], xy_m[:-1:3] + 2 * third, atol=1e-12)
    np.testing.assert_allclose([f.time_s for f in frames], np.arange(31) / FPS, atol=1e-9)


def test_the_robot_is_where_it_is_said_to_be():
    """It is the last agent; without a place there is none."""
    fish = tank()
    robot = fish.next_frame(STILL).agents[-1]
    assert (robot.agent, robot.kind, robot.x_m, robot.y_m) == (4, ROBOT, 0.225, 0.775)
    assert len(fish.next_frame(np.full(3, np.nan)).agents) == 4


def test_the_tracker_has_the_stated_noise_and_drops():
    """Over a minute; who is lost has no row."""
    fish = tank(noise_m=0.001, dropped=0.05)
    errors, rows = [], 0
    for _ in range(900):
        truth = fish.next_frame(STILL)
        seen = fish.tracked(truth)
        rows += len(seen.agents)
        where = {agent.agent: agent for agent in truth.agents}
        errors += [agent.x_m - where[agent.agent].x_m for agent in seen.agents]
    assert np.std(errors) == pytest.approx(0.001, rel=0.05)
    assert rows / (900 * 5) == pytest.approx(0.95, abs=0.012)


@pytest.mark.parametrize(
    "wrong", [{"drift_s": 0.0}, {"noise_m": -1.0}, {"dropped": 1.0}, {"between_sd": float("nan")}]
)
def test_impossible_fish_are_told_in_one_line(wrong):
    """With the name of what is wrong and what was given."""
    with pytest.raises(InputError, match=next(iter(wrong))):
        FishOptions(**wrong)


def test_a_wary_shoal_swims_otherwise():
    """Wariness is the effect of the model by that name; a negative one seeks the robot."""
    truth = Truth(BASE, FishOptions(wariness=-0.5), seed=1)
    assert truth.parameters.effects == {"robot-avoidance": {"strength": -0.5, "flight": 0.0}}
    shy, bold = (dataclasses.asdict(tank(wariness=w).truth.parameters) for w in (1.0, 0.0))
    assert shy["effects"] != bold["effects"]
    assert shy["zones"] == bold["zones"]

"""The one-step likelihood: its density, its gradient, and what it recovers."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from zfcal.errors import InputError
from zfcal.model.likelihood import _objective, _zone_steps, fit, log_density
from zfcal.model.simulate import simulate_tracks
from zfcal.model.steps import Steps, steps_of
from zfcal.parameters import to_genes
from zfcal.tracks import Samples


def samples_of(xy):
    """Return samples of fish that are seen at every step of 0.2 s."""
    n, agents = xy.shape[:2]
    return Samples(
        dt_s=0.2,
        k=np.arange(n),
        agent=np.arange(1, agents + 1, dtype=np.int32),
        kind=np.zeros(agents, dtype=np.int8),
        xy_m=xy,
        confidence=np.ones((n, agents), dtype=np.float32),
    )


@pytest.fixture(scope="module")
def run(two_rooms, model):
    """Return five simulated fish over ten minutes."""
    return simulate_tracks(model, two_rooms, n_agents=5, n_steps=3000, seed=21)


@pytest.fixture(scope="module")
def steps(run, two_rooms, model):
    """Return their steps."""
    return steps_of(samples_of(run[0]), two_rooms, fov_rad=model.fov_rad)


def test_the_density_is_the_twins_at_every_step(run, steps, twin, two_rooms, model):
    """Thirty steps anywhere: log density per radian as the plain formulas give it."""
    xy, heading = run
    rng = np.random.default_rng(0)
    differences = []
    for row in rng.choice(len(steps), 30, replace=False):
        chosen = steps.take(np.array([row]))
        zone = int(chosen.zone[0])
        own = model.zones[zone - 1]
        part = _zone_steps(chosen, zone, follows_walls=two_rooms.zones[zone - 1].follows_walls)
        log_gamma = np.log([own.gamma[name] for name in two_rooms.zone_names])
        found = log_density(part, (own.kappa_0, own.kappa_f), own.alpha, log_gamma)[0][0]

        k, i = int(chosen.k[0]), int(chosen.agent[0]) - 1
        speed = float(chosen.speed_m_s[0])
        thetas, density = twin.density(i, xy[k], heading[k], speed, model, two_rooms, n=7200)
        angle = math.atan2(chosen.taken[0, 1], chosen.taken[0, 0])
        differences.append(found - math.log(np.interp(angle, thetas, density)))

    # The integral over 64 cells misses a little beside a cliff.
    assert np.median(np.abs(differences)) < 2e-3
    assert np.abs(differences).max() < 0.05


def test_the_gradient_is_that_of_finite_differences(steps, two_rooms):
    """All parameters of each zone, lapse included, to six digits."""
    for zone in (1, 2, 3):
        part = _zone_steps(steps, zone, follows_walls=two_rooms.zones[zone - 1].follows_walls)
        x = np.array([0.31, 0.22, 0.7, -0.2, -0.4, -0.6, 0.02])
        moves = 1e-6 * np.eye(x.size)

        _, gradient = _objective(x, part)
        numeric = [
            (_objective(x + move, part)[0] - _objective(x - move, part)[0]) / 2e-6 for move in moves
        ]

        assert gradient == pytest.approx(numeric, rel=1e-5, abs=1e-8)


def test_the_score_of_the_truth_is_a_martingale(steps, two_rooms, model):
    """At the true parameters each gradient sums to zero within 4.5 standard errors."""
    for zone in (1, 2, 3):
        own = model.zones[zone - 1]
        part = _zone_steps(steps, zone, follows_walls=two_rooms.zones[zone - 1].follows_walls)
        log_gamma = np.log([own.gamma[name] for name in two_rooms.zone_names])
        _, slopes = log_density(part, (own.kappa_0, own.kappa_f), own.alpha, log_gamma)
        error = slopes.std(axis=0) * math.sqrt(len(slopes))
        assert (np.abs(slopes.sum(axis=0)) <= 4.5 * error + 1e-9).all()


@pytest.mark.slow
def test_intervals_hold_the_truth(two_rooms, model):
    """Ten minutes of five fish, five seeds: at least 85 % of 95 % intervals hold it.

    Of 15 free numbers those that the recording identifies are counted, some
    60 in all; a right interval fails this once in a thousand times.
    """
    scaled = {
        f"{zone.name}.gamma.{to}": value / max(zone.gamma.values())
        for zone in model.zones
        for to, value in zone.gamma.items()
    }
    truth = scaled | {
        f"{zone.name}.{key}": getattr(zone, key)
        for zone in model.zones
        for key in ("kappa_0", "kappa_f", "alpha")
    }
    held = []
    for seed in range(5):
        xy, _ = simulate_tracks(model, two_rooms, n_agents=5, n_steps=3000, seed=100 + seed)
        found = fit(steps_of(samples_of(xy), two_rooms, fov_rad=model.fov_rad), two_rooms, model)
        held += [
            low <= truth[name] <= high
            for name, (low, high) in found.interval.items()
            if found.identified[name] and high > low
        ]

    assert len(held) > 45
    assert np.mean(held) > 0.85


@pytest.mark.slow
def test_a_zone_nobody_can_reach_is_not_identified(steps, two_rooms, model):
    """From the centre no single step leads into the corridor: its attraction stays open."""
    found = fit(steps, two_rooms, model)

    assert not found.identified["centre.gamma.corridor"]
    assert found.interval["centre.gamma.corridor"] == (0.0, 1.0)
    assert found.identified["walls.kappa_0"]


@pytest.mark.slow
def test_tracking_errors_go_into_the_lapse(run, two_rooms, model):
    """One position in fifty thrown 4 cm off: kappa stays within 15 %, the lapse rises."""
    xy = run[0].copy()
    rng = np.random.default_rng(3)
    hit = rng.random(xy.shape[:2]) < 0.02
    angle = rng.uniform(0, 2 * math.pi, xy.shape[:2])
    thrown = xy + 0.04 * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    xy[hit] = thrown[hit]

    found = fit(steps_of(samples_of(xy), two_rooms, fov_rad=model.fov_rad), two_rooms, model)

    assert found.parameters.zones[2].kappa_0 == pytest.approx(8.0, rel=0.15)
    assert found.lapse["centre"] > 0.02


@pytest.mark.slow
def test_the_estimate_beats_every_neighbour(steps, two_rooms, model):
    """No parameter moved by a tenth makes the recording more likely."""
    found = fit(steps, two_rooms, model)
    genes = to_genes(found.parameters)

    assert ((genes >= 0) & (genes <= 1)).all()
    for zone in (1, 2, 3):
        part = _zone_steps(steps, zone, follows_walls=two_rooms.zones[zone - 1].follows_walls)
        own = found.parameters.zones[zone - 1]
        log_gamma = np.log([own.gamma[name] for name in two_rooms.zone_names])
        best = log_density(part, (own.kappa_0, own.kappa_f), own.alpha, log_gamma)[0].sum()
        for change in (0.9, 1.1):
            for kappa, alpha in (
                ((own.kappa_0 * change, own.kappa_f), own.alpha),
                ((own.kappa_0, min(30.0, own.kappa_f * change)), own.alpha),
                ((own.kappa_0, own.kappa_f), min(50.0, own.alpha * change)),
            ):
                moved = log_density(part, kappa, alpha, log_gamma)[0].sum()
                # The fit allows for lapses, the plain density does not.
                assert moved <= best + 0.5


def test_missing_and_resting_agents_make_no_steps(run, two_rooms, model):
    """A gap takes the three steps that touch it; a rest below 2 mm takes its own."""
    xy = run[0][:60].copy()
    whole = steps_of(samples_of(xy), two_rooms, fov_rad=model.fov_rad)
    xy[30, 2] = np.nan
    gapped = steps_of(samples_of(xy), two_rooms, fov_rad=model.fov_rad)

    def of_third(s: Steps) -> set[int]:
        return {int(k) for k, agent in zip(s.k, s.agent, strict=True) if agent == 3}

    assert of_third(whole) - of_third(gapped) == of_third(whole) & {29, 30, 31}
    assert len(whole) - len(gapped) == len(of_third(whole) & {29, 30, 31})


@pytest.mark.slow
def test_a_recording_of_no_agents_is_refused(two_rooms, model):
    """One clear error, not an empty estimate."""
    empty = samples_of(np.empty((100, 0, 2)))
    with pytest.raises(InputError, match="0 agents"):
        steps_of(empty, two_rooms, fov_rad=model.fov_rad)
    lost = samples_of(np.full((100, 2, 2), np.nan))
    with pytest.raises(InputError, match="0 steps in all"):
        fit(steps_of(lost, two_rooms, fov_rad=model.fov_rad), two_rooms, model)


@pytest.mark.slow
def test_the_template_keeps_its_speeds(steps, two_rooms, model):
    """Speeds are measured, not estimated here."""
    found = fit(steps, two_rooms, model).parameters

    assert [z.speed_frequency for z in found.zones] == [z.speed_frequency for z in model.zones]
    assert dataclasses.replace(found, zones=model.zones) == model

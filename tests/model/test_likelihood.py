"""The one-step likelihood: its density, its gradient, and what it recovers."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from zfcal.errors import InputError
from zfcal.model.extended import log_p_at, maximise, start_of
from zfcal.model.fitted import zone_scores, zone_turns
from zfcal.model.likelihood import fit
from zfcal.model.scene import Turns, make_scene
from zfcal.model.simulate import simulate_tracks
from zfcal.model.views import view_of
from zfcal.parameters import from_genes, to_genes
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
def scene(run, two_rooms):
    """Return their states and steps."""
    return make_scene(samples_of(run[0]), two_rooms)


def without_lapse(model):
    """Return the truth per zone, as a fit takes it, with no lapse."""
    start = start_of(model)
    for x in start:
        x[-1] = 0.0
    return start


def test_the_density_is_the_twins_at_every_step(run, scene, twin, two_rooms, model):
    """Thirty steps anywhere: log density per radian as the plain formulas give it."""
    xy, heading = run
    rng = np.random.default_rng(0)
    log_p, turns = log_p_at(scene, model, without_lapse(model)), scene.turns
    differences = []
    for row in rng.choice(len(turns), 30, replace=False):
        k, i, speed = int(turns.at[row]), int(turns.track[row]) - 1, float(turns.speed_m_s[row])
        thetas, density = twin.density(i, xy[k], heading[k], speed, model, two_rooms, n=7200)
        angle = math.atan2(turns.taken[row, 1], turns.taken[row, 0])
        differences.append(log_p[row] - math.log(np.interp(angle, thetas, density)))

    # The integral over 64 cells misses a little beside a cliff.
    assert np.median(np.abs(differences)) < 2e-3
    assert np.abs(differences).max() < 0.05


def test_the_score_of_the_truth_is_a_martingale(scene, model):
    """At the true parameters each slope sums to zero within 4.5 standard errors."""
    view = view_of(scene, model)
    for x, turns in zip(without_lapse(model), zone_turns(scene), strict=True):
        slopes = zone_scores(x, turns, view)[1][:, :-1]
        error = slopes.std(axis=0) * math.sqrt(len(slopes))
        assert (np.abs(slopes.sum(axis=0)) <= 4.5 * error + 1e-9).all()


@pytest.mark.slow
def test_the_estimate_is_the_base_that_a_diagnosis_starts_from(two_rooms, model):
    """The same parameters within a tenth of an interval, from other starts, and the same lapse."""
    zones = tuple(dataclasses.replace(zone, alpha=20.0) for zone in model.zones)
    loose = dataclasses.replace(model, zones=zones)
    xy, _ = simulate_tracks(loose, two_rooms, n_agents=5, n_steps=3000, seed=22)
    scene = make_scene(samples_of(xy), two_rooms)

    estimate = fit(scene, from_genes(np.full(18, 0.5), model))
    base = maximise(scene, model)

    assert estimate.n_steps == base.used.sum()
    assert estimate.nats_per_step * estimate.n_steps == pytest.approx(base.nats, abs=0.05)
    for x, zone in zip(base.x, base.parameters.zones, strict=True):
        own = {zone.name: zone for zone in estimate.parameters.zones}[zone.name]
        for key in ("kappa_0", "kappa_f", "alpha"):
            low, high = estimate.interval[f"{zone.name}.{key}"]
            assert getattr(own, key) == pytest.approx(getattr(zone, key), abs=0.1 * (high - low))
        assert estimate.lapse[zone.name] == pytest.approx(x[-1], abs=2e-3)


@pytest.mark.slow
def test_an_estimate_stays_within_a_genome_and_a_base_does_not(two_rooms, model):
    """Fish that turn less than a gene can say: kappa 60 along walls, of at most 30."""
    zones = tuple(dataclasses.replace(zone, kappa_0=60.0, alpha=0.0) for zone in model.zones)
    straight = dataclasses.replace(model, zones=zones)
    xy, _ = simulate_tracks(straight, two_rooms, n_agents=5, n_steps=1500, seed=2)
    scene = make_scene(samples_of(xy), two_rooms)

    estimate, base = fit(scene, model), maximise(scene, model)

    assert estimate.parameters.zones[1].kappa_0 == 30.0
    assert base.parameters.zones[1].kappa_0 == pytest.approx(60.0, rel=0.05)
    assert base.nats > estimate.nats_per_step * estimate.n_steps + 10


@pytest.mark.slow
def test_a_concentration_along_walls_of_its_own_is_estimated_as_well(scene, model):
    """The estimate has one kappa for the base of a zone, whatever the template has."""
    zones = tuple(dataclasses.replace(zone, kappa_w=3.0) for zone in model.zones)

    found = fit(scene, dataclasses.replace(model, zones=zones)).parameters

    assert [zone.kappa_w for zone in found.zones] == [None] * 3
    assert found.zones[1].kappa_0 == pytest.approx(model.zones[1].kappa_0, rel=0.15)


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
        found = fit(make_scene(samples_of(xy), two_rooms), model)
        held += [
            low <= truth[name] <= high
            for name, (low, high) in found.interval.items()
            if found.identified[name] and high > low
        ]

    assert len(held) > 45
    assert np.mean(held) > 0.85


@pytest.mark.slow
def test_a_zone_nobody_can_reach_is_not_identified(scene, model):
    """From the centre no single step leads into the corridor: its attraction stays open."""
    found = fit(scene, model)

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

    found = fit(make_scene(samples_of(xy), two_rooms), model)

    assert found.parameters.zones[2].kappa_0 == pytest.approx(8.0, rel=0.15)
    assert found.lapse["centre"] > 0.02


@pytest.mark.slow
def test_the_estimate_beats_every_neighbour(scene, model):
    """No parameter moved by a tenth makes the recording more likely."""
    found = fit(scene, model)
    genes = to_genes(found.parameters)
    start = start_of(found.parameters)
    for x, lapse in zip(start, found.lapse.values(), strict=True):
        x[-1] = lapse
    best = np.nansum(log_p_at(scene, found.parameters, start))

    assert ((genes >= 0) & (genes <= 1)).all()
    assert best == pytest.approx(found.nats_per_step * found.n_steps, abs=1e-6)
    for zone in range(3):
        for p in range(3):
            for change in (0.9, 1.1):
                moved = [x.copy() for x in start]
                moved[zone][p] = min(moved[zone][p] * change, 1.0)
                assert np.nansum(log_p_at(scene, found.parameters, moved)) <= best + 0.01


def test_missing_and_resting_agents_make_no_steps(run, two_rooms):
    """A gap takes the three steps that touch it; a rest below 2 mm takes its own."""
    xy = run[0][:60].copy()
    whole = make_scene(samples_of(xy), two_rooms).turns
    xy[30, 2] = np.nan
    gapped = make_scene(samples_of(xy), two_rooms).turns

    def of_third(turns: Turns) -> set[int]:
        return {int(k) for k, track in zip(turns.at, turns.track, strict=True) if track == 3}

    assert of_third(whole) - of_third(gapped) == of_third(whole) & {29, 30, 31}
    assert len(whole) - len(gapped) == len(of_third(whole) & {29, 30, 31})


@pytest.mark.slow
def test_a_recording_of_no_agents_is_refused(two_rooms, model):
    """One clear error, not an empty estimate."""
    empty = samples_of(np.empty((100, 0, 2)))
    with pytest.raises(InputError, match="0 fish"):
        make_scene(empty, two_rooms)
    lost = samples_of(np.full((100, 2, 2), np.nan))
    with pytest.raises(InputError, match="0 steps in all"):
        fit(make_scene(lost, two_rooms), model)


@pytest.mark.slow
def test_the_template_keeps_its_speeds(scene, model):
    """Speeds are measured, not estimated here."""
    found = fit(scene, model).parameters

    assert [z.speed_frequency for z in found.zones] == [z.speed_frequency for z in model.zones]
    assert dataclasses.replace(found, zones=model.zones) == model

"""Effects on speed at their maximum likelihood."""

import numpy as np
import pytest

from zfcal.diagnose.screening import Screen
from zfcal.diagnose.speeds import fit_speed, log_density
from zfcal.model.extended import maximise
from zfcal.model.scene import make_scene


def test_uniform_draws_have_a_flat_density():
    """Up to 0.2 m/s: a density of 1 / 0.2, but near its ends, within the noise of counts."""
    speed = np.linspace(0, 0.2, 20_001)[1:]
    log_p = log_density(speed, np.ones_like(speed), np.ones(len(speed), dtype=np.int64))
    middle = (speed > 0.02) & (speed < 0.18)
    assert np.exp(log_p[middle]) == pytest.approx(5.0, rel=0.03)


def test_a_factor_is_divided_out():
    """As in log f(v) = log f0(v / factor) - log factor."""
    rng = np.random.default_rng(1)
    draws, zone = rng.gamma(2.0, 0.03, 3000), rng.integers(1, 4, 3000)
    alone = log_density(draws, np.ones(3000), zone)
    twice = log_density(2 * draws, np.full(3000, 2.0), zone)
    assert twice == pytest.approx(alone - np.log(2))


def test_each_zone_has_its_own_law():
    """Zones one after the other give what they give together."""
    rng = np.random.default_rng(2)
    draws = np.concatenate([rng.gamma(2, 0.02, 500), rng.gamma(4, 0.04, 700)])
    zone = np.repeat([1, 2], [500, 700])
    ones = np.ones(1200)
    parts = [log_density(draws[zone == z], ones[zone == z], zone[zone == z]) for z in (1, 2)]
    assert log_density(draws, ones, zone) == pytest.approx(np.concatenate(parts))


@pytest.mark.parametrize("exponent", [0.4, -0.3])
def test_an_exponent_is_found_again(screen, candidate, exponent):
    """Ten minutes of five fish: within 0.06, and in an interval of at most twice that."""
    own = screen(53, {"burst-and-coast": {"exponent": exponent}})
    found = fit_speed(own, candidate("burst-and-coast"), exponent / 2)
    assert found.values["exponent"] == pytest.approx(exponent, abs=0.06)
    low, high = found.interval
    assert low < found.values["exponent"] < high
    assert high - low < 0.12
    assert found.values["usual_m_s"] == 0.07
    assert found.gain.shape == own.scene.moves.speed_m_s.shape
    assert found.gain.sum() > 50


def test_speed_matching_is_found_again(screen, candidate):
    """Within 0.1 of 0.5: the neighbours' mean speed varies less than the own one."""
    own = screen(59, {"speed-matching": {"exponent": 0.5}})
    found = fit_speed(own, candidate("speed-matching"), 0.3)
    assert found.values["exponent"] == pytest.approx(0.5, abs=0.1)


def test_no_effect_gains_next_to_nothing(screen, candidate):
    """On the base model the exponent is within 0.04 of zero, and gains a nat or four."""
    own = screen(11)
    found = fit_speed(own, candidate("burst-and-coast"), 0.01)
    assert abs(found.values["exponent"]) < 0.04
    assert -0.5 < found.gain.sum() < 8


def test_freezing_has_its_rate_and_duration(screen, candidate):
    """0.05 stops a second of 2 s each: some 130 of them in ten minutes of five fish.

    Both are known to a tenth, and found within a third.
    """
    own = screen(62, {"freezing": {"rate_per_s": 0.05, "duration_s": 2.0}})
    found = fit_speed(own, candidate("freezing"), 0.02)
    assert found.values["rate_per_s"] == pytest.approx(0.05, rel=0.33)
    assert found.values["duration_s"] == pytest.approx(2.0, rel=0.33)
    low, high = found.interval
    assert 0 < low < 0.05 < high
    assert found.gain.sum() > 100


def test_fish_that_never_stop_have_a_rate_near_zero(screen, candidate):
    """Draws too short for a heading are no rests: they do not go on."""
    own = screen(11)
    found = fit_speed(own, candidate("freezing"), 0.02)
    assert found.values["rate_per_s"] < 0.01
    assert found.gain.sum() < 20


def test_speeds_that_would_be_any_power_are_fitted_within_bounds(worlds, tank, fish, candidate):
    """Constant speeds: a strength at its bound, not beyond, where differences are taken."""
    angle = np.arange(600) * 0.2
    xy_m = np.stack([0.22 + 0.05 * np.cos(angle), 0.77 + 0.05 * np.sin(angle)], axis=1)[:, None]
    scene = make_scene(worlds.samples_of(xy_m), tank)
    own = Screen(scene=scene, fitted=maximise(scene, fish))
    for start in (-2.0, 0.01, 2.0):
        found = fit_speed(own, candidate("burst-and-coast"), start)
        assert -1.5 <= found.values["exponent"] <= 1.5
        assert np.isfinite(found.gain).all()

"""Effects on speed at their maximum likelihood."""

import numpy as np
import pytest

from zfcal.diagnose.confirming import half_of
from zfcal.diagnose.screening import Screen
from zfcal.diagnose.speeds import fit_speed, held_out_gain, log_density
from zfcal.model.extended import maximise
from zfcal.model.kernels.curves import BY_TIME
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


def test_a_factor_on_all_draws_says_nothing():
    """The law of the draws is not known, nor is their scale."""
    draws, zone = np.random.default_rng(1).gamma(2.0, 0.03, 3000), np.ones(3000, dtype=np.int64)
    alone = log_density(draws, np.ones(3000), zone)
    assert log_density(draws, np.full(3000, 1.7), zone) == pytest.approx(alone)


def test_a_law_with_steps_is_no_effect():
    """Speeds of even bins, and factors that have nothing to do with them: no share of a
    thousand wins more than two nats, wherever the edges of bins come to lie.
    """
    rng = np.random.default_rng(4)
    draws = 0.02 * (rng.choice(10, 6000, p=np.arange(10, 0, -1) / 55) + rng.random(6000))
    cue, zone = np.linspace(-1, 1, 6000), np.ones(6000, dtype=np.int64)
    alone = log_density(draws, np.ones(6000), zone).sum()
    for share in np.linspace(-0.05, 0.05, 41):
        assert log_density(draws, np.exp(share * cue), zone).sum() - alone < 2


def test_laws_are_those_of_the_steps_that_are_learnt_from():
    """Others are judged by them: a fast one that none of them was is unlikely."""
    draws = np.random.default_rng(6).gamma(2.0, 0.03, 3000)
    learnt = np.arange(3000) < 2000
    ones, zone = np.ones(3000), np.ones(3000, dtype=np.int64)
    log_p = log_density(draws, ones, zone, learnt)
    assert log_p[learnt] == pytest.approx(log_density(draws[learnt], ones[learnt], zone[learnt]))
    odd = np.where(learnt, draws, 0.5)
    assert np.all(log_density(odd, ones, zone, learnt)[~learnt] < log_p[learnt].min() + 2)


def test_each_zone_has_its_own_law():
    """Zones one after the other give what they give together."""
    rng = np.random.default_rng(2)
    draws = np.concatenate([rng.gamma(2, 0.02, 500), rng.gamma(4, 0.04, 700)])
    zone = np.repeat([1, 2], [500, 700])
    ones = np.ones(1200)
    parts = [log_density(draws[zone == z], ones[zone == z], zone[zone == z]) for z in (1, 2)]
    assert log_density(draws, ones, zone) == pytest.approx(np.concatenate(parts))


def test_a_field_has_a_pace_of_its_own():
    """Twice as fast in one field: as if each draw there were half as large."""
    rng = np.random.default_rng(3)
    draws, zone = rng.gamma(2.0, 0.03, 4000), np.ones(4000, dtype=np.int64)
    field = np.repeat([3, 7], 2000).astype(np.int64)
    twice, ones = np.where(field == 7, 2.0, 1.0), np.ones(4000)
    paced = log_density(twice * draws, ones, zone, field=field)
    known = log_density(twice * draws, twice, zone)
    assert paced.sum() == pytest.approx(known.sum(), abs=5)
    assert paced.sum() > log_density(twice * draws, ones, zone).sum() + 100
    # A factor on all of a field says nothing then.
    assert log_density(twice * draws, twice, zone, field=field).sum() == pytest.approx(
        paced.sum(), abs=0.5
    )


def test_a_pace_is_that_of_the_steps_that_are_learnt_from():
    """Others do not change the law, and a field of which nothing is known is as fast as all."""
    rng = np.random.default_rng(3)
    draws, zone = rng.gamma(2.0, 0.03, 3000), np.ones(3000, dtype=np.int64)
    field = np.repeat([1, 2, 3], 1000).astype(np.int64)
    learnt, ones = np.arange(3000) < 2000, np.ones(3000)
    own = log_density(draws, ones, zone, learnt, field)
    odd = np.where(learnt, draws, 3 * draws)
    assert log_density(odd, ones, zone, learnt, field)[learnt] == pytest.approx(own[learnt])
    unknown = log_density(draws, ones, zone, learnt)[~learnt]
    assert own[~learnt].mean() == pytest.approx(unknown.mean(), abs=0.01)


LIT = {"generic:speed:place": {"strength": 0.4, "x_m": 0.22, "y_m": 0.78, "reach_m": 0.35}}


def shy_by(per_neighbour):
    """Return fish that are slower or faster for each neighbour, in a tank with one lit room."""
    return LIT | {"crowding": {"per_neighbour": per_neighbour, "radius_m": 0.35}}


@pytest.mark.parametrize("per_neighbour", [0.1, -0.1])
def test_a_lit_room_does_not_change_the_size_of_crowding(screen, candidate, per_neighbour):
    """Where fish gather in it, company looks faster than it is: within 0.04 all the same."""
    own = screen(40, shy_by(per_neighbour))
    found = fit_speed(own, candidate("crowding", radius_m=0.35), per_neighbour / 2)
    assert found.values["per_neighbour"] == pytest.approx(per_neighbour, abs=0.04)
    assert found.gain.sum() > 100


def test_what_one_half_says_of_crowding_holds_in_the_other(screen, candidate):
    """In a lit room too: fields that nothing was learnt of say nothing."""
    own, crowding = screen(40, shy_by(0.1)), candidate("crowding", radius_m=0.35)
    halves = [half_of(own.scene, own.scene.moves, which) for which in (0, 1)]
    gains = [held_out_gain(own, crowding, 0.1, learnt) for learnt in halves]
    unknown = [np.isnan(gain).mean() for gain in gains]
    assert min(unknown) == 0
    assert 0 < max(unknown) < 0.2
    for gain, learnt in zip(gains, halves, strict=True):
        assert np.nansum(gain[~learnt]) > 30


def test_no_steps_have_no_density():
    """A recording in which nothing moved, say."""
    none, whole = np.zeros(0), np.zeros(0, dtype=np.int64)
    assert log_density(none, none, whole, field=whole).shape == (0,)


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


@pytest.mark.slow
def test_a_curve_of_an_exponent_is_found_again(screen, candidate):
    """Fast after fast steps at first, slow after them at last: a mean of nothing."""
    bent = {"by": float(BY_TIME), "knot_1": 0.0, "knot_2": 300.0, "knot_3": 600.0}
    bent |= {"more_1": 0.0, "more_3": 0.0}
    more = {"more_1": 0.5, "more_3": -0.5}
    own = screen(53, {"burst-and-coast": {"exponent": 0.0} | bent | more})
    flat = fit_speed(own, candidate("burst-and-coast"), 0.1)
    found = fit_speed(own, candidate("burst-and-coast", **bent), 0.1, bend=True)
    assert found.values["exponent"] == pytest.approx(0.0, abs=0.08)
    for key, value in more.items():
        assert found.values[key] == pytest.approx(value, abs=0.12)
    assert found.gain.sum() > flat.gain.sum() + 40
    halves = [half_of(own.scene, own.scene.moves, which) for which in (0, 1)]
    for learnt in halves:
        gain = held_out_gain(own, candidate("burst-and-coast", **bent), 0.1, learnt)
        assert np.nansum(gain[~learnt]) > 20


def test_a_curve_is_found_far_from_where_it_starts(screen, candidate):
    """A strength at the middle that no plain form has; it is kept where no curve is asked for."""
    bent = {"by": float(BY_TIME), "knot_1": 0.0, "knot_2": 300.0, "knot_3": 600.0}
    truth = {"more_1": -1.2, "more_3": -1.2}
    own = screen(53, {"burst-and-coast": {"exponent": 0.6} | bent | truth})
    flat = {"more_1": 0.0, "more_3": 0.0}
    found = fit_speed(own, candidate("burst-and-coast", **bent, **flat), 0.01, bend=True)
    assert found.values["exponent"] == pytest.approx(0.6, abs=0.1)
    for key, value in truth.items():
        assert found.values[key] == pytest.approx(value, abs=0.2)
    given = {"more_1": -1.0, "more_3": -1.4}
    moved = fit_speed(own, candidate("burst-and-coast", **bent, **given), 0.5)
    assert given.items() <= moved.values.items()
    assert moved.values["exponent"] == pytest.approx(0.6, abs=0.15)


def test_no_effect_gains_next_to_nothing(screen, candidate):
    """On the base model the exponent is within 0.04 of zero, and gains a nat or four."""
    own = screen(11)
    found = fit_speed(own, candidate("burst-and-coast"), 0.01)
    assert abs(found.values["exponent"]) < 0.04
    assert -0.5 < found.gain.sum() < 8


@pytest.fixture(scope="module")
def short(record, tank, fish):
    """Return what makes three minutes of fish ready to be asked for speeds: nothing is fitted."""

    def of(seed, effects=None):
        scene = make_scene(record(seed, effects, minutes=3.0), tank)
        return Screen(scene=scene, fitted=maximise(scene, fish, rounds=0))

    return of


FREEZING = {"freezing": {"rate_per_s": 0.05, "duration_s": 2.0}}


@pytest.fixture(scope="module")
def freezing(short, candidate):
    """Return fits to twelve recordings of fish that freeze 0.05 times a second, for 2 s."""
    return [fit_speed(short(seed, FREEZING), candidate("freezing"), 0.02) for seed in range(60, 72)]


@pytest.mark.slow
def test_freezing_has_its_rate_and_duration(freezing):
    """Some 41 rests in each of twelve recordings: 490 say both to a twentieth.

    Means lie within three standard errors, each recording's within 60 %.
    """
    rates = np.array([found.values["rate_per_s"] for found in freezing])
    durations = np.array([found.values["duration_s"] for found in freezing])
    assert rates.mean() == pytest.approx(0.05, rel=0.14)
    assert durations.mean() == pytest.approx(2.0, rel=0.14)
    assert rates == pytest.approx(0.05, rel=0.6)
    assert all(found.gain.sum() > 100 for found in freezing)


def test_the_interval_of_a_rate_holds_it(freezing):
    """In ten of twelve at the least, and no wider than 41 rests make it."""
    bounds = np.array([found.interval for found in freezing])
    holds = (bounds[:, 0] < 0.05) & (bounds[:, 1] > 0.05)
    assert holds.sum() >= 10
    width = np.log(bounds[:, 1] / bounds[:, 0]) / 2
    assert width == pytest.approx(1.96 / np.sqrt(41), rel=0.35)


def test_rests_of_one_step_count_as_well(short, candidate):
    """Of rests of 0.3 s a half is one step long; their rate is found within a fifth."""
    quick = {"freezing": {"rate_per_s": 0.2, "duration_s": 0.3}}
    rates = [
        fit_speed(short(seed, quick), candidate("freezing"), 0.1).values["rate_per_s"]
        for seed in range(80, 84)
    ]
    assert np.mean(rates) == pytest.approx(0.2, rel=0.2)


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

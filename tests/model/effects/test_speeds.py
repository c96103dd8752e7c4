"""Effects on the speed do what their sentences say."""

from __future__ import annotations

import math

import numpy as np
import pytest


def speeds(xy):
    """Return the speed of each step in m/s, shape (step, agent)."""
    return np.linalg.norm(np.diff(xy, axis=0), axis=-1) / 0.2


def test_with_fast_neighbours_a_fish_is_fast(ask):
    """Mean of those seen twice the usual speed, exponent one half: root of two."""
    asked = ask("speed-matching", {"exponent": 0.5}, X=[0.0, 0.1, 0.2], SPEED=[0.07, 0.10, 0.18])
    assert asked.speed() == pytest.approx(math.sqrt(2.0))
    asked.sight[:] = 0.0
    assert asked.speed() == 1.0


def test_who_is_not_seen_counts_where_a_model_says_so(ask):
    """Both behind: of those of known speed the mean is twice the usual one."""
    given = {"exponent": 0.5, "unseen": 1.0}
    asked = ask("speed-matching", given, X=[0.0, 0.1, 0.2], SPEED=[0.07, 0.14, np.nan])
    assert asked.speed() == pytest.approx(math.sqrt(2.0))
    asked.sight[:] = 0.0
    assert asked.speed() == pytest.approx(math.sqrt(2.0))


def test_with_focus_the_nearest_neighbour_counts(ask):
    """At 0.05 m and 0.2 m with focus 6: 4096 to one."""
    asked = ask(
        "speed-matching", {"exponent": 1.0, "focus": 6.0},
        X=[0.0, 0.05, 0.2], SPEED=[0.07, 0.14, 0.03],
    )  # fmt: skip
    assert asked.speed() == pytest.approx(2.0, rel=1e-3)


def test_matched_speeds_are_correlated(swim):
    """Two fish: speed against the other's last speed; without the effect nothing."""

    def correlation(xy):
        v = speeds(xy)
        return np.corrcoef(v[1:].ravel(), v[:-1, ::-1].ravel())[0, 1]

    assert correlation(swim("speed-matching", {"exponent": 0.6}, n_agents=2)[0]) > 0.1
    assert abs(correlation(swim(n_agents=2)[0])) < 0.05


@pytest.mark.parametrize("per_neighbour", [0.25, -0.25])
def test_in_a_crowd_speed_changes_with_each_neighbour(ask, per_neighbour):
    """Three others within 1 cm of the usual one: two beyond it."""
    asked = ask("crowding", {"per_neighbour": per_neighbour}, X=[0.0, 0.01, -0.01, 0.005, 0.9])
    assert asked.speed() == pytest.approx(math.exp(2 * per_neighbour), rel=1e-4)


def test_a_neighbour_at_the_radius_counts_half(ask):
    """And one that is not there does not count."""
    rows = {"X": [0.0, 0.1, 0.01], "ZONE": [3.0, 3.0, 0.0]}
    asked = ask("crowding", {"per_neighbour": 1.0, "radius_m": 0.1, "usual": 0.0}, **rows)
    assert asked.speed() == pytest.approx(math.exp(0.5))


def test_crowded_fish_are_faster(swim):
    """Speed with three or more others within 0.1 m over that with none."""

    def ratio(xy):
        v = speeds(xy)
        near = (np.linalg.norm(xy[:-1, :, None] - xy[:-1, None], axis=-1) < 0.1).sum(axis=-1) - 1
        return v[near >= 3].mean() / v[near == 0].mean()

    plain = ratio(swim()[0])
    assert ratio(swim("crowding", {"per_neighbour": 0.25, "radius_m": 0.1})[0]) > 1.3 * plain


def test_speed_lasts(ask):
    """Last speed four times the usual, exponent one half: twice; the slowest count as 5 mm/s."""
    asked = ask("burst-and-coast", {"exponent": 0.5}, SPEED=[0.28, 0.0])
    assert asked.speed() == pytest.approx(2.0)
    slow = ask("burst-and-coast", {"exponent": 0.25}, SPEED=[0.0])
    assert slow.speed() == pytest.approx((0.005 / 0.07) ** 0.25)


def test_the_mean_of_the_last_speeds_can_count(ask):
    """In place of the last one; where none is known nothing changes."""
    given = {"exponent": 0.8, "lately": 1.0}
    asked = ask("burst-and-coast", given, SPEED=[0.02], LATELY=[0.14])
    assert asked.speed() == pytest.approx(2**0.8)
    assert ask("burst-and-coast", given, SPEED=[0.02]).speed() == 1.0
    evenly = ask("burst-and-coast", given | {"evenly": 1.0}, SPEED=[0.02], LATELY=[0.12])
    assert evenly.speed() == pytest.approx(math.exp(0.8))


def test_fish_are_fast_for_some_time_or_rest_after_it(swim):
    """Correlation of a speed with the mean of the five before the last, beyond the base model's."""

    def correlation(xy):
        speed = np.linalg.norm(np.diff(xy, axis=0), axis=-1)
        before = np.lib.stride_tricks.sliding_window_view(speed[:-2], 5, axis=0).mean(axis=-1)
        return np.corrcoef(before.ravel(), speed[6:].ravel())[0, 1]

    plain = correlation(swim()[0])
    assert correlation(swim("burst-and-coast", {"exponent": 0.8, "lately": 1.0})[0]) > plain + 0.1
    assert correlation(swim("burst-and-coast", {"exponent": -0.8, "lately": 1.0})[0]) < plain - 0.05


def test_bursts_last_or_alternate(swim):
    """Correlation of successive speeds, of either sign; without the effect hardly any."""

    def correlation(xy):
        v = speeds(xy)
        return np.corrcoef(v[1:].ravel(), v[:-1].ravel())[0, 1]

    assert correlation(swim("burst-and-coast", {"exponent": 0.5})[0]) > 0.2
    assert correlation(swim("burst-and-coast", {"exponent": -0.5})[0]) < -0.1
    assert abs(correlation(swim()[0])) < 0.1


def test_a_stop_begins_and_goes_on_by_chance(ask):
    """0.5 per second for 0.2 s: 1 - e^-0.1; at rest for 2 s on average: e^-0.1."""
    asked = ask("freezing", {"rate_per_s": 0.5, "duration_s": 2.0}, SPEED=[0.05, 0.0])
    begins, goes_on = 1 - math.exp(-0.1), math.exp(-0.1)
    assert asked.speed(i=0, chance=begins - 1e-6) == 0.0
    assert asked.speed(i=0, chance=begins + 1e-6) == 1.0
    assert asked.speed(i=1, chance=goes_on - 1e-6) == 0.0
    assert asked.speed(i=1, chance=goes_on + 1e-6) == 1.0


def test_stops_are_as_frequent_and_as_long_as_asked(swim):
    """Mean length of a rest 1 / (1 - e^-0.1) steps, begun by 1 - e^-0.02 of the steps.

    Five standard errors: 15 % of the length, with some 1,500 stops.
    """
    xy, heading = swim("freezing", {"rate_per_s": 0.1, "duration_s": 2.0})
    still = speeds(xy) == 0.0
    begins = still[1:] & ~still[:-1]

    assert still.sum() / begins.sum() == pytest.approx(1 / (1 - math.exp(-0.1)), rel=0.15)
    assert begins.sum() / (~still[:-1]).sum() == pytest.approx(1 - math.exp(-0.02), rel=0.15)
    assert (np.diff(heading, axis=0)[still] == 0.0).all()


def test_fish_tire(ask):
    """1.5 per hour: an hour after the usual speed e^-1.5 is below a third, which is the least."""
    asked = ask("fatigue", {"per_hour": 0.9}, TIME=[900.0, 4500.0, 8100.0])
    assert asked.speed(i=0) == pytest.approx(1.0)
    assert asked.speed(i=1) == pytest.approx(math.exp(-0.9))
    assert asked.speed(i=2) == pytest.approx(1 / 3)


def test_tired_fish_are_slower_at_the_end(swim):
    """1 per hour over an hour: the last tenth against the first as e^-0.9, within 5 %."""
    v = speeds(swim("fatigue", {"per_hour": 1.0}, n_steps=18_000)[0])
    assert v[-1800:].mean() / v[:1800].mean() == pytest.approx(math.exp(-0.9), rel=0.05)

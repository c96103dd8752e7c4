"""Who turns first, and who later: known answers, symmetries, chance, and what is lost."""

import numpy as np
import pytest

from zfcal.behaviour.following import (
    N_SHIFTS,
    Paths,
    correlate,
    directions,
    lags_of,
    measure_following,
    shifts_of,
)
from zfcal.behaviour.measured import quantile_of
from zfcal.errors import InputError

DT_S = 0.2


@pytest.fixture
def rng():
    """Return a generator of random numbers."""
    return np.random.default_rng(1)


def path(rng, n_frames=600, n_agents=1, *, speed_m_s=0.1, sigma_rad=0.6):
    """Return walks that turn at random, shape (frame, agent, 2)."""
    heading = rng.normal(0, sigma_rad, (n_frames, n_agents)).cumsum(axis=0)
    heading += rng.uniform(-np.pi, np.pi, n_agents)
    step_m = speed_m_s * DT_S * np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    return step_m.cumsum(axis=0)


def in_a_tank(rng, n_agents, n_frames=600, side_m=0.3):
    """Return walks that are reflected at the walls of a square."""
    free = path(rng, n_frames, n_agents) + rng.uniform(0, side_m, (n_agents, 2))
    phase = free % (2 * side_m)
    return np.where(phase > side_m, 2 * side_m - phase, phase)


def copies(leader_m, frames, rng, n=4):
    """Return fish that do what a leader did some frames before, each beside it."""
    late = np.roll(leader_m, frames, axis=0)
    late[:frames] = np.nan if frames > 0 else late[:frames]
    if frames < 0:
        late[frames:] = np.nan
    return late + rng.normal(0, 0.01, (1, n, 2))


def measure(robot_m, fish_m):
    """Return all measures by name, those of the directions by lag."""
    found = measure_following(Paths.of(robot_m), Paths.of(fish_m), dt_s=DT_S)
    by_lag = {round(one.lag_s, 3): one for one in found if one.measure == "direction"}
    return {one.measure: one for one in found if one.measure != "direction"}, by_lag


def test_a_direction_by_hand():
    """A step of 3 mm and 4 mm points to (0.6, 0.8); one of 1 mm nowhere."""
    xy_m = np.array([[0.0, 0.0], [0.003, 0.004], [0.003, 0.005], [np.nan, 0.0], [0.0, 0.0]])
    found = directions(xy_m[:, None])[:, 0]
    np.testing.assert_allclose(found[0], [0.6, 0.8])
    assert np.isnan(found[1:]).all()


def test_a_step_from_one_id_to_another_has_no_direction():
    """Nobody knows whether it is the same animal."""
    xy_m = np.array([[[0.0, 0.0]], [[0.01, 0.0]], [[0.02, 0.0]]])
    found = directions(xy_m, np.array([[False], [True], [True]]))
    assert np.isnan(found[0]).all()
    np.testing.assert_allclose(found[1, 0], [1.0, 0.0])


def test_a_correlation_by_hand():
    """The leader goes right, up, left; the fish right at a later frame: one pair of a kind."""
    leader = np.array([[0.0, 0.0], [0.01, 0.0], [0.01, 0.01], [0.0, 0.01]])[:, None]
    fish = np.array([[0.05, 0.0], [0.04, 0.0], [0.05, 0.0], [0.05, 0.01]])[:, None]
    found = correlate(Paths.of(leader), Paths.of(fish), dt_s=DT_S)
    at = {round(lag / DT_S): i for i, lag in enumerate(found.lag_s)}
    # Right-right and up-up one frame later; left-left one frame earlier is not there.
    assert (found.value[0, at[1]], found.n[0, at[1]]) == (pytest.approx(1.0), 2)
    # Right-left, up-right, left-up at once.
    assert (found.value[0, at[0]], found.n[0, at[0]]) == (pytest.approx(-1 / 3), 3)
    # The fish's left before the leader's up, its right before the leader's left.
    assert (found.value[0, at[-1]], found.n[0, at[-1]]) == (pytest.approx(-0.5), 2)
    assert found.n[0, at[3]] == 0
    assert np.isnan(found.value[0, at[3]])


def test_who_rests_gives_no_pair():
    """The leader rests for its second step, the fish for its first: each costs a pair a lag."""
    leader = np.array([[0.0, 0.0], [0.01, 0.0], [0.01, 0.0], [0.02, 0.0]])[:, None]
    fish = np.array([[0.0, 0.0], [0.0, 0.0], [0.01, 0.0], [0.02, 0.0]])[:, None]
    found = correlate(Paths.of(leader), Paths.of(fish), dt_s=DT_S)
    middle = len(found.lag_s) // 2
    # Leader at 0 and 2, fish at 1 and 2.
    assert list(found.n[0, middle - 2 : middle + 3]) == [0, 1, 1, 1, 1]


@pytest.mark.parametrize(("away_m", "n"), [(0.149, 3), (0.151, 0)])
def test_a_group_reaches_15_cm(away_m, n):
    """Three steps beside each other."""
    path_m = np.stack([np.arange(4) * 0.01, np.zeros(4)], axis=-1)[:, None]
    found = correlate(Paths.of(path_m), Paths.of(path_m + np.array([0.0, away_m])), dt_s=DT_S)
    assert found.n[0, len(found.lag_s) // 2] == n


def test_the_floor_is_what_shifted_tracks_give():
    """The highest of 19, of the lead whichever sign it has: here the largest is negative."""
    rng = np.random.default_rng(2)
    robot, fish = Paths.of(in_a_tank(rng, 1)), Paths.of(in_a_tank(rng, 4))
    moved = [
        Paths(xy_m=np.roll(robot.xy_m, by, axis=0), direction=np.roll(robot.direction, by, axis=0))
        for by in shifts_of(600, DT_S)
    ]
    found = [correlate(one, fish, dt_s=DT_S) for one in moved]
    lead, following = (np.array([getattr(one, name)[0] for one in found])
                       for name in ("lead", "following"))  # fmt: skip
    by_name = {one.measure: one for one in measure_following(robot, fish, dt_s=DT_S)}
    assert by_name["lead"].floor == pytest.approx(np.abs(lead).max())
    assert by_name["following"].floor == pytest.approx(following.max())
    assert np.abs(lead).max() > lead.max()


def test_fish_that_copy_after_600_ms_follow(rng):
    """The peak is at +0.6 s, far above chance, and the robot leads."""
    robot = path(rng)
    found, by_lag = measure(robot, copies(robot, 3, rng))
    assert found["delay"].value == pytest.approx(0.6)
    assert by_lag[0.6].value == pytest.approx(1.0)
    assert by_lag[0.6].value > by_lag[0.6].floor
    assert found["following"].value > found["following"].floor
    assert found["lead"].value > found["lead"].high


def test_fish_that_lead_are_on_the_negative_side(rng):
    """The same the other way round: the robot copies, and the lead is negative."""
    robot = path(rng)
    found, _ = measure(robot, copies(robot, -3, rng))
    assert found["delay"].value == pytest.approx(-0.6)
    assert found["lead"].value < found["lead"].low


def test_who_leads_whom_is_one_question(rng):
    """C of a and b at a lag is that of b and a at the opposite one, and no fish leads itself."""
    a, b = (Paths.of(in_a_tank(rng, 1)) for _ in range(2))
    there, back = correlate(a, b, dt_s=DT_S), correlate(b, a, dt_s=DT_S)
    np.testing.assert_allclose(there.value, back.value[:, ::-1])
    np.testing.assert_array_equal(there.n, back.n[:, ::-1])
    assert not correlate(a, a, dt_s=DT_S, same=np.arange(1)).n.any()


def test_independent_walkers_are_within_chance():
    """A measure is above its 5 % floor in few of 60 windows.

    More than 8 are less likely than one in a hundred if it is so in 5 %; the test notices 20 %.
    """
    above = 0
    for seed in range(60):
        rng = np.random.default_rng(seed)
        found, _ = measure(in_a_tank(rng, 1), in_a_tank(rng, 4))
        above += found["following"].value > found["following"].floor
    assert above <= 8


def test_a_delay_is_told_only_above_chance():
    """Of independent walkers the highest correlation lies anywhere; mostly there is none."""
    known = 0
    for seed in range(20):
        rng = np.random.default_rng(seed)
        found, _ = measure(in_a_tank(rng, 1), in_a_tank(rng, 4))
        known += not np.isnan(found["delay"].value)
    assert known <= 5


def test_turning_the_tank_changes_nothing(rng):
    """Directions are compared with each other only."""
    robot, fish = in_a_tank(rng, 1), in_a_tank(rng, 4)
    turn = np.array([[0.6, -0.8], [0.8, 0.6]])
    plain = measure_following(Paths.of(robot), Paths.of(fish), dt_s=DT_S)
    turned = measure_following(Paths.of(robot @ turn), Paths.of(fish @ turn), dt_s=DT_S)
    for a, b in zip(plain, turned, strict=True):
        pair = [[getattr(x, key) for key in ("value", "low", "high", "ceiling", "floor")]
                for x in (a, b)]  # fmt: skip
        np.testing.assert_allclose(*pair, atol=1e-9)
        assert a.n == b.n


def test_who_is_lost_counts_nowhere(rng):
    """A copy that is lost for a while gives fewer pairs, and the same peak."""
    robot = path(rng)
    fish = copies(robot, 3, rng)
    whole = measure(robot, fish)[1][0.6]
    fish[100:200, 0] = np.nan
    part = measure(robot, fish)[1][0.6]
    # Of a pair at t the place at t and the step from t + 3 to t + 4 are needed: 96 to 199.
    assert whole.n - part.n == 104
    assert part.value == pytest.approx(1.0)


def test_a_robot_that_is_lost_throughout_has_no_value(rng):
    """Nor a floor; the fish in its place have theirs all the same."""
    fish = in_a_tank(rng, 4)
    for robot in (np.full((600, 1, 2), np.nan), np.zeros((600, 0, 2))):
        found, by_lag = measure(robot, fish)
        for one in (*found.values(), *by_lag.values()):
            assert np.isnan(one.value)
            assert np.isnan(one.floor)
            assert one.n == 0
            assert one.measure == "delay" or not np.isnan(one.ceiling)


def test_far_away_nobody_follows(rng):
    """Beyond the range of a group there is no pair."""
    robot = path(rng)
    assert measure(robot, copies(robot, 3, rng) + 5.0)[0]["following"].n == 0


def test_the_lead_of_all_fish_is_none(rng):
    """What one leads by another is led by: with equal numbers of pairs the mean is zero."""
    found, _ = measure(in_a_tank(rng, 1), path(rng) + rng.normal(0, 0.01, (1, 3, 2)))
    assert found["lead"].ceiling == pytest.approx(0.0, abs=1e-12)


def test_shifts_are_large_and_many():
    """19 in a window, each at least 10 s either way; none where there is no room."""
    shifts = shifts_of(600, DT_S)
    assert (len(shifts), shifts.min(), shifts.max()) == (N_SHIFTS, 50, 550)
    assert not len(shifts_of(100, DT_S))
    assert len(shifts_of(103, DT_S)) == 4


def test_lags_reach_two_seconds():
    """Also where the step does not divide them."""
    np.testing.assert_array_equal(lags_of(0.2), np.arange(-10, 11))
    np.testing.assert_array_equal(lags_of(0.3), np.arange(-6, 7))


def test_quantiles_by_hand():
    """Between two values, or on the higher one; NaN is left out."""
    values = np.array([[1.0, np.nan], [3.0, np.nan], [np.nan, np.nan]])
    np.testing.assert_array_equal(quantile_of(values, 0.25), [1.5, np.nan])
    np.testing.assert_array_equal(quantile_of(values, 0.25, between=False), [3.0, np.nan])


@pytest.mark.parametrize("share", [0.0, 0.025, 0.5, 0.95, 1.0])
@pytest.mark.parametrize(("between", "method"), [(True, "linear"), (False, "higher")])
def test_quantiles_are_those_of_numpy(share, between, method):
    """Of columns with holes; numpy takes some fifty times as long."""
    rng = np.random.default_rng(6)
    values = rng.normal(size=(19, 30))
    values[rng.random(values.shape) < 0.3] = np.nan
    theirs = np.nanquantile(values, share, axis=0, method=method)
    np.testing.assert_allclose(quantile_of(values, share, between=between), theirs, atol=1e-14)


@pytest.mark.parametrize("dt_s", [0.0, -0.2, np.nan, np.inf])
def test_a_step_that_is_no_time_is_refused(dt_s, rng):
    """The message says what it got."""
    with pytest.raises(InputError, match="dt_s must be a positive time"):
        measure_following(Paths.of(path(rng)), Paths.of(path(rng)), dt_s=dt_s)


def test_positions_of_another_shape_are_refused():
    """A path of one agent needs its axis."""
    with pytest.raises(InputError, match=r"\(frame, agent, xy\), got \(5, 2\)"):
        Paths.of(np.zeros((5, 2)))


def test_two_clocks_are_refused(rng):
    """Robots and fish are of the same frames."""
    with pytest.raises(InputError, match="10 frames and the others 12"):
        correlate(Paths.of(path(rng, 10)), Paths.of(path(rng, 12)), dt_s=DT_S)

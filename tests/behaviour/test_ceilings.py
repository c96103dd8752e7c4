"""What like scores against like."""

import math

import numpy as np
import pytest

from zfcal.behaviour.ceilings import fish_places, halves_ceiling, robot_ceiling, summarise
from zfcal.behaviour.located import locate
from zfcal.behaviour.scores import Scores, compare
from zfcal.behaviour.statistics import measure, measure_robot
from zfcal.errors import InputError
from zfcal.tracks import Samples


def scores_with(S, *, I_D=0.5, zone_names=("left", "right")):
    """Return scores that differ in S and I_D."""
    half = (0.5,) * len(zone_names)
    return Scores(
        zone_names=zone_names, D=half, W=half, T=half,
        I_D=I_D, I_W=0.5, I_O=0.5, I_T=0.5, S=S, n_features=4,
    )  # fmt: skip


def with_new_ids(samples, agent, at):
    """Return samples in which an agent goes on under a new id from a sample on."""
    xy_m = np.concatenate([samples.xy_m, np.full_like(samples.xy_m[:, :1], np.nan)], axis=1)
    xy_m[at:, -1] = xy_m[at:, agent]
    xy_m[at:, agent] = np.nan
    return Samples(
        dt_s=samples.dt_s,
        k=samples.k,
        agent=np.append(samples.agent, samples.agent.max() + 1).astype(np.int32),
        kind=np.append(samples.kind, samples.kind[agent]).astype(np.int8),
        xy_m=xy_m,
        confidence=np.ones(xy_m.shape[:2], dtype=np.float32),
    )


def test_each_fish_in_the_robots_place_by_hand(tank, samples_of):
    """Three fish in a row, 0.05 from the wall, at x = 0.06, 0.09 and 0.12; they stay.

    Pairs are 0.03 (bin 1), 0.03 (bin 1) and 0.06 (bin 2) apart. An outer fish
    has p = (1/2, 1/2) against (1, 0) of the other two: I_D = 0.458804, all else
    is 1, S = 0.458804^(1/4) = 0.823013. The middle one has (1, 0) against
    (0, 1): S = 0. The robot, wherever it is, changes nothing.
    """
    row = [(0.06, 0.05), (0.09, 0.05), (0.12, 0.05)]
    robots = [(0.3, 0.3), (0.1, 0.3)]
    samples = samples_of([[*row, robot] for robot in robots], kind=[0, 0, 0, 1])

    scores = robot_ceiling(samples, tank)

    assert [one.S for one in scores] == pytest.approx([0.823013, 0.0, 0.823013], abs=1e-6)
    assert pytest.approx(0.458804, abs=1e-6) == scores[0].I_D
    assert scores[0].I_W == scores[0].I_O == scores[0].I_T == 1.0


def test_a_fish_in_the_robots_place_is_scored_as_a_robot_would_be(tank, wander):
    """Fish 2 called a robot scores, against the other fish, what the ceiling says for it."""
    samples = wander(1, n_samples=150)
    role = np.array([0, 0, 1, 0, 0], dtype=np.int8)
    played = Samples(
        dt_s=samples.dt_s, k=samples.k, agent=samples.agent, kind=role,
        xy_m=samples.xy_m, confidence=samples.confidence,
    )  # fmt: skip

    scores = robot_ceiling(samples, tank)

    expected = compare(measure_robot(played, tank), measure(played.of_kind(0), tank))
    assert len(scores) == 5
    assert scores[2].values == pytest.approx(expected.values, abs=0)


def test_two_fish_have_no_ceiling(tank, wander):
    """Without one of two there is no pair left to compare with."""
    assert robot_ceiling(wander(1, n_agents=2), tank) == []
    assert robot_ceiling(wander(1, n_agents=1, kind=[1]), tank) == []


def test_a_fish_lost_and_found_is_one_fish(tank, wander):
    """A new id half way through: still five, and alike but for the step across the cut."""
    samples = wander(2, n_samples=200, lost=0.0)

    whole = robot_ceiling(samples, tank)
    pieced = robot_ceiling(with_new_ids(samples, 3, 100), tank)

    assert len(whole) == len(pieced) == 5
    assert sorted(one.S for one in pieced) == pytest.approx(
        sorted(one.S for one in whole), abs=0.005
    )


def test_a_glimpse_is_no_fish(tank, samples_of):
    """A fourth id seen for one sample of ten has no place, but three fish have theirs."""
    fish = [(0.06, 0.05), (0.09, 0.05), (0.12, 0.05)]
    samples = samples_of([[*fish, (0.1, 0.3) if k == 4 else None] for k in range(10)])

    assert len(robot_ceiling(samples, tank)) == 3


def test_ids_that_follow_each_other_are_one_fish_and_those_at_once_are_two(tank, samples_of):
    """Ids 0 and 1 at once; 0 ends at k = 1, 1 at k = 2; id 2 begins at k = 3 and is fish 1's."""
    p = (0.1, 0.1)
    samples = samples_of([[p, p, None], [p, p, None], [None, p, None], [None, None, p]])

    located = locate(samples, tank)

    assert fish_places(located).tolist() == [0, 1, 0, 1, 1, 1]


def test_ids_that_share_one_sample_are_two_fish(tank, samples_of):
    """Id 1 is there already when id 0 is seen for the last time, at k = 1."""
    p = (0.1, 0.1)

    located = locate(samples_of([[p, None], [p, p], [None, p]]), tank)

    assert fish_places(located).tolist() == [0, 0, 1, 1]


def test_no_fish_has_two_ids_at_once(tank, wander):
    """Many ids, lost and found: a place is taken once a sample."""
    samples = wander(3, n_samples=100)
    for agent in (0, 1, 2, 5, 0, 3):
        samples = with_new_ids(samples, agent, 20 + 9 * len(samples.agent))
    located = locate(samples, tank)

    places = fish_places(located)

    assert len(np.unique(np.stack([located.k, places]), axis=1).T) == len(located)


def test_halves_are_alternate_blocks(tank, samples_of):
    """Left, right, left, ... two samples each: at blocks of 2 s one half is left, the other right.

    The step across each cut counts in neither half, so T is left only and right
    only: 0 like O. In blocks of 3 s, counted from the first sample (k = 5), each
    half is as often left as right.
    """
    left, right = [(0.1, 0.1)], [(0.3, 0.1)]
    samples = samples_of([left, left, right, right] * 3, first_k=5)

    apart = halves_ceiling(samples, tank, block_s=2)
    mixed = halves_ceiling(samples, tank, block_s=3)

    assert apart.I_O == apart.I_T == 0.0
    assert math.isnan(apart.I_D)
    assert apart.n_features == 3
    assert mixed.I_O == 1.0


def test_a_group_that_does_not_change_is_like_itself(tank, samples_of):
    """Two fish that stay where they are score 1 in every feature."""
    samples = samples_of([[(0.1, 0.1), (0.15, 0.1)]] * 8)

    scores = halves_ceiling(samples, tank, block_s=2)

    assert (scores.S, scores.n_features) == (1.0, 4)


def test_a_recording_of_one_block_has_no_halves(tank, samples_of):
    """A minute at most, or nobody at all."""
    assert halves_ceiling(samples_of([[(0.1, 0.1)]] * 60), tank) is None
    assert halves_ceiling(samples_of([[None]] * 90), tank) is None
    assert halves_ceiling(samples_of([[(0.1, 0.1)]] * 61), tank) is not None


@pytest.mark.parametrize("block_s", [0.0, -1.0, float("nan")])
def test_blocks_need_a_length(block_s, tank, samples_of):
    """NaN is no length."""
    with pytest.raises(InputError, match="block_s must be a positive time"):
        halves_ceiling(samples_of([[(0.1, 0.1)]]), tank, block_s=block_s)


def test_a_ceiling_is_mean_and_quantiles():
    """Of 0, 0.01, ... 1.00: mean 0.5, from 0.025 to 0.975."""
    ceiling = summarise([scores_with(n / 100) for n in range(101)])

    assert ceiling.of("S") == pytest.approx((0.5, 0.025, 0.975))
    assert ceiling.of("D", "right") == pytest.approx((0.5, 0.5, 0.5))
    assert ceiling.n_windows == 101


def test_a_ceiling_leaves_null_scores_out():
    """Mean of 0.2, null and 0.4 is 0.3; of null only it is null."""
    nan = float("nan")
    ceiling = summarise([scores_with(nan, I_D=value) for value in (0.2, nan, 0.4)])

    assert ceiling.of("D")[0] == pytest.approx(0.3)
    assert all(math.isnan(value) for value in ceiling.of("S"))


def test_a_ceiling_of_nothing_or_of_other_zones_is_refused():
    """At least one comparison, all in one arena; and only scores that there are."""
    with pytest.raises(InputError, match="at least one"):
        summarise([])
    with pytest.raises(InputError, match="different zones"):
        summarise([scores_with(1.0), scores_with(1.0, zone_names=("a", "b"))])
    with pytest.raises(InputError, match="no score 'O' of zone 'left'"):
        summarise([scores_with(1.0)]).of("O", "left")

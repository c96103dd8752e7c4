"""What the fish of a trial do on average."""

import numpy as np
import pytest
import shapely

from zfcal.arena import Zone, make_arena
from zfcal.behaviour.features.registry import statistics
from zfcal.behaviour.features.statistic import Points
from zfcal.behaviour.located import locate
from zfcal.report.comparison.means import FishMeans
from zfcal.report.comparison.quantities import quantities
from zfcal.tracks import Samples

DT_S = 0.2


@pytest.fixture(scope="module")
def halves():
    """A tank of one metre by two: a left and a right half."""
    return make_arena(
        name="halves",
        outline=shapely.box(0, 0, 2, 1),
        zones=(
            Zone(name="left", follows_walls=False, polygon=shapely.box(0, 0, 1, 1)),
            Zone(name="right", follows_walls=False, polygon=shapely.box(1, 0, 2, 1)),
        ),
    )


def samples_of(*paths, robot=False):
    """Return samples of agents by their positions, the last one a robot where asked for."""
    xy_m = np.array(paths, dtype=float).transpose(1, 0, 2)
    n_samples, n = xy_m.shape[:2]
    return Samples(
        dt_s=DT_S,
        k=np.arange(n_samples),
        agent=np.arange(n, dtype=np.int32),
        kind=np.array([0] * (n - robot) + [1] * robot, dtype=np.int8),
        xy_m=xy_m,
        confidence=np.ones((n_samples, n), dtype=np.float32),
    )


def means_of(arena, *parts):
    """Return the means of stretches of samples."""
    means = FishMeans()
    for part in parts:
        means.add(locate(part, arena))
    return means.values()


def test_means_are_what_one_counts_by_hand(halves):
    """One fish rests at (0.5, 0.5), one swims 0.02 m a step from 0.9 m on: five of 20 at left."""
    x = 0.91 + 0.02 * np.arange(20)
    found = means_of(halves, samples_of([(0.5, 0.5)] * 20, [(each, 0.5) for each in x]))

    assert found["V_m_s"] == pytest.approx((0 + 0.1) / 2)
    assert found["O_share_left"] == pytest.approx(25 / 40)
    assert found["O_share_right"] == pytest.approx(15 / 40)
    # One of 38 steps leads into the other zone.
    assert found["T_per_s"] == pytest.approx(1 / 38 / DT_S)
    # Together in a zone they are for five samples; as neighbours always.
    assert found["D_m"] == pytest.approx(np.mean(x[:5] - 0.5))
    assert found["neighbour_m"] == pytest.approx(np.mean(x - 0.5))
    assert found["W_m"] == pytest.approx(0.5)
    assert found["curvature_rad_m"] == pytest.approx(0, abs=1e-9)


def test_a_robot_is_no_fish(halves):
    """Alone with a robot a fish has no neighbour."""
    found = means_of(halves, samples_of([(0.5, 0.5)] * 20, [(0.6, 0.5)] * 20, robot=True))

    assert found["V_m_s"] == 0
    assert not {"D_m", "neighbour_m", "polarisation", "spread_m"} & set(found)


def test_values_are_those_of_the_observations_whatever_the_bins(two_rooms, wander):
    """Means are over what is observed; a window that comes in two segments is one."""
    samples = wander(two_rooms, n_samples=600, robot=False)
    located = locate(samples, two_rooms)
    whole = means_of(two_rooms, samples)
    parts = FishMeans()
    for start_s in (0, 60):
        parts.add(located.between(start_s, start_s + 60))
    inside = located.take(located.zone > 0)
    points = Points(located=inside, role=np.ones(len(inside), dtype=bool), within=True)
    residence = np.concatenate([o.value for o in statistics()["residence"].observe(points)])

    assert whole["residence_s"] == pytest.approx(residence.mean())
    assert parts.values() == pytest.approx(whole)


def test_windows_do_not_lengthen_what_is_cut_in_them(two_rooms, wander):
    """Of four minutes the stays are those of two windows; other means are over all samples."""
    parts = [wander(two_rooms, n_samples=300, robot=False, first_k=300 * i) for i in range(4)]
    first, second = means_of(two_rooms, *parts[:2]), means_of(two_rooms, *parts[2:])
    found = means_of(two_rooms, *parts)

    assert found["W_m"] == pytest.approx((first["W_m"] + second["W_m"]) / 2)
    # No step leads from one window into the next, where these fish jump.
    assert found["V_m_s"] == pytest.approx((first["V_m_s"] + second["V_m_s"]) / 2)
    low, high = sorted((first["residence_s"], second["residence_s"]))
    assert low <= found["residence_s"] <= high


def test_nobody_has_no_mean(halves):
    """A trial without tracks, and a stretch of robots alone."""
    assert FishMeans().values() == {}
    assert means_of(halves, samples_of([(0.5, 0.5)] * 5, robot=True)) == {}


def test_fish_in_the_void_alone_have_no_mean(halves):
    """Nothing is divided by nothing."""
    assert means_of(halves, samples_of([(5, 5)] * 5)) == {}


def test_every_statistic_of_the_registry_has_a_quantity_with_its_unit(halves):
    """A further statistic is compared without a line in the comparison."""
    rows = quantities(halves.zone_names)
    names = [row.name for row in rows]

    assert len(set(names)) == len(names)
    for statistic in statistics().values():
        own = [row for row in rows if row.name.startswith(statistic.name)]
        assert own, statistic.name
        if statistic.form == "bins":
            assert own[0].name.endswith(statistic.unit.replace("/", "_"))
    assert names[-1] == "S_robot"
    assert "S_model_over_ceiling" in names

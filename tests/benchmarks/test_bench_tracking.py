"""The benchmarks of tracking, each run small; what their marks count."""

import numpy as np
import pytest

from zfcal.tracking.seen import METHODS


@pytest.mark.slow
def test_the_benchmark_of_tracking_runs(tiny):
    """Both methods on drawn film, with scores beside those of the truth."""
    found, text = tiny("tracking/bench_tracking.py")
    assert {row["method"] for row in found["rows"]} == set(METHODS)
    for row in found["rows"]:
        assert row["recall"] > 0.9
        assert f"- {row['film']}, {row['method']}: S " in text


@pytest.mark.slow
def test_the_benchmark_of_live_tracking_runs(tiny):
    """Latency, and the robot's heading."""
    found, text = tiny("tracking/bench_tracking_live.py")
    assert found["live"]["latency_ms"]["median"] > 0
    assert found["robot"]["seen"] > 0.5
    assert "Memory" not in text


@pytest.fixture(scope="module")
def film(script, tmp_path_factory):
    """Return twelve seconds of drawn film without other runs of its model."""
    tracking = script("tracking.bench_tracking")
    others, tracking.OTHERS = tracking.OTHERS, ()
    yield tracking.drawn(9104, "usual", "12s", tmp_path_factory.mktemp("film"))
    tracking.OTHERS = others


@pytest.mark.slow
def test_the_measure_of_film_with_a_hand_runs(script, film):
    """Dark fish are found after four seconds of it; the command takes no smaller effort."""
    hands = script("tracking.tracking_hands")
    images = hands.with_odd(film, "light hand, 4 s", np.random.default_rng(5))
    assert (images[0] != film.frames[0].image).any()
    polarity, mota, late = hands.measured(film, images)
    assert polarity == "dark"
    assert mota <= 1
    assert 0.5 < late <= 1


@pytest.mark.slow
def test_the_measure_of_what_is_learnt_runs(script, film):
    """A negative is told by its polarity; the command takes no smaller effort."""
    learnt = script("tracking.tracking_learnt")
    name, polarity, *numbers = learnt.measured(learnt.Trial(film=film, changes=("negative",)))
    assert name == f"{film.name}, negative"
    assert polarity == "light"
    assert all(np.isfinite(numbers))


@pytest.fixture(scope="module")
def measures(script):
    """Return what compares tracks with the truth, within 20 mm at 15 Hz."""
    of = script("tracking.measures").measures
    return lambda truth, told: of(truth, told, gate=20.0, fps=15.0)


def test_two_that_change_places_are_two_switches(measures):
    """Over 90 frames of two animals a tenth of a fish-minute each: ten a fish-minute."""
    xy_mm = np.array([[(0.0, 0.0), (100.0, 0.0)]] * 90)
    told = [[(0 if f < 45 else 1, 0.0, 0.0), (1 if f < 45 else 0, 100.0, 0.0)] for f in range(90)]

    found = measures(xy_mm, told)

    assert found["switches_per_fish_minute"] == pytest.approx(2 / (2 * 0.1))
    assert found["idf1"] == pytest.approx(0.5)


def test_who_is_missed_and_who_is_nobody_are_counted(measures):
    """One of two animals is told, and one that is not there: half of each, no frame exact."""
    xy_mm = np.array([[(0.0, 0.0), (100.0, 0.0)]] * 10)
    told = [[(0, 3.0, 4.0), (5, 500.0, 0.0), (6, 600.0, 0.0)]] * 10

    found = measures(xy_mm, told)

    assert found["recall"] == 0.5
    assert found["precision"] == pytest.approx(1 / 3)
    assert found["median_error"] == 5.0
    assert found["missed"] == 10
    assert found["exact"] == 0


def test_whom_the_truth_does_not_know_is_nobody_but_not_where_it_is_whole(measures):
    """Two animals, one of them not known in half of the frames, and both told in all."""
    xy_mm = np.array([[(0.0, 0.0), (100.0, 0.0)]] * 10)
    told = [[(k, x, y) for k, (x, y) in enumerate(places)] for places in xy_mm]
    xy_mm[5:, 1] = np.nan

    found = measures(xy_mm, told)

    assert found["precision"] == 0.75
    assert found["precision_of_whole"] == 1.0
    assert found["recall"] == 1.0

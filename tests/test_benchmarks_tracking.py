"""What the benchmarks of tracking make of tracks: scores, measures, documents."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from zfcal.artifacts.arenas import load_arena
from zfcal.tracks import FISH, ROBOT, Tracks

FPS = 15.0


@pytest.fixture(scope="module")
def scores(scripts):
    """Return what makes scores of tracks."""
    return scripts("tracking_scores")


@pytest.fixture(scope="module")
def measures(scripts):
    """Return what compares tracks with the truth, within 20 mm at 15 Hz."""
    of = scripts("tracking_measures").measures
    return lambda truth, told: of(truth, told, gate=20.0, fps=FPS)


def swum(xy_m, *, robot=None):
    """Return tracks of animals, shape (frame, agent, 2); one of them may be the robot."""
    n_frames, n_agents = xy_m.shape[:2]
    frame = np.repeat(np.arange(n_frames), n_agents)
    agent = np.tile(np.arange(n_agents, dtype=np.int32), n_frames)
    flat = xy_m.reshape(-1, 2)
    return Tracks(
        time_s=frame / FPS,
        frame=frame,
        agent=agent,
        kind=np.where(agent == robot, ROBOT, FISH).astype(np.int8),
        x_m=flat[:, 0],
        y_m=flat[:, 1],
        heading_rad=np.full(len(flat), np.nan, np.float32),
        confidence=np.ones(len(flat), np.float32),
    )


def wandering(seed, *, n_frames=1800, n_agents=3):
    """Return paths about the middle of a tank, shape (frame, agent, 2)."""
    rng = np.random.default_rng(seed)
    frame, phase = np.arange(n_frames)[:, None], rng.uniform(0, 2 * math.pi, (2, n_agents))
    rate = rng.uniform(0.01, 0.03, (2, n_agents))
    return 0.15 * np.stack([np.sin(rate[k] * frame + phase[k]) for k in range(2)], axis=-1)


def told_of(xy_m):
    """Return what a tracker without fault tells of paths."""
    return [[(k, x, y) for k, (x, y) in enumerate(places)] for places in xy_m]


def test_what_was_told_is_told_again(scores):
    """Every row, with its time and its place."""
    xy_m = wandering(1, n_frames=30)

    tracks = scores.as_tracks(told_of(xy_m), swum(xy_m), fps=FPS)

    np.testing.assert_allclose(np.column_stack([tracks.x_m, tracks.y_m]), xy_m.reshape(-1, 2))
    np.testing.assert_array_equal(tracks.frame, np.repeat(np.arange(30), 3))
    np.testing.assert_allclose(tracks.time_s, tracks.frame / FPS)
    assert (tracks.kind == FISH).all()


def test_the_robot_is_the_track_nearest_to_its_true_place(scores):
    """Whatever its id, which changes half-way, it is one robot with an id of its own."""
    xy_m = np.array([[(0.0, 0.0), (0.1, 0.0), (0.2, 0.0)]] * 10)
    told = [[(7 if f < 5 else 8, 0.101, 0.0), (1, 0.0, 0.0), (2, 0.2, 0.0)] for f in range(10)]

    tracks = scores.as_tracks(told, swum(xy_m, robot=1), fps=FPS)

    robots = tracks.take(tracks.kind == ROBOT)
    np.testing.assert_array_equal(robots.frame, np.arange(10))
    np.testing.assert_allclose(robots.x_m, 0.101)
    assert len(set(robots.agent)) == 1
    assert set(robots.agent).isdisjoint({0, 1, 2, 7, 8})


def test_without_a_track_near_it_there_is_no_robot(scores):
    """Five centimetres away somebody else begins."""
    xy_m = np.array([[(0.0, 0.0), (0.1, 0.0)]])

    near = scores.as_tracks([[(0, 0.149, 0.0)]], swum(xy_m, robot=1), fps=FPS)
    far = scores.as_tracks([[(0, 0.151, 0.0)]], swum(xy_m, robot=1), fps=FPS)

    assert near.kind.tolist() == [ROBOT]
    assert far.kind.tolist() == [FISH]


def test_a_frame_without_anybody_has_no_row(scores):
    """Nor has a film: the tracks are empty then, and no error."""
    xy_m = wandering(1, n_frames=3)

    some = scores.as_tracks([told_of(xy_m)[0], [], []], swum(xy_m), fps=FPS)
    none = scores.as_tracks([[], [], []], swum(xy_m), fps=FPS)

    assert some.frame.tolist() == [0, 0, 0]
    assert len(none) == 0


def of_paths(scores, xy_m):
    """Return the statistics of paths in an open square."""
    arena = load_arena("open-square", Path())
    return scores.statistics_of(swum(xy_m), arena, fps=FPS, end_s=len(xy_m) / FPS)


def test_tracks_that_are_the_truth_change_no_score(scores):
    """Against three other runs, which scatter among themselves."""
    truth, *others = (of_paths(scores, wandering(seed)) for seed in range(4))

    found = scores.differences(truth, truth, others)

    assert set(found) == set(scores.NAMES)
    assert found["S"]["change"] == found["D"]["change"] == 0.0
    assert found["D"]["noise"] > 0.0


def test_tracks_of_fish_that_stay_by_the_wall_change_the_scores(scores):
    """All moved a decimetre: their distances to walls are others."""
    truth, *others = (of_paths(scores, wandering(seed)) for seed in range(4))
    moved = of_paths(scores, wandering(0) + 0.1)

    found = scores.differences(moved, truth, others)

    assert found["W"]["change"] > 0.02


def test_runs_that_are_all_the_same_have_no_noise(scores):
    """Half the range of equal scores is nothing."""
    one = of_paths(scores, wandering(0))

    found = scores.differences(one, one, [one, one, one])

    assert found["S"] == {"change": 0.0, "noise": pytest.approx(0.0, abs=1e-12)}


def test_what_was_found_is_said_in_three_digits(scores):
    """Change, and noise in brackets."""
    found = {"S": {"change": 0.0012, "noise": 0.09}, "D": {"change": 0.5, "noise": 0.1}}

    assert scores.summary(found) == "S 0.001 (0.090), D 0.500 (0.100)"


def test_a_tracker_without_fault_has_full_marks(measures):
    """No switch, no error, everybody in every frame."""
    xy_mm = 1e3 * wandering(2, n_frames=90)

    found = measures(xy_mm, told_of(xy_mm))

    assert (found["mota"], found["idf1"], found["precision"], found["recall"]) == (1, 1, 1, 1)
    assert found["switches_per_fish_minute"] == found["missed"] == found["error_95"] == 0
    assert found["exact"] == 1


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
    told = told_of(xy_mm)
    xy_mm[5:, 1] = np.nan

    found = measures(xy_mm, told)

    assert found["precision"] == 0.75
    assert found["precision_of_whole"] == 1.0
    assert found["recall"] == 1.0


def test_a_film_goes_to_its_end_and_back(scripts):
    """Without showing its last image, or its first, twice in a row."""
    live = scripts("bench_tracking_live")

    assert [live.to_and_fro(k, 4) for k in range(8)] == [0, 1, 2, 3, 2, 1, 0, 1]


def test_the_document_tells_latency_and_memory(scripts):
    """With an hour of video and without."""
    live = scripts("bench_tracking_live")
    found = {
        "machine": "a machine",
        "load_before": 0.5,
        "busy": 0,
        "live": {
            "frames": 900,
            "missing": 0,
            "duplicates": 0,
            "latency_ms": {"median": 5.0, "p95": 9.0, "max": 30.0},
        },
    }
    found["robot"] = {
        "frames": 900,
        "seen": 1.0,
        "heading_told": 0.999,
        "front_wrong": 0.02,
        "heading_median_deg": 1.5,
        "position_95_mm": 2.0,
        "fish_ids": 4,
    }
    hour = {"video_s": 3600, "took_s": 150.0, "grows_mb": 0.5, "most_mb": 250.0}
    hour["memory_mb"] = {"0": 240.0, "60": 249.0, "660": 249.0, "3600": 250.0}

    short = live.markdown(json.loads(json.dumps(found)))
    long = live.markdown({**found, "hour": hour})

    assert "| 5 | 9 | 30 | 0 | 0 |" in short
    assert "| 1 | 0.999 | 0.02 | 1.5 | 2 | 4 |" in short
    assert "Memory" not in short
    assert "| 3,600 | 250 |" in long
    assert "660" not in long
    assert live.ratios({**found, "hour": hour})["latency, 95 % over 20 ms"].value == 0.45

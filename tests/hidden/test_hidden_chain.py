"""The tracker of the hidden trials writes what it is told to."""

import numpy as np
import pytest

from hidden.chain import Chain, filmed, measure, sampled
from hidden.scenario import Scenario, make_trial, write_csv
from zfcal.readers.csv import read_csv
from zfcal.readers.options import ImportOptions


@pytest.fixture(scope="module")
def states():
    """Return five agents on random walks of half an hour."""
    rng = np.random.default_rng(9000)
    return 0.5 + np.cumsum(rng.normal(0, 0.004, (9001, 5, 2)), axis=0)


def rng():
    """Return a generator, the same each time."""
    return np.random.default_rng(9001)


def test_frames_lie_straight_between_steps(states):
    """At 15 Hz every third frame is a state, and the others divide the way into thirds."""
    xy = filmed(states, fps=15)

    assert len(xy) == 27000
    np.testing.assert_array_equal(xy[::3], states[:-1])
    np.testing.assert_allclose(xy[1], states[0] + (states[1] - states[0]) / 3, atol=1e-15)


@pytest.mark.parametrize("fps", [5, 15])
def test_a_perfect_tracker_gives_the_states_back(states, fps):
    """Without faults the samples are the true positions, and the last agent is the robot."""
    tracks = measure(states, 4, Chain(), fps=fps, rng=rng())
    xy, ids, robot = sampled(tracks, fps=fps)

    np.testing.assert_allclose(xy, states[:-1], atol=1e-12)
    assert ids.tolist() == [0, 1, 2, 3, 4]
    assert robot.tolist() == [False] * 4 + [True]


def test_noise_has_the_asked_spread(states):
    """Each coordinate's error has a standard deviation of 1.5 mm, to within 1 %."""
    tracks = measure(states, 4, Chain(noise_mm=1.5), fps=5, rng=rng())
    xy, _, _ = sampled(tracks, fps=5)

    assert (xy - states[:-1]).std() == pytest.approx(0.0015, rel=0.01)


@pytest.mark.parametrize("renamed", [0.0, 1.0])
def test_lost_agents_are_away_for_two_seconds_and_return_by_another_name(states, renamed):
    """Two losses a minute cost 6 % of the frames; each brings a new id, or none does."""
    chain = Chain(drops_per_min=2, renamed=renamed)
    tracks = measure(states, 4, chain, fps=15, rng=rng())

    assert len(tracks) / (27000 * 5) == pytest.approx(1 - 2 * 2 / 60, abs=0.02)
    n_ids = tracks["agent"].nunique()
    if renamed == 0:
        assert n_ids == 5
    else:
        assert 5 + 200 < n_ids < 5 + 400
    assert not tracks.duplicated(["time_s", "agent"]).any()
    assert (tracks.groupby("agent")["kind"].nunique() == 1).all()


def test_swaps_leap_over_to_the_other_fish(states):
    """A track follows one fish, and from a swap on another that was within 3 cm."""
    tracks = measure(states, 4, Chain(swaps_per_min=1), fps=5, rng=rng())
    xy, ids, robot = sampled(tracks, fps=5)
    follows = np.linalg.norm(xy[:, :, None] - states[:-1, None], axis=3).argmin(axis=2)
    changes = np.argwhere(np.diff(follows, axis=0))

    assert ids.tolist() == [0, 1, 2, 3, 4]
    assert 4 <= len(changes) <= 80
    assert (follows[:, robot] == 4).all()
    for sample, track in changes:
        was, now = follows[sample : sample + 2, track]
        gap = np.linalg.norm(states[sample + 1, was] - states[sample + 1, now])
        assert gap < 0.03


def test_frames_that_miss_the_steps_are_refused(states):
    """Six frames a second never fall on steps of 0.2 s."""
    tracks = measure(states[:100], 4, Chain(), fps=6, rng=rng())
    with pytest.raises(ValueError, match="steps of"):
        sampled(tracks, fps=6)


def test_zfcal_reads_the_table(tmp_path):
    """What is written is imported as so many rows, kinds and ids."""
    trial = make_trial(Scenario(minutes=0.5, seed=9000, chain=Chain(drops_per_min=2)), oracle=False)
    write_csv(trial, tmp_path / "trial.csv")
    read = read_csv(tmp_path / "trial.csv", ImportOptions(fps=15.0))

    assert len(read.tracks) == len(trial.tracks)
    assert np.unique(read.tracks.agent).size == len(trial.track_ids)
    np.testing.assert_allclose(read.tracks.x_m, trial.tracks["x_m"], atol=1e-6)

"""Rows at the camera's rate become states at the model's step."""

import math
from itertools import pairwise

import numpy as np
import pytest

from zfcal.errors import InputError
from zfcal.sampling import sample, sample_range
from zfcal.tracks import FISH, ROBOT, Tracks


def rows(frame, *, agent=None, fps=15.0, time_s=None, kind=None, x_m=None):
    """Return tracks with a row per given frame; x is the frame number in millimetres."""
    frame = np.asarray(frame, dtype=np.int64)
    n = len(frame)
    return Tracks(
        time_s=np.asarray(frame / fps if time_s is None else time_s, dtype=float),
        frame=frame,
        agent=np.asarray(np.zeros(n) if agent is None else agent, dtype=np.int32),
        kind=np.asarray(np.zeros(n) if kind is None else kind, dtype=np.int8),
        x_m=np.asarray(frame / 1000 if x_m is None else x_m, dtype=float),
        y_m=np.zeros(n),
        heading_rad=np.full(n, np.nan, dtype=np.float32),
        confidence=np.full(n, 0.9, dtype=np.float32),
    )


def frames_taken(samples):
    """Return the frame number behind each sample of the first agent; -1 where it is missing."""
    return np.nan_to_num(np.round(samples.xy_m[:, 0, 0] * 1000), nan=-1).astype(int).tolist()


def test_every_third_frame_is_taken_at_15_hz():
    """0.2 s at 15 Hz are three frames: samples 0 to 4 are frames 0, 3, 6, 9, 12."""
    samples = sample(rows(range(15)), fps=15, dt_s=0.2, start_s=0, end_s=1)

    assert samples.k.tolist() == [0, 1, 2, 3, 4]
    assert frames_taken(samples) == [0, 3, 6, 9, 12]
    assert samples.dt_s == 0.2
    assert samples.confidence[:, 0] == pytest.approx(0.9)


def test_a_window_keeps_its_start_and_leaves_its_end():
    """From 60 to 120 s at 0.2 s: samples 300 to 599; the frame at 120 s is the next window's."""
    samples = sample(rows(range(60 * 15, 122 * 15)), fps=15, dt_s=0.2, start_s=60, end_s=120)

    assert (samples.k[0], samples.k[-1], len(samples.k)) == (300, 599, 300)
    assert frames_taken(samples)[-1] == 599 * 3


def test_a_third_of_a_second_is_no_trouble():
    """The authors' step: 360 samples in 120 s, though 1/3 is no exact number."""
    assert sample_range(0, 120, dt_s=1 / 3) == (0, 360)
    assert sample_range(120, 240, dt_s=1 / 3) == (360, 720)


@pytest.mark.parametrize("fps", [3.0, 15.0, 25.0, 28.07, 29.97, 32.0])
def test_windows_side_by_side_share_no_sample_and_lose_none(fps):
    """Each k belongs to exactly one of the minutes, whatever the rate."""
    dt_s = max(1, round(0.2 * fps)) / fps
    edges = [sample_range(60 * m, 60 * (m + 1), dt_s=dt_s) for m in range(30)]

    assert all(a[1] == b[0] for a, b in pairwise(edges))
    assert (edges[0][0], edges[-1][1]) == (0, math.ceil(1800 / dt_s - 1e-6))


def test_a_lost_agent_is_missing_and_never_interpolated():
    """Frame 3 is gone: sample 1 is NaN, though frames 2 and 4 are there."""
    samples = sample(rows([0, 1, 2, 4, 5, 6]), fps=15, dt_s=0.2, start_s=0, end_s=0.6)

    assert frames_taken(samples) == [0, -1, 6]
    assert np.isnan(samples.confidence[1, 0])


def test_an_agent_missing_in_the_nearest_frame_is_missing():
    """Agent 1 is seen a frame earlier and later than sample 1, but not in its frame."""
    tracks = rows([0, 0, 2, 3, 4, 6, 6], agent=[0, 1, 1, 0, 1, 0, 1])

    samples = sample(tracks, fps=15, dt_s=0.2, start_s=0, end_s=0.6)

    assert np.isnan(samples.xy_m[:, 1, 0]).tolist() == [False, True, False]
    assert not np.isnan(samples.xy_m[:, 0]).any()


def test_the_nearest_frame_counts_by_time_not_by_number():
    """A camera that runs late: sample 1 (0.2 s) is nearer to the frame at 0.17 than at 0.25 s."""
    tracks = rows([0, 1, 2, 3], time_s=[0.0, 0.08, 0.17, 0.25])

    assert frames_taken(sample(tracks, fps=15, dt_s=0.2, start_s=0, end_s=0.3)) == [0, 2]


def test_a_frame_more_than_half_an_interval_away_is_none():
    """At 15 Hz half an interval is 33.3 ms: 0.232 s is near enough to 0.2 s, 0.235 s is not."""
    near = rows([0, 3], time_s=[0.0, 0.232])
    far = rows([0, 3], time_s=[0.0, 0.235])

    assert frames_taken(sample(near, fps=15, dt_s=0.2, start_s=0, end_s=0.3)) == [0, 3]
    assert frames_taken(sample(far, fps=15, dt_s=0.2, start_s=0, end_s=0.3)) == [0, -1]


def test_a_frame_is_used_once_when_all_lie_between_two_samples():
    """At one sample a frame, frames half an interval late go each to the sample before."""
    tracks = rows(range(1, 6), time_s=(np.arange(5) + 0.5) / 3)

    assert frames_taken(sample(tracks, fps=3, dt_s=1 / 3, start_s=0, end_s=2)) == [
        1, 2, 3, 4, 5, -1,
    ]  # fmt: skip


def test_agents_stand_by_their_number_with_their_kind():
    """The columns are the agents that are in a sample, in ascending order."""
    tracks = rows([0, 0, 1, 3, 3], agent=[4, 9, 5, 4, 9], kind=[FISH, ROBOT, FISH, FISH, ROBOT])

    samples = sample(tracks, fps=15, dt_s=0.2, start_s=0, end_s=0.4)

    assert samples.agent.tolist() == [4, 9]
    assert samples.kind.tolist() == [FISH, ROBOT]
    assert samples.xy_m.shape == (2, 2, 2)


def test_rows_outside_the_window_do_not_matter():
    """The same samples come out whether or not the rest of the trial is given."""
    tracks = rows(range(100))
    part = tracks.take(slice(30, 60))

    a, b = (sample(t, fps=15, dt_s=0.2, start_s=2, end_s=4) for t in (tracks, part))

    assert np.array_equal(a.xy_m, b.xy_m)
    assert a.k.tolist() == b.k.tolist()


def test_no_rows_are_samples_without_agents():
    """An empty segment has its samples and nobody in them."""
    samples = sample(rows([]), fps=15, dt_s=0.2, start_s=0, end_s=1)

    assert samples.xy_m.shape == (5, 0, 2)


@pytest.mark.parametrize(
    ("tracks", "says"),
    [
        (rows([0, 2, 1]), "sorted by frame"),
        (rows([0, 0], agent=[1, 0]), "sorted by frame"),
        (rows([0, 0], agent=[1, 1]), "one a frame and agent"),
        (rows([0, 1], time_s=[0.2, 0.1]), "time must grow"),
        (rows([0, 1], time_s=[0.1, 0.1]), "time must grow"),
        (rows([0, 1], time_s=[0.1, np.nan]), "time must grow"),
        (rows([0, 0], agent=[0, 1], time_s=[0.0, 0.01]), "a frame has one time"),
        (rows([0, 3], kind=[FISH, ROBOT]), "agent 0 is of two kinds"),
    ],
)
def test_rows_that_make_no_sense_are_refused(tracks, says):
    """The message names the rule and the two rows that break it."""
    with pytest.raises(InputError, match=says):
        sample(tracks, fps=15, dt_s=0.2, start_s=0, end_s=1)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"dt_s": 0.05}, "at least one frame"),
        ({"dt_s": float("nan")}, "at least one frame"),
        ({"fps": float("nan")}, "at least one frame"),
        ({"fps": -15}, "at least one frame"),
        ({"dt_s": float("inf")}, "positive time"),
        ({"start_s": 2}, "end after it starts"),
        ({"end_s": float("nan")}, "end after it starts"),
    ],
)
def test_options_that_make_no_sense_are_refused(options, says):
    """A rate, a step and a window have their limits, which NaN does not pass."""
    with pytest.raises(InputError, match=says):
        sample(rows([0]), **({"fps": 15, "dt_s": 0.2, "start_s": 0, "end_s": 1} | options))

"""The tracker's own noise, from tracks of drawn film alone, against the truth."""

from pathlib import Path

import numpy as np
import pytest

from zfcal.artifacts.arenas import load_arena
from zfcal.cameras.frames import Frame
from zfcal.cameras.rig import overhead_camera
from zfcal.stages.track.tracker_noise import losses, tracker_noise
from zfcal.tracking.region import region_of
from zfcal.tracking.seen import TrackerOptions
from zfcal.tracking.tracker import FishTracker, follow
from zfcal.tracks import FISH, Tracks
from zfcal.virtual.images.look import CLEAN, look_of
from zfcal.virtual.images.render import OverheadPainter
from zfcal.virtual.images.swimming import swimming

pytestmark = pytest.mark.slow

FPS, STEP = 15.0, 3
N_FRAMES, N_FISH = 450, 3


def tracks_of(rows):
    """Return tracks of rows (frame, agent, x, y, confidence)."""
    table = np.array(rows, float)
    return Tracks(
        time_s=table[:, 0] / FPS,
        frame=table[:, 0].astype(np.int64),
        agent=table[:, 1].astype(np.int32),
        kind=np.full(len(table), FISH, np.int8),
        x_m=table[:, 2],
        y_m=table[:, 3],
        heading_rad=np.full(len(table), np.nan, np.float32),
        confidence=table[:, 4].astype(np.float32),
    )


def walk(seed):
    """Return fish that go straight for 0.2 s at a time, in a room, shape (frame, fish, 2)."""
    rng = np.random.default_rng(seed)
    centres = np.array([[0.25, 0.80], [0.45, 0.60], [0.75, 0.25]])[:N_FISH]
    angle = np.cumsum(rng.normal(0, 0.5, (N_FRAMES // STEP + 1, N_FISH)), axis=0)
    knots = centres + 0.06 * np.stack([np.cos(angle), np.sin(angle)], axis=2)
    at = np.arange(N_FRAMES) / STEP
    k, part = at.astype(int), (at % 1)[:, None, None]
    return (1 - part) * knots[k] + part * knots[k + 1]


@pytest.fixture(scope="module")
def followed():
    """Return the truth and the tracks of half a minute of film."""
    arena, truth = load_arena("open-square", Path()), walk(7)
    camera, look = overhead_camera(arena), look_of(CLEAN, {"noise_grey": 3.0})
    rows = [(f, a, *truth[f, a], 1.0) for f in range(N_FRAMES) for a in range(N_FISH)]
    swum = swimming(tracks_of(rows), look, fps=FPS, seed=7)
    painter = OverheadPainter(arena, camera, look, seed=7)
    frames = (
        Frame(number=k, time_s=k / FPS, image=painter.paint(swum.at(k))) for k in range(N_FRAMES)
    )
    tracker = FishTracker(TrackerOptions(n_agents=N_FISH), camera, region=region_of(arena, camera))
    told = [
        (frame.number, s.agent, s.x_m, s.y_m, s.confidence)
        for frame, seen in follow(tracker, frames)
        for s in seen
    ]
    return truth, told


def test_noise_told_from_tracks_alone_is_that_of_their_errors(followed):
    """Within a fifth of the second differences of the errors against the truth."""
    truth, told = followed
    errors = np.full(truth.shape, np.nan)
    for frame, _, x, y, _ in told:
        away = np.hypot(*(truth[frame] - (x, y)).T)
        errors[frame, away.argmin()] = truth[frame, away.argmin()] - (x, y)
    second = errors[:-2] - 2 * errors[1:-1] + errors[2:]

    found = tracker_noise(tracks_of(told), fps=FPS, dt_s=0.2)

    assert found == pytest.approx(np.sqrt(np.nanmean(second**2) / 6), rel=0.2)


def test_positions_of_drawn_fish_are_within_a_millimetre(followed):
    """The median error, of fish 37 mm long at 2 mm a pixel."""
    truth, told = followed

    errors = [np.hypot(*(truth[row[0]] - row[2:4]).T).min() for row in told]

    assert len(told) > 0.99 * N_FRAMES * N_FISH
    assert np.median(errors) < 0.001
    assert np.quantile(errors, 0.95) < 0.003


def test_without_frames_between_steps_the_noise_is_not_known(followed):
    """A step as long as a frame leaves nothing straight."""
    _, told = followed

    assert tracker_noise(tracks_of(told), fps=FPS, dt_s=1 / FPS) is None


def test_losses_by_hand():
    """Three agents in four frames: two rows are missing, one id is new, one row is a guess."""
    rows = [(0, 1), (0, 2), (0, 3), (1, 1), (1, 2), (2, 1), (2, 3), (3, 1), (3, 3), (3, 4)]
    frame, agent = np.array(rows).T
    tracks = Tracks(
        time_s=frame / 15,
        frame=frame,
        agent=agent.astype(np.int32),
        kind=np.zeros(10, np.int8),
        x_m=np.zeros(10),
        y_m=np.zeros(10),
        heading_rad=np.full(10, np.nan, np.float32),
        confidence=np.array([0.4] + 9 * [0.9], np.float32),
    )
    assert losses(tracks, n_agents=3) == {"drops": 2, "suspected_swaps": 1, "guesses": 1}
    nobody = tracks.take(np.zeros(10, np.bool_))
    assert losses(nobody, n_agents=3) == {"drops": 0, "suspected_swaps": 0, "guesses": 0}

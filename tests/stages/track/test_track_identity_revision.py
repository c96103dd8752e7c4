"""Ids in tracks are put right where animals crossed, though looks told so later."""

import math

import cv2
import numpy as np
import pytest

from zfcal.artifacts.pose_files import read_poses
from zfcal.artifacts.tables import read_tracks
from zfcal.stages.camera.rig import CameraChoice
from zfcal.stages.events import say_nothing
from zfcal.stages.init import NewTrial, create_trial
from zfcal.stages.track.plan import TrackOptions
from zfcal.stages.track.track import track
from zfcal.tracks import tracks_of

pytestmark = pytest.mark.slow

FPS = 15.0
CORNERS = ((-0.5, 199.5), (199.5, 199.5), (199.5, -0.5), (-0.5, -0.5))
MIDDLE_M = 0.2


def bounce(frames=75, times=3):
    """Return places of two that swim toward each other, touch, and turn back, in pixels."""
    there = np.linspace(0.0, 1.0, frames)
    along = np.concatenate([np.concatenate([there, there[::-1]]) for _ in range(times)])
    left = 30.0 + 69.5 * along
    forward = np.diff(left, append=left[-1]) >= 0
    return [
        ((x, 100.0, 0.0 if ahead else math.pi), (200.0 - x, 100.0, math.pi if ahead else 0.0))
        for x, ahead in zip(left, forward, strict=True)
    ]


@pytest.fixture(scope="module")
def tracked(tmp_path_factory, drawn_tank):
    """Return the trial of a film of a dark one to the left and a fair one to the right."""
    folder = tmp_path_factory.mktemp("bounce")
    writer = cv2.VideoWriter(
        str(folder / "film.avi"), cv2.VideoWriter.fourcc(*"FFV1"), FPS, (200, 200)
    )
    rng = np.random.default_rng(1)
    for dark, fair in bounce():
        image = np.minimum(
            drawn_tank.image([dark], rng=rng, fish=80.0),
            drawn_tank.image([fair], rng=rng, fish=98.0),
        )
        writer.write(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR))
    writer.release()
    root = folder / "trial"
    create_trial(root, NewTrial(n_fish=2, fps=FPS, side_m=0.4, dt_s=0.2), say_nothing)
    overhead = CameraChoice(source=str(folder / "film.avi"), corners_px=CORNERS)
    track(root, TrackOptions(overhead=overhead), say_nothing)
    return root


def ids_by_side(tracks):
    """Return the ids of those to the left, and of those to the right; of those between nobody's."""
    left, right = tracks.x_m < MIDDLE_M - 0.02, tracks.x_m > MIDDLE_M + 0.02
    return np.unique(tracks.agent[left]).tolist(), np.unique(tracks.agent[right]).tolist()


def test_poses_are_told_by_what_is_believed(tracked):
    """Whoever drives by them hears the other's id for a while, and then nothing for a step."""
    poses = tracks_of(read_poses(tracked / "poses" / "000000.mcap"))
    assert ids_by_side(poses) == ([0, 1], [0, 1])
    assert len(poses) < 2 * len(bounce())


def test_tracks_have_everybody_s_own_id_in_every_frame(tracked):
    """Not a row is wrong, not a row is lacking."""
    tracks = read_tracks(tracked / "tracks" / "000000.parquet")
    left, right = ids_by_side(tracks)
    assert len(left) == len(right) == 1
    assert left != right
    assert len(tracks) == 2 * len(bounce())

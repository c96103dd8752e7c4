"""Paths over the plan of the tank, and ids over time."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from zfcal.artifacts.arenas import load_arena
from zfcal.report.figures.trajectories import draw_trajectories, unbroken
from zfcal.tracks import FISH, ROBOT, AgentPose, FramePoses, tracks_of


def tracks(n_frames, n_agents):
    """Return agents on straight ways; the last is a robot, and every seventh frame is missing."""
    frames = []
    for k in range(n_frames):
        agents = tuple(
            AgentPose(
                agent=number,
                kind=ROBOT if number == n_agents - 1 else FISH,
                x_m=0.1 + 0.001 * k,
                y_m=0.1 + 0.8 * number / n_agents,
                heading_rad=0.0,
                confidence=0.3 if k % 5 == 0 else 0.9,
            )
            for number in range(n_agents)
        )
        frames.append(FramePoses(time_s=k / 15, frame=k, agents=agents if k % 7 else ()))
    return tracks_of(frames)


@pytest.mark.parametrize("name", ["open-square", "two-rooms", "ring"])
@pytest.mark.parametrize("n_agents", [1, 5, 40])
def test_a_picture_is_drawn_of_any_tank_and_any_group(tmp_path, name, n_agents):
    """With many ids too, whose names would not fit."""
    path = tmp_path / "paths.png"
    draw_trajectories(load_arena(name, Path()), tracks(100, n_agents), path)
    image = cv2.imread(str(path))
    assert image.shape[1] > 1000
    # The robot's colour is there: its path, and the bar of its id.
    robot = np.array([0xDB, 0x5B, 0xBD])
    assert (np.abs(image.astype(int) - robot).sum(axis=2) < 60).sum() > 100


def test_no_rows_make_a_picture_of_the_tank(tmp_path):
    """Nobody was found: no error."""
    path = tmp_path / "paths.png"
    draw_trajectories(load_arena("two-rooms", Path()), tracks_of([]), path)
    assert path.stat().st_size > 5000


def test_the_same_tracks_make_the_same_bytes(tmp_path):
    """Nothing of the day or the machine is in it."""
    arena = load_arena("open-square", Path())
    for name in ("a.png", "b.png"):
        draw_trajectories(arena, tracks(50, 3), tmp_path / name)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


@pytest.mark.parametrize(
    ("frames", "runs"),
    [([], []), ([5], [(0, 1)]), ([1, 2, 3], [(0, 3)]), ([1, 3, 4, 9], [(0, 1), (1, 3), (3, 4)])],
)
def test_a_path_is_broken_where_a_frame_is_missing(frames, runs):
    """By hand."""
    found = list(unbroken(np.array(frames, np.int64)))
    assert [(part.start, part.stop) for part in found] == runs

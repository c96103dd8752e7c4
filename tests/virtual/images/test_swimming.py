"""Postures from tracks."""

import numpy as np
import pytest

from zfcal.tracks import FISH, ROBOT, Tracks
from zfcal.virtual.images.look import USUAL, look_of
from zfcal.virtual.images.swimming import swimming

FPS = 15.0
LOOK = look_of(USUAL)


def tracks_of(xy_m, heading_rad, *, kind=None, keep=None):
    """Return tracks from positions of shape (frame, agent, 2) and headings."""
    n_frames, n_agents = heading_rad.shape
    frame = np.repeat(np.arange(n_frames), n_agents)
    kinds = np.full(n_agents, FISH, np.int8) if kind is None else np.array(kind, np.int8)
    tracks = Tracks(
        time_s=frame / FPS,
        frame=frame,
        agent=np.tile(np.arange(n_agents, dtype=np.int32), n_frames),
        kind=np.tile(kinds, n_frames),
        x_m=xy_m[..., 0].ravel(),
        y_m=xy_m[..., 1].ravel(),
        heading_rad=heading_rad.ravel().astype(np.float32),
        confidence=np.ones(n_frames * n_agents, np.float32),
    )
    return tracks if keep is None else tracks.take(keep)


def circle(n=60, radius_m=0.1, turn_s=4.0):
    """Return a fish that swims a circle to the left, and its headings."""
    angle = 2 * np.pi * np.arange(n) / FPS / turn_s
    xy_m = radius_m * np.stack([np.cos(angle), np.sin(angle)], axis=-1)[:, None] + 0.5
    return xy_m, np.angle(np.exp(1j * (angle[:, None] + np.pi / 2)))


def test_positions_are_those_of_the_tracks():
    """Bit by bit, with the frame's number and time."""
    xy_m, heading = circle()
    found = swimming(tracks_of(xy_m, heading), LOOK, fps=FPS, seed=1)
    assert len(found) == 60
    for row in (0, 17, 59):
        moment = found.at(row)
        assert np.array_equal(moment.bodies.xy_m, xy_m[row])
        assert (moment.number, moment.time_s) == (row, row / FPS)


def test_a_fish_on_a_circle_bends_along_it():
    """Heading, velocity and bend to the left are constant but for the ends."""
    xy_m, heading = circle()
    found = swimming(tracks_of(xy_m, heading), LOOK, fps=FPS, seed=1)
    inner = slice(8, -8)
    off = np.angle(np.exp(1j * (found.heading_rad - heading)))[inner]
    assert np.abs(off).max() < 1e-3
    speed = np.hypot(*np.moveaxis(found.velocity_m_s, -1, 0))[inner]
    assert speed == pytest.approx(2 * np.pi * 0.1 / 4, rel=0.01)
    assert found.bend_rad[inner] == pytest.approx(found.bend_rad[20, 0])
    assert 0.1 < found.bend_rad[20, 0] < 0.3


def test_a_sudden_turn_is_drawn_over_some_frames():
    """The heading of a step jumps by a right angle; the drawn one takes a fifth of a second."""
    heading = np.where(np.arange(30) < 15, 0.0, np.pi / 2)[:, None]
    xy_m = np.zeros((30, 1, 2)) + np.arange(30)[:, None, None] * 0.002
    found = swimming(tracks_of(xy_m, heading), LOOK, fps=FPS, seed=1)
    turning = np.flatnonzero((found.heading_rad > 0.05) & (found.heading_rad < np.pi / 2 - 0.05))
    assert 2 <= len(turning) <= 4
    assert found.bend_rad.max() > 0.5


def test_missing_headings_are_those_of_the_movement():
    """As in imported tracks; a fish that rests keeps the last one."""
    xy_m, heading = circle()
    xy_m = np.concatenate([xy_m, np.repeat(xy_m[-1:], 10, axis=0)])
    nowhere = np.full((70, 1), np.nan)
    found = swimming(tracks_of(xy_m, nowhere), LOOK, fps=FPS, seed=1)
    off = np.angle(np.exp(1j * (found.heading_rad[8:50] - heading[8:50])))
    assert np.abs(off).max() < 0.02
    assert found.heading_rad[-1, 0] == pytest.approx(heading[-1, 0], abs=0.15)
    assert np.isfinite(found.heading_rad).all()


def test_who_is_missing_is_not_drawn():
    """An agent without a row in a frame; the others keep their postures' lengths."""
    xy_m, heading = circle()
    both = np.concatenate([xy_m, xy_m + 0.1], axis=1), np.concatenate([heading, heading], axis=1)
    keep = np.ones(120, bool)
    keep[2 * 20 + 1] = False
    found = swimming(tracks_of(*both, keep=keep), LOOK, fps=FPS, seed=1)
    assert [len(found.at(row).bodies) for row in (19, 20, 21)] == [2, 1, 2]
    assert found.at(20).bodies.length_m[0] == found.at(19).bodies.length_m[0]
    for row in (19, 20, 21):
        assert np.isfinite(found.at(row).bodies.heading_rad).all()
        assert np.isfinite(found.at(row).bodies.phase_rad).all()


def test_a_lure_is_stiff_and_as_long_as_asked_for():
    """Fish differ in length, and the seed decides how."""
    xy_m, heading = circle()
    many = np.repeat(xy_m, 5, axis=1), np.repeat(heading, 5, axis=1)
    tracks = tracks_of(*many, kind=[FISH] * 4 + [ROBOT])
    found = swimming(tracks, LOOK, fps=FPS, seed=1)
    assert found.is_robot.tolist() == [False] * 4 + [True]
    assert found.length_m[4] == LOOK.lure_length_m
    assert not found.bend_rad[:, 4].any()
    assert len(set(found.length_m[:4])) == 4
    assert np.abs(found.length_m[:4] - LOOK.fish_length_m).max() < 0.006
    again, other = (swimming(tracks, LOOK, fps=FPS, seed=seed) for seed in (1, 2))
    assert np.array_equal(found.phase_rad, again.phase_rad)
    assert not np.array_equal(found.length_m, other.length_m)


def test_a_single_frame_can_be_drawn():
    """Nobody moves in it."""
    xy_m, heading = circle(1)
    moment = swimming(tracks_of(xy_m, heading), LOOK, fps=FPS, seed=1).at(0)
    assert moment.velocity_m_s.tolist() == [[0.0, 0.0]]
    assert np.isfinite(moment.bodies.bend_rad).all()

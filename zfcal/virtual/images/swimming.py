"""From tracks to postures: how bodies that follow given tracks hold themselves.

Positions are those of the tracks, exactly. Headings and bends are drawn plausibly from
them, since a track knows neither a tail nor what happens between two of a model's steps.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d

from zfcal.arrays import Bools, Floats, Ints
from zfcal.tracks import ROBOT, Tracks
from zfcal.virtual.images.bodies import Bodies
from zfcal.virtual.images.look import Look

_TURN_S = 0.08
"""Standard deviation in time of the smoothing of headings: a fish turns within 0.2 s."""

_BEND_S = 0.11
"""How far the tail lags behind the head, in seconds of turning."""

_MOST_BENT_RAD = 1.1
_GLIDE_RAD, _STROKE_RAD = 0.08, 0.45
_CRUISE_M_S = 0.12
_STROKE_HZ, _STROKE_PER_M = 1.5, 35.0
"""Tail beats: in a glide, and more for each metre that is swum."""

_SLOW_M_S = 0.01
"""Below this speed the direction of movement says nothing about the heading."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Moment:
    """Everybody at one instant: what one image of each camera shows.

    Parameters
    ----------
    number
        The frame.
    time_s
        Middle of the exposure.
    is_robot : ndarray of bool, shape (body,)
    bodies
        Fish and lures.
    velocity_m_s : ndarray, shape (body, 2)
        Blurs a body while the shutter is open.
    """

    number: int
    time_s: float
    is_robot: Bools
    bodies: Bodies
    velocity_m_s: Floats


@dataclass(frozen=True, slots=True, kw_only=True)
class Swimming:
    """Postures of all agents over time; NaN where an agent is missing.

    Parameters
    ----------
    frame : ndarray of int64, shape (frame,)
    time_s : ndarray, shape (frame,)
    is_robot : ndarray of bool, shape (agent,)
    length_m, contrast : ndarray, shape (agent,)
    xy_m, velocity_m_s : ndarray, shape (frame, agent, 2)
    heading_rad, bend_rad, wave_rad, phase_rad : ndarray, shape (frame, agent)
    """

    frame: Ints
    time_s: Floats
    is_robot: Bools
    length_m: Floats
    contrast: Floats
    xy_m: Floats
    velocity_m_s: Floats
    heading_rad: Floats
    bend_rad: Floats
    wave_rad: Floats
    phase_rad: Floats

    def __len__(self) -> int:
        return len(self.frame)

    def at(self, row: int) -> Moment:
        """Return everybody who is there in a row of the arrays."""
        here = np.isfinite(self.xy_m[row]).all(axis=-1)
        bodies = Bodies(
            xy_m=self.xy_m[row, here],
            heading_rad=self.heading_rad[row, here],
            length_m=self.length_m[here],
            bend_rad=self.bend_rad[row, here],
            wave_rad=self.wave_rad[row, here],
            phase_rad=self.phase_rad[row, here],
            contrast=self.contrast[here],
        )
        return Moment(
            number=int(self.frame[row]),
            time_s=float(self.time_s[row]),
            is_robot=self.is_robot[here],
            bodies=bodies,
            velocity_m_s=self.velocity_m_s[row, here],
        )


def swimming(tracks: Tracks, look: Look, *, fps: float, seed: int) -> Swimming:
    """Return how bodies swim along tracks.

    Parameters
    ----------
    tracks
        At most one row of an agent a frame.
    look
        Lengths of fish and lures.
    fps
        Frame rate of the tracks, in hertz.
    seed
        Of the fish's lengths and shades, and of the phases of their tails.

    Returns
    -------
    Swimming
        A row for each frame of the tracks.
    """
    frame, rows = np.unique(tracks.frame, return_inverse=True)
    agent, columns = np.unique(tracks.agent, return_inverse=True)
    is_robot = np.zeros(len(agent), bool)
    is_robot[columns] = tracks.kind == ROBOT
    time_s = np.zeros(len(frame))
    time_s[rows] = tracks.time_s
    shape = (len(frame), len(agent))
    xy_m = np.full((*shape, 2), np.nan)
    xy_m[rows, columns] = np.column_stack([tracks.x_m, tracks.y_m])
    stated = np.full(shape, np.nan)
    stated[rows, columns] = tracks.heading_rad
    velocity = _rate(xy_m, frame, fps)
    heading = _headings(xy_m, stated, velocity, fps)
    rng = np.random.default_rng([seed, _LENGTHS])
    lengths = look.fish_length_m + look.fish_length_sd_m * rng.standard_normal(len(agent))
    lengths = np.clip(lengths, 0.5 * look.fish_length_m, 1.5 * look.fish_length_m)
    bend, wave, phase = _strokes(heading, velocity, frame, fps, rng)
    shades = np.random.default_rng([seed, _SHADES]).standard_normal(len(agent))
    contrast = np.clip(1.0 + look.fish_contrast_sd * shades, 0.5, 1.5)
    return Swimming(
        frame=frame,
        time_s=time_s,
        is_robot=is_robot,
        length_m=np.where(is_robot, look.lure_length_m, lengths),
        contrast=np.where(is_robot, 1.0, contrast),
        xy_m=xy_m,
        velocity_m_s=velocity,
        heading_rad=heading,
        # A lure is stiff.
        bend_rad=np.where(is_robot, 0.0, bend),
        wave_rad=np.where(is_robot, 0.0, wave),
        phase_rad=np.where(is_robot, 0.0, phase),
    )


_LENGTHS, _SHADES = 1, 2
"""Tell the random numbers of bodies from those of images."""


def _rate(values: Floats, frame: Ints, fps: float) -> Floats:
    """Return the change of values a second, from neighbouring frames; 0 where there are none."""
    if len(frame) < 2:
        return np.zeros_like(values)
    rate = np.gradient(values, frame / fps, axis=0)
    return np.where(np.isfinite(rate), rate, 0.0)


def _headings(xy_m: Floats, stated: Floats, velocity: Floats, fps: float) -> Floats:
    """Return headings smoothed over time; the direction of movement where none is stated."""
    moves = np.hypot(velocity[..., 0], velocity[..., 1]) > _SLOW_M_S
    course = np.where(moves, np.arctan2(velocity[..., 1], velocity[..., 0]), np.nan)
    angle = np.where(np.isfinite(stated), stated, course)
    pointer = np.where(np.isfinite(angle), np.exp(1j * np.nan_to_num(angle)), 0.0)
    # Where nothing is known the last direction stays.
    known = pointer != 0
    last = np.maximum.accumulate(np.where(known, np.arange(len(angle))[:, None], 0), axis=0)
    pointer = np.take_along_axis(pointer, last, axis=0)
    pointer = np.where(np.isfinite(xy_m).all(axis=-1), pointer, 0.0)
    width = _TURN_S * fps
    smooth = gaussian_filter1d(pointer.real, width, axis=0, mode="nearest") + 1j * (
        gaussian_filter1d(pointer.imag, width, axis=0, mode="nearest")
    )
    return np.angle(smooth)


def _strokes(
    heading: Floats,
    velocity: Floats,
    frame: Ints,
    fps: float,
    rng: np.random.Generator,
) -> tuple[Floats, Floats, Floats]:
    """Return bends, and amplitudes and phases of the tail's stroke."""
    turning = _rate(np.unwrap(heading, axis=0), frame, fps)
    bend = _MOST_BENT_RAD * np.tanh(_BEND_S * turning / _MOST_BENT_RAD)
    speed = gaussian_filter1d(np.hypot(velocity[..., 0], velocity[..., 1]), 0.1 * fps, axis=0)
    wave = _GLIDE_RAD + (_STROKE_RAD - _GLIDE_RAD) * np.minimum(speed / _CRUISE_M_S, 1.0)
    start = rng.uniform(0.0, 2 * np.pi, heading.shape[1])
    beats = np.cumsum((_STROKE_HZ + _STROKE_PER_M * speed) / fps, axis=0)
    return bend, wave, start + 2 * np.pi * beats

"""Recordings with a known answer: of the base model, and with something plainly wrong in them."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np

from zfcal.artifacts.arenas import load_arena
from zfcal.model.extended import maximise
from zfcal.model.scene import make_scene
from zfcal.model.simulate import simulate_tracks
from zfcal.parameters import natural
from zfcal.tracks import Samples, Tracks

DT_S = 0.2


def two_rooms():
    """Return the default arena."""
    return load_arena("two-rooms", Path())


def natural_fish(arena):
    """Return natural parameters for an arena."""
    return natural(tuple((zone.name, zone.follows_walls) for zone in arena.zones), dt_s=DT_S)


def samples_of(xy_m):
    """Return positions (sample, fish, xy) as samples of fish that were all seen."""
    n, fish = xy_m.shape[:2]
    return Samples(
        dt_s=DT_S,
        k=np.arange(n, dtype=np.int64),
        agent=np.arange(1, fish + 1, dtype=np.int32),
        kind=np.zeros(fish, dtype=np.int8),
        xy_m=xy_m,
        confidence=np.ones((n, fish), dtype=np.float32),
    )


def base_walk(seed, *, minutes=5.0, fish=5):
    """Return positions of fish that do as the base model does, (sample, fish, xy)."""
    arena = two_rooms()
    xy_m, _ = simulate_tracks(
        natural_fish(arena), arena, n_agents=fish, n_steps=round(minutes * 300), seed=seed
    )
    return xy_m


def fitted_scene(xy_m):
    """Return the scene of positions, and the base model at its maximum likelihood there."""
    arena = two_rooms()
    scene = make_scene(samples_of(xy_m), arena)
    return scene, maximise(scene, natural_fish(arena))


def redrawn(scene, fitted, rng, tilt):
    """Return the scene with each heading drawn anew from the model's law times a factor.

    Where everybody was when a step began stays as it was, so that what is wrong is the factor
    alone: a plain generator of wrong steps, not of walks.

    Parameters
    ----------
    tilt : callable
        From the angles of the cells, shape (cell,), to factors of shape (turn, cell).
    """
    table = fitted.tables()[1]
    cells = table.shape[1]
    angle = 2 * np.pi * np.arange(cells) / cells
    law = table * tilt(angle)
    law /= law.sum(axis=1, keepdims=True)
    drawn = (rng.random(len(law))[:, None] > law.cumsum(axis=1)).sum(axis=1)
    drawn = np.minimum(drawn, cells - 1)
    taken = np.stack([np.cos(angle[drawn]), np.sin(angle[drawn])], axis=1)
    landing = scene.turns.share[np.arange(len(drawn)), drawn].argmax(axis=1) + 1
    turns = dataclasses.replace(scene.turns, taken=taken, landing=landing.astype(np.int64))
    return dataclasses.replace(scene, turns=turns)


def filmed(xy_m, *, fps, noise_m, rng):
    """Return tracks at a frame rate, straight between steps, with white noise."""
    per = round(fps * DT_S)
    at = np.arange((len(xy_m) - 1) * per + 1)
    a = np.minimum(at // per, len(xy_m) - 2)
    share = ((at - a * per) / per)[:, None, None]
    return tracks_of((1 - share) * xy_m[a] + share * xy_m[a + 1], fps=fps, noise_m=noise_m, rng=rng)


def tracks_of(xy_m, *, fps, noise_m=0.0, rng=None):
    """Return positions (frame, fish, xy) as rows, with white noise; NaN leaves a row out."""
    if noise_m > 0:
        xy_m = xy_m + rng.normal(0.0, noise_m, xy_m.shape)
    frame, agent = np.nonzero(~np.isnan(xy_m[..., 0]))
    n = len(frame)
    return Tracks(
        time_s=frame / fps,
        frame=frame.astype(np.int64),
        agent=agent.astype(np.int32),
        kind=np.zeros(n, dtype=np.int8),
        x_m=xy_m[frame, agent, 0],
        y_m=xy_m[frame, agent, 1],
        heading_rad=np.full(n, np.nan, dtype=np.float32),
        confidence=np.ones(n, dtype=np.float32),
    )

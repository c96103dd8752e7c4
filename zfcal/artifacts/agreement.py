"""Whether ``trial.toml`` and the tracks of a trial agree: agents at once, and frames a second.

People edit the settings after tracks were made. Models are then simulated with other agents than
were recorded, and nothing in the scores would show it.
"""

from __future__ import annotations

import numpy as np

from zfcal.arrays import Floats, Ints
from zfcal.artifacts.segments import segment_path, segment_starts
from zfcal.artifacts.tables import read_tracks
from zfcal.errors import DamagedError, InputError
from zfcal.tracks import Tracks
from zfcal.trial import CONFIG_NAME, Trial

_LOOKED_AT = 8
"""Segments that are read, spread evenly: settings are wrong for all of them or for none."""

_IN_FRAMES = 0.99
"""An agent more in a hundredth of the frames is a false detection."""

_SAME_RATE = 0.15
"""A live camera may be a tenth off its rate, by its share; a wrong setting is farther off."""


def check_agreement(trial: Trial) -> None:
    """Refuse a trial whose tracks hold other agents, or another rate, than its settings say.

    Fewer agents are no disagreement: they may be lost. What cannot be read is left to those
    who need it.

    Raises
    ------
    InputError
        They disagree.
    """
    for problem in disagreements(trial):
        raise problem


def disagreements(trial: Trial) -> list[InputError]:
    """Return in what the tracks of a trial disagree with its settings; empty without tracks."""
    read = [_read_or_none(trial, start) for start in _looked_at(trial)]
    found = [tracks for tracks in read if tracks is not None and len(tracks)]
    problems = [_too_many(trial, found), _other_rate(trial, found)] if found else []
    return [problem for problem in problems if problem is not None]


def _looked_at(trial: Trial) -> list[int]:
    starts = segment_starts(trial.root)
    at = np.linspace(0, len(starts) - 1, min(len(starts), _LOOKED_AT)).round()
    return [starts[int(number)] for number in at]


def _read_or_none(trial: Trial, start_s: int) -> Tracks | None:
    try:
        return read_tracks(segment_path(trial.root, start_s))
    except (DamagedError, InputError):
        return None


def _too_many(trial: Trial, found: list[Tracks]) -> InputError | None:
    present = np.concatenate([_at_once(tracks) for tracks in found])
    n = int(np.quantile(present, _IN_FRAMES))
    if n <= trial.n_agents:
        return None
    return InputError(
        f"{trial.config}: n_fish = {trial.n_fish} and n_robots = {trial.n_robots} are "
        f"{trial.n_agents} agents, the tracks hold {n} at once.",
        hint=f"Set n_fish and n_robots in {CONFIG_NAME} to those of the recording, or make its "
        "tracks again.",
    )


def _at_once(tracks: Tracks) -> Ints:
    """Return how many agents are in each frame that has any, shape (frame,)."""
    _, counts = np.unique(tracks.frame, return_counts=True)
    return np.asarray(counts, dtype=np.int64)


def _other_rate(trial: Trial, found: list[Tracks]) -> InputError | None:
    frame_s = np.concatenate([_frame_times(tracks) for tracks in found])
    if not len(frame_s):
        return None
    rate_hz = float(1 / np.median(frame_s))
    if abs(rate_hz / trial.fps - 1) <= _SAME_RATE:
        return None
    return InputError(
        f"{trial.config}: the tracks have {rate_hz:.4g} frames a second, fps says {trial.fps:g}.",
        hint=f"Set fps (and dt_s, a whole number of frames) in {CONFIG_NAME} to the recording's.",
    )


def _frame_times(tracks: Tracks) -> Floats:
    """Return the seconds of a frame between each two that follow each other, shape (pair,)."""
    frames = np.diff(tracks.frame)
    new = frames > 0
    frame_s: Floats = np.diff(tracks.time_s)[new] / frames[new]
    return frame_s[frame_s > 0]

"""Whether ``trial.toml`` and the tracks of a trial agree: agents at once, and frames a second.

People edit the settings after tracks were made. Models are then simulated with other agents than
were recorded, and nothing in the scores would show it.
"""

from __future__ import annotations

import numpy as np

from zfcal.artifacts.segments import segment_path, segment_starts
from zfcal.artifacts.tables import read_tracks
from zfcal.errors import DamagedError, InputError
from zfcal.tracks import ROBOT, Tracks
from zfcal.trial import CONFIG_NAME, Trial

_LOOKED_AT = 8
"""Segments that are read, spread evenly; settings are wrong where most of them say so."""

_IN_FRAMES = 0.99
"""An agent more in a hundredth of the frames is a false detection."""

_SAME_RATE = 0.15
"""By so large a share times may be off; a wrong setting is farther off."""


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
    n = _usual([_at_once(tracks) for tracks in found])
    n_robots = _usual([_at_once(tracks.take(tracks.kind == ROBOT)) for tracks in found])
    # A robot may be tracked as one of the fish.
    if n <= trial.n_agents and n_robots <= trial.n_robots:
        return None
    held = f"{n} at once" if n > trial.n_agents else f"{n} at once, of which {n_robots} are robots"
    return InputError(
        f"{trial.config}: n_fish = {trial.n_fish} and n_robots = {trial.n_robots} are "
        f"{trial.n_agents} agents, the tracks hold {held}.",
        hint=f"Set n_fish and n_robots in {CONFIG_NAME} to those of the recording, or make its "
        "tracks again.",
    )


def _usual(numbers: list[int]) -> int:
    """Return a number that at least half of the segments have, or more."""
    return sorted(numbers)[(len(numbers) - 1) // 2]


def _at_once(tracks: Tracks) -> int:
    """Return how many agents are there at once, but for false detections."""
    counts = np.unique(tracks.frame, return_counts=True)[1]
    return int(np.quantile(counts, _IN_FRAMES)) if len(counts) else 0


def _other_rate(trial: Trial, found: list[Tracks]) -> InputError | None:
    # Of a camera that is slower than its rate frame numbers leave some out: times tell the same.
    frames = sum(int(tracks.frame[-1] - tracks.frame[0]) for tracks in found)
    time_s = sum(float(tracks.time_s[-1] - tracks.time_s[0]) for tracks in found)
    if not (frames > 0 and time_s > 0) or abs(frames / time_s / trial.fps - 1) <= _SAME_RATE:
        return None
    return InputError(
        f"{trial.config}: the tracks have {frames / time_s:.4g} frames a second, fps says "
        f"{trial.fps:g}.",
        hint=f"Set fps (and dt_s, a whole number of frames) in {CONFIG_NAME} to the recording's.",
    )

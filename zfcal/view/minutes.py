"""A minute of a trial as the page plays it: positions at even times, from tracks or poses."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np

from zfcal.arrays import Floats
from zfcal.artifacts.drive_files import drive_files
from zfcal.artifacts.pose_files import read_poses
from zfcal.artifacts.reading.contents import looks_of, numbered_of
from zfcal.artifacts.reading.parsing import json_of
from zfcal.artifacts.segments import segment_path, segment_starts
from zfcal.artifacts.tables import read_tracks
from zfcal.artifacts.tailing import Tail
from zfcal.errors import DamagedError, InputError
from zfcal.tracks import GUESS, KINDS, Tracks, tracks_of
from zfcal.trial import Trial
from zfcal.units import SEGMENT_S

MOST_HZ = 10.0
"""Positions a second that the page gets; it draws what lies between."""

_MM = 1000.0
_MRAD = 1000.0


def minute_starts(root: Path) -> list[int]:
    """Return the seconds at which the minutes start of which there are tracks or poses.

    Raises
    ------
    InputError
        A folder cannot be listed.
    """
    poses = [start for start in numbered_of(root / "poses", ".mcap") if start % SEGMENT_S == 0]
    return sorted({*segment_starts(root), *poses})


def stamps_of(root: Path) -> dict[int, int]:
    """Return for each minute a number that changes when its files do.

    Raises
    ------
    InputError
        A folder cannot be listed.
    """
    poses, drives = numbered_of(root / "poses", ".mcap"), drive_files(root)
    return {
        start: _stamp(segment_path(root, start), poses.get(start), drives.get(start))
        for start in minute_starts(root)
    }


def _stamp(*paths: Path | None) -> int:
    looks = [path and looks_of(path) for path in paths]
    return crc32(repr(looks).encode())


def minute_of(trial: Trial, start_s: int) -> dict[str, Any]:
    """Return where everybody was in a minute.

    Parameters
    ----------
    trial
        The trial.
    start_s
        Second at which the minute starts.

    Returns
    -------
    dict
        ``start_s``; ``hz``; ``agents``, each with ``agent``, ``kind``, and ``x``, ``y`` in
        millimetres, ``heading`` in milliradians and ``guess`` (whether the position is one) at
        ``start_s + n / hz``, null where it was not seen; ``targets``, rows of second,
        millimetres and millimetres.

    Raises
    ------
    InputError
        Of that minute there is nothing.
    DamagedError
        Neither tracks nor poses can be read.
    """
    hz = min(trial.fps, MOST_HZ)
    tracks = _tracks(trial.root, start_s)
    times_s = start_s + np.arange(round(SEGMENT_S * hz)) / hz
    return {
        "start_s": start_s,
        "hz": hz,
        "agents": [
            _course(tracks.take(tracks.agent == agent), times_s, within_s=0.75 / trial.fps)
            for agent in np.unique(tracks.agent)
        ],
        "targets": _targets(trial.root, start_s),
    }


def _tracks(root: Path, start_s: int) -> Tracks:
    """Return the closed segment; where there is none that can be read, the poses so far."""
    poses = numbered_of(root / "poses", ".mcap").get(start_s)
    path = segment_path(root, start_s)
    if path.is_file():
        try:
            return read_tracks(path)
        except (DamagedError, InputError):
            if poses is None:
                raise
    if poses is None:
        raise InputError(f"{path}: no such file.", hint="It may have been moved away.")
    return tracks_of(read_poses(poses, left_out=lambda _: None))


def _course(own: Tracks, times_s: Floats, *, within_s: float) -> dict[str, Any]:
    """Return one agent at the given times: at each the frame that is nearest, if one is near."""
    after = np.searchsorted(own.time_s, times_s).clip(1, max(1, len(own) - 1))
    after = np.minimum(after, len(own) - 1)
    before = np.maximum(after - 1, 0)
    is_before = times_s - own.time_s[before] <= own.time_s[after] - times_s
    nearest = np.where(is_before, before, after)
    seen = np.abs(own.time_s[nearest] - times_s) <= within_s
    return {
        "agent": int(own.agent[0]),
        "kind": KINDS[own.kind[0]],
        "x": _whole(own.x_m[nearest] * _MM, seen),
        "y": _whole(own.y_m[nearest] * _MM, seen),
        "heading": _whole(own.heading_rad[nearest] * _MRAD, seen),
        "guess": [int(n) for n in np.flatnonzero(seen & (own.confidence[nearest] < GUESS))],
    }


def _whole(values: Floats, seen: np.ndarray) -> list[int | None]:
    known = seen & np.isfinite(values)
    rounded = np.where(known, values, 0.0).round().astype(int).tolist()
    return [value if is_known else None for value, is_known in zip(rounded, known, strict=True)]


def _targets(root: Path, start_s: int) -> list[list[float]]:
    """Return the robot's targets of a minute; none where the log cannot be read."""
    try:
        path = drive_files(root).get(start_s)
        if path is None:
            return []
        said = [json_of(data) for _, data in Tail(path, "/targets").poll()]
    except (DamagedError, InputError):
        return []
    return [row for each in said if (row := _target(each)) is not None]


def _target(said: Any) -> list[float] | None:
    try:
        row = [float(said["time_s"]), _MM * float(said["x_m"]), _MM * float(said["y_m"])]
    except (KeyError, TypeError, ValueError):
        return None
    return [round(value, 2) for value in row] if np.isfinite(row).all() else None

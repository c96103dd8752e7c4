"""All tracks of a trial, or of a stretch of it, on the model's clock.

For whoever looks at a recording as a whole; windows are read in `segments`.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from zfcal.artifacts.tables import read_extra, read_tracks
from zfcal.behaviour.sampling import sample
from zfcal.errors import DamagedError, InputError
from zfcal.stages.events import LeftOut, Tell
from zfcal.stages.opening import OpenTrial
from zfcal.stages.segments import STEP_S, check_times, segment_path, segment_starts
from zfcal.tracks import Samples, Tracks, concatenate
from zfcal.units import SEGMENT_S

NOISE_KEY = "noise_m"
"""Extra metadata of a segment: the source's position noise, where it is known."""

_SAME_RATE = 0.01


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stretch:
    """What was read of a trial.

    Parameters
    ----------
    tracks
        Rows at the camera's rate.
    samples
        The same on the model's clock.
    files
        The segments that the stretch touches, damaged ones as well.
    n_left_out
        How many of them could not be read.
    noise_m
        Position noise as the segments state it, in metres; None where none does.
    """

    tracks: Tracks
    samples: Samples
    files: tuple[Path, ...]
    n_left_out: int
    noise_m: float | None


def read_stretch(opened: OpenTrial, window_s: tuple[int, int] | None, tell: Tell) -> Stretch:
    """Return the tracks of a trial, or of a stretch of it.

    Parameters
    ----------
    opened
        The trial.
    window_s
        From and to, in seconds since trial start; None for all.
    tell
        Hears of each damaged segment, which is left out.

    Raises
    ------
    InputError
        There are no tracks, all are damaged, or they were recorded at another rate.
    """
    root = opened.trial.root
    files = segment_files(root, window_s)
    if not files:
        where = "" if window_s is None else f" from {window_s[0]} s to {window_s[1]} s"
        raise InputError(
            f"{root}: has no tracks{where}.",
            hint=f"Import them first: zfcal import SRC {root}",
        )
    read = [(path, _read_or_tell(opened, path, tell)) for path in files]
    parts = [tracks for _, tracks in read if tracks is not None]
    if not parts:
        raise InputError(
            f"{root}: none of {len(files)} segments of tracks can be read.",
            hint="Import the recording again.",
        )
    tracks = concatenate(parts)
    _check_rate(opened, tracks)
    return Stretch(
        tracks=tracks,
        samples=_sample(opened, tracks, files, window_s),
        files=tuple(files),
        n_left_out=len(files) - len(parts),
        noise_m=_noise([path for path, tracks in read if tracks is not None]),
    )


def read_tracked(root: Path) -> Tracks:
    """Return all rows of a trial's segments.

    Raises
    ------
    InputError
        There are no segments.
    DamagedError
        One is damaged.
    """
    files = segment_files(root, None)
    if not files:
        raise InputError(f"{root}: has no tracks.", hint=f"Make them with: zfcal track {root}")
    return concatenate([read_tracks(path) for path in files])


def segment_files(root: Path, window_s: tuple[int, int] | None) -> list[Path]:
    """Return the segments of a trial that a stretch touches, in order of time."""
    starts = segment_starts(root)
    if window_s is not None:
        starts = [start for start in starts if window_s[0] - STEP_S < start < window_s[1]]
    return [segment_path(root, start) for start in starts]


def _read_or_tell(opened: OpenTrial, path: Path, tell: Tell) -> Tracks | None:
    trial, start_s = opened.trial, int(path.stem)
    try:
        tracks = read_tracks(path)
        check_times(path, tracks, start_s)
        # For its rules alone: a segment that breaks them is left out, the others stay.
        sample(tracks, fps=trial.fps, dt_s=trial.dt_s, start_s=start_s, end_s=start_s + SEGMENT_S)
    except (DamagedError, InputError) as error:
        said = str(error) if str(path) in str(error) else f"{path}: {error}"
        tell(LeftOut(path=path, problem=said, hint=error.hint))
        return None
    return tracks


def _check_rate(opened: OpenTrial, tracks: Tracks) -> None:
    frames = np.diff(tracks.frame)
    new = frames > 0
    if not new.any():
        return
    fps = float(1 / np.median(np.diff(tracks.time_s)[new] / frames[new]))
    trial = opened.trial
    if not abs(fps / trial.fps - 1) <= _SAME_RATE:
        raise InputError(
            f"{trial.root}: the tracks have {fps:.4g} frames a second, {trial.config} says "
            f"{trial.fps:g}.",
            hint="Set fps (and dt_s, a whole number of frames) in trial.toml to the recording's.",
        )


def _sample(
    opened: OpenTrial, tracks: Tracks, files: list[Path], window_s: tuple[int, int] | None
) -> Samples:
    trial = opened.trial
    first_s, end_s = (int(files[0].stem), int(files[-1].stem) + STEP_S)
    if len(tracks):
        end_s = min(end_s, tracks.time_s[-1] + 1 / trial.fps)
    if window_s is not None:
        first_s, end_s = max(first_s, window_s[0]), min(end_s, window_s[1])
    return sample(
        tracks,
        fps=trial.fps,
        dt_s=trial.dt_s,
        start_s=float(first_s),
        end_s=max(float(end_s), float(first_s)),
    )


def _noise(files: list[Path]) -> float | None:
    """Return the middle of what the segments state; tools may state it for each."""
    said = [read_extra(path).get(NOISE_KEY) for path in files]
    known = [float(value) for value in said if isinstance(value, int | float)]
    return float(np.median(known)) if known else None

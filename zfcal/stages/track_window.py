"""All tracks of a trial, or of a stretch of it, on the camera's clock and on the model's.

For whoever looks at a stretch as a whole. Each segment is read by `read_segment`, so that
its samples are those that its statistics were made of.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from zfcal.artifacts.segments import read_segment
from zfcal.artifacts.tables import read_extra, read_tracks
from zfcal.errors import DamagedError, InputError
from zfcal.sampling import sample_range
from zfcal.stages.events import LeftOut, Tell
from zfcal.stages.segments import STEP_S, readable, segment_files
from zfcal.stages.trial_context import OpenTrial
from zfcal.tracks import Samples, Tracks, concatenate, joined

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
        The segments that the stretch touches and that can be opened, damaged ones as well.
    n_segments
        How many the stretch touches, whatever they turned out to be.
    n_left_out
        How many of those could not be read.
    noise_m
        Position noise as the segments state it, in metres; None where none does.
    """

    tracks: Tracks
    samples: Samples
    files: tuple[Path, ...]
    n_segments: int
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
        Hears of each segment that is damaged or no file, which is left out.

    Raises
    ------
    InputError
        There are no tracks, none can be read, or they were recorded at another rate.
    """
    root = opened.trial.root
    touched = segment_files(root, window_s)
    if not touched:
        where = "" if window_s is None else f" from {window_s[0]} s to {window_s[1]} s"
        raise InputError(
            f"{root}: has no tracks{where}.",
            hint=f"Import them first: zfcal import SRC {root}",
        )
    files = readable(touched, tell)
    found = [_read_or_tell(opened, path, tell) for path in files]
    read = [segment for segment in found if segment is not None]
    if not read:
        raise InputError(
            f"{root}: none of {len(touched)} segments of tracks can be read.",
            hint="Import the recording again.",
        )
    tracks = concatenate([rows for _, rows, _ in read])
    _check_rate(opened, tracks)
    first, stop = _span(opened, tracks, files, window_s)
    return Stretch(
        tracks=tracks,
        samples=joined((samples for _, _, samples in read), first=first, stop=stop),
        files=tuple(files),
        n_segments=len(touched),
        n_left_out=len(touched) - len(read),
        noise_m=noise_of([path for path, _, _ in read]),
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


def _read_or_tell(opened: OpenTrial, path: Path, tell: Tell) -> tuple[Path, Tracks, Samples] | None:
    try:
        return (path, *read_segment(opened.trial, int(path.stem)))
    except (DamagedError, InputError) as error:
        tell(LeftOut(path=path, problem=str(error), hint=error.hint))
        return None


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


def _span(
    opened: OpenTrial, tracks: Tracks, files: list[Path], window_s: tuple[int, int] | None
) -> tuple[int, int]:
    """Return the first sample of a stretch, and the one after its last."""
    first_s, end_s = float(files[0].stem), float(files[-1].stem) + STEP_S
    if len(tracks):
        end_s = min(end_s, tracks.time_s[-1] + 1 / opened.trial.fps)
    if window_s is not None:
        first_s, end_s = max(first_s, window_s[0]), min(end_s, window_s[1])
    return sample_range(first_s, max(end_s, first_s), dt_s=opened.trial.dt_s)


def noise_of(files: Iterable[Path]) -> float | None:
    """Return the position noise, in metres: the middle of what segments state; None for no word."""
    said = [read_extra(path).get(NOISE_KEY) for path in files]
    known = [float(value) for value in said if isinstance(value, int | float)]
    return float(np.median(known)) if known else None

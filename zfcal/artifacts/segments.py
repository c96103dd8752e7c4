"""The closed track segments of a trial as files: their places, and from their rows to samples.

All that is made from tracks is made from `read_segment`.
"""

from __future__ import annotations

from pathlib import Path

from zfcal.artifacts.reading.contents import numbered_of
from zfcal.artifacts.tables import read_tracks
from zfcal.errors import DamagedError, InputError
from zfcal.sampling import sample
from zfcal.tracks import Samples, Tracks
from zfcal.trial import Trial
from zfcal.units import SEGMENT_S


def segment_name(start_s: int) -> str:
    """Return the path of the segment that starts at a second, relative to its trial."""
    return f"tracks/{start_s:06d}.parquet"


def segment_path(root: Path, start_s: int) -> Path:
    """Return the place of the segment that starts at a second."""
    return root / segment_name(start_s)


def segment_starts(root: Path) -> list[int]:
    """Return the seconds at which the segments of a trial start, in order.

    Segments start on whole minutes; other files in ``tracks/`` are none.
    """
    found = numbered_of(root / "tracks", ".parquet")
    return [second for second in found if second % SEGMENT_S == 0]


def read_segment(trial: Trial, start_s: int) -> tuple[Tracks, Samples]:
    """Return a segment on the camera's clock, and on the model's.

    A sample is taken from the frames of its own segment: a segment then has the same samples
    in every window.

    Raises
    ------
    DamagedError
        The file is damaged, of another schema, or holds what no tracker writes.
    """
    path = segment_path(trial.root, start_s)
    tracks = read_tracks(path)
    end_s = start_s + SEGMENT_S
    _check_times(path, tracks, start_s)
    try:
        samples = sample(tracks, fps=trial.fps, dt_s=trial.dt_s, start_s=start_s, end_s=end_s)
    except InputError as error:
        raise DamagedError(f"{path}: {error}", hint=error.hint) from error
    return tracks, samples


def _check_times(path: Path, tracks: Tracks, start_s: int) -> None:
    """Refuse a segment whose rows lie outside the minute that its name states."""
    end_s = start_s + SEGMENT_S
    if len(tracks) and not (tracks.time_s[0] >= start_s and tracks.time_s[-1] < end_s):
        raise DamagedError(
            f"{path}: holds the times {tracks.time_s[0]:.6g} s to {tracks.time_s[-1]:.6g} s, "
            f"expected {start_s} s to {end_s:.6g} s.",
            hint="The name says where a segment starts: give the file its own name back.",
        )

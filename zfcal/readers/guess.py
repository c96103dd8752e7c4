"""What a file looks like: the format when none is named, and the hint when the wrong one is."""

from __future__ import annotations

import re
from pathlib import Path

from zfcal.errors import InputError
from zfcal.readers.extras import open_hdf5
from zfcal.readers.fishmodel import LINE
from zfcal.readers.text import first_lines

_ENDINGS = {".npz": "trex", ".npy": "trajectorytools", ".xml": "cats", ".nc": "movement"}
_ENDINGS |= {".slp": "sleap", ".nwb": "nwb"}

_HEADERS = (
    (re.compile(r"timeStep\t"), "cats"),
    (re.compile(r"X1\tY1\tProbId1"), "idtracker"),
    (re.compile(r"scorer,"), "deeplabcut"),
    (re.compile(r"(frame,time,individual,|(time,|seconds,)?x1,y1)"), "idtracker"),
    (re.compile(r"(.*,)?[XY](#\w+)?( \((cm|px)\))?(,|$)"), "trex"),
    (re.compile(r"(.*,)?(x_m|x_px)(,|$)"), "csv"),
    (re.compile(r"frame,id,|(\s*-?[\d.]+\s*,){5,}"), "mot"),
    (re.compile(rf"(?:{LINE.pattern})$"), "fishmodel"),
)

_KEYS = (
    ("df_with_missing", "deeplabcut"),
    ("trajectories", "idtracker"),
    ("tracks", "sleap"),
    ("entities", "robofish"),
    ("file_create_date", "nwb"),
)


def guess_format(path: Path) -> str | None:
    """Return the name of the format that a file looks like; None if like none.

    Parameters
    ----------
    path
        A file, or a folder as TRex fills it.
    """
    if path.is_dir():
        return "trex" if any(path.glob("*_*[0-9].npz")) else None
    ending = Path(path.name.removesuffix(".gz")).suffix.lower()
    if ending in _ENDINGS:
        return _ENDINGS[ending]
    try:
        if ending in {".h5", ".hdf5"}:
            with open_hdf5(path, under=None) as file:
                return next((name for key, name in _KEYS if key in file), None)
        line = first_lines(path, 1)[0]
    except InputError:
        return None
    return next((name for pattern, name in _HEADERS if pattern.match(line)), None)

"""Tracks of idtracker.ai (``.h5``, ``.npy``, csv) and of idTracker (``trajectories.txt``).

idtracker.ai (6.0, ``utils/trajectories_io.py``; user guide, "Trajectory
files"): ``trajectories`` of shape (frame, animal, 2), in pixels, NaN where not
located; ``id_probabilities`` (frame, animal) or (frame, animal, 1);
``frames_per_second``; ``length_unit`` in pixels per a unit that the file does
not name. As csv either ``time,x1,y1,x2,y2,...`` or, tidy,
``frame,time,individual,x,y,probability``. A located animal has the certainty of
its identity; one whose blob touches others is placed by an estimate and has NaN.

idTracker (``src/trajectories2txt.m``, ``src/despedida.m``): tab-separated
``X1 Y1 ProbId1 X2 ...``, a row per frame, in pixels. ProbId -1: occluded, with a
centroid after resegmentation; -2: placed by an estimate that is not very accurate.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from zfcal.arrays import Floats
from zfcal.errors import InputError
from zfcal.readers.assemble import Imported, assemble
from zfcal.readers.clock import check_declared, check_rate
from zfcal.readers.extras import dataset, open_hdf5, texts
from zfcal.readers.options import ImportOptions
from zfcal.readers.pickles import read_npy
from zfcal.readers.raw import Grid, Rows
from zfcal.readers.text import (
    Layout,
    header_of,
    numbers,
    read_table,
    whole_numbers,
)

_LOCATED = 0.5
"""Confidence of a located animal is at least this: its identity may be unsure, not its place."""

_TOUCHING = 0.4
"""Confidence of a place that was found after taking touching animals apart."""

_GUESSED = 0.1
"""Confidence of a place that idTracker calls not very accurate."""

_TIDY = ("frame", "time", "individual", "x", "y", "probability")

_WIDE = re.compile(r"([xyXY])_?(\d+)")


def read_idtracker(path: Path, options: ImportOptions) -> Imported:
    """Read tracks of idtracker.ai or idTracker, in pixels.

    Parameters
    ----------
    path
        ``.h5``, ``.hdf5``, ``.npy``, ``.csv`` or ``.txt``; text may be ``.gz``.
    options
        Needs ``m_per_px``.
    """
    ending = Path(path.name.removesuffix(".gz")).suffix
    if ending in {".h5", ".hdf5"}:
        rows = from_dictionary(path, _read_h5(path), options)
    elif ending == ".npy":
        found = read_npy(path)
        if not isinstance(found, dict):
            raise InputError(
                f"{path}: expected a dictionary with 'trajectories', got {type(found).__name__}.",
                hint="A plain array of positions is read by --format trajectorytools.",
            )
        rows = from_dictionary(path, found, options)
    elif ending == ".txt":
        rows = _old_text(path, options)
    elif ending == ".csv":
        rows = _csv(path, options)
    else:
        raise InputError(f"{path}: expected .h5, .npy, .csv or .txt, got {ending or 'no ending'}.")
    return assemble(path, rows, options)


def from_dictionary(path: Path, found: Mapping[str, Any], options: ImportOptions) -> Rows:
    """Return the rows of a dictionary as idtracker.ai stores it.

    Parameters
    ----------
    path
        Named in messages.
    found
        ``trajectories`` and what else the file has.
    options
        The frame rate to compare with.
    """
    if "trajectories" not in found:
        raise InputError(
            f"{path}: expected the key 'trajectories', got {', '.join(map(str, found)) or 'none'}."
        )
    xy = positions(path, found["trajectories"])
    n_frames, n_animals = xy.shape[:2]
    confidence = None
    if found.get("id_probabilities") is not None:
        known = np.asarray(found["id_probabilities"])
        shapes = {(n_frames, n_animals), (n_frames, n_animals, 1)}
        if known.dtype.kind not in "iuf" or known.shape not in shapes:
            raise InputError(
                f"{path}: expected id_probabilities, numbers of shape {(n_frames, n_animals)}, "
                f"got {known.dtype} of {known.shape}."
            )
        confidence = _confidence(known.reshape(n_frames, n_animals).astype(np.float64))
    names = tuple(str(name) for name in np.ravel(found.get("identities_labels", ())))
    frame = np.arange(n_frames)
    return Grid(
        xy=xy,
        frame=frame,
        time_s=frame / options.fps,
        unit="px",
        confidence=confidence,
        names=names if len(names) == n_animals else (),
        notes=_notes(path, found, options),
    ).rows()


def positions(path: Path, found: Any) -> Floats:
    """Return positions as float64 of shape (frame, animal, 2), or say what is wrong with them."""
    stored = np.asarray(found)
    if stored.dtype.kind not in "iuf":
        raise InputError(f"{path}: expected trajectories of numbers, got {stored.dtype}.")
    xy = stored.astype(np.float64)
    if xy.ndim != 3 or xy.shape[2] != 2 or 0 in xy.shape:
        raise InputError(
            f"{path}: expected trajectories of shape (frame, animal, 2), got {xy.shape}."
        )
    return xy


def _notes(path: Path, found: Mapping[str, Any], options: ImportOptions) -> tuple[str, ...]:
    notes: list[str] = []
    rate = found.get("frames_per_second")
    if isinstance(rate, int | float | np.number):
        notes += check_declared(path, float(rate), options.fps)
    unit = found.get("length_unit")
    if isinstance(unit, int | float | np.number) and float(unit) > 0:
        notes.append(
            f"The file has {float(unit):.6g} px per unit of length, without naming the unit: "
            "not used."
        )
    return tuple(notes)


def _confidence(identity: Floats) -> Floats:
    """Tell located animals from estimated ones by the certainty of identity."""
    located = np.clip(identity, _LOCATED, 1.0)
    return np.where(np.isnan(identity) | (identity <= 0), _TOUCHING, located)


def _read_h5(path: Path) -> dict[str, Any]:
    with open_hdf5(path) as file:
        found: dict[str, Any] = dict(file.attrs)
        for name in ("trajectories", "id_probabilities", "frames_per_second", "length_unit"):
            if name in file and hasattr(file[name], "shape"):
                found[name] = dataset(file, name, path)
        if "identities_labels" in found:
            found["identities_labels"] = texts(found["identities_labels"])
        if "trajectories" not in found:
            there = ", ".join(sorted(file)) or "none"
            raise InputError(f"{path}: expected a data set 'trajectories', got {there}.")
    return found


def _csv(path: Path, options: ImportOptions) -> Rows:
    header = header_of(path, ",")
    if header == _TIDY:
        return _tidy(path, options)
    times = [name for name in header if name in {"time", "seconds"}]
    columns = tuple(name for name in header if _WIDE.fullmatch(name))
    numbers_found = sorted({int(name.strip("xyXY_")) for name in columns})
    if not columns or len(columns) != 2 * len(numbers_found):
        raise InputError(
            f"{path}, line 1: expected columns time, x1, y1, x2, y2, ... or {', '.join(_TIDY)}, "
            f"got {', '.join(header)[:200]}."
        )
    layout = Layout(names=header, delimiter=",", n_header=1, numeric=(*times, *columns))
    table = read_table(path, layout)
    xy = np.stack([numbers(table, name) for name in columns], axis=-1)
    frame = np.arange(len(xy))
    if times:
        _check_times(path, numbers(table, times[0]), options.fps)
    return Grid(
        xy=xy.reshape(len(xy), -1, 2),
        frame=frame,
        time_s=frame / options.fps,
        unit="px",
        names=tuple(str(number) for number in numbers_found),
    ).rows()


def _tidy(path: Path, options: ImportOptions) -> Rows:
    table = read_table(path, Layout(names=_TIDY, delimiter=",", n_header=1, numeric=_TIDY))
    frame = whole_numbers(table, "frame")
    frames, first_rows = np.unique(frame, return_index=True)
    _check_times(path, numbers(table, "time")[first_rows], options.fps, frames)
    return Rows(
        time_s=frame / options.fps,
        frame=frame,
        agent=whole_numbers(table, "individual"),
        x=numbers(table, "x"),
        y=numbers(table, "y"),
        unit="px",
        confidence=_confidence(numbers(table, "probability")),
    )


def _check_times(path: Path, time_s: Floats, fps: float, frame: Any = None) -> None:
    if not (np.diff(time_s) > 0).all():
        row = int(np.argmin(np.diff(time_s) > 0))
        raise InputError(
            f"{path}: expected times that advance, got {time_s[row + 1]:.10g} after "
            f"{time_s[row]:.10g}."
        )
    check_rate(path, time_s, fps=fps, frame=frame)


def _old_text(path: Path, options: ImportOptions) -> Rows:
    header = header_of(path, "\t")
    named = [name for name in header if name]
    n_animals = len(named) // 3
    expected = [f"{part}{i}" for i in range(1, n_animals + 1) for part in ("X", "Y", "ProbId")]
    if not named or named != expected:
        raise InputError(
            f"{path}, line 1: expected tab-separated columns X1, Y1, ProbId1, X2, ..., got "
            f"{', '.join(named)[:200]}."
        )
    layout = Layout(names=header, delimiter="\t", n_header=1, numeric=tuple(named))
    table = read_table(path, layout)
    values = np.stack([numbers(table, name) for name in named], axis=-1)
    values = values.reshape(len(values), n_animals, 3)
    frame = np.arange(len(values))
    return Grid(
        xy=values[..., :2],
        frame=frame,
        time_s=frame / options.fps,
        unit="px",
        confidence=_old_confidence(values[..., 2]),
        names=tuple(str(i) for i in range(1, n_animals + 1)),
    ).rows()


def _old_confidence(identity: Floats) -> Floats:
    """NaN is no estimate: ``trajectories.txt`` holds only animals that were seen apart."""
    confidence = np.where(np.isnan(identity), 1.0, np.clip(identity, _LOCATED, 1.0))
    confidence = np.where(identity == -1, _TOUCHING, confidence)
    return np.where(identity <= -2, _GUESSED, confidence)

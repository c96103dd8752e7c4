"""Tracks of TRex: a ``.npz`` or csv file for each individual.

TRex (``docs/formats.rst``): files ``VIDEO_id0.npz``, ``VIDEO_fish0.npz``, ... with
``frame``, ``time`` (seconds from the start of the video), ``missing`` and
``X#wcentroid``, ``Y#wcentroid`` (the body's centre) or ``X``, ``Y`` (the head), in
centimetres with y downwards; csv names carry the unit, ``X#wcentroid (cm)``. What is
not known is infinite. A frame with ``missing`` = 1 can hold an interpolated
position: it is taken as missing. Centimetres are right only if ``cm_per_pixel`` was
set: TRex takes an arena 30 cm wide otherwise. The ``.npz`` files of newer versions
(``tracking/Export.cpp``) hold ``cm_per_pixel``, ``frame_rate`` and ``id``. The file of an
individual that is called ``robot`` in place of ``id`` or ``fish`` (`zfcal export`) is a
robot's. ``ANGLE`` is not read: its sense of rotation is not documented.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from zfcal.arrays import Floats, Ints
from zfcal.errors import InputError
from zfcal.readers.assemble import Imported, assemble
from zfcal.readers.clock import check_declared, check_rate
from zfcal.readers.extras import whole
from zfcal.readers.options import Idle, ImportOptions, without_confidence
from zfcal.readers.raw import Rows
from zfcal.readers.text import Layout, header_of, numbers, read_table
from zfcal.tracks import FISH, KINDS, ROBOT

_CENTROID = "wcentroid"
_SOURCES = {_CENTROID: "#wcentroid", "centroid": "#centroid", "pcentroid": "#pcentroid", "head": ""}
"""What a position is of, and how TRex marks it in a name."""

_NUMBERED = re.compile(r"(?P<video>.+)_(?P<what>[A-Za-z]+)(?P<number>\d+)\.(?:npz|csv|csv\.gz)")
_NOT_TRACKS = re.compile(r"_(posture|statistics|memory|visual_field|heatmap|tracklet|recognition)_")
_UNIT = re.compile(r"(?P<name>.*?)\s*\((?P<unit>[^)]*)\)")


@dataclass(frozen=True, slots=True, kw_only=True)
class _Individual:
    """One file: its arrays by name without unit, and the unit of the positions."""

    path: Path
    number: int
    kind: int
    columns: Mapping[str, Floats]
    unit: str


def read_trex(path: Path, options: ImportOptions) -> Imported:
    """Read the files of TRex, in centimetres.

    Parameters
    ----------
    path
        The file of one individual, or the folder with those of all.
    options
        ``keypoint`` chooses ``wcentroid`` (default), ``centroid``, ``pcentroid`` or
        ``head``. With ``m_per_px`` the scale of TRex is replaced, where the file
        tells it.
    """
    mark, files = _asked(path, options)
    individuals = [_read(file, mark, number) for number, file in enumerate(files)]
    parts = [_rows(individual, mark, options) for individual in individuals]
    return assemble(path, _joined(parts), options)


def check_trex(path: Path, options: ImportOptions) -> Idle:
    """Look at the names of the files alone, and return the options that take no effect.

    Raises
    ------
    InputError
        A folder has no files of TRex or those of several videos, or no position is of such a part.
    """
    _asked(path, options)
    return without_confidence(path, options)


def _asked(path: Path, options: ImportOptions) -> tuple[str, list[Path]]:
    """Return how the names of the columns are marked, and the files of the individuals."""
    source = options.keypoint or _CENTROID
    if source not in _SOURCES:
        raise InputError(
            f"{path}: TRex has no body part {source!r}, expected one of {', '.join(_SOURCES)}."
        )
    return _SOURCES[source], _files(path) if path.is_dir() else [path]


def _files(folder: Path) -> list[Path]:
    """Return the files of one video's individuals, ``.npz`` rather than csv."""
    found = [file for file in sorted(folder.iterdir()) if _NUMBERED.fullmatch(file.name)]
    found = [file for file in found if not _NOT_TRACKS.search(file.name)]
    chosen = [file for file in found if file.suffix == ".npz"] or found
    videos = sorted({_match(file)["video"] for file in chosen})
    if len(videos) != 1:
        raise InputError(
            f"{folder}: expected the files of one video, VIDEO_id0.npz and so on, got those of "
            f"{len(videos)}{': ' if videos else ''}{', '.join(videos)}."
        )
    return sorted(chosen, key=lambda file: int(_match(file)["number"]))


def _match(file: Path) -> re.Match[str]:
    match = _NUMBERED.fullmatch(file.name)
    if match is None:
        raise InputError(f"{file}: expected a name such as VIDEO_id0.npz.")
    return match


def _read(path: Path, mark: str, place: int) -> _Individual:
    columns, unit = _read_npz(path) if path.suffix.lower() == ".npz" else _read_csv(path, mark)
    numbered = _NUMBERED.fullmatch(path.name)
    number = int(numbered["number"]) if numbered else place
    if "id" in columns and columns["id"].size == 1:
        number = int(columns["id"].item())
    is_robot = numbered is not None and numbered["what"] == KINDS[ROBOT]
    kind = ROBOT if is_robot else FISH
    return _Individual(path=path, number=number, kind=kind, columns=columns, unit=unit)


def _read_npz(path: Path) -> tuple[dict[str, Floats], str]:
    with (
        whole(path, ".npz"),
        path.open("rb") as file,
        np.load(file, allow_pickle=False) as archive,
    ):
        wanted = [name for name in archive.files if name.split("#")[0] in _WANTED]
        columns = {name: np.ravel(np.asarray(archive[name], np.float64)) for name in wanted}
    return columns, "cm"


_SINGLE = {"cm_per_pixel", "frame_rate", "id"}
_WANTED = {"frame", "time", "missing", "X", "Y"} | _SINGLE


def _read_csv(path: Path, mark: str) -> tuple[dict[str, Floats], str]:
    header = header_of(path, ",")
    parsed = [_UNIT.fullmatch(name) for name in header]
    names = tuple(m["name"] if m else name for m, name in zip(parsed, header, strict=True))
    wanted = {"frame", "time", "missing", f"X{mark}", f"Y{mark}"}
    layout = Layout(
        names=names,
        delimiter=",",
        n_header=1,
        numeric=tuple(name for name in names if name in wanted),
    )
    units = {m["unit"] for m in parsed if m and m["name"] in {f"X{mark}", f"Y{mark}"}} or {"cm"}
    if units not in ({"cm"}, {"px"}):
        raise InputError(f"{path}, line 1: expected positions in cm or px, got {', '.join(units)}.")
    if not layout.numeric:
        # What is missing is told where it is needed.
        return {}, units.pop()
    table = read_table(path, layout)
    return {name: numbers(table, name) for name in table.columns}, units.pop()


def _rows(individual: _Individual, mark: str, options: ImportOptions) -> Rows:
    path, columns = individual.path, individual.columns
    x_name, y_name = f"X{mark}", f"Y{mark}"
    missing = [name for name in ("frame", x_name, y_name) if name not in columns]
    if missing:
        there = [source for source, m in _SOURCES.items() if f"X{m}" in columns]
        got = ", ".join(sorted(columns)) or "nothing of it"
        raise InputError(
            f"{path}: expected {missing[0]!r}, got {got}.",
            hint=f"Positions of another part: --keypoint {there[0]}" if there else "",
        )
    frame = _frames(path, columns)
    unseen = columns.get("missing", np.zeros(len(frame))) != 0
    x, y = (np.where(unseen, np.nan, _known(columns[name])) for name in (x_name, y_name))
    unit, scale = _unit(individual, options)
    time_s, notes = _clock(individual, frame, options)
    return Rows(
        time_s=time_s,
        frame=frame,
        agent=np.full(len(frame), individual.number, dtype=np.int64),
        x=x / scale,
        y=y / scale,
        unit=unit,
        kind=np.full(len(frame), individual.kind, dtype=np.int8),
        notes=(*notes, _scale_note(columns)),
    )


def _frames(path: Path, columns: Mapping[str, Floats]) -> Ints:
    """Return the frame numbers, once every column has as many values and they ascend."""
    stored = columns["frame"]
    for name in columns.keys() - _SINGLE:
        if columns[name].size != stored.size:
            raise InputError(
                f"{path}: expected {stored.size} values in {name!r}, got {columns[name].size}."
            )
    # Written so that NaN and infinity fail.
    if not (stored.size and (np.abs(stored) < 2**53).all() and (stored == np.rint(stored)).all()):
        raise InputError(f"{path}: expected whole frame numbers, got others or none.")
    if stored[0] < 0 or not (np.diff(stored) > 0).all():
        raise InputError(f"{path}: expected frame numbers that ascend from 0 or more.")
    return stored.astype(np.int64)


def _known(values: Floats) -> Floats:
    return np.where(np.isinf(values), np.nan, values)


def _unit(individual: _Individual, options: ImportOptions) -> tuple[str, float]:
    """Return the unit of the positions once they are divided by the second value."""
    if options.m_per_px is None or individual.unit == "px":
        return individual.unit, 1.0
    cm_per_px = individual.columns.get("cm_per_pixel")
    if cm_per_px is None or not cm_per_px.size or not cm_per_px[0] > 0:
        raise InputError(
            f"{individual.path}: positions are in cm and the file does not state its cm_per_pixel, "
            f"so a scale of {options.m_per_px:.6g} m per pixel cannot take effect.",
            hint="Leave --mm-per-px out, or set cm_per_pixel in TRex and export again.",
        )
    return "px", float(cm_per_px[0])


def _scale_note(columns: Mapping[str, Floats]) -> str:
    told = columns.get("cm_per_pixel")
    scale = f"{told[0]:.6g} cm per pixel" if told is not None and told.size else "not in the file"
    return f"TRex's own scale (cm_per_pixel) is {scale}; unset, it takes an arena 30 cm wide."


def _clock(
    individual: _Individual, frame: Ints, options: ImportOptions
) -> tuple[Floats, tuple[str, ...]]:
    path, columns = individual.path, individual.columns
    notes: tuple[str, ...] = ()
    rate = columns.get("frame_rate")
    if rate is not None and rate.size:
        notes = check_declared(path, float(rate[0]), options.fps)
    time_s = columns.get("time")
    if time_s is None or not np.isfinite(time_s).all():
        return frame / options.fps, notes
    if not (np.diff(time_s) > 0).all() or time_s[0] < 0:
        raise InputError(f"{path}: expected times that advance from 0 or more.")
    check_rate(path, time_s, fps=options.fps, frame=frame)
    return time_s, notes


def _joined(parts: list[Rows]) -> Rows:
    if len({part.unit for part in parts}) != 1:
        raise InputError(
            "The files of one video have positions in cm and in px, expected one unit."
        )
    return Rows(
        time_s=np.concatenate([part.time_s for part in parts]),
        frame=np.concatenate([part.frame for part in parts]),
        agent=np.concatenate([part.agent for part in parts]),
        x=np.concatenate([part.x for part in parts]),
        y=np.concatenate([part.y for part in parts]),
        unit=parts[0].unit,
        kind=np.concatenate([part.kind for part in parts if part.kind is not None]),
        notes=tuple(dict.fromkeys(note for part in parts for note in part.notes)),
    )

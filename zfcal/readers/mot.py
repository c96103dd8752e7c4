"""Tracks as MOTChallenge csv: ``frame, id, x, y, width, height, confidence``.

MOTChallenge (motchallenge.net, instructions): x and y are the left and top edge
of a box in pixels; frames are numbered from 1; a confidence of -1 says nothing.
Trackers of animals use the same columns for points: width and height are then -1
and x, y the animal's centre (in FERDA's ground truth they lie 7 px from the
middle of an 80 px body), and x = y = -1 says that it is missing.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from zfcal.arrays import Floats, Ints
from zfcal.errors import InputError
from zfcal.readers.assemble import Imported, assemble
from zfcal.readers.options import ImportOptions
from zfcal.readers.raw import Rows
from zfcal.readers.text import (
    Layout,
    TextTable,
    cell_error,
    first_lines,
    header_of,
    numbers,
    read_table,
    whole_numbers,
)

_NAMES = ("frame", "id", "x", "y", "width", "height", "confidence")

_LONGEST = 10


def read_mot(path: Path, options: ImportOptions) -> Imported:
    """Read MOT tracks, in pixels.

    Parameters
    ----------
    path
        Comma-separated, with or without a header; ``.gz`` is unpacked.
    options
        Needs ``m_per_px``. ``box`` says whether x and y of a box are its corner
        (the standard, and the default) or its centre; ``first_frame`` is 1
        unless given.
    """
    table = _read(path)
    frame = _frames(table, 1 if options.first_frame is None else options.first_frame)
    x, y, notes = _centres(table, options)
    confidence, confidence_notes = _confidence(table)
    rows = Rows(
        time_s=frame / options.fps,
        frame=frame,
        agent=whole_numbers(table, "id"),
        x=x,
        y=y,
        unit="px",
        confidence=confidence,
        notes=(*notes, *confidence_notes),
    )
    return assemble(path, rows, options)


def _read(path: Path) -> TextTable:
    cells = header_of(path, ",")
    n_header = 0 if _is_number(cells[0]) else 1
    if n_header:
        _check_header(path, cells)
    if not len(_NAMES) - 1 <= len(cells) <= _LONGEST:
        raise InputError(
            f"{path}, line 1: expected {len(_NAMES)} to {_LONGEST} columns "
            f"({', '.join(_NAMES)}, ...), got {len(cells)}: {first_lines(path, 1)[0][:60]!r}."
        )
    more = tuple(f"column {i}" for i in range(len(_NAMES) + 1, len(cells) + 1))
    names = (*_NAMES, *more)[: len(cells)]
    numeric = tuple(name for name in names if name in _NAMES)
    layout = Layout(names=names, delimiter=",", n_header=n_header, numeric=numeric)
    return read_table(path, layout)


def _check_header(path: Path, cells: tuple[str, ...]) -> None:
    """Accept the names of the standard and of the usual tools."""
    usual = (
        {"frame"},
        {"id"},
        {"x", "bb_left", "left"},
        {"y", "bb_top", "top"},
        {"width", "w", "bb_width"},
        {"height", "h", "bb_height"},
        {"confidence", "conf"},
    )
    wrong = [cell for cell, names in zip(cells, usual, strict=False) if cell.lower() not in names]
    if wrong:
        raise InputError(
            f"{path}, line 1: expected columns {', '.join(_NAMES)}, got {', '.join(cells)}."
        )


def _frames(table: TextTable, first_frame: int) -> Ints:
    frame = whole_numbers(table, "frame") - first_frame
    if frame.min() < 0:
        row = int(np.argmin(frame))
        error = cell_error(
            table,
            "frame",
            row,
            expected=f"a frame number of {first_frame} or more",
            got=str(frame[row] + first_frame),
        )
        error.hint = "If the file counts frames from 0: --first-frame 0"
        raise error
    return frame


def _centres(table: TextTable, options: ImportOptions) -> tuple[Floats, Floats, tuple[str, ...]]:
    x, y, width, height = (numbers(table, name) for name in ("x", "y", "width", "height"))
    boxed = (width > 0) & (height > 0)
    missing = ~boxed & (x == -1) & (y == -1)
    notes: tuple[str, ...] = ()
    if options.box == "centre":
        half_width = half_height = np.zeros(len(x))
    else:
        half_width, half_height = np.where(boxed, width / 2, 0), np.where(boxed, height / 2, 0)
        if boxed.any():
            notes = ("x, y are the corner of a box, as the standard has it; its centre is taken.",)
    if options.box is not None and not boxed.any():
        raise InputError(
            f"{table.path}: no row has a box (width and height are not positive), so box = "
            f"{options.box} cannot take effect."
        )
    return (
        np.where(missing, np.nan, x + half_width),
        np.where(missing, np.nan, y + half_height),
        notes,
    )


def _confidence(table: TextTable) -> tuple[Floats | None, tuple[str, ...]]:
    if "confidence" not in table.columns:
        return None, ()
    values = numbers(table, "confidence")
    told = np.where(values == -1, np.nan, values)
    outside = (told < 0) | (told > 1)
    notes: tuple[str, ...] = ()
    if outside.any():
        notes = (f"{int(outside.sum())} confidences lie outside 0 to 1 and are cut to it.",)
    return np.clip(told, 0, 1), notes


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True

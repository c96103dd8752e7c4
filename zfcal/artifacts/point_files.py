"""Points of the tank as people write them down: CSV with a pixel and a place a line."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from zfcal.arrays import Floats
from zfcal.artifacts.reading.contents import read_bytes
from zfcal.errors import DamagedError, InputError

_UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001}


@dataclass(frozen=True, slots=True, kw_only=True)
class PointFile:
    """Points of the tank's plane, and where an image shows them.

    Parameters
    ----------
    px, m : ndarray, shape (n, 2)
        In pixels, and in metres.
    lines
        The line of the file that each stands on.
    """

    px: Floats
    m: Floats
    lines: tuple[int, ...]


def read_points(path: Path) -> PointFile:
    """Read pairs of points.

    Parameters
    ----------
    path
        A CSV file with the columns ``x_px, y_px`` and ``x_m, y_m`` (or ``_cm``, or ``_mm``),
        in any order; other columns are passed over. Lines that start with # are comments.

    Raises
    ------
    InputError
        The file is missing, or a column or a number is; with the line.
    DamagedError
        It is no text.
    """
    try:
        text = read_bytes(path).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise DamagedError(
            f"{path}: is no UTF-8 text (byte {error.start}).", hint="Save it as CSV in UTF-8."
        ) from error
    kept = [
        (number, line)
        for number, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    rows = list(csv.reader(line for _, line in kept))
    if not rows:
        raise InputError(f"{path}: holds no points.", hint=_EXAMPLE)
    columns, scale = _columns(path, [name.strip() for name in rows[0]])
    lines = tuple(number for number, _ in kept[1:])
    values = [
        [_number(path, line, row, place, name) for name, place in columns.items()]
        for line, row in zip(lines, rows[1:], strict=True)
    ]
    found = np.array(values, np.float64).reshape(-1, 4)
    return PointFile(px=found[:, :2], m=found[:, 2:] * scale, lines=lines)


_EXAMPLE = "The first line names the columns: x_px,y_px,x_m,y_m; then a point a line."


def _columns(path: Path, names: list[str]) -> tuple[dict[str, int], float]:
    units = [unit for unit in _UNITS if {f"x_{unit}", f"y_{unit}"} <= set(names)]
    if not {"x_px", "y_px"} <= set(names) or len(units) != 1:
        raise InputError(
            f"{path}: expected the columns x_px, y_px, x_m, y_m, got {', '.join(names)}.",
            hint=f"{_EXAMPLE} Centimetres (x_cm,y_cm) and millimetres will do.",
        )
    wanted = ["x_px", "y_px", f"x_{units[0]}", f"y_{units[0]}"]
    return {name: names.index(name) for name in wanted}, _UNITS[units[0]]


def _number(path: Path, line: int, row: list[str], place: int, name: str) -> float:
    text = row[place].strip() if place < len(row) else ""
    try:
        value = float(text)
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise InputError(
            f"{path}, line {line}, column {name}: expected a number, got {text!r}.",
            hint="Leave a point out that is not known.",
        )
    return value

"""Tracks of the older rig's software, CATS2: ``positions-*.txt`` and trajectory XML.

Text (CATS2, ``tracker/TrajectoryWriter.cpp``): tab-separated, ``timeStep``
(seconds since the program started, three decimals), then ``robot0X robot0Y
robot0Direction ... fish0X fish0Y fish0Direction ...`` in metres and radians;
NaN for an agent that is not seen. A position or direction that the tracker
marks invalid is written as its default, 0: exactly (0, 0) counts as missing here,
a direction of exactly 0 as unknown.

XML (``trajectory-convertor/main.cpp``): OpenCV storage with one ``polygon`` of
x y pairs in metres, one pair per frame, of one fish. Where the fish was lost the
last known position is written again: a pair that repeats the one before gets
confidence 0.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np

from zfcal.arrays import Floats
from zfcal.errors import InputError
from zfcal.readers.assemble import Imported, assemble
from zfcal.readers.clock import check_rate, frames_of
from zfcal.readers.options import ImportOptions
from zfcal.readers.raw import Grid, Rows
from zfcal.readers.text import Layout, TextTable, cell_error, header_of, numbers
from zfcal.readers.text import read_table as read_text
from zfcal.tracks import FISH, ROBOT

_COLUMN = re.compile(r"(robot|fish)(\d+)(X|Y|Direction)")


def read_cats(path: Path, options: ImportOptions) -> Imported:
    """Read tracks of CATS2, text or XML, in metres.

    Parameters
    ----------
    path
        ``positions-*.txt`` or a trajectory ``.xml``.
    options
        Times are taken from the text; an XML file is played at ``fps``.
    """
    rows = _xml_rows(path, options) if path.suffix.lower() == ".xml" else _text_rows(path, options)
    return assemble(path, rows, options)


def _text_rows(path: Path, options: ImportOptions) -> Rows:
    table, agents = _read_text(path)
    time_s = _times(table)
    start_s = float(time_s[0])
    check_rate(path, time_s, fps=options.fps)
    stacked = np.stack(
        [[numbers(table, f"{agent}{part}") for part in ("X", "Y", "Direction")] for agent in agents]
    )
    xyd = np.moveaxis(stacked, -1, 0)
    invalid = (xyd[..., 0] == 0) & (xyd[..., 1] == 0)
    xyd[invalid] = np.nan
    notes = [f"Times are counted from the first row, {start_s:g} s in the file."]
    if invalid.any():
        notes.append(f"{int(invalid.sum())} positions at exactly (0, 0) are taken as missing.")
    grid = Grid(
        xy=xyd[..., :2],
        frame=frames_of(path, time_s, options.fps),
        time_s=time_s - start_s,
        unit="m",
        heading_rad=np.where(xyd[..., 2] == 0, np.nan, xyd[..., 2]),
        names=agents,
        y_down=False,
        notes=tuple(notes),
    )
    rows = grid.rows()
    kinds = np.array([ROBOT if name.startswith("robot") else FISH for name in agents], np.int8)
    return replace(rows, kind=kinds[rows.agent])


def _read_text(path: Path) -> tuple[TextTable, tuple[str, ...]]:
    """Return the table and its agents, in the order of the columns."""
    header = header_of(path, "\t")
    found = [_COLUMN.fullmatch(name) for name in header]
    agents = tuple(dict.fromkeys(f"{m[1]}{m[2]}" for m in found if m))
    columns = tuple(f"{agent}{part}" for agent in agents for part in ("X", "Y", "Direction"))
    missing = [name for name in columns if name not in header]
    if header[0] != "timeStep" or not agents or missing:
        raise InputError(
            f"{path}, line 1: expected tab-separated columns timeStep, robot0X, robot0Y, "
            f"robot0Direction, ..., fish0X, fish0Y, fish0Direction, got {', '.join(header)[:200]}."
            + (f" {missing[0]} is missing." if missing else "")
        )
    layout = Layout(names=header, delimiter="\t", n_header=1, numeric=("timeStep", *columns))
    return read_text(path, layout), agents


def _times(table: TextTable) -> Floats:
    time_s = numbers(table, "timeStep")
    wrong = ~np.isfinite(time_s)
    wrong[1:] |= ~(np.diff(time_s) > 0)
    if wrong.any():
        row = int(np.argmax(wrong))
        before = f" after {time_s[row - 1]:.10g}" if row else ""
        expected, got = "a later time in each row", f"{time_s[row]:.10g}{before}"
        raise cell_error(table, "timeStep", row, expected=expected, got=got)
    return time_s


def _xml_rows(path: Path, options: ImportOptions) -> Rows:
    points = _polygon(path)
    held = np.zeros(len(points), dtype=np.bool_)
    held[1:] = (points[1:] == points[:-1]).all(axis=1)
    frame = np.arange(len(points))
    notes = [f"The file has no times: it is played at {options.fps:g} Hz."]
    if held.any():
        notes.append(
            f"{int(held.sum())} positions repeat the one before, as CATS2 writes them for a "
            "lost fish: their confidence is 0."
        )
    grid = Grid(
        xy=points[:, np.newaxis],
        frame=frame,
        time_s=frame / options.fps,
        unit="m",
        confidence=np.where(held, 0.0, 1.0)[:, np.newaxis],
        y_down=False,
        notes=tuple(notes),
    )
    return grid.rows()


def _polygon(path: Path) -> Floats:
    """Return the points of the XML file, shape (frame, 2)."""
    try:
        # The parser refuses entities that grow; it fetches nothing from elsewhere.
        root = ET.parse(path).getroot()  # noqa: S314
    except ET.ParseError as error:
        raise InputError(
            f"{path}: expected a whole XML file, got one that is cut off or is not XML ({error})."
        ) from error
    node = root.find("polygon") if root.tag == "opencv_storage" else None
    if node is None:
        raise InputError(
            f"{path}: expected <opencv_storage> with a <polygon> of x y pairs, got <{root.tag}>."
        )
    if root.find("excludedPolygons") is not None:
        raise InputError(f"{path}: expected a trajectory, got the map of a set-up.")
    cells = "".join(node.itertext()).split()
    try:
        values = np.array(cells, dtype=np.float64)
    except ValueError as error:
        raise InputError(f"{path}: expected numbers in <polygon>, got others ({error}).") from error
    if not values.size or values.size % 2:
        raise InputError(f"{path}: expected pairs x y in <polygon>, got {values.size} numbers.")
    return values.reshape(-1, 2)

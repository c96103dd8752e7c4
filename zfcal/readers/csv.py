"""CSV tracks, a row per agent and frame: the format to write for zfcal.

Columns: ``time_s`` or ``frame`` (or both), ``agent``, ``x_m, y_m`` or
``x_px, y_px``; ``kind`` (fish, robot; default fish), ``heading_rad`` and
``confidence`` if there are. An empty cell or NaN is a missing position.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Floats, Ints
from zfcal.errors import InputError
from zfcal.readers.assemble import EXTENT_LIMIT_M, Imported, assemble, scale_of
from zfcal.readers.clock import check_rate
from zfcal.readers.options import Idle, ImportOptions, without_confidence
from zfcal.readers.raw import Rows
from zfcal.readers.text import (
    Layout,
    TextTable,
    cell_error,
    header_of,
    labels,
    numbers,
    read_table,
    whole_numbers,
)
from zfcal.tracks import KINDS

_NUMERIC = ("time_s", "frame", "x_m", "y_m", "x_px", "y_px", "heading_rad", "confidence")
_TEXT = ("agent", "kind")

_EXPECTED = "time_s (or frame), agent, and x_m, y_m (or x_px, y_px)"

_UNIX_TIME_S = 1e8
_MAX_HEADING_RAD = 2 * np.pi + 1e-6


def read_csv(path: Path, options: ImportOptions) -> Imported:
    """Read CSV tracks.

    Parameters
    ----------
    path
        Comma-separated text with a header; ``.gz`` is unpacked.
    options
        ``columns`` renames, ``m_per_px`` chooses the columns in pixels.

    Raises
    ------
    InputError
        A column is missing, a cell is wrong (its line is named), times run
        backwards or at another rate, or x_m is not in metres.
    """
    table, unit, notes = _read(path, options)
    agent, names = _agents(table)
    time_s, frame = _clock(table, agent, options)
    x, y = (_finite(table, f"{axis}_{unit}") for axis in "xy")
    if unit == "m":
        _check_metres(table, x, y)
    rows = Rows(
        time_s=time_s,
        frame=frame,
        agent=agent,
        x=x,
        y=y,
        unit=unit,
        heading_rad=_headings(table),
        confidence=_confidences(table),
        kind=_kinds(table, agent),
        names=names,
        y_down=unit == "px",
        notes=notes,
        idle=_without_frames(path, table.layout.names, options),
    )
    return assemble(path, rows, options)


def check_csv(path: Path, options: ImportOptions) -> Idle:
    """Look at the header of CSV tracks alone, and return the options that take no effect.

    Raises
    ------
    InputError
        A column is missing, or the scale does not go with the unit.
    """
    names, unit = _columns(path, options)
    scale_of(path, unit, options)
    idle = _without_frames(path, names, options)
    return idle if "confidence" in names else {**idle, **without_confidence(path, options)}


def _without_frames(path: Path, names: tuple[str, ...], options: ImportOptions) -> Idle:
    """Return that ``first_frame``, if given, is idle in a file without frame numbers."""
    if options.first_frame is None or "frame" in names:
        return {}
    problem = InputError(
        f"{path}, line 1: first_frame = {options.first_frame} cannot take effect: expected a "
        f"column 'frame', got {', '.join(names)}.",
        hint="Leave --first-frame out: time_s says when each row is. Or name the column of frame "
        "numbers: --columns frame=NAME",
    )
    return {"first_frame": problem}


def _columns(path: Path, options: ImportOptions) -> tuple[tuple[str, ...], str]:
    """Return the columns, the known ones under our names, and the unit of positions."""
    header = header_of(path, ",")
    names = _renamed(path, header, options)
    unit = "px" if {"x_px", "y_px"} <= set(names) else "m"
    if {"x_m", "y_m"} <= set(names) and options.m_per_px is None:
        unit = "m"
    needed = {"agent", f"x_{unit}", f"y_{unit}"}
    if not ({"time_s", "frame"} & set(names) and needed <= set(names)):
        raise InputError(
            f"{path}, line 1: expected columns {_EXPECTED}, got {', '.join(header)}.",
            hint="Rename them in the file, or here: --columns agent=id,x_px=pos_x",
        )
    return names, unit


def _read(path: Path, options: ImportOptions) -> tuple[TextTable, str, tuple[str, ...]]:
    """Return the known columns under our names, the unit, and what was passed over."""
    names, unit = _columns(path, options)
    other = "m" if unit == "px" else "px"
    wanted = set(_NUMERIC + _TEXT) - {f"x_{other}", f"y_{other}"}
    layout = Layout(
        names=names,
        delimiter=",",
        n_header=1,
        numeric=tuple(name for name in names if name in wanted and name in _NUMERIC),
        text=tuple(name for name in names if name in _TEXT),
    )
    extra = [name or "(no name)" for name in names if name not in wanted]
    notes = (f"Columns that are not used: {', '.join(extra)}.",) if extra else ()
    return read_table(path, layout), unit, notes


def _renamed(path: Path, header: tuple[str, ...], options: ImportOptions) -> tuple[str, ...]:
    theirs_to_ours = {}
    for ours, theirs in options.columns:
        if ours not in _NUMERIC + _TEXT:
            raise InputError(
                f"Import option columns: {ours!r} is no column of tracks, expected one of "
                f"{', '.join(_NUMERIC + _TEXT)}."
            )
        if theirs not in header:
            raise InputError(
                f"{path}, line 1: expected a column {theirs!r} (for {ours}), got "
                f"{', '.join(header)}."
            )
        theirs_to_ours[theirs] = ours
    taken = set(theirs_to_ours.values())
    # A column that already has our name gives way to the one that a person names.
    kept = [f"{name} (not used)" if name in taken else name for name in header]
    return tuple(theirs_to_ours.get(name, kept[i]) for i, name in enumerate(header))


def _agents(table: TextTable) -> tuple[Ints, dict[int, str]]:
    """Return agent numbers; names that are no numbers are numbered in their order."""
    codes, found = labels(table, "agent")
    if "" in found:
        row = int(np.argmax(codes == found.index("")))
        raise cell_error(table, "agent", row, expected="an agent", got="nothing")
    numeric = [_whole(name) for name in found]
    numbered = [number for number in numeric if number is not None]
    if len(numbered) == len(found):
        return np.array(numbered, dtype=np.int64)[codes], {}
    order = {name: number for number, name in enumerate(sorted(set(found)))}
    agent = np.array([order[name] for name in found], dtype=np.int64)[codes]
    return agent, {number: name for name, number in order.items()}


def _whole(name: str) -> int | None:
    try:
        value = float(name)
    except ValueError:
        return None
    return int(value) if value.is_integer() and abs(value) < 2**53 else None


def _clock(table: TextTable, agent: Ints, options: ImportOptions) -> tuple[Floats, Ints]:
    """Return the time and frame of each row; each is told by the other if it is not there."""
    first = options.first_frame or 0
    if "time_s" not in table.columns:
        frame = whole_numbers(table, "frame") - first
        _check_order(table, "frame", agent, frame.astype(np.float64))
        if frame.min() < 0:
            row = int(np.argmin(frame))
            expected = f"a frame number of {first} or more"
            raise cell_error(table, "frame", row, expected=expected, got=str(frame[row] + first))
        return frame / options.fps, frame
    time_s = _times(table)
    _check_order(table, "time_s", agent, time_s)
    if "frame" in table.columns:
        frame = whole_numbers(table, "frame") - first
        _check_order(table, "frame", agent, frame.astype(np.float64))
        _check_frames(table, time_s, frame, options.fps)
        return time_s, frame
    check_rate(table.path, np.unique(time_s), fps=options.fps)
    frame = np.rint(time_s * options.fps).astype(np.int64)
    _check_spacing(table, agent, time_s, frame, fps=options.fps)
    return time_s, frame


def _times(table: TextTable) -> Floats:
    time_s = numbers(table, "time_s")
    wrong = ~((time_s >= 0) & (time_s < _UNIX_TIME_S))
    if wrong.any():
        row = int(np.argmax(wrong))
        got = f"{time_s[row]:.10g}"
        expected = "seconds since the start of the trial"
        raise cell_error(table, "time_s", row, expected=expected, got=got)
    return time_s


def _check_order(table: TextTable, name: str, agent: Ints, clock: Floats) -> None:
    """Refuse a clock that runs backwards within an agent's rows."""
    order = np.argsort(agent, kind="stable")
    back = (np.diff(agent[order]) == 0) & (np.diff(clock[order]) < 0)
    if back.any():
        row = int(order[1:][back].min())
        before = clock[order[int(np.flatnonzero(order == row)[0]) - 1]]
        expected = f"times of agent {agent[row]} that never run backwards"
        got = f"{clock[row]:.10g} after {before:.10g}"
        raise cell_error(table, name, row, expected=expected, got=got)


def _check_spacing(
    table: TextTable, agent: Ints, time_s: Floats, frame: Ints, *, fps: float
) -> None:
    """Tell two rows of an agent that share a time from two that share only a frame."""
    order = np.lexsort((time_s, agent))
    close = (np.diff(agent[order]) == 0) & (np.diff(frame[order]) == 0)
    if not close.any():
        return
    row = int(order[1:][close].min())
    before = time_s[order[int(np.flatnonzero(order == row)[0]) - 1]]
    expected = f"agent {agent[row]} once in frame {frame[row]} (at fps = {fps:.6g})"
    got = f"{before:.10g} s and {time_s[row]:.10g} s"
    raise cell_error(table, "time_s", row, expected=expected, got=got)


def _check_frames(table: TextTable, time_s: Floats, frame: Ints, fps: float) -> None:
    """Refuse a frame with two times, and times and frames that advance differently."""
    order = np.lexsort((time_s, frame))
    torn = (np.diff(frame[order]) == 0) & (np.diff(time_s[order]) > 0.5 / fps)
    if torn.any():
        row = int(order[1:][torn].min())
        expected, got = f"one time for frame {frame[row]}", f"another: {time_s[row]:.10g}"
        raise cell_error(table, "time_s", row, expected=expected, got=got)
    frames, first_rows = np.unique(frame, return_index=True)
    times = time_s[first_rows]
    back = np.diff(times) <= 0
    if back.any():
        row = int(first_rows[1 + int(np.argmax(back))])
        expected = f"a later time in frame {frame[row]} than in the one before"
        raise cell_error(table, "time_s", row, expected=expected, got=f"{time_s[row]:.10g}")
    check_rate(table.path, times, fps=fps, frame=frames)


def _finite(table: TextTable, name: str) -> Floats:
    values = numbers(table, name)
    infinite = np.isinf(values)
    if infinite.any():
        row = int(np.argmax(infinite))
        expected = "a finite number, or nothing where the agent is missing"
        raise cell_error(table, name, row, expected=expected, got=f"{values[row]:g}")
    return values


def _check_metres(table: TextTable, x: Floats, y: Floats) -> None:
    for name, values in (("x_m", x), ("y_m", y)):
        if np.isnan(values).all():
            continue
        low, high = np.nanmin(values), np.nanmax(values)
        if not high - low <= EXTENT_LIMIT_M:
            row = int(np.nanargmax(np.abs(values - np.nanmedian(values))))
            error = cell_error(
                table,
                name,
                row,
                expected=f"metres within a tank of {EXTENT_LIMIT_M:g} m",
                got=f"{values[row]:g}: the column spans {high - low:.4g}",
            )
            error.hint = (
                "That looks like pixels or millimetres: call the columns x_px, y_px and give "
                "--mm-per-px (1 for millimetres)."
            )
            raise error


def _headings(table: TextTable) -> Floats | None:
    if "heading_rad" not in table.columns:
        return None
    values = _finite(table, "heading_rad")
    wrong = np.abs(values) > _MAX_HEADING_RAD
    if wrong.any():
        row = int(np.argmax(wrong))
        expected = "radians within -2 pi to 2 pi"
        got = f"{values[row]:g} (degrees?)"
        raise cell_error(table, "heading_rad", row, expected=expected, got=got)
    return values


def _confidences(table: TextTable) -> Floats | None:
    if "confidence" not in table.columns:
        return None
    values = numbers(table, "confidence")
    wrong = (values < 0) | (values > 1)
    if wrong.any():
        row = int(np.argmax(wrong))
        raise cell_error(table, "confidence", row, expected="0 to 1", got=f"{values[row]:g}")
    return values


def _kinds(table: TextTable, agent: Ints) -> NDArray[np.int8] | None:
    if "kind" not in table.columns:
        return None
    codes, found = labels(table, "kind")
    unknown = [name for name in found if name not in KINDS]
    if unknown:
        row = int(np.argmax(codes == found.index(unknown[0])))
        got = repr(unknown[0]) if unknown[0] else "nothing"
        raise cell_error(table, "kind", row, expected=" or ".join(KINDS), got=got)
    kind = np.array([KINDS.index(name) for name in found], dtype=np.int8)[codes]
    pairs = np.unique(agent * len(KINDS) + kind) // len(KINDS)
    both = np.diff(pairs) == 0
    if both.any():
        changed = int(pairs[int(np.argmax(both))])
        row = int(np.flatnonzero((agent == changed) & (kind != kind[agent == changed][0]))[0])
        expected = f"agent {changed} to stay what it is"
        raise cell_error(table, "kind", row, expected=expected, got=KINDS[kind[row]])
    return kind

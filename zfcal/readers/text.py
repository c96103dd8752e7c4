"""Strict reading of delimited text: what is wrong is told by line and column.

A short row or a word among numbers is an error here; nothing is padded,
guessed or skipped, empty lines excepted.
"""

from __future__ import annotations

import csv
import gzip
import itertools
import zlib
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TextIO

import numpy as np
import pyarrow as pa
import pyarrow.csv as pa_csv

from zfcal.arrays import Floats, Ints
from zfcal.artifacts.arrays import array_of, numbers_of
from zfcal.artifacts.reading.limits import TABLE_BYTES, largest, too_large
from zfcal.errors import InputError

_MISSING = ("", "NaN", "nan", "NAN", "NA", "null", "None")
"""Cells that stand for a missing value."""

_NAMES = {",": "commas", "\t": "tabs", ";": "semicolons", "|": "bars"}
_BROKEN = (OSError, EOFError, zlib.error)
# Parsed without threads of pyarrow: one that is just starting when the process ends aborts it.
_ALONE_BYTES = 1 << 20
_PART_BYTES = 1 << 20

_LONGEST_LINE = 1 << 24
"""Letters: a header that names a hundred animals' body parts has some 100,000."""


def first_lines(path: Path, count: int) -> list[str]:
    """Return up to ``count`` first lines of a text file, without their ends.

    Raises
    ------
    InputError
        The file is empty, is no text, or is a damaged archive.
    """
    try:
        with _open(path) as file:
            lines = [_line_of(path, file) for _ in range(count)]
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: expected a text file in UTF-8, got other bytes.") from error
    except _BROKEN as error:
        raise InputError(f"{path}: cannot be read ({error}).") from error
    lines = [line.rstrip("\r\n") for line in lines if line]
    if not any(line.strip() for line in lines):
        raise InputError(f"{path}: the file is empty, expected a header line and rows.")
    if any("\0" in line for line in lines):
        raise InputError(f"{path}: expected a text file, got binary data.")
    return lines


def all_lines(path: Path) -> list[tuple[int, str]]:
    """Return the lines of a text file that are not empty, without their ends, by number from 1.

    Raises
    ------
    InputError
        As of `first_lines`.
    """
    first_lines(path, 1)
    try:
        with _open(path) as file:
            lines = [(k, line.rstrip("\r\n")) for k, line in enumerate(file, start=1)]
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: expected a text file in UTF-8, got other bytes.") from error
    except _BROKEN as error:
        raise InputError(f"{path}: cannot be read ({error}).") from error
    return [(k, line) for k, line in lines if line.strip()]


def check_unpacked(path: Path) -> None:
    """Refuse a compressed text that unpacks to more than a table may have.

    What is damaged is passed: whoever reads it says what is wrong.

    Raises
    ------
    DamagedError
        It is too large.
    """
    if path.suffix != ".gz":
        return
    most, size = largest(TABLE_BYTES), 0
    with suppress(*_BROKEN), gzip.open(path, "rb") as file:
        while size <= most and (part := file.read(_PART_BYTES)):
            size += len(part)
    if size > most:
        raise too_large(path, size, most, unpacked=True)


def _line_of(path: Path, file: TextIO) -> str:
    """Return the next line with its end; '' where there is none."""
    line = file.readline(_LONGEST_LINE)
    if len(line) == _LONGEST_LINE:
        message = f"{path}: expected lines of text, got one of more than {_LONGEST_LINE} letters."
        raise InputError(message)
    return line


def header_of(path: Path, delimiter: str) -> tuple[str, ...]:
    """Return the names in the first line; a wrong delimiter is told apart."""
    line = first_lines(path, 1)[0]
    names = tuple(name.strip() for name in next(csv.reader([line], delimiter=delimiter), []))
    for other, called in _NAMES.items():
        if len(names) == 1 and other != delimiter and other in names[0]:
            raise InputError(
                f"{path}, line 1: expected columns separated by {_NAMES[delimiter]}, "
                f"got {called}: {line[:60]!r}.",
                hint="Export the file again, with a point as the decimal mark.",
            )
    return names


@dataclass(frozen=True, slots=True, kw_only=True)
class Layout:
    """How a text file is laid out, and what of it is wanted.

    Parameters
    ----------
    names
        Names of the columns. A last, empty name stands for the delimiter that
        some programs put at the end of a line; rows need not have it.
    delimiter
        What separates cells.
    n_header
        Lines to leave out at the start.
    numeric, text
        Columns to read, as numbers and as text; the others are passed over.
    """

    names: tuple[str, ...]
    delimiter: str
    n_header: int
    numeric: tuple[str, ...]
    text: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class TextTable:
    """The wanted columns of a delimited text file.

    Parameters
    ----------
    path
        The file; compressed when it ends in ``.gz``.
    layout
        How it was read.
    columns
        Arrow columns by name.
    """

    path: Path
    layout: Layout
    columns: Mapping[str, Any]


def read_table(path: Path, layout: Layout) -> TextTable:
    """Read the wanted columns of a delimited text file.

    Raises
    ------
    InputError
        A row has another number of cells, a number is none, a name is there
        twice, or there is no row: each with its line.
    """
    names = _without_tail(path, layout)
    repeated = [name for i, name in enumerate(names) if name and name in names[:i]]
    if repeated:
        raise InputError(f"{path}, line {layout.n_header}: column {repeated[0]!r} is there twice.")
    types = {name: pa.float64() for name in layout.numeric}
    types |= {name: pa.string() for name in layout.text}
    try:
        table = pa_csv.read_csv(
            str(path),
            read_options=pa_csv.ReadOptions(
                skip_rows=layout.n_header,
                column_names=list(names),
                use_threads=path.stat().st_size > _ALONE_BYTES,
            ),
            parse_options=pa_csv.ParseOptions(delimiter=layout.delimiter),
            convert_options=pa_csv.ConvertOptions(
                column_types=types,
                include_columns=list(types),
                null_values=list(_MISSING),
                strings_can_be_null=True,
            ),
        )
    except (pa.ArrowInvalid, *_BROKEN) as error:
        raise _why(path, layout, names, str(error)) from error
    if table.num_rows == 0:
        raise _no_rows(path)
    columns = dict(zip(table.column_names, table.columns, strict=True))
    return TextTable(path=path, layout=layout, columns=columns)


def numbers(table: TextTable, name: str) -> Floats:
    """Return a column as float64; NaN where a cell is empty or says so."""
    return np.asarray(numbers_of(table.columns[name]), dtype=np.float64)


def whole_numbers(table: TextTable, name: str) -> Ints:
    """Return a column as int64; an empty cell or a fraction is an error with its line."""
    values = numbers(table, name)
    wrong = ~(np.abs(values) < 2.0**53) | (values != np.round(values))
    if wrong.any():
        row = int(np.argmax(wrong))
        raise cell_error(table, name, row, expected="a whole number", got=_shown(values[row]))
    return values.astype(np.int64)


def labels(table: TextTable, name: str) -> tuple[Ints, tuple[str, ...]]:
    """Return for each row the place of its text in the list of texts that occur.

    An empty cell is the text ''.
    """
    nothing = array_of([""], pa.string())[0]
    column = table.columns[name].cast(pa.string()).fill_null(nothing)
    coded = column.combine_chunks().dictionary_encode()
    if isinstance(coded, pa.ChunkedArray):
        coded = coded.combine_chunks()
    found = tuple(str(value).strip() for value in coded.dictionary.to_pylist())
    return np.asarray(numbers_of(coded.indices), dtype=np.int64), found


def cell_error(table: TextTable, name: str, row: int, *, expected: str, got: str) -> InputError:
    """Return the error for one cell, by its line in the file and its column."""
    rows = _rows(table.path, table.layout)
    line = next(itertools.islice(rows, row, None), (table.layout.n_header + row + 1, []))[0]
    return InputError(f"{table.path}, line {line}, column {name}: expected {expected}, got {got}.")


def _open(path: Path) -> TextIO:
    if path.suffix == ".gz":
        return gzip.open(path, "rt", encoding="utf-8-sig", newline="")
    return path.open(encoding="utf-8-sig", newline="")


def _rows(path: Path, layout: Layout) -> Iterator[tuple[int, list[str]]]:
    """Go through the rows with their line numbers; slow, for messages only."""
    with _open(path) as file:
        reader = csv.reader(file, delimiter=layout.delimiter)
        for cells in reader:
            if cells and reader.line_num > layout.n_header:
                yield reader.line_num, cells


def _without_tail(path: Path, layout: Layout) -> tuple[str, ...]:
    """Keep an empty last name if the rows have that cell, and drop it if they do not."""
    names = layout.names
    if not names or names[-1]:
        return names
    lines = [line for line in first_lines(path, layout.n_header + 20)[layout.n_header :] if line]
    if not lines:
        raise _no_rows(path)
    cells = next(csv.reader([lines[0]], delimiter=layout.delimiter))
    return names if len(cells) >= len(names) else names[:-1]


def _why(path: Path, layout: Layout, names: tuple[str, ...], reason: str) -> InputError:
    """Find the first row that is wrong; else pass on what the library says."""
    if "Empty CSV file" in reason:
        return _no_rows(path)
    try:
        for line, cells in _rows(path, layout):
            if len(cells) != len(names):
                shown = layout.delimiter.join(cells)[:60]
                return InputError(
                    f"{path}, line {line}: expected {len(names)} cells, got {len(cells)}: "
                    f"{shown!r}.",
                    hint="The file may have been cut short, or a cell holds the delimiter.",
                )
            for name in layout.numeric:
                cell = cells[names.index(name)].strip()
                if cell not in _MISSING and not _is_number(cell):
                    return InputError(
                        f"{path}, line {line}, column {name}: expected a number, got {cell[:40]!r}."
                    )
    except (*_BROKEN, UnicodeDecodeError, csv.Error) as error:
        return InputError(f"{path}: cannot be read whole ({error}).")
    return InputError(f"{path}: cannot be read ({reason}).")


def _no_rows(path: Path) -> InputError:
    return InputError(
        f"{path}: there is a header but no row below it, expected a row per agent and frame."
    )


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return "_" not in cell


def _shown(value: float) -> str:
    return "nothing" if np.isnan(value) else f"{value:g}"

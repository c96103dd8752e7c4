"""The forms of the tables, as their schema files describe them, and whether a table fits.

Opens no file of a trial: see `tables`.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from zfcal.artifacts.arrays import array_of, dictionary_of, numbers_of
from zfcal.errors import InputError

_TYPES: dict[str, pa.DataType] = {
    "float64": pa.float64(),
    "float32": pa.float32(),
    "int64": pa.int64(),
    "int32": pa.int32(),
    "string": pa.string(),
    "dictionary": pa.dictionary(pa.int8(), pa.string()),
    "list<float64>": pa.list_(pa.float64()),
}
TABLE_SCHEMAS = (
    "zfcal.tracks/1", "zfcal.stats/1", "zfcal.following/1", "zfcal.scores/1", "zfcal.rules/1",
    "zfcal.population/1",
)  # fmt: skip
"""Names of the schemas that tables can have."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Column:
    """One column of a table.

    Parameters
    ----------
    name, type, says
        Its name, its Arrow type, and what it means, with its unit.
    null, nan
        Whether a value may be null, or NaN.
    minimum, maximum
        Limits that a value may touch; None for none.
    values
        All that may stand there; empty for anything.
    """

    name: str
    type: str
    says: str
    null: bool = False
    nan: bool = False
    minimum: float | None = None
    maximum: float | None = None
    values: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Form:
    """The form of a table: what a file in ``schemas/`` says of it.

    Parameters
    ----------
    schema, title, says, made_by
        Name and version, a heading, what a row is, and the command that makes it.
    columns
        Its columns in order.
    sorted_by
        The columns by which the rows ascend; empty for any order.
    unique
        Whether no two rows may agree in them.
    """

    schema: str
    title: str
    says: str
    made_by: str
    columns: tuple[Column, ...]
    sorted_by: tuple[str, ...] = ()
    unique: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns, in order."""
        return tuple(column.name for column in self.columns)

    def arrow(self) -> pa.Schema:
        """Return the Arrow schema, without metadata."""
        return pa.schema([(column.name, _TYPES[column.type]) for column in self.columns])


@cache
def form_of(schema: str) -> Form:
    """Return the form of the tables of one schema, such as ``zfcal.tracks/1``."""
    if schema not in TABLE_SCHEMAS:
        raise InputError(
            f"{schema!r} is no schema of a table.", hint=f"There are {', '.join(TABLE_SCHEMAS)}."
        )
    name = schema.removeprefix("zfcal.").partition("/")[0]
    text = (files("zfcal.schemas") / f"{name}.arrow.json").read_text(encoding="utf-8")
    document: dict[str, Any] = json.loads(text)
    columns = tuple(
        Column(**{**column, "values": tuple(column.get("values", ()))})
        for column in document.pop("columns")
    )
    sorted_by = tuple(document.pop("sorted_by", ()))
    return Form(**document, columns=columns, sorted_by=sorted_by)


def make_table(schema: str, columns: Mapping[str, Any]) -> pa.Table:
    """Return a table of one schema from a value per row and column.

    Parameters
    ----------
    schema
        Such as ``zfcal.scores/1``.
    columns
        For each column a sequence or array; None is null, and so is NaN where
        a column may be null and not NaN.

    Raises
    ------
    InputError
        A column is missing, unknown, of another length or not of its type.
    """
    form = form_of(schema)
    problem = _names_problem(form, list(columns))
    if problem:
        raise InputError(f"A table of {schema} cannot be made: {problem}.")
    try:
        made = [_array(column, columns[column.name]) for column in form.columns]
        return pa.Table.from_arrays(made, schema=form.arrow())
    except (pa.ArrowException, ValueError, TypeError) as error:
        raise InputError(f"A table of {schema} cannot be made: {error}.") from error


def problem_of(table: pa.Table, form: Form) -> str | None:
    """Return what is wrong with a table, in words; None if it has the form.

    The columns may stand in any order.
    """
    problem = _names_problem(form, table.column_names)
    if problem:
        return problem
    for column in form.columns:
        problem = _column_problem(table.column(column.name), column)
        if problem:
            return f"column {column.name!r} {problem}"
    problem = _order_problem(table, form)
    if problem is None and form.schema.startswith("zfcal.tracks/"):
        problem = _clock_problem(table)
    return problem


def _array(column: Column, values: Any) -> pa.Array:
    kind = _TYPES[column.type]
    from_arrow = isinstance(values, pa.Array | pa.ChunkedArray)
    if column.type == "dictionary":
        try:
            return dictionary_of(values.to_pylist() if from_arrow else values, column.values)
        except ValueError as error:
            message = f"column {column.name!r} holds {error}"
            raise ValueError(message) from error
    if from_arrow:
        return values.cast(kind)
    return array_of(values, kind, nan_is_null=column.null and not column.nan)


def _names_problem(form: Form, names: Sequence[str]) -> str | None:
    missing = [name for name in form.names if name not in names]
    surplus = [name for name in names if name not in form.names]
    if missing:
        got = ", ".join(names) or "none"
        return f"column {missing[0]!r} is missing (expected {', '.join(form.names)}; got {got})"
    if surplus:
        return f"column {surplus[0]!r} is unknown (expected {', '.join(form.names)})"
    return "two columns have one name" if len(set(names)) < len(names) else None


def _column_problem(values: pa.ChunkedArray, column: Column) -> str | None:
    wanted = _TYPES[column.type]
    # Parquet keeps the values of a dictionary, not always their order or the width of its codes.
    same = pa.types.is_dictionary(values.type) if column.type == "dictionary" else False
    if not same and values.type != wanted:
        return f"is of type {values.type}, expected {wanted}"
    if values.null_count and not column.null:
        row = pc.index(pc.is_null(values), True).as_py()
        return f"is empty in row {row}, where a value is needed"
    if column.values:
        return _unknown_value(values, column)
    if pa.types.is_string(values.type):
        return None
    if pa.types.is_list(values.type):
        values = pc.list_flatten(values)
        if values.null_count:
            return "holds a list with an empty place"
    return _number_problem(values, column)


def _unknown_value(values: pa.ChunkedArray, column: Column) -> str | None:
    for value in pc.unique(values.cast(pa.string())).to_pylist():
        if value not in column.values and value is not None:
            return f"holds {value!r}, expected one of {', '.join(column.values)}"
    return None


def _number_problem(values: pa.ChunkedArray | pa.Array, column: Column) -> str | None:
    numbers = numbers_of(pc.drop_null(values))
    wrong = ~_allowed(numbers, column)
    if not wrong.any():
        return None
    place = int(np.argmax(wrong))
    known = pc.is_valid(values).to_numpy(zero_copy_only=False)
    row = int(np.flatnonzero(known)[place])
    limits = [
        f"{word} {limit:g}"
        for word, limit in (("at least", column.minimum), ("at most", column.maximum))
        if limit is not None
    ]
    expected = " and ".join(limits) or "a finite number"
    return f"is {numbers[place]} in row {row}, expected {expected}"


def _allowed(numbers: np.ndarray[Any, Any], column: Column) -> np.ndarray[Any, Any]:
    """Tell where a number keeps the column's limits; NaN keeps none."""
    if numbers.dtype.kind == "f":
        allowed = np.isfinite(numbers)
    else:
        allowed = np.ones(numbers.shape, dtype=bool)
    if column.minimum is not None:
        allowed &= numbers >= column.minimum
    if column.maximum is not None:
        allowed &= numbers <= column.maximum
    if column.nan:
        allowed |= np.isnan(numbers)
    return np.asarray(allowed)


def _order_problem(table: pa.Table, form: Form) -> str | None:
    if not form.sorted_by or table.num_rows < 2:
        return None
    keys = [numbers_of(table.column(name)) for name in form.sorted_by]
    falls = np.zeros(table.num_rows - 1, dtype=bool)
    ties = np.ones(table.num_rows - 1, dtype=bool)
    for key in keys:
        falls |= ties & (key[1:] < key[:-1])
        ties &= key[1:] == key[:-1]
    by = ", then ".join(form.sorted_by)
    if falls.any():
        return f"row {int(np.argmax(falls)) + 1} breaks the order (rows are sorted by {by})"
    if form.unique and ties.any():
        row = int(np.argmax(ties)) + 1
        return f"row {row} repeats the {' and the '.join(form.sorted_by)} of the row before"
    return None


def _clock_problem(table: pa.Table) -> str | None:
    """Check that all rows of a frame have one time, and that later frames have later times."""
    time_s, frame = (numbers_of(table.column(name)) for name in ("time_s", "frame"))
    same = np.diff(frame) == 0
    step = np.diff(time_s)
    wrong = np.where(same, step != 0, step <= 0)
    if not wrong.any():
        return None
    row = int(np.argmax(wrong)) + 1
    return (
        f"time_s is {time_s[row]} at frame {frame[row]} (row {row}), after {time_s[row - 1]} "
        f"at frame {frame[row - 1]}: time must rise with the frame"
    )

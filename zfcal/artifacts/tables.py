"""Tables as Parquet files: the same table and lineage, the same bytes.

What the columns are stands in the files of ``schemas/``; see `columns`.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from zfcal.artifacts.arrays import numbers_of
from zfcal.artifacts.atomic import write_whole
from zfcal.artifacts.columns import TABLE_SCHEMAS, form_of, make_table, problem_of
from zfcal.artifacts.lineage import JSON, LINEAGE_KEY, Lineage, first_line, to_json
from zfcal.artifacts.reading.contents import read_bytes
from zfcal.artifacts.reading.limits import TABLE_BYTES, TABLE_ROWS, largest, too_large
from zfcal.artifacts.reading.opening import open_regular, unreadable
from zfcal.artifacts.reading.parsing import json_of
from zfcal.errors import DamagedError, InputError, SchemaError
from zfcal.tracks import KINDS, Tracks

__all__ = [
    "TABLE_SCHEMAS",
    "make_table",
    "read_extra",
    "read_table",
    "read_tracks",
    "write_table",
    "write_tracks",
]

TRACKS = "zfcal.tracks/1"
STATS = "zfcal.stats/1"
FOLLOWING = "zfcal.following/1"
SCORES = "zfcal.scores/1"
RULES = "zfcal.rules/1"
POPULATION = "zfcal.population/1"
EXPORT = "zfcal.export/1"
"""Of what is written for other programs: files of any form, by their sidecar."""

_EXTRA_KEY = b"zfcal.extra"
_MAGIC = b"PAR1"


def write_table(
    path: Path, table: pa.Table, lineage: Lineage, *, extra: Mapping[str, JSON] | None = None
) -> None:
    """Write a table whole, or not at all.

    Parameters
    ----------
    path
        Where it goes.
    table
        Of the form that ``lineage.schema`` names; see `make_table`.
    lineage
        Where it comes from.
    extra
        Further metadata, read back by `read_extra`.

    Raises
    ------
    InputError
        The table has not that form.
    StorageError
        The file cannot be written.
    """
    form = form_of(lineage.schema)
    problem = problem_of(table, form)
    if problem:
        raise InputError(f"{path}: not written, not a table of {form.schema}: {problem}.")
    metadata = {LINEAGE_KEY.encode(): to_json(lineage.as_dict()).encode()}
    if extra:
        metadata[_EXTRA_KEY] = to_json(extra).encode()
    whole = table.select(form.names).combine_chunks().replace_schema_metadata(metadata)
    write_whole(path, lambda part: _write_parquet(part, whole), parents=False)


def _write_parquet(part: Path, table: pa.Table) -> None:
    # Through a file object of Python's: its errors carry their number, as StorageError needs.
    with part.open("wb") as file:
        pq.write_table(table, file, version="2.6", compression="zstd", write_page_checksum=True)


def read_table(path: Path, schema: str) -> pa.Table:
    """Read a table and check that it is whole and of one schema.

    Parameters
    ----------
    path
        A Parquet file.
    schema
        The schema that it must have, such as ``zfcal.tracks/1``.

    Returns
    -------
    pyarrow.Table
        Its columns in the schema's order.

    Raises
    ------
    InputError
        The file is missing or cannot be opened.
    DamagedError
        It is cut short, no Parquet, or its content breaks the schema's rules.
    SchemaError
        It was written with another schema, or another version.
    """
    form = form_of(schema)
    hint = f"Make it again with: {form.made_by} --force; or copy it again from where it was made."
    table = read_parquet(path, hint)
    found = schema_of(table)
    if found != schema:
        raise SchemaError(path, found=found, wanted=schema)
    problem = problem_of(table, form)
    if problem:
        raise DamagedError(f"{path}: {problem}.", hint=hint)
    return table.select(form.names)


def read_extra(path: Path) -> dict[str, JSON]:
    """Return the further metadata of a table; empty if there is none.

    Raises
    ------
    InputError, DamagedError
        As `read_table`.
    """
    _check_ends(path, "Make it again.")
    try:
        metadata = pq.ParquetFile(pa.py_buffer(read_bytes(path))).metadata.metadata or {}
        extra: dict[str, JSON] = json_of(metadata.get(_EXTRA_KEY, b"{}"))
    except (pa.ArrowException, OSError, ValueError, MemoryError) as error:
        raise DamagedError(f"{path}: cannot be read whole ({first_line(error)}).") from error
    return extra


def write_tracks(
    path: Path, tracks: Tracks, lineage: Lineage, *, extra: Mapping[str, JSON] | None = None
) -> None:
    """Write tracks as a table of ``zfcal.tracks/1``; errors as in `write_table`."""
    columns = {name: getattr(tracks, name) for name in form_of(TRACKS).names}
    columns["kind"] = np.array(KINDS, dtype=object)[tracks.kind]
    write_table(path, make_table(TRACKS, columns), lineage, extra=extra)


def read_tracks(path: Path) -> Tracks:
    """Read tracks from a table of ``zfcal.tracks/1``; errors as in `read_table`."""
    table = read_table(path, TRACKS).combine_chunks()
    kinds = table.column("kind").combine_chunks().dictionary_encode()
    # The file may know the kinds in another order.
    codes = [KINDS.index(kind) for kind in kinds.dictionary.to_pylist()]
    kind = np.array(codes, dtype=np.int8)[numbers_of(kinds.indices)]
    names = [name for name in table.column_names if name != "kind"]
    columns = {name: numbers_of(table.column(name)) for name in names}
    return Tracks(kind=kind, **columns)


def read_parquet(path: Path, hint: str) -> pa.Table:
    """Read any Parquet file, whatever it holds; errors as in `read_table`, with a hint."""
    _check_ends(path, hint)
    try:
        # From memory: reading a file itself, pyarrow starts a thread even where it is told not to,
        # and a process that then ends at once is aborted now and then (apache/arrow issue 34314).
        source = pa.py_buffer(read_bytes(path))
        # Not read_table: it loads pyarrow.dataset and with it pandas, a fifth of a second.
        whole = pq.ParquetFile(source, page_checksum_verification=True)
        _check_claims(path, whole.metadata, hint)
        return whole.read(use_threads=False)
    except (
        pa.ArrowException,
        OSError,
        ValueError,
        KeyError,
        NotImplementedError,
        MemoryError,
    ) as error:
        raise DamagedError(f"{path}: is damaged ({first_line(error)}).", hint=hint) from error


def _check_claims(path: Path, metadata: Any, hint: str) -> None:
    """Refuse a table that says of itself that it is beyond all measure, before it is unpacked."""
    groups = [metadata.row_group(number) for number in range(metadata.num_row_groups)]
    rows = max(metadata.num_rows, sum(group.num_rows for group in groups))
    if not 0 <= rows <= TABLE_ROWS:
        raise DamagedError(f"{path}: claims {rows} rows, expected at most {TABLE_ROWS}.", hint=hint)
    sizes = [
        group.column(number).total_uncompressed_size
        for group in groups
        for number in range(group.num_columns)
    ]
    most = largest(TABLE_BYTES)
    if min(sizes, default=0) < 0 or sum(sizes) > most:
        raise too_large(path, sum(sizes), most)


def _check_ends(path: Path, hint: str) -> None:
    """Tell an empty, a foreign and a cut file apart: the library calls them all invalid."""
    try:
        with open_regular(path) as file:
            head = file.read(4)
            size = file.seek(0, 2)
            file.seek(max(size - 4, 0))
            tail = file.read(4)
    except OSError as error:
        raise unreadable(path, error) from error
    if size == 0:
        raise DamagedError(f"{path}: the file is empty (0 bytes).", hint=hint)
    if head != _MAGIC:
        raise DamagedError(
            f"{path}: is not a Parquet file (it starts with {head!r}).",
            hint="Move it out of the trial; foreign tracks come in with: zfcal import SRC TRIAL",
        )
    if tail != _MAGIC or size < 12:
        raise DamagedError(
            f"{path}: was cut short ({size} bytes, and the footer is missing).", hint=hint
        )


def schema_of(table: pa.Table) -> str:
    """Return the schema that a table's lineage names, or words for why there is none."""
    text = (table.schema.metadata or {}).get(LINEAGE_KEY.encode())
    if text is None:
        return "none: it carries no lineage"
    try:
        return str(json_of(text)["schema"])
    except (ValueError, KeyError, TypeError):
        return "none: its lineage is damaged"

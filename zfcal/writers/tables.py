"""Tidy tables as CSV and as Parquet: a row for each observation, units in the columns' names."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from zfcal.artifacts.lineage import LINEAGE_KEY, Lineage, to_json


def write_csv(path: Path, table: pd.DataFrame) -> None:
    """Write a table as comma-separated text: numbers in full, what is missing empty.

    Parameters
    ----------
    path
        Where it goes.
    table
        Of tracks it is what `zfcal.readers.csv` reads.
    """
    with path.open("w", encoding="utf-8", newline="") as file:
        table.to_csv(file, index=False, lineterminator="\n")


def write_parquet(path: Path, table: pd.DataFrame, lineage: Lineage) -> None:
    """Write a table as Parquet, with where it comes from and pandas' own metadata.

    Parameters
    ----------
    path
        Where it goes.
    table
        With columns of numbers, words and truth.
    lineage
        Where it comes from.
    """
    whole = pa.Table.from_pandas(table, preserve_index=False)
    told = {LINEAGE_KEY.encode(): to_json(lineage.as_dict()).encode()}
    whole = whole.replace_schema_metadata({**(whole.schema.metadata or {}), **told})
    with path.open("wb") as file:
        pq.write_table(whole, file, version="2.6", compression="zstd", write_page_checksum=True)

"""The tables of a trial as CSV or Parquet: tracks, and what was made of them."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

import pandas as pd

from zfcal.artifacts.lineage import Lineage
from zfcal.errors import DamagedError, InputError
from zfcal.frames import TABLES, TrialTables
from zfcal.stages.export.manifest import SCHEMA, Content, Place, exported
from zfcal.stages.export.options import ExportOptions
from zfcal.stages.segments import readable
from zfcal.stages.stage import Item, Run
from zfcal.stages.track_window import noise_of
from zfcal.writers.losses import lost_noise, noise_option
from zfcal.writers.tables import write_csv, write_parquet

_TRACKS = "tracks"


def tables_item(run: Run, name: str, options: ExportOptions) -> Item:
    """Return the export of all tables that a trial has.

    Parameters
    ----------
    run
        On which trial.
    name
        ``csv`` or ``parquet``.
    options
        Where it goes.

    Raises
    ------
    InputError
        The trial has nothing yet.
    """
    tables = TrialTables(run.root)
    files = {table: tables.files(table) for table in TABLES}
    if not any(files.values()):
        raise InputError(
            f"{run.root}: there is nothing to export.", hint=f"First: zfcal track {run.root}"
        )
    inputs = readable([path for paths in files.values() for path in paths], run.tell)
    lineage = run.lineage(SCHEMA, inputs, options={"format": name})
    place = Place(root=run.root, name=name, folder=options.folder, reads="tracks.csv")
    wanted = [table for table, paths in files.items() if set(paths) & set(inputs)]
    names = [f"{table}.{name}" for table in wanted]
    return exported(run, place, lineage, lambda: _content(run.root, name, wanted), names)


def _content(root: Path, name: str, wanted: list[str]) -> Content:
    left_out: list[str] = []
    tables = TrialTables(root, on_damage=lambda error: left_out.append(str(error)))
    found = {table: _read(tables, table, left_out) for table in wanted}
    frames = {table: frame for table, frame in found.items() if frame is not None}
    noise_m = _noise(tables) if _TRACKS in frames else None
    noise = noise_option(noise_m)
    return Content(
        files={f"{table}.{name}": _writer(name, frame) for table, frame in frames.items()},
        lost=tuple(lost_noise(noise_m)),
        read_back=("--format", "csv", *noise) if name == "csv" and _TRACKS in frames else (),
        left_out=tuple(left_out),
    )


def _read(tables: TrialTables, table: str, left_out: list[str]) -> pd.DataFrame | None:
    """Return a table; None where all of its files are damaged."""
    n_before = len(left_out)
    try:
        frame: pd.DataFrame = getattr(tables, table)()
    except DamagedError as error:
        left_out.append(str(error))
        return None
    except InputError:
        # Nothing is left to read: that was told of each file.
        if len(left_out) == n_before:
            raise
        return None
    return frame


def _noise(tables: TrialTables) -> float | None:
    whole = []
    for path in tables.files(_TRACKS):
        try:
            noise_of([path])
        except (DamagedError, InputError):
            continue
        whole.append(path)
    return noise_of(whole)


def _writer(name: str, frame: pd.DataFrame) -> Callable[[Path, Lineage], None]:
    if name == "parquet":
        return lambda path, lineage: write_parquet(path, frame, lineage)
    return partial(_as_csv, frame)


def _as_csv(frame: pd.DataFrame, path: Path, _: Lineage) -> None:
    write_csv(path, frame)

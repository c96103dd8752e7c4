"""Tracks of DeepLabCut (and Lightning Pose): csv and HDF5, one animal or several.

DeepLabCut writes a pandas table: columns ``scorer``, ``individuals`` (with
several animals), ``bodyparts``, ``coords`` (x, y, likelihood), in pixels; a row
per frame, numbered from 0. As csv the names stand in the first lines; as HDF5 it
is the table ``df_with_missing``, as pandas stores it. Body parts that belong to no
animal (the corners of a tank) are those of the individual ``single``.

The HDF5 file is read without PyTables, which would run the pickles in it.
"""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Floats, Ints
from zfcal.errors import InputError
from zfcal.readers.assemble import Imported, assemble
from zfcal.readers.extras import dataset, open_hdf5, texts
from zfcal.readers.options import ImportOptions
from zfcal.readers.pickles import load_plain
from zfcal.readers.poses import Poses, choose
from zfcal.readers.text import (
    Layout,
    first_lines,
    numbers,
    read_table,
    whole_numbers,
)

_KEY = "df_with_missing"

_SINGLE = "single"
"""The individual that holds body parts of no animal."""

_Column = tuple[str, ...]
"""Scorer, individual (with several animals), body part, coordinate."""


def read_deeplabcut(path: Path, options: ImportOptions) -> Imported:
    """Read poses of DeepLabCut, in pixels.

    Parameters
    ----------
    path
        ``.csv`` (or ``.csv.gz``) or ``.h5``.
    options
        Needs ``m_per_px``, and ``keypoint`` when there are several body parts.
        The likelihood becomes the confidence: ``min_confidence`` drops guesses.
    """
    text = Path(path.name.removesuffix(".gz")).suffix == ".csv"
    frame, columns, values = _read_csv(path) if text else _read_h5(path)
    poses = replace(_poses(path, frame, columns, values), time_s=frame / options.fps)
    return assemble(path, choose(path, poses, options).rows(), options)


def _poses(path: Path, frame: Ints, columns: Sequence[_Column], values: Floats) -> Poses:
    """Sort the columns by individual and body part."""
    if values.shape != (len(frame), len(columns)):
        raise InputError(
            f"{path}: expected {len(frame)} rows of {len(columns)} values, got {values.shape}."
        )
    several = len(columns[0]) == 4
    found = {
        (column[1] if several else "", column[-2], column[-1]): place
        for place, column in enumerate(columns)
    }
    if any(coord == "z" for _, _, coord in found):
        raise InputError(f"{path}: expected poses in two dimensions, got x, y and z.")
    agents = tuple(dict.fromkeys(agent for agent, _, _ in found))
    notes: tuple[str, ...] = ()
    if _SINGLE in agents and len(agents) > 1:
        agents = tuple(agent for agent in agents if agent != _SINGLE)
        notes = ("Body parts of no animal (individual 'single') are not used.",)
    keypoints = tuple(dict.fromkeys(part for agent, part, _ in found if agent in agents))
    cube = np.full((len(frame), len(agents), len(keypoints), 3), np.nan)
    for (agent, part, coord), place in found.items():
        if agent in agents and coord in {"x", "y", "likelihood"}:
            at = ("x", "y", "likelihood").index(coord)
            cube[:, agents.index(agent), keypoints.index(part), at] = values[:, place]
    return Poses(
        position=cube[..., :2],
        score=cube[..., 2],
        frame=frame,
        time_s=frame.astype(np.float64),
        agents=agents if several else (),
        keypoints=keypoints,
        notes=notes,
    )


def _read_csv(path: Path) -> tuple[Ints, list[_Column], Floats]:
    lines = first_lines(path, 4)
    heads = [next(csv.reader([line]), []) or [""] for line in lines]
    levels = ["scorer", "individuals", "bodyparts", "coords"]
    if len(heads) > 1 and heads[1][0] == "bodyparts":
        levels.remove("individuals")
    first = [head[0] for head in heads[: len(levels)]]
    if first != levels or len({len(head) for head in heads[: len(levels)]}) != 1:
        raise InputError(
            f"{path}, line 1: expected lines that start with {', '.join(levels)}, got "
            f"{', '.join(first)}."
        )
    columns = [tuple(names) for names in zip(*(h[1:] for h in heads[: len(levels)]), strict=True)]
    names = ("frame", *("/".join(column) for column in columns))
    layout = Layout(names=names, delimiter=",", n_header=len(levels), numeric=names)
    table = read_table(path, layout)
    values = np.stack([numbers(table, name) for name in names[1:]], axis=-1)
    return _ascending(path, whole_numbers(table, "frame")), columns, values


def _read_h5(path: Path) -> tuple[Ints, list[_Column], Floats]:
    with open_hdf5(path) as file:
        if _KEY not in file:
            raise InputError(f"{path}: expected a table {_KEY!r}, got {', '.join(sorted(file))}.")
        group = file[_KEY]
        if "table" in group:
            index, columns, values = _appendable(path, group)
        else:
            index, columns, values = _fixed(path, group)
    if index.dtype.kind not in "iu" or {len(column) for column in columns} - {3, 4}:
        raise InputError(
            f"{path}: expected frames by number and columns scorer, (individuals,) bodyparts, "
            f"coords; got frames by {index.dtype} and {len(columns[0])} levels.",
            hint="Labelled training data are no tracks: import the analysed video.",
        )
    return _ascending(path, index.astype(np.int64)), columns, values


def _appendable(path: Path, group: Any) -> tuple[NDArray[Any], list[_Column], Floats]:
    """Read what ``DataFrame.to_hdf(format="table")`` writes, DeepLabCut's way."""
    table = dataset(group, "table", path)
    blocks = [name for name in table.dtype.names or () if name.startswith("values_block_")]
    columns: list[_Column] = []
    for name in blocks:
        pickled = group["table"].attrs.get(f"{name}_kind", b"")
        kind = load_plain(path, bytes(pickled))
        if not isinstance(kind, list) or not all(isinstance(column, tuple) for column in kind):
            raise InputError(f"{path}: expected the columns of {name}, got {type(kind).__name__}.")
        columns += [tuple(map(str, column)) for column in kind]
    parts = [np.asarray(table[name], dtype=np.float64).reshape(len(table), -1) for name in blocks]
    values = np.concatenate(parts, axis=1) if parts else np.empty((len(table), 0))
    if not columns or values.shape[1] != len(columns):
        got = values.shape[1]
        raise InputError(f"{path}: expected {len(columns)} columns of values, got {got}.")
    return table["index"], columns, values


def _fixed(path: Path, group: Any) -> tuple[NDArray[Any], list[_Column], Floats]:
    """Read what ``DataFrame.to_hdf(format="fixed")`` writes."""
    columns: list[_Column] = []
    parts: list[Floats] = []
    for block in range(int(group.attrs.get("nblocks", 0))):
        name = f"block{block}"
        levels = []
        for level in range(int(group.attrs[f"{name}_items_nlevels"])):
            names = texts(dataset(group, f"{name}_items_level{level}", path))
            codes = dataset(group, f"{name}_items_label{level}", path)
            levels.append([names[code] for code in codes])
        columns += list(zip(*levels, strict=True))
        parts.append(np.asarray(dataset(group, f"{name}_values", path), dtype=np.float64))
    if not parts:
        raise InputError(f"{path}: the table {_KEY!r} is empty.")
    return dataset(group, "axis1", path), columns, np.concatenate(parts, axis=1)


def _ascending(path: Path, frame: Ints) -> Ints:
    if frame.size == 0 or frame[0] < 0 or not (np.diff(frame) > 0).all():
        raise InputError(f"{path}: expected frame numbers that ascend from 0 or more.")
    return frame

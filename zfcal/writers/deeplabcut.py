"""Tracks as DeepLabCut stores several animals: ``.csv`` and ``.h5``, in pixels.

Mirror of `zfcal.readers.deeplabcut`: columns scorer, individuals, bodyparts, coords. The HDF5
file has what pandas' ``to_hdf(format="fixed")`` writes with PyTables, which is not needed here.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from zfcal.arrays import Floats
from zfcal.writers.extras import require
from zfcal.writers.source import BODY, Files, Source

_NAME = "tracksDLC_zfcal"
_KEY = "df_with_missing"
_COORDS = ("x", "y", "likelihood")
_LEVELS = ("scorer", "individuals", "bodyparts", "coords")


def deeplabcut_files(source: Source) -> Files:
    """Return the two files, which hold the same.

    Raises
    ------
    InputError
        h5py is not installed.
    """
    h5py = require("h5py", "deeplabcut")

    def write_h5(path: Path) -> None:
        with path.open("w+b") as raw, h5py.File(raw, "w") as file:
            _fill(file, source)

    return {f"{_NAME}.csv": lambda path: _write_csv(path, source), f"{_NAME}.h5": write_h5}


def _values(source: Source) -> Floats:
    """Return x, y and likelihood of each individual in turn, shape (frame, column)."""
    columns = np.concatenate([source.xy, source.dense.confidence[..., np.newaxis]], axis=-1)
    return columns.reshape(len(columns), -1)


def _write_csv(path: Path, source: Source) -> None:
    names = [["zfcal"], list(source.dense.names), [BODY], list(_COORDS)]
    columns = pd.MultiIndex.from_product(names, names=_LEVELS)
    with path.open("w", encoding="utf-8", newline="") as file:
        pd.DataFrame(_values(source), columns=columns).to_csv(file, lineterminator="\n")


def _fill(file: Any, source: Source) -> None:
    _say(file, **_node("GROUP", "1.0"), PYTABLES_FORMAT_VERSION="2.1")
    group = file.create_group(_KEY)
    _say(group, **_node("GROUP", "1.0"), pandas_type="frame", encoding="UTF-8", errors="strict")
    _say(group, axis0_variety="multi", axis1_variety="regular", block0_items_variety="multi")
    for name, count in (("ndim", 2), ("nblocks", 1), ("axis0_nlevels", 4)):
        group.attrs[name] = np.int64(count)
    group.attrs["block0_items_nlevels"] = np.int64(4)
    levels = (("zfcal",), source.dense.names, (BODY,), _COORDS)
    for axis in ("axis0", "block0_items"):
        for number, (name, words) in enumerate(zip(_LEVELS, levels, strict=True)):
            put = _put(group, f"{axis}_level{number}", np.array([word.encode() for word in words]))
            _say(put, kind="string", name=name, nan_rep="", **{f"{axis}_name{name}": name})
            _put(group, f"{axis}_label{number}", _codes(number, len(source.dense.agent)))
    index = _put(group, "axis1", source.dense.frame)
    _say(index, kind="integer")
    # None, pickled, which is known by its bytes: the index has no name.
    index.attrs["name"] = np.bytes_("N.")
    _put(group, "block0_values", _values(source))


def _codes(level: int, n_agents: int) -> NDArray[np.int32]:
    """Return which of a level's words each column has."""
    n = n_agents * len(_COORDS)
    at = {1: np.arange(n) // len(_COORDS), 3: np.arange(n) % len(_COORDS)}
    return at.get(level, np.zeros(n, dtype=np.int64)).astype(np.int32)


def _put(group: Any, name: str, values: NDArray[Any]) -> Any:
    made = group.create_dataset(name, data=values)
    _say(made, **_node("ARRAY", "2.4"), FLAVOR="numpy")
    made.attrs["transposed"] = np.uint8(1)
    return made


def _node(kind: str, version: str) -> dict[str, str]:
    """Return what PyTables wants to know of every node."""
    return {"CLASS": kind, "TITLE": "", "VERSION": version}


def _say(node: Any, **attributes: str) -> None:
    """Write attributes as PyTables does: texts of fixed length, in UTF-8."""
    h5py = require("h5py", "deeplabcut")
    for name, text in attributes.items():
        if text:
            length = h5py.string_dtype("utf-8", len(text.encode()))
            node.attrs.create(name, text.encode(), dtype=length)
        else:
            node.attrs[name] = h5py.Empty(h5py.string_dtype("utf-8", 1))

"""Tracks for trajectorytools: ``.npy`` files of positions or of pickled dictionaries.

trajectorytools 0.4 (``trajectories.py``) reads the dictionaries of idtracker.ai
and arrays of shape (frame, animal, 2) in pixels, and saves its own:
``traj_data`` with positions ``_s`` and ``params`` with ``displacement`` (pixels),
``length_unit`` (pixels) and ``frame_rate``; pixels are
``_s * length_unit - displacement``.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from zfcal.arrays import Floats
from zfcal.errors import InputError
from zfcal.readers.assemble import Imported, assemble
from zfcal.readers.idtracker import from_dictionary, positions
from zfcal.readers.options import ImportOptions
from zfcal.readers.pickles import read_npy


def read_trajectorytools(path: Path, options: ImportOptions) -> Imported:
    """Read the positions of a ``.npy`` file, in pixels.

    Parameters
    ----------
    path
        An array (frame, animal, 2), or a dictionary of idtracker.ai or of
        trajectorytools itself.
    options
        Needs ``m_per_px``.
    """
    found = read_npy(path)
    if isinstance(found, np.ndarray):
        found = {"trajectories": found}
    if not isinstance(found, dict):
        raise InputError(f"{path}: expected an array or a dictionary, got {type(found).__name__}.")
    if "traj_data" in found:
        found = _saved(path, found)
    return assemble(path, from_dictionary(path, found, options), options)


def _saved(path: Path, found: Mapping[str, Any]) -> dict[str, Any]:
    """Return what ``Trajectories.save`` wrote, as a dictionary in pixels."""
    params = found.get("params")
    data = found["traj_data"]
    if not (isinstance(params, dict) and isinstance(data, dict) and "_s" in data):
        raise InputError(f"{path}: expected traj_data with '_s' and params, got {sorted(found)}.")
    try:
        unit_px = float(params["length_unit"])
        shift_px: Floats = np.asarray(params["displacement"], dtype=np.float64).reshape(2)
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(
            f"{path}: expected params with length_unit and displacement, got {sorted(params)}."
        ) from error
    pixels = positions(path, data["_s"]) * unit_px - shift_px
    return {"trajectories": pixels, "frames_per_second": params.get("frame_rate")}

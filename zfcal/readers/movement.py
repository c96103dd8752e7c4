"""Tracks of movement: its netCDF files.

movement (documentation, "The movement datasets"): a variable ``position`` over
``time``, ``space`` (x, y), ``keypoints`` and ``individuals`` - from version 0.17
on ``keypoint`` and ``individual`` - and ``confidence``; boxes have no keypoints.
Attributes ``fps`` and ``time_unit`` (seconds or frames). Positions are in pixels,
unless the variable has the attribute ``space_unit``, which
``movement.transforms.scale`` sets (or ``units``). Missing is NaN. `zfcal export` adds a variable
``heading_rad`` over time and individual, and the attribute ``y_axis`` (up or down) of positions.

A netCDF-4 file is an HDF5 file and is read as one: its variables are data sets,
its dimensions their scales.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Floats, Ints
from zfcal.errors import InputError
from zfcal.readers.assemble import UNITS, Imported, assemble
from zfcal.readers.clock import check_declared, check_rate
from zfcal.readers.extras import dataset, open_hdf5, texts
from zfcal.readers.options import ImportOptions
from zfcal.readers.poses import Poses, choose

_LEGACY = {"keypoints": "keypoint", "individuals": "individual"}
"""Names of dimensions before version 0.17, and since."""

_ORDER = ("time", "individual", "keypoint", "space")


@dataclass(frozen=True, slots=True, kw_only=True)
class _Variable:
    """An array with the names of its axes."""

    values: NDArray[Any]
    dims: tuple[str, ...]
    attributes: Mapping[str, str]


def read_movement(path: Path, options: ImportOptions) -> Imported:
    """Read a poses or bounding boxes data set of movement.

    Parameters
    ----------
    path
        netCDF-4, as ``Dataset.to_netcdf`` writes it.
    options
        Needs ``m_per_px`` when the positions are in pixels, and ``keypoint`` when
        there are several.
    """
    variables, attributes = _read(path)
    _check(path, variables)
    notes: tuple[str, ...] = ()
    if "fps" in attributes:
        notes = check_declared(path, _number(path, attributes["fps"]), options.fps)
    time_s, frame = _clock(path, variables["time"].values, attributes, options)
    poses = Poses(
        position=_arranged(variables["position"]),
        score=_arranged(variables["confidence"]) if "confidence" in variables else None,
        frame=frame,
        time_s=time_s,
        agents=_names(variables, "individual"),
        keypoints=_names(variables, "keypoint") or ("centre",),
        unit=_unit(path, variables["position"]),
        heading_rad=_headings(path, variables),
        y_down=variables["position"].attributes.get("y_axis") != "up",
        notes=notes,
    )
    return assemble(path, choose(path, poses, options).rows(), options)


def _read(path: Path) -> tuple[dict[str, _Variable], dict[str, str]]:
    """Return the variables that are there of those needed, and the file's attributes."""
    with open_hdf5(path) as file:
        found = {}
        for name in (
            "position",
            "confidence",
            "heading_rad",
            "time",
            "space",
            *_LEGACY,
            *_LEGACY.values(),
        ):
            if name in file:
                new = _LEGACY.get(name, name)
                found[new] = _variable(path, file, name)
        return found, _texts(file.attrs)


def _variable(path: Path, file: Any, name: str) -> _Variable:
    node = file[name]
    # A coordinate is its own scale.
    scales = [axis[0].name if len(axis) else name for axis in node.dims]
    dims = tuple(scale.rsplit("/", 1)[-1] for scale in scales)
    values = dataset(file, name, path)
    return _Variable(
        values=values,
        dims=tuple(_LEGACY.get(dim, dim) for dim in dims),
        attributes=_texts(node.attrs),
    )


def _texts(attributes: Any) -> dict[str, str]:
    """Return the attributes that are needed, as text."""
    wanted = ("fps", "time_unit", "space_unit", "units", "y_axis", "scale_factor", "add_offset")
    return {name: texts(np.asarray(attributes[name]))[0] for name in wanted if name in attributes}


def _check(path: Path, variables: Mapping[str, _Variable]) -> None:
    dims = variables["position"].dims if "position" in variables else ()
    needed = {"time", "space", "individual"}
    if not (needed <= set(dims) <= set(_ORDER) and {"time", "space"} <= set(variables)):
        raise InputError(
            f"{path}: expected a variable 'position' over time, space, keypoint and individual, "
            f"got {', '.join(dims) or 'none'}."
        )
    space = texts(variables["space"].values)
    if space != ("x", "y"):
        raise InputError(f"{path}: expected space to be x, y, got {', '.join(space)}.")
    shape = dict(zip(dims, variables["position"].values.shape, strict=True))
    n_times = variables["time"].values.size
    if shape["time"] != n_times or shape["space"] != 2:
        raise InputError(f"{path}: expected positions for {n_times} times, got {shape}.")
    for name in {"position", "confidence"} & set(variables):
        _check_plain(path, name, variables[name], shape)


def _headings(path: Path, variables: Mapping[str, _Variable]) -> Floats | None:
    if "heading_rad" not in variables:
        return None
    heading = variables["heading_rad"]
    sizes = dict(zip(variables["position"].dims, variables["position"].values.shape, strict=True))
    expected = {dim: sizes[dim] for dim in ("time", "individual")}
    got = dict(zip(heading.dims, heading.values.shape, strict=True))
    if got != expected or heading.values.dtype.kind != "f":
        raise InputError(
            f"{path}: expected heading_rad, numbers over {expected}, got {heading.values.dtype} "
            f"over {got}."
        )
    return np.asarray(heading.values.transpose([heading.dims.index(d) for d in expected]), float)


def _check_plain(path: Path, name: str, variable: _Variable, shape: Mapping[str, int]) -> None:
    """Refuse packed numbers, and a confidence that does not go with the positions."""
    packed = {"scale_factor", "add_offset"} & set(variable.attributes)
    if packed or variable.values.dtype.kind not in "iuf":
        raise InputError(
            f"{path}: expected plain numbers in {name}, got {variable.values.dtype}"
            f"{' packed by ' if packed else ''}{', '.join(sorted(packed))}."
        )
    got = dict(zip(variable.dims, variable.values.shape, strict=True))
    expected = {dim: size for dim, size in shape.items() if dim != "space" or name == "position"}
    if got != expected:
        raise InputError(f"{path}: expected {name} over {expected}, got {got}.")


def _arranged(variable: _Variable) -> Floats:
    """Return an array with its axes in the order time, individual, keypoint (, space)."""
    order = [dim for dim in _ORDER if dim in variable.dims]
    values = np.transpose(variable.values, [variable.dims.index(dim) for dim in order])
    if "keypoint" not in variable.dims:
        values = np.expand_dims(values, 2)
    return np.asarray(values, dtype=np.float64)


def _clock(
    path: Path, stored: NDArray[Any], attributes: Mapping[str, str], options: ImportOptions
) -> tuple[Floats, Ints]:
    """Return the seconds and the numbers of the frames."""
    time = np.asarray(stored, dtype=np.float64)
    unit = attributes.get("time_unit", "seconds" if "fps" in attributes else "frames")
    if unit not in {"frames", "seconds"}:
        raise InputError(f"{path}: expected time_unit frames or seconds, got {unit!r}.")
    if not (time.size and np.isfinite(time).all() and time[0] >= 0 and (np.diff(time) > 0).all()):
        raise InputError(f"{path}: expected times that advance from 0 or more.")
    if unit == "frames":
        return time / options.fps, np.rint(time).astype(np.int64)
    check_rate(path, time, fps=options.fps)
    return time, np.rint(time * options.fps).astype(np.int64)


def _names(variables: Mapping[str, _Variable], dim: str) -> tuple[str, ...]:
    position = variables["position"]
    if dim not in position.dims:
        return ()
    if dim in variables and variables[dim].values.dtype.kind in "OSU":
        return texts(variables[dim].values)
    return tuple(f"{dim}_{i}" for i in range(position.values.shape[position.dims.index(dim)]))


def _number(path: Path, text: str) -> float:
    try:
        return float(text)
    except ValueError as error:
        raise InputError(f"{path}: expected a frame rate in fps, got {text!r}.") from error


def _unit(path: Path, position: _Variable) -> str:
    stated = position.attributes.get("space_unit", position.attributes.get("units", "px"))
    if stated not in UNITS:
        raise InputError(
            f"{path}: positions are in {stated!r}, expected one of {', '.join(UNITS)}."
        )
    return UNITS[stated]

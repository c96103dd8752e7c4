"""Tracks of RoboFish: the HDF5 files of robofish-io, track format 1.

Documentation of robofish-io, and the RoboFish Track Format 1.0: the root has the attributes
``format_version`` ([1, 0]) and ``world_size_cm`` (width, height). Each group of ``entities`` has an
attribute ``category`` (organism, robot or obstacle; fish in older files) and data sets
``positions`` (sample, 2), in centimetres about the centre of the world, and ``orientations``
(sample, 2), unit vectors; NaN where it was lost. One sample alone holds for the whole recording,
which is believed of robots and obstacles, not of fish.
``samplings`` has a group for each clock, with the attribute ``frequency_hz`` or a data set
``monotonic_time_points_us``; ``default`` names the one of all entities whose attribute ``sampling``
names no other. No file of robofish-io was at hand to confirm ``default``, ``sampling`` and the
times: where a file has several samplings, the import says which one it took.

The format does not tell to which side of the tank y counts. BioTracker writes images' rows, which
count downwards; simulators count upwards.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Floats
from zfcal.errors import InputError
from zfcal.readers.assemble import Imported, assemble
from zfcal.readers.clock import check_declared, check_rate, frames_of
from zfcal.readers.extras import dataset, open_hdf5, texts
from zfcal.readers.options import ImportOptions
from zfcal.readers.raw import Grid
from zfcal.tracks import FISH, ROBOT

_KINDS = {"fish": FISH, "organism": FISH, "robot": ROBOT}
"""Kinds by category; an entity of another one, such as an obstacle, is no agent."""

_UNIT_TOLERANCE = 0.01
"""By how much the length of an orientation, in single precision, may differ from one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Sampling:
    """A clock: seconds of the samples, or None where only their rate is told."""

    name: str
    frequency_hz: float | None
    time_s: Floats | None

    def is_like(self, other: _Sampling) -> bool:
        """Whether samples of the same number are of the same time."""
        ours, theirs = self.time_s, other.time_s
        if self.name == other.name:
            return True
        if ours is None or theirs is None:
            return ours is theirs and self.frequency_hz == other.frequency_hz
        return np.array_equal(ours, theirs)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Entity:
    """A fish or a robot: positions in cm and headings, shapes (sample, 2) and (sample,)."""

    name: str
    kind: int
    xy: Floats
    heading_rad: Floats
    sampling: _Sampling


def read_robofish(path: Path, options: ImportOptions) -> Imported:
    """Read fish and robots of a RoboFish file, from centimetres about the centre of the world.

    Parameters
    ----------
    path
        HDF5, as robofish-io and BioTracker write it.
    options
        ``origin`` is in centimetres, as the file has it: with ``-50,-50`` the lower left corner of
        a world of 100 x 100 cm becomes (0, 0). Entities of category robot are robots.
    """
    with open_hdf5(path) as file:
        world_cm = _world(path, file)
        entities, left_out = _entities(path, file)
        unused = sorted(set(file["samplings"]) - {entity.sampling.name for entity in entities})
    sampling = _one_sampling(path, entities)
    n_samples = _length(path, entities, sampling)
    _check_swim(path, entities, n_samples)
    frame = np.arange(n_samples)
    time_s = frame / options.fps
    notes = [_axes_note(world_cm, options)]
    if sampling.time_s is not None:
        time_s = sampling.time_s - sampling.time_s[0]
        check_rate(path, time_s, fps=options.fps)
        frame = frames_of(path, time_s, options.fps)
    elif sampling.frequency_hz is not None:
        notes += check_declared(path, sampling.frequency_hz, options.fps)
    if left_out:
        notes.append(f"Entities that are neither fish nor robot are left out: {left_out}.")
    if unused:
        notes.append(f"Sampling {sampling.name!r} is taken, not used: {', '.join(unused)}.")
    ended = [f"{e.name} ({len(e.xy)})" for e in entities if 1 < len(e.xy) < n_samples]
    if ended:
        notes.append(f"Some end before the last of {n_samples} samples: {', '.join(ended)}.")
    fixed = [e.name for e in entities if len(e.xy) == 1 < n_samples and e.kind == ROBOT]
    if fixed:
        notes.append(f"One sample holds for all {n_samples}, as of robots: {', '.join(fixed)}.")
    grid = Grid(
        xy=np.stack([_filled(entity.xy, n_samples) for entity in entities], axis=1),
        frame=frame,
        time_s=time_s,
        unit="cm",
        heading_rad=np.stack([_filled(e.heading_rad, n_samples) for e in entities], axis=1),
        names=tuple(entity.name for entity in entities),
        y_down=False,
        notes=tuple(notes),
    )
    kinds = np.array([entity.kind for entity in entities], dtype=np.int8)
    return assemble(path, replace(grid.rows(), kind=np.tile(kinds, n_samples)), options)


def _world(path: Path, file: Any) -> tuple[float, float]:
    """Return width and height of the world in cm; check what is there, and its version."""
    for name in ("format_version", "world_size_cm"):
        if name not in file.attrs:
            raise InputError(
                f"{path}: expected a RoboFish file with the attribute {name!r}, got attributes "
                f"{', '.join(sorted(file.attrs)) or 'none'}."
            )
    version = texts(np.atleast_1d(file.attrs["format_version"]))
    if version[0].partition(".")[0] != "1":
        raise InputError(
            f"{path}: expected RoboFish's track format 1, got version {'.'.join(version)}.",
            hint="Convert it with the robofish-io that wrote it, or export it as csv.",
        )
    size = _floats(path, "attribute 'world_size_cm'", file.attrs["world_size_cm"])
    if size.shape != (2,) or not (np.isfinite(size) & (size > 0)).all():
        raise InputError(
            f"{path}: expected world_size_cm of two positive lengths, got {size.tolist()}."
        )
    return float(size[0]), float(size[1])


def _entities(path: Path, file: Any) -> tuple[list[_Entity], str]:
    """Return fish and robots by name, and the names of what is neither."""
    group = _group(path, file, "entities")
    known, others = [], []
    for name in sorted(group):
        if not hasattr(group[name], "keys"):
            raise InputError(f"{path}: expected a group entities/{name}, got a data set.")
        category = _text(group[name], "category")
        if category is None:
            raise InputError(
                f"{path}: entities/{name} has no attribute 'category', expected one of "
                f"{', '.join(_KINDS)} or obstacle."
            )
        if category in _KINDS:
            known.append(_entity(path, file, name, _KINDS[category]))
        else:
            others.append(f"{name} ({category})")
    if not known:
        raise InputError(
            f"{path}: expected entities of category {', '.join(_KINDS)}, got "
            f"{', '.join(others) or 'none'}."
        )
    return known, ", ".join(others)


def _entity(path: Path, file: Any, name: str, kind: int) -> _Entity:
    group, where = file["entities"][name], f"entities/{name}"
    xy = _pairs(path, group, "positions", where)
    heading_rad = np.full(len(xy), np.nan)
    if "orientations" in group:
        along = _pairs(path, group, "orientations", where)
        if len(along) not in {1, len(xy)}:
            raise InputError(
                f"{path}: {where} has {len(xy)} positions, expected as many orientations, got "
                f"{len(along)}."
            )
        heading_rad = _filled(_headings(path, along, where), len(xy))
    return _Entity(
        name=name,
        kind=kind,
        xy=xy,
        heading_rad=heading_rad,
        sampling=_sampling(path, file, _text(group, "sampling"), where),
    )


def _headings(path: Path, along: Floats, where: str) -> Floats:
    """Return directions of unit vectors; NaN for (0, 0), which BioTracker writes for none."""
    length = np.hypot(along[:, 0], along[:, 1])
    wrong = (length > 0) & ~(np.abs(length - 1) <= _UNIT_TOLERANCE)
    if wrong.any():
        at = int(np.argmax(wrong))
        raise InputError(
            f"{path}: {where}/orientations: expected unit vectors, got "
            f"({along[at, 0]:g}, {along[at, 1]:g}) in sample {at}."
        )
    return np.where(length > 0, np.arctan2(along[:, 1], along[:, 0]), np.nan)


def _sampling(path: Path, file: Any, named: str | None, where: str) -> _Sampling:
    """Return the sampling that an entity names, else the default, else the only one."""
    group = _group(path, file, "samplings")
    known = sorted(group)
    name = named or _text(group, "default") or (known[0] if len(known) == 1 else "")
    if name not in known:
        raise InputError(
            f"{path}: {where} is of sampling {name or 'unknown'}, expected one of "
            f"{', '.join(known) or 'those in the file, which has none'}."
        )
    found = group[name]
    time_s = None
    if "monotonic_time_points_us" in found:
        time_s = dataset(found, "monotonic_time_points_us", path).astype(np.float64) / 1e6
        if time_s.ndim != 1 or not time_s.size or not (np.diff(time_s) > 0).all():
            raise InputError(f"{path}: samplings/{name}: expected times that advance.")
    frequency_hz = None
    if "frequency_hz" in found.attrs:
        stored = found.attrs["frequency_hz"]
        numbers = _floats(path, f"samplings/{name}, frequency_hz", stored).ravel()
        frequency_hz = float(numbers[0]) if numbers.size == 1 else np.nan
    if frequency_hz is None and time_s is None:
        raise InputError(
            f"{path}: samplings/{name} has neither the attribute 'frequency_hz' nor a data set "
            "'monotonic_time_points_us'; expected one of them."
        )
    return _Sampling(name=name, frequency_hz=frequency_hz, time_s=time_s)


def _one_sampling(path: Path, entities: Sequence[_Entity]) -> _Sampling:
    first = entities[0]
    for other in entities[1:]:
        if not other.sampling.is_like(first.sampling):
            raise InputError(
                f"{path}: {first.name} is of sampling {first.sampling.name!r}, {other.name} of "
                f"{other.sampling.name!r}; expected one clock for all fish and robots.",
                hint="Bring them to one sampling with robofish-io first; nothing is interpolated.",
            )
    return first.sampling


def _length(path: Path, entities: Sequence[_Entity], sampling: _Sampling) -> int:
    longest = max(entities, key=lambda entity: len(entity.xy))
    if sampling.time_s is None:
        return len(longest.xy)
    if len(longest.xy) > len(sampling.time_s):
        raise InputError(
            f"{path}: entities/{longest.name} has {len(longest.xy)} positions, expected at most "
            f"the {len(sampling.time_s)} of sampling {sampling.name!r}."
        )
    return len(sampling.time_s)


def _check_swim(path: Path, entities: Sequence[_Entity], n_samples: int) -> None:
    """Refuse a fish that would stand still throughout."""
    for entity in entities:
        seen = np.isfinite(entity.xy).all()
        if entity.kind == FISH and len(entity.xy) == 1 < n_samples and seen:
            raise InputError(
                f"{path}: entities/{entity.name} is a fish with one sample, expected {n_samples}.",
                hint="One sample holds for the whole recording, and no fish stands still that "
                "long: leave it out of the file, or give it the category robot.",
            )


def _filled(values: Floats, n_samples: int) -> Floats:
    """Return one row for each sample: a single one holds for all, those after the last are NaN."""
    if len(values) == 1:
        return np.repeat(values, n_samples, axis=0)
    rest = np.full((n_samples - len(values), *values.shape[1:]), np.nan)
    return np.concatenate([values, rest])


def _axes_note(world_cm: tuple[float, float], options: ImportOptions) -> str:
    """Say what was taken for up, since the file does not tell, and how to have it otherwise."""
    x, y = (size / 2 for size in world_cm)
    if options.flip_y:
        return "The file does not state which way y counts: it was turned, as --flip-y says."
    return (
        "The file does not state which way y counts: upwards is assumed. If it counts down (as "
        f"BioTracker writes it), turn it with --flip-y and --origin 0,0 (centre) or {-x:g},{y:g} "
        f"(corner); --origin {-x:g},{-y:g} puts the lower left corner of this world at (0, 0)."
    )


def _group(path: Path, file: Any, name: str) -> Any:
    if name not in file or not hasattr(file[name], "keys"):
        there = ", ".join(sorted(file)) or "an empty file"
        raise InputError(f"{path}: expected a RoboFish file with a group {name!r}, got {there}.")
    return file[name]


def _text(node: Any, name: str) -> str | None:
    return texts(np.asarray(node.attrs[name]))[0] if name in node.attrs else None


def _pairs(path: Path, group: Any, name: str, where: str) -> Floats:
    """Return a data set of two numbers a sample."""
    if name not in group:
        there = ", ".join(sorted(group)) or "nothing"
        raise InputError(f"{path}: {where}: expected a data set {name!r}, got {there}.")
    found = _floats(path, f"{where}/{name}", dataset(group, name, path))
    if found.ndim != 2 or found.shape[1] != 2 or not len(found):
        raise InputError(f"{path}: {where}/{name}: expected shape (samples, 2), got {found.shape}.")
    return found


def _floats(path: Path, what: str, stored: NDArray[Any]) -> Floats:
    found = np.asarray(stored)
    if found.dtype.kind not in "iuf":
        raise InputError(f"{path}: {what}: expected numbers, got {found.dtype}.")
    return found.astype(np.float64)

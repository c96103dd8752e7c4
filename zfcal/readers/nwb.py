"""Poses in Neurodata Without Borders, ``.nwb``: what sleap-io and others write by ndx-pose.

Each module of ``processing`` may hold groups of type ``PoseEstimation``, one for each animal
(sleap-io calls them ``track=NAME``), and these a ``PoseEstimationSeries`` for each body part: data
(sample, xy) with a unit, ``confidence``, and ``timestamps`` or ``starting_time`` with its rate, in
seconds. sleap-io leaves out samples in which a part was not seen, cuts the rate to whole hertz, and
without a rate counts a frame as a second.

The file is read as HDF5. sleap-io's own reader numbers frames anew where nobody was seen, and
forgets who is who.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from zfcal.arrays import Floats, Ints
from zfcal.errors import InputError
from zfcal.readers.assemble import UNITS, Imported, assemble
from zfcal.readers.clock import check_declared, check_rate
from zfcal.readers.extras import dataset, open_hdf5, texts
from zfcal.readers.options import ImportOptions
from zfcal.readers.poses import Poses, choose

_PREFIX = "track="


@dataclass(frozen=True, slots=True, kw_only=True)
class _Series:
    """A body part of an animal: positions (sample, 2), confidence and times (sample,).

    ``rate_hz`` is None where each sample has a time of its own.
    """

    agent: str
    part: str
    unit: str
    xy: Floats
    confidence: Floats
    time_s: Floats
    rate_hz: float | None


def read_nwb(path: Path, options: ImportOptions) -> Imported:
    """Read the poses of an NWB file.

    Parameters
    ----------
    path
        HDF5.
    options
        Needs ``m_per_px`` when the positions are in pixels, and ``keypoint`` when there are
        several body parts. Frames are played at ``fps``, with which times are compared.
    """
    with open_hdf5(path) as file:
        series = list(_all_series(path, file))
    if len({(found.agent, found.part) for found in series}) < len(series):
        raise InputError(f"{path}: expected each animal once, got two of the same name.")
    units = sorted({found.unit for found in series})
    if len(units) != 1:
        raise InputError(f"{path}: expected positions in one unit, got {', '.join(units)}.")
    frames, notes = _frames(path, series, options)
    frame = np.unique(np.concatenate(frames))
    agents = tuple(dict.fromkeys(found.agent for found in series))
    parts = tuple(dict.fromkeys(found.part for found in series))
    cube = np.full((len(frame), len(agents), len(parts), 3), np.nan)
    for found, own in zip(series, frames, strict=True):
        at = np.searchsorted(frame, own), agents.index(found.agent), parts.index(found.part)
        cube[at] = np.column_stack([found.xy, found.confidence])
    poses = Poses(
        position=cube[..., :2],
        score=cube[..., 2],
        frame=frame,
        time_s=frame / options.fps,
        agents=agents,
        keypoints=parts,
        unit=units[0],
        notes=notes,
    )
    return assemble(path, choose(path, poses, options).rows(), options)


def _all_series(path: Path, file: Any) -> Iterator[_Series]:
    modules = file.get("processing", {})
    held = {
        f"{module}/{name}": modules[module][name] for module in modules for name in modules[module]
    }
    animals = {name: node for name, node in held.items() if _type(node) == "PoseEstimation"}
    videos = {
        video
        for node in animals.values()
        if "original_videos" in node
        for video in texts(dataset(node, "original_videos", path))
    }
    if not animals or len(videos) > 1:
        kinds = ", ".join(sorted({_type(node) for node in held.values()} - {""}))
        got = f"poses in {len(videos)} videos" if animals else kinds or "nothing in 'processing'"
        raise InputError(
            f"{path}: expected an NWB file with PoseEstimation of one video, got {got}.",
            hint="Training data (PoseTraining) are no tracks." if "PoseTraining" in kinds else "",
        )
    for name, node in animals.items():
        found = [part for part in node if _type(node[part]) == "PoseEstimationSeries"]
        if not found:
            raise InputError(f"{path}: {name} holds no PoseEstimationSeries, expected some.")
        agent = name.partition("/")[2].removeprefix(_PREFIX)
        yield from (_series(path, node[part], agent, part) for part in found)


def _type(node: Any) -> str:
    stored = node.attrs.get("neurodata_type", "")
    return texts(np.asarray(stored))[0]


def _series(path: Path, node: Any, agent: str, part: str) -> _Series:
    where = f"{agent}/{part}"
    xy = dataset(node, "data", path)
    if xy.ndim != 2 or xy.shape[1] != 2 or xy.dtype.kind not in "iuf" or not len(xy):
        raise InputError(
            f"{path}: {where}: expected positions of shape (samples, 2), got {xy.dtype} of "
            f"{xy.shape}."
        )
    attributes = node["data"].attrs
    unit = texts(np.asarray(attributes.get("unit", "pixels")))[0]
    if unit not in UNITS:
        raise InputError(
            f"{path}: {where}: positions are in {unit!r}, expected one of {', '.join(UNITS)}."
        )
    confidence = np.full(len(xy), np.nan)
    if "confidence" in node:
        confidence = dataset(node, "confidence", path)
    time_s, rate_hz = _times(path, node, where, len(xy))
    if confidence.shape != time_s.shape or confidence.dtype.kind not in "iuf":
        raise InputError(
            f"{path}: {where}: expected {len(xy)} numbers of confidence, got {confidence.dtype} "
            f"of {confidence.shape}."
        )
    scale = float(attributes.get("conversion", 1.0))
    return _Series(
        agent=agent,
        part=part,
        unit=UNITS[unit],
        xy=xy * scale + float(attributes.get("offset", 0.0)),
        confidence=confidence,
        time_s=time_s,
        rate_hz=rate_hz,
    )


def _times(path: Path, node: Any, where: str, n_samples: int) -> tuple[Floats, float | None]:
    """Return the times of the samples, and the rate where that is what the file has."""
    if "timestamps" in node:
        time_s = dataset(node, "timestamps", path)
        numeric = time_s.dtype.kind in "iuf" and time_s.shape == (n_samples,)
        if not (numeric and np.isfinite(time_s).all() and (np.diff(time_s) > 0).all()):
            raise InputError(f"{path}: {where}: expected {n_samples} timestamps that advance.")
        return time_s.astype(np.float64), None
    start = dataset(node, "starting_time", path)
    rate_hz = float(node["starting_time"].attrs.get("rate", 0.0))
    if start.shape != () or not np.isfinite(start) or not 0 < rate_hz < np.inf:
        raise InputError(
            f"{path}: {where}: expected a starting_time with a positive rate, got {start} and "
            f"{rate_hz:g}."
        )
    return float(start) + np.arange(n_samples) / rate_hz, rate_hz


def _count_frames(time_s: Floats) -> bool:
    """Whether all times are whole seconds, in steps of one."""
    steps_s = np.diff(time_s)
    whole = time_s[0] >= 0 and (time_s == np.rint(time_s)).all()
    return bool(whole and (not steps_s.size or steps_s.min() == 1))


def _frames(
    path: Path, series: Sequence[_Series], options: ImportOptions
) -> tuple[list[Ints], tuple[str, ...]]:
    """Return for each series the frames of its samples, and what a person should know."""
    if _count_frames(np.unique(np.concatenate([found.time_s for found in series]))):
        note = (
            f"Times are whole seconds: each is taken as the number of a frame, at {options.fps:g} "
            "frames per second, as sleap-io has it when it is not told a rate."
        )
        return [found.time_s.astype(np.int64) for found in series], (note,)
    notes: tuple[str, ...] = ()
    start_s = min(float(found.time_s[0]) for found in series)
    frames = []
    for found in series:
        first = np.rint((found.time_s[0] - start_s) * options.fps)
        if found.rate_hz is None:
            check_rate(path, found.time_s, fps=options.fps)
            own = np.rint((found.time_s - start_s) * options.fps)
        else:
            notes = check_declared(path, found.rate_hz, options.fps)
            own = first + np.arange(len(found.time_s))
        if not (np.diff(own) > 0).all():
            raise InputError(
                f"{path}: {found.agent}/{found.part} has two samples in a frame, at "
                f"{options.fps:g} frames per second; expected one."
            )
        frames.append(own.astype(np.int64))
    if start_s:
        notes = (*notes, f"Times are counted from the first sample, {start_s:g} s in the file.")
    return frames, notes

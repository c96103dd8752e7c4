"""Poses in Neurodata Without Borders, ``.nwb``: what sleap-io and others write by ndx-pose.

Each module of ``processing`` may hold groups of type ``PoseEstimation``, one for each animal
(sleap-io calls them ``track=NAME``), and these a ``PoseEstimationSeries`` for each body part: data
(sample, xy) with a unit, ``confidence``, and ``timestamps`` or ``starting_time`` with its rate, in
seconds: see `zfcal.readers.nwb_clock`.

The file is read as HDF5. sleap-io's own reader numbers frames anew where nobody was seen, and
forgets who is who.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from zfcal.arrays import Floats
from zfcal.errors import InputError
from zfcal.readers.assemble import UNITS, Imported, assemble
from zfcal.readers.extras import dataset, open_hdf5, texts
from zfcal.readers.nwb_clock import Clock, frames_from
from zfcal.readers.options import ImportOptions
from zfcal.readers.poses import Poses, choose

_PREFIX = "track="


@dataclass(frozen=True, slots=True, kw_only=True)
class _Series:
    """A body part of an animal: positions (sample, 2) and confidence (sample,)."""

    agent: str
    part: str
    unit: str
    xy: Floats
    confidence: Floats
    clock: Clock


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
    with open_hdf5(path, under="processing") as file:
        series = list(_all_series(path, file))
    if len({(found.agent, found.part) for found in series}) < len(series):
        raise InputError(f"{path}: expected each animal once, got two of the same name.")
    units = sorted({found.unit for found in series})
    if len(units) != 1:
        raise InputError(f"{path}: expected positions in one unit, got {', '.join(units)}.")
    found_frames = frames_from(path, [found.clock for found in series], options.fps)
    frames = [own for own in found_frames.of if own is not None]
    frame = np.unique(np.concatenate(frames))
    agents = tuple(dict.fromkeys(found.agent for found in series))
    parts = tuple(dict.fromkeys(found.part for found in series))
    cube = np.full((len(frame), len(agents), len(parts), 3), np.nan)
    for found, own in zip(series, found_frames.of, strict=True):
        if own is None:
            continue
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
        notes=found_frames.notes,
    )
    imported = assemble(path, choose(path, poses, options).rows(), options)
    return replace(imported, warnings=found_frames.warnings)


def _all_series(path: Path, file: Any) -> Iterator[_Series]:
    modules = file.get("processing", {})
    held = {
        f"{module}/{name}": modules[module][name]
        for module in modules
        if hasattr(modules[module], "keys")
        for name in modules[module]
    }
    animals = {name: node for name, node in held.items() if _type(node) == "PoseEstimation"}
    told = [_videos(path, node) for node in animals.values()]
    videos = set().union(*told)
    if not animals or len(videos) > 1:
        kinds = ", ".join(sorted({_type(node) for node in held.values()} - {""}))
        got = f"poses in {len(videos)} videos" if animals else kinds or "nothing in 'processing'"
        raise InputError(
            f"{path}: expected an NWB file with PoseEstimation of one video, got {got}.",
            hint="Training data (PoseTraining) are no tracks." if "PoseTraining" in kinds else "",
        )
    places = sorted({name.partition("/")[0] for name in animals})
    if len(places) > 1 and not all(told):
        raise InputError(
            f"{path}: expected PoseEstimation of one video, got those of {', '.join(places)}, and "
            "not for all of them the video.",
            hint="They may be of several cameras: keep one of them in the file.",
        )
    for name, node in animals.items():
        found = [part for part in node if _is_series(node, part)]
        if not found:
            raise InputError(f"{path}: {name} holds no PoseEstimationSeries, expected some.")
        agent = name.partition("/")[2].removeprefix(_PREFIX)
        by_sleap = name.partition("/")[2].startswith(_PREFIX) or _software(path, node) == "SLEAP"
        yield from (_series(path, node[part], (agent, part), by_sleap=by_sleap) for part in found)


def _videos(path: Path, node: Any) -> set[str]:
    """Return what the file has for the video of an animal."""
    if "original_videos" in node:
        return set(texts(dataset(node, "original_videos", path)))
    return {str(node["source_video"].name)} if "source_video" in node else set()


def _software(path: Path, node: Any) -> str:
    return texts(dataset(node, "source_software", path))[0] if "source_software" in node else ""


def _is_series(node: Any, part: str) -> bool:
    # A link that leads nowhere, as to a skeleton that was left out, is no series.
    return part in node and _type(node[part]) == "PoseEstimationSeries"


def _type(node: Any) -> str:
    stored = node.attrs.get("neurodata_type", "")
    return texts(np.asarray(stored))[0]


def _series(path: Path, node: Any, name: tuple[str, str], *, by_sleap: bool) -> _Series:
    where = "/".join(name)
    xy = dataset(node, "data", path)
    if xy.ndim and not len(xy):
        # sleap-io writes so a part that was never seen.
        xy = np.empty((0, 2))
    if xy.ndim != 2 or xy.shape[1] != 2 or xy.dtype.kind not in "iuf":
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
    if "confidence" in node and len(xy):
        confidence = dataset(node, "confidence", path)
    clock = _clock(path, node, where, len(xy), by_sleap=by_sleap)
    if confidence.shape != (len(xy),) or confidence.dtype.kind not in "iuf":
        raise InputError(
            f"{path}: {where}: expected {len(xy)} numbers of confidence, got {confidence.dtype} "
            f"of {confidence.shape}."
        )
    scale = _number(path, where, attributes, "conversion", 1.0)
    if not scale > 0:
        raise InputError(f"{path}: {where}: expected a positive conversion, got {scale:g}.")
    agent, part = name
    return _Series(
        agent=agent,
        part=part,
        unit=UNITS[unit],
        xy=xy * scale + _number(path, where, attributes, "offset", 0.0),
        confidence=confidence,
        clock=clock,
    )


def _number(
    path: Path, where: str, attributes: Mapping[str, Any], name: str, default: float
) -> float:
    """Return a finite number that an attribute holds, or the default."""
    stored = attributes.get(name, default)
    # An attribute without a value, as HDF5 may have it, is no array of numbers either.
    found = np.asarray(stored)
    if found.shape != () or found.dtype.kind not in "iuf" or not np.isfinite(found):
        raise InputError(f"{path}: {where}: expected a number as {name}, got {stored}.")
    return float(found)


def _clock(path: Path, node: Any, where: str, n_samples: int, *, by_sleap: bool) -> Clock:
    """Return the times of the samples, or their rate where that is what the file has."""
    clock = Clock(
        where=where,
        start_s=np.nan,
        n_samples=n_samples,
        time_s=None,
        rate_hz=None,
        by_sleap=by_sleap,
    )
    if not n_samples:
        return clock
    if "timestamps" in node:
        time_s = dataset(node, "timestamps", path)
        numeric = time_s.dtype.kind in "iuf" and time_s.shape == (n_samples,)
        # Differences of whole numbers without sign would always be positive.
        time_s = time_s.astype(np.float64) if numeric else time_s
        if not (numeric and np.isfinite(time_s).all() and (np.diff(time_s) > 0).all()):
            raise InputError(f"{path}: {where}: expected {n_samples} timestamps that advance.")
        return replace(clock, start_s=float(time_s[0]), time_s=time_s)
    start = dataset(node, "starting_time", path)
    rate_hz = _number(path, where, node["starting_time"].attrs, "rate", 0.0)
    startable = start.shape == () and start.dtype.kind in "iuf" and np.isfinite(start)
    if not (startable and (rate_hz > 0 or (rate_hz == 0 and by_sleap))):
        raise InputError(
            f"{path}: {where}: expected a starting_time with a positive rate, got {start} and "
            f"{rate_hz:g}."
        )
    return replace(clock, start_s=float(start), rate_hz=rate_hz)

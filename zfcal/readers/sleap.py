"""Tracks of SLEAP: its analysis HDF5 file, and its labels.

Labels, ``.slp``, are read by sleap-io: see `zfcal.readers.slp`.

SLEAP (``sleap/info/write_tracking_h5.py``) writes its arrays transposed, for
MATLAB: ``tracks`` is (track, xy, node, frame) and ``point_scores`` (track, node,
frame), NaN where nothing was found; ``track_names`` and ``node_names`` are texts.
sleap-io (``sleap_io/io/analysis_h5.py``) may write another order and then says so
in the attribute ``dims``, a JSON list of the words frame, track, node, xy. Frames
count from the start of the video, unless the file was written without all frames.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Floats
from zfcal.errors import InputError
from zfcal.readers.assemble import Imported, assemble
from zfcal.readers.extras import dataset, open_hdf5, texts
from zfcal.readers.options import ImportOptions
from zfcal.readers.poses import Poses, choose
from zfcal.readers.slp import labelled

_MATLAB = ("track", "xy", "node", "frame")

_OURS = ("frame", "track", "node", "xy")


def read_sleap(path: Path, options: ImportOptions) -> Imported:
    """Read a SLEAP analysis file or labels, in pixels.

    Parameters
    ----------
    path
        ``.analysis.h5``, or ``.slp``.
    options
        Needs ``m_per_px``, and ``keypoint`` when there are several nodes.
    """
    if path.suffix.lower() == ".slp":
        poses, warnings = labelled(path, options)
    else:
        poses, warnings = _analysed(path, options), ()
    imported = assemble(path, choose(path, poses, options).rows(), options)
    return replace(imported, warnings=warnings)


def _analysed(path: Path, options: ImportOptions) -> Poses:
    with open_hdf5(path) as file:
        order = _order(path, file)
        position = _arranged(path, dataset(file, "tracks", path), order)
        score = None
        if "point_scores" in file:
            scores = dataset(file, "point_scores", path)
            score = _arranged(path, scores, tuple(word for word in order if word != "xy"))
        keypoints = texts(dataset(file, "node_names", path))
        agents = texts(dataset(file, "track_names", path)) if "track_names" in file else ()
    n_frames, n_tracks, n_nodes, n_space = position.shape
    if n_space != 2 or n_nodes != len(keypoints) or len(agents) not in {0, n_tracks}:
        raise InputError(
            f"{path}: expected tracks of shape (track, 2, node, frame) with {len(keypoints)} nodes "
            f"and {len(agents)} tracks, got {n_tracks} tracks, {n_space} coordinates, "
            f"{n_nodes} nodes, {n_frames} frames."
        )
    frame = np.arange(n_frames)
    return Poses(
        position=position,
        score=score if score is None or score.shape == position.shape[:3] else None,
        frame=frame,
        time_s=frame / options.fps,
        agents=agents,
        keypoints=keypoints,
    )


def _order(path: Path, file: Any) -> tuple[str, ...]:
    """Return what the axes of ``tracks`` stand for."""
    if "tracks" not in file or "dims" not in file["tracks"].attrs:
        return _MATLAB
    words = tuple(json.loads(file["tracks"].attrs["dims"]))
    if sorted(words) != sorted(_MATLAB):
        raise InputError(
            f"{path}: expected dims of {', '.join(_MATLAB)}, got {', '.join(map(str, words))}."
        )
    return words


def _arranged(path: Path, stored: NDArray[Any], order: tuple[str, ...]) -> Floats:
    """Return an array with its axes in the order frame, track, node, xy."""
    if stored.ndim != len(order):
        raise InputError(
            f"{path}: expected an array of ({', '.join(order)}), got one of shape {stored.shape}."
        )
    axes = [order.index(word) for word in _OURS if word in order]
    return np.asarray(np.transpose(stored, axes), dtype=np.float64)

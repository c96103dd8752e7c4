"""Tracks as an analysis file of SLEAP: ``tracks.analysis.h5``, in pixels.

Mirror of `zfcal.readers.sleap`: arrays transposed for MATLAB, with one node, and the words of
sleap-io on the order of axes. Confidence is the score of the point and of the instance.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from zfcal.writers.extras import require
from zfcal.writers.source import BODY, Files, Source


def sleap_files(source: Source) -> Files:
    """Return the one file.

    Raises
    ------
    InputError
        h5py is not installed.
    """
    h5py = require("h5py", "sleap")

    def write(path: Path) -> None:
        with path.open("w+b") as raw, h5py.File(raw, "w") as file:
            _fill(file, source)

    return {"tracks.analysis.h5": write}


def _fill(file: Any, source: Source) -> None:
    found = source.dense
    score = found.confidence.T
    arrays = {
        "tracks": (source.xy.transpose(1, 2, 0)[:, :, np.newaxis], "track xy node frame"),
        "track_occupancy": (~np.isnan(found.xy_m[..., 0]), "frame track"),
        "point_scores": (score[:, np.newaxis], "track node frame"),
        "instance_scores": (score, "track frame"),
        "tracking_scores": (score, "track frame"),
    }
    for name, (values, dims) in arrays.items():
        stored = values.astype(np.uint8) if values.dtype == np.bool_ else values
        made = file.create_dataset(name, data=stored, compression="gzip")
        made.attrs["dims"] = json.dumps(dims.split())
    file["track_names"] = np.array([name.encode() for name in found.names])
    file["node_names"] = np.array([BODY.encode()])
    file["edge_names"] = np.empty((0, 2), dtype="S1")
    file["edge_inds"] = np.empty((0, 2), dtype=np.int64)
    file["labels_path"] = ""
    # Nobody knows its name here, but sleap-io saves no labels (.slp) of a video that has none.
    file["video_path"] = "tracks.mp4"
    file["video_ind"] = 0
    file["provenance"] = json.dumps({"source": "zfcal", "fps": found.fps})
    file.attrs["preset"] = "matlab"
    file.attrs["format"] = "analysis"

"""Tracks as a poses data set of movement: ``tracks.nc``, netCDF-4.

Mirror of `zfcal.readers.movement`. Dimensions have the names of movement up to 0.16
(``keypoints``, ``individuals``). The unit stands in ``space_unit`` of the positions, as movement
writes it, and the sense of y in ``y_axis``, which movement hands on. Headings are a variable of
their own, ``heading_rad``, which movement hands on too.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from zfcal.writers.extras import require
from zfcal.writers.source import BODY, Files, Source

_PACKED = {"zlib": True, "complevel": 4}


def movement_files(source: Source) -> Files:
    """Return the one file.

    Raises
    ------
    InputError
        xarray or h5netcdf is not installed.
    """
    xarray = require("xarray", "movement")
    require("h5netcdf", "movement")

    def write(path: Path) -> None:
        data = _dataset(xarray, source)
        packed = dict.fromkeys(data.data_vars, _PACKED)
        with path.open("w+b") as file:
            data.to_netcdf(file, engine="h5netcdf", encoding=packed)

    return {"tracks.nc": write}


def _dataset(xarray: Any, source: Source) -> Any:
    found, axes = source.dense, source.axes
    keyed = ("time", "keypoints", "individuals")
    told = {"space_unit": axes.unit, "y_axis": "down" if axes.y_down else "up"}
    heading = np.where(axes.y_down, -found.heading_rad, found.heading_rad)
    says = "Counter-clockwise from x" if not axes.y_down else "From x towards y"
    return xarray.Dataset(
        {
            "position": (
                ("time", "space", *keyed[1:]),
                source.xy.transpose(0, 2, 1)[:, :, np.newaxis],
                told,
            ),
            "confidence": (keyed, found.confidence[:, np.newaxis]),
            "heading_rad": (("time", "individuals"), heading, {"units": "rad", "long_name": says}),
        },
        coords={
            "time": found.time_s if found.times_tell_frames else found.frame / found.fps,
            "space": ["x", "y"],
            "keypoints": [BODY],
            "individuals": list(found.names),
        },
        attrs={
            "fps": found.fps,
            "time_unit": "seconds",
            "ds_type": "poses",
            "source_software": "zfcal",
        },
    )

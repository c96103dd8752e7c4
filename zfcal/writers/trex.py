"""Tracks as TRex writes them: a ``.npz`` file for each individual, in centimetres.

Mirror of `zfcal.readers.trex`, which says what the arrays are. A file goes from the first frame
of its individual to the last; between them ``missing`` is 1 where it was not seen. Numbers
have double precision.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np

from zfcal.tracks import KINDS
from zfcal.units import M_PER_CM
from zfcal.writers.axes import Image
from zfcal.writers.source import Files, Source


def trex_files(source: Source, image: Image) -> Files:
    """Return the files of all individuals, ``tracks_fish0.npz`` and so on.

    Parameters
    ----------
    source
        In centimetres.
    image
        Its scale is that of TRex, ``cm_per_pixel``.
    """
    cm_per_px = image.axes("px").m_per_unit / M_PER_CM
    agents = zip(source.dense.kind, source.dense.agent, strict=True)
    return {
        f"tracks_{KINDS[kind]}{agent}.npz": partial(_write, source, column, cm_per_px)
        for column, (kind, agent) in enumerate(agents)
    }


def _write(source: Source, column: int, cm_per_px: float, path: Path) -> None:
    found = source.dense
    seen = ~np.isnan(found.xy_m[:, column, 0])
    known = np.flatnonzero(seen)
    part = slice(int(known[0]), int(known[-1]) + 1)
    lost = ~seen[part]
    x_cm, y_cm = np.where(lost, np.inf, source.axes.place(found.xy_m[part, column]).T)
    columns = {
        "frame": found.frame[part],
        "time": found.time_s[part],
        "missing": lost.astype(np.float64),
        "X#wcentroid": x_cm,
        "Y#wcentroid": y_cm,
        "cm_per_pixel": np.array([cm_per_px]),
        "frame_rate": np.array([found.fps]),
        "id": np.array([found.agent[column]]),
    }
    # Through a file object: numpy adds an ending to a name.
    with path.open("wb") as file:
        np.savez_compressed(file, allow_pickle=False, **columns)

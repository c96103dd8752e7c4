"""Tracks as idtracker.ai stores them: ``trajectories.npy``, a dictionary in pixels.

Mirror of `zfcal.readers.idtracker`. ``id_probabilities`` of a guess are NaN, as idtracker.ai has
it for animals that it placed by an estimate; ``length_unit`` is pixels per centimetre.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from zfcal.tracks import GUESS, KINDS
from zfcal.units import M_PER_CM
from zfcal.writers.source import Files, Source


def idtracker_files(source: Source) -> Files:
    """Return the one file, as ``numpy.save`` writes a dictionary."""

    def write(path: Path) -> None:
        with path.open("wb") as file:
            np.save(file, np.array(_dictionary(source), dtype=object), allow_pickle=True)

    return {"trajectories.npy": write}


def _dictionary(source: Source) -> dict[str, Any]:
    found = source.dense
    sure = np.where(found.confidence < GUESS, np.nan, found.confidence)
    return {
        "trajectories": source.xy,
        "id_probabilities": sure,
        "frames_per_second": found.fps,
        "identities_labels": list(found.names),
        # idtracker.ai counts its animals from 1.
        "identities_groups": {
            name: [int(column) + 1 for column in np.flatnonzero(found.kind == kind)]
            for kind, name in enumerate(KINDS)
        },
        "length_unit": M_PER_CM / source.axes.m_per_unit,
    }

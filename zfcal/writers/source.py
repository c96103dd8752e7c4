"""What is written into another program's file, and how a file is written."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

from zfcal.arrays import Floats
from zfcal.writers.axes import Axes
from zfcal.writers.dense import Dense

BODY = "centroid"
"""What files with body parts call the one that tracks have."""

Write: TypeAlias = Callable[[Path], None]
"""Writes a file to a path whose ending says nothing about the format."""

Files: TypeAlias = Mapping[str, Write]
"""By name, how each file of an export is written."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Source:
    """Tracks, and the axes that they are to have.

    Parameters
    ----------
    dense
        Every agent in every frame.
    axes
        Of the file.
    """

    dense: Dense
    axes: Axes

    @property
    def xy(self) -> Floats:
        """Positions in the file's unit and axes, shape (frame, agent, 2)."""
        return self.axes.place(self.dense.xy_m)

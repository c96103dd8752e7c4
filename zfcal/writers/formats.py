"""The formats that tracks are exported in, and what each of them holds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from zfcal.errors import InputError
from zfcal.writers.axes import METRES, Axes, Image
from zfcal.writers.deeplabcut import deeplabcut_files
from zfcal.writers.dense import Dense
from zfcal.writers.idtracker import idtracker_files
from zfcal.writers.movement import movement_files
from zfcal.writers.sleap import sleap_files
from zfcal.writers.source import Files, Source
from zfcal.writers.trex import trex_files


@dataclass(frozen=True, slots=True, kw_only=True)
class Format:
    """A foreign format; what its files hold stands in ``docs/formats.md``.

    Parameters
    ----------
    name
        As in ``--to``, and in ``--format`` of the import.
    files
        Returns how its files are written.
    unit
        ``px`` or ``cm``; ``m`` for a format that has metres unless a scale is asked for.
    holds
        What it has a place for; see `zfcal.writers.losses.lost`.
    reads
        The file that `zfcal import` is given, or empty for the folder with all of them.
    """

    name: str
    files: Callable[[Source, Image], Files]
    unit: str
    holds: frozenset[str]
    reads: str

    def axes(self, image: Image, *, scaled: bool) -> Axes:
        """Return the axes of its file.

        Parameters
        ----------
        image
            How the tank lies in an image.
        scaled
            Whether a person asks for pixels.
        """
        if self.unit == "m":
            return image.axes("px") if scaled else METRES
        return image.axes(self.unit)


_ALL = (
    Format(
        name="trex",
        files=trex_files,
        unit="cm",
        holds=frozenset({"rate", "times"}),
        reads="",
    ),
    Format(
        name="idtracker",
        files=lambda source, _: idtracker_files(source),
        unit="px",
        holds=frozenset({"rate", "certainty"}),
        reads="trajectories.npy",
    ),
    Format(
        name="movement",
        files=lambda source, _: movement_files(source),
        unit="m",
        holds=frozenset({"rate", "times", "confidence", "headings"}),
        reads="tracks.nc",
    ),
    Format(
        name="deeplabcut",
        files=lambda source, _: deeplabcut_files(source),
        unit="px",
        holds=frozenset({"confidence"}),
        reads="tracksDLC_zfcal.h5",
    ),
    Format(
        name="sleap",
        files=lambda source, _: sleap_files(source),
        unit="px",
        holds=frozenset({"confidence"}),
        reads="tracks.analysis.h5",
    ),
)

FORMATS: dict[str, Format] = {known.name: known for known in _ALL}
"""Formats of tracks by the name that ``--to`` takes."""

TABLES = ("csv", "parquet")
"""Formats of tables: tracks, and what was made of them."""


def export_files(name: str, dense: Dense, axes: Axes, image: Image) -> Files:
    """Return how the files of an export are written.

    Parameters
    ----------
    name
        A key of `FORMATS`.
    dense
        The tracks.
    axes
        Of the files; see `Format.axes`.
    image
        How the tank lies in an image.

    Raises
    ------
    InputError
        There is no such format, or a package that it needs is not installed.
    """
    if name not in FORMATS:
        raise InputError(f"Format {name!r} is unknown, expected one of {', '.join(FORMATS)}.")
    return FORMATS[name].files(Source(dense=dense, axes=axes), image)

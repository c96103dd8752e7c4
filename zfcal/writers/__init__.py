"""Tracks for other programs: writers only, one file per format, mirror of `zfcal.readers`."""

from zfcal.writers.axes import METRES, Axes, Image, image_of_import
from zfcal.writers.dense import Dense, dense
from zfcal.writers.formats import FORMATS, TABLES, Format, export_files
from zfcal.writers.losses import lost, lost_noise

__all__ = [
    "FORMATS",
    "METRES",
    "TABLES",
    "Axes",
    "Dense",
    "Format",
    "Image",
    "dense",
    "export_files",
    "image_of_import",
    "lost",
    "lost_noise",
]

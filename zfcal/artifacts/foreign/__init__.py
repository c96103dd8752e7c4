"""Tracks that other programs made: readers only, one file per format."""

from zfcal.artifacts.foreign.assemble import Imported
from zfcal.artifacts.foreign.formats import FORMATS, Format, import_foreign, read_foreign
from zfcal.artifacts.foreign.guess import guess_format
from zfcal.artifacts.foreign.options import ImportOptions

__all__ = [
    "FORMATS",
    "Format",
    "ImportOptions",
    "Imported",
    "guess_format",
    "import_foreign",
    "read_foreign",
]

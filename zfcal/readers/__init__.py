"""Tracks that other programs made: readers only, one file per format."""

from zfcal.readers.assemble import Imported
from zfcal.readers.formats import FORMATS, Format, import_foreign, read_foreign
from zfcal.readers.guess import guess_format
from zfcal.readers.options import ImportOptions

__all__ = [
    "FORMATS",
    "Format",
    "ImportOptions",
    "Imported",
    "guess_format",
    "import_foreign",
    "read_foreign",
]

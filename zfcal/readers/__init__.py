"""Tracks that other programs made: readers only, one file per format."""

from zfcal.readers.assemble import Imported
from zfcal.readers.formats import (
    FORMATS,
    Format,
    check_part,
    import_foreign,
    import_part,
    read_foreign,
)
from zfcal.readers.guess import guess_format
from zfcal.readers.options import ImportOptions, refuse_idle

__all__ = [
    "FORMATS",
    "Format",
    "ImportOptions",
    "Imported",
    "check_part",
    "guess_format",
    "import_foreign",
    "import_part",
    "read_foreign",
    "refuse_idle",
]
